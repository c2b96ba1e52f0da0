"""Two planar arms that hold a rigid object and carry it round a circle: example 1 of the paper.

The synchronization function is f = x_1 - x_2 - A = 0 with the constant vector A from one grip to the other,
so that c_1 = -1, c_2 = 1 and epsilon = e_2 - e_1. The object is not simulated: epsilon is by how much the
two grips would stretch or bend it. The arms are those of section V-B; the object, its path and the gains
are our choice.
"""

from __future__ import annotations

from typing import Unpack

import numpy as np

from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.synchronization import SynchronizationFunction
from ..robots.catalog import load_robot
from ..robots.parameters import planar_two_link_parameters, theta_50
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment
from ..tasks.inverse_kinematics import inverse_kinematics
from ..tasks.spaces import CartesianSpace
from ..tasks.trajectories import Circle
from .parts import ControllerParts, ready_experiment

A = np.array([-0.3, 0.0])  # m, x_1 - x_2
BASES = ((-0.35, 0.0, 0.0), (0.35, 0.0, 0.0))  # m
CENTER, RADIUS, SPEED = np.array([0.0, 0.35]), 0.08, np.pi / 2  # m, m, rad/s
#: where the search for the initial joint positions begins: elbows outward
Q0 = ((1.9, -1.6), (1.2, 1.6))  # rad
SPACE = CartesianSpace("xy")
DURATION = 6.0  # s
GAINS = Gains(Lambda=10.0, beta=20.0, K_r=0.5, K_eps=20.0, Gamma=2.0)
MASS_HAT, LENGTH_HAT = 0.8, 0.2  # kg, m: the initial guess of every link
#: something pushes against the first arm
PUSH = Disturbance(robot=0, torque=(1.0, 1.0), start=2.0, stop=2.2)


def rigid_object(
    synchronized: bool = True,
    disturbed: bool = True,
    gains: Gains | None = None,
    **parts: Unpack[ControllerParts],
) -> Experiment:
    """Two arms and the object between them, in Cartesian space.

    Args:
        disturbed: whether the first arm is pushed, 1 N·m on both joints for 2 <= t < 2.2 s.
        synchronized, gains, parts: see `ready_experiment`.
    """
    members = [_member(i) for i in range(2)]
    function = SynchronizationFunction(lambda x_1, x_2, t: x_1 - x_2 - A, robots=2, dimension=2)
    coupling = function.coupling([member.trajectory for member in members], DURATION)
    cell = Cell(members, coupling, SPACE, name="rigid object")
    pushes = (PUSH,) if disturbed else ()
    return ready_experiment(cell, DURATION, GAINS, gains, synchronized, parts, disturbances=pushes)


def _member(i: int) -> Member:
    robot = load_robot("planar2r").placed(BASES[i], name=f"arm {i + 1}")
    path = Circle(CENTER + (1, -1)[i] * A / 2, RADIUS, SPEED)
    return Member(
        robot,
        path,
        inverse_kinematics(robot, path(0.0).x, np.array(Q0[i]), SPACE),
        parameters=planar_two_link_parameters(robot),
        theta_hat0=theta_50([MASS_HAT] * 2, [LENGTH_HAT] * 2),
    )
