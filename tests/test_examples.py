"""Examples 1 to 3 of the paper, and the vehicle that its wheels move."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from browser import open_page
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import load_robot
from synctrl.errors import InputError
from synctrl.experiments import mobile_robot, quadratic_analysis, rigid_object
from synctrl.experiments.mobile_robot import DURATION, TRACK, WHEEL_RADIUS, WheelPath, heading, radius
from synctrl.experiments.rigid_object import A
from synctrl.show.animation import vehicle_animation, vehicle_path
from synctrl.tasks.rotations import from_quaternion as matrices

SCRIPT = Path(__file__).resolve().parent.parent / "scripts" / "paper_examples.py"
TIMES = np.linspace(0, DURATION, 400)


@cache
def run(example, synchronized=True, disturbed=True):
    return example(synchronized, disturbed).simulate(dt=4e-3 if example is rigid_object else 1e-2)


# -- examples 1 and 2, closed loop ------------------------------------------------------------------------


@pytest.mark.parametrize("example", [rigid_object, mobile_robot])
def test_both_robots_reach_the_desired_motion_and_each_other(example):
    result = run(example)
    assert np.abs(result.tracking_error[-1]).max() < 0.05 * np.abs(result.tracking_error).max()
    assert np.abs(result.sync_error[-1]).max() < 0.02 * np.abs(result.sync_error).max()


@pytest.mark.parametrize("example", [rigid_object, mobile_robot])
@pytest.mark.parametrize("disturbed", [True, False])
def test_synchronized_robots_stay_in_step_more_closely_than_independent_ones(example, disturbed):
    together, alone = run(example, True, disturbed), run(example, False, disturbed)
    assert np.abs(together.sync_error).max() < np.abs(alone.sync_error).max() / 3


@pytest.mark.parametrize("example", [rigid_object, mobile_robot])
def test_only_synchronized_robots_respond_to_what_happens_to_the_other(example):
    for synchronized in (True, False):
        calm, pushed = run(example, synchronized, False), run(example, synchronized, True)
        assert np.array_equal(calm.q[:, 1], pushed.q[:, 1]) != synchronized


@pytest.mark.parametrize("example", [rigid_object, mobile_robot])
def test_the_synchronization_error_is_the_function_of_the_actual_positions(example):
    result = run(example)
    x = result.x
    if example is rigid_object:
        f = x[:, 0] - x[:, 1] - A
    else:
        f = radius(result.t, 1)[0][:, None] * x[:, 0] - radius(result.t, 0)[0][:, None] * x[:, 1]
    np.testing.assert_allclose(result.sync_error[:, 0], f, atol=1e-10 * np.abs(x).max())


# -- example 2: radii, wheels and the vehicle -------------------------------------------------------------


def test_the_weights_of_the_wheels_change_with_the_radii():
    weights = mobile_robot().cell.coupling.weights(TIMES, 1)
    for i, (sign, other) in enumerate([(-1, 1), (1, 0)]):
        expected = sign * radius(TIMES, other)
        for part, derivative in zip(weights[:3], expected, strict=True):
            largest = np.abs(derivative).max()
            assert largest > 0.05
            np.testing.assert_allclose(part[:, i, 0, 0], derivative, atol=1e-8 * largest)


@pytest.mark.parametrize("function", [lambda t: WheelPath(0)(t), lambda t: WheelPath(1)(t), heading])
def test_the_derivatives_of_path_and_heading_are_derivatives(function):
    h = 1e-4
    _, first, second = (np.asarray(part) for part in function(TIMES))
    later, earlier = function(TIMES + h), function(TIMES - h)
    np.testing.assert_allclose((later[0] - earlier[0]) / (2 * h), first, atol=1e-5)
    np.testing.assert_allclose((later[1] - earlier[1]) / (2 * h), second, atol=1e-5)


def test_x_over_r_is_the_heading_for_both_wheels_and_the_curvature_changes():
    angles = np.stack([WheelPath(i)(TIMES).x[:, 0] for i in range(2)], axis=1)
    path = vehicle_path(angles, WHEEL_RADIUS, TRACK)
    np.testing.assert_allclose(path[:, 2], heading(TIMES)[0], atol=1e-12)
    for i in range(2):
        np.testing.assert_allclose(WHEEL_RADIUS * angles[:, i] / radius(TIMES, i)[0], path[:, 2], atol=1e-12)
    way = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1)
    curvature = (np.diff(path[:, 2]) / way)[40:]
    assert curvature.max() > 1.5 * curvature.min() > 0
    assert (np.diff(angles, axis=0) > 0).all()  # no wheel ever turns back


@given(st.floats(-3, 3), st.floats(0.5, 3), st.integers(2, 50))
def test_steady_wheels_drive_the_vehicle_round_a_circle_whatever_the_step(turn, mean_radius, steps):
    theta = np.linspace(0, turn, steps)
    ways = np.stack([mean_radius - TRACK / 2, mean_radius + TRACK / 2])
    path = vehicle_path(theta[:, None] * ways / WHEEL_RADIUS + 7.0, WHEEL_RADIUS, TRACK)
    circle = mean_radius * np.stack([np.sin(theta), 1 - np.cos(theta)], axis=1)
    np.testing.assert_allclose(path[:, :2], circle, atol=1e-9)
    np.testing.assert_allclose(path[:, 2], theta, atol=1e-9)


def test_a_wheel_has_the_inertia_it_says_and_no_weight_to_lift():
    wheel = load_robot("wheel")
    for q in (0.0, 1.0, 4.0):
        np.testing.assert_allclose(wheel.mass_matrix([q]), [[0.05]], rtol=1e-12)
        np.testing.assert_allclose(wheel.gravity([q]), [0.0], atol=1e-12)


def node(scene, name):
    return next(node for node in scene.nodes if node.name.endswith(name))


def test_the_wheels_of_the_animation_roll_on_the_ground_without_slip():
    result = run(mobile_robot)
    fps = 100  # every instant of the log, so that a frame's difference is a velocity
    scene = vehicle_animation(result, WHEEL_RADIUS, TRACK, fps=fps)
    for i, name in enumerate(("left wheel", "right wheel")):
        spoke = node(scene, f"spoke of {name}")
        turned = matrices(spoke.quaternion)
        # The point of the wheel that touches the ground stands still: p + R down is stationary.
        down = np.einsum("tji,j->ti", turned, [0.0, 0.0, -WHEEL_RADIUS])
        before = spoke.position[:-1] + np.einsum("tij,tj->ti", turned[:-1], down[:-1])
        after = spoke.position[1:] + np.einsum("tij,tj->ti", turned[1:], down[:-1])
        rolled = WHEEL_RADIUS * np.abs(np.diff(result.x[: len(turned), i, 0]))
        slip = np.linalg.norm(after - before, axis=1)
        assert (slip <= 0.1 * rolled + 1e-5).all()
        np.testing.assert_allclose(spoke.position[:, 2], WHEEL_RADIUS)
        axle = matrices(node(scene, f"cylinder {name}").quaternion)[:, :, 2]
        np.testing.assert_allclose(np.abs(np.vecdot(axle, turned[:, :, 1])), 1.0, atol=1e-9)


def test_the_animation_shows_the_body_between_its_wheels_and_both_paths():
    result = run(mobile_robot)
    scene = vehicle_animation(result, WHEEL_RADIUS, TRACK, fps=20)
    left, right = (node(scene, f"cylinder {name}").position for name in ("left wheel", "right wheel"))
    np.testing.assert_allclose(np.linalg.norm(left - right, axis=1), TRACK)
    driven = vehicle_path(result.x[:, :, 0], WHEEL_RADIUS, TRACK)[::5][: len(left)]
    np.testing.assert_allclose(((left + right) / 2)[:, :2], driven[:, :2], atol=1e-9)
    assert {"line desired path", "line driven path"} <= {node.name for node in scene.nodes}
    assert scene.page().startswith("<!DOCTYPE html>")


def test_the_vehicle_drives_its_path_in_a_browser(tmp_path):
    path = vehicle_animation(run(mobile_robot), WHEEL_RADIUS, TRACK).write(tmp_path / "vehicle.html")
    with open_page(path) as page:
        page.check_plays()


def test_only_a_run_of_two_wheels_moves_a_vehicle():
    with refused(InputError, "result", found=(2, 2)):
        vehicle_animation(rigid_object().simulate(0.01), WHEEL_RADIUS, TRACK)
    with refused(InputError, "angles"):
        vehicle_path(np.zeros((4, 3)), WHEEL_RADIUS, TRACK)


# -- example 3 --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("t", [0.0, 1.3])
def test_the_quadratic_function_has_second_order_coefficients_of_plus_one_and_row_vectors(t):
    analysis = quadratic_analysis(t)
    xd = np.array([r * np.array([np.cos(t), np.sin(t)]) for r in (0.3, 0.4)])
    np.testing.assert_allclose(analysis.expansion.value, 0, atol=1e-12)
    np.testing.assert_allclose(analysis.expansion.c[:, 0], -2 * xd, atol=1e-10)
    assert analysis.expansion.second_order_terms() == ["+1 e_1^T e_1", "+1 e_2^T e_2"]
    assert not analysis.expansion.invertible


def test_control_with_the_quadratic_function_is_refused_for_both_reasons():
    said = quadratic_analysis().refusal
    assert "1 by 2 and has no inverse" in said and "not linear (assumption 1)" in said
    assert said in str(quadratic_analysis())


def test_the_script_runs_all_examples_and_writes_the_animations(tmp_path):
    command = [sys.executable, str(SCRIPT), "--out", str(tmp_path), "--duration", "0.1"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=SCRIPT.parent.parent)
    assert "refused: f cannot be controlled" in done.stdout
    assert {path.name for path in tmp_path.iterdir()} == {
        "mobile_robot_synchronized.html",
        "mobile_robot_independent.html",
    }
