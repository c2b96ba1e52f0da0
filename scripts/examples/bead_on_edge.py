"""A bead of adhesive on the edge of a plate that another arm moves.

The nozzle follows the edge in the plate's own axes. Its colour in the animation is the error with which it
was laid. The arm with the plate is pushed.
"""

import numpy as np
from example import arguments

from synctrl.experiments import bead_on_edge
from synctrl.show import scene_of
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
engine, duration, log_dt = ("pinocchio", 2e-3, 2e-4) if short else ("compiled", 4.0, 1e-2)
with style():
    figure, axes = new_figure(2.8)
    for name in ("independent", "synchronized"):
        made = bead_on_edge(name == "synchronized", push=True)
        run = made.simulate(duration, dt=2e-4, log_dt=log_dt, engine=engine)
        missed = 1e3 * np.linalg.norm(run.outputs["bead_error"], axis=1)
        axes[0, 0].plot(run.t, missed, label=name)
    axes[0, 0].set(xlabel="time, s", ylabel="bead beside its place, mm", ylim=0)
    axes[0, 0].legend()
save(figure, out / "bead_on_edge")
scene_of(run).write(out / "bead_on_edge.html")
