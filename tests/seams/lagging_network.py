"""A network of one's own: what neighbours say arrives through a lag, T h' = w - h, h(0) = 0.
Its memory is h, (n, m), the integrals of epsilon, (p, m), and E, (n, m)."""

import numpy as np

from synctrl import Cell
from synctrl.control.network import Received


class Lagging:
    def __init__(self, T: float):
        self.T = T

    def bind(self, cell: Cell) -> "BoundLagging":
        return BoundLagging(self.T, cell.coupling, cell.m)

    def as_dict(self) -> dict:
        return {"name": "Lagging", "T": self.T}


class BoundLagging:
    def __init__(self, T: float, coupling, m: int):
        self.T, self.coupling, self.m, S = T, coupling, m, coupling.matrix
        self.p, self.n = S.shape
        self.own = np.diag(np.diag(S.T @ S))
        self.others = S.T @ S - self.own

    def start(self):
        return np.zeros((2 * self.n + self.p) * self.m)

    def exchange(self, t, w, memory):
        heard, _, E = np.split(memory.reshape(-1, self.m), [self.n, self.n + self.p])
        heard_dot = (w[0] - heard) / self.T
        sigma, sigma_dot = self.own @ w + self.others @ np.stack((heard, heard_dot))
        epsilon, epsilon_dot = self.coupling.compare(w)
        memory_dot = np.concatenate((heard_dot, epsilon, sigma)).ravel()
        return Received(epsilon, epsilon_dot, np.stack((E, sigma, sigma_dot)), memory_dot)

    def integral(self, memory):
        return memory.reshape(-1, self.m)[self.n : self.n + self.p]
