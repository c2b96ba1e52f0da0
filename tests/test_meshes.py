"""A mesh never costs the robot: whatever cannot be shown is left out, and said; nothing outside is opened."""

from __future__ import annotations

import json
import os
import re
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import meshes
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from urdf_corpus import GOOD, write

from synctrl.errors import RobotError, RobotWarning
from synctrl.robots.urdf import mesh_files, read_urdf
from synctrl.robots.urdf.document import Document, Geometry, Link, Shape
from synctrl.robots.urdf.meshes import find_pictures
from synctrl.robots.urdf.packages import Packages, Unusable
from synctrl.robots.urdf.report import Notes
from synctrl.show.meshes import read_mesh

CASES = Path(__file__).parent / "cases" / "urdf"


@pytest.fixture(autouse=True)
def _no_ros(monkeypatch):
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)


def looked_for(
    file: Path,
    filename: str,
    *,
    folders: tuple[Path, ...] = (),
    texture: str | None = None,
    strict: bool = False,
) -> tuple[Geometry, Notes]:
    """A visual with this mesh in this description, and the notes of whoever looked for it."""
    shape = Shape("mesh", (1.0, 1.0, 1.0), filename) if filename else Shape("sphere", (1.0,))
    arm = Link("arm", visuals=(Geometry(shape, line=7, texture=texture),))
    notes = Notes(file, strict)
    document = find_pictures(Document("r", (arm,), (), file), Packages(file, folders), notes)
    return document.links[0].visuals[0], notes


def found(file: Path, filename: str, **options: object) -> Path:
    """The file of a mesh that is shown."""
    visual, notes = looked_for(file, filename, **options)
    assert not notes.collected, notes.collected
    assert visual.shape.file is not None
    return visual.shape.file


def left_out(file: Path, filename: str, **options: object) -> str:
    """Why a mesh is not shown. It is said once, with link and line, and a strict reader refuses it."""
    visual, notes = looked_for(file, filename, **options)
    (note,) = notes.collected
    assert visual.shape.hidden and visual.shape.filename == filename
    assert (note.kind, note.where, note.line) == ("left out", "link 'arm', visual", 7)
    assert note.text.isprintable() and len(note.text) < 500
    with refused(RobotError, "link 'arm', visual", file=str(file), line=7):
        looked_for(file, filename, strict=True, **options)
    return note.text


@pytest.fixture
def file(tmp_path) -> Path:
    """A description in a package."""
    (tmp_path / "robot" / "urdf").mkdir(parents=True)
    (tmp_path / "robot" / "meshes").mkdir()
    (tmp_path / "robot" / "package.xml").write_text("<package><name>arm</name></package>")
    (tmp_path / "robot" / "meshes" / "a.stl").write_bytes(meshes.stl())
    (tmp_path / "outside.stl").write_bytes(meshes.stl())
    return tmp_path / "robot" / "urdf" / "robot.urdf"


# -- where meshes are --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["package://arm/meshes/a.stl", "model://arm/meshes/a.stl", "../meshes/a.stl"]
)
def test_a_mesh_in_the_package_is_found_from_any_working_directory(name, file, tmp_path, monkeypatch):
    monkeypatch.chdir("/")
    assert found(file, name) == tmp_path / "robot" / "meshes" / "a.stl"
    monkeypatch.chdir(tmp_path)
    assert found(Path("robot/urdf/robot.urdf"), name) == tmp_path / "robot" / "meshes" / "a.stl"


def test_a_mesh_by_its_whole_path_is_found_in_the_package_and_in_named_folders(file, tmp_path):
    mesh = tmp_path / "robot" / "meshes" / "a.stl"
    spaced = tmp_path / "robot" / "meshes" / "a b.stl"
    spaced.write_bytes(meshes.stl())
    for name in (str(mesh), f"file://{mesh}", f"file://localhost{mesh}", f"{mesh.parent}/../meshes/a.stl"):
        assert found(file, name) == mesh
    for name in (f"file://{spaced}", f"file://{spaced}".replace(" ", "%20")):
        assert found(file, name) == spaced
    outside = tmp_path / "outside.stl"
    assert "package_dirs" in left_out(file, f"file://{outside}")
    assert found(file, f"file://{outside}", folders=(tmp_path,)) == outside
    assert found(file, "../../outside.stl", folders=(tmp_path,)) == outside


