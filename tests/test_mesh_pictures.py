"""Meshes as they are drawn: in metres, in their place, in their colours; files that they name are safe."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import coal
import meshes
import numpy as np
import pinocchio as pin
import pytest
import trimesh
import yourdfpy
from PIL import Image
from sliders import GANTRY, pair, urdf

from synctrl import load_robot
from synctrl.errors import RobotWarning
from synctrl.robots.catalog import load_description
from synctrl.robots.urdf import Description
from synctrl.robots.urdf.packages import Unusable
from synctrl.show import scene_of
from synctrl.show.meshes import MeshLibrary, read_mesh
from synctrl.show.shapes import Solid, corners


def drawn(file: Path, content: bytes) -> list[tuple[Solid, tuple[float, ...] | None]]:
    file.write_bytes(content)
    return read_mesh(file)


def box(shapes: list[Solid]) -> np.ndarray:
    """Lowest and highest corner of shapes, (2, 3), m."""
    points = np.vstack([corners(shape) for shape in shapes])
    return np.array([points.min(axis=0), points.max(axis=0)])


def triangles(shapes: list[Solid]) -> int:
    return sum(len(shape.geometry["data"]["index"]["array"]) for shape in shapes if "data" in shape.geometry)


def color(file: Path, content: bytes) -> np.ndarray | None:
    """The one colour of a mesh."""
    ((_, found),) = drawn(file, content)
    return None if found is None else np.array(found)


# -- places and sizes --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", meshes.WRITTEN)
def test_a_mesh_in_every_format_is_drawn_where_its_corners_are(name, tmp_path):
    ((shape, _),) = drawn(tmp_path / name, meshes.written(name))
    np.testing.assert_allclose(box([shape]), [[0, 0, 0], [1, 2, 3]])
    assert triangles([shape]) == 1


@pytest.mark.parametrize("name", ["ball.stl", "ball.obj", "ball.dae", "ball.glb"])
def test_triangles_and_bounds_are_those_that_trimesh_wrote(name, tmp_path):
    solid = meshes.ball(tmp_path / name)
    shapes = [shape for shape, _ in read_mesh(tmp_path / name)]
    assert triangles(shapes) == len(solid.faces)
    np.testing.assert_allclose(box(shapes), solid.bounds, atol=1e-6)


@pytest.mark.parametrize("meter", [1, 0.01, 0.0254])
def test_a_collada_file_is_drawn_in_metres(meter, tmp_path):
    scene = f"<node><translate>0 0 5</translate>{meshes.SHAPE}</node>"
    content = meshes.collada(unit=f'<unit meter="{meter}" name="x"/>', scene=scene)
    ((shape, _),) = drawn(tmp_path / "a.dae", content)
    np.testing.assert_allclose(box([shape]), meter * np.array([[0, 0, 5], [1, 2, 8]]), rtol=1e-6)


@pytest.mark.parametrize("axis", ["X_UP", "Y_UP", "Z_UP"])
def test_the_axis_that_a_collada_file_calls_up_plays_no_part_here_or_in_pinocchio(axis, tmp_path):
    ((shape, _),) = drawn(tmp_path / "a.dae", meshes.collada(unit=f"<up_axis>{axis}</up_axis>"))
    theirs = coal.MeshLoader().load(str(tmp_path / "a.dae"), np.ones(3)).vertices()
    np.testing.assert_allclose(box([shape]), [theirs.min(axis=0), theirs.max(axis=0)])


def test_empty_lines_before_a_collada_file_do_no_harm(tmp_path):
    ((shape, _),) = drawn(tmp_path / "a.dae", b" \n\n" + meshes.collada())
    np.testing.assert_allclose(box([shape]), [[0, 0, 0], [1, 2, 3]])


def test_nodes_within_nodes_draw_a_shape_as_often_as_they_say(tmp_path):
    nodes = f"<library_nodes><node id='a'>{2 * meshes.SHAPE}</node></library_nodes>"
    scene = '<node><instance_node url="#a"/><instance_node url="#a"/></node>'
    shapes = [shape for shape, _ in drawn(tmp_path / "a.dae", meshes.collada(nodes=nodes, scene=scene))]
    assert triangles(shapes) == 4


def test_a_scale_stretches_and_mirrors_a_mesh_about_its_origin(tmp_path):
    (tmp_path / "a.stl").write_bytes(meshes.stl())
    scale, place = np.array([-2.0, 0.5, 1.0]), pin.SE3.Random()
    visual = pin.GeometryObject("a", 0, 0, place, coal.BVHModelOBBRSS(), str(tmp_path / "a.stl"), scale)
    (shape,) = MeshLibrary().shapes(visual)
    expected = np.array([place.act(scale * corner) for corner in meshes.TRIANGLE])
    vertices = shape.geometry["data"]["attributes"]["position"]["array"]
    found = vertices @ shape.matrix[:3, :3].T + shape.matrix[:3, 3]
    np.testing.assert_allclose(np.sort(found, axis=0), np.sort(expected, axis=0), atol=1e-6)


def test_corners_that_are_nowhere_are_refused_wherever_a_format_hides_them(tmp_path):
    for number in (np.nan, 1e30):
        place = meshes.glb(nodes=[{"mesh": 0, "translation": [0, number, 0]}])
        with pytest.raises(Unusable):
            drawn(tmp_path / "a.glb", place)


# -- colours -----------------------------------------------------------------------------------------------


def striped(*colors: tuple[int, int, int]) -> Image.Image:
    image = Image.new("RGB", (len(colors), 1))
    image.putdata(list(colors))
    return image


@pytest.fixture
def folder(tmp_path) -> Path:
    """The folder of meshes in a package, with textures beside it and a picture outside."""
    (tmp_path / "arm" / "meshes").mkdir(parents=True)
    (tmp_path / "arm" / "textures").mkdir()
    (tmp_path / "arm" / "package.xml").write_text("<package><name>arm</name></package>")
    striped((255, 0, 0), (0, 0, 255)).save(tmp_path / "arm" / "textures" / "t.png")
    striped((0, 255, 0)).save(tmp_path / "outside.png")
    os.mkfifo(tmp_path / "arm" / "meshes" / "pipe.png")
    os.mkfifo(tmp_path / "arm" / "meshes" / "pipe.mtl")
    return tmp_path / "arm" / "meshes"


def test_a_textured_mesh_has_the_mean_colour_of_its_texture(folder):
    purple = [0.5, 0, 0.5, 1]
    found = color(folder / "a.dae", meshes.collada(texture="../textures/t.png"))
    np.testing.assert_allclose(found, purple, atol=1 / 255)
    (folder / "m.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd ../textures/t.png\n")
    found = color(folder / "a.obj", meshes.obj(library="m.mtl"))
    np.testing.assert_allclose(found, purple, atol=1 / 255)


def test_a_material_library_colours_a_mesh(folder):
    (folder / "m.mtl").write_text("newmtl m\nKd 0.2 0.4 0.6\n")
    found = color(folder / "a.obj", meshes.obj(library="m.mtl"))
    np.testing.assert_allclose(found, [0.2, 0.4, 0.6, 1], atol=1 / 255)


def test_a_glb_has_the_colour_of_its_material(folder):
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, "material": 0}
    material = {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1]}}
    content = meshes.glb(meshes=[{"primitives": [primitive]}], materials=[material])
    np.testing.assert_allclose(color(folder / "a.glb", content), [0.2, 0.4, 0.6, 1], atol=1 / 255)


def test_a_part_has_the_mean_of_the_colours_of_its_corners(folder):
    solid = trimesh.creation.box()
    solid.visual.vertex_colors = [[255, 0, 0, 255]] * 4 + [[0, 0, 255, 255]] * 4
    solid.export(folder / "a.glb")
    ((_, found),) = read_mesh(folder / "a.glb")
    np.testing.assert_allclose(found, [0.5, 0, 0.5, 1], atol=1 / 255)


@pytest.mark.parametrize(
    "name",
    ["../../outside.png", "pipe.png", "none.png", "/etc/passwd", "file:///etc/passwd", "link.png", "\0"],
)
def test_a_texture_outside_or_in_a_pipe_is_not_opened_and_the_mesh_is_shown_without_it(name, folder):
    (folder / "link.png").symlink_to("../../outside.png")
    green = np.array([0, 1, 0, 1])
    contents = {"a.obj": meshes.obj(library="m.mtl")}
    if name.isprintable():
        contents["a.dae"] = meshes.collada(texture=name)
    (folder / "m.mtl").write_text(f"newmtl m\nKd 1 0 0\nmap_Kd {name}\n")
    for mesh, content in contents.items():
        found = color(folder / mesh, content)
        assert found is not None and not np.allclose(found, green)


@pytest.mark.parametrize("name", ["pipe.mtl", "../../outside.mtl", "/etc/passwd", "none.mtl", "link.mtl"])
def test_a_material_library_outside_or_in_a_pipe_is_not_opened(name, folder):
    (folder.parents[1] / "outside.mtl").write_text("newmtl m\nKd 0 1 0\n")
    (folder / "link.mtl").symlink_to("../../outside.mtl")
    found = color(folder / "a.obj", meshes.obj(library=name))
    assert found is None or not np.allclose(found, [0, 1, 0, 1])


def test_a_gltf_file_opens_its_numbers_in_its_package_only(folder):
    glb = meshes.glb()
    size = int.from_bytes(glb[12:16], "little")
    header, numbers = glb[20 : 20 + size], glb[28 + size :]
    named = header.replace(b'{"byteLength": 48}', b'{"byteLength": 48, "uri": "%s"}')
    (folder / "numbers.bin").write_bytes(numbers)
    (folder.parents[1] / "outside.bin").write_bytes(numbers)
    assert len(drawn(folder / "a.gltf", named % b"numbers.bin")) == 1
    for name in (b"../../outside.bin", b"pipe.png", b"/etc/passwd", b"none.bin"):
        with pytest.raises(Unusable):
            drawn(folder / "a.gltf", named % name)


def test_the_scene_of_a_run_says_which_pictures_are_missing(tmp_path):
    mesh = '<visual><geometry><mesh filename="package://none/meshes/gone.stl"/></geometry></visual>'
    text = urdf("arm", GANTRY).replace('<link name="link1">', f'<link name="link1">{mesh}')
    file = tmp_path / "arm.urdf"
    file.write_text(text)
    with pytest.warns(RobotWarning, match="gone.stl"):
        robot = load_robot(file)
    page = scene_of(pair((robot, robot)).simulate(dt=5e-3)).page()
    assert page.count(": gone.stl</p>") == 2


# -- a second opinion --------------------------------------------------------------------------------------


def theirs(description: Description) -> Iterator[tuple[pin.GeometryObject, trimesh.Scene]]:
    """The meshes of an arm, each with what yourdfpy reads in its file, scaled as the description says."""
    for visual in description.visual.geometryObjects:
        if visual.meshPath:
            mesh = yourdfpy.urdf.Mesh(filename=visual.meshPath, scale=visual.meshScale)
            shape = yourdfpy.urdf.Visual(name="a", geometry=yourdfpy.urdf.Geometry(mesh=mesh))
            robot = yourdfpy.urdf.Robot(name="a", links=[yourdfpy.urdf.Link(name="a", visuals=[shape])])
            yield visual, yourdfpy.URDF(robot, filename_handler=lambda fname: fname).scene


@pytest.mark.parametrize("name", ["ur5", "xarm7", "so100", "talos_arm", "kinova"])
def test_an_arm_of_the_catalogue_is_drawn_as_yourdfpy_reads_it(name):
    library = MeshLibrary()
    for visual, scene in theirs(load_description(name)):
        shapes = library.shapes(visual)
        assert triangles(shapes) == sum(len(part.faces) for part in scene.geometry.values())
        place = visual.placement.homogeneous
        shapes = [replace(shape, matrix=np.linalg.inv(place) @ shape.matrix) for shape in shapes]
        np.testing.assert_allclose(box(shapes), scene.bounds, atol=1e-6)
    assert library._files and not library.faults
