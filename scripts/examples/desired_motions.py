"""Desired motions: a cubic, a circle, an approach, and a function of your own.

Of a function only the position is said: `SmoothTrajectory` finds velocity and acceleration by itself, and
refuses a function that has none.
"""

import numpy as np
from example import arguments

from synctrl import Circle, Cubic, ExponentialApproach, SmoothTrajectory
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)


def eight(t):
    return np.array([0.4 + 0.2 * np.sin(np.pi * t), 0.1 + 0.2 * np.sin(2 * np.pi * t)])


ways = {
    "Cubic": Cubic([0.2, -0.1], [0.6, 0.3], duration=1.5),
    "Circle": Circle([0.4, 0.1], radius=0.2, speed=np.pi),
    "ExponentialApproach": ExponentialApproach([0.2, -0.1], [0.6, 0.3], rate=3.0),
    "SmoothTrajectory": SmoothTrajectory(eight, duration=2.0),
}
times = np.linspace(0.0, 2.0, 20 if short else 400)
with style():
    figure, axes = new_figure(
        6.0, 3, len(ways), width=9.0, sharex="row", sharey="row", height_ratios=(2, 1, 1)
    )
    for (plane, speed, push), (name, way) in zip(axes.T, ways.items(), strict=True):
        motion = way(times)
        plane.plot(*motion.x.T)
        plane.set(title=name, aspect="equal", xlabel="x, m")
        speed.plot(times, motion.x_dot)
        push.plot(times, motion.x_ddot, label=["x", "y"])
        push.set(xlabel="time, s")
    for panel, label in zip(axes[:, 0], ("y, m", "velocity, m/s", "acceleration, m/s²"), strict=True):
        panel.set_ylabel(label)
    figure.legend(*push.get_legend_handles_labels(), loc="outside lower center", ncols=2)
save(figure, out / "desired_motions")
