"""A UR5, a UR10, a Panda and an xArm7 in one cell: tips on synchronized circles in Cartesian space."""

from __future__ import annotations

from typing import Unpack

from ..control.gains import Gains
from ..simulation.simulate import Experiment
from .panda_four import DISTANCE, K_R, POSTURE, Station, circle_cell
from .parts import ControllerParts

UR_POSTURE = (0.0, -1.3, 1.9, -2.17, -1.57, 0.0)
STATIONS = (
    Station("ur5", UR_POSTURE, 0.80, "UR5", (50.0, 60.0, 20.0, 6.0, 10.0, 0.6)),
    Station("ur10", UR_POSTURE, 1.00, "UR10", (120.0, 160.0, 60.0, 0.6, 0.25, 0.02)),
    Station("panda", POSTURE, DISTANCE, "Panda", K_R),
    Station(
        "xarm7", (0.0, -0.3, 0.0, 1.1, 0.0, 1.4, 0.0), 0.65, "xArm7", (5.0, 25.0, 5.0, 6.0, 0.2, 0.25, 0.005)
    ),
)


def mixed_four(
    synchronized: bool = True, gains: Gains | None = None, **parts: Unpack[ControllerParts]
) -> Experiment:
    """Arms with six and with seven joints on tilted circles, position only: the rest is free for a posture.

    Without friction, and with 0.7 of the true inertial parameters as the first estimate.

    Args:
        synchronized, gains, parts: see `ready_experiment`; the gains of the cell converge within the run.
    """
    return circle_cell(STATIONS, "mixed cell", gains, synchronized, parts)
