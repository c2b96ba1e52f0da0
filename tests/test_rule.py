"""What a robot description may be: held joints, tips, names, orientations, inertias, suspicions."""

from __future__ import annotations

import pickle
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from urdf_corpus import GOOD, write

from synctrl import Cell, Coupling, Experiment, Gains, Hold, Member, Robot, load_robot
from synctrl.control.adaptation import Natural
from synctrl.errors import FrameNotFound, InputError, RobotError, RobotWarning
from synctrl.robots.mechanism import joint_limits
from synctrl.robots.urdf.document import Inertial, Pose
from synctrl.show import scene_of

INERTIA = '<inertia ixx="{i}" ixy="0" ixz="0" iyy="{i}" iyz="0" izz="{i}"/>'
BODY = f'<inertial><mass value="{{mass}}"/>{INERTIA}</inertial>'
LIMIT = '<limit lower="{lower}" upper="{upper}" effort="50" velocity="3"/>'


def link(name: str, mass: float | None = 1.0, i: float = 0.01) -> str:
    """A link, without an inertial where there is no mass."""
    return f'<link name="{name}">{"" if mass is None else BODY.format(mass=mass, i=i)}</link>'


def joint(name: str, parent: str, child: str, inner: str = "", **words: object) -> str:
    """A joint half a metre along x, about or along y: revolute, from -2 to 2 rad unless said otherwise."""
    kind, lower, upper = words.get("type", "revolute"), words.get("lower", -2), words.get("upper", 2)
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>{LIMIT.format(lower=lower, upper=upper)}{inner}</joint>'
    )


def robot_text(*parts: str, name: str = "r") -> str:
    """A description with a base and these parts."""
    return f'<robot name="{name}"><link name="base"/>{"".join(parts)}</robot>'


def chain(names: str, parent: str = "base", **words: object) -> str:
    """Joints `j<name>` and links `<name>`, one behind the other."""
    ends = [parent, *names.split()]
    pairs = pairwise(ends)
    return "".join(link(child) + joint(f"j{child}", before, child, **words) for before, child in pairs)


ARM = chain("a b c")
HAND = (
    ARM
    + link("f1", 0.1)
    + link("f2", 0.1)
    + joint("jf1", "c", "f1", type="prismatic", lower=0, upper=0.04)
    + joint(
        "jf2", "c", "f2", '<mimic joint="jf1" multiplier="-1" offset="0.01"/>', type="prismatic", lower=-1
    )
)
DUAL = chain("l1 l2 left_hand") + chain("r1 r2 right_hand", lower=0.5)


def loaded(folder: Path, text: str, **options: object) -> Robot:
    """A robot, whatever is warned of."""
    (folder / "robot.urdf").write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return load_robot(folder / "robot.urdf", **options)


def held(robot: Robot) -> set[str]:
    """The joints that are held unasked, by the report."""
    return {note.where.split("'")[1] for note in robot.report.of_kind("locked")}


def same_as_pinocchio(robot: Robot, file: Path, **positions: float) -> None:
    """M, C, g and the regressor are those of the file, read by Pinocchio alone, with joints held."""
    whole = pin.buildModelFromUrdf(str(file))
    at = pin.neutral(whole)
    for name, position in positions.items():
        at[whole.joints[whole.getJointId(name)].idx_q] = position
    model = pin.buildReducedModel(whole, [whole.getJointId(name) for name in positions], at)
    assert list(model.names)[1:] == list(robot.joint_names)
    data = model.createData()
    for q, v, a in np.random.default_rng(3).uniform(-2, 2, (3, 3, robot.nv)):
        there = pin.integrate(model, pin.neutral(model), q)
        C = pin.computeCoriolisMatrix(model, data, there, v)
        np.testing.assert_allclose(robot.coriolis_matrix(q, v), C, rtol=1e-10, atol=1e-10)
        torque = pin.rnea(model, data, there, v, a)
        np.testing.assert_allclose(robot.inverse_dynamics(q, v, a), torque, rtol=1e-10, atol=1e-10)
        Y = robot.regressor(q, v, v, a)
        np.testing.assert_allclose(Y @ robot.inertial_parameters, torque, rtol=1e-10, atol=1e-10)


