"""Friction that a robot's file states: at hand, never silently ignored, and one word lets it act."""

from __future__ import annotations

import pickle
import warnings
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from refusals import refused

from synctrl import (
    BaseParameters,
    Cell,
    Coupling,
    Cubic,
    Experiment,
    Friction,
    FrictionParameters,
    FullParameters,
    Gains,
    Hold,
    Member,
    Result,
    load_robot,
)
from synctrl.errors import InputError, RobotWarning
from synctrl.robots.documents import planar_arm, write_urdf
from synctrl.robots.robot import Robot
from synctrl.robots.urdf.description import describe, read_urdf

STATING = ("panda", "xarm7", "z1", "talos_arm")
VISCOUS, COULOMB = (0.3, 0.2), (0.1, 0.05)


def rubbing(armature: float = 0.0) -> Robot:
    """A planar arm whose description states friction."""
    document = planar_arm([0.3, 0.3], [1, 1])
    moving = [
        replace(joint, damping=VISCOUS[k], friction=COULOMB[k]) if joint.moves else joint
        for k, joint in enumerate(document.joints)
    ]
    found = describe(replace(document, joints=tuple(moving)))
    robot = Robot(found.model, found.tip, name="arm", document=found.document, report=found.report)
    return robot.with_armature(armature) if armature else robot


def cell(robot: Robot, **options: object) -> Cell:
    path = Cubic([0.1, 0.5], [0.6, 0.1], 0.3)
    return Cell([Member(robot, path, **options)] * 2, Coupling.pair())


def experiment(robot: Robot, **options: object) -> Experiment:
    made = cell(robot, **options)
    return Experiment(made, Gains(8, 8, 2, 1, 0.1), 0.3)


def in_file(path: Path, joint: str) -> tuple[float, float]:
    """Damping and friction of a joint as its file writes them."""
    for element in ElementTree.parse(path).getroot().findall("joint"):
        if element.get("name") == joint:
            dynamics = element.find("dynamics")
            found = {} if dynamics is None else dynamics.attrib
            return float(found.get("damping", 0)), float(found.get("friction", 0))
    raise KeyError(joint)


@pytest.mark.parametrize("name", STATING)
def test_what_the_file_says_is_at_hand_joint_by_joint(name):
    robot = load_robot(name)
    stated = np.array([in_file(robot.document.file, joint) for joint in robot.joint_names]).T
    np.testing.assert_array_equal([robot.urdf_friction.viscous, robot.urdf_friction.coulomb], stated)
    assert stated.any()
    moved = robot.placed((1, 0, 0)).with_tip(robot.tip).with_armature(0.1)
    assert moved.urdf_friction.equals(robot.urdf_friction)
    heavier = robot.with_parameters(1.1 * robot.inertial_parameters)
    assert heavier.urdf_friction.equals(robot.urdf_friction)


@pytest.mark.parametrize("name", STATING)
def test_the_report_of_a_robot_says_that_its_friction_waits_to_be_asked_for(name):
    report = load_robot(name).report
    assert [note.kind for note in report.known] == ["assumed"]
    assert "friction='urdf'" in str(report)


def test_friction_alone_is_neither_a_warning_nor_an_error_of_a_strict_reader(tmp_path):
    file = write_urdf(rubbing().document, tmp_path / "robot.urdf")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for strict in (False, True):
            report = read_urdf(file, strict=strict).report
            assert not report and "dynamics" in report.known[0].where


def test_friction_that_nobody_asks_for_is_said_when_a_run_leaves_it_out():
    with pytest.warns(RobotWarning, match="robot 1, robot 2 state friction, which does not act") as caught:
        result = experiment(rubbing()).simulate(0.05)
    assert {Path(each.filename) for each in caught} == {Path(__file__)}
    assert result.info["friction"] == ["nobody"] * 2


@pytest.mark.parametrize("friction", [Friction(), "urdf"])
def test_whoever_says_what_friction_there_is_is_not_warned(friction):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = experiment(rubbing(), friction=friction).simulate(0.05)
    assert result.info["friction"] == ["urdf" if friction == "urdf" else "given"] * 2


