"""Small files, each with one thing that real files have: it is left out or assumed, and said."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import pinocchio as pin
import pytest
from refusals import refused

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from survey_dynamics import differences, followers_in, loop_difference  # noqa: E402

from synctrl import Robot, load_robot  # noqa: E402
from synctrl.errors import RobotError, RobotWarning  # noqa: E402

FOLDER = ROOT / "tests" / "cases" / "urdf"

#: by file: the kind of the note, and words of it
SAID = {
    "default_tip_is_base": ("assumed", "'tool0'"),
    "effort_zero": ("assumed", "effort 0"),
    "file_url_mesh": ("left out", "link 'link1'"),
    "finger_without_mass": ("locked", "joint 'j_f1'"),
    "inertial_without_inertia": ("assumed", "link 'camera'"),
    "limit_degrees": ("suspicious", "joint 'joint1', limit"),
    "limit_no_range": ("assumed", "joint 'joint1', limit"),
    "mimic_gripper": ("locked", "joint 'j_f2'"),
    "mimic_gripper_effort_zero": ("locked", "joint 'j_f2'"),
    "parent_mesh": ("left out", "link 'link1'"),
    "placeholder_10g": ("suspicious", "link 'link1', inertial"),
    "plate_three_digits": ("suspicious", "link 'link1', inertial"),
    "self_collision_checking": ("left out", "<self_collision_checking>"),
    "slash_names": ("assumed", "'wx200/link1'"),
    "two_materials": ("left out", "another <material>"),
    "wrong_gram": ("suspicious", "a mass in g"),
    "zero_box_visual": ("left out", "link 'base_link', visual"),
    "zero_sphere": ("left out", "link 'link1', collision"),
}
#: there is nothing to say about them
GOOD = (
    *("good", "mesh_in_package"),
    *(f"{folder}/urdf/mesh_in_package" for folder in ("demo_description", "Demo_Description_Repo")),
)
#: by file: what the refusal is about
REFUSED = {
    "gazebo_closed_loop": "gazebo, joint",
    "no_inertia_anywhere": None,
    "xacro_nested": "link 'link1', visual, xacro:grey",
}


def case(name: str) -> Path:
    return FOLDER / f"{name}.urdf"


def quietly(name: str, **options: object) -> Robot:
    """A case, whatever is warned of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return load_robot(case(name), **options)


def test_every_case_is_in_a_table():
    found = FOLDER.rglob("*.urdf")
    assert {file.relative_to(FOLDER).with_suffix("").as_posix() for file in found} == {*GOOD, *SAID, *REFUSED}


@pytest.mark.parametrize("name", SAID)
def test_a_case_loads_with_one_warning_and_the_note_that_it_is_for(name):
    with pytest.warns(RobotWarning) as caught:
        robot = load_robot(case(name))
    assert len(caught) == 1
    kind, words = SAID[name]
    assert any(words in str(note) for note in robot.report.of_kind(kind)), str(robot.report)
    assert robot.joint_names == ("joint1", "joint2")
    assert robot.tip == ("tool0" if name == "default_tip_is_base" else "link2")


@pytest.mark.parametrize("name", SAID)
def test_strictly_a_case_is_refused(name):
    with refused(RobotError, file=str(case(name))):
        load_robot(case(name), strict=True)


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.filterwarnings("error")
def test_a_good_one_loads_without_a_word_from_any_folder(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    robot = load_robot(case(name), strict=True)
    assert not robot.report and robot.visual.ngeoms == ("mesh" in name)


@pytest.mark.parametrize("name", REFUSED)
def test_what_would_be_another_mechanism_is_refused(name):
    with refused(RobotError, REFUSED[name], file=str(case(name))):
        load_robot(case(name))


@pytest.mark.parametrize("name", ["good", *SAID])
def test_the_dynamics_are_those_of_the_file_with_the_held_joints_fixed(name, capfd):
    whole, followers = pin.buildModelFromUrdf(str(case(name))), followers_in(case(name).read_text("utf-8"))
    errors = differences(quietly(name), whole, followers)
    assert set(errors) == {"M", "C", "g", "regressor"}
    assert max(errors.values()) < 1e-11


@pytest.mark.parametrize("name", ["good", *SAID])
def test_both_engines_run_two_of_a_case_alike(name):
    pytest.importorskip("casadi")
    assert loop_difference(quietly(name)) < 1e-9


@pytest.mark.parametrize("name", ["mimic_gripper", "mimic_gripper_effort_zero"])
def test_fingers_are_held_where_the_caller_says_and_followers_with_them(name):
    robot = quietly(name, locked={"j_f1": 0.02})
    y = {joint.name: joint.origin.xyz[1] for joint in robot.document.joints}
    assert (y["j_f1"], y["j_f2"]) == (0.02, 0.02)
    assert [note.where for note in robot.report] == ["joint 'j_f2'"]