@pytest.mark.parametrize(
    "name",
    [
        *("../../outside.stl", "package://arm/../outside.stl", "package://arm/meshes/../../outside.stl"),
        *(
            "package://../outside.stl",
            "package:///etc/passwd.stl",
            "/etc/passwd.stl",
            "file:///etc/passwd.stl",
        ),
        *("link.stl", "folder/outside.stl", "package://arm/urdf/link.stl", "file://%2e%2e/outside.stl"),
        *("http://example.org/a.stl", "https://example.org/a.stl", "data://a.stl", "//server/a.stl"),
        *(
            "..\\..\\outside.stl",
            "C:/outside.stl",
            "package://arm",
            "package://",
            "",
            "package://other/a.stl",
        ),
    ],
)
def test_a_mesh_outside_is_left_out_and_never_looked_at(name, file, tmp_path, monkeypatch):
    (file.parent / "link.stl").symlink_to(tmp_path / "outside.stl")
    (file.parent / "folder").symlink_to(tmp_path)
    monkeypatch.setattr(mesh_files, "read_regular", lambda *_: pytest.fail("it was opened"))
    if name:
        left_out(file, name)


def test_a_link_within_the_package_is_fine_and_keeps_its_format(file):
    (file.parent / "blob").write_bytes(meshes.stl())
    (file.parent / "link.stl").symlink_to("blob")
    assert found(file, "link.stl") == file.parent / "link.stl"


def test_a_name_means_nothing_but_a_file(file):
    for name in ("meshes/<script>.stl", "a\nb.stl", "$(rm).stl", "\x1b[31m.stl"):
        assert "script" not in left_out(file, name) or "<script>" in name
    (file.parent / "ä #1.stl").write_bytes(meshes.stl())
    assert found(file, "ä #1.stl").name == "ä #1.stl"


@pytest.mark.parametrize("name", ["Demo_Description_Repo/urdf", "demo_description/urdf", "."])
def test_the_meshes_of_the_cases_are_found_by_the_name_in_package_xml(name):
    file = CASES / name / "mesh_in_package.urdf"
    assert found(file, "package://demo_description/meshes/a.stl").name == "a.stl"


# -- files that cannot be shown ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", meshes.WRITTEN)
def test_a_mesh_in_every_format_is_shown_as_it_is(name, file):
    (file.parent / name).write_bytes(meshes.written(name))
    assert found(file, name) == file.parent / name


@pytest.mark.parametrize("name", meshes.WRITTEN)
def test_a_mesh_that_is_cut_short_is_left_out(name, file):
    whole = meshes.written(name)
    for end in (0, 10, len(whole) // 2, len(whole) - 12):
        (file.parent / name).write_bytes(whole[:end])
        left_out(file, name)


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", meshes.WRITTEN)
def test_a_mesh_with_corners_that_are_not_finite_is_left_out(name, number, file):
    corners = meshes.TRIANGLE.copy()
    corners[1, 2] = number
    (file.parent / name).write_bytes(meshes.written(name, corners))
    assert "not finite" in left_out(file, name)


@pytest.mark.parametrize("name", [*meshes.WRITTEN, "a.gltf"])
def test_a_pointer_of_git_lfs_is_left_out_with_what_to_do(name, file):
    (file.parent / name).write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    assert "git lfs pull" in left_out(file, name)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("none.stl", "no such file"),
        ("x" * 300 + ".stl", "too long"),
        ("a\0.stl", ""),
        (".", "not a regular file"),
        ("pipe.stl", "not a regular file"),
        ("round.stl", ""),
        ("format.step", "expected one of the formats"),
        ("format", "expected one of the formats"),
    ],
)
def test_a_name_that_is_no_mesh_file_is_left_out(name, words, file):
    os.mkfifo(file.parent / "pipe.stl")
    (file.parent / "round.stl").symlink_to("round.stl")
    for other in ("format.step", "format"):
        (file.parent / other).write_bytes(meshes.stl())
    assert words in left_out(file, name)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_mesh_that_may_not_be_read_is_left_out(file):
    (file.parent / "a.stl").write_bytes(meshes.stl())
    (file.parent / "a.stl").chmod(0)
    assert "ermission" in left_out(file, "a.stl")


