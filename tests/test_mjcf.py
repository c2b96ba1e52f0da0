"""MJCF loads as MuJoCo computes it, opens no file but its own, and is refused where it is no arm."""

from __future__ import annotations

import math
import os
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from synctrl import Robot, load_robot
from synctrl.errors import MissingDependencyError, RobotError, RobotWarning
from synctrl.robots.mechanism import joint_limits

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is an extra: pip install 'synctrl[mujoco]'")

ROUNDING = 1e-10
INERTIAL = '<inertial mass="2" pos=".1 .02 .03" quat=".9 .1 .2 .3" diaginertia=".03 .02 .015"/>'
SMALL = '<inertial mass=".5" pos=".05 0 .01" diaginertia=".002 .003 .004"/>'
ARM = f"""
<mujoco model="arm">
  <compiler angle="degree"/>
  <default><joint damping=".1"/><default class="seen"><geom group="2"/></default></default>
  <worldbody>
    <geom type="plane" size="1 1 .1"/>
    <body name="base" pos="0 0 .1" euler="10 20 30">
      <inertial mass="1" pos="0 0 0" diaginertia=".1 .1 .1"/>
      <body name="upper" pos="0 0 .2">
        <joint name="turn" axis="0 0 2" pos=".01 .02 .03" range="-90 45" armature=".1" frictionloss=".2"/>
        {INERTIAL}
        <geom class="seen" type="box" size=".1 .05 .02" rgba="1 0 0 1"/>
        <body name="lower" pos=".3 0 0" euler="0 30 0">
          <joint name="push" type="slide" axis="1 1 0" range="-.1 .3" ref=".05"/>
          <geom type="capsule" size=".03" fromto="0 0 0 .2 0 0"/>
          <body name="hand" pos=".2 0 0">
            <joint name="spin" axis="0 1 0" ref="20" armature=".02"/>
            {SMALL}
            <site name="tool" pos="0 0 .1" euler="90 0 0"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="turn" gear="5" ctrlrange="-2 2"/>
    <position joint="push" kp="10" forcerange="-7 7"/>
  </actuator>
</mujoco>
"""


def write(folder: Path, text: str, name: str = "arm.xml") -> Path:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def quietly(file: Path, **options: object) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return load_robot(file, **options)


