"""A payload is picked up, and put down again: nobody tells the controller, and it learns.

Robot 1 of two A460 takes 2 kg in its hand at 1 s and lets go at 2.5 s.
"""

from dataclasses import replace

import numpy as np
from example import arguments

from synctrl import Payload
from synctrl.experiments import a460_pair
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
start, stop = (0.02, 0.04) if short else (1.0, 2.5)
payload = Payload(robot=0, mass=2.0, start=start, stop=stop)
runs = {}
for name in ("independent", "synchronized"):
    experiment = replace(a460_pair(name == "synchronized", friction=False), payloads=[payload])
    runs[name] = experiment.simulate(2 * stop if short else 4.0, dt=1e-3)

with style():
    figure, axes = new_figure(3.4, 1, 2, width=7.5)
    for name, run in runs.items():
        axes[0, 0].plot(run.t, 1e3 * np.linalg.norm(run.sync_error[:, 0], axis=1), label=name)
        axes[0, 1].plot(run.t, run.tau[:, 0, 1], label=name)
    for panel in axes[0]:
        panel.axvspan(start, stop, color="#a3acb7", alpha=0.3, lw=0, label="2 kg in the hand of robot 1")
        panel.set(xlabel="time, s", xlim=(0, run.t[-1]))
    axes[0, 0].set(title="out of step", ylabel="mrad", ylim=0)
    axes[0, 1].set(title="torque of its joint 2", ylabel="N·m")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
save(figure, out / "payload_picked_up")
