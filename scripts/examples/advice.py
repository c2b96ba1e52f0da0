"""Advice before anything runs: what gains will do, and what to change first.

The gains of this cell are too high for a controller that samples every 4 ms. The advice says which, and how
far down; the runs show both.
"""

import numpy as np
from example import arguments

from synctrl.analysis import advise
from synctrl.errors import SimulationError
from synctrl.experiments import a460_pair
from synctrl.experiments.a460_pair import GAINS
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
period, high = 4e-3, GAINS.replace(K_r=6 * GAINS.K_r, beta=60.0)
advice = advise(a460_pair(friction=False).cell, high, dt=2e-3, control_period=period)
print(advice)
with style():
    figure, axes = new_figure(2.8)
    for name, gains in {"as it was": high, "as advised": advice.changed}.items():
        made = a460_pair(friction=False, gains=gains)
        try:
            run = made.simulate(0.02 if short else 1.0, dt=2e-3, control_period=period)
        except SimulationError as stop:
            run = stop.result
        axes[0, 0].plot(run.t, 1e3 * np.linalg.norm(run.tracking_error[:, 0], axis=1), label=name)
    axes[0, 0].set(xlabel="time, s", ylabel="robot 1 off its path, mrad", ylim=(0, 40))
    axes[0, 0].legend()
save(figure, out / "advice")
