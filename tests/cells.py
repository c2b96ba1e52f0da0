"""Cells nobody chose: random robots, motions, couplings and gains, and small cells that run fast."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from machines import random_robot, rate, rod_arm

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    ExponentialApproach,
    FunctionTrajectory,
    Gains,
    JointSpace,
    Member,
    load_robot,
)
from synctrl.control.controller import Signals
from synctrl.simulation.closed_loop import ClosedLoop
from synctrl.simulation.simulate import Experiment

COUPLINGS: dict[str, Callable[..., Coupling]] = {
    "pair": lambda n, c: Coupling.pair(c[:2] if np.ndim(c) else c),
    "ring": Coupling.ring,
    "chain": Coupling.chain,
}


def smooth_motion(rng: np.random.Generator, m: int, size: float = 1.0, center: np.ndarray | None = None):
    """Sines about a center, with their derivatives."""
    a, w, p = size * rng.uniform(-1, 1, m), rng.uniform(0.5, 2, m), rng.uniform(0, 6, m)
    center = rng.uniform(-1, 1, m) if center is None else center
    return FunctionTrajectory(
        lambda t: center + a * np.sin(w * t + p),
        lambda t: a * w * np.cos(w * t + p),
        lambda t: -a * w * w * np.sin(w * t + p),
    )


def moving_weights(rng: np.random.Generator, n: int, m: int):
    """Full matrices that turn with time and keep their inverse: t -> c, c', c''."""
    base = np.sign(rng.uniform(-1, 1, (n, 1, 1))) * rng.uniform(1.5, 3, (n, 1, 1)) * np.eye(m)
    swing = rng.uniform(-0.4, 0.4, (2, n, m, m))

    def weights(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        s, c = np.sin(2 * t), np.cos(3 * t)
        return (
            base + swing[0] * s + swing[1] * c,
            2 * swing[0] * np.cos(2 * t) - 3 * swing[1] * np.sin(3 * t),
            -4 * swing[0] * s - 9 * swing[1] * c,
        )

    return weights


def random_gains(rng: np.random.Generator, n: int, m: int, nv: int, parameters: int) -> Gains:
    """A different number in every place that may have one."""
    return Gains(
        Lambda=rng.uniform(1, 5, m),
        beta=rng.uniform(1, 5, m),
        K_r=rng.uniform(1, 5, (n, nv)),
        K_eps=rng.uniform(1, 5, m),
        Gamma=rng.uniform(0.1, 1, (n, parameters)),
    )


def random_experiment(
    seed: int, space: str = "joint", coupling: str = "ring", moving: bool = True, **options: str
) -> Experiment:
    """Four (or two) different robots with two or three task coordinates and a random coupling."""
    rng = np.random.default_rng(seed)
    n, m = (2 if coupling == "pair" else 4), (3 if space == "joint" else 2)
    if space == "joint":
        robots, task = [random_robot(int(rng.integers(2**31)), m) for _ in range(n)], JointSpace()
    else:
        rods = rng.uniform(0.3, 1.5, (n, 2, 2))
        robots = [
            rod_arm(tuple(mass), tuple(length)).placed(rng.uniform(-1, 1, 3), (0, 0, k))
            for k, (mass, length) in enumerate(rods)
        ]
        task = CartesianSpace("xy")
    q0 = rng.uniform(0.6, 1.5, (n, m))
    starts = [
        robot.tip_position(q)[:m] if space != "joint" else q for robot, q in zip(robots, q0, strict=True)
    ]
    members = [
        Member(robot, smooth_motion(rng, m, 0.05, start), q, theta_hat0=rng.uniform(-1, 1, 10 * robot.nv))
        for robot, start, q in zip(robots, starts, q0, strict=True)
    ]
    c = moving_weights(rng, n, m) if moving else rng.uniform(0.5, 2, (n, m, m)) + 2 * np.eye(m)
    cell = Cell(members, COUPLINGS[coupling](n, c=c), task)
    return Experiment(cell, random_gains(rng, n, m, m, 10 * m), 1.0, **options)


def random_state(loop: ClosedLoop, seed: int) -> np.ndarray:
    """A state near the initial one, moving."""
    rng = np.random.default_rng(seed)
    return loop.initial_state() + rng.uniform(-0.3, 0.3, loop.size)


def look(loop: ClosedLoop, t: float, y: np.ndarray) -> tuple[np.ndarray, Signals]:
    """y' and the signals at t, undisturbed."""
    return loop.evaluate(loop.cell.references(np.array([t]))[0], y, np.zeros((loop.cell.n, loop.cell.nv)))


def along(
    loop: ClosedLoop, t: float, y: np.ndarray, value: Callable[[float, np.ndarray, Signals], np.ndarray]
):
    """d/dt of something along the motion of the closed loop, by differences.

    The motion is replaced by its tangent at t, which has the same derivative there.
    """
    y_dot = look(loop, t, y)[0]
    return rate(lambda s: value(t + s, y + s * y_dot, look(loop, t + s, y + s * y_dot)[1]))


def small_cell(n: int = 2, way: float = 0.05, coupling: Coupling | None = None, name: str = "small") -> Cell:
    """Planar arms that each move their tip a few centimetres: runs in a blink."""
    arm = load_robot("planar2r")
    members = []
    for i in range(n):
        q0 = np.array([0.3 + 0.2 * i, 1.2 + 0.1 * i])
        placed = arm.placed((i, 0.0, 0.0), name=f"arm {i + 1}")
        start = placed.tip_position(q0)[:2]
        end = start + way * np.array([np.cos(i), np.sin(i)])
        members.append(Member(placed, ExponentialApproach(start, end, 3.0), q0))
    if coupling is None:
        coupling = Coupling.pair() if n == 2 else Coupling.chain(n)
    return Cell(members, coupling, CartesianSpace("xy"), name=name)


#: mild ones, for which a step of some milliseconds is accurate
SMALL_GAINS = Gains(Lambda=4.0, beta=4.0, K_r=1.0, K_eps=2.0, Gamma=0.2)
