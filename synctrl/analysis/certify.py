"""Certify: everything the theory says about one run, in one object."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..simulation.plant import Plant
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .consistency import Consistency, physical_consistency
from .convergence import Convergence, convergence
from .delay_condition import DelayCondition, delay_condition
from .gain_condition import GainCondition, gain_condition
from .jumps import jumps_at_messages
from .lyapunov import Growth, Lyapunov, first_growth, lyapunov, outside
from .metrics import finite_or_none
from .replay import Replay, replay

VERDICTS = ("certified", "outside the theorem", "not certified")


@dataclass(frozen=True, eq=False)
class Certificate:
    """What the proof of convergence says about one run.

    Attributes:
        title: of the run.
        verdict: "certified": every assumption of the theorem holds along the run, V' <= 0 to rounding at
            every logged instant, and the balance of V closes. "outside the theorem": some assumption does not
            hold, and nothing else is wrong. "not certified": V grows although every assumption holds, or the
            run is not accurate enough to tell, or its log is thinned.
        outside: the assumptions that do not hold, each with what was found.
        doubts: what speaks against the run itself.
        growth: the first instant at which V grows, and the term that did it, or None.
        lyapunov: V and V' with their terms.
        gain_condition: where the gain condition is tightest; it matters only if `gain_condition.needed`.
        convergence: errors at the end.
        consistency: whether the estimates are those of bodies that can exist, which the theorem does not
            need; None where what is adapted are not the parameters of bodies.
        statement: when the law converges, in words; None if it does not say.
        theorem: of robots that hold one object together, which theorem covers the run, in words; else None.
        delay_condition: of robots that hear each other late, which theorem covers the run, with its margin;
            else None.
        every: steps of the run per logged instant. With more than one the log is thinned: what V did between
            two instants, and whether its balance closes, cannot be seen.
    """

    title: str
    verdict: str
    outside: tuple[str, ...]
    doubts: tuple[str, ...]
    growth: Growth | None
    lyapunov: Lyapunov
    gain_condition: GainCondition
    convergence: Convergence
    every: int = 1
    consistency: Consistency | None = None
    statement: str | None = None
    theorem: str | None = None
    delay_condition: DelayCondition | None = None

    @property
    def certified(self) -> bool:
        """Whether the verdict is "certified"."""
        return self.verdict == "certified"

    @property
    def closes(self) -> bool | None:
        """Whether the balance of V closes; None if the log is thinned."""
        return self.lyapunov.closes if self.every == 1 else None

    def as_dict(self) -> dict[str, Any]:
        """The same as plain numbers, words and lists, without the arrays over time."""
        record, condition = self.lyapunov, asdict(self.gain_condition)
        condition = {k: finite_or_none(v) if isinstance(v, float) else v for k, v in condition.items()}
        return {
            "title": self.title,
            "verdict": self.verdict,
            "outside": list(self.outside),
            "doubts": list(self.doubts),
            "growth": None if self.growth is None else asdict(self.growth),
            "V": _ends(record.V) | {name: _ends(term) for name, term in record.energy.items()},
            "V_dot": {"largest": float(record.V_dot.max()), "rounding": float(record.rounding.max())},
            "energy": {name: float(value) for name, value in record.supplied.items()},
            "balance": {"closes": self.closes, "drift": record.largest_drift, "bound": record.drift_bound},
            "steps_per_instant": self.every,
            "gain_condition": {**condition, "holds": self.gain_condition.holds},
            "convergence": asdict(self.convergence),
            "consistency": None if self.consistency is None else self.consistency.as_dict(),
            "statement": self.statement,
            "theorem": self.theorem,
            "delay_condition": None if self.delay_condition is None else self.delay_condition.as_dict(),
        }

    def __str__(self) -> str:
        record, errors = self.lyapunov, self.convergence
        acting = [name for name, power in record.power.items() if (np.abs(power) > record.rounding).any()]
        supplied = ", ".join(f"{name} {record.supplied[name]:.3g}" for name in acting)
        final = ", ".join(f"{name} {value:.3g}" for name, value in errors.final.items())
        lines = [
            f"{self.title}: {self.verdict}",
            *(f"  outside: {text}" for text in self.outside),
            *(f"  doubt: {text}" for text in self.doubts),
            f"  V goes from {record.V[0]:.5g} to {record.V[-1]:.5g}",
            f"  by term: {supplied or 'no change'}",
            f"  V' is at most {record.V_dot.max():.3g} (rounding {record.rounding.max():.1g})",
            f"  balance: {_balance(self)}",
            f"  gain condition: {_state(self.gain_condition)}",
            *([] if self.delay_condition is None else [f"  network: {self.delay_condition}"]),
            f"  at the end: {final}",
            f"  estimates: {self.consistency or 'of parameters that are not those of bodies'}",
            f"  w = N e* + S+ epsilon: off by {errors.identity:.1g}",
        ]
        if self.statement is not None:
            apart = "" if self.theorem is None else " of robots that nothing connects"
            lines.append(f"  law{apart}: {self.statement}")
        if self.theorem is not None:
            lines.append(f"  closed chain: {self.theorem}")
        if self.growth is not None:
            lines.append(f"  V first grows at t = {self.growth.time:g} s, by the term '{self.growth.term}'")
        return "\n".join(lines)


def certify(result: Result, experiment: Experiment | None = None) -> Certificate:
    """Check a run against the proof of convergence, at every logged instant.

    Args:
        result: the run.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: no experiment, or another than the one that made the result.
    """
    run = replay(result, experiment)
    record, condition, errors = lyapunov(run), gain_condition(run), convergence(run)
    growth, heard = first_growth(record), delay_condition(run)
    unproven = _unproven(run, heard)
    found = (*_outside(run, record, condition, heard), *unproven)
    excused = found or (growth is not None and _covers(heard, growth.term))
    known = not unproven and heard is None
    doubts = tuple(_doubts(run, record, errors, None if excused else growth, known))
    verdict = VERDICTS[2] if doubts else VERDICTS[1] if found else VERDICTS[0]
    return Certificate(
        str(result.info["title"]), verdict, found, doubts, growth, record, condition, errors, _every(result),
        _consistency(run), getattr(run.loop.controller.law, "statement", None),
        getattr(run.loop.chain, "theorem", None), heard,
    )  # fmt: skip


def _consistency(run: Replay) -> Consistency | None:
    """Whether estimates are those of bodies, or None if they are not meant to be."""
    with suppress(InputError):
        return physical_consistency(run.result, run.experiment)
    return None


def _every(result: Result) -> int:
    """How many steps lie between two logged instants."""
    dt = result.info.get("dt")
    return max(1, round(float(np.diff(result.t).max(initial=0.0)) / dt)) if dt else 1


def _covers(heard: DelayCondition | None, term: str) -> bool:
    """Whether a term of V' is what a theorem for networks covers; V may grow by it and is not its storage."""
    return term == "network" and heard is not None and heard.theorem is not None


