"""Four Pandas, fingers locked, whose tips move along synchronized circles in Cartesian space."""

from __future__ import annotations

from typing import Unpack

import numpy as np

from ..control.gains import Gains
from ..simulation.simulate import Experiment
from .circles import Station, circle_cell
from .parts import ControllerParts

POSTURE = (0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4)
DISTANCE = 0.65  # m
K_R = (10.0, 50.0, 10.0, 24.0, 1.5, 2.0, 0.3)  # N·m·s/rad


def panda_four(
    synchronized: bool = True, gains: Gains | None = None, **parts: Unpack[ControllerParts]
) -> Experiment:
    """Four seven-joint arms on tilted circles, position only: four joints of each are free for a posture.

    Without friction, and with 0.7 of the true inertial parameters as the first estimate.

    Args:
        synchronized: False sets beta = K_eps = 0, independent adaptive control.
        gains: by default ones that converge within the run.
        parts: parts and options of the controller, see `ControllerParts`.
    """
    stations = [Station("panda", POSTURE, DISTANCE, f"Panda {i}", K_R) for i in range(1, 5)]
    return circle_cell(stations, "four Pandas", gains, synchronized, parts)