def test_a_moment_that_is_negative_by_rounding_is_said(tmp_path):
    text = robot_text(ARM).replace('ixx="0.01"', 'ixx="-1e-35"', 1)
    assert [note.kind for note in loaded(tmp_path, text).report] == ["suspicious"]


# -- held joints -------------------------------------------------------------------------------------------


def test_followers_and_the_finger_they_follow_are_held_where_the_mimic_says(tmp_path):
    robot = loaded(tmp_path, robot_text(HAND))
    assert robot.joint_names == ("ja", "jb", "jc") and held(robot) == {"jf1", "jf2"}
    assert robot.tip == "c"
    same_as_pinocchio(robot, tmp_path / "robot.urdf", jf1=0.0, jf2=0.01)


def test_followers_go_where_the_caller_holds_what_they_follow(tmp_path):
    robot = loaded(tmp_path, robot_text(HAND), locked={"jf1": 0.03})
    assert held(robot) == {"jf2"}
    same_as_pinocchio(robot, tmp_path / "robot.urdf", jf1=0.03, jf2=-0.02)


def test_a_follower_within_the_arm_is_held_and_its_leader_moves(tmp_path):
    text = robot_text(
        chain("a b") + link("c") + joint("jc", "b", "c", '<mimic joint="ja"/>') + chain("d", "c")
    )
    robot = loaded(tmp_path, text)
    assert robot.joint_names == ("ja", "jb", "jd") and held(robot) == {"jc"}


def test_what_follows_itself_in_a_circle_or_nobody_is_held(tmp_path):
    one = link("c") + joint("jc", "b", "c", '<mimic joint="jd"/>')
    other = link("d") + joint("jd", "c", "d", '<mimic joint="jc"/>')
    assert held(loaded(tmp_path, robot_text(chain("a b") + one + other))) == {"jc", "jd"}
    lost = link("c") + joint("jc", "b", "c", '<mimic joint="nobody" offset="0.3"/>')
    robot = loaded(tmp_path, robot_text(chain("a b") + lost))
    assert "0.3 rad" in str(robot.report) and held(robot) == {"jc"}


def test_limits_and_masses_of_held_joints_are_not_asked_for(tmp_path):
    """A range upside down and a missing mass cost nothing where they play no part."""
    wrong = joint("jd", "c", "d", lower=1, upper=-1)
    text = robot_text(ARM + link("d", None) + wrong)
    with refused(RobotError, "joint 'jd'"):
        loaded(tmp_path, text)
    robot = loaded(tmp_path, text, locked={"jd": 0.5})
    assert robot.joint_names == ("ja", "jb", "jc") and not robot.report


@pytest.mark.parametrize("name", ["left_finger", "gripper", "jaw_1"])
def test_fingers_without_mass_are_held_and_named(name, tmp_path):
    robot = loaded(tmp_path, robot_text(ARM + link("x", None) + joint(name, "c", "x")))
    assert held(robot) == {name} and robot.tip == "c"


def test_two_last_joints_on_a_hand_without_mass_are_fingers_whatever_they_are_called(tmp_path):
    last = link("x", None) + joint("jx", "c", "x") + link("y", None) + joint("jy", "c", "y")
    assert held(loaded(tmp_path, robot_text(ARM + last))) == {"jx", "jy"}


def test_a_base_that_is_none_is_held_and_named(tmp_path):
    """As planners have it: two slides and a turn without mass or shape, before the first body."""
    virtual = (
        link("x", None) + joint("jx", "base", "x", type="prismatic")
        + link("y", None) + joint("jy", "x", "y", type="prismatic")
        + link("turn", None) + joint("jturn", "y", "turn")
    )  # fmt: skip
    robot = loaded(tmp_path, robot_text(virtual, chain("a b", parent="turn")))
    assert held(robot) == {"jx", "jy", "jturn"}
    same_as_pinocchio(robot, tmp_path / "robot.urdf", jx=0.0, jy=0.0, jturn=0.0)


