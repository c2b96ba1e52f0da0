"""The loader: good descriptions come through as they are, wrong ones are refused, odd ones taken and said."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from urdf_corpus import GOOD, REFUSED, TAKEN, TRIANGLE, write

from synctrl.errors import FrameNotFound, InputError, RobotError, RobotWarning
from synctrl.robots.urdf import (
    Description,
    describe,
    existing_file,
    lock_joints,
    model_from_xml,
    read_urdf,
    urdf_folder,
)
from synctrl.robots.urdf.build import check_model
from synctrl.robots.urdf.document import Pose
from synctrl.robots.urdf.packages import data_folder
from synctrl.robots.urdf.reader import read_text
from synctrl.robots.urdf.writer import to_xml

OWN = sorted(urdf_folder().glob("*/*.urdf"))


def refusal(file: Path, **options: object) -> str:
    """What the loader says about a file it refuses."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        with pytest.raises(RobotError) as caught:
            read_urdf(file, **options)
    return str(caught.value)


def quietly(file: Path, **options: object) -> Description:
    """A robot, whatever is warned of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return read_urdf(file, **options)


def with_mesh(folder: Path, filename: str) -> Path:
    """The good description in a folder of its own, with another mesh."""
    return write(folder / "robot", GOOD.replace("meshes/fore.stl", filename))


# -- broken descriptions -----------------------------------------------------------------------------------


def test_the_corpus_has_at_least_a_hundred_and_twenty_kinds():
    assert len(REFUSED) + len(TAKEN) >= 120


@pytest.mark.parametrize("name", REFUSED)
def test_a_wrong_mechanism_is_refused_with_the_right_words(name, tmp_path):
    message = refusal(write(tmp_path, REFUSED[name].text))
    assert message.startswith(str(tmp_path / "robot.urdf")), message
    assert message.isprintable() and ("expected" in message or "did you mean" in message), message
    for word in REFUSED[name].words:
        assert word in message, message


@pytest.mark.parametrize("name", TAKEN)
def test_what_does_not_change_the_mechanism_is_taken_with_one_warning_and_a_note(name, tmp_path):
    with pytest.warns(RobotWarning) as caught:
        description = read_urdf(write(tmp_path, TAKEN[name].text))
    assert len(caught) == 1 and str(caught[0].message) == description.report.summary()
    odd = [note for note in description.report if note.kind == TAKEN[name].kind]
    assert any(note.where.startswith(TAKEN[name].where) for note in odd), description.report
    assert str(description.report).replace("\n", "").isprintable()


@pytest.mark.parametrize("name", TAKEN)
def test_strictly_read_every_oddity_is_an_error(name, tmp_path):
    assert refusal(write(tmp_path, TAKEN[name].text), strict=True).startswith(str(tmp_path))


def test_two_joints_on_one_axis_with_next_to_nothing_between_them_are_refused(tmp_path):
    """Each body is possible, but no acceleration of such a mechanism has a correct digit."""
    text = GOOD.replace('<origin xyz="0.4 0 0"/>', "").replace('<axis xyz="0 1 0"/>', '<axis xyz="0 0 1"/>')
    text = text.replace('"2.5"/>', '"1e-15"/>').replace('<origin xyz="0.2 0 0" rpy="0.1 0.2 0.3"/>', "")
    light = 'ixx="1e-17" ixy="0" ixz="0" iyy="1e-17" iyz="0" izz="1e-17"'
    text = text.replace('ixx="0.01" ixy="0.001" ixz="0" iyy="0.04" iyz="0" izz="0.045"', light)
    assert "positive definite mass matrix" in refusal(write(tmp_path, text))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "no element found"),
        (b"\x01\x02\x03", "well-formed"),
        (b"just text", "well-formed"),
        (GOOD.replace("utf-8", "utf-16").encode(), "'utf-16'"),
        (GOOD.replace("utf-8", "us-ascii").replace("good", "g\u00f6d", 1).encode(), "none of ascii"),
        (GOOD.encode().replace(b"good", b"g\xf6od", 1), "0xf6"),
        (b"<robot name='x'>" + b" " * 10_000_001 + b"</robot>", "at most 10 MB"),
        (GOOD.replace('encoding="utf-8"', "").encode("utf-16-le"), "UTF-16"),
        (b"<robot name='x'>" + b"<gazebo/>" * 100_001 + b"</robot>", "at most 100000 elements"),
    ],
)
def test_a_file_that_is_no_urdf_is_refused(content, words, tmp_path):
    assert words in refusal(write(tmp_path, content))


@pytest.mark.parametrize(
    ("declared", "encoding"),
    [
        ("utf-8", "utf-8-sig"),
        ("UTF-16", "utf-16"),
        ("utf-8", "utf-16"),
        ("ISO-8859-1", "latin-1"),
        ("windows-1252", "cp1252"),
    ],
)
def test_a_file_is_read_in_the_encoding_of_its_mark_or_else_of_its_declaration(declared, encoding, tmp_path):
    text = GOOD.replace("utf-8", declared).replace('name="good"', 'name="gr\u00f6\u00dfer"')
    with pytest.warns(RobotWarning, match="names are taken as they stand"):
        description = read_urdf(write(tmp_path, text.encode(encoding)))
    assert description.document.name == "gr\u00f6\u00dfer"


def test_a_file_of_a_chinese_maker_is_read_as_it_declares(tmp_path):
    text = GOOD.replace("utf-8", "GB2312").replace('name="good"', 'name="\u81c2"')
    with pytest.warns(RobotWarning):
        assert read_urdf(write(tmp_path, text.encode("gbk"))).document.name == "\u81c2"


_LOADS = """
import sys
from synctrl import load_robot
from synctrl.errors import RobotError
try:
    load_robot(sys.argv[1])
