"""Weights that move: two wheels turn as a curve demands, whose radius changes on the way.

Example 2 of the paper: a vehicle stays on its path as long as the angles of its wheels, each over the
radius of its track, agree. The weights of the errors are these radii, functions of time.
"""

import numpy as np
from example import arguments

from synctrl.experiments import mobile_robot
from synctrl.experiments.mobile_robot import TRACK, WHEEL_RADIUS
from synctrl.show.animation import vehicle_animation, vehicle_path
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
duration = 0.5 if short else None
runs = {
    name: mobile_robot(name == "synchronized").simulate(duration, dt=1e-2)
    for name in ("independent", "synchronized")
}
vehicle_animation(runs["synchronized"], WHEEL_RADIUS, TRACK).write(out / "weights_that_move.html")

with style():
    figure, axes = new_figure(3.4, 1, 2, width=7.5)
    for name, run in runs.items():
        driven = vehicle_path(run.x[..., 0], WHEEL_RADIUS, TRACK)
        planned = vehicle_path(run.x_desired[..., 0], WHEEL_RADIUS, TRACK)
        axes[0, 0].plot(*driven.T[:2], label=name)
        axes[0, 1].plot(run.t, np.rad2deg(driven[:, 2] - planned[:, 2]), label=name)
    axes[0, 0].plot(*planned.T[:2], "k-.", lw=1, label="planned")
    axes[0, 0].set(xlabel="x, m", ylabel="y, m", aspect="equal", title="way of the vehicle")
    axes[0, 1].set(xlabel="time, s", ylabel="heading off by, deg", title="what the wheels make of it")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
save(figure, out / "weights_that_move")