def mujoco_torque(model: object, robot: Robot, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Inverse dynamics by MuJoCo without its passive forces, in the robot's order of joints."""
    data, acceleration, torque = mujoco.MjData(model), np.zeros(model.nv), np.zeros(model.nv)
    joints = [model.joint(name) for name in robot.joint_names]
    dofs = [int(joint.dofadr[0]) for joint in joints]
    data.qpos[[int(joint.qposadr[0]) for joint in joints]] = q
    data.qvel[dofs], acceleration[dofs] = v, a
    mujoco.mj_forward(model, data)
    mujoco.mj_mulM(model, data, torque, acceleration)
    return (torque + data.qfrc_bias)[dofs]


# -- what it says ------------------------------------------------------------------------------------------


def test_dynamics_are_those_of_mujoco_in_random_states(tmp_path: Path) -> None:
    file = write(tmp_path, ARM)
    robot, model = quietly(file), mujoco.MjModel.from_xml_path(str(file))
    assert sorted(robot.joint_names) == ["push", "spin", "turn"]
    for q, v, a in np.random.default_rng(0).uniform(-2, 2, (20, 3, robot.nv)):
        expected = mujoco_torque(model, robot, q, v, a)
        assert abs(robot.inverse_dynamics(q, v, a) - expected).max() < ROUNDING


def test_joints_without_a_name_get_one_and_move_as_they_do_in_mujoco(tmp_path: Path) -> None:
    text = ARM.replace('<position joint="push"', '<position joint="turn"')
    text = text.replace('name="spin" ', "").replace('name="push" ', "")
    robot, named = quietly(write(tmp_path, text)), quietly(write(tmp_path, ARM, "named.xml"))
    assert robot.joint_names == ("turn", "joint1", "joint2")
    for q, v, a in np.random.default_rng(1).uniform(-2, 2, (5, 3, robot.nv)):
        assert abs(robot.inverse_dynamics(q, v, a) - named.inverse_dynamics(q, v, a)).max() < ROUNDING


def test_a_body_and_a_site_that_are_named_as_the_world_are_told_from_it(tmp_path: Path) -> None:
    text = ARM.replace('<body name="hand"', '<body name="universe"').replace("tool", "universe")
    robot = quietly(write(tmp_path, text), tip="universe (link)")
    frames = {frame.name for frame in robot.model.frames}
    assert robot.nv == 3 and {"universe (link)", "universe (link)_2"} <= frames


def test_a_site_is_a_frame_where_mujoco_has_it(tmp_path: Path) -> None:
    file = write(tmp_path, ARM)
    robot, model = quietly(file, tip="tool"), mujoco.MjModel.from_xml_path(str(file))
    data, q = mujoco.MjData(model), np.array([0.3, -0.2, 0.7])
    for name, position in zip(robot.joint_names, q, strict=True):
        data.joint(name).qpos[0] = position
    mujoco.mj_forward(model, data)
    pose = robot.tip_pose(q)
    assert abs(pose.translation - data.site("tool").xpos).max() < ROUNDING
    assert abs(pose.rotation - data.site("tool").xmat.reshape(3, 3)).max() < ROUNDING


def test_limits_rotors_and_friction_come_along(tmp_path: Path) -> None:
    robot = quietly(write(tmp_path, ARM))
    of = {joint.name: joint for joint in robot.document.moving_joints}
    assert of["turn"].limit.effort == pytest.approx(10)
    assert (of["turn"].limit.lower, of["turn"].limit.upper) == pytest.approx((-math.pi / 2, math.pi / 4))
    assert (of["turn"].friction, of["turn"].damping) == (0.2, 0.1)
    assert of["push"].limit.effort == 7
    assert (of["push"].limit.lower, of["push"].limit.upper) == (-0.1, 0.3)
    assert (of["spin"].type, of["spin"].limit.effort) == ("continuous", math.inf)
    rotors = dict(zip(robot.joint_names, robot.armature, strict=True))
    assert rotors == {"turn": 0.1, "push": 0.0, "spin": 0.02}


def test_what_actuators_may_do_to_a_joint_counts_where_it_is_less_than_they_can(tmp_path: Path) -> None:
    for most, limit in ((4, 4), (40, 10)):  # the motor can do 2 times 5
        text = ARM.replace('name="turn"', f'name="turn" actuatorfrcrange="-{most} {most}"')
        assert joint_limits(quietly(write(tmp_path, text))).torque[0] == limit


def test_shapes_of_hidden_groups_are_not_seen(tmp_path: Path) -> None:
    seen = [quietly(write(tmp_path, ARM.replace('group="2"', f'group="{k}"'))).visual.ngeoms for k in (2, 3)]
    assert seen[1] == seen[0] - 1


def test_shapes_are_seen_in_their_size_place_and_colour(tmp_path: Path) -> None:
    robot = quietly(write(tmp_path, ARM))
    box = next(g for link in robot.document.links for g in link.visuals if g.shape.kind == "box")
    assert box.shape.size == pytest.approx((0.2, 0.1, 0.04))
    assert box.color == (1, 0, 0, 1)
    assert robot.visual.ngeoms == 2


def test_an_equality_of_joints_makes_one_follow(tmp_path: Path) -> None:
    text = ARM.replace("<actuator>", '<equality><joint joint1="spin" joint2="turn"/></equality><actuator>')
    with pytest.warns(RobotWarning, match="spin"):
        robot = load_robot(write(tmp_path, text))
    assert sorted(robot.joint_names) == ["push", "turn"]


def test_an_equality_with_a_number_holds_a_joint_there(tmp_path: Path) -> None:
    held = '<equality><joint joint1="spin" polycoef=".4 0 0 0 0"/></equality><actuator>'
    file = write(tmp_path, ARM.replace("<actuator>", held))
    with pytest.warns(RobotWarning, match=r"locked .* holds it at \S+ rad"):
        robot = load_robot(file, tip="tool")
    free = quietly(write(tmp_path, ARM, "free.xml"), tip="tool")
    at = {"turn": 0.3, "push": 0.1, "spin": math.radians(20) + 0.4}
    poses = [arm.tip_pose([at[name] for name in arm.joint_names]) for arm in (robot, free)]
    assert poses[0].isApprox(poses[1], ROUNDING)


@pytest.mark.parametrize(
    ("old", "new", "subject", "found"),
    [
        (
            '<joint name="spin" axis="0 1 0" ref="20"',
            '<joint name="spin" type="ball"',
            "joint 'spin'",
            "a ball joint",
        ),
        ('<joint name="spin"', '<joint axis="1 0 0"/><joint name="spin"', "body 'hand'", "2"),
        (
            "<actuator>",
            '<equality><connect body1="hand" body2="base" anchor="0 0 0"/></equality><actuator>',
            None,
            "an equality of kind 'connect'",
        ),
        (
            "<worldbody>",
            '<worldbody><body><freejoint/><geom size=".1"/></body>',
            "joint 'joint0'",
            "a free joint",
        ),
        (
            "<worldbody>",
            '<extension><plugin plugin="mujoco.pid"/></extension><worldbody>',
            "mujoco, extension",
            "a plugin",
        ),
        (
            "<worldbody>",
            '<worldbody><flexcomp name="f" type="grid" count="2 2 1" spacing=".1 .1 .1"/>',
            "mujoco, worldbody, flexcomp",
            "a flexible body",
        ),
        (
            "<worldbody>",
            '<asset><model name="m" file="m.xml"/></asset><worldbody>',
            "mujoco, asset, model",
            "a model within the model",
        ),
        ("<mujoco", "<!DOCTYPE mujoco><mujoco", None, "<!DOCTYPE>"),
    ],
)
def test_what_is_no_arm_is_refused_with_the_reason(
    old: str, new: str, subject: str | None, found: str, tmp_path: Path
) -> None:
    file = write(tmp_path, ARM.replace(old, new, 1))
    with refused(RobotError, subject, found=found, file=str(file)):
        quietly(file)


def test_what_mujoco_does_not_compile_is_refused_with_its_reason(tmp_path: Path) -> None:
    with refused(RobotError) as caught:
        quietly(write(tmp_path, ARM.replace("<worldbody>", "<worldbody><unknown/>")))
    assert "unrecognized element" in caught.value.found  # MuJoCo's own words


def test_what_acts_on_the_joints_and_is_not_read_is_refused_with_the_torque(tmp_path: Path) -> None:
    rotor = '<tendon><fixed armature=".3"><joint joint="spin" coef="1"/></fixed></tendon><actuator>'
    with refused(RobotError) as caught:
        quietly(write(tmp_path, ARM.replace("<actuator>", rotor)))
    assert len(caught.value.found) == 3


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name="spin"', 'name="spin" stiffness="3"', "a spring of 3 N·m/rad,"),
        ('name="push"', 'name="push" stiffness="3"', "a spring of 3 N/m,"),
        ("<compiler", '<option gravity="0 0 -1.62"/><compiler', "in place of 0 0 -1.62"),
        ("<compiler", '<option><flag gravity="disable"/></option><compiler', "in place of 0 0 0"),
        ('<body name="hand"', '<body name="hand" gravcomp="1"', "gravcomp"),
        ('forcerange="-7 7"', 'forcerange="-7 9"', "smaller limit of force, 7"),
        (
            "<actuator>",
            '<tendon><fixed stiffness="3"><joint joint="spin" coef="1"/></fixed></tendon><actuator>',
            "tendons",
        ),
    ],
)
def test_what_acts_and_is_not_taken_is_said(old: str, new: str, said: str, tmp_path: Path) -> None:
    with pytest.warns(RobotWarning):
        robot = load_robot(write(tmp_path, ARM.replace(old, new)))
    assert said in str(robot.report)


