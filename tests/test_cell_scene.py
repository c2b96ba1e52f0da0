"""The scene of any run: made again from a file, in any space, with bars that say who is compared."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from cells import SMALL_GAINS, small_cell
from machines import random_robot
from refusals import refused
from seams.degrees import Degrees
from sliders import SCARA, load, pair, urdf
from test_animation import ends, node

from synctrl import Cell, Coupling, Experiment, Hold, JointSpace, Member, Result, Robot, load_robot
from synctrl.errors import InputError, RobotWarning
from synctrl.experiments import carry_ur5, mobile_robot
from synctrl.robots.written import read_robot, write_robot
from synctrl.show import scene_of
from synctrl.show.arms import ALARM, skeleton
from synctrl.show.cell_scene import STILL
from synctrl.show.legends import pair_colors


@pytest.fixture(scope="module")
def star() -> Result:
    return Experiment(small_cell(4, coupling=Coupling.star(4)), SMALL_GAINS, 0.2).simulate(dt=5e-3)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Arms in joint space whose description has no shapes."""
    robot = load(tmp_path_factory.mktemp("bare"), "bare", SCARA, shapes=False)
    return pair((robot, robot)).simulate(dt=2e-3)


def reloaded(result: Result, folder: Any) -> Result:
    return Result.load(result.save(folder / "run.npz"))


def test_the_scene_of_a_loaded_run_is_the_same_page(star, bare, tmp_path):
    for run in (star, bare):
        assert scene_of(reloaded(run, tmp_path)).page() == scene_of(run).page()


def test_arms_with_meshes_come_back_from_a_file(tmp_path):
    ur5 = load_robot("ur5").placed((1.0, 2.0, 0.3), (0.1, 0.2, 0.3), name="left")
    again = read_robot(write_robot(ur5), "left", ur5.joint_names)
    q = np.linspace(-1, 1, 6)
    np.testing.assert_allclose(again.tip_pose(q).homogeneous, ur5.tip_pose(q).homogeneous, atol=1e-12)
    assert [g.meshPath for g in again.visual.geometryObjects] == [
        g.meshPath for g in ur5.visual.geometryObjects
    ]
    assert write_robot(ur5) == write_robot(ur5) != write_robot(ur5.placed((1, 0, 0)))
    assert "file" not in write_robot(ur5)  # the place of the catalogue's files is none of the result's


def test_a_locked_and_placed_panda_comes_back_with_its_tip():
    panda = load_robot("panda", tip="panda_link7").placed((0, 1, 0))
    again = read_robot(write_robot(panda), "panda", panda.joint_names)
    assert (again.tip, again.joint_names) == ("panda_link7", panda.joint_names)
    np.testing.assert_allclose(again.inertial_parameters, panda.inertial_parameters, atol=1e-12)


def test_bars_join_compared_tips_in_different_colours_and_turn_red(star):
    scene = scene_of(star, fps=1 / star.t[1])
    size = np.linalg.norm(star.sync_error, axis=2)
    for k, (i, j) in enumerate(star.info["pairs"]):
        bar = node(scene, f"segment ε{'₁₂₃'[k]}, to {star.names[j]}")
        start, end = ends(bar)
        np.testing.assert_allclose(start[:, :2], star.x[: len(start), i], atol=1e-9)
        np.testing.assert_allclose(end[:, :2], star.x[: len(end), j], atol=1e-9)
        worst = size[: len(start), k].argmax()
        if size[worst, k] == size.max():
            np.testing.assert_allclose(bar.rgb[worst], ALARM)
        assert bar.scale[worst, 0] == bar.scale[:, 0].max()
    bars = [color for text, color in scene._legend if text.startswith("ε")]
    assert bars == pair_colors(star) and len({*bars}) == 3


