"""Which limits of the robots' descriptions a run left, when, and by how much."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..coupling.cell import Cell
from ..robots.limits import joint_limits
from ..robots.units import unit_for
from .damping import spans

if TYPE_CHECKING:
    from .result import Result


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
    found = []
    for i, robot in enumerate(cell.robots):
        limits = joint_limits(robot)
        watched = (
            ("position", "rad", q, limits.lower, limits.upper),
            ("velocity", "rad/s", v, -limits.velocity, limits.velocity),
            ("torque", "N·m", tau, -limits.torque, limits.torque),
        )
        for kind, turning, values, lower, upper in watched:
            for joint, unit in enumerate(robot.joint_units):
                about = {"robot": i, "joint": joint, "kind": kind, "unit": unit_for(turning, unit)}
                for entry in _outside(t, values[:, i, joint], lower[joint], upper[joint]):
                    found.append({**about, **entry})
    return sorted(found, key=lambda entry: (entry["start"], entry["robot"], entry["joint"], entry["kind"]))


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


def torque_limits(cell: Cell) -> np.ndarray:
    """Torque limits of all robots, (n, nv), N·m; infinite where there is none."""
    limits = np.full((cell.n, cell.nv), np.inf)
    for i, robot in enumerate(cell.robots):
        limits[i, : robot.nv] = joint_limits(robot).torque
    return limits


def applied_torque(result: Result) -> np.ndarray:
    """Torque of the motors at every logged instant, (T, n, nv), N·m.

    It is `result.tau`, what the controller commands; in a run with saturation cut off at the limits, which
    newer results have as the output "applied_torque".
    """
    if "applied_torque" in result.outputs:
        return result.outputs["applied_torque"].copy()
    tau = result.tau.copy()
    for i, robot in enumerate(result.info["robots"]):
        for joint, limit in enumerate(robot.get("torque_limits", ()) if result.info.get("saturate") else ()):
            if limit is not None:
                tau[:, i, joint] = np.clip(tau[:, i, joint], -limit, limit)
    return tau