def test_a_name_with_line_breaks_is_one_line_and_so_is_what_is_said_of_it(tmp_path: Path) -> None:
    odd = ARM.replace('"spin"', '"s&#10;p\x9b" stiffness="3"').replace('"hand"', '"h&#10;d" gravcomp="1"')
    odd = odd.replace("-7 7", "-7 9").replace('"push"', '"p&#10;h"').replace('model="arm"', 'model="a&#10;m"')
    robot = quietly(write(tmp_path, odd.replace('"tool"', '"t&#10;l"')))
    assert (robot.name, robot.tip) == ("a\\nm", "t\\nl")
    assert robot.joint_names == ("turn", "p\\nh", "s\\np\\x9b")
    assert len(robot.report) == 4 and all(str(note).isprintable() for note in robot.report)


def test_a_model_in_which_nothing_moves_is_refused(tmp_path: Path) -> None:
    with refused(RobotError, found=0):
        quietly(write(tmp_path, "<mujoco><worldbody><body><geom size='.1'/></body></worldbody></mujoco>"))


def test_an_urdf_with_the_ending_xml_is_read_as_one(tmp_path: Path) -> None:
    planar = Path(load_robot("planar2r").document.file)
    file = write(tmp_path, planar.read_text(encoding="utf-8"), "planar.xml")
    assert load_robot(file).nv == 2


def test_without_mujoco_the_advice_is_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with refused(MissingDependencyError, found="mujoco"):
        load_robot(write(tmp_path, ARM))


# -- files -------------------------------------------------------------------------------------------------

TETRAHEDRON = "\n".join(
    ["v 0 0 0", "v .1 0 0", "v 0 .1 0", "v 0 0 .1", "f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4", ""]
)


def with_mesh(inertial: str, file: str = "part.obj", compiler: str = 'meshdir="meshes"') -> str:
    """An arm of one link whose shape is a mesh."""
    return f"""<mujoco model="one"><compiler {compiler}/><asset><mesh name="part" file="{file}"/></asset>
    <worldbody><body name="link"><joint name="turn"/>{inertial}
    <geom type="mesh" mesh="part" pos=".1 .2 .3" quat="1 2 0 0"/></body></worldbody></mujoco>"""