def test_a_base_that_turns_without_mass_and_then_drives_is_held_and_named(tmp_path):
    text = robot_text(
        link("turned", None), joint("jturn", "base", "turned"),
        chain("driven", parent="turned", type="prismatic", lower=0.3), chain("a b", parent="driven"),
    )  # fmt: skip
    robot = loaded(tmp_path, text)
    assert held(robot) == {"jturn", "jdriven"}
    for q in np.random.default_rng(5).uniform(-2, 2, (5, robot.nv)):
        assert np.linalg.eigvalsh(robot.mass_matrix(q))[0] > 0
    same_as_pinocchio(robot, tmp_path / "robot.urdf", jturn=0.0, jdriven=0.3)


SEEN = '<visual><geometry><sphere radius="0.1"/></geometry></visual></link>'


@pytest.mark.parametrize(
    "turned, behind",
    [
        (link("turned", None), chain("x a b", parent="turned")),
        (link("turned", None), chain("x", parent="turned", type="prismatic")),
        (
            link("turned", None).replace("</link>", SEEN),
            chain("x", parent="turned", type="prismatic") + chain("a", "x"),
        ),
    ],
    ids=["a turn behind it", "a slide with nothing on it", "a link that is seen"],
)
def test_what_turns_without_mass_is_else_no_such_base(turned, behind, tmp_path):
    with refused(RobotError, "joint 'jturn'"):
        loaded(tmp_path, robot_text(turned, joint("jturn", "base", "turned"), behind))


def test_a_turning_first_link_without_mass_is_no_such_base(tmp_path):
    text = robot_text(link("a", None), joint("ja", "base", "a"), chain("b c", parent="a"))
    with refused(RobotError, "joint 'ja'"):
        loaded(tmp_path, text)


def test_fingers_of_a_last_link_that_weighs_nothing_without_them_are_held(tmp_path):
    wrist = link("wrist", None) + joint("jwrist", "b", "wrist")
    fingers = "".join(
        link(name, 0.1) + joint(f"j{name}", "wrist", name, type="prismatic", lower=0, upper=0.04)
        for name in ("finger_1", "finger_2")
    )
    robot = loaded(tmp_path, robot_text(chain("a b"), wrist, fingers))
    assert held(robot) == {"jfinger_1", "jfinger_2"}
    same_as_pinocchio(robot, tmp_path / "robot.urdf", jfinger_1=0.0, jfinger_2=0.0)


@pytest.mark.parametrize("mass", [None, 0.0])
def test_a_link_of_the_arm_without_mass_is_refused_with_both_ways_on(mass, tmp_path):
    for text in (ARM + link("d", mass) + joint("jd", "c", "d"), link("z", mass) + joint("jz", "base", "z")):
        with refused(RobotError) as caught:
            loaded(tmp_path, robot_text(text if "jd" in text else text + chain("a", "z")))
        assert "inertials=" in str(caught.value) and "locked=" in str(caught.value)


def test_of_some_joints_a_range_of_no_length_means_held(tmp_path):
    text = robot_text(chain("a b") + link("c") + joint("jc", "b", "c", lower=0.4, upper=0.4))
    robot = loaded(tmp_path, text)
    assert held(robot) == {"jc"}
    same_as_pinocchio(robot, tmp_path / "robot.urdf", jc=0.4)


def test_of_all_joints_a_range_of_0_to_0_means_that_there_is_none(tmp_path):
    robot = loaded(tmp_path, robot_text(chain("a b c", lower=0, upper=0)))
    assert robot.joint_names == ("ja", "jb", "jc") and not held(robot)
    assert len(robot.report.of_kind("assumed")) == 3
    assert np.isinf(joint_limits(robot).lower).all() and np.isinf(joint_limits(robot).upper).all()


def test_a_robot_of_which_everything_is_held_is_none(tmp_path):
    with refused(RobotError, None, found=0):
        loaded(tmp_path, robot_text(ARM), locked=dict.fromkeys(("ja", "jb", "jc"), 0.0))


