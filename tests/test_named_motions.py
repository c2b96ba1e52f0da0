"""Motions with a name: velocities and accelerations are derivatives, and each goes where it should."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl.errors import InputError, TrajectoryError
from synctrl.experiments.mobile_robot import WheelPath
from synctrl.tasks.splines import Spline
from synctrl.tasks.swings import FigureEight, Sway, Swing

#: s; central differences are off by about H^2
H = 1e-5
KNOTS = np.array([0.0, 0.4, 1.1, 1.5, 2.6, 3.0])
POINTS = np.array([[0.0, 1.0], [0.3, 0.2], [0.1, 0.4], [0.5, 0.5], [0.9, 0.0], [0.7, 0.1]])
MOTIONS: list[Any] = [
    Swing((0.3, 0.2, 0.1), 2.0, (1.0, 0.0, -1.0)),
    Sway((0.3, 0.1), (0.2, 0.4), 1.7),
    FigureEight((0.1, 0.2, 0.3), 0.2, 0.1, -1.3, 0.4, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    Spline(KNOTS, POINTS),
    Spline(KNOTS, POINTS, "free"),
]  # fmt: skip


@pytest.mark.parametrize("motion", MOTIONS, ids=range(len(MOTIONS)))
def test_velocity_and_acceleration_are_derivatives(motion: Any) -> None:
    t = np.linspace(0.01, 2.99, 200)
    (x0, v0, _), (_, v, a), (x1, v1, _) = motion(t - H), motion(t), motion(t + H)
    np.testing.assert_allclose((x1 - x0) / (2 * H), v, atol=1e-7)
    np.testing.assert_allclose((v1 - v0) / (2 * H), a, atol=1e-6)
    assert motion(0.5).x.tobytes() == motion(np.array([0.5])).x[0].tobytes()


def test_a_swing_begins_and_ends_a_period_at_rest() -> None:
    swing = MOTIONS[0]
    for t in (0.0, 2.0):
        np.testing.assert_allclose(swing(t).x, swing.offset, atol=1e-15)
        np.testing.assert_allclose(swing(t).x_dot, 0.0, atol=1e-14)
    np.testing.assert_allclose(swing(1.0).x[::2], (swing.offset + swing.amplitude)[::2])


def test_an_eight_crosses_itself_at_its_centre_twice_a_round() -> None:
    eight = MOTIONS[2]
    times = (np.array([0.0, np.pi]) - eight.phase) / eight.speed
    first, second = eight(times).x_dot
    np.testing.assert_allclose(eight(times).x, [eight.center] * 2, atol=1e-15)
    assert np.linalg.norm(np.cross(first, second)) > 0.1
    around = eight(np.linspace(0, 2 * np.pi / 1.3, 4001)).x - eight.center
    np.testing.assert_allclose(np.abs(around).max(axis=0), (0.0, eight.along, eight.across), atol=1e-6)


@pytest.mark.parametrize("spline", MOTIONS[3:], ids=["rest", "free"])
def test_a_spline_goes_through_its_points_when_it_should(spline: Spline) -> None:
    np.testing.assert_allclose(spline(KNOTS).x, POINTS, atol=1e-12)


def test_a_spline_rests_before_its_first_and_after_its_last_point() -> None:
    x, v, a = MOTIONS[3](np.array([-1.0, 0.0, 3.0, 9.0]))
    np.testing.assert_allclose(x, POINTS[[0, 0, -1, -1]], atol=1e-12)
    np.testing.assert_allclose(np.stack((v, a)), 0.0, atol=1e-10)


@given(st.lists(st.floats(-2, 2), min_size=6, max_size=6))
def test_a_free_spline_is_the_polynomial_that_its_points_are_on(coefficients: list[float]) -> None:
    path = np.polynomial.Polynomial(coefficients)
    spline = Spline(np.linspace(0, 2, 9), path(np.linspace(0, 2, 9))[:, None], "free")
    t = np.linspace(0, 2, 50)
    for found, expected, size in zip(
        spline(t), (path, path.deriv(), path.deriv(2)), (1, 10, 100), strict=True
    ):
        np.testing.assert_allclose(found[:, 0], expected(t), atol=1e-10 * size)


def test_a_free_spline_has_no_motion_outside() -> None:
    with refused(TrajectoryError, "t", found=3.5):
        MOTIONS[4](np.array([1.0, 3.5]))


@pytest.mark.parametrize(
    ("arguments", "subject"),
    [
        (([0.0, 0.0], [[0.0], [1.0]]), "times"),
        (([0.0], [[0.0]]), "number of points"),
        (([0.0, 1.0], [[0.0], [1.0], [2.0]]), "points"),
        (([0.0, 1.0], [[0.0], [1.0]], "free"), "number of points"),
        (([0.0, 1.0], [[0.0], [1.0]], "loose"), "ends"),
    ],
)
def test_what_is_no_spline_is_refused(arguments: tuple, subject: str) -> None:
    with refused(InputError, subject):
        Spline(*arguments)


def test_there_are_two_wheels() -> None:
    with refused(InputError, "wheel", found=2):
        WheelPath(2)
