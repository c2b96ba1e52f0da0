"""What a run left and met: limits of the robots' descriptions, torque that was cut off, and damping.

Of each of these a result has a list in plain data: which robot, which joint, when, and by how much.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..control.adaptation import Adaptation, bounded
from ..control.controller import Signals
from ..control.gains import Gains
from ..coupling.cell import Cell
from ..errors import SaturationWarning, warn
from ..renamed import names_elsewhere
from ..robots.mechanism import joint_limits
from ..robots.model import unit_for
from ..tasks.redundancy import velocity_lost
from .memory import in_parts, row_of
from .plant import Output, Plant

if TYPE_CHECKING:
    from .result import Result

#: the output that has what was left of the torque
APPLIED = "applied_torque"
#: adaptations that keep estimates within bounds, and need no advice
BOUNDED = "Ball", "Box"
#: instants that are looked at side by side
ROWS = 64
#: growth of the estimates that is worth a word, as a share of what they were
GROWN = 0.01


def spans(active: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of True in a row, (T,)."""
    edges = np.flatnonzero(np.diff(active, prepend=False, append=False))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


# -- limits of the descriptions ---------------------------------------------------------------------------


def limit_report(
    cell: Cell, t: np.ndarray, q: np.ndarray, v: np.ndarray, tau: np.ndarray
) -> list[dict[str, Any]]:
    """Intervals in which a joint was outside a limit of its description, in order of their start.

    Args:
        cell: the cell.
        t: logged instants, (T,), s.
        q, v, tau: positions, velocities and torques the controller commanded, (T, n, nv).

    Returns:
        One entry per interval: `robot` and `joint`, counted from 0; `kind`: "position", "velocity" or
        "torque"; `start`, `stop`: its first and last logged instant, s; `limit`: the one that was left; and
        `reached`: what was farthest outside; `unit`: that of both. A torque is what the controller commands:
        with saturation the plant got the limit instead.
    """
    first, last, speed, torque = limits_of_all(cell)
    watched = (
        ("position", "rad", q, first, last),
        ("velocity", "rad/s", v, -speed, speed),
        ("torque", "N·m", tau, -torque, torque),
    )
    found = []
    for kind, turning, values, lower, upper in watched:
        least, most = _extremes(values)
        left = (least < lower) | (most > upper)
        for i, joint in np.argwhere(left).tolist():
            unit = unit_for(turning, cell.robots[i].joint_units[joint])
            about = {"robot": i, "joint": joint, "kind": kind, "unit": unit}
            for entry in _outside(t, row_of(values, i, joint), lower[i, joint], upper[i, joint]):
                found.append({**about, **entry})
    return sorted(found, key=lambda entry: (entry["start"], entry["robot"], entry["joint"], entry["kind"]))


def limits_of_all(cell: Cell) -> np.ndarray:
    """Lower and upper limits of positions, and those of speeds and torques, (4, n, nv); infinite for none."""
    found = np.full((4, cell.n, cell.nv), np.inf)
    found[0] = -np.inf
    for i, robot in enumerate(cell.robots):
        limits = joint_limits(robot)
        found[:, i, : robot.nv] = limits.lower, limits.upper, limits.velocity, limits.torque
    return found