# -- tips and branches -------------------------------------------------------------------------------------


def test_two_arms_of_one_file_work_in_one_cell(tmp_path):
    left, right = (loaded(tmp_path, robot_text(DUAL), tip=f"{side}_hand") for side in ("left", "right"))
    assert left.joint_names == ("jl1", "jl2", "jleft_hand") and left.tip == "left_hand"
    assert right.joint_names == ("jr1", "jr2", "jright_hand")
    same_as_pinocchio(left, tmp_path / "robot.urdf", jr1=0.5, jr2=0.5, jright_hand=0.5)
    same_as_pinocchio(right, tmp_path / "robot.urdf", jl1=0.0, jl2=0.0, jleft_hand=0.0)
    members = [Member(robot, Hold(np.full(3, 0.6))) for robot in (left, right)]
    run = Experiment(Cell(members, Coupling.pair()), Gains(5.0, 1.0, 5.0, 1.0, 0.1), 0.05)
    ends = [run.simulate(engine=engine).q[-1] for engine in ("pinocchio", "compiled")]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)


def test_the_arm_that_is_held_is_held_where_the_caller_says(tmp_path):
    robot = loaded(tmp_path, robot_text(DUAL), tip="left_hand", locked={"jr1": 1.5})
    same_as_pinocchio(robot, tmp_path / "robot.urdf", jr1=1.5, jr2=0.5, jright_hand=0.5)


def test_without_a_tip_all_arms_move_and_that_is_said(tmp_path):
    robot = loaded(tmp_path, robot_text(DUAL))
    assert robot.nv == 6 and robot.tip == "left_hand"
    assert "'jr1'" in str(robot.report.of_kind("suspicious")[0])


def test_the_longest_branch_bears_the_tip(tmp_path):
    assert loaded(tmp_path, robot_text(chain("head") + ARM)).tip == "c"


def test_fingers_of_a_hand_that_was_asked_for_are_held(tmp_path):
    fingers = link("x") + joint("jx", "c", "x") + link("y") + joint("jy", "c", "y")
    for tip in ("c", "a"):
        robot = loaded(tmp_path, robot_text(ARM + fingers), tip=tip)
        assert held(robot) == {"jx", "jy"} and robot.joint_names == ("ja", "jb", "jc")


def test_of_a_torso_that_carries_two_arms_as_the_tip_the_arms_are_held(tmp_path):
    arms = chain("l1 l2 l3", "torso") + chain("r1 r2 r3", "torso")
    robot = loaded(tmp_path, robot_text(chain("torso") + arms), tip="torso")
    assert robot.joint_names == ("jtorso",)


def test_an_arm_is_not_cut_behind_its_tip(tmp_path):
    robot = loaded(tmp_path, robot_text(ARM), tip="a")
    assert robot.nv == 3 and not robot.report


@pytest.mark.parametrize(
    ("tip", "words"),
    [("base", "no joint moves it"), ("universe", "no joint moves it"), ("f1", "on a finger")],
)
def test_a_tip_on_the_base_or_on_a_finger_is_suspicious(tip, words, tmp_path):
    robot = loaded(tmp_path, robot_text(HAND), tip=tip)
    assert any(words in note.text for note in robot.report.of_kind("suspicious"))


def fixed(parent: str, child: str) -> str:
    return (
        f'<link name="{child}"/><joint name="to_{child}" type="fixed"><parent link="{parent}"/>'
        f'<child link="{child}"/></joint>'
    )


def test_the_tip_is_a_tool_rather_than_a_camera_or_a_frame_of_the_base(tmp_path):
    ends = (
        fixed("c", "flange") + fixed("flange", "tool0") + fixed("c", "camera_link") + fixed("base", "world2")
    )
    robot = loaded(tmp_path, robot_text(ARM + ends))
    assert robot.tip == "tool0" and "'world2'" in str(robot.report)


def test_a_tip_that_there_is_not_lists_the_frames(tmp_path):
    with refused(FrameNotFound, frame="d"):
        loaded(tmp_path, robot_text(ARM), tip="d")