except RobotError as error:
    print(error)
"""


@pytest.mark.parametrize("name", ["a.urdf", "a.xml", "a.xacro", "a.urdf.xacro"])
@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_what_is_no_regular_file_is_refused_and_not_waited_for(kind, name, tmp_path):
    """In a process of its own, which may hang."""
    make = {"pipe": os.mkfifo, "device": lambda file: file.symlink_to("/dev/zero"), "folder": Path.mkdir}
    make[kind](tmp_path / name)
    run = [sys.executable, "-c", _LOADS, str(tmp_path / name)]
    said = subprocess.run(run, capture_output=True, text=True, timeout=60, check=True).stdout
    assert str(tmp_path / name) in said and ("folder" if kind == "folder" else "no regular file") in said


def test_a_line_number_is_that_of_the_defect(tmp_path):
    broken = GOOD.replace('value="2.5"', 'value="abc"')
    line = broken[: broken.index("abc")].count("\n") + 1
    file = write(tmp_path, broken)
    with refused(RobotError, "link 'upper', inertial, mass", file=str(file), line=line):
        read_urdf(file)


def test_a_missing_file_is_said_with_the_near_ones(tmp_path):
    write(tmp_path, GOOD)
    assert "did you mean 'robot.urdf'" in refusal(tmp_path / "robto.urdf")
    assert "robot.urdf" in refusal(tmp_path / "else.urdf")
    assert "a folder" in refusal(tmp_path)
    with refused(InputError, "path"):
        existing_file(3)


@pytest.mark.parametrize("path", ["a\0b.urdf", "x" * 5000 + ".urdf", "\x1b[31mred.urdf"])
def test_a_path_that_cannot_be_is_refused_in_printable_words(path):
    assert refusal(Path(path)).isprintable()


def test_an_unknown_tip_lists_the_frames(tmp_path):
    with refused(FrameNotFound, robot="good", frame="tol"):
        read_urdf(write(tmp_path, GOOD), tip="tol")


def test_what_pinocchio_refuses_is_an_error_of_the_robot():
    with refused(RobotError, file="a.urdf"):
        model_from_xml("a.urdf", '<robot name="x"><link name="a"/><link name="a"/></robot>')


def test_reading_needs_no_standard_error_no_home_and_no_folder_to_write_in(tmp_path):
    code = (
        "import os, sys, tempfile; os.close(2); sys.stderr = None\n"
        "tempfile.tempdir = '/nowhere'\n"
        "from synctrl import load_robot\n"
        f"print(load_robot({str(write(tmp_path, GOOD))!r}).nv)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        text=True,
        check=False,
        env={"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    assert done.stdout.strip() == "3"


def test_threads_may_read_at_the_same_time_and_leave_the_standard_error_alone(tmp_path):
    file, before = write(tmp_path, GOOD), os.fstat(2).st_ino
    with ThreadPoolExecutor(8) as pool:
        models = [description.model for description in pool.map(lambda _: quietly(file), range(24))]
    assert all(model == models[0] for model in models)
    assert os.fstat(2).st_ino == before


# -- warnings ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 2"/>', "axis has length 2"),
        ("meshes/fore.stl", "meshes/none.stl", "mesh 'meshes/none.stl' is not shown: there is no such file"),
        ("meshes/fore.stl", "package://nowhere/none.stl", "package 'nowhere'"),
        ('<link name="tool"/>', '<link name="tool"><feature/></link>', "<feature> is not read"),
        ('<material name="grey"/>', '<material name="gray"/>', "did you mean 'grey'"),
    ],
)
def test_the_warning_says_the_first_of_each_kind(old, new, words, tmp_path):
    with pytest.warns(RobotWarning, match=words):
        read_urdf(write(tmp_path, GOOD.replace(old, new)))


def test_an_impossible_inertia_of_the_base_is_left_out_because_it_plays_no_part(tmp_path):
    base = (
        '<link name="base"><inertial><mass value="-1"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    )
    description = quietly(write(tmp_path, GOOD.replace('<link name="base">', base)))
    assert [(note.kind, note.where) for note in description.report] == [("left out", "link 'base', inertial")]


@pytest.mark.filterwarnings("error")
def test_a_good_description_is_read_without_a_warning(tmp_path):
    description = read_urdf(write(tmp_path, GOOD))
    assert description.model.nv == 3
    assert description.tip == "tool"
    assert description.root == "base"
    assert description.links == ("base", "upper", "fore", "slide", "tool")
    assert len(description.visual.geometryObjects) == 4


def test_an_axis_is_taken_by_its_direction(tmp_path):
    long = quietly(write(tmp_path, GOOD.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 2"/>')))
    assert long.model == read_urdf(write(tmp_path, GOOD)).model


# -- meshes ------------------------------------------------------------------------------------------------


def left_out(file: Path) -> list[str]:
    """The links of a robot that lose a picture; nothing else may be said about it."""
    report = quietly(file).report
    assert {note.kind for note in report} <= {"left out"}
    return sorted({note.where.partition(",")[0] for note in report})


def test_a_link_out_of_the_folder_is_left_out(tmp_path):
    (tmp_path / "outside.stl").write_bytes(TRIANGLE)
    file = with_mesh(tmp_path, "meshes/link.stl")
    (file.parent / "meshes" / "link.stl").symlink_to(tmp_path / "outside.stl")
    assert left_out(file) == ["link 'fore'"]


def test_a_package_is_found_where_the_caller_says(tmp_path):
    file = with_mesh(tmp_path, "package://my_robot/fore.stl")
    package = tmp_path / "packages" / "my_robot"
    package.mkdir(parents=True)
    (package / "fore.stl").write_bytes(TRIANGLE)
    shape = read_urdf(file, [tmp_path / "packages"]).visual.geometryObjects[2]
    assert Path(shape.meshPath) == package / "fore.stl"


def test_a_description_finds_the_package_it_lies_in_but_no_other_folder_above(tmp_path):
    home = tmp_path / "home"
    file = with_mesh(home, "package://home/secret.stl")
    (home / "secret.stl").write_bytes(TRIANGLE)
    with pytest.warns(RobotWarning, match="package 'home'"):
        read_urdf(file)
    (home / "package.xml").write_text("<package/>")
    assert Path(read_urdf(file).visual.geometryObjects[2].meshPath) == home / "secret.stl"


# -- good descriptions come through as they are ------------------------------------------------------------


def stock(*paths: str) -> list[Path]:
    """Files of example-robot-data."""
    return [data_folder() / "example-robot-data" / "robots" / path for path in paths]


@pytest.mark.parametrize(
    "file",
    [*OWN, *stock("ur_description/urdf/ur5_robot.urdf", "xarm_description/urdf/xarm7.urdf")],
    ids=lambda file: file.stem,
)
def test_strict_reading_gives_the_model_and_shapes_that_pinocchio_reads_itself(file):
    mine = read_urdf(file)
    model = pin.buildModelFromUrdf(str(file))
    visual = pin.buildGeomFromUrdf(model, str(file), pin.VISUAL, package_dirs=[str(data_folder())])
    assert list(mine.model.names) == list(model.names)
    for limit in ("lowerPositionLimit", "upperPositionLimit", "effortLimit", "velocityLimit", "damping"):
        np.testing.assert_array_equal(getattr(mine.model, limit), getattr(model, limit))
    for one, other in zip(mine.model.inertias, model.inertias, strict=True):
        assert one.isApprox(other, 1e-14)
    for one, other in zip(mine.model.frames, model.frames, strict=True):
        assert one.name == other.name and one.placement.isApprox(other.placement, 1e-12)
    for one, other in zip(mine.visual.geometryObjects, visual.geometryObjects, strict=True):
        assert (one.name, one.parentJoint, one.parentFrame) == (
            other.name,
            other.parentJoint,
            other.parentFrame,
        )
        assert one.placement.isApprox(other.placement, 1e-12)
        if one.meshPath:
            assert os.path.samefile(one.meshPath, other.meshPath)
            np.testing.assert_array_equal(one.meshScale, other.meshScale)
        else:
            assert one.geometry == other.geometry
        assert one.overrideMaterial == other.overrideMaterial
        np.testing.assert_allclose(one.meshColor, other.meshColor, atol=1e-7)


def test_what_is_written_is_read_again_as_the_same_document(tmp_path):
    file = write(tmp_path, GOOD)
    document = read_text(file, file.read_bytes())
    again = read_text(file, to_xml(document).encode())
    assert without_lines(again) == without_lines(document)


def without_lines(document):
    """A document with nothing in it that tells where in a file a thing stood."""

    def plain(item):
        lines = {"line": 0} if hasattr(item, "line") else {}
        for key in ("visuals", "collisions"):
            if hasattr(item, key):
                lines[key] = tuple(map(plain, getattr(item, key)))
        if getattr(item, "inertial", None):
            lines["inertial"] = plain(item.inertial)
        return replace(item, **lines)

    links, joints = tuple(map(plain, document.links)), tuple(map(plain, document.joints))
    return replace(document, links=links, joints=joints)


angle = st.floats(-np.pi, np.pi)
near_upright = st.floats(-1e-6, 1e-6).map(lambda small: np.pi / 2 + small)


@given(roll=angle, pitch=angle | near_upright | near_upright.map(lambda x: -x), yaw=angle)
def test_a_pose_writes_every_rotation_to_rounding(roll, pitch, yaw):
    placement = pin.SE3(pin.rpy.rpyToMatrix(roll, pitch, yaw), np.zeros(3))
    np.testing.assert_allclose(Pose.of(placement).se3.rotation, placement.rotation, atol=1e-14)


@given(q=st.tuples(st.floats(-2, 2.5), st.floats(-3, 3), st.floats(0, 0.3)), keep=st.sampled_from([0, 1, 2]))
def test_locked_joints_leave_the_reduced_model(q, keep):
    """Compared with Pinocchio's own reduction, by the mass matrix and gravity of what is left."""
    names = ("shoulder", "elbow", "rail")
    document = replace(read_text(CORPUS_FILE, CORPUS_FILE.read_bytes()), file=None)
    full = describe(without_shapes(document)).model
    locked = {name: value for name, value in zip(names, q, strict=True) if name != names[keep]}
    mine = describe(without_shapes(lock_joints(document, locked))).model
    whole = pin.integrate(full, pin.neutral(full), np.array(q))
    theirs = pin.buildReducedModel(full, [full.getJointId(name) for name in locked], whole)
    for model in (mine, theirs):
        assert list(model.names) == ["universe", names[keep]]
    at = [pin.integrate(model, pin.neutral(model), np.array([q[keep]])) for model in (mine, theirs)]
    H = [pin.crba(m, m.createData(), x) for m, x in zip((mine, theirs), at, strict=True)]
    g = [pin.computeGeneralizedGravity(m, m.createData(), x) for m, x in zip((mine, theirs), at, strict=True)]
    np.testing.assert_allclose(H[0], H[1], rtol=1e-11)
    np.testing.assert_allclose(g[0], g[1], atol=1e-11)