def _extremes(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest number at any instant of an array over time, each (...); NaN where all are."""
    least = np.full(values.shape[1:], np.nan)
    most = least.copy()
    for rows in in_parts(values):
        for part in _in_long_rows(rows):
            least = np.fmin(least, np.fmin.reduce(np.fmin.reduce(part, axis=0), axis=0))
            most = np.fmax(most, np.fmax.reduce(np.fmax.reduce(part, axis=0), axis=0))
    return least, most


def _in_long_rows(rows: np.ndarray) -> Iterator[np.ndarray]:
    """An array over time as `ROWS` instants side by side, (k, ROWS, ...), and what is left, (1, rest, ...).

    NumPy is many times faster if what it compares is long.
    """
    whole = len(rows) // ROWS * ROWS
    if whole:
        yield rows[:whole].reshape(-1, ROWS, *rows.shape[1:])
    if whole < len(rows):
        yield rows[None, whole:]


def _outside(t: np.ndarray, values: np.ndarray, lower: float, upper: float) -> Iterator[dict[str, float]]:
    for limit, excess in ((lower, lower - values), (upper, values - upper)):
        for first, last in spans(excess > 0):
            farthest = first + int(excess[first : last + 1].argmax())
            yield {
                "start": float(t[first]),
                "stop": float(t[last]),
                "limit": float(limit),
                "reached": float(values[farthest]),
            }


# -- torque that was cut off ------------------------------------------------------------------------------


def saturation_report(plant: Plant, arrays: Mapping[str, np.ndarray]) -> list[dict[str, Any]]:
    """Joints whose torque was cut off, in order of robots and joints.

    Args:
        plant: the plant.
        arrays: `tau`, (T, n, nv), N·m, and `theta_hat`, (T, n, P), at the logged instants.

    Returns:
        One entry per joint: `robot` and `joint`, counted from 0; `limit`, in `unit`; `share` of the logged
        instants at which the controller asked for more; `largest`, the largest torque that it asked for at
        these; and `theta_hat`, the largest magnitude of the robot's estimates at the start and over the run.
        A cut between two logged instants is in none.
    """
    if not plant.saturate or not len(arrays["tau"]):
        return []
    tau, estimates, limits = arrays["tau"], arrays["theta_hat"], plant.torque_limits
    share = sum((np.abs(rows) > limits).sum(axis=0) for rows in in_parts(tau)) / len(tau)
    return [
        {
            "robot": int(i),
            "joint": int(joint),
            "limit": float(limits[i, joint]),
            "unit": unit_for("N·m", plant.cell.robots[i].joint_units[joint]),
            "share": float(share[i, joint]),
            "largest": float(np.abs(row_of(tau, i, joint)).max()),
            "theta_hat": [float(np.abs(part).max()) for part in (estimates[0, i], row_of(estimates, i))],
        }
        for i, joint in np.argwhere(share > 0)
    ]


def learning_within(
    plant: Plant, gains: Gains, adaptation: Adaptation | None
) -> tuple[Gains, Adaptation | None]:
    """Gains and adaptation of a controller: (14) is `bounded` where the plant may cut its torque off.

    Args:
        plant: the true cell.
        gains, adaptation: those that are given; an adaptation that is given stays what it is.
    """
    Gamma = gains.Gamma
    if adaptation is not None or Gamma is None or not np.isfinite(plant.torque_limits).any():
        return gains, adaptation
    return gains.replace(Gamma=None), bounded(plant.cell, Gamma, plant.schedule.carried)


def applied_output(plant: Plant, tau: np.ndarray) -> dict[str, Output]:
    """What reached the joints of torques tau, (T, n, nv), N·m, as an output."""
    return {APPLIED: (plant.applied(tau), "N·m", ("time", "robot", "joint"))} if plant.saturate else {}


def applied_torque(result: Result) -> np.ndarray:
    """Torque of the motors at every logged instant, (T, n, nv), N·m.

    It is `result.tau`, what the controller commands; in a run with saturation cut off at the limits, which
    newer results have as the output "applied_torque".
    """
    if APPLIED in result.outputs:
        return result.outputs[APPLIED].copy()
    tau = result.tau.copy()
    for i, robot in enumerate(result.info["robots"]):
        for joint, limit in enumerate(robot.get("torque_limits", ()) if result.info.get("saturate") else ()):
            if limit is not None:
                tau[:, i, joint] = np.clip(tau[:, i, joint], -limit, limit)
    return tau


def warn_of_saturation(result: Result) -> None:
    """Warn whoever called the package of torque that was cut off while the controller went on regardless."""
    found = result.info["saturation"]
    if not found:
        return
    worst = max(found, key=lambda entry: entry["largest"] - entry["limit"])
    warn(
        f"{result.info['title']}: torque was cut off at {len(found)} joints, for up to "
        f"{max(entry['share'] for entry in found):.0%} of the time; {result.names[worst['robot']]}, joint "
        f"{worst['joint'] + 1} asked for {worst['largest']:.3g} {worst['unit']} of its "
        f"{worst['limit']:.3g}. {_meanwhile(result)}{_learned(found)}. See info['saturation'] and "
        f"outputs['{APPLIED}']; lower the gains, or ask for a slower motion{_advice(result)}",
        SaturationWarning,
    )


def _bounds(result: Result) -> str:
    """The adaptation that keeps estimates within bounds, by name; empty if there is none."""
    settings = result.info["adaptation"]
    while isinstance(settings.get("adaptation"), Mapping):  # the one that it slows down, or hedges
        settings = settings["adaptation"]
    name = settings.get("name")
    return name if name in BOUNDED else ""


def _meanwhile(result: Result) -> str:
    """What controllers did while torque was cut off, in words."""
    if result.info["adaptation"].get("name") == "Hedged":
        did = "The desired motion gave way meanwhile, see outputs['hedge'], and little was learned"
    else:
        did = "Estimates and integrals of the synchronization errors went on meanwhile as if it had got it"
    name = _bounds(result)
    return f"{did}, estimates within the bounds of the adaptation {name}" if name else did


def _advice(result: Result) -> str:
    """What keeps estimates within bounds, in words, if nothing does."""
    return "" if _bounds(result) else "; adaptation=Guarded(Ball(...)) keeps estimates within bounds"


def _learned(found: list[dict[str, Any]]) -> str:
    """How far the estimates grew, in words; empty if they hardly did."""
    start, largest = max((entry["theta_hat"] for entry in found), key=lambda pair: pair[1])
    if largest <= (1 + GROWN) * start:
        return ""
    times = f", {largest / start:.3g} times as much" if start > 0 else ""
    return f": the largest entry of theta_hat went from {start:.3g} to {largest:.3g}{times}"


# -- damping ----------------------------------------------------------------------------------------------


#: what is logged of damping, (n,) each: lambda, and the part of xref' that J v_ref leaves out
DAMPING = ("damping", "velocity_lost")


def may_damp(space: Any) -> bool:
    """Whether a space may damp singular configurations: of one of a user's own nobody knows."""
    ours = type(space).__module__.partition(".")[0] == __name__.partition(".")[0]
    return not ours or getattr(space, "damping", None) is not None


def damping_of(signals: Signals) -> tuple[np.ndarray, np.ndarray]:
    """What is logged of damping at one instant, see `DAMPING`."""
    task = signals.task
    if task.J is None or task.inversion is None or task.inversion.damping is None:
        none = np.zeros(len(signals.tau))
        return none, none
    lost = velocity_lost(task.J, signals.v_ref, signals.asked.xref_dot)
    return task.inversion.damping[:, 0], lost[:, 0]


def damping_report(t: np.ndarray, damping: np.ndarray, lost: np.ndarray) -> list[dict[str, Any]]:
    """Intervals in which the damping of a robot was above zero, in order of their start.

    Args:
        t: logged instants, (T,), s.
        damping, lost: see `DAMPING`, (T, n).

    Returns:
        One entry per interval: `robot`, counted from 0; `start`, `stop`, s: first and last instant;
        `largest_damping`: of lambda; `largest_velocity_lost`: of |xref' - J v_ref|, task unit per s.
    """
    damped = np.flatnonzero(_extremes(damping)[1] > 0).tolist()
    found = [
        {
            "robot": robot,
            "start": float(t[first]),
            "stop": float(t[last]),
            "largest_damping": float(size[first : last + 1].max()),
            "largest_velocity_lost": float(missing[first : last + 1].max()),
        }
        for robot in damped
        for size, missing in [[row_of(part, robot) for part in (damping, lost)]]
        for first, last in spans(size > 0)
    ]
    return sorted(found, key=lambda entry: (entry["start"], entry["robot"]))


__getattr__ = names_elsewhere(__name__, ".plant", "torque_limits")
