"""Closed edges, and the frame of a nozzle that goes along them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from flows import derivative
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import Hold
from synctrl.errors import InputError
from synctrl.tasks.edge import DOWN, AlongEdge, Edge
from synctrl.tasks.rotations import log
from synctrl.tasks.ways import RampUp

SEEDS, TIMES = st.integers(0, 10_000), st.floats(0.1, 4.9)


def bean(rng: np.random.Generator):
    """A closed curve of about 2 m that bends both ways, as a function of an angle."""
    a, phase = rng.uniform(0.02, 0.12, 3), rng.uniform(0, 6, 3)
    k = np.array([2, 3, 4])

    def curve(u: float) -> np.ndarray:
        return (0.35 + 0.35 * np.sum(a * np.sin(k * u + phase))) * np.array([np.cos(u), np.sin(u)])

    return curve


def edge_of(rng: np.random.Generator) -> Edge:
    return Edge.of(bean(rng), tilt=rng.uniform(-0.8, 0.8), stand_off=rng.uniform(0.0, 0.02))


def stadium():
    """Two straight lines of 1 and two half circles of radius .5: its curvature jumps four times."""
    ends = np.cumsum([1.0, 0.5 * np.pi, 1.0, 0.5 * np.pi])

    def curve(u: float) -> np.ndarray:
        s = u % ends[-1]
        turn = np.pi * (s >= ends[1])
        s -= ends[1] * (s >= ends[1])
        angle = max(s - 1.0, 0.0) / 0.5 - np.pi / 2
        point = np.array([min(s, 1.0) - 0.5, 0.0]) + 0.5 * np.array([np.cos(angle), np.sin(angle)])
        return (np.cos(turn) * point).round(15)

    return curve, float(ends[-1])


def polygon(*corners: tuple[float, float], per_side: int = 4) -> np.ndarray:
    """Points along straight lines from corner to corner, and back to the first."""
    ends = np.array([*corners, corners[0]])
    steps = np.arange(per_side)[:, None] / per_side
    return np.concatenate([*(a + steps * (b - a) for a, b in pairwise(ends)), ends[:1]])


SQUARE = polygon((0, 0), (1, 0), (1, 1), (0, 1))


# -- the curve --------------------------------------------------------------------------------------------


@settings(max_examples=5)
@given(seed=SEEDS, s=st.floats(-3, 6))
def test_an_edge_is_travelled_by_its_length_and_its_tangent_normal_and_curvature_belong_together(seed, s):
    edge = Edge.of(bean(np.random.default_rng(seed)))
    at = edge.at(s)

    def part(name: str):
        return derivative(lambda x: getattr(edge.at(x), name), s, 2e-4)

    np.testing.assert_allclose(part("p"), at.t, atol=1e-8)
    np.testing.assert_allclose(part("t"), -at.kappa * at.n, atol=1e-6)
    np.testing.assert_allclose(part("n"), at.kappa * at.t, atol=1e-6)
    np.testing.assert_allclose(part("kappa"), at.kappa_s, atol=1e-3 * (1 + float(abs(at.kappa_s[0]))))
    np.testing.assert_allclose(np.cross(at.n, at.t), [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(edge.at(s + edge.length).p, at.p, atol=1e-9)


def test_a_circle_has_the_length_and_the_curvature_of_a_circle():
    u = np.linspace(0, 2 * np.pi, 101)
    edge = Edge(0.3 * np.stack((np.cos(u), np.sin(u)), axis=1))
    assert edge.length == pytest.approx(2 * np.pi * 0.3, rel=1e-9)
    at = edge.at(np.linspace(0, edge.length, 50))
    np.testing.assert_allclose(at.kappa, 1 / 0.3, rtol=1e-5)
    np.testing.assert_allclose(at.p, 0.3 * at.n, atol=1e-8)


def test_a_smooth_function_and_points_on_it_make_the_same_edge():
    curve = bean(np.random.default_rng(1))
    points = Edge([curve(u) for u in np.linspace(0, 2 * np.pi, 300)])
    function = Edge.of(curve)
    assert points.length == pytest.approx(function.length, rel=1e-8)
    s = np.linspace(0, function.length, 40)
    np.testing.assert_allclose(points.at(s).p, function.at(s).p, atol=1e-7)


# -- the nozzle -------------------------------------------------------------------------------------------


@settings(max_examples=5)
@given(seed=SEEDS, s=st.floats(0, 2))
def test_the_nozzle_points_at_the_edge_from_its_distance_tilted_to_the_outside(seed, s):
    edge = edge_of(np.random.default_rng(seed))
    at, frame = edge.at(s), edge.nozzle(s)
    a = frame.R[:, 2]
    np.testing.assert_allclose(frame.rho + edge.stand_off * a, at.p, atol=1e-12)
    assert a[2] == pytest.approx(-np.cos(edge.tilt))
    assert a @ at.t == pytest.approx(0, abs=1e-12)
    assert (frame.rho - at.p) @ at.n == pytest.approx(edge.stand_off * np.sin(edge.tilt))


@settings(max_examples=5)
@given(seed=SEEDS, s=st.floats(0, 2))
def test_derivatives_of_the_nozzles_frame_are_those_of_differences(seed, s):
    edge, h = edge_of(np.random.default_rng(seed)), 2e-4
    frame = edge.nozzle(s)
    np.testing.assert_allclose(derivative(lambda x: edge.nozzle(x).rho, s, h), frame.rho_s, atol=1e-7)
    np.testing.assert_allclose(derivative(lambda x: edge.nozzle(x).rho_s, s, h), frame.rho_ss, atol=1e-5)
    R_s = derivative(lambda x: edge.nozzle(x).R, s, h)
    np.testing.assert_allclose(R_s, np.cross(frame.w, frame.R, axisb=0, axisc=0), atol=1e-6)
    scale = 1 + np.abs(frame.w_s).max()
    np.testing.assert_allclose(derivative(lambda x: edge.nozzle(x).w, s, h), frame.w_s, atol=1e-3 * scale)


def test_the_nozzle_does_not_wind_up_on_its_way_round():
    edge = Edge.of(bean(np.random.default_rng(4)), tilt=0.5)
    R = edge.nozzle(np.linspace(0, edge.length, 200)).R
    np.testing.assert_allclose(R[-1], R[0], atol=1e-9)
    assert np.linalg.norm(log(R @ DOWN.T), axis=-1).max() == pytest.approx(0.5)


@settings(max_examples=10)
@given(seed=SEEDS, t=TIMES)
def test_the_way_of_a_nozzle_over_time_has_the_derivatives_of_differences(seed, t):
    rng = np.random.default_rng(seed)
    frame = AlongEdge(edge_of(rng), RampUp(rng.uniform(-0.2, 0.2), 0.5))
    t += 1e-2 * (abs(t - 0.5) < 4e-3)  # where s''' jumps
    position, turning = frame.position(t), frame.orientation(t)
    np.testing.assert_allclose(derivative(lambda t: frame.position(t).x, t), position.x_dot, atol=1e-6)
    np.testing.assert_allclose(derivative(lambda t: frame.position(t).x_dot, t), position.x_ddot, atol=1e-5)
    R_dot = derivative(lambda t: frame.orientation(t).R, t)
    np.testing.assert_allclose(R_dot, np.cross(turning.w, turning.R, axisb=0, axisc=0), atol=1e-6)
    w_dot = derivative(lambda t: frame.orientation(t).w, t)
    np.testing.assert_allclose(w_dot, turning.w_dot, atol=1e-3 * (1 + np.abs(w_dot).max()))


# -- what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        pytest.param(lambda: Edge(SQUARE[:-1]), "points", id="an open edge"),
        pytest.param(lambda: Edge(SQUARE[::-1]), "points", id="clockwise"),
        pytest.param(
            lambda: Edge(polygon((0, 0), (1, 1), (1, 0), (0, 1))), "points", id="an edge that crosses itself"
        ),
        pytest.param(lambda: Edge(np.repeat(SQUARE, 2, axis=0)), "points", id="a segment of no length"),
        pytest.param(lambda: Edge(np.zeros((9, 2))), "points", id="no extent"),
        pytest.param(lambda: Edge(SQUARE[[0, 4, 8, 0]]), "points", id="too few points"),
        pytest.param(lambda: Edge(np.zeros((9, 3))), "points", id="points in space"),
        pytest.param(lambda: Edge(SQUARE, tilt=2.0), "tilt", id="a tilt beyond a right angle"),
        pytest.param(lambda: Edge(SQUARE, stand_off=-1.0), "stand_off", id="a nozzle inside the plate"),
        pytest.param(lambda: Edge.of(*stadium(), tilt=0.3), "tilt", id="a curvature that jumps, tilted"),
        pytest.param(lambda: Edge.of(lambda u: SQUARE[int(4 * u) % 16], 4.0), "points", id="stairs"),
        pytest.param(
            lambda: Edge.of(lambda u: np.array([np.cos(u), abs(np.sin(u)) + 0.1 * np.sin(u)])),
            "curve",
            id="a corner",
        ),
        pytest.param(lambda: Edge.of(lambda u: (np.cos(u), np.sin(u)), 3.0), "points", id="half a circle"),
        pytest.param(lambda: AlongEdge(SQUARE, RampUp(0.1, 0.5)), "edge", id="points in place of an edge"),
        pytest.param(lambda: AlongEdge(Edge(SQUARE), Hold([0, 0])), "way", id="a way of two numbers"),
        pytest.param(lambda: RampUp(0.1, 0.0), "ramp", id="no ramp"),
    ],
)
def test_what_is_no_edge_and_no_motion_along_one_is_refused(make, subject):
    with refused(InputError, subject):
        make()


def test_a_nozzle_further_outside_than_the_edge_bends_inwards_is_refused():
    def kidney(u: float) -> np.ndarray:
        return (1 + 0.5 * np.cos(2 * u)) * np.array([np.cos(u), np.sin(u)])

    radius = -1 / Edge.of(kidney).at(np.linspace(0, 10, 5000)).kappa.min()
    Edge.of(kidney, tilt=np.pi / 6, stand_off=1.98 * radius)
    with refused(InputError, "stand_off"):
        Edge.of(kidney, tilt=np.pi / 6, stand_off=2.02 * radius)
    Edge.of(kidney, stand_off=3 * radius)  # above the edge, not beside it


def test_a_curvature_that_jumps_is_no_harm_to_a_nozzle_that_is_not_tilted():
    edge = Edge.of(*stadium(), stand_off=0.01)
    assert edge.length == pytest.approx(2 + np.pi, rel=1e-6)
