"""Animations show what was computed: every mark is where, and as large as, its caption says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from synctrl import Cell, Coupling, Experiment, Gains, Hold, Member, load_robot
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four
from synctrl.show.animation import (
    PAIR_TIMES,
    PAYLOAD,
    PLANAR_TIMES,
    THICK,
    THIN,
    payload_pair_scene,
    planar_scene,
)
from synctrl.show.arms import ALARM, CALM
from synctrl.tasks.rotations import from_quaternion as rotations

FPS = 25.0


@pytest.fixture(scope="module")
def planar():
    return planar_four(synchronized=False, disturbance="torque").simulate(0.8, dt=2e-3)


@pytest.fixture(scope="module")
def pair():
    return a460_pair(synchronized=False).simulate(0.4, dt=2e-3)


def node(scene, name):
    (found,) = (n for n in scene.nodes if n.name == name)
    return found


def shown(result):
    """Instants that are shown: every 1/FPS."""
    return slice(0, len(result.t) - 1, round(1 / FPS / result.t[1]))


def ends(segment):
    """Both ends of a bar, (T, 3): it lies along z of its node and is as long as its scale."""
    half = 0.5 * segment.scale[:, 2:] * rotations(segment.quaternion)[:, :, 2]
    return segment.position - half, segment.position + half


def test_bars_join_the_tips_of_the_pairs_that_are_compared(planar):
    scene = planar_scene(planar, fps=FPS)
    for k, (i, j) in enumerate(planar.info["pairs"]):
        start, end = ends(node(scene, f"segment error {k + 1}, to {planar.names[j]}"))
        np.testing.assert_allclose(start[:, :2], planar.x[shown(planar), i], atol=1e-9)
        np.testing.assert_allclose(end[:, :2], planar.x[shown(planar), j], atol=1e-9)


def test_bars_grow_and_redden_with_the_synchronization_error(planar):
    limit = 0.1
    scene = planar_scene(planar, limit=limit, fps=FPS)
    size = np.linalg.norm(planar.sync_error[shown(planar)], axis=2)
    for k, (_, end) in enumerate(planar.info["pairs"]):
        bar = node(scene, f"segment error {k + 1}, to {planar.names[end]}")
        share = np.clip(size[:, k] / limit, 0, 1)
        np.testing.assert_allclose(bar.scale[:, 0], THIN + share * (THICK - THIN))
        np.testing.assert_allclose(bar.rgb, CALM + share[:, None] * (ALARM - CALM))
    assert size.max() > limit, "the largest error is beyond full red"
    assert "from 0.1 m²" in scene.caption


def test_without_a_limit_the_largest_error_of_the_run_is_fully_red(planar):
    largest = np.linalg.norm(planar.sync_error, axis=2).max()
    assert f"from {largest:.2g} m²" in planar_scene(planar, fps=FPS).caption


def test_tracking_errors_are_drawn_as_many_times_larger_as_the_caption_says(planar):
    scene = planar_scene(planar, fps=FPS)
    assert f"{PLANAR_TIMES:g} times as large" in scene.caption
    for i in range(4):
        desired, far = ends(node(scene, f"segment error of robot {i + 1}"))
        np.testing.assert_allclose(desired[:, :2], planar.x_desired[shown(planar), i], atol=2e-6)
        drawn = (desired - far)[:, :2]
        np.testing.assert_allclose(drawn, PLANAR_TIMES * planar.tracking_error[shown(planar), i], atol=2e-6)


def test_a_torque_from_outside_is_seen_while_it_acts(planar):
    ball = node(planar_scene(planar, fps=FPS), "sphere torque on robot 1")
    t = planar.t[shown(planar)]
    np.testing.assert_array_equal(ball.scale[:, 0] > 1e-3, (t >= 0.5) & (t < 0.75))
    base = planar.experiment.cell.robots[0].model.jointPlacements[1].translation
    np.testing.assert_allclose(ball.position[0], base)


def test_a_run_that_nothing_disturbs_shows_no_torque(pair):
    assert not [n for n in payload_pair_scene(pair).nodes if "torque" in n.name]


def test_the_payload_lies_level_between_the_wrists(pair):
    payload = node(payload_pair_scene(pair, fps=FPS), "box payload")
    wrists = [
        np.array([robot.tip_position(q) for q in pair.q[shown(pair), i]])
        for i, robot in enumerate(pair.experiment.cell.robots)
    ]
    np.testing.assert_allclose(payload.position, 0.5 * (wrists[0] + wrists[1]), atol=1e-9)
    along, up = rotations(payload.quaternion)[:, :, 0], rotations(payload.quaternion)[:, :, 2]
    between = wrists[1] - wrists[0]
    np.testing.assert_allclose(np.cross(along, between), 0, atol=1e-9)
    assert (up[:, 2] > np.cos(np.deg2rad(2))).all()
    assert np.abs(np.linalg.norm(between, axis=1) - PAYLOAD[0]).max() < 0.02


def test_wrist_errors_are_those_of_the_joints(pair):
    scene = payload_pair_scene(pair, fps=FPS)
    assert f"{PAIR_TIMES:g} times as large" in scene.caption
    for i, robot in enumerate(pair.experiment.cell.robots):
        desired, far = ends(node(scene, f"segment error of robot {i + 1}"))
        wanted = np.array([robot.tip_position(q) for q in pair.x_desired[shown(pair), i]])
        actual = np.array([robot.tip_position(q) for q in pair.q[shown(pair), i]])
        np.testing.assert_allclose(desired, wanted, atol=2e-6)
        np.testing.assert_allclose(far - desired, PAIR_TIMES * (actual - wanted), atol=2e-6)


def test_the_page_says_that_the_payload_is_drawn(pair):
    scene = payload_pair_scene(pair, fps=FPS)
    assert "drawn, not simulated" in scene.caption
    assert "deg of synchronization error" in scene.caption
    assert scene.title == "A460 pair, independent"


def test_every_robot_stands_with_its_desired_path(planar, pair):
    for scene in (planar_scene(planar, fps=FPS), payload_pair_scene(pair, fps=FPS)):
        names = [n.name for n in scene.nodes]
        robots = [name for name in names if name.startswith("robot ")]
        assert len([name for name in names if name.startswith("line desired path")]) == len(robots) >= 2


def test_runs_that_cannot_be_shown_are_refused(planar, pair):
    with refused(InputError, "result", found=("joint1", "joint2", "joint3")):
        planar_scene(pair)
    with refused(InputError, "result", found=(4, "m")):
        payload_pair_scene(planar)
    with refused(InputError, "experiment", found="no experiment"):
        planar_scene(replace(planar, experiment=None))
    with refused(InputError, "fps"):
        planar_scene(planar, fps=0)
    with refused(InputError, "limit"):
        payload_pair_scene(pair, limit=-1.0)


def test_a_loaded_result_is_shown_with_the_experiment_that_made_it(planar):
    loaded = replace(planar, experiment=None)
    one = planar_scene(loaded, planar.experiment, fps=FPS).page()
    assert one == planar_scene(planar, fps=FPS).page()


def test_a_robot_without_shapes_is_drawn_as_plain_links():
    bare = load_robot("planar2r").placed()
    bare.visual = None
    members = [Member(bare.placed((0, k, 0)), Hold([0.1, 0.2])) for k in range(2)]
    gains = Gains(Lambda=1.0, beta=1.0, K_r=1.0, K_eps=1.0, Gamma=1.0)
    run = Experiment(Cell(members, Coupling.pair()), gains, 0.01).simulate()
    links = node(payload_pair_scene(run), "robot robot 1").children
    assert [len(link.shapes) for link in links] == [2, 2]  # a ball and a link each
