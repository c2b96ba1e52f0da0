"""Arms that carry an object as one body with it, at places of one's own."""

from __future__ import annotations

from typing import Any

import numpy as np

from synctrl import Experiment, Robot
from synctrl.tasks.inverse_kinematics import reach
from synctrl.tasks.pose import PoseSpace
from synctrl.tasks.rotations import exp, log


def posture(robot: Robot, p: np.ndarray, R: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Joint positions, (nv,), that bring the tip to a place and an orientation to the last bits."""
    space, pose = PoseSpace(), np.concatenate((p, log(R)))
    q = reach(robot, pose, q, space)
    for _ in range(2):  # by Newton's method, on from where `reach` has stopped
        e, J = space.miss(robot, pose, q)
        q = q + np.linalg.solve(J, e)
    return q


def carried_along(made: Experiment, moved: np.ndarray, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """q and v of arms that carry their object as one body, displaced and with a twist."""
    kept = made.plant_type.keywords
    p, R = kept["at"][0] + moved[:3], exp(moved[3:]) @ kept["at"][1]
    q, v = np.zeros((2, 2, 6))
    for i, (grasp, arm, robot) in enumerate(
        zip(kept["grasps"], kept["robots"], made.cell.robots, strict=True)
    ):
        q[i] = posture(arm, p + R @ grasp.xyz, R @ grasp.rotation, made.cell.q0[i])
        v[i] = np.linalg.solve(robot.jacobian(q[i]), twist)
    return q, v


def evaluate_held(run: Experiment, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, Any]:
    """y' and signals at t = 0 of arms that hold an object."""
    loop, cell = run.closed_loop(), run.cell
    state = loop.state(loop.initial_state())
    state.q[...], state.v[...] = q, v
    return loop.evaluate(cell.references(np.zeros(1))[0], state.flat, np.zeros_like(cell.q0))
