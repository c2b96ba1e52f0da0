"""Lost messages: four arms that tell each other every 10 ms what they know, and of that half gets through.

What one message brings makes up for all that were lost before, for it holds integrals and not differences.
"""

import numpy as np
from example import arguments

from synctrl import Network
from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
with style():
    figure, axes = new_figure(3.2, 1, 2, width=7.5)
    for loss in (0.0, 0.5, 0.9):
        network = Network(period=0.01, delay=0.005, loss=loss, seed=1)
        run = planar_four(disturbance="torque", network=network).simulate(
            0.1 if short else 2.0, dt=5e-4, log_dt=5e-3
        )
        size, label = 1e3 * np.linalg.norm(run.sync_error, axis=2).max(axis=1), f"{loss:.0%} lost"
        axes[0, 0].plot(run.t, size, label=label)
        axes[0, 1].plot(run.t, 1e3 * run.outputs["message_age"].max(axis=1), lw=0.9, label=label)
    axes[0, 0].set(title="largest synchronization error", xlabel="time, s", ylabel="10⁻³ m²", ylim=0)
    axes[0, 1].set(title="age of the oldest message that counts", xlabel="time, s", ylabel="ms", ylim=0)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
save(figure, out / "lost_messages")
