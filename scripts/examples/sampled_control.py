"""Sampled control: a controller that is called once a period, and how long a period a cell takes.

Torque and adaptation are held in between, as on a digital controller. A run that has to stop says which
robot and joint, when and why, and hands over what there is.
"""

import numpy as np
from example import arguments

from synctrl.errors import SimulationError
from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
with style():
    figure, axes = new_figure(2.8)
    for period in (2e-3, 8e-3, 1e-2):
        try:
            run = planar_four().simulate(0.02 if short else 0.4, dt=2e-3, control_period=period)
        except SimulationError as stop:
            print(f"{1e3 * period:g} ms: {stop}")
            run = stop.result
        axes[0, 0].plot(
            run.t, 1e3 * np.linalg.norm(run.tracking_error[:, 0], axis=1), label=f"{1e3 * period:g} ms"
        )
    axes[0, 0].set(xlabel="time, s", ylabel="arm 1 off its path, mm", ylim=(0, 20))
    axes[0, 0].legend()
save(figure, out / "sampled_control")
