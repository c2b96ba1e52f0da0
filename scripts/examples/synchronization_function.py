"""A synchronization function: say what must stay true, and the weights follow from it.

The second arm has to be at twice the angles of the first, less a little that changes with time. f = 0 is
all that is written down; here it is held while the first arm is pushed.
"""

import numpy as np
from example import arguments

from synctrl import Cell, Disturbance, Gains, Member, SmoothTrajectory, load_robot, simulate
from synctrl.coupling.synchronization import SynchronizationFunction
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
duration = 0.2 if short else 2.0


def f(x1, x2, t):
    return 2 * x1 - x2 - 0.3 * np.sin(3 * t)


def lead(t):
    return np.array([0.4 - 0.3 * np.cos(3 * t), 0.8 + 0.1 * np.sin(3 * t)])


ways = [SmoothTrajectory(lead, 2.0), SmoothTrajectory(lambda t: 2 * lead(t) - 0.3 * np.sin(3 * t), 2.0)]
coupling = SynchronizationFunction(f, robots=2, dimension=2).coupling(ways, duration=2.0)
arm = load_robot("planar2r")
cell = Cell([Member(arm.placed((0, y, 0)), way) for y, way in zip((0.0, 1.0), ways, strict=True)], coupling)
gains = Gains(Lambda=5, beta=20, K_r=2, K_eps=2, Gamma=0.1)
push = Disturbance(robot=0, torque=0.8, start=0.5, stop=0.8)
with style():
    figure, axes = new_figure(2.8)
    for name, own in {"independent": gains.independent(), "synchronized": gains}.items():
        run = simulate(cell, own, duration, dt=2e-3, disturbances=[push])
        axes[0, 0].plot(run.t, np.rad2deg(run.sync_error[:, 0, 0]), label=name)
    axes[0, 0].axvspan(0.5, 0.8, color="#b3001b", alpha=0.12, lw=0, label="push on robot 1")
    axes[0, 0].set(xlabel="time, s", ylabel="f of the first joints, deg", xlim=(0, duration))
    axes[0, 0].legend()
save(figure, out / "synchronization_function")
