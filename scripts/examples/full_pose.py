"""A full pose: hands that keep their place on a thing that moves and turns, in position and orientation.

In `PoseSpace` a desired motion says where a hand is and how it is turned; `Attached` says it once, for the
thing, and where on it each hand is.
"""

import numpy as np
from example import arguments

from synctrl.experiments import ur5_payload
from synctrl.experiments.ur5_payload import PAYLOAD
from synctrl.show.animation import payload_scene
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
experiment = ur5_payload()
print(*experiment.cell.space.labels(experiment.cell.robots))
run = experiment.simulate(0.05 if short else 3.0, dt=2e-3)
payload_scene(run, PAYLOAD).write(out / "full_pose.html")

with style():
    figure, axes = new_figure(3.0, 1, 2, width=7.5)
    for k, name in enumerate(run.names):
        e = run.tracking_error[:, k]
        axes[0, 0].plot(run.t, 1e3 * np.linalg.norm(e[:, :3], axis=1), label=name)
        axes[0, 1].plot(run.t, np.rad2deg(np.linalg.norm(e[:, 3:], axis=1)), label=name)
    epsilon = run.sync_error[:, 0]
    axes[0, 0].plot(run.t, 1e3 * np.linalg.norm(epsilon[:, :3], axis=1), "k--", label="one beside the other")
    axes[0, 1].plot(run.t, np.rad2deg(np.linalg.norm(epsilon[:, 3:], axis=1)), "k--")
    axes[0, 0].set(title="position", ylabel="mm", xlabel="time, s", ylim=0)
    axes[0, 1].set(title="orientation", ylabel="deg", xlabel="time, s", ylim=0)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
save(figure, out / "full_pose")
