"""A law of your own: a class with `bind` and `command`, from errors to a reference motion and a force.

This one tracks, and adds a spring between neighbours that gets soft where they are far apart, so that
nobody is pulled hard. It is logged, saved, compared and certified as those of the package are.
"""

import numpy as np
from example import arguments

from synctrl.control.laws import Asked, SlotineLi
from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style


class SoftSprings:
    independent = True  # it has no place for the gains beta and K_eps

    def __init__(self, stiffness, width):
        self.stiffness, self.width = stiffness, width

    def bind(self, cell, gains):
        self.Lambda = gains.Lambda
        return self  # good for one cell

    def command(self, errors):
        velocity, acceleration = errors.rates + self.Lambda * errors.error
        pull = self.stiffness * np.tanh(errors.sigma / self.width) * self.width
        return Asked(velocity, acceleration, np.matvec(errors.c.mT, pull))

    def as_dict(self):
        return {"name": "SoftSprings", "stiffness": self.stiffness, "width": self.width}


out, short = arguments(__doc__)
with style():
    figure, axes = new_figure(2.8)
    for law in (SlotineLi(), SoftSprings(50.0, 0.01)):
        run = planar_four(disturbance="torque", law=law).simulate(0.1 if short else 2.0, dt=1e-3)
        size = 1e3 * np.linalg.norm(run.sync_error, axis=2).max(axis=1)
        axes[0, 0].plot(run.t, size, label=run.info["law"]["name"])
    axes[0, 0].set(xlabel="time, s", ylabel="out of step, 10⁻³ m²", ylim=0)
    axes[0, 0].legend()
save(figure, out / "own_law")
