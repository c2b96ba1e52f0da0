"""A space of one's own: joint positions in degrees."""

import numpy as np

from synctrl.tasks.spaces import Measurement

DEGREES = np.rad2deg(1.0)


class Degrees:
    unit = "deg"

    def labels(self, robots):
        return robots[0].joint_names

    def bind(self, robots):
        return BoundDegrees(len(robots), robots[0].nv)


class BoundDegrees:
    def __init__(self, n: int, nv: int):
        self.J = np.broadcast_to(DEGREES * np.eye(nv), (n, nv, nv))

    def measure(self, motion, desired):
        x = DEGREES * motion
        J_inv, J_dot = self.J / DEGREES**2, np.zeros_like(self.J)
        return Measurement(x, desired[:2] - x, desired[1:], self.J, J_inv, J_dot)

    def to_joints(self, task, xref_dot, xref_ddot):
        return xref_dot / DEGREES, xref_ddot / DEGREES

    def to_torque(self, task, force):
        return DEGREES * force
