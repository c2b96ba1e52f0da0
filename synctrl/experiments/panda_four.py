"""Arms around a common place whose tips move along synchronized circles: four Pandas, and parts for more.

The tips hold a formation, a square, that is carried round a tilted circle: every desired path is the same
circle about another centre. All arms start at rest, each a few centimetres off its path. Everything here is
our choice and not the paper's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np

from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..robots.catalog import load_robot
from ..robots.friction import Friction
from ..simulation.simulate import Experiment
from ..tasks.inverse_kinematics import reach
from ..tasks.redundancy import Redundancy
from ..tasks.spaces import CartesianSpace
from ..tasks.trajectories import Circle
from .parts import ControllerParts, ready_experiment

#: of a Panda, see `Station`
POSTURE = (0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4)
DISTANCE = 0.65  # m
K_R = (10.0, 50.0, 10.0, 24.0, 1.5, 2.0, 0.3)  # N·m·s/rad
FORMATION = 0.30  # m, distance of every circle's centre from the middle
HEIGHT = 0.40  # m
RADIUS, PERIOD = 0.10, 4.0  # m, s
TILT = np.deg2rad(30)
DURATION = 6.0  # s
LAMBDA, BETA, K_EPS = 6.0, 6.0, 50.0  # 1/s, 1/s, N·m/rad
#: adaptation rates: of the first bodies, and of the light ones from joint 5 on
GAMMA_ARM, GAMMA_WRIST, ARM_BODIES = 0.3, 0.03, 4
#: where each tip is at t = 0, as seen from the start of its path, m
OFFSETS = 0.02 * np.array([[1.2, 0.0, 1.0], [-1.0, 1.0, 0.0], [0.0, -1.2, -1.0], [1.0, 1.0, 1.0]])
#: share of the true parameters that the controller starts with
KNOWN = 0.7
#: how fast the joints that the task leaves free return to the posture, 1/s
POSTURE_GAIN = 2.0


@dataclass(frozen=True)
class Station:
    """A robot of the catalogue at its place around the middle.

    Attributes:
        robot: name in the catalogue.
        posture: joint positions it prefers, rad; it then reaches out along the x axis of its base.
        distance: of its base from the middle, m.
        name: for legends.
        K_r: damping of each joint, N·m·s/rad: some 40 per second times the inertia that the joint feels.
    """

    robot: str
    posture: tuple[float, ...]
    distance: float
    name: str
    K_r: tuple[float, ...]


def circle_cell(
    stations: Sequence[Station],
    name: str,
    gains: Gains | None,
    synchronized: bool,
    parts: ControllerParts,
) -> Experiment:
    """Robots at equal angles around the middle, each on its circle, coupled in a ring."""
    postures = [np.array(station.posture) for station in stations]
    members = [_member(s, 2 * np.pi * i / len(stations), OFFSETS[i]) for i, s in enumerate(stations)]
    space = CartesianSpace("xyz", redundancy=Redundancy(postures, POSTURE_GAIN))
    cell = Cell(members, Coupling.ring(len(stations)), space, name=name)
    return ready_experiment(cell, DURATION, _gains(stations), gains, synchronized, parts)


def panda_four(
    synchronized: bool = True, gains: Gains | None = None, **parts: Unpack[ControllerParts]
) -> Experiment:
    """Four seven-joint arms on tilted circles, position only: four joints of each are free for a posture.

    Without friction, and with 0.7 of the true inertial parameters as the first estimate.

    Args:
        synchronized, gains, parts: see `ready_experiment`; the gains of the cell converge within the run.
    """
    stations = [Station("panda", POSTURE, DISTANCE, f"Panda {i}", K_R) for i in range(1, 5)]
    return circle_cell(stations, "four Pandas", gains, synchronized, parts)


def _gains(stations: Sequence[Station]) -> Gains:
    """Gains of the cell."""
    joints = max(len(station.K_r) for station in stations)
    K_r = [station.K_r for station in stations]
    Gamma = np.where(np.arange(joints) < ARM_BODIES, GAMMA_ARM, GAMMA_WRIST).repeat(10)
    return Gains(Lambda=LAMBDA, beta=BETA, K_r=K_r, K_eps=K_EPS, Gamma=Gamma)


def _member(station: Station, bearing: float, offset: np.ndarray) -> Member:
    outward = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    robot = load_robot(station.robot).placed(
        station.distance * outward, (0.0, 0.0, bearing + np.pi), name=station.name
    )
    center = FORMATION * outward + (0.0, 0.0, HEIGHT)
    tilted = (0.0, np.cos(TILT), np.sin(TILT))
    circle = Circle(center, RADIUS, 2 * np.pi / PERIOD, first=(1.0, 0.0, 0.0), second=tilted)
    return Member(
        robot,
        circle,
        reach(robot, circle(0.0).x + offset, np.array(station.posture)),
        theta_hat0=KNOWN * robot.inertial_parameters,
        friction=Friction(),
        name=station.name,
    )
