"""Friction that nobody told the controller of, and friction that it learns.

Among the parameters of `FrictionParameters` are the coefficients of every joint; then they are adapted as
masses are.
"""

import numpy as np
from example import arguments

from synctrl.experiments import a460_pair
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
cells = {
    "no friction": a460_pair(friction=False),
    "friction, unknown": a460_pair(),
    "friction, adapted": a460_pair(adapt_friction=True),
}
duration = 0.05 if short else 4.0
runs = {name: cell.simulate(duration, dt=5e-4, log_dt=2e-3) for name, cell in cells.items()}
with style():
    figure, axes = new_figure(3.2, 1, 2, width=7.5)
    for name, run in runs.items():
        for panel, e in zip(axes[0], (run.tracking_error, run.sync_error), strict=True):
            panel.plot(run.t, 1e3 * np.linalg.norm(e, axis=2).max(axis=1), label=name)
    axes[0, 0].set(title="off the path", xlabel="time, s", ylabel="mrad", ylim=0)
    axes[0, 1].set(title="out of step", xlabel="time, s", ylim=0)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
save(figure, out / "friction")