BALLOON = "<library_nodes>{}</library_nodes>".format(
    "".join(f'<node id="n{k}">' + f'<instance_node url="#n{k + 1}"/>' * 10 + "</node>" for k in range(9))
    + '<node id="n9"><instance_geometry url="#g"/></node>'
)
AT_THE_TOP = '<node><instance_node url="#n0"/></node>'
CIRCLE = '<library_nodes><node id="n0"><instance_node url="#n0"/></node></library_nodes>'
HUGE = [
    {"componentType": 5126, "count": 10**12, "type": "VEC3"},
    {"componentType": 5125, "count": 3, "type": "SCALAR"},
]
HOSTILE = {
    "doctype.dae": b'<!DOCTYPE c [<!ENTITY e SYSTEM "file:///etc/passwd">]>' + meshes.collada(),
    "utf16.dae": meshes.collada().decode().encode("utf-16"),
    "other.dae": b"<html/>",
    "deep.dae": b"<COLLADA>" + b"<a>" * 100_000 + b"</a>" * 100_000 + b"</COLLADA>",
    "empty.dae": meshes.collada(scene="<node/>"),
    "balloon.dae": meshes.collada(nodes=BALLOON, scene=AT_THE_TOP),
    "circle.dae": meshes.collada(nodes=CIRCLE, scene=AT_THE_TOP),
    "empty.obj": b"v 0 0 0\n",
    "empty.stl": meshes.stl(np.zeros((0, 3, 3))),
    "trailing.stl": meshes.stl() + b"x",
    "noise.stl": bytes(range(256)),
    "noise.glb": b"glTF" + bytes(range(256)),
    "list.gltf": b"[]",
    "deep.gltf": b"[" * 100_000,
    "empty.gltf": b"{}",
    "draco.glb": meshes.glb(extensionsRequired=["KHR_draco_mesh_compression"]),
    "circle.glb": meshes.glb(nodes=[{"mesh": 0, "children": [0]}]),
    "parents.glb": meshes.glb(nodes=[{"children": [1, 1]}, {"mesh": 0}]),
    "far.glb": meshes.glb(nodes=[{"children": [5]}, {"mesh": 0}]),
    "huge.glb": meshes.glb(accessors=HUGE),
    "past.glb": meshes.glb(bufferViews=[{"buffer": 0, "byteOffset": 10**6, "byteLength": 36}] * 2),
    "many.glb": meshes.glb(nodes=[{"mesh": 0}] * 10_000),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_mesh_is_left_out(name, file):
    (file.parent / name).write_bytes(HOSTILE[name])
    left_out(file, name)


@pytest.mark.parametrize("name", ["a.stl", "text.stl", "a.obj", "a.dae", "a.glb"])
def test_a_mesh_of_too_many_triangles_is_left_out_before_anybody_builds_them(name, file, monkeypatch):
    (file.parent / name).write_bytes(meshes.written(name))
    monkeypatch.setattr(mesh_files, "MAX_TRIANGLES", 0)
    assert "triangles, found" in left_out(file, name)


def test_a_mesh_of_too_many_bytes_is_left_out_without_reading_it_whole(file):
    with (file.parent / "big.stl").open("wb") as stream:
        stream.write(bytes(80) + (4_000_000).to_bytes(4, "little"))
        stream.truncate(199_000_084)
    assert "expected at most 64 MB" in left_out(file, "big.stl")


@pytest.mark.parametrize("name", ["ball.stl", "ball.obj", "ball.dae", "ball.glb"])
def test_triangles_are_counted_as_trimesh_builds_them(name, tmp_path):
    solid = meshes.ball(tmp_path / name)
    counted = mesh_files.FORMATS[tmp_path.joinpath(name).suffix](tmp_path.joinpath(name).read_bytes())
    assert counted == len(solid.faces)


@given(st.data())
def test_a_mesh_that_was_damaged_is_shown_or_left_out(data):
    """Bytes are changed at random, or cut out, or put in twice."""
    name = data.draw(st.sampled_from(sorted(meshes.WRITTEN)))
    content = bytearray(meshes.written(name))
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content) - 1))
        end = data.draw(st.integers(start, min(len(content), start + 40)))
        content[start:end] = data.draw(st.sampled_from([b"", b"9", b"-", bytes(content[start:end]) * 2]))
    with TemporaryDirectory() as folder:
        file = Path(folder, name)
        file.write_bytes(content)
        with suppress(Unusable):
            mesh_files.check_mesh(file)
        with suppress(Unusable):
            assert read_mesh(file)


# -- whole robots ------------------------------------------------------------------------------------------


def test_a_robot_is_loaded_without_the_mesh_that_cannot_be_shown_and_says_so(tmp_path):
    file = write(tmp_path, GOOD)
    (tmp_path / "meshes" / "fore.stl").write_text("version https://git-lfs.github.com/spec/v1\n")
    with pytest.warns(
        RobotWarning, match=r"left out \(1\): line 30: link 'fore', visual: .*Git-LFS"
    ) as caught:
        description = read_urdf(file)
    assert len(caught) == 1
    assert [shape.filename for shape in description.document.hidden] == ["meshes/fore.stl"]
    assert len(description.visual.geometryObjects) == 3
    with refused(RobotError, "link 'fore', visual", file=str(file), line=30):
        read_urdf(file, strict=True)