def test_an_object_that_hands_carry_is_drawn_where_it_is_and_so_it_is_of_a_loaded_run(tmp_path):
    run = carry_ur5().simulate(0.01, dt=1e-3)
    scene = scene_of(run, fps=1e3)
    box = node(scene, "box payload")
    pose = run.outputs["object_pose"][: len(box.position)]
    assert np.ptp(pose, axis=0).max() > 0
    np.testing.assert_allclose(box.position, pose[:, :3], atol=1e-12)
    np.testing.assert_allclose(np.abs((box.quaternion * pose[:, 3:]).sum(axis=1)), 1, atol=1e-12)
    assert scene_of(reloaded(run, tmp_path), fps=1e3).page() == scene.page()


def test_a_bar_past_other_tips_goes_above_what_it_would_hide():
    """Four arms in a row, all compared: three bars to the next one, and three past others."""
    arm = load_robot("planar2r")
    members = [Member(arm.placed((i, 0.0, 0.0)), Hold([0.3, 1.2])) for i in range(4)]
    run = Experiment(Cell(members, Coupling.complete(4)), SMALL_GAINS, 0.02).simulate(dt=5e-3)
    at = [member.robot.tip_position([0.3, 1.2]) for member in members]
    scene = scene_of(run)
    lifts = {}
    for k, (i, j) in enumerate(run.info["pairs"]):
        start, _ = ends(node(scene, f"segment ε{'₁₂₃₄₅₆'[k]}, to {run.names[j]}"))
        lifts[i, j] = start[0, 2] - at[i][2]
    past = [lift for (i, j), lift in lifts.items() if abs(i - j) > 1]
    assert all(abs(lifts[pair]) < 1e-9 for pair in ((0, 1), (1, 2), (2, 3)))
    assert len({*np.round(past, 6)}) == 3 and min(past) > 0.01


def test_robots_without_shapes_are_drawn_as_plain_links_and_the_page_says_so(bare):
    scene = scene_of(bare)
    robot = node(scene, "robot robot 1")
    assert sum(len(child.shapes) for child in robot.children) == 4 + 1 + 3  # balls, a rod, and links
    assert "as plain links: robot 1, robot 2" in scene.caption


def test_plain_links_reach_from_joint_to_joint():
    robot = random_robot(3, 4)
    shapes = skeleton(robot, "red").geometryObjects
    links = [g for g in shapes if isinstance(g.geometry, type(shapes[-1].geometry))]
    for link in links:
        half = link.placement.rotation[:, 2] * link.geometry.halfLength
        start, end = link.placement.translation - half, link.placement.translation + half
        ways = [robot.model.jointPlacements[j].translation for j in range(1, robot.model.njoints)]
        ways.append(robot.model.frames[robot.tip_id].placement.translation)
        assert np.abs(start).max() < 1e-9 and min(np.abs(end - way).max() for way in ways) < 1e-9


def test_in_joint_space_the_desired_paths_are_those_of_the_tips(bare):
    scene = scene_of(bare)
    robot = bare.experiment.cell.robots[0]
    tips = np.array([robot.tip_position(q) for q in bare.x_desired[:, 0]])
    low, high = node(scene, "line desired path of robot 1").shapes[0].bounds
    np.testing.assert_allclose([low, high], [tips.min(axis=0), tips.max(axis=0)], atol=0.02)


def test_tips_that_stand_still_have_no_path():
    run = mobile_robot().simulate(0.05)
    assert np.ptp(run.x[:, 0]) > STILL
    assert not [each for each in scene_of(run).nodes if each.name.startswith("line")]


def test_a_space_of_ones_own_that_has_no_tips_is_shown_without_paths():
    arm = load_robot("planar2r")
    members = [Member(arm.placed((i, 0, 0)), Hold([10.0, 60.0]), q0=[0.2, 1.0]) for i in range(2)]
    run = Experiment(Cell(members, Coupling.pair(), Degrees()), SMALL_GAINS, 0.02).simulate()
    scene = scene_of(run)
    assert not [each for each in scene.nodes if each.name.startswith("line")]
    assert "Desired paths are not shown" in scene.caption


def test_a_robot_that_cannot_be_made_again_is_named_and_its_experiment_taken(tmp_path):
    model = load_robot("planar2r").model
    robots = [Robot(pin.Model(model), "tip", name=f"mine {k}") for k in range(2)]
    members = [Member(robot, Hold([0.1, 1.0])) for robot in robots]
    experiment = Experiment(Cell(members, Coupling.pair(), JointSpace()), SMALL_GAINS, 0.02)
    loaded = reloaded(experiment.simulate(), tmp_path)
    with refused(InputError, "experiment", found="robot 1"):
        scene_of(loaded)
    assert scene_of(loaded, experiment).nodes