def _outside(
    run: Replay, record: Lyapunov, condition: GainCondition, heard: DelayCondition | None
) -> list[str]:
    """Assumptions of the theorem that do not hold along the run."""
    found = []
    if run.result.status != "completed":
        found.append(f"the run {run.result.status}")
    period = run.result.info.get("control_period")
    if period is not None:
        found.append(f"torque and adaptation are held for {period:g} s at a time")
    found += [*_devices(run), *_events(run), *getattr(run.loop.chain, "outside", ())]
    for name in (name for name in record.power if name not in record.inside):
        power = record.power[name]
        only_takes = power.max() <= record.rounding.max()  # at rest nothing that cancels shows in the bound
        if only_takes and (name == "fixtures" or (name in run.learning and name not in _WORDS)):
            continue
        if name != "weight rate" and not _covers(heard, name) and (np.abs(power) > record.rounding).any():
            words = _in_words(run, name)
            found.append(f"{words}: power from {power.min():.3g} to {power.max():.3g}")
    if condition.needed and not condition.holds:
        name = run.loop.cell.names[condition.robot]
        found.append(f"the gain condition fails: {name} {condition.in_words()}")
    return found


def _devices(run: Replay) -> list[str]:
    """Sensors and actuators between robots and controller, in words."""
    settings = run.loop.devices.settings
    named = {role: ", ".join(part["name"] for part in parts) for role, parts in settings.items()}
    words = {"sensors": "the controller knows the motion by", "actuators": "its torque acts through"}
    return [f"{words[role]} {role}: {names}" for role, names in named.items()]