@pytest.mark.parametrize(
    ("old", "new", "lost"),
    [
        ('scale="1 1 1"', 'scale="1 0 1"', "fore"),
        ('scale="1 1 1"', 'scale="1 a 1"', "fore"),
        ('filename="meshes/fore.stl" ', "", "fore"),
        ('<box size="0.4 0.06 0.05"/>', '<box size="0 0 0"/>', "upper"),
        ('<capsule radius="0.03" length="0.4"/>', '<capsule radius="0" length="0.4"/>', "upper"),
        ('<sphere radius="0.04"/>', '<sphere radius="-1"/>', "slide"),
        ('<sphere radius="0.04"/>', '<sphere radius="nan"/>', "slide"),
        ('<sphere radius="0.04"/>', "", "slide"),
        ('<sphere radius="0.04"/>', '<sphere radius="0.04"/><sphere radius="0.04"/>', "slide"),
        ('<sphere radius="0.04"/>', '<cone radius="0.04"/>', "slide"),
        ('xyz="0 0 0.05" rpy="0 0 0"', 'xyz="0 0 inf"', "base"),
        ('rgba="0.9 0.5 0.1 1"', 'rgba="255 128 0 1"', "fore"),
    ],
)
def test_a_shape_or_colour_that_is_none_never_costs_the_robot(old, new, lost, tmp_path):
    assert GOOD.count(old) == 1
    file = write(tmp_path, GOOD.replace(old, new))
    with pytest.warns(RobotWarning):
        description = read_urdf(file)
    assert {note.kind for note in description.report} == {"left out"}
    assert all(f"link '{lost}'" in note.where for note in description.report)
    assert description.model == read_urdf(write(tmp_path / "good", GOOD)).model


@pytest.mark.parametrize("depth", ["", "material"])
def test_a_texture_of_a_material_is_seen_wherever_the_material_stands(depth, tmp_path):
    picture(tmp_path / "t.png", (255, 0, 0))
    textured = '<material name="grey"><texture filename="t.png"/></material>'
    text = (
        GOOD.replace('<material name="grey"/>', textured)
        if depth
        else GOOD.replace('<material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>', textured)
    )
    base = read_urdf(write(tmp_path, text)).visual.geometryObjects[0]
    np.testing.assert_allclose(base.meshColor, [1, 0, 0, 1])


# -- textures of the description ---------------------------------------------------------------------------


def picture(path: Path, *colors: tuple[int, int, int]) -> Path:
    """A picture with a stripe of each colour."""
    from PIL import Image

    image = Image.new("RGB", (len(colors), 2))
    for k, color in enumerate(colors):
        for row in range(2):
            image.putpixel((k, row), color)
    image.save(path)
    return path


@pytest.mark.parametrize("name", ["a.png", "a.bmp"])
def test_a_texture_is_shown_as_its_mean_colour(name, file):
    picture(file.parent / name, (255, 0, 0), (0, 0, 255), (0, 255, 0), (0, 0, 255))
    visual, notes = looked_for(file, "", texture=name)
    np.testing.assert_allclose(visual.color, (0.25, 0.25, 0.5, 1), atol=1 / 255)
    assert not notes.collected


@pytest.mark.parametrize(
    "name", ["none.png", "pipe.png", "noise.png", "cut.png", "../../outside.png", "a.eps"]
)
def test_a_texture_that_cannot_be_shown_is_left_out(name, file, tmp_path):
    os.mkfifo(file.parent / "pipe.png")
    (file.parent / "noise.png").write_bytes(bytes(range(256)))
    (file.parent / "a.eps").write_text("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 1 1\n%%EndComments\n")
    whole = picture(tmp_path / "outside.png", (255, 0, 0)).read_bytes()
    (file.parent / "cut.png").write_bytes(whole[: len(whole) // 2])
    visual, notes = looked_for(file, "", texture=name)
    (note,) = notes.collected
    assert visual.color is None and re.search(rf"texture .*{re.escape(name)}", note.text)


def test_a_picture_of_too_many_pixels_is_not_unpacked(file):
    from PIL import Image

    Image.new("1", (9000, 9000)).save(file.parent / "big.png")
    assert (file.parent / "big.png").stat().st_size < 1e6
    _, notes = looked_for(file, "", texture="big.png")
    assert "million pixels" in notes.collected[0].text
    assert json.dumps(notes.collected[0].text)
