"""Two UR5 in MuJoCo's own loop, driven by the digital controller: no simulator of ours takes part."""

import mujoco
import numpy as np

import synctrl
from synctrl.experiments import ur5_payload

experiment = ur5_payload()
controller = experiment.controller(period=2e-3)
model, joints = synctrl.mujoco_model(experiment.cell, timestep=1e-3)
data = mujoco.MjData(model)
joints.write(data, experiment.cell.q0, experiment.cell.v0)
controller.reset(data.time, *joints.read(data))

errors = []
for _ in range(1000):  # two seconds
    joints.command(data, controller.step(data.time, *joints.read(data)))
    errors.append(controller.signals.epsilon)
    for _ in range(2):
        mujoco.mj_step(model, data)

epsilon = 1e3 * np.linalg.norm(np.array(errors)[:, 0, :3], axis=1)
print(f"synchronization error of the hands: {epsilon[0]:.1f} mm at first, {epsilon[-1]:.3f} mm after 2 s")
