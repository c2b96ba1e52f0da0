"""A network that is late: how much delay a cell takes, and how it then goes.

`delay_margin` looks at small errors of a pair of UR5 that stand still: beyond 21 ms a wrist begins to
swing, ever so slowly. In motion it is a matter of how long errors live.
"""

import numpy as np
from example import arguments

from synctrl import Network
from synctrl.analysis import delay_margin
from synctrl.experiments import ur5_payload
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
arms = ur5_payload()
margin = delay_margin(arms.cell, arms.gains)
print(margin)
with style():
    figure, axes = new_figure(3.2, 1, 2, width=7.5)
    delays = np.linspace(1e-3, 0.1, 4 if short else 41)
    axes[0, 0].plot(1e3 * delays, [margin.growth(delay) for delay in delays])
    axes[0, 0].axvline(1e3 * margin.delay, color="#b3001b", ls="--", lw=1)
    axes[0, 0].annotate(
        f" margin, {1e3 * margin.delay:.1f} ms", (1e3 * margin.delay, 0), color="#b3001b", va="top"
    )
    axes[0, 0].set(title="small errors", xlabel="delay, ms", ylabel="growth, 1/s")
    for delay in (0.0, 0.03, 0.1):
        run = ur5_payload(network=Network(delay=delay)).simulate(0.02 if short else 1.5, dt=2e-3)
        angle = np.rad2deg(np.linalg.norm(run.sync_error[:, 0, 3:], axis=1))
        axes[0, 1].plot(run.t, angle, label=f"{1e3 * delay:g} ms late")
    axes[0, 1].set(title="a run: one hand turned beside the other", xlabel="time, s", ylabel="deg", ylim=0)
    axes[0, 1].legend()
save(figure, out / "network_delay")
