"""MuJoCo as the plant: another library, which reads the robots' files by itself, judges the physics.

The controller is the same, with Pinocchio's regressor. What differs is rounding and integration alone.
"""

import numpy as np
from example import arguments

from synctrl.experiments import mixed_four
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
duration = 0.02 if short else 1.0
ours, theirs = (mixed_four().simulate(duration, dt=2e-3, plant=name) for name in ("pinocchio", "mujoco"))
with style():
    figure, axes = new_figure(3.2, 1, 2, width=7.5)
    for k, name in enumerate(ours.names):
        axes[0, 0].plot(ours.t, 1e3 * np.linalg.norm(theirs.tracking_error[:, k], axis=1), label=name)
        difference = np.linalg.norm(ours.q[:, k] - theirs.q[:, k], axis=1)
        axes[0, 1].semilogy(ours.t[1:], difference[1:], label=name)
    axes[0, 0].set(title="errors with MuJoCo as the plant", xlabel="time, s", ylabel="mm", ylim=0)
    axes[0, 1].set(title="joints, MuJoCo less Pinocchio", xlabel="time, s", ylabel="rad")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
save(figure, out / "mujoco_plant")