def test_the_file_may_be_split(tmp_path: Path) -> None:
    write(
        tmp_path,
        f'<mujocoinclude><body name="more" pos="0 0 1">{SMALL}</body></mujocoinclude>',
        "more/more.xml",
    )
    whole = ARM.replace('<site name="tool"', '<include file="more/more.xml"/><site name="tool"')
    robot = quietly(write(tmp_path, whole))
    assert "more" in {link.name for link in robot.document.links}


def test_a_mass_from_a_mesh_is_that_of_mujoco(tmp_path: Path) -> None:
    write(tmp_path / "meshes", TETRAHEDRON, "part.obj")
    file = write(tmp_path, with_mesh(""))
    robot, model = quietly(file), mujoco.MjModel.from_xml_path(str(file))
    assert robot.inertial_parameters[0] == pytest.approx(model.body("link").mass[0])


@pytest.mark.parametrize("inertial", ["", SMALL])
def test_a_mesh_is_seen_where_its_own_file_puts_it(inertial: str, tmp_path: Path) -> None:
    """MuJoCo moves a mesh's frame into its centre of mass; what is drawn is the file."""
    write(tmp_path / "meshes", TETRAHEDRON, "part.obj")
    robot = quietly(write(tmp_path, with_mesh(inertial)))
    (shape,) = (g for link in robot.document.links for g in link.visuals)
    assert shape.origin.se3.translation == pytest.approx([0.1, 0.2, 0.3])
    expected = np.array([[1, 0, 0], [0, -0.6, -0.8], [0, 0.8, -0.6]])
    assert shape.origin.se3.rotation == pytest.approx(expected)
    assert Path(shape.shape.filename) == Path("meshes/part.obj")


def test_a_missing_mesh_costs_only_the_picture(tmp_path: Path) -> None:
    with pytest.warns(RobotWarning, match=r"part\.obj"):
        robot = load_robot(write(tmp_path, with_mesh(SMALL)))
    assert robot.nv == 1


def test_a_missing_mesh_that_has_the_mass_is_refused(tmp_path: Path) -> None:
    with refused(RobotError, "mujoco, asset, mesh", found="there is no such file"):
        quietly(write(tmp_path, with_mesh("")))


@pytest.mark.parametrize("named", ["../../part.obj", "OUT", "link.obj"])
def test_a_mesh_outside_of_the_package_is_not_read(named: str, tmp_path: Path) -> None:
    write(tmp_path, TETRAHEDRON, "part.obj")
    home = tmp_path / "home"
    (home / "meshes").mkdir(parents=True)
    (home / "meshes" / "link.obj").symlink_to(tmp_path / "part.obj")
    named = named.replace("OUT", str(tmp_path / "part.obj"))
    with refused(RobotError, "mujoco, asset, mesh", found="outside of the package"):
        quietly(write(home, with_mesh("", named)))


def test_an_include_outside_of_the_package_is_not_read(tmp_path: Path) -> None:
    write(tmp_path, "<mujocoinclude/>", "outside.xml")
    text = ARM.replace("<worldbody>", '<include file="../outside.xml"/><worldbody>')
    with refused(RobotError, "mujoco, include", found="'../outside.xml'"):
        quietly(write(tmp_path / "home", text))


def test_a_file_that_includes_itself_is_refused(tmp_path: Path) -> None:
    write(tmp_path, '<mujocoinclude><include file="loop.xml"/></mujocoinclude>', "loop.xml")
    with refused(RobotError, "mujocoinclude, include", found="more", file=str(tmp_path / "loop.xml")):
        quietly(write(tmp_path, ARM.replace("<worldbody>", '<include file="loop.xml"/><worldbody>')))


def test_a_pipe_in_the_place_of_a_mesh_is_not_waited_for(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    os.mkfifo(tmp_path / "meshes" / "part.obj")
    with refused(RobotError, "mujoco, asset, mesh", found="it is not a regular file"):
        quietly(write(tmp_path, with_mesh("")))


def test_mujoco_opens_no_file_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its compiler gets a text and the content of meshes, and knows no folder in which either could lie."""
    write(tmp_path / "meshes", TETRAHEDRON, "part.obj")
    file = write(tmp_path, with_mesh("", compiler='meshdir="meshes" texturedir="/"'))
    given: list[str] = []
    compile_text = mujoco.MjModel.from_xml_string

    def listening(text: str, assets: dict[str, bytes]) -> object:
        given.extend([text, *assets])
        return compile_text(text, assets)

    monkeypatch.setattr(mujoco, "MjModel", type("Model", (), {"from_xml_string": staticmethod(listening)}))
    quietly(file)
    text, *assets = given
    assert [word.split('"')[1] for word in text.split(" file=")[1:]] == assets
    assert "dir=" not in text
