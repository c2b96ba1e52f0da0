"""The cells that the benchmark runs."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from synctrl import CartesianSpace, Cell, Coupling, Cubic, Experiment, Gains, Member, Robot, load_robot
from synctrl.experiments import a460_pair, planar_four
from synctrl.robots.documents import planar_arm, write_urdf
from synctrl.robots.parameters import planar_two_link_parameters

#: how long the desired motion takes, s
MOTION = 2.0
START = {"ur5": (0.1, -1.2, 0.8, -0.6, 0.4, 0.3), "panda": (0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.7)}
#: K_r per joint: a distal joint has little inertia, and K_r / M has to stay well below 2.8 / (1 ms)
DAMPING = {"ur5": (12.0, 12.0, 8.0, 0.4, 0.2, 0.04), "panda": (4.0, 4.0, 2.0, 2.0, 0.4, 0.4, 0.1)}


class Parts(NamedTuple):
    """What an experiment is made of."""

    cell: Cell
    gains: Gains
    duration: float


def joint_cell(name: str, n: int) -> Experiment:
    """n robots of one kind in joint space, all inertial parameters adapted."""
    return Experiment(*joint_parts(name, n))


def joint_parts(name: str, n: int) -> Parts:
    """What `joint_cell` is made of."""
    robot, start = load_robot(name), np.array(START[name])
    members = [
        Member(
            robot.placed((1.5 * i, 0, 0)),
            Cubic(start, start + 0.3, MOTION),
            theta_hat0=0.7 * robot.inertial_parameters,
        )
        for i in range(n)
    ]
    return Parts(Cell(members, _coupling(n)), Gains(8, 8, DAMPING[name], 1, 0.01), MOTION)


def planar_ring(n: int) -> Experiment:
    """n planar two-link arms with Cartesian tasks in one signed ring; theta (50) is adapted."""
    return Experiment(*ring_parts(n))


def ring_parts(n: int) -> Parts:
    """What `planar_ring` is made of."""
    arm, q0 = load_robot("planar2r"), np.array([0.4, 1.2])
    members = []
    for i in range(n):
        robot = arm.placed((i, 0, 0))
        tip = robot.tip_position(q0)[:2]
        parameters = planar_two_link_parameters(robot)
        path = Cubic(tip, tip + np.array([-0.1, 0.05]), MOTION)
        members.append(Member(robot, path, q0, parameters=parameters, theta_hat0=0.5 * parameters.theta))
    cell = Cell(members, _coupling(n), CartesianSpace("xy"))
    return Parts(cell, Gains(10, 20, 1, 1, 0.1), MOTION)


def planar_chain(joints: int) -> Experiment:
    """Two planar arms with many joints, 1 m and 6 kg in all, in joint space."""
    arm, start = _planar(joints), np.full(joints, 0.3 / joints)
    theta = 0.7 * arm.inertial_parameters
    free = 1 / np.diag(np.linalg.inv(arm.mass_matrix(start)))  # inertia of a joint while the others give way
    members = [
        Member(arm.placed((2.5 * i, 0, 0)), Cubic(start, 3 * start, MOTION), theta_hat0=theta) for i in (0, 1)
    ]
    return Experiment(Cell(members, _coupling(2)), Gains(4, 4, 40 * free, 0.01, 1e-4), MOTION)


def _planar(joints: int) -> Robot:
    with tempfile.TemporaryDirectory() as folder:
        document = planar_arm([1 / joints] * joints, [6 / joints] * joints, f"planar{joints}r")
        return load_robot(write_urdf(document, Path(folder) / "arm.urdf"))


def _coupling(n: int) -> Coupling:
    return Coupling.pair() if n == 2 else Coupling.signed_ring(n)


CELLS: dict[str, Callable[[], Experiment]] = {
    "four planar arms": planar_four,
    "two A460": a460_pair,
    "two UR5": lambda: joint_cell("ur5", 2),
    "two Panda": lambda: joint_cell("panda", 2),
    "sixteen UR5": lambda: joint_cell("ur5", 16),
}
