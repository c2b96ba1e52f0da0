"""Suggested gains on every arm of the catalogue, in joint, position and pose space, with and without a load.

    python scripts/bench_gains.py [--arms NAME ...] [--bandwidth OMEGA] [--naive] [--short]

A run is a success if it is completed, its error after 3 s is below 5 % of the motion, and no torque is larger
than 3 times the largest of exact computed torque. Prints a row per arm and space, and the sums.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from synctrl import (
    AxisRotation,
    CartesianSpace,
    Cell,
    Coupling,
    Experiment,
    Friction,
    Gains,
    JointSpace,
    Member,
    Payload,
    PoseSpace,
    PoseTrajectory,
    Robot,
    SynctrlError,
    load_robot,
)
from synctrl.control.excursion import POINTS, excursion
from synctrl.robots.catalog import catalog_names
from synctrl.robots.mechanism import joint_limits
from synctrl.robots.payload import carrying
from synctrl.tasks.trajectories import Motion

#: rad/s; s; s, of the motion there and back; share of the true parameters that is known; kg
BANDWIDTH, DURATION, RETURN, KNOWN, LOAD = 8.0, 3.0, 4.0, 0.7, 2.0
#: how far the joints go, rad; the tip, as a share of its reach; its orientation, rad
SWING, SHIFT, TURN = 0.5, 0.1, 0.4
#: what a success is: error over motion at the end, torque over that of exact computed torque
LAST_ERROR, TORQUE = 0.05, 3.0
SPACES = ("joint", "position", "pose")
#: period of sampled control, s; None is continuous control with RK4 of 1 ms
PERIODS = (None, 1e-3, 2e-3, 4e-3)
NAIVE = Gains(Lambda=BANDWIDTH, beta=BANDWIDTH / 2, K_r=80.0, K_eps=10.0, Gamma=0.3)


class Outcome(NamedTuple):
    """Of one run: what the success is judged by; `status` says why if it was not completed."""

    status: str
    error: float
    torque: float

    @property
    def good(self) -> bool:
        return self.status == "completed" and self.error < LAST_ERROR and self.torque < TORQUE


class Swing(NamedTuple):
    """start + way (1 - cos(w t))/2: there and back, from rest."""

    start: np.ndarray
    way: np.ndarray
    breaks: tuple[float, ...] = ()

    @property
    def dimension(self) -> int:
        return self.start.size

    def __call__(self, t: ArrayLike) -> Motion:
        w, half = 2 * np.pi / RETURN, self.way / 2
        phase = w * np.asarray(t, dtype=float)[..., None]
        return Motion(
            self.start + half * (1 - np.cos(phase)), half * w * np.sin(phase), half * w * w * np.cos(phase)
        )


class Task(NamedTuple):
    """One arm in one space: where it starts, and what it is to do."""

    robot: Robot
    space: JointSpace | CartesianSpace | PoseSpace
    q0: np.ndarray
    path: Swing | PoseTrajectory


def good_posture(robot: Robot, rows: list[int]) -> np.ndarray:
    """Of 300 configurations well inside the ranges the one farthest from singular ones, (nv,), rad."""
    limits = joint_limits(robot)
    low, high = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    middle, half = (low + high) / 2, (high - low) / 2
    draws = middle + 0.7 * half * np.random.default_rng(0).uniform(-1, 1, (300, robot.nv))
    reach = max(np.linalg.norm(robot.tip_position(q)) for q in draws)
    scale = np.array([1 / reach] * 3 + [1.0] * 3)[rows, None]
    return max(draws, key=lambda q: np.linalg.svd(scale * robot.jacobian(q)[rows], compute_uv=False)[-1])


def movable_axes(robot: Robot) -> str:
    """Axes of the world along which the tip can be moved at will."""
    q = np.random.default_rng(0).uniform(-1, 1, robot.nv)
    J = robot.jacobian(q)[:3]
    for axes in ("xyz", "xy", "xz", "yz", "x", "y", "z"):
        values = np.linalg.svd(J[["xyz".index(a) for a in axes]], compute_uv=False)
        if len(axes) <= robot.nv and values[-1] > 1e-3:
            return axes
    return ""


def task(name: str, space: str) -> Task | None:
    """The task of an arm of the catalogue, or None if the arm cannot do it."""
    robot = load_robot(name)
    if space == "joint":
        q0 = good_posture(robot, [0, 1, 2])
        return Task(robot, JointSpace(), q0, Swing(q0, SWING * (-1.0) ** np.arange(robot.nv)))
    if space == "position":
        axes = movable_axes(robot)
        if not axes:
            return None
        return position_task(robot, axes)
    rank = np.linalg.matrix_rank(robot.jacobian(np.full(robot.nv, 0.3)), tol=1e-6)
    return pose_task(robot) if rank == 6 else None


def position_task(robot: Robot, axes: str) -> Task:
    rows = ["xyz".index(axis) for axis in axes]
    q0 = good_posture(robot, rows)
    x = robot.tip_position(q0)
    inward = -x / np.linalg.norm(x) + 0.3
    return Task(robot, CartesianSpace(axes), q0, Swing(x[rows], SHIFT * np.linalg.norm(x) * inward[rows]))


def pose_task(robot: Robot) -> Task:
    q0 = good_posture(robot, [*range(6)])
    tip = robot.tip_pose(q0)
    x = tip.translation
    way = Swing(x, SHIFT * (-x + 0.3 * np.linalg.norm(x)))
    turn = AxisRotation(tip.rotation, (1.0, 0.5, -0.5), Swing(np.zeros(1), np.array([TURN])))
    return Task(robot, PoseSpace(), q0, PoseTrajectory(way, turn))


def cell(what: Task, n: int) -> Cell:
    """n such arms, as a pair or a signed ring, which know 0.7 of their parameters."""
    theta = KNOWN * what.robot.inertial_parameters
    members = [
        Member(what.robot, what.path, what.q0, theta_hat0=theta, friction=Friction(), name=f"arm {i}")
        for i in range(n)
    ]
    return Cell(members, Coupling.pair() if n == 2 else Coupling.signed_ring(n), what.space)


def run(what: Cell, gains: Gains, period: float | None, load: float, engine: str = "compiled") -> Outcome:
    """One run, judged."""
    payloads = [Payload(i, load) for i in range(what.n)] if load else []
    experiment = Experiment(what, gains, DURATION, payloads=payloads)
    try:
        result = experiment.simulate(dt=1e-3, engine=engine, control_period=period, log_dt=4e-3)
    except SynctrlError as error:
        return Outcome(f"{type(error).__name__}: {error}"[:100], np.inf, np.inf)
    desired = result.x_desired
    motion = np.abs(desired - desired[0]).max(axis=(0, 1))
    error = np.abs(result.tracking_error[-1]).max(axis=0)
    share = np.abs(result.tau).max() / exact_torque(what, load)
    return Outcome(result.status, float((error / _common(motion, what)).max()), float(share))


def _common(motion: np.ndarray, what: Cell) -> np.ndarray:
    """For every coordinate the largest motion of its unit: one that hardly moves is not judged alone."""
    units = np.array(what.units)
    return np.array([motion[units == unit].max() for unit in units])


def exact_torque(what: Cell, load: float) -> float:
    """The largest torque, N·m, with which the first robot and its load follow the path exactly."""
    robot = carrying(what.robots[0], Payload(0, load)) if load else what.robots[0]
    path = (part[:POINTS, 0] for part in excursion(what, DURATION)[:3])
    return max(float(np.abs(robot.inverse_dynamics(*state)).max()) for state in zip(*path, strict=True))


def bench(
    arms: list[str], bandwidth: float | None, loads: tuple, periods: tuple, sizes: tuple
) -> Iterator[tuple]:
    """(arm, space, n, period, load, outcome) of every run, with pairs and rings of so many robots.

    Without a bandwidth all arms have the same gains.
    """
    for name in arms:
        for space in SPACES:
            what = task(name, space)
            for n in sizes if what else ():
                one = cell(what, n)
                for period in periods:
                    gains = NAIVE if bandwidth is None else Gains.suggest(one, bandwidth, period=period)
                    for load in loads:
                        yield name, space, n, period, load, run(one, gains, period, load)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--arms", nargs="*", default=[n for n in catalog_names() if n != "wheel"])
    parser.add_argument("--bandwidth", type=float, default=BANDWIDTH, help="rad/s")
    parser.add_argument("--naive", action="store_true", help="the same gains for all arms")
    parser.add_argument("--short", action="store_true", help="pairs only, in continuous control and at 2 ms")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = []
    extent = ((None, 2e-3), (2,)) if arguments.short else (PERIODS, (2, 3))
    bandwidth = None if arguments.naive else arguments.bandwidth
    for row in bench(arguments.arms, bandwidth, (0.0, LOAD), *extent):
        rows.append(row)
        name, space, n, period, load, outcome = row
        words = "good" if outcome.good else "BAD "
        print(
            f"{words} {name:12} {space:8} n={n} period={period} load={load:g} "
            f"error={outcome.error:.3g} torque={outcome.torque:.3g} {outcome.status}",
            flush=True,
        )
    for load in (0.0, LOAD):
        good = [row[-1].good for row in rows if row[-2] == load]
        print(f"load {load:g} kg: {sum(good)} of {len(good)}")


if __name__ == "__main__":
    main()
