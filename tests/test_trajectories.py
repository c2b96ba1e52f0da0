"""Desired motions: every derivative against differences, and what each motion promises."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import rate, seeds
from refusals import refused

from synctrl import Circle, Cubic, ExponentialApproach, FunctionTrajectory, Hold
from synctrl.errors import InputError, TrajectoryError


def frame(rng: np.random.Generator, m: int) -> tuple[np.ndarray, np.ndarray]:
    """Two orthonormal vectors."""
    columns = np.linalg.qr(rng.normal(size=(m, 2)))[0].T
    return columns[0], columns[1]


def own(rng: np.random.Generator, m: int) -> FunctionTrajectory:
    a, b = rng.uniform(-1, 1, (2, m))
    return FunctionTrajectory(
        lambda t: a * np.sin(t) + b * t**2,
        lambda t: a * np.cos(t) + 2 * b * t,
        lambda t: 2 * b - a * np.sin(t),
    )


def circle(rng: np.random.Generator, m: int) -> Circle:
    m = max(m, 2)
    first, second = frame(rng, m)
    return Circle(
        rng.normal(size=m), rng.uniform(0.1, 2), rng.uniform(-3, 3), rng.uniform(-3, 3), first, second
    )


KINDS = {
    "hold": lambda rng, m: Hold(rng.normal(size=m)),
    "cubic": lambda rng, m: Cubic(*rng.normal(size=(2, m)), rng.uniform(0.5, 3)),
    "exponential": lambda rng, m: ExponentialApproach(*rng.normal(size=(2, m)), rng.uniform(0.2, 3)),
    "circle": circle,
    "own": own,
}


@pytest.mark.parametrize("kind", KINDS)
@given(seed=seeds, m=st.integers(1, 4), t=st.floats(0, 4))
@settings(max_examples=25)
def test_velocity_and_acceleration_are_the_derivatives(kind, seed, m, t):
    trajectory = KINDS[kind](np.random.default_rng(seed), m)
    if any(abs(t - jump) < 0.01 for jump in trajectory.breaks):
        t += 0.05
    motion = trajectory(t)
    np.testing.assert_allclose(motion.x_dot, rate(lambda s: trajectory(t + s).x), rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(motion.x_ddot, rate(lambda s: trajectory(t + s).x_dot), rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("kind", KINDS)
@given(seed=seeds, m=st.integers(1, 4))
@settings(max_examples=10)
def test_many_times_at_once_are_the_same_as_one_by_one(kind, seed, m):
    trajectory = KINDS[kind](np.random.default_rng(seed), m)
    times = np.linspace(-0.5, 4, 40)
    together = trajectory(times)
    for part in together:
        assert part.shape == (40, trajectory.dimension)
    for k, t in enumerate(times):
        for part, single in zip(together, trajectory(t), strict=True):
            assert single.shape == (trajectory.dimension,)
            np.testing.assert_allclose(part[k], single, rtol=1e-14, atol=1e-14)


@given(seeds, st.floats(0.1, 5))
@settings(max_examples=25)
def test_a_cubic_goes_from_rest_to_rest_and_stays(seed, duration):
    start, end = np.random.default_rng(seed).normal(size=(2, 3))
    cubic = Cubic(start, end, duration)
    np.testing.assert_array_equal(cubic(0.0).x, start)
    np.testing.assert_array_equal(cubic(0.0).x_dot, 0)
    np.testing.assert_allclose(cubic(duration / 2).x, (start + end) / 2, atol=1e-12)
    for t in (duration, duration + 1.0, 1e6):
        np.testing.assert_allclose(cubic(t).x, end, atol=1e-12)
        np.testing.assert_array_equal(cubic(t).x_dot, 0)
        np.testing.assert_array_equal(cubic(t).x_ddot, 0)
    np.testing.assert_array_equal(cubic(-1.0).x, start)
    np.testing.assert_array_equal(cubic(-1.0).x_ddot, 0)


def test_only_the_acceleration_of_a_cubic_jumps_and_it_says_where():
    cubic = Cubic([0.0, 1.0], [1.0, -1.0], 2.0)
    assert cubic.breaks == (0.0, 2.0)
    for jump in cubic.breaks:
        before, at, after = cubic(np.nextafter(jump, -1)), cubic(jump), cubic(np.nextafter(jump, 3))
        np.testing.assert_allclose(before.x, after.x, atol=1e-14)
        np.testing.assert_allclose(before.x_dot, after.x_dot, atol=1e-14)
        assert np.abs(before.x_ddot - after.x_ddot).min() > 1
        np.testing.assert_allclose(at.x_ddot, after.x_ddot, atol=1e-14)  # from the right, as promised


@given(seeds, st.floats(0.1, 5))
@settings(max_examples=25)
def test_an_exponential_approach_is_the_papers(seed, t):
    start, end = np.random.default_rng(seed).normal(size=(2, 2))
    motion = ExponentialApproach(start, end)(t)
    np.testing.assert_allclose(motion.x, start + (end - start) * (1 - np.exp(-t)), rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(
        ExponentialApproach(start, end, 2.5)(t).x, ExponentialApproach(start, end)(2.5 * t).x
    )
    np.testing.assert_array_equal(ExponentialApproach(start, end)(0.0).x, start)


@given(seeds, st.integers(2, 4), st.floats(-5, 5))
@settings(max_examples=25)
def test_a_circle_keeps_its_radius_plane_and_speed(seed, m, t):
    path = circle(np.random.default_rng(seed), m)
    x, x_dot, x_ddot = path(t)
    outward = x - path.center
    np.testing.assert_allclose(np.linalg.norm(outward), path.radius, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(x_dot), abs(path.speed) * path.radius, rtol=1e-12)
    np.testing.assert_allclose(outward @ x_dot, 0, atol=1e-12)
    np.testing.assert_allclose(x_ddot, -(path.speed**2) * outward, atol=1e-12)
    plane = np.array([path.first, path.second])
    np.testing.assert_allclose(plane.T @ (plane @ outward), outward, atol=1e-12)
    turn = 2 * np.pi / path.speed if path.speed else 0.0
    np.testing.assert_allclose(path(t + turn).x, x, atol=1e-9)


def test_a_plain_circle_turns_from_the_first_axis_to_the_second():
    path = Circle([1.0, 2.0], radius=0.5, speed=np.pi / 2)
    np.testing.assert_allclose(path([0.0, 1.0, 2.0]).x, [[1.5, 2.0], [1.0, 2.5], [0.5, 2.0]], atol=1e-15)


def test_a_motion_cannot_be_changed_from_outside():
    start = np.array([1.0, 2.0])
    path = Cubic(start, [0.0, 0.0], 1.0)
    start[:] = 7.0
    np.testing.assert_array_equal(path(0.0).x, [1.0, 2.0])
    with pytest.raises(ValueError, match="read-only"):  # numpy's words
        path.start[0] = 7.0


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Cubic([0.0], [1.0, 2.0], 1.0), "end"),
        (lambda: Cubic([0.0], [1.0], 0.0), "duration"),
        (lambda: Cubic([0.0], [1.0], -1.0), "duration"),
        (lambda: Cubic([0.0], [1.0], np.nan), "duration"),
        (lambda: Cubic([0.0], [1.0], "long"), "duration"),
        (lambda: Cubic([np.inf], [1.0], 1.0), "start"),
        (lambda: Cubic(0.0, 1.0, 1.0), "start"),
        (lambda: Hold([[1.0]]), "start"),
        (lambda: Hold([np.nan]), "start"),
        (lambda: Hold("here"), "start"),
        (lambda: ExponentialApproach([0.0], [1.0], rate=0.0), "rate"),
        (lambda: ExponentialApproach([0.0], [1.0], rate=-2.0), "rate"),
        (lambda: Circle([0.0, 0.0], radius=0.0, speed=1.0), "radius"),
        (lambda: Circle([0.0, 0.0], radius=1.0, speed=np.inf), "speed"),
        (lambda: Circle([0.0, 0.0], radius=1.0, speed=1.0, phase=np.nan), "phase"),
        (lambda: Circle([0.0, 0.0], 1.0, 1.0, first=[1.0, 0.0, 0.0]), "first"),
        (lambda: FunctionTrajectory(np.atleast_1d, 1.0, np.atleast_1d), "velocity"),
        (lambda: FunctionTrajectory(*[np.atleast_1d] * 3, breaks=3), "breaks"),
        (lambda: FunctionTrajectory(*[np.atleast_1d] * 3, breaks=("soon",)), "breaks"),
    ],
)
def test_numbers_that_make_no_motion_are_refused(make, subject):
    with refused(InputError, subject):
        make()


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Circle([0.0], radius=1.0, speed=1.0), "center"),
        (lambda: Circle([0.0, 0.0], 1.0, 1.0, first=[1.0, 0.0], second=[1.0, 0.0]), "first, second"),
        (lambda: Circle([0.0, 0.0], 1.0, 1.0, first=[2.0, 0.0], second=[0.0, 1.0]), "first, second"),
        (lambda: FunctionTrajectory(np.atleast_1d, np.atleast_1d, lambda t: [t, t]), "acceleration"),
        (lambda: FunctionTrajectory(np.atleast_1d, np.atleast_1d, lambda t: [np.nan]), "acceleration"),
        (lambda: FunctionTrajectory(lambda t: ["x"], np.atleast_1d, np.atleast_1d), "position"),
        (lambda: FunctionTrajectory(lambda t: t, lambda t: [t, t], np.atleast_1d), "position"),
    ],
)
def test_motions_that_contradict_themselves_are_refused(make, subject):
    with refused(TrajectoryError, subject):
        make()


def test_a_function_that_fails_later_is_named_with_the_time():
    path = FunctionTrajectory(lambda t: [t if t < 2 else np.nan], np.atleast_1d, np.atleast_1d)
    np.testing.assert_array_equal(path([0.0, 1.0]).x, [[0.0], [1.0]])
    with refused(TrajectoryError, "position", time=2.0):
        path([0.0, 1.0, 2.0])
