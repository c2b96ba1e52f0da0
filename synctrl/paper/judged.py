"""Cells that run twice: with the plant by Pinocchio, and by MuJoCo from its own reading of the URDF."""

from __future__ import annotations

import numpy as np

from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..robots.robot import load_robot
from ..simulation.simulate import Experiment
from ..tasks.trajectories import Cubic

GAINS = Gains(Lambda=5.0, beta=2.0, K_r=5.0, K_eps=5.0, Gamma=0.05)
MOTION_TIME, DURATION = 0.6, 0.4  # s
#: share of the true parameters that the controller starts with
KNOWN = 0.5


def joint_pair(name: str) -> Experiment:
    """Two robots of one kind, turned and tilted differently, that move all their joints together.

    Args:
        name: of the robot in the catalogue.
    """
    members = []
    for i in range(2):
        robot = load_robot(name).placed((0.3 * i, 1.0, -0.2), (0.3, -0.4 * i, 0.5 + i))
        start = np.linspace(-0.7, 0.9, robot.nv) + 0.2 * i
        path = Cubic(start, start + np.linspace(0.5, -0.4, robot.nv), MOTION_TIME)
        members.append(Member(robot, path, theta_hat0=KNOWN * robot.inertial_parameters))
    cell = Cell(members, Coupling.pair(), name=f"two {name}")
    return Experiment(cell, GAINS, DURATION, title=f"two {name} in joint space")
