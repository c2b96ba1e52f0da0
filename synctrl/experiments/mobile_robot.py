"""The two wheels of a mobile robot on a curved path: example 2 of the paper.

The synchronization function is f = R_2(t) x_1 - R_1(t) x_2 = 0, with the radii R_i(t) of the wheels' paths
and the displacements x_i of the wheels. The left wheel, robot 1, is the inner one.

What this means. The vehicle's heading is (x_2 - x_1) / b for wheels a track b apart. With R_2 - R_1 = b,
f = 0 says that both x_1 / R_1 and x_2 / R_2 are this heading. On a circle R_i is its radius. On a path whose
curvature changes, x_i / R_i is the heading only if R_i(t) is the distance the wheel has covered since the
start, divided by the angle the vehicle has turned since: a mean radius, and not the radius of curvature at
that instant, which would relate the velocities x_1' / R_1 = x_2' / R_2. We take the paper's relation
literally and choose the heading theta(t) and the mean radius rho(t) of the path freely; then
R_i = rho -+ b / 2, and x_i = R_i theta on the path.

The coordinates are the angles of the wheels, x_i / r, for which f is the same up to the factor r. The path,
the vehicle and the gains are our choice.
"""

from __future__ import annotations

from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from ..checks import index
from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.synchronization import SynchronizationFunction
from ..robots.catalog import load_robot
from ..robots.parameters import LinearParameters
from ..robots.robot import Robot
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment
from ..tasks.spaces import JointSpace
from ..tasks.trajectories import Motion
from .parts import ControllerParts, ready_experiment

WHEEL_RADIUS, TRACK = 0.1, 0.4  # m
INERTIA = 0.05  # kg·m^2, about the axle
DURATION = 8.0  # s
TURN_RATE, START_RATE = 0.8, 2.0  # rad/s, 1/s
MEAN_RADIUS, SWING = 1.0, 0.3  # m: smallest mean radius, and by how much it grows
GAINS = Gains(Lambda=4.0, beta=8.0, K_r=0.5, K_eps=2.0, Gamma=0.1)
#: share of the true inertia that the controller starts with
KNOWN = 0.5
#: the left wheel meets an obstacle
OBSTACLE = Disturbance(robot=0, torque=-1.5, start=3.0, stop=3.5)


def heading(t: ArrayLike) -> np.ndarray:
    """Theta of the path and its first two derivatives, (3, ...), rad: from rest to a steady turn."""
    t = np.asarray(t, dtype=float)
    left = np.exp(-START_RATE * t)
    return TURN_RATE * np.array([t - (1 - left) / START_RATE, 1 - left, START_RATE * left])


def radius(t: ArrayLike, wheel: int) -> np.ndarray:
    """R_i of the path of wheel 0 (left) or 1 (right) and its first two derivatives, (3, ...), m."""
    w = 2 * np.pi / DURATION
    phase = w * np.asarray(t, dtype=float)
    mean = MEAN_RADIUS + SWING / 2 * (1 - np.cos(phase))
    side = (-1, 1)[wheel] * TRACK / 2
    return np.array([mean + side, SWING / 2 * w * np.sin(phase), SWING / 2 * w**2 * np.cos(phase)])


class WheelPath:
    """Desired angle of a wheel, R_i theta / r.

    Args:
        wheel: 0 (left) or 1 (right).

    Raises:
        InputError: another number.
    """

    dimension = 1
    breaks: tuple[float, ...] = ()

    def __init__(self, wheel: int):
        self.wheel = index("wheel", wheel, 2)

    def __call__(self, t: ArrayLike) -> Motion:
        R, theta = radius(t, self.wheel), heading(t)
        angle = R[0] * theta[0]
        angle_dot = R[1] * theta[0] + R[0] * theta[1]
        angle_ddot = R[2] * theta[0] + 2 * R[1] * theta[1] + R[0] * theta[2]
        return Motion(*(part[..., None] / WHEEL_RADIUS for part in (angle, angle_dot, angle_ddot)))


class WheelSynchronization(SynchronizationFunction):
    """f = R_2(t) x_1 - R_1(t) x_2, so that c_1 = -R_2 and c_2 = R_1."""

    def __init__(self) -> None:
        super().__init__(_apart, robots=2, dimension=1, unit="m")


def wheel_synchronization() -> SynchronizationFunction:
    """The synchronization function of the wheels."""
    return WheelSynchronization()


def _apart(x_1: np.ndarray, x_2: np.ndarray, t: float) -> np.ndarray:
    return radius(t, 1)[0] * x_1 - radius(t, 0)[0] * x_2


def mobile_robot(
    synchronized: bool = True,
    disturbed: bool = True,
    gains: Gains | None = None,
    **parts: Unpack[ControllerParts],
) -> Experiment:
    """Two wheels, each a robot with one joint, on a path whose radii change with time.

    Args:
        disturbed: whether the left wheel meets an obstacle, -1.5 N·m for 3 <= t < 3.5 s.
        synchronized, gains, parts: see `ready_experiment`.
    """
    wheel = load_robot("wheel")
    members = [_member(wheel, i) for i in range(2)]
    coupling = wheel_synchronization().coupling([member.trajectory for member in members], DURATION)
    cell = Cell(members, coupling, JointSpace(), name="wheels of a mobile robot")
    met = (OBSTACLE,) if disturbed else ()
    return ready_experiment(cell, DURATION, GAINS, gains, synchronized, parts, disturbances=met)


def _member(wheel: Robot, i: int) -> Member:
    side = (1, -1)[i] * TRACK / 2
    robot = wheel.placed((0.0, side, WHEEL_RADIUS), name=("left wheel", "right wheel")[i])
    matrix = np.zeros((10, 1))
    matrix[6] = 1.0  # I_yy
    return Member(
        robot,
        WheelPath(i),
        parameters=LinearParameters(robot, matrix, [INERTIA], ["I_yy"]),
        theta_hat0=[KNOWN * INERTIA],
        name=robot.name,
    )
