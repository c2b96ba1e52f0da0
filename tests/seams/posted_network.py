"""A network of one's own: robots hear of each other once in a period T, and what they heard holds."""

import numpy as np

from synctrl.control.network import Received


class Posted:
    def __init__(self, T):
        self.T = T

    def bind(self, cell):
        return BoundPosted(self.T, cell.coupling, cell.m)

    def as_dict(self):
        return {"name": "Posted", "T": self.T}


class BoundPosted:
    def __init__(self, T, coupling, m):
        self.T, self.coupling, self.m, self.n = T, coupling, m, coupling.robots
        self.own = np.diag(np.diag(coupling.matrix.T @ coupling.matrix))
        self.others = coupling.matrix.T @ coupling.matrix - self.own

    def start(self):
        return np.zeros((2 * self.n + self.coupling.pairs, self.m))  # what was heard, int epsilon, E

    def messages(self, start, end):
        return self.T * np.arange(*np.ceil([start / self.T, end / self.T]))

    def meet(self, t, w, memory):
        return np.concatenate((w[0], memory[self.n :]))

    def exchange(self, t, w, memory):
        (epsilon, epsilon_dot), heard = self.coupling.compare(w), memory[: self.n]
        shares = np.stack((memory[-self.n :], self.own @ w[0] + self.others @ heard, self.own @ w[1]))
        return Received(epsilon, epsilon_dot, shares, np.concatenate((0 * heard, epsilon, shares[1])))

    def integral(self, memory):
        return memory[self.n : -self.n]
