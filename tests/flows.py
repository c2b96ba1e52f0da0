"""Smooth motions with known derivatives, and finite differences, for the tests of task spaces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from synctrl import FunctionOrientation, FunctionTrajectory, PoseTrajectory, Robot
from synctrl.tasks.rotations import exp
from synctrl.tasks.trajectories import Trajectory

H = 1e-3


def derivative(f: Callable[[float], np.ndarray], t: float, h: float = H) -> np.ndarray:
    """d/dt f by the five-point rule, whose error falls with h^4."""
    return (f(t - 2 * h) - 8 * f(t - h) + 8 * f(t + h) - f(t + 2 * h)) / (12 * h)


class Sines:
    """x(t) = offset + sum_k a_k sin(w_k t + p_k), for arrays of any shape."""

    def __init__(self, rng: np.random.Generator, shape: tuple[int, ...], offset: np.ndarray | float = 0.0):
        self.offset = offset
        self.a = rng.uniform(-0.5, 0.5, (3, *shape))
        self.w = rng.uniform(0.3, 1.5, 3).reshape(3, *[1] * len(shape))
        self.p = rng.uniform(0, 6, (3, *shape))

    def __call__(self, t: float) -> np.ndarray:
        return self.offset + (self.a * np.sin(self.w * t + self.p)).sum(0)

    def dot(self, t: float) -> np.ndarray:
        return (self.a * self.w * np.cos(self.w * t + self.p)).sum(0)

    def ddot(self, t: float) -> np.ndarray:
        return (-self.a * self.w**2 * np.sin(self.w * t + self.p)).sum(0)


def joint_flow(rng: np.random.Generator, robots: list[Robot]) -> Sines:
    """A joint motion of all robots, (n, nv), zero for joints a robot does not have."""
    nv = max(robot.nv for robot in robots)
    exists = np.array([np.arange(nv) < robot.nv for robot in robots])
    offset = rng.uniform(0.5, 1.2, exists.shape) * rng.choice([-1, 1], exists.shape) * exists
    flow = Sines(rng, exists.shape, offset)
    flow.a = flow.a * exists
    return flow


def desired_flow(rng: np.random.Generator, m: int) -> Trajectory:
    """A smooth desired motion: of m coordinates, or of a full pose if m is 6."""
    position = Sines(rng, (3 if m == 6 else m,))
    trajectory = FunctionTrajectory(position, position.dot, position.ddot)
    return PoseTrajectory(trajectory, tumbling(rng)) if m == 6 else trajectory


def tumbling(rng: np.random.Generator) -> FunctionOrientation:
    """R = exp(a(t) n1) exp(b(t) n2) with two fixed axes, whose angular velocity is known in closed form."""
    n1, n2 = (n / np.linalg.norm(n) for n in rng.standard_normal((2, 3)))
    a, b = Sines(rng, (1,)), Sines(rng, (1,))

    def second(t: float) -> np.ndarray:
        return exp(a(t) * n1) @ n2

    return FunctionOrientation(
        lambda t: exp(a(t) * n1) @ exp(b(t) * n2),
        lambda t: a.dot(t) * n1 + b.dot(t) * second(t),
        lambda t: a.ddot(t) * n1 + b.ddot(t) * second(t) + a.dot(t) * b.dot(t) * np.cross(n1, second(t)),
    )
