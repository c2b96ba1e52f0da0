"""How much of the torque that a controller asked for was cut off, and what it learned meanwhile."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import SaturationWarning, warn
from ..robots.units import unit_for
from .plant import Output, Plant

if TYPE_CHECKING:
    from .result import Result

#: the output that has what was left of the torque
APPLIED = "applied_torque"
#: growth of the estimates that is worth a word, as a share of what they were
GROWN = 0.01


def saturation_report(plant: Plant, arrays: Mapping[str, np.ndarray]) -> list[dict[str, Any]]:
    """Joints whose torque was cut off, in order of robots and joints.

    Args:
        plant: the plant.
        arrays: `tau`, (T, n, nv), N·m, and `theta_hat`, (T, n, P), at the logged instants.

    Returns:
        One entry per joint: `robot` and `joint`, counted from 0; `limit`, in `unit`; `share` of the logged
        instants at which the controller asked for more; `largest`, the largest torque that it asked for; and
        `theta_hat`, the largest magnitude of the robot's estimates at the start and over the run.
    """
    if not plant.saturate:
        return []
    size, limits = np.abs(arrays["tau"]), plant.torque_limits
    share = (size > limits).mean(axis=0) if len(size) else np.zeros(limits.shape)
    return [
        {
            "robot": int(i),
            "joint": int(joint),
            "limit": float(limits[i, joint]),
            "unit": unit_for("N·m", plant.cell.robots[i].joint_units[joint]),
            "share": float(share[i, joint]),
            "largest": float(size[:, i, joint].max()),
            "theta_hat": _growth(arrays["theta_hat"][:, i]),
        }
        for i, joint in np.argwhere(share > 0)
    ]


def _growth(theta_hat: np.ndarray) -> list[float]:
    """Largest magnitude of estimates, (T, P), at the start and over the run."""
    size = np.abs(theta_hat)
    return [float(size[0].max()), float(size.max())]


def applied_output(plant: Plant, tau: np.ndarray) -> dict[str, Output]:
    """What reached the joints of torques tau, (T, n, nv), N·m, as an output."""
    return {APPLIED: (plant.applied(tau), "N·m", ("time", "robot", "joint"))} if plant.saturate else {}


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
        f"{worst['limit']:.3g}. Estimates and integrals of the synchronization errors went on meanwhile as "
        f"if it had got it{_learned(found)}. See info['saturation'] and "
        f"outputs['{APPLIED}']; lower the gains, or ask for a slower motion",
        SaturationWarning,
    )


def _learned(found: list[dict[str, Any]]) -> str:
    """How far the estimates grew, in words; empty if they hardly did."""
    start, largest = max((entry["theta_hat"] for entry in found), key=lambda pair: pair[1])
    if largest <= (1 + GROWN) * start:
        return ""
    times = f", {largest / start:.3g} times as much" if start > 0 else ""
    return f": the largest entry of theta_hat went from {start:.3g} to {largest:.3g}{times}"
