"""A redundant Panda: seven joints for three coordinates, and what becomes of the four that are left.

With a posture they go back to it, without one they drift. The tip does not notice.
"""

import numpy as np
from example import arguments

from synctrl import CartesianSpace, Cell, Circle, Coupling, Friction, Gains, Member, Redundancy, load_robot
from synctrl.show import side_by_side
from synctrl.show.plots import new_figure, save, style
from synctrl.simulation.simulate import simulate

out, short = arguments(__doc__)
posture = np.array([0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8])
members = []
for k, y in enumerate((-0.4, 0.4)):
    arm = load_robot("panda").placed((0, y, 0), name=f"Panda {k + 1}")
    center = arm.tip_position(posture) - [0.15, 0, 0]
    circle = Circle(center, 0.15, speed=2 * np.pi, first=(1, 0, 0), second=(0, 0.8, 0.6))
    known = {"theta_hat0": arm.inertial_parameters, "friction": Friction()}
    members.append(Member(arm, circle, q0=posture, name=arm.name, **known))


def cell(redundancy):
    return Cell(members, Coupling.pair(), CartesianSpace("xyz", redundancy=redundancy))


ways = {"with a posture": Redundancy(posture, gain=4.0), "without": Redundancy()}
gains = Gains.suggest(cell(ways["without"]), bandwidth=6.0)
runs = {name: simulate(cell(way), gains, 0.05 if short else 4.0, dt=2e-3) for name, way in ways.items()}
side_by_side(runs).write(out / "redundant_panda.html")
with style():
    figure, axes = new_figure(3.0, 1, 2, width=7.5)
    for name, run in runs.items():
        axes[0, 0].plot(run.t, np.rad2deg(np.linalg.norm(run.q[:, 0] - posture, axis=1)), label=name)
        axes[0, 1].plot(run.t, 1e3 * np.linalg.norm(run.tracking_error[:, 0], axis=1), label=name)
    axes[0, 0].set(title="how far the joints are from the posture", xlabel="time, s", ylabel="deg", ylim=0)
    axes[0, 1].set(title="how far the tip is off", xlabel="time, s", ylabel="mm", ylim=0)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
save(figure, out / "redundant_panda")
