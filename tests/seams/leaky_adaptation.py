"""An adaptation of one's own: (14) that forgets, theta_hat' = Gamma Y^T s_q - nu (theta_hat - theta_hat0).
Its storage is that of (14); the leakage adds the power nu tilde^T Gamma^-1 (theta_hat - theta_hat0)."""

import numpy as np


class Leaky:
    def __init__(self, Gamma: float, nu: float):
        self.Gamma, self.nu = Gamma, nu

    def bind(self, cell):
        return BoundLeaky(self.Gamma, self.nu, cell.theta_hat0)

    def as_dict(self):
        return {"name": "Leaky", "Gamma": self.Gamma, "nu": self.nu}


class BoundLeaky:
    def __init__(self, Gamma, nu, theta_hat0):
        self.Gamma, self.nu, self.theta_hat0 = Gamma, nu, theta_hat0

    def start(self):
        return self.theta_hat0.copy()

    def rate(self, z, seen):
        return self.Gamma * seen.gradient - self.nu * (z - self.theta_hat0)

    def estimate(self, z):
        return z

    settle = estimate

    def storage(self, z, theta):
        return float(0.5 * np.sum((theta - z) ** 2) / self.Gamma)

    def storage_rate(self, z, z_dot, theta):
        return float(-np.sum((theta - z) * z_dot) / self.Gamma)

    def powers(self, z, theta, seen):
        return {"leakage": float(self.nu * np.sum((theta - z) * (z - self.theta_hat0)) / self.Gamma)}
