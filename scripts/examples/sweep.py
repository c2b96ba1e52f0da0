"""A sweep: the same cell with hundreds of gains and first estimates, as a table of pandas.

Rows are written as they come; what was interrupted goes on where it was. With `workers=` it takes more
processes, with `backend="dask"` a cluster.
"""

from tempfile import TemporaryDirectory

import numpy as np
from example import arguments

from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style
from synctrl.sweep import LogUniform, Sweep, Uniform, gain, load, model_error

out, short = arguments(__doc__)
factors = [
    gain("beta", LogUniform(5, 150)),
    gain("Lambda", LogUniform(2, 50)),
    model_error(Uniform(-0.9, 0.5)),
]
options = {"duration": 0.02, "samples": 4} if short else {"duration": 1.0, "samples": 400}
sweep = Sweep(planar_four(), factors, seed=0, dt=1e-3, **options)
with TemporaryDirectory() as folder:
    sweep.run(f"{folder}/rows", workers=1, progress=False)
    table = load(f"{folder}/rows")
done = table[table["status"] == "completed"]
print(
    done[["beta", "Lambda", "sync_rms", "tracking_rms", "peak_torque"]].describe().loc[["min", "50%", "max"]]
)
with style():
    figure, axes = new_figure(3.6)
    x, y = 1e3 * done["tracking_rms"], 1e3 * done["sync_rms"]
    dots = axes[0, 0].scatter(x, y, s=9, c=np.log10(done["beta"]), cmap="viridis", lw=0)
    bar = figure.colorbar(dots, ax=axes[0, 0], label="β, 1/s", ticks=np.log10([5, 15, 50, 150]))
    bar.ax.set_yticklabels(["5", "15", "50", "150"])
    axes[0, 0].set(xscale="log", yscale="log", xlabel="tracking error, rms, mm")
    axes[0, 0].set_xticks([0.5, 1, 2, 5], ["0.5", "1", "2", "5"])
    axes[0, 0].minorticks_off()
    axes[0, 0].set_ylabel("synchronization error, rms, 10⁻³ m²")
save(figure, out / "sweep")
