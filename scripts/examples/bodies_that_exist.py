"""Estimates of bodies that can exist: the paper's adaptation leaves them, `Natural` never does.

Ten numbers are the parameters of a body if its pseudo-inertia has no eigenvalue below zero.
"""

import numpy as np
from example import arguments

from synctrl.analysis.consistency import physical_consistency
from synctrl.control.adaptation import Natural
from synctrl.experiments import a460_pair
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
duration = 0.02 if short else 2.0
cells = {"Gradient, as in the paper": a460_pair(), "Natural": a460_pair(adaptation=Natural(0.1))}
with style():
    figure, axes = new_figure(2.8)
    for name, cell in cells.items():
        found = physical_consistency(cell.simulate(duration, dt=5e-4, log_dt=5e-3))
        print(f"{name}: {found}")
        axes[0, 0].plot(
            found.t, 1e3 * np.min([robot.min(axis=1) for robot in found.smallest], axis=0), label=name
        )
    axes[0, 0].axhspan(-100, 0, color="#b3001b", alpha=0.12, lw=0, label="no such body")
    axes[0, 0].set(xlabel="time, s", xlim=(0, duration), ylim=(-8, 8))
    axes[0, 0].set_ylabel("smallest eigenvalue, 10⁻³ kg·m²")
    figure.legend(loc="outside lower center", ncols=3)
save(figure, out / "bodies_that_exist")
