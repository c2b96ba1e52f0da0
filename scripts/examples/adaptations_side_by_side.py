"""Adaptations side by side: how fast each brings the robots to their paths, and what it learns.

All run under the paper's law in the paper's cell, with its first estimate, 0.7 of the true parameters.
"""

import numpy as np
from example import arguments

from synctrl.control.adaptation import Composite, Gradient, Leakage, Natural
from synctrl.experiments import a460_pair
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
ways = {
    "none": Gradient(0.0),
    "Gradient, as in the paper": Gradient(0.3),
    "Leakage": Leakage(0.3, 0.5),
    "Natural": Natural(0.1),
    "Composite": Composite(0.3, prediction=2.0, bandwidth=20.0),
}
with style():
    figure, axes = new_figure(3.4, 1, 2, width=7.5)
    for name, way in ways.items():
        run = a460_pair(friction=False, adaptation=way).simulate(0.02 if short else 3.0, dt=1e-3, log_dt=5e-3)
        theta = np.array([robot["theta"] for robot in run.info["robots"]])
        first, now = (np.linalg.norm(run.theta_hat[k] - theta, axis=-1) for k in (0, slice(None)))
        axes[0, 0].plot(run.t, 1e3 * np.linalg.norm(run.tracking_error, axis=2).max(axis=1), label=name)
        axes[0, 1].plot(run.t, (now / first)[:, 0], label=name)
    axes[0, 0].set(title="off the path", xlabel="time, s", ylabel="mrad", ylim=0)
    axes[0, 1].set(title="error of the estimates, robot 1", xlabel="time, s", ylabel="of the first one")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
save(figure, out / "adaptations_side_by_side")
