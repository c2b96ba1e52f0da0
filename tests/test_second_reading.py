"""Other readers of a robot's file: they read what this package does, and it is seen where they do not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synctrl import load_robot
from synctrl.errors import RobotWarning
from synctrl.robots.documents import planar_arm, write_urdf
from synctrl.robots.second_reading import SAME, second_readings

CASES = Path(__file__).parent / "cases" / "urdf"
NAMES = ["planar2r", "a460_full", "ur5_gripper", "panda", "kinova", "talos_arm"]


def by_library(robot, **options):
    return {reading.library.split()[0]: reading for reading in second_readings(robot, **options)}


def differing(robot, library: str) -> set[str]:
    return {each.what for each in by_library(robot)[library].differences if not each.agrees}


@pytest.mark.filterwarnings("ignore::synctrl.errors.RobotWarning")
@pytest.mark.parametrize("name", NAMES)
def test_yourdfpy_and_mujoco_read_the_same(name):
    pytest.importorskip("mujoco")
    found = by_library(load_robot(name))
    assert found.keys() == {"yourdfpy", "MuJoCo"}
    for reading in found.values():
        assert reading.agrees, reading
        assert {"mass matrix", "torque of gravity", "range"} <= {each.what for each in reading.differences}


@settings(max_examples=10)
@given(st.lists(st.tuples(st.floats(0.1, 2), st.floats(0.1, 20)), min_size=1, max_size=4), st.floats(1.01, 3))
def test_other_masses_are_seen(tmp_path_factory, rods, factor):
    lengths, masses = zip(*rods, strict=True)
    file = write_urdf(planar_arm(lengths, masses), tmp_path_factory.mktemp("arms") / "arm.urdf")
    robot = load_robot(file)
    heavier = robot.with_parameters(factor * robot.inertial_parameters)
    assert not differing(robot, "yourdfpy")
    sizes = {each.what: each.size for each in by_library(heavier)["yourdfpy"].differences}
    assert sizes["mass matrix"] == pytest.approx((factor - 1) / factor)


@pytest.mark.parametrize("library", ["yourdfpy", "MuJoCo"])
def test_another_place_of_a_joint_another_tip_and_other_limits_are_seen(library):
    pytest.importorskip("mujoco")
    robot = load_robot("ur5_limited")
    model = robot.model.copy()
    model.jointPlacements[3].translation = model.jointPlacements[3].translation + np.array([0.0, 0.0, 1e-3])
    moved = robot._with(model)
    assert {"place of the tip", "mass matrix", "torque of gravity"} <= differing(moved, library)
    limited = robot.model.copy()
    limited.upperPositionLimit = 0.5 * limited.upperPositionLimit
    other = robot._with(limited)
    assert differing(other, library) == {"range"}


@pytest.mark.filterwarnings("ignore::synctrl.errors.RobotWarning")
@pytest.mark.parametrize(("joint", "position"), [("panda_joint2", 0.4), ("panda_finger_joint1", 0.02)])
def test_joints_that_are_held_stand_there_in_every_reading(joint, position):
    pytest.importorskip("mujoco")
    held = load_robot("panda", locked={joint: position})
    assert joint not in held.joint_names
    assert all(reading.agrees for reading in second_readings(held))


def test_a_reader_that_refuses_is_quoted_and_does_not_agree():
    pytest.importorskip("mujoco")
    with pytest.warns(RobotWarning):
        robot = load_robot(CASES / "plate_three_digits.urdf")
    found = by_library(robot)
    assert found["yourdfpy"].agrees and not found["MuJoCo"].agrees
    assert "inertia" in found["MuJoCo"].refusal and not found["MuJoCo"].differences


@pytest.mark.filterwarnings("ignore::synctrl.errors.RobotWarning")
def test_files_in_other_encodings_and_with_elements_of_other_programs_are_read_too(tmp_path):
    text = (CASES / "good.urdf").read_text("utf-8")
    strange = text.replace("</robot>", "<gazebo:plugin ros:file='x'/><link name='腕'/></robot>")
    strange = strange.replace(
        "</robot>", "<joint name='j' type='fixed'><parent link='link2'/><child link='腕'/></joint></robot>"
    )
    file = tmp_path / "arm.urdf"
    file.write_bytes(
        f"<?xml version='1.0' encoding='gb2312'?>\n{strange.partition('?>')[2] or strange}".encode("gb2312")
    )
    readings = by_library(load_robot(file, tip="link2"))
    assert readings["yourdfpy"].agrees, readings


def test_a_robot_without_a_file_is_not_read_again():
    robot = load_robot("planar2r")
    document = replace(robot.document, file=None)
    assert second_readings(type(robot)(robot.model, robot.tip, document=document)) == ()


def test_rounding_is_far_below_what_counts_as_the_same():
    (yourdfpy, *_) = second_readings(load_robot("ur10"))
    assert max(each.size for each in yourdfpy.differences) < 1e-3 * SAME
