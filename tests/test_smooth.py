"""Motions and weights given without derivatives: these are found, and those that have none are refused."""

from __future__ import annotations

import numpy as np
import pytest
from cells import smooth_motion
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import seeds
from refusals import refused

from synctrl import Coupling, Cubic, FunctionOrientation, SmoothOrientation, SmoothTrajectory
from synctrl.coupling.weights import SmoothWeights
from synctrl.errors import CouplingError, InputError, TrajectoryError
from synctrl.tasks.rotations import exp, skew
from synctrl.tasks.trajectories import MOTION_PARTS

TIMES = np.linspace(0, 2, 301)


def assert_same(found, expected, share: float = 1e-8) -> None:
    rate = max(1.0, np.abs(expected[1]).max(), np.sqrt(np.abs(expected[2]).max()))
    for order, (one, other) in enumerate(zip(found, expected, strict=True)):
        np.testing.assert_allclose(one, other, rtol=0, atol=10 * share * rate**order)


@settings(max_examples=20)
@given(seeds, st.integers(1, 6))
def test_derivatives_of_a_smooth_motion_are_found_to_1e_8(seed: int, m: int) -> None:
    known = smooth_motion(np.random.default_rng(seed), m)
    found = SmoothTrajectory(lambda t: known(t).x, 2.0)
    assert found.dimension == m and found.breaks == ()
    assert_same(found(TIMES), known(TIMES))
    assert found(0.5).x.shape == (m,)


def test_breaks_may_separate_pieces() -> None:
    known = Cubic([0.0, 1.0], [1.0, -2.0], 1.3)
    found = SmoothTrajectory(lambda t: known(t).x, 2.0, known.breaks)
    assert found.breaks == known.breaks
    assert_same(found(TIMES), known(TIMES))
    np.testing.assert_allclose(found(1.3).x_ddot, known(1.3).x_ddot, atol=1e-6)  # from the right


def test_a_motion_may_have_a_hundred_breaks() -> None:
    corners = np.linspace(0, 2, 101)
    heights = np.random.default_rng(0).uniform(-1, 1, 101)
    found = SmoothTrajectory(lambda t: [np.interp(t, corners, heights)], 2.0, corners[1:-1])
    middles = 0.5 * (corners[1:] + corners[:-1])
    slopes = np.diff(heights) / np.diff(corners)
    np.testing.assert_allclose(found(middles).x_dot[:, 0], slopes, rtol=0, atol=1e-6 * np.abs(slopes).max())


def test_a_motion_that_jumps_itself_at_a_break_is_refused() -> None:
    with refused(TrajectoryError, "position") as caught:
        SmoothTrajectory(lambda t: [float(t >= 0.7)], 2.0, breaks=(0.7,))
    assert caught.value.time == pytest.approx(0.7, abs=0.1)


@pytest.mark.parametrize(
    ("position", "first", "last"),
    [
        (lambda t: Cubic([0.0], [1.0], 1.3)(t).x, 1.29, 1.31),
        (lambda t: [abs(t - 0.7)], 0.69, 0.71),
        (lambda t: [float(t > 0.7)], 0.69, 0.71),
        (lambda t: [np.sin(t) + 1e-6 * np.sin(1e6 * t)], 0.0, 2.0),
        (lambda t: [np.sin(t), 0.0][: 1 + (t < 1)], 1.0, 2.0),
        (lambda t: [np.nan if t > 1 else 0.0], 1.0, 2.0),
    ],
)
def test_a_motion_without_derivatives_is_refused_with_its_time(position, first, last) -> None:
    with pytest.raises(TrajectoryError) as caught:
        SmoothTrajectory(position, 2.0)
    assert caught.value.subject in MOTION_PARTS and first <= caught.value.time <= last


@pytest.mark.parametrize("t", [-0.1, 2.1, [0.0, 2.1]])
def test_a_time_for_which_the_motion_was_not_made_is_refused(t) -> None:
    for made in (
        SmoothTrajectory(lambda t: [t], 2.0),
        SmoothOrientation(lambda t: np.eye(3), 2.0),
    ):
        with refused(TrajectoryError, "t", found=float(np.ravel(t)[-1])):
            made(t)


@settings(max_examples=15)
@given(seeds)
def test_the_angular_velocity_of_a_smooth_orientation_is_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axes, start = rng.uniform(-1.5, 1.5, (2, 3)), exp(rng.normal(size=3))
    a, b = axes

    def rotation(t: float) -> np.ndarray:
        return exp(t * a) @ exp(np.sin(t) * b) @ start

    def velocity(t: float) -> np.ndarray:
        return a + np.cos(t) * exp(t * a) @ b

    def acceleration(t: float) -> np.ndarray:
        turned = exp(t * a) @ b
        return np.cos(t) * skew(a) @ turned - np.sin(t) * turned

    found = SmoothOrientation(rotation, 2.0)(TIMES)
    assert_same(found, FunctionOrientation(rotation, velocity, acceleration)(TIMES))
    np.testing.assert_allclose(found.R @ found.R.mT, np.broadcast_to(np.eye(3), found.R.shape), atol=1e-13)


def test_an_orientation_that_is_none_is_refused() -> None:
    with refused(TrajectoryError, "rotation"):
        SmoothOrientation(lambda t: (1 + t) * np.eye(3), 2.0)
    with pytest.raises(TrajectoryError) as caught:
        SmoothOrientation(lambda t: exp(np.array([abs(t - 0.7), 0, 0])), 2.0)
    assert caught.value.time == pytest.approx(0.7, abs=0.01)


@pytest.mark.parametrize("kind", [SmoothTrajectory, SmoothOrientation])
def test_arguments_that_do_not_fit_are_refused(kind) -> None:
    still = (lambda t: [0.0]) if kind is SmoothTrajectory else (lambda t: np.eye(3))
    for arguments in ((3, 1.0), (still, 0.0), (still, "long"), (still, 1.0, ("late",)), (still, -1.0)):
        with pytest.raises((InputError, TrajectoryError)):
            kind(*arguments)


def test_weights_alone_are_enough_for_a_coupling() -> None:
    def alone(t: float) -> np.ndarray:
        return np.array([2 + np.sin(3 * t), -1 - np.exp(-t)])

    def known(t: float):
        return alone(t), [3 * np.cos(3 * t), np.exp(-t)], [-9 * np.sin(3 * t), -np.exp(-t)]

    found = Coupling.pair(SmoothWeights.from_function(alone, 2.0, 2)).weights(TIMES, 2)
    expected = Coupling.pair(known).weights(TIMES, 2)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-6)


def test_smooth_weights_for_another_number_of_coordinates_are_refused() -> None:
    coupling = Coupling.pair(SmoothWeights.from_function(lambda t: [1.0, -2.0 - np.sin(t)], 2.0, 3))
    with refused(CouplingError, "c"):
        coupling.weights(TIMES, 2)


def test_weights_that_have_no_derivatives_are_refused() -> None:
    with refused(CouplingError, "c", robot=1) as caught:
        SmoothWeights.from_function(lambda t: [1.0, 2 + abs(t - 0.7)], 2.0, 2)
    assert caught.value.time == pytest.approx(0.7, abs=0.01)
    for value, subject, found in (
        (1.0, "c", ()),
        ("x", "c at t = 0 s", "x"),
        ([1.0, np.inf], "c at t = 0 s", np.inf),
        (np.ones((2, 3)), "c", (2, 3)),
    ):
        with refused(InputError, subject, found=found):
            SmoothWeights.from_function(lambda t, value=value: value, 2.0, 2)