# -- names -------------------------------------------------------------------------------------------------

NAMES = [
    *("wx200/arm", "two words", "Gelenk_ä", "../../up", "universe", "<b>bold</b>", 'say "x"', "$\\frac$"),
    *("a&b", "%s{0}", "x" * 400, "名前", "joint (2)"),
]


def escaped(name: str) -> str:
    for char, entity in (("&", "&amp;"), ("<", "&lt;"), ('"', "&quot;")):
        name = name.replace(char, entity)
    return name


@pytest.mark.parametrize("name", NAMES)
def test_any_name_is_taken_and_kept(name, tmp_path):
    text = GOOD.replace('"elbow"', f'"{escaped(name)}"').replace('"tool"', f'"{escaped(name)}"')
    robot = loaded(write(tmp_path, text).parent, text.replace('name="good"', f'name="{escaped(name)}"'))
    assert robot.joint_names == ("shoulder", name, "rail")
    assert robot.name == name and robot.tip.startswith(name) and robot.report
    assert str(robot.report).replace("\n", "").isprintable()
    same = load_good(tmp_path)
    for q, v, a in np.random.default_rng(1).uniform(-1, 1, (3, 3, 3)):
        np.testing.assert_array_equal(robot.inverse_dynamics(q, v, a), same.inverse_dynamics(q, v, a))
        np.testing.assert_array_equal(robot.tip_position(q), same.tip_position(q))
    assert pickle.loads(pickle.dumps(robot)).joint_names == robot.joint_names


def load_good(folder: Path) -> Robot:
    (folder / "good").mkdir(exist_ok=True)
    return load_robot(write(folder / "good", GOOD))


def test_a_name_with_line_breaks_is_one_line(tmp_path):
    robot = loaded(tmp_path, robot_text(ARM.replace('"jb"', '"j&#10;b&#9;"')))
    assert robot.joint_names == ("ja", "j\\nb\\t", "jc")


def test_a_robot_without_a_name_is_called_as_its_file(tmp_path):
    assert loaded(tmp_path, robot_text(ARM).replace(' name="r"', "")).name == "robot"


@pytest.mark.parametrize("name", ["universe", "a"])
def test_a_joint_may_be_named_as_a_link_or_the_world(name, tmp_path):
    robot = loaded(tmp_path, robot_text(ARM.replace('"jb"', f'"{name}"')))
    same = loaded(tmp_path, robot_text(ARM))
    assert robot.joint_names == ("ja", name, "jc")
    for q in np.random.default_rng(1).uniform(-1, 1, (3, 3)):
        np.testing.assert_array_equal(robot.mass_matrix(q), same.mass_matrix(q))
        for frame, other in zip(robot.joint_frames, same.joint_frames, strict=True):
            place, there = robot.with_tip(frame).tip_position(q), same.with_tip(other).tip_position(q)
            np.testing.assert_array_equal(place, there)


# -- orientations ------------------------------------------------------------------------------------------

parts = st.floats(-1, 1)


