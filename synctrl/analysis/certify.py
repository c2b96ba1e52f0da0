"""Certify: everything the theory says about one run, in one object."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .assumptions import broken, covers, proven
from .consistency import Consistency, physical_consistency
from .convergence import Convergence, convergence
from .delay_condition import DelayCondition, delay_condition
from .dissipation import Dissipation, balanced
from .gain_condition import GainCondition, gain_condition
from .growth import Growth, first_growth
from .in_words import InWords, units_in_words
from .lyapunov import RESOLVED, Lyapunov, lyapunov
from .metrics import finite_or_none
from .replay import Replay, replay

VERDICTS = ("covered by the theorem", "bounded by Theorem A", "outside the theorem")
#: what makes V grow under sampled control where no power of the law does
SAMPLING = "sampling"
#: what each verdict says, in a sentence
MEANINGS = (
    "along this run the proof's inequality held and nothing outside the theorem acted; it does not say that "
    "errors are small",
    "something outside the theorem acted; Theorem A bounds what it can do to velocity and synchronization "
    "errors in the mean; it does not say that they go to zero",
    "nothing is promised of this run, for one of the reasons named",
)


@dataclass(frozen=True, eq=False, repr=False)
class Certificate(InWords):
    """What the proof of convergence says about one run.

    Attributes:
        title: of the run.
        verdict: one of `VERDICTS`. "covered by the theorem": nothing outside the theorem acted along the run,
            V' <= 0 to rounding at every logged instant, and the balance of V closes. "bounded by Theorem A":
            what acted outside are torques that nothing models, or energies that are measured. "outside the
            theorem": something else acted, or there are doubts.
        outside: the assumptions that do not hold, each with what was found.
        unbounded: those among them of which Theorem A says nothing either.
        doubts: what speaks against the run itself: its balance does not close or is too coarse to tell, V
            grows although every assumption holds, or the log is thinned.
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
        dissipation: what unmodelled torque did, beside the most that it can do by Theorem A.
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
    unbounded: tuple[str, ...] = ()
    dissipation: Dissipation | None = None

    @property
    def certified(self) -> bool:
        """Whether the verdict is "covered by the theorem"."""
        return self.verdict == VERDICTS[0]

    @property
    def meaning(self) -> str:
        """What the verdict says, and what it does not, in a sentence."""
        return MEANINGS[VERDICTS.index(self.verdict)]

    @property
    def closes(self) -> bool | None:
        """Whether the balance of V closes; None if the log is thinned, or torque is held."""
        return None if self.every > 1 or self._held else self.lyapunov.closes

    @property
    def _held(self) -> bool:
        return self.dissipation is not None and SAMPLING in self.dissipation.sources

    def as_dict(self) -> dict[str, Any]:
        """The same as plain numbers, words and lists, without the arrays over time."""
        record, condition = self.lyapunov, asdict(self.gain_condition)
        condition = {k: finite_or_none(v) if isinstance(v, float) else v for k, v in condition.items()}
        return {
            "title": self.title,
            "verdict": self.verdict,
            "meaning": self.meaning,
            "outside": list(self.outside),
            "unbounded": list(self.unbounded),
            "doubts": list(self.doubts),
            "growth": None if self.growth is None else asdict(self.growth),
            "V": _ends(record.V) | {name: _ends(term) for name, term in record.energy.items()},
            "V_dot": {"largest": float(record.V_dot.max()), "rounding": float(record.rounding.max())},
            "energy": {name: float(value) for name, value in record.supplied.items()},
            "balance": {
                "closes": self.closes,
                "drift": record.largest_drift,
                "bound": record.drift_bound,
                "jumped": record.jumped,
            },
            "dissipation": None if self.dissipation is None else self.dissipation.as_dict(),
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
        units = {name: units_in_words(unit) for name, unit in errors.units.items()}
        final = ", ".join(f"{name} {x:.3g} {units[name]}" for name, x in errors.final.items())
        lines = [
            f"{self.title}: {self.verdict}",
            f"  that is: {self.meaning}",
            *(f"  outside: {text}" for text in self.outside),
            *(f"  doubt: {text}" for text in self.doubts),
            f"  V goes from {record.V[0]:.5g} to {record.V[-1]:.5g} N·m",
            f"  by term: {f'{supplied} N·m' if supplied else 'no change'}",
            f"  V' is at most {record.V_dot.max():.3g} W (rounding {record.rounding.max():.1g})",
            f"  balance: {_balance(self)}",
            *([] if self.dissipation is None else [f"  {line}" for line in self.dissipation.lines]),
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
    growth, heard = _growth(run, record), delay_condition(run)
    found = broken(run, record, condition, heard)
    excused = any(found) or (growth is not None and covers(heard, growth.term))
    known = proven(run) and heard is None
    doubts = tuple(_doubts(run, record, errors, None if excused else growth, known))
    verdict = VERDICTS[2 if doubts or found.unbounded else 1 if found.bounded else 0]
    return Certificate(
        str(run.result.info["title"]), verdict, found.bounded + found.unbounded, doubts, growth, record,
        condition, errors, _every(run.result), _consistency(run),
        getattr(run.loop.controller.law, "statement", None), getattr(run.loop.chain, "theorem", None), heard,
        found.unbounded, balanced(run, found.unbounded),
    )  # fmt: skip


def _growth(run: Replay, record: Lyapunov) -> Growth | None:
    """The first growth of V; where V' of the law does not explain it, what samples do does."""
    growth, held = first_growth(record), run.result.info.get("control_period") is not None
    return replace(growth, term=SAMPLING) if held and growth and growth.term == "integration" else growth


def _consistency(run: Replay) -> Consistency | None:
    """Whether estimates are those of bodies, or None if they are not meant to be."""
    with suppress(InputError):
        return physical_consistency(run.result, run.experiment)
    return None


def _every(result: Result) -> int:
    """How many steps lie between two logged instants."""
    dt = result.info.get("dt")
    return max(1, round(float(np.diff(result.t).max(initial=0.0)) / dt)) if dt else 1


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
    elif not record.resolved and not sampled:
        found.append(
            f"numerical errors of {record.drift_bound:.3g} may hide in the balance of V, expected at most "
            f"{RESOLVED:g} of the {np.ptp(record.V):.3g} by which V changes; the step is too long to tell"
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
    if c.every > 1:
        return f"cannot be seen in a log of one of {c.every} steps"
    record, a = c.lyapunov, c.dissipation
    if c._held and a is not None:
        off = f"off by {record.largest_drift:.2g}, as V' is that of nothing held"
        return f"{off}; with what is held, by {float(np.abs(a.gap).max()):.2g} N·m"
    return f"off by {record.largest_drift:.2g}, numerical errors explain {record.drift_bound:.2g} N·m"


def _state(condition: GainCondition) -> str:
    margin = f"margin {condition.margin:.4g}"
    if not condition.needed:
        return f"not needed with the exact reference acceleration ({margin})"
    return f"{'holds' if condition.holds else 'fails'}, {margin}"
