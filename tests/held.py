"""Arms that carry an object as one body with it, at places of one's own."""

from __future__ import annotations

from typing import Any

import numpy as np

from synctrl import Experiment
from synctrl.tasks.inverse_kinematics import reach
from synctrl.tasks.pose import PoseSpace
from synctrl.tasks.rotations import exp, log


def carried_along(made: Experiment, moved: np.ndarray, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """q and v of arms that carry their object as one body, displaced and with a twist."""
    kept = made.plant_type.keywords
    p, R = kept["at"][0] + moved[:3], exp(moved[3:]) @ kept["at"][1]
    q, v = np.zeros((2, 2, 6))
    for i, (grasp, arm, robot) in enumerate(
        zip(kept["grasps"], kept["robots"], made.cell.robots, strict=True)
    ):
        hand = np.concatenate((p + R @ grasp.xyz, log(R @ grasp.rotation)))
        q[i] = reach(arm, hand, made.cell.q0[i], PoseSpace())
        v[i] = np.linalg.solve(robot.jacobian(q[i]), twist)
    return q, v


def evaluate_held(run: Experiment, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, Any]:
    """y' and signals at t = 0 of arms that hold an object."""
    loop, cell = run.closed_loop(), run.cell
    state = loop.state(loop.initial_state())
    state.q[...], state.v[...] = q, v
    return loop.evaluate(cell.references(np.zeros(1))[0], state.flat, np.zeros_like(cell.q0))