@given(quaternion=st.tuples(parts, parts, parts, parts).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_a_quaternion_places_a_link_as_pinocchio_reads_it(quaternion, tmp_path_factory):
    x, y, z, w = np.array(quaternion) / np.linalg.norm(quaternion)
    placed = f'<origin xyz="0.5 0 0" quat_xyzw="{x!r} {y!r} {z!r} {w!r}"/>'.replace(
        "np.float64(", ""
    ).replace(")", "")
    text = robot_text(ARM.replace('<origin xyz="0.5 0 0"/>', placed)).replace(
        "<robot", '<robot version="1.1"'
    )
    robot = loaded(tmp_path_factory.mktemp("turned"), text)
    assert not robot.report
    R = pin.Quaternion(w, x, y, z).matrix()
    for k in range(1, 4):
        np.testing.assert_allclose(robot.model.jointPlacements[k].rotation, R, atol=1e-12)


@pytest.mark.parametrize(
    "words",
    ['quat_xyzw="0 0 0 0"', 'quat_xyzw="0 0 1"', 'quat_xyzw="0 0 0 1" rpy="0 0 0"', 'quat_xyzw="0 0 nan 1"'],
)
def test_what_is_no_orientation_is_refused(words, tmp_path):
    with refused(RobotError, "joint 'ja', origin"):
        loaded(tmp_path, robot_text(ARM.replace('xyz="0.5 0 0"', words, 1)))


@pytest.mark.parametrize("x", ["1e16", "-2e6"])
def test_places_so_far_away_that_digits_are_lost_are_refused(x, tmp_path):
    with refused(RobotError, "joint 'ja', origin"):
        loaded(tmp_path, robot_text(ARM.replace('xyz="0.5 0 0"', f'xyz="{x} 0 0"', 1)))


def test_turns_of_which_digits_are_lost_are_refused(tmp_path):
    with refused(RobotError, "joint 'ja', origin"):
        loaded(tmp_path, robot_text(ARM.replace('xyz="0.5 0 0"', 'rpy="0 1e16 0"', 1)))


@pytest.mark.parametrize("offset", ["1e12", "-1e12"])
def test_a_joint_that_would_be_held_so_far_away_is_refused(offset, tmp_path):
    follower = joint("jd", "c", "d", f'<mimic joint="ja" offset="{offset}"/>', type="prismatic")
    with refused(RobotError, "joint 'jd'"):
        loaded(tmp_path, robot_text(ARM, link("d"), follower))
    free = robot_text(ARM.replace('lower="-2" upper="2"', "").replace("revolute", "prismatic"))
    with refused(RobotError, "joint 'jc'"):
        loaded(tmp_path, free, locked={"jc": float(offset)})


# -- the mechanism -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "part",
    [
        '<loop_joint name="x" type="revolute"/>',
        '<drake:joint name="x" type="ball"/>',
        "<gazebo><model><joint><parent>c</parent><child>base</child></joint></model></gazebo>",
        "<gazebo><joint><parent>world</parent><child>c</child></joint></gazebo>",
        "<mujoco><equality><connect/></equality></mujoco>",
        '<joint name="k" type="floating"><parent link="c"/><child link="d"/></joint><link name="d"/>',
        '<joint name="k" type="planar"><parent link="c"/><child link="d"/></joint><link name="d"/>',
        '<xacro:macro name="m"/>',
        "<gazebo><xacro:sensor/></gazebo>",
        '<link name="${prefix}d"/>',
        '<joint name="$(arg p)k" type="fixed"><parent link="c"/><child link="d"/></joint><link name="d"/>',
        '<link name="d"/><joint name="k" type="fixed"><parent link="c"/><child link="d"/>'
        '<orgin xyz="1 0 0"/></joint>',
    ],
)
def test_what_would_make_it_another_mechanism_is_refused(part, tmp_path):
    with refused(RobotError):
        loaded(tmp_path, robot_text(ARM + part))


@pytest.mark.parametrize(
    "part",
    [
        "<gazebo><joint><parent>world</parent><child>base</child></joint></gazebo>",
        '<gazebo reference="ja"><implicitSpringDamper>1</implicitSpringDamper></gazebo>',
        "<gazebo><plugin><joint>ja</joint></plugin></gazebo>",
        '<mujoco><compiler meshdir="x"/></mujoco>',
        '<transmission name="t"><joint name="ja"/><actuator name="m"/></transmission>',
    ],
)
def test_what_says_nothing_of_the_mechanism_needs_no_word(part, tmp_path):
    assert not loaded(tmp_path, robot_text(ARM + part)).report


@pytest.mark.parametrize(
    "part",
    [
        "<links/>",
        "<traits/>",
        '<drake:collision_filter_group name="g"/>',
        "<joint_properties/>",
        "<linkage/>",
    ],
)
def test_other_elements_are_left_out_and_said(part, tmp_path):
    assert [note.kind for note in loaded(tmp_path, robot_text(ARM + part)).report] == ["left out"]


