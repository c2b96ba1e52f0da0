"""Whether tubes stay clear of singular configurations: the geometry behind the answer, and both answers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from machines import rod_arm
from theory_cells import planar_arm

from synctrl import CartesianSpace, Cell, Coupling, Experiment, Gains, Member, PoseSpace, Robot, load_robot
from synctrl.analysis import Tube, tube
from synctrl.analysis.clearance import LOG, SCALES, bend, clearance, two_links
from synctrl.experiments import panda_four, planar_four, rigid_object, ur5_payload
from synctrl.experiments.planar_four import GAINS
from synctrl.tasks.rotations import left_jacobian_inverse, log
from synctrl.tasks.trajectories import Hold


def tip_of(robot: Robot, q: np.ndarray, space: CartesianSpace | PoseSpace) -> np.ndarray:
    """Where the tip is, in coordinates of the space."""
    pose = robot.tip_pose(q)
    return np.append(pose.translation, log(pose.rotation)) if space.m == 6 else pose.translation[space.rows]


# -- the inequality ----------------------------------------------------------------------------------------

ARMS = {
    "planar": (load_robot("planar2r"), CartesianSpace("xy")),
    "a460": (load_robot("a460"), CartesianSpace("xyz")),
    "ur5": (load_robot("ur5"), PoseSpace()),
    "kinova": (load_robot("kinova"), PoseSpace()),
}


@pytest.mark.parametrize("name", ARMS)
@given(seed=st.integers(0, 2**20), far=st.floats(0.01, 1.0), scale=st.sampled_from(SCALES))
@settings(max_examples=10)
def test_an_error_is_at_least_what_the_smallest_singular_value_says_less_the_bend(
    name: str, seed: int, far: float, scale: float
) -> None:
    """By Taylor's formula, in which H bounds what is left out of the tip's way, and of its Jacobian."""
    robot, space = ARMS[name]
    rng = np.random.default_rng(seed)
    q_d, way = (seed % 2) * rng.uniform(-np.pi, np.pi, robot.nv), rng.standard_normal(robot.nv)
    units, H = bend(robot, scale, space.m)
    J = space.miss(robot, tip_of(robot, q_d, space), q_d)[1] / units[:, None]
    s = np.linalg.svd(J, compute_uv=False)[-1]
    step = far * way / np.linalg.norm(way)
    e, J_there = space.miss(robot, tip_of(robot, q_d, space), q_d + step)
    assert np.linalg.norm(e / units + J @ step) <= H / 2 * far**2 + 1e-9
    assert np.linalg.norm(e / units) >= s * far - H / 2 * far**2 - 1e-9
    moved = (robot.jacobian(q_d + step) - robot.jacobian(q_d))[: len(units)] / units[:, None]
    assert np.linalg.norm(moved[space.rows] if space.m < 6 else moved, 2) <= H * far + 1e-9
    assert np.linalg.svd(J_there / units[:, None], compute_uv=False)[-1] >= s - H * far - 1e-9


@given(phi=st.lists(st.floats(-1, 1), min_size=3, max_size=3), size=st.floats(0.01, np.pi - 1e-3))
@settings(max_examples=25)
def test_the_logarithm_bends_by_less_than_is_reckoned_with(phi: list[float], size: float) -> None:
    assume(np.linalg.norm(phi) > 1e-3)
    turn = size * np.array(phi) / np.linalg.norm(phi)
    assert np.linalg.norm(left_jacobian_inverse(turn) - np.eye(3), 2) <= LOG * size
    largest = np.linalg.norm(left_jacobian_inverse(turn), 2)
    assert largest == pytest.approx((size / 2) / np.sin(size / 2), rel=1e-9)


def test_two_links_are_known_by_their_axes_whatever_the_offsets() -> None:
    assert two_links(load_robot("planar2r"), CartesianSpace("xy")) == pytest.approx((0.3, 0.3))
    placed = rod_arm((1.0, 2.0), (0.4, 0.7)).placed((1, 2, 3), (0, 0, 0.5))
    assert two_links(placed, CartesianSpace("xy")) == pytest.approx((0.4, 0.7))
    assert two_links(placed.placed((0, 0, 0), (np.pi / 2, 0, 0)), CartesianSpace("xy")) is None
    assert two_links(planar_arm(3), CartesianSpace("xy")) is None


# -- the answers -------------------------------------------------------------------------------------------


def told(experiment: Experiment, **changes: float) -> Tube:
    gains = experiment.gains.replace(**changes)
    return tube(experiment.cell, gains, duration=experiment.duration, disturbances=experiment.disturbances)


def test_it_closes_for_the_rigid_object_without_a_push_and_not_with_it() -> None:
    assert told(rigid_object(disturbed=False)).closes
    pushed = told(rigid_object(disturbed=True))
    assert pushed.excludes_singularities is False and not pushed.closes
    assert told(rigid_object(disturbed=True), K_r=2.0).closes


def test_the_papers_four_arms_are_too_near_their_reach_but_with_faster_learning_it_closes() -> None:
    paper = told(planar_four())
    assert paper.excludes_singularities is False
    assert "robot 2" in paper.reason or "robot 3" in paper.reason  # on the larger circle
    assert told(planar_four(), Gamma=5 * GAINS.Gamma).closes


def test_a_tube_that_closes_has_no_singular_position_in_it() -> None:
    """Tips anywhere in it are at distances at which the elbow is neither folded nor stretched."""
    one, rng = rigid_object(disturbed=False), np.random.default_rng(0)
    found = told(one)
    for k in rng.integers(len(found.t), size=20):
        for i, robot in enumerate(one.cell.robots):
            angle, share = rng.uniform(0, 2 * np.pi), np.sqrt(rng.uniform())
            away = share * found.radius[k, i, 0] * np.array([np.cos(angle), np.sin(angle)])
            target = one.cell.motion(i, found.t[k : k + 1]).x[0] - away
            distance = np.linalg.norm(target - robot.model.jointPlacements[1].translation[:2])
            assert 0 < distance < 0.6


def test_the_tube_of_the_ur5_excludes_half_turns_and_not_singular_positions() -> None:
    one = ur5_payload()
    found = tube(one.cell, one.gains, duration=one.duration, times=np.linspace(0, one.duration, 21))
    assert found.excludes_half_turns is True
    assert found.excludes_singularities is False and not found.closes
    assert found.largest[:, 1].max() < found.plain.max() < 3.0


def test_arms_of_any_kind_that_start_almost_right_and_are_known_close_it() -> None:
    gains = Gains(Lambda=20.0, beta=20.0, K_r=20.0, K_eps=1.0, Gamma=10.0)
    for robot, space, q in (
        (load_robot("a460"), CartesianSpace("xyz"), np.array([0.3, 0.9, -1.2])),
        (load_robot("ur5"), PoseSpace(), np.array([0.0, -1.5, 2.0, -0.5, np.pi / 2, 0.0])),
    ):
        stay = Hold(tip_of(robot, q, space))
        known = {"theta_hat0": robot.inertial_parameters}
        members = [Member(robot, stay, q + 1e-5, name=f"arm {i}", **known) for i in (1, 2)]
        cell = Cell(members, Coupling.pair(), space)
        assert tube(cell, gains, duration=1.0, times=[0.0, 0.5, 1.0]).closes
        assert tube(cell, gains, 1.0, 1.0, times=[0.0, 0.5, 1.0]).excludes_singularities is False


def test_a_start_on_another_branch_is_seen() -> None:
    robot, space = load_robot("a460"), CartesianSpace("xyz")
    q = np.array([0.3, 0.9, -1.2])
    stay, known = Hold(tip_of(robot, q, space)), {"theta_hat0": robot.inertial_parameters}
    for start, excluded in ((q, True), (q + 2 * np.pi * np.eye(3)[2], True)):
        members = [Member(robot, stay, start, name=f"arm {i}", **known) for i in (1, 2)]
        cell = Cell(members, Coupling.pair(), space)
        told = cell.reference_table(np.array([0.0, 1.0]))
        assert clearance(cell, told, np.full((2, 2, 1), 1e-6)).excluded is excluded
        assert clearance(cell, told, np.full((2, 2, 1), 1e3)).excluded is False
    far = [Member(robot, stay, q + 0.8, name=f"arm {i}", **known) for i in (1, 2)]
    assert clearance(Cell(far, Coupling.pair(), space), told, np.full((2, 2, 1), 1e-6)).excluded is None


def test_of_free_joints_and_damped_inverses_nothing_is_said() -> None:
    four = panda_four()
    found = tube(four.cell, four.gains, times=[0.0, 1.0])
    assert found.excludes_singularities is None and not found.closes
    one = rigid_object(disturbed=False)
    damped = Cell(one.cell.members, one.cell.coupling, CartesianSpace("xy", singularity="damped"))
    assert tube(damped, one.gains, times=[0.0, 1.0]).excludes_singularities is None
