"""The assumptions of the theorem that do not hold along a run, in words.

Two kinds of them. What acts as a torque that nothing models, or as an energy that is measured, is covered by
Theorem A: it bounds the coupled velocity errors, see docs/theorem_a.md. Of the rest no theorem says anything.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..simulation.plant import Plant
from .delay_condition import DelayCondition
from .gain_condition import GainCondition
from .jumps import desired_jumps, jumps_at_messages
from .lyapunov import Lyapunov, outside
from .replay import Replay

#: powers of which Theorem A says nothing, and which have reasons with words of their own below
UNBOUNDED = ("law", "weight rate", "damped inverse")


class Broken(NamedTuple):
    """Assumptions that do not hold, each with what was found.

    Attributes:
        bounded: those that Theorem A covers.
        unbounded: the others.
    """

    bounded: tuple[str, ...]
    unbounded: tuple[str, ...]


def broken(run: Replay, record: Lyapunov, condition: GainCondition, heard: DelayCondition | None) -> Broken:
    """Which assumptions do not hold along a run.

    Args:
        run: instants of the run.
        record: V and V'.
        condition: the gain condition.
        heard: of robots that hear each other late, which theorem covers the run.
    """
    acting = {name: _in_words(run, record, name) for name in _acting(run, record, heard)}
    bounded = [*_held(run), *_devices(run), *_told(run, heard)]
    bounded += [words for name, words in acting.items() if name not in UNBOUNDED]
    beyond = [words for name, words in acting.items() if name == "law"]
    return Broken(tuple(bounded), (*unbounded(run, condition), *beyond))


def unbounded(run: Replay, condition: GainCondition) -> tuple[str, ...]:
    """Why Theorem A says nothing of a run; empty if it does.

    Args:
        run, condition: as of `broken`.
    """
    found = [*_ended(run), *_events(run), *_desired_jumps(run), *_law(run), *_damped(run)]
    return (*found, *_gains(run, condition), *_undamped(run), *getattr(run.loop.chain, "outside", ()))


def covers(heard: DelayCondition | None, term: str) -> bool:
    """Whether a term of V' is what a theorem for networks covers; V may grow by it and is not its storage."""
    return term == "network" and heard is not None and heard.theorem is not None


def proven(run: Replay) -> bool:
    """Whether a proof is known for the law, and the network is one that its theorem knows."""
    return not _law(run) and outside(run.loop.controller.network) is None


# -- covered by Theorem A ----------------------------------------------------------------------------------


def _held(run: Replay) -> list[str]:
    period = run.result.info.get("control_period")
    return [] if period is None else [f"torque and adaptation are held for {period:g} s at a time"]


def _devices(run: Replay) -> list[str]:
    """Sensors and actuators between robots and controller, in words."""
    settings = run.loop.devices.settings
    named = {role: ", ".join(part["name"] for part in parts) for role, parts in settings.items()}
    words = {"sensors": "the controller knows the motion by", "actuators": "its torque acts through"}
    return [f"{words[role]} {role}: {names}" for role, names in named.items()]


def _told(run: Replay, heard: DelayCondition | None) -> list[str]:
    """The network, where no proof is known for it."""
    controller = run.loop.controller
    words = outside(controller.network) if heard is None else heard.reason
    return [] if words is None else [f"the network {controller.network_settings['name']}: {words}"]


def _acting(run: Replay, record: Lyapunov, heard: DelayCondition | None) -> list[str]:
    """Names of the powers that the theorem does not know and that are more than rounding."""
    found = []
    for name in (name for name in record.power if name not in record.inside):
        power = record.power[name]
        only_takes = power.max() <= record.rounding.max()  # at rest nothing that cancels shows in the bound
        harmless = only_takes and (name == "fixtures" or (name in run.learning and name not in _WORDS))
        if not harmless and not covers(heard, name) and (np.abs(power) > record.rounding).any():
            found.append(name)
    return found


def _in_words(run: Replay, record: Lyapunov, name: str) -> str:
    """A power that the theorem does not know, with the plant that it comes from if that is a special one."""
    plant, power = type(run.loop.plant), record.power[name]
    special = name == "other" and plant is not Plant
    words = _WORDS.get(name, f"the adaptation's {name}")
    words += f", of the plant {plant.__qualname__}" if special else ""
    return f"{words}: power from {power.min():.3g} to {power.max():.3g} W"


_WORDS = {
    "law": "the force of a law without a proof",
    "network": "what the network keeps robots from knowing",
    "diffusion": "power of diffusive coupling, whose storage is not in V",
    "friction": "friction that the model does not contain",
    "disturbance": "torque from outside",
    "saturation": "torque that saturation takes away, for which no adaptation makes up while it lasts",
    "model error": "parameters that are wrong and not adapted",
    "fixtures": "fixtures that give, of which the theorem is to the first order",
    "object": "an object that does not move as the hands do",
    "other": "forces that the model does not contain",
}


# -- of which nothing is said ------------------------------------------------------------------------------


def _ended(run: Replay) -> list[str]:
    return [] if run.result.status == "completed" else [f"the run {run.result.status}"]


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


def _desired_jumps(run: Replay) -> list[str]:
    cell = run.loop.cell
    return [
        f"the desired {what} of {cell.names[i]} jumps by {size:.3g} at t = {time:g} s: V jumps there"
        for i, what, size, time in desired_jumps(cell, float(run.result.t[-1]))
    ]


def _law(run: Replay) -> list[str]:
    controller = run.loop.controller
    if hasattr(controller.law, "proof"):
        return []
    return [f"the law {controller.law_settings['name']}: it has no energies, and no proof is known"]


def _damped(run: Replay) -> list[str]:
    """Damped inverse kinematics at work: J s_q is not c^-1 r then, and s_q -> 0 does not give r -> 0.

    The power of it says too little: with K_eps = 0 it is zero by construction.
    """
    x = run.rows
    if not (x.inverse_damping > 0).any():
        return []
    apart = np.abs(np.matvec(x.c_inv, x.r) - np.matvec(x.J, x.s_q)).max(axis=-1)
    i = int(apart.max(axis=0).argmax())
    return [
        "damped inverse kinematics do not follow the reference: J s_q and c^-1 r are up to "
        f"{apart.max():.3g} apart ({run.loop.cell.names[i]})"
    ]


def _gains(run: Replay, condition: GainCondition) -> list[str]:
    if not condition.needed or condition.holds:
        return []
    return [f"the gain condition fails: {run.loop.cell.names[condition.robot]} {condition.in_words()}"]


def _undamped(run: Replay) -> list[str]:
    """Motions in a null space, which damping in task space does not reach."""
    controller, cell = run.loop.controller, run.loop.cell
    if controller.k_r_space == "joint":
        return []
    free = [name for name, robot in zip(cell.names, cell.robots, strict=True) if robot.nv > cell.m]
    return [f"K_r in task space leaves motions of {name} in its null space undamped" for name in free]