@pytest.mark.parametrize("value", ["0", "-1", "inf", "1e300", None])
def test_an_effort_or_speed_that_bounds_nothing_is_no_limit(value, tmp_path):
    word = "" if value is None else f'effort="{value}"'
    robot = loaded(tmp_path, robot_text(ARM.replace('effort="50"', word)))
    assert np.isinf(joint_limits(robot).torque).all()
    assert len(robot.report.of_kind("assumed")) == 3
    speed = ARM.replace('velocity="3"', word.replace("effort", "velocity"))
    assert np.isinf(joint_limits(loaded(tmp_path, robot_text(speed))).velocity).all()


def test_a_prismatic_joint_without_a_range_slides_without_end_in_every_engine(tmp_path):
    pytest.importorskip("mujoco")
    robot = loaded(tmp_path, robot_text(ARM).replace('lower="-2" upper="2"', ""))
    assert np.isinf(joint_limits(robot).lower).all()
    members = [Member(robot, Hold(np.full(3, 0.2)))] * 2
    run = Experiment(Cell(members, Coupling.pair()), Gains(5.0, 1.0, 5.0, 1.0, 0.1), 0.05)
    ends = [run.simulate(plant=plant).q[-1] for plant in ("pinocchio", "mujoco")]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)


# -- inertias ----------------------------------------------------------------------------------------------


def test_moments_of_next_to_nothing_are_none_whatever_their_sign(tmp_path):
    robot = loaded(tmp_path, robot_text(ARM.replace('ixx="0.01"', 'ixx="-1e-35"')))
    assert robot.nv == 3
    again = robot.with_parameters(robot.inertial_parameters)
    np.testing.assert_allclose(again.mass_matrix(np.ones(3)), robot.mass_matrix(np.ones(3)), rtol=1e-12)


@pytest.mark.parametrize(
    ("inertial", "said"),
    [
        (f'<mass value="0"/>{INERTIA.format(i=0.02)}', "assumed"),
        ('<mass value="0.5"/>', "assumed"),
        (f'<mass value="0"/>{INERTIA.format(i=0)}', None),
        (INERTIA.format(i=0.02), "left out"),
        ("", "left out"),
    ],
)
def test_an_inertial_that_lacks_something_costs_nothing_on_a_fixed_link(inertial, said, tmp_path):
    part = f'<link name="d"><inertial>{inertial}</inertial></link>'
    mount = '<joint name="jd" type="fixed"><parent link="c"/><child link="d"/><origin xyz="0 0.1 0"/></joint>'
    robot = loaded(tmp_path, robot_text(ARM + part + mount))
    assert [note.kind for note in robot.report] == ([said] if said else [])
    if said != "left out":
        same_as_pinocchio(robot, tmp_path / "robot.urdf")


def test_physically_consistent_adaptation_says_that_it_cannot_use_what_no_body_has(tmp_path):
    robot = loaded(tmp_path, robot_text(ARM.replace('ixx="0.01"', 'ixx="0.03"', 1)))
    assert "physically consistent" in str(robot.report)
    member = Member(robot, Hold(np.zeros(3)), theta_hat0=robot.inertial_parameters)
    gains = Gains(5.0, 1.0, 5.0, 1.0)
    with refused(InputError, "theta_hat0 of robot 1") as caught:
        Experiment(Cell([member] * 2, Coupling.pair()), gains, 0.01, adaptation=Natural(0.1)).simulate()
    assert caught.value.found < 0  # the smallest eigenvalue


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('mass value="1.0"', 'mass value="3000"', "a mass in g"),
        ('mass value="1.0"', 'mass value="0.001"', "radius of gyration"),
        ('<inertial><mass', '<inertial><origin xyz="200 0 0"/><mass', "centre of mass"),
        ('mass value="1.0"', 'mass value="0.01"', "10 g"),
        ('lower="-2" upper="2"', 'lower="-180" upper="180"', "in degrees"),
        ('izz="0.01"', 'izz="0.03"', "sum of the others"),
    ],
)  # fmt: skip
def test_what_is_suspicious_is_said_and_taken(old, new, words, tmp_path):
    robot = loaded(tmp_path, robot_text(ARM.replace(old, new)))
    assert any(words in note.text for note in robot.report.of_kind("suspicious")), str(robot.report)
    same_as_pinocchio(robot, tmp_path / "robot.urdf")


