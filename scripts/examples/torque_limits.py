"""Limits of torque: what is learned while torque is cut off, with and without bounds of the estimates.

A push of 300 N·m is more than the motors of the arm have. An adaptation that goes on learning takes the
missing torque for mass; bounds keep its estimates where bodies can be.
"""

import warnings
from dataclasses import replace

import numpy as np
from example import arguments

from synctrl import Disturbance
from synctrl.control.adaptation import Gradient
from synctrl.experiments import a460_pair
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
start, stop = (0.01, 0.03) if short else (0.5, 0.65)
made = a460_pair(friction=False)
pushed = replace(made, disturbances=[Disturbance(0, 300.0, start, stop)], saturate=True)
plain = replace(pushed, adaptation=Gradient(0.3), gains=made.gains.replace(Gamma=None))
with warnings.catch_warnings():
    warnings.simplefilter("ignore", UserWarning)  # of torque that was cut off: here it is meant
    runs = {
        name: experiment.simulate(0.04 if short else 2.0, dt=1e-3)
        for name, experiment in {"bounded": pushed, "as it is": plain}.items()
    }
with style():
    figure, axes = new_figure(3.2, 1, 2, width=7.5)
    for name, run in runs.items():
        axes[0, 0].semilogy(run.t, np.abs(run.theta_hat[:, 0]).max(axis=1), label=name)
        axes[0, 1].semilogy(run.t, np.abs(run.tracking_error[:, 0]).max(axis=1), label=name)
    for panel in axes[0]:
        panel.axvspan(start, stop, color="#b3001b", alpha=0.12, lw=0, label="push")
        panel.set(xlabel="time, s", xlim=(0, run.t[-1]))
    axes[0, 0].set(title="largest estimate of robot 1", ylabel="SI units")
    axes[0, 1].set(title="off the path", ylabel="rad")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
save(figure, out / "torque_limits")
