"""Integrators: fixed steps of Runge and Kutta, and adaptive methods of SciPy that judge them.

How far a run with fixed steps is from one whose steps are chosen to be exact to ten digits, over the step.
It falls with the fourth power, until rounding is all that is left.
"""

import warnings

import numpy as np
from example import arguments

from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
steps = (2e-3, 1e-3) if short else (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4)
experiment, duration = planar_four(), 0.02 if short else 0.2
judge = experiment.simulate(duration, dt=max(steps), integrator="DOP853", rtol=1e-12, atol=1e-14)
errors = []
for dt in steps:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of steps that are too long: some are meant to be
        run = experiment.simulate(duration, dt=dt)
    errors.append(np.abs(run.q[-1] - judge.q[-1]).max())
    print(f"dt = {1e3 * dt:g} ms: {errors[-1]:.2g} rad off")
with style():
    figure, axes = new_figure(3.0)
    axes[0, 0].loglog(1e3 * np.array(steps), errors, "o-", label="rk4")
    fourth = errors[0] * (np.array(steps) / steps[0]) ** 4
    axes[0, 0].loglog(1e3 * np.array(steps), fourth, "k--", lw=1, label="fourth power")
    axes[0, 0].set(xlabel="step, ms", ylabel="error at the end, rad")
    axes[0, 0].set_xticks(1e3 * np.array(steps), [f"{1e3 * dt:g}" for dt in steps])
    axes[0, 0].minorticks_off()
    axes[0, 0].legend()
save(figure, out / "integrators")
