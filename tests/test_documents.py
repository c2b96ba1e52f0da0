"""Made documents: written as URDF they load back to the dynamics that Pinocchio makes in its own way."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused
from urdf_corpus import GOOD, write

from synctrl.errors import FrameNotFound, InputError, RobotError
from synctrl.robots.catalog import load_description
from synctrl.robots.documents import lock, planar_arm, weld, write_urdf
from synctrl.robots.urdf import describe, read_urdf

lengths_and_masses = st.lists(st.tuples(st.floats(0.05, 3), st.floats(0.1, 50)), min_size=1, max_size=6)
triple = st.tuples(*[st.floats(-1, 1)] * 3)
angles = st.tuples(*[st.floats(-3, 3)] * 3)


def dynamics(model: pin.Model, count: int = 3) -> list[np.ndarray]:
    """Mass matrix, Coriolis matrix and gravity at random states."""
    rng = np.random.default_rng(3)
    data = model.createData()
    found = []
    for _ in range(count):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-3, 3, model.nv))
        v = rng.standard_normal(model.nv)
        found.append(pin.crba(model, data, q).copy())
        found.append(pin.computeCoriolisMatrix(model, data, q, v).copy())
        found.append(pin.computeGeneralizedGravity(model, data, q).copy())
    return found


def assert_same_dynamics(mine: pin.Model, theirs: pin.Model) -> None:
    """The same joints, and equal matrices to rounding."""
    assert list(mine.names) == list(theirs.names)
    for one, other in zip(dynamics(mine), dynamics(theirs), strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * max(1.0, abs(other).max()))


def read_back(document, folder) -> pin.Model:
    """The model of a document that has been a file in between."""
    return read_urdf(write_urdf(document, folder / "made.urdf")).model


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("documents")


@settings(max_examples=30)
@given(lengths_and_masses)
def test_a_planar_arm_is_the_one_that_pinocchio_s_own_calls_make(folder, rods):
    lengths, masses = zip(*rods, strict=True)
    theirs, parent, reach = pin.Model(), 0, 0.0
    for k, (length, mass) in enumerate(rods):
        placement = pin.SE3(np.eye(3), np.array([reach, 0, 0]))
        parent = theirs.addJoint(parent, pin.JointModelRZ(), placement, f"joint{k + 1}")
        thin, long = mass * (length / 60) ** 2 / 2, mass * length**2 / 12
        rod = pin.Inertia(mass, np.array([length / 2, 0, 0]), np.diag([thin, long, long]))
        theirs.appendBodyToJoint(parent, rod, pin.SE3.Identity())
        reach = length
    assert_same_dynamics(read_back(planar_arm(lengths, masses), folder), theirs)


def test_a_planar_arm_with_the_paper_s_numbers_is_planar2r():
    made, own = describe(planar_arm([0.3, 0.3], [1, 1])), load_description("planar2r")
    assert_same_dynamics(made.model, own.model)
    assert made.tip == own.tip == "tip"
    for limit in ("lowerPositionLimit", "upperPositionLimit", "effortLimit", "velocityLimit"):
        np.testing.assert_array_equal(getattr(made.model, limit), getattr(own.model, limit))


@settings(max_examples=15)
@given(st.sampled_from(["xarm7", "panda", "a460"]), st.floats(0.01, 20), triple, triple, angles)
def test_a_welded_payload_is_pinocchio_s_appended_body(folder, name, mass, com, xyz, rpy):
    description = load_description(name)
    size = np.array([0.1, 0.2, 0.3])
    inertia = np.diag((size**2).sum() - size**2) * mass / 12
    theirs = pin.Model(description.model)
    frame = theirs.frames[theirs.getFrameId(description.tip, pin.BODY)]
    placement = frame.placement * pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(xyz))
    theirs.appendBodyToJoint(frame.parentJoint, pin.Inertia(mass, np.array(com), inertia), placement)
    made = weld(description, description.tip, mass, com=com, size=size, xyz=xyz, rpy=rpy)
    assert_same_dynamics(read_back(made, folder), theirs)


def test_a_welded_tool_is_a_frame_at_its_place():
    description = describe(weld("ur5", "tool0", 0.5, xyz=(0, 0, 0.1), name="gripper"))
    assert description.tip == "gripper"
    frames = {f.name: f for f in description.model.frames if f.type == pin.BODY}
    offset = frames["tool0"].placement.actInv(frames["gripper"].placement)
    np.testing.assert_allclose(offset.translation, [0, 0, 0.1], atol=1e-15)


@settings(max_examples=15)
@given(q=st.tuples(*[st.floats(-3, 3)] * 3))
def test_locked_joints_are_pinocchio_s_reduction(folder, q):
    names = ("joint1", "joint4", "joint6")
    full = load_description("a460_full").model
    held = [full.getJointId(name) for name in names]
    at = pin.neutral(full)
    at[[joint - 1 for joint in held]] = q
    theirs = pin.buildReducedModel(full, held, at)
    assert_same_dynamics(read_back(lock("a460_full", dict(zip(names, q, strict=True))), folder), theirs)


@pytest.mark.parametrize("angle", [np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9, np.pi / 2 + 1e-12])
def test_a_joint_locked_upright_loses_no_digits(folder, angle):
    """Where roll and yaw cannot be told apart: a right angle about y, in a frame that is turned too."""
    text = GOOD.replace('<origin xyz="0.4 0 0"/>', '<origin xyz="0.4 0 0" rpy="0.3 0 0.7"/>')
    full = read_urdf(write(folder, text))
    held = [full.model.getJointId("elbow")]
    at = pin.integrate(full.model, pin.neutral(full.model), np.array([0, angle, 0]))
    theirs = pin.buildReducedModel(full.model, held, at)
    assert_same_dynamics(read_back(lock(full, {"elbow": angle}), folder), theirs)


def test_an_unchanged_robot_is_written_as_it_is(folder):
    for name in ("a460_full", "ur5", "panda", "kinova"):
        description = load_description(name)
        again = read_urdf(write_urdf(description.document, folder / "again.urdf"))
        assert_same_dynamics(again.model, description.model)
        shapes, written = description.visual.geometryObjects, again.visual.geometryObjects
        for one, other in zip(shapes, written, strict=True):
            assert one.meshPath == other.meshPath and one.placement.isApprox(other.placement, 1e-15)
            np.testing.assert_array_equal(one.meshColor, other.meshColor)


def test_another_reader_understands_what_is_written(folder):
    """yourdfpy, which shares nothing with this package or Pinocchio, finds the tip at the same place."""
    made = weld(planar_arm([0.4, 0.3, 0.2], [3, 2, 1]), "tip", 0.5, xyz=(0.1, 0, 0.2), rpy=(0.1, 0.2, 0.3))
    file = write_urdf(made, folder / "other.urdf")
    model = read_urdf(file).model
    other = yourdfpy.URDF.load(str(file), load_meshes=False)
    q = np.array([0.3, -0.5, 1.2])
    other.update_cfg(q)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    mine = data.oMf[model.getFrameId("payload", pin.BODY)].homogeneous
    np.testing.assert_allclose(other.get_transform("payload", "base"), mine, atol=1e-12)


@pytest.mark.parametrize(
    ("lengths", "masses", "subject"),
    [
        ([], [], "lengths, masses"),
        ([0.3], [1, 1], "lengths, masses"),
        ([0.3, -0.3], [1, 1], "lengths[1]"),
        ([0.3, 0.3], [1, 0], "masses[1]"),
        ([0.3, float("nan")], [1, 1], "lengths"),
        ("ab", [1], "lengths"),
        ([[0.3]], [1], "lengths"),
    ],
)
def test_numbers_that_make_no_arm_are_refused(lengths, masses, subject):
    with refused(InputError, subject):
        planar_arm(lengths, masses)


@pytest.mark.parametrize(
    ("values", "subject"),
    [
        ({"mass": -1.0}, "mass"),
        ({"mass": float("inf")}, "mass"),
        ({"com": (0, 0)}, "com"),
        ({"size": (0.1, 0.1, 0)}, "size[2]"),
        ({"inertia": np.diag([1.0, 1.0, 3.0])}, "inertia"),
        ({"inertia": np.diag([1.0, 1.0, -1.0])}, "inertia"),
        ({"inertia": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]}, "inertia"),
        ({"rpy": (0, 0, float("nan"))}, "rpy"),
        ({"name": "<b>"}, "name"),
        ({"name": "tip"}, "name"),
    ],
)
def test_a_payload_that_no_body_can_be_is_refused(values, subject):
    with refused(InputError, subject):
        weld("planar2r", "tip", **{"mass": 1.0, **values})


def test_a_payload_on_a_link_that_is_not_there_lists_the_links():
    with refused(FrameNotFound, robot="planar2r", frame="tpi", available=("base", "link1", "link2", "tip")):
        weld("planar2r", "tpi", 1.0)


def test_a_name_with_markup_makes_no_robot():
    with refused(InputError, "name"):
        planar_arm([1], [1], name="<script>")


def test_a_joint_that_is_not_there_cannot_be_locked():
    with refused(RobotError, found="joint"):
        lock("planar2r", {"joint": 0.0})


def test_an_arm_with_every_joint_locked_is_no_robot(folder):
    with refused(RobotError, found=0):
        write_urdf(lock("planar2r", {"joint1": 0.0, "joint2": 0.0}), folder / "stiff.urdf")


def test_a_file_that_cannot_be_written_is_said(folder):
    file = folder / "none" / "arm.urdf"
    with refused(InputError, str(file)):
        write_urdf(planar_arm([1], [1]), file)


def test_meshes_named_by_plain_paths_keep_a_document_in_its_folder(folder, tmp_path):
    description = read_urdf(write(tmp_path, GOOD))
    assert write_urdf(description.document, tmp_path / "again.urdf").is_file()
    with refused(RobotError, "link 'fore'", file=str(tmp_path / "robot.urdf")):
        write_urdf(description.document, folder / "elsewhere.urdf")


def test_a_turn_near_a_right_angle_keeps_the_digits_that_the_writer_of_yourdfpy_loses(tmp_path):
    """Why documents are not written by yourdfpy: its way from a rotation to angles is no way back."""
    rpy = (0.3, np.pi / 2 - 1e-14, 0.2)
    R = pin.rpy.rpyToMatrix(*rpy)
    turned = np.eye(4)
    turned[:3, :3] = R
    joint = yourdfpy.urdf.Joint(name="j", type="fixed", parent="a", child="b", origin=turned)
    links = [yourdfpy.urdf.Link(name=name) for name in "ab"]
    theirs = yourdfpy.URDF(
        robot=yourdfpy.urdf.Robot(name="r", links=links, joints=[joint]),
        build_scene_graph=False,
        load_meshes=False,
    )
    file = tmp_path / "theirs.urdf"
    file.write_bytes(theirs.write_xml_string())
    lost = np.abs(pin.buildModelFromUrdf(str(file)).frames[-1].placement.rotation - R).max()
    assert lost > 1e-5

    model = read_back(weld("planar2r", "tip", 1.0, rpy=rpy), tmp_path)
    tip, payload = (model.frames[model.getFrameId(name)].placement for name in ("tip", "payload"))
    np.testing.assert_allclose(tip.rotation.T @ payload.rotation, R, atol=1e-14)
