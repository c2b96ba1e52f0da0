"""An adaptation of your own: one that does not learn from velocity errors small enough to be noise.

Its storage is its part in the proof, and what it adds to V' is named: the certificate then says what it
costs.
"""

import numpy as np
from example import arguments

from synctrl.analysis import certify
from synctrl.experiments import a460_pair
from synctrl.show.lyapunov_plots import lyapunov_figure
from synctrl.show.plots import save


class DeadZone:
    def __init__(self, Gamma, width):
        self.Gamma, self.width = Gamma, width

    def bind(self, cell):
        self.start = cell.theta_hat0.copy  # z at t = 0
        return self

    def awake(self, seen):
        return np.linalg.norm(seen.s_q, axis=1, keepdims=True) > self.width

    def rate(self, z, seen):
        return self.Gamma * seen.gradient * self.awake(seen)

    def estimate(self, z):
        return z

    settle = estimate  # what becomes of z after a step

    def storage(self, z, theta):
        return 0.5 * np.sum((theta - z) ** 2) / self.Gamma

    def storage_rate(self, z, z_dot, theta):
        return -np.sum((theta - z) * z_dot) / self.Gamma

    def powers(self, z, theta, seen):
        return {"dead zone": np.sum((theta - z) * seen.gradient * ~self.awake(seen))}

    def as_dict(self):
        return {"Gamma": self.Gamma, "width": self.width}


out, short = arguments(__doc__)
run = a460_pair(friction=False, adaptation=DeadZone(0.3, 2e-2)).simulate(0.02 if short else 2.0)
certificate = certify(run)
print(certificate)
save(lyapunov_figure(certificate.lyapunov), out / "own_adaptation")