def _events(run: Replay) -> list[str]:
    """What plant and network do to the state at once, in words."""
    if not run.events:
        return []
    loop, t = run.loop, run.result.t[run.events[0] + 1]
    parts = {f"the plant {type(loop.plant).__qualname__}": loop.events.size > 0}
    parts[f"the network {loop.controller.network_settings['name']}"] = jumps_at_messages(loop)
    names = " and ".join(name for name, has_events in parts.items() if has_events)
    share = f"{len(run.events)} of {len(run.result.t) - 1} intervals of the log"
    return [f"events of {names} move the state in {share}, first until t = {t:g} s: V jumps there"]


def _unproven(run: Replay, heard: DelayCondition | None) -> list[str]:
    """Parts of the controller for which no proof is known, by name."""
    controller, found = run.loop.controller, []
    if not hasattr(controller.law, "proof"):
        found.append(f"the law {controller.law_settings['name']}: it has no energies, and no proof is known")
    if (words := outside(controller.network) if heard is None else heard.reason) is not None:
        found.append(f"the network {controller.network_settings['name']}: {words}")
    return found


def _in_words(run: Replay, name: str) -> str:
    """A power that the theorem does not know, with the plant that it comes from if that is a special one."""
    plant = type(run.loop.plant)
    special = name == "other" and plant is not Plant
    return _WORDS.get(name, f"the adaptation's {name}") + (
        f", of the plant {plant.__qualname__}" if special else ""
    )


_WORDS = {
    "law": "the force of a law without a proof",
    "network": "what the network keeps robots from knowing",
    "diffusion": "power of diffusive coupling, whose storage is not in V",
    "friction": "friction that the model does not contain",
    "disturbance": "torque from outside",
    "saturation": "torque that saturation takes away, for which no adaptation makes up while it lasts",
    "model error": "parameters that are wrong and not adapted",
    "damped inverse": "a reference that damped inverse kinematics do not follow",
    "fixtures": "fixtures that give, of which the theorem is to the first order",
    "object": "an object that does not move as the hands do",
    "other": "forces that the model does not contain",
}


def _doubts(
    run: Replay, record: Lyapunov, errors: Convergence, growth: Growth | None, known: bool
) -> list[str]:
    """What should not be even outside the theorem, and growth of V where it has no excuse.

    That w = N e* + S+ epsilon is asked of what is `known`: a law of ours, of robots that hear all at once.
    """
    found = []
    sampled, every = run.result.info.get("control_period") is not None, _every(run.result)
    if every > 1:
        found.append(
            f"the log is thinned, to one of {every} steps: what V did in between, and whether its balance "
            "closes, cannot be seen; certify a run that logs every step"
        )
    elif not record.closes and not sampled:
        found.append(
            f"the balance of V does not close: V - V(0) - integral of V' reaches {record.largest_drift:.3g}, "
            f"numerical errors explain {record.drift_bound:.3g}; the step is too long to follow this motion"
            + _advice(run.result)
        )
    if growth is not None:
        found.append(f"V grows at t = {growth.time:g} s by the term '{growth.term}'")
    if known and not errors.identity_holds:
        found.append(f"w = N e* + S+ epsilon is off by {errors.identity:.3g}")
    return found


def _advice(result: Result) -> str:
    """The step that the run itself advises, in words; nothing if it does not."""
    step = (result.info.get("step_error") or {}).get("advised_step")
    return "" if step is None else f", expected at most dt = {step:g} s"


def _ends(term: np.ndarray) -> dict[str, float]:
    return {"start": float(term[0]), "end": float(term[-1])}


def _balance(c: Certificate) -> str:
    if c.closes is None:
        return f"cannot be seen in a log of one of {c.every} steps"
    record = c.lyapunov
    return f"off by {record.largest_drift:.2g}, numerical errors explain {record.drift_bound:.2g}"


def _state(condition: GainCondition) -> str:
    margin = f"margin {condition.margin:.4g}"
    if not condition.needed:
        return f"not needed with the exact reference acceleration ({margin})"
    return f"{'holds' if condition.holds else 'fails'}, {margin}"
