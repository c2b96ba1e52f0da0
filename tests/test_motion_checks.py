"""A desired velocity or acceleration that does not belong to its motion ends a run before it starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from flows import tumbling
from hypothesis import given, settings
from machines import seeds
from refusals import refused

from synctrl import (
    Cell,
    Coupling,
    Experiment,
    FunctionOrientation,
    FunctionTrajectory,
    JointSpace,
    Member,
    PoseSpace,
    PoseTrajectory,
    SmoothTrajectory,
    load_robot,
)
from synctrl.coupling.reachability import check_motions
from synctrl.errors import CouplingError, NonFiniteError, TrajectoryError
from synctrl.experiments import a460_pair, planar_four
from synctrl.tasks.rotations import exp
from synctrl.tasks.trajectories import Hold, Motion

ARM, UR5 = load_robot("planar2r"), load_robot("ur5")
TIMES = np.linspace(0, 2, 201)


def position(t: float) -> np.ndarray:
    return np.array([0.3 * np.sin(2 * t), 1 + 0.1 * np.cos(3 * t)])


def velocity(t: float) -> np.ndarray:
    return np.array([0.6 * np.cos(2 * t), -0.3 * np.sin(3 * t)])


def acceleration(t: float) -> np.ndarray:
    return np.array([-1.2 * np.sin(2 * t), -0.9 * np.cos(3 * t)])


def cell_with(trajectory, space=None) -> Cell:
    good = FunctionTrajectory(position, velocity, acceleration)
    members = [Member(ARM, good), Member(ARM, trajectory, name="left")]
    return Cell(members, Coupling.pair(), space)


WRONG: dict[str, tuple[Callable, Callable, dict]] = {
    "sign": (lambda t: -velocity(t), acceleration, {"derivative": "velocity", "coordinate": "joint 1"}),
    "degrees": (velocity, lambda t: np.rad2deg(acceleration(t)), {"derivative": "acceleration"}),
    "one coordinate": (
        lambda t: velocity(t) * [1, 1.05], acceleration, {"derivative": "velocity", "coordinate": "joint 2"},
    ),
    "left out": (velocity, lambda t: np.zeros(2), {"derivative": "acceleration", "coordinate": "joint 1"}),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_derivative_that_does_not_fit_ends_the_run_before_it_starts(name: str) -> None:
    v, a, data = WRONG[name]
    cell = cell_with(FunctionTrajectory(position, v, a))
    told: list[float] = []
    with refused(TrajectoryError, "left, trajectory", **data):
        Experiment(cell, SMALL_GAINS, 2.0).simulate(progress=told.append)
    assert told == []


def test_an_own_object_is_held_against_differences_too() -> None:
    class Own:
        dimension, breaks = 2, ()

        def __init__(self, factor: float):
            self.factor = factor

        def __call__(self, t):
            t = np.asarray(t, dtype=float)[..., None] * np.ones(2)
            return Motion(np.sin(t), self.factor * np.cos(t), -np.sin(t))

    check_motions(cell_with(Own(1.0)), TIMES)
    with refused(TrajectoryError, "left, trajectory", derivative="velocity"):
        check_motions(cell_with(Own(0.9)), TIMES)


def test_a_motion_that_is_not_finite_later_on_is_left_to_the_run() -> None:
    class Own:
        dimension, breaks = 2, ()

        def __call__(self, t):
            t = np.asarray(t, dtype=float)[..., None] * np.ones(2)
            return Motion(np.where(t > 1, np.nan, 0 * t), 0 * t, 0 * t)

    check_motions(cell_with(Own()), TIMES)
    with refused(NonFiniteError, robot=1, cause="motion"):
        cell_with(Own()).motion(1, TIMES)


def test_jumps_pass_where_breaks_are_named_and_the_derivatives_fit_in_between() -> None:
    def ramp(t: float) -> list[float]:
        return [0.0, abs(t - 0.7)]

    def slope(t: float) -> list[float]:
        return [0.0, 1.0 if t >= 0.7 else -1.0]

    check_motions(cell_with(FunctionTrajectory(ramp, slope, lambda t: [0, 0], breaks=(0.7,))), TIMES)


@settings(max_examples=10)
@given(seeds)
def test_tumbling_poses_pass_and_rates_of_the_rotation_vector_do_not(seed: int) -> None:
    right = PoseTrajectory(Hold([0.4, 0.1, 0.4]), tumbling(np.random.default_rng(seed)))
    q0 = np.array([0.1, -1.2, 1.4, -1.0, -1.4, 0.3])
    members = [Member(UR5, right, q0), Member(UR5, right, q0)]
    cell = Cell(members, Coupling.pair(), PoseSpace())
    check_motions(cell, TIMES)

    class Spoilt:
        dimension, breaks = 6, right.breaks

        def __call__(self, t):
            x, v, a = right(t)
            return Motion(x, v * [1, 1, 1, 1, 1, -1], a)

    spoilt = Cell([members[0], replace(members[1], trajectory=Spoilt())], Coupling.pair(), PoseSpace())
    with refused(TrajectoryError, "robot 2, trajectory", derivative="velocity", coordinate="rz"):
        check_motions(spoilt, TIMES)


def test_an_orientation_with_its_velocity_in_body_axes_is_refused() -> None:
    start = exp(np.array([0.5, 0.2, 0.1]))
    axis = np.array([0.0, 0.0, 1.0])

    def turning(w: np.ndarray) -> FunctionOrientation:
        return FunctionOrientation(lambda t: exp(t * axis) @ start, lambda t: w, lambda t: np.zeros(3))

    world, body = turning(axis), turning(start.T @ axis)
    q0 = np.zeros(6)
    place = Hold([0.4, 0.1, 0.4])

    def cell(orientation) -> Cell:
        return Cell(
            [Member(UR5, PoseTrajectory(place, o), q0) for o in (world, orientation)],
            Coupling.pair(),
            PoseSpace(),
        )

    check_motions(cell(world), TIMES)
    with refused(TrajectoryError, "robot 2, trajectory", derivative="velocity"):
        check_motions(cell(body), TIMES)


def test_a_space_may_say_what_its_velocities_are() -> None:
    class Halved(JointSpace):
        """Velocities that are half of the derivatives of the coordinates."""

        def displacement(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
            return 0.5 * (end - start)

    halved = FunctionTrajectory(position, lambda t: 0.5 * velocity(t), lambda t: 0.5 * acceleration(t))
    members = [Member(ARM, halved), Member(ARM, halved)]
    check_motions(Cell(members, Coupling.pair(), Halved()), TIMES)
    with pytest.raises(TrajectoryError):
        check_motions(Cell(members, Coupling.pair()), TIMES)


def test_weights_whose_derivative_is_off_by_a_little_are_refused_before_a_run() -> None:
    def c(t: float):
        return [2 + np.sin(t), 1.0], [1.05 * np.cos(t), 0.0], [-1.05 * np.sin(t), 0.0]

    cell = small_cell(coupling=Coupling.pair(c))
    with refused(CouplingError, "c'", robot=0):
        Experiment(cell, SMALL_GAINS, 0.5).simulate(dt=1e-2)


def test_ready_cells_and_smooth_trajectories_pass() -> None:
    for experiment in (planar_four(), a460_pair()):
        check_motions(experiment.cell, np.linspace(0, experiment.duration, 101))
    check_motions(cell_with(SmoothTrajectory(position, 2.0)), TIMES)
