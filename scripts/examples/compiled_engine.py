"""The compiled engine: the whole closed loop as generated C, and how much faster that is.

It is compared with the reference engine before it is used. The first run of a cell compiles; later ones
find what was compiled.
"""

from time import process_time

import numpy as np
from example import arguments

from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
experiment, duration, dt = planar_four(), 0.05 if short else 1.0, 1e-3
experiment.simulate(2 * dt, dt, engine="compiled")  # compiles
runs, times = {}, {}
for engine in ("pinocchio", "compiled"):
    start = process_time()
    runs[engine] = experiment.simulate(duration, dt, engine=engine)
    times[engine] = (process_time() - start) / (duration / dt)
print(*(f"{name}: {1e6 * time:.0f} µs a step" for name, time in times.items()), sep="\n")

ours, theirs = runs["compiled"], runs["pinocchio"]
with style():
    figure, axes = new_figure(3.0, 1, 2, width=7.5)
    bars = axes[0, 0].barh([*times], [1e6 * time for time in times.values()], height=0.5)
    axes[0, 0].bar_label(bars, fmt=" %.0f")
    axes[0, 0].margins(x=0.15)
    axes[0, 0].set(xlabel="processor time of a step, µs", title="the paper's four arms")
    axes[0, 1].semilogy(ours.t[1:], np.abs(ours.q - theirs.q).max(axis=(1, 2))[1:] + 1e-18)
    axes[0, 1].set(xlabel="time, s", ylabel="rad", title="largest difference of any joint")
save(figure, out / "compiled_engine")
