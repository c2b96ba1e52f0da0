"""Lengths of links bound the Jacobian of a tip, and its derivatives, wherever the joints are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import random_robot
from sliders import SCARA, load

from synctrl import Robot, load_robot
from synctrl.robots.link_lengths import column_bounds
from synctrl.robots.mechanism import joint_limits

ARMS = (
    "planar2r",
    "a460",
    "a460_full",
    "ur3",
    "ur5",
    "ur10_limited",
    "panda",
    "xarm7",
    "kinova",
    "z1",
)
ROUNDING = 1e-9


def drawn(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    """Joint positions: any angle, and slides within their limits, or within 5 m where there are none."""
    limits, turns = joint_limits(robot), np.array(robot.joint_units) == "rad"
    low, high = np.where(turns, -np.pi, limits.lower), np.where(turns, np.pi, limits.upper)
    return rng.uniform(np.maximum(low, -5.0), np.minimum(high, 5.0))


def check(robot: Robot, seed: int) -> None:
    """Columns of J and of its derivatives at some positions against their bounds."""
    rng, bounds = np.random.default_rng(seed), column_bounds(robot)
    for q in (drawn(robot, rng) for _ in range(10)):
        J = robot.jacobian(q)
        assert (np.linalg.norm(J[:3], axis=0) <= bounds.linear + ROUNDING).all()
        assert (np.linalg.norm(J[3:], axis=0) <= bounds.angular + ROUNDING).all()
        for j, along in enumerate(np.eye(robot.nv)):
            slope = robot.jacobian_dot(q, along)
            assert (np.linalg.norm(slope[:3], axis=0) <= bounds.bending[j] + ROUNDING).all()
            assert (np.linalg.norm(slope[3:], axis=0) <= bounds.turning[j] + ROUNDING).all()


@pytest.mark.parametrize("name", ARMS)
def test_no_position_of_a_robot_of_the_catalogue_is_beyond_the_bounds(name: str) -> None:
    check(load_robot(name), 1)


@given(seed=st.integers(0, 2**20), chain=st.booleans())
@settings(max_examples=25)
def test_nor_is_one_of_any_robot_be_it_a_tree_or_with_slides(seed: int, chain: bool) -> None:
    check(random_robot(seed, 5, chain), seed)


def test_a_stretched_arm_reaches_its_bounds() -> None:
    for name in ("planar2r", "a460"):
        robot = load_robot(name)
        bounds, rng = column_bounds(robot), np.random.default_rng(0)
        tried = [np.linalg.norm(robot.jacobian(drawn(robot, rng))[:3], axis=0) for _ in range(1000)]
        assert np.max(tried, axis=0) == pytest.approx(bounds.linear, rel=0.05)


def test_a_slide_lengthens_the_arm_by_its_limits_and_without_limits_there_is_no_bound(tmp_path) -> None:
    robot = load(tmp_path, "scara", SCARA)
    check(robot, 2)
    assert np.isfinite(column_bounds(robot).linear).all()
    unlimited = random_robot(13)
    assert np.isinf(column_bounds(unlimited).linear).any()


def test_a_tool_beyond_the_tip_adds_its_length_to_every_joint_that_turns() -> None:
    arm = load_robot("ur5")
    assert column_bounds(arm, 0.25).linear == pytest.approx(column_bounds(arm).linear + 0.25)