def test_a_robot_without_friction_in_its_file_needs_no_word():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        experiment(load_robot("planar2r")).simulate(0.05)


def test_one_word_puts_friction_into_plant_and_regressor():
    member = Member(rubbing(), Hold([0.1, 0.2]), friction="urdf")
    assert isinstance(member.parameters, FrictionParameters)
    np.testing.assert_array_equal(member.theta[-4:], [*VISCOUS, *COULOMB])
    plant = experiment(rubbing(), friction="urdf").closed_loop().plant
    np.testing.assert_array_equal(plant.viscous, [VISCOUS] * 2)
    np.testing.assert_array_equal(plant.coulomb, [COULOMB] * 2)


@pytest.mark.parametrize(
    ("word", "base"), [(None, FullParameters), ("full", FullParameters), ("base", BaseParameters)]
)
def test_the_bodies_are_adapted_as_the_other_word_says(word, base):
    member = Member(rubbing(), Hold([0.1, 0.2]), friction="urdf", parameters=word)
    assert type(member.parameters.base) is base
    assert not member.parameters.armature


def test_rotors_are_part_of_it():
    member = Member(rubbing(armature=0.02), Hold([0.1, 0.2]), friction="urdf")
    np.testing.assert_array_equal(member.theta[-2:], [0.02, 0.02])


def test_parameters_that_are_given_stay_as_they_are():
    robot = rubbing()
    own = FullParameters(robot)
    member = Member(robot, Hold([0.1, 0.2]), friction="urdf", parameters=own)
    assert member.parameters is own
    assert member.friction.equals(robot.urdf_friction)


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
def test_a_controller_that_knows_the_friction_of_the_file_follows_exactly(engine):
    """Y theta is then the whole torque, and without friction in it there are errors."""
    robot = rubbing(armature=0.01)
    theta = Member(robot, Hold([0.1, 0.2]), friction="urdf").theta
    known = experiment(robot, friction="urdf", theta_hat0=theta).simulate(engine=engine)
    assert np.abs(known.tracking_error).max() < 1e-6
    rest = {"parameters": FullParameters(robot), "theta_hat0": robot.inertial_parameters}
    unknown = experiment(robot, friction="urdf", **rest).simulate(engine=engine)
    assert np.abs(unknown.tracking_error).max() > 1e-3


def test_both_engines_agree_on_a_robot_with_the_friction_of_its_file():
    robot = load_robot("panda")
    start = np.array([0, -0.8, 0, -2.3, 0, 1.6, 0.8])
    member = Member(robot, Cubic(start, start + 0.2, 0.2), friction="urdf")
    pair = Cell([replace(member, theta_hat0=0.8 * member.theta, name=name) for name in "ab"], Coupling.pair())
    runs = [
        Experiment(pair, Gains.suggest(pair, 5.0), 0.1).simulate(engine=engine)
        for engine in ("pinocchio", "compiled")
    ]
    np.testing.assert_allclose(runs[0].q, runs[1].q, rtol=0, atol=1e-9)
    assert runs[0].info["friction"] == ["given"] * 2  # replaced members have what they were given


def test_who_asked_for_friction_survives_copies_and_files(tmp_path):
    made = cell(rubbing(), friction="urdf")
    again = pickle.loads(pickle.dumps(made))
    assert [member.friction_from for member in again.members] == ["urdf"] * 2
    result = experiment(rubbing(), friction="urdf").simulate(0.02)
    assert Result.load(result.save(tmp_path / "run.npz")).info["friction"] == ["urdf"] * 2


@pytest.mark.parametrize("friction", ["udrf", 0.5])
def test_another_word_is_refused(friction):
    with refused(InputError, "robot 1, friction"):
        cell(rubbing(), friction=friction)


def test_estimates_that_leave_out_the_friction_are_told_what_is_adapted():
    robot = rubbing()
    with refused(InputError, "robot 1, theta_hat0", found=(20,)) as caught:
        cell(robot, friction="urdf", theta_hat0=0.5 * robot.inertial_parameters)
    names = FrictionParameters(robot, robot.urdf_friction).names
    assert f"{names[0]} to {names[-1]}" in str(caught.value)
