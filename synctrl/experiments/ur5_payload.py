"""Two UR5 arms that carry a payload between them, in full pose.

The payload's desired motion swings out, up and round and comes back; each hand's follows from its place on
the payload. The payload is drawn, not simulated: it exerts no force on the arms. Everything here is our
choice and not the paper's.
"""

from __future__ import annotations

from typing import Unpack

import numpy as np

from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..robots.catalog import load_robot
from ..robots.robot import Robot
from ..simulation.simulate import Experiment
from ..tasks.inverse_kinematics import reach
from ..tasks.pose import PoseSpace
from ..tasks.poses import Attached, AxisRotation, PoseTrajectory
from ..tasks.rotations import exp
from ..tasks.swings import Swing
from .parts import ControllerParts, ready_experiment

DISTANCE = 0.65  # m, of each base from the middle
LENGTH = 0.40  # m, of the payload: from hand to hand
PAYLOAD = (LENGTH, 0.12, 0.12)  # m
HEIGHT = 0.40  # m
PERIOD = DURATION = 5.0  # s
SWING = np.array([0.0, 0.20, 0.15])  # m, how far the payload goes
TURN, TURN_AXIS = 0.6, (0.3, 0.2, 1.0)  # rad
POSTURE = (0.0, -1.5, 2.0, -0.5, np.pi / 2, 0.0)  # rad: the elbow up, the tool level
#: how far off each hand starts: in position, m, and as a rotation vector, rad
OFFSETS = np.array([[0.02, -0.01, 0.01, 0.04, 0.0, -0.03], [0.01, 0.02, -0.01, -0.03, 0.04, 0.0]])
#: share of the true parameters that the controller starts with
KNOWN = 0.7
GAINS = Gains(
    Lambda=6.0,
    beta=6.0,
    K_r=(50.0, 60.0, 20.0, 6.0, 10.0, 0.6),
    K_eps=50.0,
    Gamma=np.where(np.arange(6) < 4, 0.3, 0.03).repeat(10),
)


def ur5_payload(
    synchronized: bool = True, gains: Gains | None = None, **parts: Unpack[ControllerParts]
) -> Experiment:
    """The two-arm cell in pose space, with epsilon = e_1 - e_2 in position and orientation.

    Without friction, and with 0.7 of the true inertial parameters as the first estimate. The arms start at
    rest, a few centimetres and degrees off their paths.

    Args:
        synchronized, gains, parts: see `ready_experiment`; the gains of the cell converge within the run.
    """
    members = [_member(i) for i in range(2)]
    cell = Cell(members, Coupling.pair(), PoseSpace(), name="UR5 pair with payload")
    return ready_experiment(cell, DURATION, GAINS, gains, synchronized, parts)


def payload_motion() -> PoseTrajectory:
    """Desired motion of the payload's middle: away with 1 - cos, back after one period."""
    way = swing(SWING, offset=np.array([0.0, 0.0, HEIGHT]))
    return PoseTrajectory(way, AxisRotation(np.eye(3), TURN_AXIS, swing(np.array([TURN]))))


def hand_on_payload(i: int) -> tuple[np.ndarray, np.ndarray]:
    """Place, (3,), and orientation, (3, 3), of a hand in the payload's axes: it points at the payload."""
    side = (-1.0, 1.0)[i]
    pointing = exp(np.array([0.0, -side * np.pi / 2, 0.0]))
    return np.array([side * LENGTH / 2, 0.0, 0.0]), pointing


def facing_ur5(i: int, distance: float = DISTANCE) -> Robot:
    """UR5 1 or 2, i = 0 or 1, at x = -distance or distance, m, where it faces the middle of its cell."""
    side, heading = ((-1.0, 0.0), (1.0, np.pi))[i]
    return load_robot("ur5").placed((side * distance, 0.0, 0.0), (0.0, 0.0, heading), name=f"UR5 {i + 1}")


def _member(i: int) -> Member:
    robot = facing_ur5(i)
    motion = Attached(payload_motion(), *hand_on_payload(i))
    return Member(
        robot,
        motion,
        _start(robot, motion(0.0).x, OFFSETS[i]),
        theta_hat0=KNOWN * robot.inertial_parameters,
        name=robot.name,
    )


def _start(robot: Robot, pose: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Joint positions at the start of the path, and from there a step of the size of the offset."""
    q = reach(robot, pose, np.array(POSTURE), PoseSpace())
    return q + np.linalg.solve(PoseSpace().miss(robot, pose, q)[1], offset)


def swing(amplitude: np.ndarray, offset: np.ndarray | float = 0.0) -> Swing:
    """The swing of this cell, at rest at t = 0 and back after its period."""
    return Swing(amplitude, PERIOD, offset)
