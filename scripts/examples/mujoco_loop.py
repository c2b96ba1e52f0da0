"""In MuJoCo's own loop: a cell becomes a model of MuJoCo, and the controller drives it.

`mujoco_model` gives the model, and an object that knows which of its joints are whose.
"""

import mujoco
import numpy as np
from example import arguments

from synctrl import mujoco_model
from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
experiment = planar_four()
controller = experiment.controller(period=2e-3)
model, joints = mujoco_model(experiment.cell, timestep=1e-3)
data = mujoco.MjData(model)
joints.write(data, experiment.cell.q0, experiment.cell.v0)
controller.reset(data.time, *joints.read(data))
times, epsilon = [], []
while data.time < (0.02 if short else 1.5):
    joints.command(data, controller.step(data.time, *joints.read(data)))
    mujoco.mj_step(model, data, nstep=2)
    times.append(data.time)
    epsilon.append(1e3 * np.linalg.norm(controller.signals.epsilon, axis=1))
with style():
    figure, axes = new_figure(2.8)
    axes[0, 0].plot(times, epsilon, label=["arms 1 and 2", "arms 2 and 3", "arms 3 and 4", "arms 4 and 1"])
    axes[0, 0].set(xlabel="time, s", ylabel="synchronization error, 10⁻³ m²", ylim=0)
    axes[0, 0].legend()
save(figure, out / "mujoco_loop")
