"""A circle in Cartesian space: two UR5 whose tips go round on circles that face each other.

Paths are those of the tips, in metres. Both arms start a few centimetres off, where inverse kinematics
finds joint positions for them, and know different shares of their own masses.
"""

import numpy as np
from example import arguments

from synctrl import CartesianSpace, Cell, Circle, Coupling, Gains, Member, load_robot, simulate
from synctrl.show import scene_of
from synctrl.show.plots import new_figure, save, style
from synctrl.tasks.inverse_kinematics import reach

out, short = arguments(__doc__)
posture = [0.0, -1.3, 1.9, -2.17, -1.57, 0.0]  # rad, where inverse kinematics begins
members = []
for k, (side, off, known) in enumerate(((-1.0, [0.03, 0, 0], 0.7), (1.0, [0, 0.01, -0.02], 0.4))):
    robot = load_robot("ur5").placed((0, 0.75 * side, 0), (0, 0, -side * np.pi / 2), name=f"UR5 {k + 1}")
    circle = Circle((0, 0.25 * side, 0.4), 0.12, speed=np.pi, first=(1, 0, 0), second=(0, 0, 1))
    q0 = reach(robot, circle(0.0).x + off, np.array(posture))
    members.append(Member(robot, circle, q0, theta_hat0=known * robot.inertial_parameters))
cell = Cell(members, Coupling.pair(), CartesianSpace("xyz"), name="two circles")
gains = Gains.suggest(cell, bandwidth=6.0)
run = simulate(cell, gains, 0.05 if short else 2.5, dt=2e-3)
scene_of(run).write(out / "circle_in_space.html")

with style():
    figure, axes = new_figure(3.2, 1, 2, width=7.5)
    for k, name in enumerate(run.names):
        axes[0, 0].plot(*run.x[:, k, ::2].T, label=name)
        axes[0, 1].plot(run.t, 1e3 * np.linalg.norm(run.tracking_error[:, k], axis=1), label=name)
    axes[0, 0].plot(*run.x_desired[:, 0, ::2].T, "k-.", lw=1, label="desired")
    axes[0, 0].set(xlabel="x, m", ylabel="z, m", aspect="equal", title="ways of the tips")
    axes[0, 1].set(xlabel="time, s", title="how far they are off", ylabel="mm", ylim=0)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
save(figure, out / "circle_in_space")
