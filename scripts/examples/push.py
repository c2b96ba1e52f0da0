"""A push: one arm of four is disturbed, and the others follow it, so that they stay together.

The paper's own cell: 1 N·m for a quarter of a second. What a pushed robot costs its neighbours, and what
they spare it.
"""

import numpy as np
from example import arguments

from synctrl.experiments import planar_four
from synctrl.show import side_by_side
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
runs = {
    name: planar_four(name == "synchronized", disturbance="torque").simulate(
        0.6 if short else 2.0, dt=5e-4, log_dt=5e-3
    )
    for name in ("independent", "synchronized")
}
side_by_side(runs).write(out / "push.html")
with style():
    figure, axes = new_figure(3.2, 1, 2, width=7.5, sharey=True)
    for panel, (name, run) in zip(axes[0], runs.items(), strict=True):
        for k, robot in enumerate(run.names):
            panel.plot(run.t, 1e3 * np.linalg.norm(run.tracking_error[:, k], axis=1), label=robot)
        panel.axvspan(0.5, 0.75, color="#b3001b", alpha=0.12, lw=0, label="push on arm 1")
        panel.set(title=name, xlabel="time, s", xlim=(0, run.t[-1]))
    axes[0, 0].set(ylabel="off the path, mm", ylim=0)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
save(figure, out / "push")
