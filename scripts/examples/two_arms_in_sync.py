"""Two arms in sync: each tracks its own path, and makes up for what the other one is late.

The second arm rubs four times as hard as the first, and neither controller knows. Beta and K_eps couple
them.
"""

import numpy as np
from example import arguments

from synctrl import Cell, Coupling, Cubic, Friction, Gains, Member, load_robot, simulate
from synctrl.show import scene_of
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
arm = load_robot("a460")
start, end = [0.3, 1.0, -2.8], [0.9, 1.3, -3.0]  # rad


def member(y, viscous):
    placed = arm.placed(xyz=(0, y, 0))
    guess = 0.5 * placed.inertial_parameters  # what the controller believes at first
    return Member(placed, Cubic(start, end, duration=1.5), theta_hat0=guess, friction=Friction(viscous))


cell = Cell([member(0.0, 4.0), member(1.0, 16.0)], Coupling.pair(), name="two A460")
gains = Gains(Lambda=8, beta=8, K_r=(80, 80, 100), K_eps=10, Gamma=0.3)
duration = 0.1 if short else 3.0
together = simulate(cell, gains, duration, dt=2e-3)
alone = simulate(cell, gains.independent(), duration, dt=2e-3)
scene_of(together).write(out / "two_arms_in_sync.html")

with style():
    figure, axes = new_figure(2.6)
    for name, run in {"independent": alone, "synchronized": together}.items():
        distance = np.rad2deg(np.linalg.norm(run.sync_error[:, 0], axis=1))
        axes[0, 0].plot(run.t, distance, label=name)
    axes[0, 0].set(xlabel="time, s", ylabel="how far they are apart, deg", ylim=0, xlim=(0, duration))
    axes[0, 0].legend()
save(figure, out / "two_arms_in_sync")