def test_a_description_of_another_robot_or_no_description_is_refused_by_name(star):
    robots = [{**robot, "joints": ["a", "b"]} for robot in star.info["robots"]]
    for wrong in (robots, [{**robot, "urdf": "<robot"} for robot in robots]):
        run = replace(star, info={**star.info, "robots": wrong}, experiment=None)
        with refused(InputError, "experiment", found="robot 1") as caught:
            scene_of(run)
        assert str(Path(__file__).parents[1]) not in str(caught.value)  # it comes from no file of ours


def test_a_notebook_shows_the_scene_or_says_that_it_is_too_large(star, monkeypatch):
    scene = scene_of(star)
    assert scene._repr_html_().startswith("<iframe sandbox=")
    monkeypatch.setattr("synctrl.show.shown.NOTEBOOK_LIMIT", 10)
    assert "use write()" in scene._repr_html_() and "<iframe" not in scene._repr_html_()


def test_meshes_beside_a_file_of_ones_own_are_found_again_from_elsewhere(tmp_path, monkeypatch):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((0.3, 0.1, 0.1)).export(tmp_path / "box.stl")
    text = urdf("boxes", SCARA).replace('<box size="0.3 0.06 0.06"/>', '<mesh filename="box.stl"/>')
    (tmp_path / "boxes.urdf").write_text(text, encoding="utf-8")
    robot = load_robot(tmp_path / "boxes.urdf")
    run = pair((robot, robot)).simulate(0.02, dt=2e-3)
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path / "other")
    loaded = reloaded(run, tmp_path)
    assert loaded.info["robots"][0]["file"] == str(tmp_path / "boxes.urdf")
    assert scene_of(loaded, package_dirs=[tmp_path]).page() == scene_of(run).page()
    (tmp_path / "box.stl").unlink()
    with pytest.warns(RobotWarning, match=r"box\.stl"):
        assert "Not shown of robot 1: box.stl" in scene_of(loaded, package_dirs=tmp_path).page()


def test_of_a_robot_that_comes_back_only_missing_pictures_are_said_again(tmp_path):
    text = urdf("odd one", SCARA)
    (tmp_path / "odd.urdf").write_text(text, encoding="utf-8")
    with pytest.warns(RobotWarning, match="odd one"):
        robot = load_robot(tmp_path / "odd.urdf")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_robot(write_robot(robot), "left", robot.joint_names)
    (tmp_path / "odd.urdf").write_text(
        text.replace('<box size="0.3 0.06 0.06"/>', '<mesh filename="no.stl"/>'), encoding="utf-8"
    )
    with pytest.warns(RobotWarning):
        robot = load_robot(tmp_path / "odd.urdf")
    expected = r"^the result's robot 'left':\n  left out \(\d\): .*no\.stl"
    with pytest.warns(RobotWarning, match=expected) as said:
        read_robot(write_robot(robot), "left", robot.joint_names)
    assert len(said) == 1


def test_a_result_does_not_choose_the_folder_from_which_meshes_are_read(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((0.3, 0.1, 0.1)).export(tmp_path / "box.stl")
    text = urdf("boxes", SCARA).replace('<box size="0.3 0.06 0.06"/>', '<mesh filename="box.stl"/>')
    (tmp_path / "boxes.urdf").write_text(text, encoding="utf-8")
    robot = load_robot(tmp_path / "boxes.urdf")
    loaded = reloaded(pair((robot, robot)).simulate(0.02, dt=2e-3), tmp_path)
    for folders in ((), [tmp_path / "other"]):
        with pytest.warns(RobotWarning, match=r"box\.stl") as told:
            assert "Not shown of robot 1: box.stl" in scene_of(loaded, package_dirs=folders).page()
        assert str(told[0].message).startswith("the result's robot 'robot 1':")