CORPUS_FILE = Path(__file__).parent / "urdf_corpus" / "good.urdf"


def without_shapes(document):
    """The document without visuals, so that no mesh is looked for."""
    return replace(document, links=tuple(replace(link, visuals=()) for link in document.links))


def test_a_mimic_joint_is_read_when_it_is_locked(tmp_path):
    text = GOOD.replace('<limit effort="30"', '<mimic joint="shoulder"/><limit effort="30"')
    description = read_urdf(write(tmp_path, text), locked={"elbow": 0.0})
    assert description.locked == ("elbow",) and not description.report
    assert list(description.model.names) == ["universe", "shoulder", "rail"]


@pytest.mark.parametrize(
    ("locked", "words"),
    [
        ({"elbw": 0.0}, "did you mean 'elbow'"),
        ({"mount": 0.0}, "moving joints"),
        ({"rail": 0.4}, "from 0 to 0.3"),
    ],
)
def test_a_joint_that_cannot_be_locked_is_refused(locked, words, tmp_path):
    assert words in refusal(write(tmp_path, GOOD), locked=locked)


def test_a_position_that_is_no_number_cannot_be_locked(tmp_path):
    with refused(InputError, "position of joint 'elbow'"):
        read_urdf(write(tmp_path, GOOD), locked={"elbow": float("nan")})


@pytest.mark.parametrize("options", [{"locked": ("elbow",)}, {"package_dirs": 3}, {"package_dirs": [None]}])
def test_options_of_another_type_are_refused(options, tmp_path):
    with refused(InputError, next(iter(options))):
        read_urdf(write(tmp_path, GOOD), **options)


def test_a_model_that_is_not_the_document_is_refused(tmp_path):
    description = read_urdf(write(tmp_path, GOOD))
    lighter = pin.Model(description.model)
    lighter.inertias[2].mass *= 0.999
    with refused(RobotError, "joint 'elbow'"):
        check_model(description.document, lighter)
    fewer = pin.buildReducedModel(description.model, [2], pin.neutral(description.model))
    with refused(RobotError, None, found=", ".join(map(repr, fewer.names[1:]))):
        check_model(description.document, fewer)


def test_a_fixed_joint_may_share_its_name_with_a_link(tmp_path):
    text = GOOD.replace('<joint name="mount"', '<joint name="tool"')
    description = read_urdf(write(tmp_path, text))
    assert description.model.frames[description.model.getFrameId("tool")].type == pin.BODY
