"""Encoders that count, velocities that are differences of what they count, and motors that lag.

The log has the true motion; what the controller was told is an output beside it.
"""

import numpy as np
from example import arguments

from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style
from synctrl.simulation.devices import DifferencedVelocity, Lag, Noise, Quantisation

out, short = arguments(__doc__)
duration = 0.05 if short else 1.0
cells = {
    "ideal": planar_four(),
    "16 bits, motors that lag": planar_four(
        sensors=[Noise(q=1e-5, seed=1), Quantisation(2 * np.pi / 2**16), DifferencedVelocity(omega=300.0)],
        actuators=[Lag(0.5e-3)],
    ),
}
runs = {name: cell.simulate(duration, dt=5e-4, control_period=1e-3) for name, cell in cells.items()}
with style():
    figure, axes = new_figure(4.6, 2, 1, sharex=True)
    for name, run in reversed(runs.items()):
        seen = run.outputs["measured_v"][:, 0, 0] if "measured_v" in run.outputs else run.v[:, 0, 0]
        axes[0, 0].plot(run.t, np.rad2deg(seen), lw=0.8, label=name)
        axes[1, 0].plot(run.t, run.tau[:, 0, 0], lw=0.8, label=name)
    axes[0, 0].set(title="velocity of joint 1 as the controller knows it", ylabel="deg/s")
    axes[1, 0].set(title="torque that it asks for", ylabel="N·m", xlabel="time, s")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
save(figure, out / "noisy_sensors")
