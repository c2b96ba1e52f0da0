"""A loop of your own: the controller is an object that is called once a period, here with a plant of ours.

On a robot, read its encoders in place of `q` and `v`, and send it the torque.
"""

import numpy as np
from example import arguments

from synctrl.experiments import ur5_payload
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
period = 2e-3  # s
experiment = ur5_payload()
controller = experiment.controller(
    period, faults="hold"
)  # a reading that is none: what was asked for is held
plant, (q, v) = experiment.closed_loop().plant, (experiment.cell.q0, experiment.cell.v0)
times, apart = period * np.arange(10 if short else 750), []
controller.reset(0.0, q, v)
for t in times:
    tau = controller.step(t, q, v)
    v = v + period * plant.acceleration(q, v, tau)
    q = q + period * v
    apart.append(controller.signals.epsilon[0])
controller.save(out / "controller.npz")  # what it has learned, to go on with tomorrow
apart = np.array(apart)
with style():
    figure, axes = new_figure(2.8)
    axes[0, 0].semilogy(times, 1e3 * np.linalg.norm(apart[:, :3], axis=1), label="position, mm")
    axes[0, 0].semilogy(times, np.rad2deg(np.linalg.norm(apart[:, 3:], axis=1)), label="orientation, deg")
    axes[0, 0].set(xlabel="time, s", ylabel="one hand beside the other")
    axes[0, 0].legend()
save(figure, out / "own_loop")