def test_a_file_without_any_mass_says_so_before_what_else_is_wrong_with_it(tmp_path):
    lost = joint("jx", "nowhere", "a") + link("b", None)
    for wrong in (chain("a b c", lower=5), ARM + lost):
        with refused(RobotError, None, file=str(tmp_path / "robot.urdf")) as caught:
            loaded(tmp_path, robot_text(wrong.replace(BODY.format(mass=1.0, i=0.01), "")))
        assert "inertials={...}" in str(caught.value)


def test_inertials_of_the_caller_take_the_place_of_missing_ones(tmp_path):
    text = robot_text(ARM)
    bare = robot_text(ARM.replace(BODY.format(mass=1.0, i=0.01), ""))
    with refused(RobotError, None, file=str(tmp_path / "robot.urdf")):
        loaded(tmp_path, bare)
    kinds = {"a": (0.01, 0.01, 0.01), "b": np.eye(3) / 100, "c": (0.01, 0, 0, 0.01, 0, 0.01)}
    given = {name: {"mass": 1.0, "inertia": inertia} for name, inertia in kinds.items()}
    mine, theirs = loaded(tmp_path, bare, inertials=given), loaded(tmp_path, text)
    np.testing.assert_allclose(mine.inertial_parameters, theirs.inertial_parameters, rtol=1e-15)
    moved = {"c": Inertial(2.0, (0.1, 0.0, 0.0, 0.1, 0.0, 0.1), Pose((0.0, 0.3, 0.0)))}
    other = {"c": {"mass": 2.0, "com": (0, 0.3, 0), "inertia": np.eye(3) / 10}}
    one, two = (loaded(tmp_path, text, inertials=value).inertial_parameters for value in (moved, other))
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize(
    ("inertials", "subject"),
    [
        ({"d": {"mass": 1.0, "inertia": (1, 1, 1)}}, "inertials"),
        ({"c": {"mas": 1.0, "inertia": (1, 1, 1)}}, "inertials['c']"),
        ({"c": {"mass": 1.0}}, "inertials['c']"),
        ({"c": {"mass": -1.0, "inertia": (1, 1, 1)}}, "inertials['c']['mass']"),
        ({"c": {"mass": 1.0, "inertia": (1, 1)}}, "inertials['c']['inertia']"),
        ({"c": 3.0}, "inertials['c']"),
        ("c", "inertials"),
    ],
)
def test_what_is_no_inertial_is_refused(inertials, subject, tmp_path):
    with refused(InputError, subject):
        loaded(tmp_path, robot_text(ARM), inertials=inertials)


def test_a_robot_keeps_its_report_whatever_becomes_of_it(tmp_path):
    robot = loaded(tmp_path, robot_text(HAND))
    copies = (
        robot.placed(xyz=(1, 0, 0)),
        robot.with_tip("a"),
        robot.with_armature(0.1),
        robot.with_parameters(1.1 * robot.inertial_parameters),
        pickle.loads(pickle.dumps(robot)),
    )
    assert robot.report and all(copy.report == robot.report for copy in copies)


def test_no_name_becomes_markup_in_a_page_or_a_figure(tmp_path):
    name = "</script><img src=x onerror=alert(1)> $\\frac$"
    text = GOOD.replace('"elbow"', f'"{escaped(name)}"').replace('"good"', f'"{escaped(name)}"')
    robot = loaded(write(tmp_path, text).parent, text)
    members = [Member(robot, Hold(np.full(3, 0.1)))] * 2
    run = Experiment(Cell(members, Coupling.pair()), Gains(5.0, 1.0, 5.0, 1.0, 0.1), 0.01)
    result = run.simulate()
    assert result.info["robots"][0]["joints"][1] == name
    page = tmp_path / "scene.html"
    scene_of(result, run).write(page)
    assert "<img src=x" not in page.read_text(encoding="utf-8")
    for figure in result.plot().values():
        figure.canvas.draw()
