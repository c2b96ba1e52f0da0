"""Paths by their arc length, motions along them, and weights in their axes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import seeds
from refusals import refused

from synctrl.coupling.along_path import Gate, PathWeights
from synctrl.errors import CouplingError, InputError, TrajectoryError
from synctrl.tasks.path import AlongPath, Path
from synctrl.tasks.rotations import skew
from synctrl.tasks.trajectories import FunctionTrajectory
from synctrl.tasks.ways import Ramped

H = 1e-5  # of differences


def flat(y: float) -> tuple[float, float, float]:
    return 0.06 * np.sin(np.pi * y / 0.3), y, 0.25


def spiral(u: float) -> tuple[float, float, float]:
    return 0.1 * np.cos(u), 0.1 * np.sin(u), 0.05 * u + 0.02 * np.sin(2 * u)


FLAT, SPIRAL = Path.from_function(flat, -0.3, 0.3), Path.from_function(spiral, 0, 5)
PATHS = pytest.mark.parametrize("path", [FLAT, SPIRAL], ids=["in a plane", "in space"])


def difference(function, at: np.ndarray) -> np.ndarray:
    return (np.asarray(function(at + H)) - np.asarray(function(at - H))) / (2 * H)


def meeting(path: Path = FLAT, gap: float = 0.02) -> list[AlongPath]:
    """Two robots that go from both ends to a gap, a bit behind the middle, in 3 s."""
    L = path.length
    stops = 0.55 * L - gap / 2, 0.55 * L + gap / 2
    return [AlongPath(path, Ramped(*ends, 3.0, 0.3)) for ends in zip((0.0, L), stops, strict=True)]


# -- the curve --------------------------------------------------------------------------------------------


@PATHS
def test_a_path_goes_by_its_arc_length_and_its_derivatives_are_those_of_its_places(path):
    s = np.linspace(0.01, path.length - 0.01, 60)
    place = path.at(s)
    np.testing.assert_allclose(difference(lambda s: path.at(s).position, s), place.tangent, atol=2e-8)
    np.testing.assert_allclose(np.linalg.norm(place.tangent, axis=1), 1, atol=1e-9)
    np.testing.assert_allclose(difference(lambda s: path.at(s).tangent, s), place.bend, atol=1e-6)
    turned = skew(place.turn) @ place.axes
    np.testing.assert_allclose(difference(lambda s: path.at(s).axes, s), turned, atol=1e-6)
    scale = np.abs(place.turn_s).max()
    np.testing.assert_allclose(difference(lambda s: path.at(s).turn, s), place.turn_s, atol=1e-6 * scale)


@PATHS
def test_axes_are_a_rotation_of_which_n_is_level(path):
    axes = path.at(np.linspace(0, path.length, 50)).axes
    np.testing.assert_allclose(axes @ axes.mT, np.broadcast_to(np.eye(3), axes.shape), atol=1e-8)
    assert (np.linalg.det(axes) > 0).all() and np.abs(axes[:, 2, 1]).max() < 1e-8


def test_the_curvature_of_a_path_in_a_plane_is_that_of_its_function():
    s = np.linspace(0.02, FLAT.length - 0.02, 40)
    place = FLAT.at(s)
    y, k = place.position[:, 1], np.pi / 0.3
    slope, bend = 0.06 * k * np.cos(k * y), -0.06 * k * k * np.sin(k * y)
    np.testing.assert_allclose(place.turn[:, 2], -bend / (1 + slope**2) ** 1.5, atol=1e-6)
    assert np.abs(place.turn[:, :2]).max() < 1e-7


def test_a_circle_through_points_has_the_length_and_the_centre_of_a_circle():
    angles = np.linspace(0, np.pi, 60)
    half = Path(0.2 * np.stack((np.cos(angles), np.sin(angles), 0 * angles), 1))
    assert half.length == pytest.approx(0.2 * np.pi, rel=1e-8)
    place = half.at(np.linspace(0, half.length, 30))
    np.testing.assert_allclose(place.position + 0.2 * place.axes[..., 1], 0, atol=1e-6)


@PATHS
@settings(max_examples=20)
@given(seeds)
def test_a_place_beside_a_path_is_projected_to_where_it_stands(path, seed):
    rng = np.random.default_rng(seed)
    s = rng.uniform(0.03, path.length - 0.03, 5)
    place = path.at(s)
    beside = place.position + 0.01 * rng.normal(size=(5, 1)) * place.axes[..., 1] + 0.01 * place.axes[..., 2]
    np.testing.assert_allclose(path.project(beside, s + rng.uniform(-0.02, 0.02, 5)), s, atol=1e-8)


def test_beyond_its_ends_a_path_goes_on_straight():
    ends, past = FLAT.at([0.0, FLAT.length]), FLAT.at([-0.1, FLAT.length + 0.2])
    way = np.array([[-0.1], [0.2]])
    np.testing.assert_allclose(past.position, ends.position + way * ends.tangent, atol=1e-12)
    np.testing.assert_allclose(past.axes, ends.axes, atol=1e-12)
    assert not past.bend.any() and not past.turn.any() and not past.turn_s.any()


def test_a_path_that_halts_bends_sharply_or_goes_along_up_is_refused():
    line = np.outer(np.linspace(0, 1, 8), (1.0, 0.0, 0.0))
    with refused(InputError, "number of points", found=5):
        Path(line[:5])
    with refused(InputError, "points", found=0.0):
        Path(np.repeat(line, 2, axis=0))
    across = np.linspace(-1, 1, 601)
    with refused(TrajectoryError, "points"):
        Path(np.stack((across, np.abs(across), 0 * across), 1))
    with refused(TrajectoryError, "up"):
        Path(line, up=(1.0, 0.0, 0.0))


# -- motions ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ends", [(0.0, 0.4), (0.6, 0.2)])
def test_a_ramped_way_has_the_derivatives_it_says_and_the_speed_in_the_middle(ends):
    way, t = Ramped(*ends, 3.0, 0.4), np.linspace(0.01, 2.99, 200)
    np.testing.assert_allclose(difference(lambda t: way(t).x, t), way(t).x_dot, atol=1e-8)
    np.testing.assert_allclose(difference(lambda t: way(t).x_dot, t), way(t).x_ddot, atol=1e-4)
    assert way(-1.0).x == ends[0] and way(4.0).x == pytest.approx(ends[1], abs=1e-15)
    assert way(1.5).x_dot == pytest.approx((ends[1] - ends[0]) / (3.0 - 0.4))
    assert not way(4.0).x_dot.any() and not way(4.0).x_ddot.any()
    with refused(InputError, "ramp", found=2.0):
        Ramped(*ends, 3.0, 2.0)


@PATHS
def test_a_motion_along_a_path_has_the_derivatives_it_says(path):
    motion, t = meeting(path)[1], np.linspace(0.01, 2.99, 100)
    np.testing.assert_allclose(difference(lambda t: motion(t).x, t), motion(t).x_dot, atol=1e-8)
    np.testing.assert_allclose(difference(lambda t: motion(t).x_dot, t), motion(t).x_ddot, atol=1e-4)


@pytest.mark.parametrize("robot", [0, 1])
def test_a_lag_is_measured_along_the_path_in_the_direction_of_travel(robot):
    motion = meeting()[robot]
    forward = (1, -1)[robot]
    s = float(motion.way(1.2).x[0])
    place = FLAT.at(s - 0.013 * forward)
    beside = place.position + 0.01 * place.axes[:, 1]
    assert motion.lag(1.2, beside) == pytest.approx(0.013, abs=1e-9)
    assert motion.lag(3.5, beside) == 0.0


# -- weights ----------------------------------------------------------------------------------------------

KINDS = {
    "gap": PathWeights.of_gap,
    "gap weighted": lambda motions: PathWeights.of_gap(motions, Gate(0.02)),
    "phase": lambda motions: PathWeights.of_phase(motions, 3.0),
}


@PATHS
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("m", [3, 6])
def test_rates_of_weights_are_their_derivatives(path, kind, m):
    source, t = KINDS[kind](meeting(path)), np.linspace(0.01, 2.99, 80)
    weights = source.at(t, m)
    slopes = difference(lambda t: np.stack(source.at(t, m)[:2]), t)
    for slope, rate in zip(slopes, weights[1:3], strict=True):
        np.testing.assert_allclose(slope, rate, atol=1e-6 * max(1.0, np.abs(rate).max()))
    one = weights.c @ weights.c_inv
    np.testing.assert_allclose(one, np.broadcast_to(np.eye(m), one.shape), atol=1e-7)


def test_the_first_error_is_that_of_the_gap_or_of_time():
    motions, t = meeting(), np.array([1.1])
    lags = np.array([0.003, 0.002])
    forward = np.array([1.0, -1.0])
    tangents = np.stack([FLAT.at(float(motion.way(1.1).x[0])).tangent for motion in motions])
    e = np.concatenate((tangents * (lags * forward)[:, None], np.zeros((2, 3))), axis=1)
    gap = np.matvec(PathWeights.of_gap(motions).at(t, 6).c[0], e).sum(axis=0)
    np.testing.assert_allclose(gap, [lags.sum(), 0, 0, 0, 0, 0], atol=1e-9)
    late = lags * np.array([1.0, motions[1].way.speed / -motions[0].way.speed])
    e = np.concatenate((tangents * (late * [1, -1] * [1, 1.5])[:, None], np.zeros((2, 3))), axis=1)
    c = PathWeights.of_phase(motions, 3.0).at(t, 6).c[0]
    v = np.abs([motion.way.speed for motion in motions])
    expected = v.mean() * (late[0] / v[0] - 1.5 * late[1] / v[1])
    np.testing.assert_allclose(np.matvec(c, e).sum(axis=0), [expected, 0, 0, 0, 0, 0], atol=1e-9)


def test_errors_count_in_full_where_robots_meet_and_half_at_the_reach_of_the_gate():
    motions = meeting()
    gate = Gate(0.02, reach=0.05)
    t = np.linspace(0, 3, 2001)
    gaps = (motions[1].way(t).x - motions[0].way(t).x)[:, 0]
    w = gate.at([motion.way(t) for motion in motions], t)[0]
    assert w[-1] == pytest.approx(1.0) and (np.diff(w) >= 0).all() and w[0] < 0.1
    assert np.interp(-0.07, -gaps, w) == pytest.approx(0.5, rel=1e-3)


def test_weights_and_speeds_that_pass_zero_are_refused():
    motions = meeting()
    with refused(InputError, "a"):
        PathWeights(motions, (1.0, 0.0))
    with refused(CouplingError, "gate") as caught:
        PathWeights.of_gap(motions, Gate(0.3, 0.05)).at(np.linspace(0, 3, 61), 6)
    assert 1.0 < caught.value.time < 3.0
    back = FunctionTrajectory(
        lambda t: [0.1 + 0.1 * np.sin(t)], lambda t: [0.1 * np.cos(t)], lambda t: [-0.1 * np.sin(t)]
    )
    for way in (Ramped(0.1, 0.1, 3.0, 0.3), back):
        with refused(InputError, "motions, robot 2"):
            PathWeights.of_phase([motions[0], AlongPath(FLAT, way)], 3.0)
    with refused(CouplingError, "c", found=2):
        PathWeights.of_gap(motions).at(np.zeros(1), 2)


@given(st.floats(0.1, 3.0))
@settings(max_examples=10)
def test_a_scale_of_weights_is_a_factor_of_them_and_of_their_size(factor):
    source = PathWeights.of_gap(meeting(), Gate(0.02))
    scaled, t = source.scaled(factor), np.array([1.0])
    np.testing.assert_allclose(scaled.at(t, 3).c, factor * source.at(t, 3).c, atol=1e-12)
    assert scaled.size(1.0) == pytest.approx(factor * source.size(1.0))
