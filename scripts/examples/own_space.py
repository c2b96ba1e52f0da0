"""A task space of your own: coordinates around a post, in which a logarithmic spiral is a straight line.

They are the logarithm of z = x + iy: how far the tip is, and in which direction. `measure` says where the
robots are, `to_joints` and `to_torque` are the ways to joint space and back.
"""

import numpy as np
from example import arguments

from synctrl import Cell, Coupling, Cubic, Gains, Member, load_robot, simulate
from synctrl.show.plots import new_figure, save, style
from synctrl.tasks.measurement import Measurement, Tips


class AroundThePost:
    unit = "1"

    def labels(self, robots):
        return "log distance", "direction"

    def bind(self, robots):
        self.tips = Tips(robots)
        return self

    def measure(self, motion, desired):
        (p, v), J, J_dot = self.tips.positions(*motion)
        z, z_dot = (part[:, :1] + 1j * part[:, 1:2] for part in (p, v))
        dz, dz_dot = (part[:, 0] + 1j * part[:, 1] for part in (J, J_dot))
        found = np.log(z), z_dot / z, dz / z, dz_dot / z - dz * z_dot / z**2
        x, x_dot, J, J_dot = (np.stack((part.real, part.imag), axis=1) for part in found)
        motion = np.array([x, x_dot])[..., 0]
        return Measurement(motion, desired[:2] - motion, desired[1:], J, np.linalg.inv(J), J_dot)

    def to_joints(self, task, xref_dot, xref_ddot):
        v_ref = np.matvec(task.J_inv, xref_dot)
        return v_ref, np.matvec(task.J_inv, xref_ddot - np.matvec(task.J_dot, v_ref))

    def to_torque(self, task, force):
        return np.matvec(task.J.mT, force)


out, short = arguments(__doc__)
members = []
for bearing, q0 in ((1.0, [-0.53, -2.21]), (-1.0, [1.45, 2.28])):  # of bases and spirals, around a post at 0
    arm = load_robot("planar2r").placed((0.45 * np.cos(bearing), 0.45 * np.sin(bearing), 0))
    way = Cubic([np.log(0.25), bearing - 0.5], [np.log(0.1), bearing + 1.0], duration=1.5)
    members.append(Member(arm, way, q0))
gains = Gains(Lambda=6, beta=6, K_r=2, K_eps=0.5, Gamma=0.1)
run = simulate(Cell(members, Coupling.pair(), AroundThePost()), gains, 0.05 if short else 2.0)
z, wanted = (np.exp(x[..., 0] + 1j * x[..., 1]) for x in (run.x, run.x_desired))
with style():
    figure, axes = new_figure(4.2)
    axes[0, 0].plot(z.real, z.imag)
    axes[0, 0].plot(wanted.real, wanted.imag, "k-.", lw=1)
    axes[0, 0].set(xlabel="x, m", ylabel="y, m", aspect="equal", title="tips and desired spirals")
save(figure, out / "own_space")
