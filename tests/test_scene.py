"""The recorder: what a page holds is what Pinocchio says, and what a user writes stays text."""

from __future__ import annotations

import base64
import gzip
import html
import importlib.metadata
import json
import re
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import umsgpack
from browser import open_page
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from refusals import refused

from synctrl.errors import InputError, RobotError, RobotWarning
from synctrl.show import shapes, shown, view
from synctrl.show.nodes import continuous, towards
from synctrl.show.scene import Scene
from synctrl.tasks.rotations import from_quaternion as matrices

ROOT = Path(__file__).resolve().parent.parent
SHARE = Path(str(importlib.metadata.distribution("example-robot-data").locate_file("cmeel.prefix/share")))
DATA = SHARE / "example-robot-data" / "robots"
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&<!--"

FRAMES = 12


# -- robots to draw --------------------------------------------------------------------------------


def load(path: Path) -> tuple[pin.Model, pin.GeometryModel]:
    model = pin.buildModelFromUrdf(str(path))
    return model, pin.buildGeomFromUrdf(model, str(path), pin.GeometryType.VISUAL, package_dirs=[str(SHARE)])


def planar() -> tuple[pin.Model, pin.GeometryModel]:
    return load(ROOT / "robots" / "planar2r" / "planar2r.urdf")


def a460() -> tuple[pin.Model, pin.GeometryModel]:
    return load(ROOT / "robots" / "a460" / "a460.urdf")


def ur5() -> tuple[pin.Model, pin.GeometryModel]:
    return load(DATA / "ur_description" / "urdf" / "ur5_robot.urdf")


def shape_bench() -> tuple[pin.Model, pin.GeometryModel]:
    """One joint that carries every kind of shape, each placed at random; one mesh is mirrored."""
    import coal

    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Random(), "joint")
    mesh = DATA / "xarm_description" / "meshes" / "xarm7" / "visual" / "link1.stl"
    mirrored = np.array([1.0, -2.0, 1.5])
    solids = {
        "box": coal.Box(0.1, 0.2, 0.3),
        "sphere": coal.Sphere(0.1),
        "ellipsoid": coal.Ellipsoid(0.1, 0.2, 0.3),
        "cylinder": coal.Cylinder(0.1, 0.5),
        "cone": coal.Cone(0.1, 0.4),
        "capsule": coal.Capsule(0.1, 0.3),
        "mesh": coal.MeshLoader().load(str(mesh), mirrored),
    }
    visual = pin.GeometryModel()
    for name, solid in solids.items():
        path, scale = (str(mesh), mirrored) if name == "mesh" else ("", np.ones(3))
        visual.addGeometryObject(
            pin.GeometryObject(name, joint, 0, pin.SE3.Random(), solid, path, scale, True, np.full(4, 1.0))
        )
    return model, visual


def motion(model: pin.Model, frames: int = FRAMES, seed: int = 0) -> np.ndarray:
    start = np.random.default_rng(seed).uniform(-1, 1, model.nv)
    steps = np.linspace(0, 1.5, frames)[:, None] * np.random.default_rng(seed + 1).uniform(-1, 1, model.nv)
    return np.array([pin.integrate(model, pin.neutral(model), v) for v in start + steps])


# -- reading a page back, with the rules of three.js -----------------------------------------------


class Elements(HTMLParser):
    """All elements of a page, with what stands in the scripts."""

    def __init__(self, text: str):
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data: str) -> None:
        if self.scripts and self.cdata_elem == "script":
            self.scripts[-1] += data
        else:
            self.text += data


def payload(page: str) -> list[bytes]:
    packed = re.search(r'class="commands">([^<]*)<', page)
    assert packed is not None
    return [base64.b64decode(line) for line in packed[1].split()]


def decode(page: str) -> dict[str, list[dict[str, Any]]]:
    """The embedded commands by their type."""
    types = {0x14: np.uint16, 0x16: np.uint32, 0x17: np.float32}
    handlers = {code: (lambda ext, t=kind: np.frombuffer(ext.data, t)) for code, kind in types.items()}
    commands: dict[str, list[dict[str, Any]]] = {}
    for line in payload(page):
        command = umsgpack.unpackb(gzip.decompress(line), ext_handlers=handlers)
        commands.setdefault(command["type"], []).append(command)
    return commands


class Drawn:
    """The decoded scene: where everything is at a frame."""

    def __init__(self, scene: Scene):
        commands = decode(scene.page())
        objects = {command["path"]: command["object"] for command in commands["set_object"]}
        self.scene = objects["/meshcat"]
        self.root = self.scene["object"]
        self.animations = commands.get("set_animation", [])
        clips = [entry["clip"] for command in self.animations for entry in command["animations"]]
        self.tracks = {track["name"]: track for clip in clips for track in clip["tracks"]}
        self.geometries = {g["uuid"]: g for g in self.scene["geometries"]}
        self.materials = {m["uuid"]: m for m in self.scene["materials"]}

    def value(self, name: str, frame: int) -> np.ndarray | None:
        if name not in self.tracks:
            return None
        times, values = self.tracks[name]["times"], self.tracks[name]["values"]
        np.testing.assert_array_equal(times, np.arange(len(times)))
        return values.reshape(len(times), -1)[frame]

    def pose(self, node: dict[str, Any], frame: int) -> np.ndarray:
        """The node's matrix: its tracks where it has them, its own matrix where not."""
        matrix = np.array(node["matrix"]).reshape(4, 4).T.copy()
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        rotation = matrix[:3, :3] / scale
        position = self.value(f"{node['uuid']}.position", frame)
        quaternion = self.value(f"{node['uuid']}.quaternion", frame)
        stretch = self.value(f"{node['uuid']}.scale", frame)
        if quaternion is not None:
            rotation = pin.Quaternion(*np.roll(quaternion.astype(float), 1)).matrix()
        matrix[:3, :3] = rotation * (scale if stretch is None else stretch)
        if position is not None:
            matrix[:3, 3] = position
        return matrix

    def meshes(self, frame: int) -> list[tuple[dict[str, Any], np.ndarray]]:
        """Every mesh with its matrix in the world."""
        found: list[tuple[dict[str, Any], np.ndarray]] = []

        def walk(node: dict[str, Any], parent: np.ndarray) -> None:
            world = parent @ (self.pose(node, frame) if "matrix" in node else np.eye(4))
            if node["type"] == "Mesh":
                found.append((node, world))
            for child in node.get("children", []):
                walk(child, world)

        walk(self.root, np.eye(4))
        return found

    def triangles(self, mesh: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        data = self.geometries[mesh["geometry"]]["data"]
        return data["attributes"]["position"]["array"].reshape(-1, 3), data["index"]["array"].reshape(-1, 3)

    def bounds(self, mesh: dict[str, Any]) -> np.ndarray:
        """Extent of a geometry before its matrix, from what three.js documents of each type."""
        geometry = self.geometries[mesh["geometry"]]
        match geometry["type"]:
            case "BoxGeometry":
                half = np.array([geometry["width"], geometry["height"], geometry["depth"]]) / 2
            case "SphereGeometry":
                half = np.full(3, geometry["radius"])
            case "CylinderGeometry":
                radius = max(geometry["radiusTop"], geometry["radiusBottom"])
                half = np.array([radius, geometry["height"] / 2, radius])
            case "LatheGeometry":
                x, y = np.array([[p["x"], p["y"]] for p in geometry["points"]]).T
                return np.array([[-x.max(), y.min(), -x.max()], [x.max(), y.max(), x.max()]])
            case _:
                vertices, _ = self.triangles(mesh)
                return np.array([vertices.min(axis=0), vertices.max(axis=0)])
        return np.array([-half, half])


def box_corners(bounds: np.ndarray) -> np.ndarray:
    return np.array(np.meshgrid(*bounds.T)).reshape(3, 8).T


def sorted_rows(points: np.ndarray) -> np.ndarray:
    return points[np.lexsort(np.round(points, 4).T)]


def transform(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ matrix[:3, :3].T + matrix[:3, 3]


# -- robots are where Pinocchio says, and whole ----------------------------------------------------


@pytest.mark.parametrize("robot", [planar, a460, shape_bench], ids=lambda robot: robot.__name__)
def test_every_visual_is_where_pinocchio_puts_it_at_every_frame(robot: Any) -> None:
    pin.seed(1)
    model, visual = robot()
    q = motion(model)
    scene = Scene()
    scene.add_robot("robot", model, visual, q)
    drawn = Drawn(scene)
    order = sorted(range(visual.ngeoms), key=lambda k: visual.geometryObjects[k].parentJoint)
    data, placed = model.createData(), visual.createData()
    for frame in range(FRAMES):
        pin.updateGeometryPlacements(model, data, visual, placed, q[frame])
        meshes = drawn.meshes(frame)
        assert len(meshes) == visual.ngeoms
        for (mesh, world), k in zip(meshes, order, strict=True):
            solid = visual.geometryObjects[k].geometry
            solid.computeLocalAABB()
            extent = np.array([solid.aabb_local.min_, solid.aabb_local.max_])
            expected = transform(placed.oMg[k].homogeneous, box_corners(extent))
            found = transform(world, box_corners(drawn.bounds(mesh)))
            np.testing.assert_allclose(sorted_rows(found), sorted_rows(expected), atol=2e-6)


def test_the_ur5_is_drawn_whole_in_the_colours_of_its_files() -> None:
    model, visual = ur5()
    scene = Scene()
    scene.add_robot("ur5", model, visual, pin.neutral(model))
    drawn = Drawn(scene)
    links = {link["name"]: link["children"] for link in drawn.root["children"][0]["children"]}
    stated_colors = set()
    for solid in visual.geometryObjects:
        document = Path(solid.meshPath).read_text(encoding="utf-8")
        vertices = [drawn.triangles(mesh) for mesh in links[f"joint {model.names[solid.parentJoint]}"]]
        stated = sum(map(int, re.findall(r'<triangles[^>]* count="(\d+)"', document)))
        assert sum(len(faces) for _, faces in vertices) == stated
        extent = np.vstack([v for v, _ in vertices])
        expected = solid.geometry.vertices()
        np.testing.assert_allclose(extent.min(axis=0), expected.min(axis=0), atol=1e-6)
        np.testing.assert_allclose(extent.max(axis=0), expected.max(axis=0), atol=1e-6)
        for rgba in re.findall(r"<diffuse>\s*<color[^>]*>([^<]*)<", document):
            r, g, b = (round(255 * float(c)) for c in rgba.split()[:3])
            stated_colors.add(r << 16 | g << 8 | b)
    assert {m["color"] for m in drawn.materials.values()} == stated_colors


def test_equal_meshes_of_two_robots_are_in_the_file_once() -> None:
    model, visual = ur5()
    sizes = []
    for count in (1, 2):
        scene = Scene()
        for k in range(count):
            scene.add_robot(f"ur5 {k}", model, visual, motion(model, seed=k))
        drawn = Drawn(scene)
        sizes.append((len(drawn.geometries), len(drawn.materials)))
    assert sizes[0] == sizes[1]


def test_one_colour_for_a_robot_replaces_those_of_its_shapes() -> None:
    model, visual = planar()
    scene = Scene()
    scene.add_robot("robot", model, visual, pin.neutral(model), color="#20406080")
    (material,) = Drawn(scene).materials.values()
    assert material["color"] == 0x204060
    assert material["opacity"] == pytest.approx(0x80 / 255)
    assert material["transparent"]


def test_a_mesh_that_cannot_be_read_is_left_out_and_the_page_says_so(tmp_path: Path) -> None:
    (tmp_path / "broken <b>.dae").write_text("<COLLADA", encoding="utf-8")
    model, visual = planar()
    for solid in visual.geometryObjects:
        solid.meshPath = str(tmp_path / "broken <b>.dae")
    scene = Scene()
    with pytest.warns(RobotWarning, match=r"mesh .*broken <b>.dae is not shown: .*COLLADA") as caught:
        scene.add_robot("arm", model, visual, pin.neutral(model))
    assert len(caught) == 1
    assert not Drawn(scene).meshes(0)
    assert "Not shown of arm: broken &lt;b&gt;.dae</p>" in scene.page()


def test_a_page_says_which_meshes_are_missing_but_not_all_of_many() -> None:
    scene = Scene()
    scene.add_hidden("arm", [])
    assert "Not shown" not in scene.page()
    scene.add_hidden("arm", ["a.stl", "a.stl", HOSTILE, "c.stl", "d.stl", "e.stl"])
    page = scene.page()
    assert Elements(page).text.count("Not shown of arm: a.stl") == 1
    assert "and 2 more" in page and "<img" not in page and "d.stl" not in page


def test_a_mesh_built_in_memory_is_drawn() -> None:
    model, visual = shape_bench()
    mesh = next(g for g in visual.geometryObjects if g.name == "mesh")
    mesh.meshPath = ""
    scene = Scene()
    scene.add_robot("robot", model, visual, pin.neutral(model))
    faces = [len(Drawn(scene).triangles(m)[1]) for m, _ in Drawn(scene).meshes(0)[-1:]]
    assert faces == [mesh.geometry.num_tris]


def test_a_shape_without_bounds_is_refused_by_name() -> None:
    import coal

    model, visual = planar()
    plane = coal.Halfspace(np.array([0.0, 0, 1]), 0.0)
    visual.addGeometryObject(pin.GeometryObject("floor", 0, 0, pin.SE3.Identity(), plane))
    with refused(RobotError, "visual 'floor'", found="Halfspace"):
        Scene().add_robot("robot", model, visual, pin.neutral(model))


# -- tracks ----------------------------------------------------------------------------------------


def test_what_stands_still_has_no_tracks() -> None:
    model, visual = planar()
    q = motion(model)
    q[:, 0] = q[0, 0]  # only the second joint moves
    scene = Scene(fps=10)
    scene.add_robot("still", model, visual, np.repeat(q[:1], FRAMES, axis=0))
    scene.add_sphere("ball", 0.1, np.zeros((FRAMES, 3)), "#ff0000")
    assert Drawn(scene).animations == []
    scene.add_robot("moving", model, visual, q)
    drawn = Drawn(scene)
    assert {name.partition(".")[2] for name in drawn.tracks} == {"quaternion"}
    assert len(drawn.tracks) == 1


def test_the_animation_plays_by_itself_and_for_ever() -> None:
    scene = Scene(fps=25)
    scene.add_sphere("ball", 0.1, np.eye(3), "#ff0000")
    (animation,) = Drawn(scene).animations
    assert animation["options"] == {"play": True, "repetitions": np.inf}
    assert animation["animations"][0]["clip"]["fps"] == 25


def test_a_segment_ends_at_its_two_points_at_every_frame() -> None:
    random = np.random.default_rng(3)
    start, end = random.normal(size=(2, FRAMES, 3))
    end[0] = start[0] - [0, 0, 1]  # straight down: the direction without a shortest turn from z
    radius = random.uniform(0.01, 0.1, FRAMES)
    scene = Scene()
    scene.add_segment("bar", start, end, radius, random.uniform(size=(FRAMES, 3)))
    drawn = Drawn(scene)
    for frame in range(FRAMES):
        ((_, world),) = drawn.meshes(frame)
        ends = transform(world, np.array([[0, -0.5, 0], [0, 0.5, 0]]))  # three.js: along y
        np.testing.assert_allclose(ends, [start[frame], end[frame]], atol=1e-5)
        assert np.linalg.norm(world[:3, 0]) == pytest.approx(radius[frame], rel=1e-4)


def test_a_mark_grows_and_changes_its_colour() -> None:
    radius, rgb = np.linspace(0, 0.3, FRAMES), np.random.default_rng(4).uniform(size=(FRAMES, 3))
    scene = Scene()
    scene.add_sphere("mark", radius, np.zeros(3), rgb)
    scene.add_sphere("other", 0.1, np.zeros(3), tuple(rgb[0]))
    drawn = Drawn(scene)
    (mark, _), (other, _) = drawn.meshes(0)
    assert mark["material"] != other["material"]  # or both would change
    for frame in range(FRAMES):
        assert drawn.meshes(frame)[0][1][0, 0] == pytest.approx(max(radius[frame], 1e-6), rel=1e-4)
        np.testing.assert_allclose(
            drawn.value(f"{mark['uuid']}.material.color", frame), rgb[frame], atol=1e-6
        )


def test_boxes_and_cylinders_follow_their_pose() -> None:
    random = np.random.default_rng(5)
    position, quaternion = random.normal(size=(FRAMES, 3)), random.normal(size=(FRAMES, 4))
    scene = Scene()
    scene.add_box("box", (0.1, 0.2, 0.3), position, "#ffffff", quaternion)
    scene.add_cylinder("can", 0.1, 0.5, position, "#ffffff", quaternion)
    drawn = Drawn(scene)
    for frame in range(FRAMES):
        rotation = pin.Quaternion(*np.roll(quaternion[frame], 1)).normalized().matrix()
        (_, box), (_, can) = drawn.meshes(frame)
        np.testing.assert_allclose(box[:3, :3], rotation * [0.1, 0.2, 0.3], atol=1e-6)
        np.testing.assert_allclose(can[:3, 1], 0.5 * rotation[:, 2], atol=1e-6)
        np.testing.assert_allclose([box[:3, 3], can[:3, 3]], [position[frame]] * 2, atol=1e-6)


unit_vectors = arrays(float, (5, 3), elements=st.floats(-1, 1)).filter(
    lambda a: bool((np.linalg.norm(a, axis=1) > 1e-3).all())
)


@given(unit_vectors)
def test_towards_turns_z_to_the_direction(along: np.ndarray) -> None:
    turned = matrices(towards(along))
    np.testing.assert_allclose(turned @ turned.transpose(0, 2, 1), np.tile(np.eye(3), (5, 1, 1)), atol=1e-6)
    np.testing.assert_allclose(
        turned[:, :, 2], along / np.linalg.norm(along, axis=1, keepdims=True), atol=1e-6
    )


@given(arrays(float, (6, 4), elements=st.floats(0.1, 1)), st.lists(st.booleans(), min_size=6, max_size=6))
def test_continuous_quaternions_are_the_same_rotations_without_jumps(q: np.ndarray, flip: list[bool]) -> None:
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    smooth = continuous(q * np.where(flip, -1.0, 1.0)[:, None])
    np.testing.assert_allclose(matrices(smooth), matrices(q), atol=1e-12)
    assert (np.sum(smooth[1:] * smooth[:-1], axis=1) >= 0).all()


# -- lines and camera ------------------------------------------------------------------------------


def distance_to_path(points: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Distance of each point to the nearest segment of a polyline."""
    a, along = path[:-1], np.diff(path, axis=0)
    share = np.einsum("psk,sk->ps", points[:, None] - a, along) / np.maximum((along**2).sum(axis=1), 1e-300)
    nearest = a + np.clip(share, 0, 1)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


@pytest.mark.parametrize(
    "path",
    [
        np.stack([np.cos(np.linspace(0, 6.28, 80)), np.sin(np.linspace(0, 6.28, 80)), np.zeros(80)], axis=1),
        np.outer(1 - np.exp(-np.linspace(0, 20, 300)), [1.0, 2, 0.5]),  # its end is a heap of near points
        np.array([[0, 0, 0], [0, 0, 1.0], [0, 0, 1.0], [0, 0, 0.2]]),  # waits and turns back
    ],
    ids=["circle", "approach", "back"],
)
def test_a_line_is_a_tube_about_its_points(path: np.ndarray) -> None:
    scene = Scene()
    scene.add_line("path", path, "#0000ff", width=0.02)
    drawn = Drawn(scene)
    ((mesh, _),) = drawn.meshes(0)
    vertices, faces = drawn.triangles(mesh)
    distance = distance_to_path(vertices.astype(float), path)
    assert np.isfinite(vertices).all()
    assert distance.max() < 0.0101
    assert distance.min() > 0.009
    assert faces.max() < len(vertices)
    assert np.linalg.norm(vertices[:, None] - path[[0, -1]], axis=2).min(axis=0).max() < 0.02


def test_a_line_that_stays_at_a_point_is_a_ball() -> None:
    scene = Scene()
    scene.add_line("hold", np.tile([1.0, 2, 3], (50, 1)), "#0000ff", width=0.02)
    drawn = Drawn(scene)
    ((mesh, world),) = drawn.meshes(0)
    np.testing.assert_allclose(transform(world, box_corners(drawn.bounds(mesh))).mean(axis=0), [1, 2, 3])


boxes = st.tuples(
    arrays(float, 3, elements=st.floats(-20, 20)), arrays(float, 3, elements=st.floats(1e-3, 20))
)


@given(boxes)
def test_the_camera_sees_the_whole_box(box: tuple[np.ndarray, np.ndarray]) -> None:
    low, extent = box
    position, target = view.fit_camera(np.array([low, low + extent]))
    back = (position - target) / np.linalg.norm(position - target)
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    offset = box_corners(np.array([low, low + extent])) - position
    depth = -offset @ back
    slope = np.tan(np.radians(view.FIELD_OF_VIEW / 2))
    assert (depth > 0).all()
    assert (np.abs(offset @ np.cross(back, right)) <= depth * slope).all()
    narrowest = view.narrowest(np.array([low, low + extent]), position, target)
    assert np.abs(offset @ right / depth).max() == pytest.approx(slope * narrowest)
    assert narrowest <= view.ASPECT


def test_the_camera_looks_at_everything_that_moves_at_any_time() -> None:
    scene = Scene()
    scene.add_sphere("ball", 0.5, [[0, 0, 0], [10, 0, 0], [0, 0, 4.0]], "#ff0000")
    np.testing.assert_allclose(scene.box(), [[-0.5, -0.5, -0.5], [10.5, 0.5, 4.5]])
    scene.camera((1, 2, 3), (0, 0, 1))
    page = scene.page()
    wanted = [c["value"] for c in decode(page)["set_property"] if c["property"] == "position"]
    assert wanted == [[1, 3, -2]]  # y up
    assert json.loads(re.search(r'data-target="([^"]*)"', page)[1]) == [0, 1, 0]


# -- the page --------------------------------------------------------------------------------------


def hostile_scene() -> Scene:
    model, visual = planar()
    scene = Scene(title=HOSTILE, caption=HOSTILE)
    for name in (HOSTILE, "constructor", "__proto__", "a/b", "", "\ud800", "<object>"):
        scene.add_robot(name, model, visual, motion(model, 40))
        scene.add_line(name, np.eye(3), "#ff0000")
    scene.add_legend(HOSTILE, (1, 0, 0))
    return scene


def test_names_and_titles_are_text_and_never_markup() -> None:
    elements = Elements(hostile_scene().page())
    plain = Elements(Scene(title="a", caption="b").page())
    legend = ["p", "span", "i"]
    assert sorted(tag for tag, _ in elements.tags) == sorted([tag for tag, _ in plain.tags] + legend)
    assert elements.scripts[0] == plain.scripts[0]
    assert elements.scripts[2:] == plain.scripts[2:]
    assert not any(name.startswith("on") for _, attributes in elements.tags for name in attributes)
    assert elements.text.count(HOSTILE) == 4  # title of the window, heading, caption, legend


def test_the_page_allows_its_own_scripts_and_no_request() -> None:
    elements = Elements(Scene().page())
    policy = next(a["content"] for tag, a in elements.tags if tag == "meta" and "http-equiv" in a)
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert set(rules) <= {
        "default-src",
        "script-src",
        "style-src",
        "img-src",
        "worker-src",
        "base-uri",
        "form-action",
    }
    assert not re.search(r"https?:|wss?:|\*", policy)
    assert "unsafe" not in rules["script-src"]
    assert not any({"src", "href"} & set(a) for tag, a in elements.tags if a.get("href") != "data:,")


def test_the_same_scene_gives_the_same_bytes() -> None:
    assert hostile_scene().page() == hostile_scene().page()


def test_ten_seconds_of_four_robots_stay_small() -> None:
    model, visual = planar()
    scene = Scene(fps=30)
    for k in range(4):
        scene.add_robot(f"arm {k}", model, visual, motion(model, 300, seed=k))
    assert sum(map(len, payload(scene.page()))) < 1.2e6
    assert len(scene.page()) < 2e6


def test_writing_needs_neither_a_server_nor_the_packages_that_talk_to_one(tmp_path: Path) -> None:
    code = (
        "import sys; from synctrl.show.scene import Scene; scene = Scene()\n"
        "scene.add_sphere('ball', 0.1, [[0, 0, 0], [1, 0, 0]], '#ff0000'); scene.write(sys.argv[1])\n"
        "print(*{'meshcat', 'zmq', 'tornado', 'IPython', 'trimesh'} & set(sys.modules))"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "new" / "scene.html")]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout.strip() == ""
    assert run.stderr == ""
    assert (tmp_path / "new" / "scene.html").stat().st_size > 500_000


def test_a_folder_cannot_be_written_over(tmp_path: Path) -> None:
    with refused(InputError, file=str(tmp_path)):
        Scene().write(tmp_path)


def test_a_notebook_gets_the_page_in_a_closed_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = hostile_scene()
    elements = Elements(scene.html(height=300))
    ((tag, attributes),) = elements.tags
    assert tag == "iframe"
    assert attributes["srcdoc"] == scene.page()
    assert "allow-same-origin" not in str(attributes["sandbox"])
    monkeypatch.setattr(shown, "NOTEBOOK_LIMIT", 1000)
    with refused(InputError, found=len(scene.page())):
        scene.html()


# -- what is refused -------------------------------------------------------------------------------

POINTS = np.zeros((3, 3))


@pytest.mark.parametrize(
    ("act", "subject", "found"),
    [
        (lambda s: Scene(fps=0), "fps", 0),
        (lambda s: Scene(title=None), "title", "NoneType"),
        (lambda s: s.add_robot("r", *planar(), np.zeros((5, 3))), "r: q", (5, 3)),
        (lambda s: s.add_robot("r", *planar(), np.full((5, 2), np.inf)), "r: q", np.inf),
        (lambda s: s.add_robot("r", *planar(), np.zeros((4, 2))), "r: q", 4),
        (lambda s: s.add_sphere("ball", 0.1, POINTS, "#ff0000"), None, "sphere ball"),
        (lambda s: s.add_sphere(7, 0.1, POINTS, "#ff0000"), "name", "int"),
        (lambda s: s.add_sphere("b", -1, POINTS, "#ff0000"), "b: radius", -1),
        (lambda s: s.add_sphere("b", 1, np.zeros((0, 3)), "#ff0000"), "b: position", (0, 3)),
        (lambda s: s.add_sphere("b", 1, POINTS, "rouge"), "b: color", "rouge"),
        (lambda s: s.add_sphere("b", 1, POINTS, "#gg0000"), "b: color", "#gg0000"),
        (lambda s: s.add_sphere("b", 1, POINTS, (1, 0)), "b: color", (1, 0)),
        (lambda s: s.add_sphere("b", 1, POINTS, (255, 0, 0)), "b: color", (0, 255)),
        (lambda s: s.add_sphere("b", 1, POINTS, 2 * np.ones((3, 3))), "b: color", (2, 2)),
        (lambda s: s.add_box("b", (1, 0, 1), POINTS, "#ff0000"), "b: size", (1, 0, 1)),
        (lambda s: s.add_box("b", (1, 1, 1), POINTS, "#ff0000", np.zeros(4)), "b: quaternion", 0),
        (lambda s: s.add_cylinder("b", 1, -1, POINTS, "#ff0000"), "b: length", -1),
        (lambda s: s.add_segment("b", POINTS, np.zeros((5, 3)), 1, "#ff0000"), "b: end", 5),
        (lambda s: s.add_line("b", np.zeros((0, 3)), "#ff0000"), "b: points", 0),
        (lambda s: s.add_line("b", POINTS, "#ff0000", width=0), "b: width", 0),
        (lambda s: s.camera((1, 1, 1), (1, 1, 1)), "camera", (1, 1, 1)),
        (lambda s: s.html(height=-1), "height", -1),
    ],
)
def test_wrong_input_is_refused_with_what_is_wrong_and_what_was_found(
    act: Any, subject: str | None, found: Any
) -> None:
    scene = Scene()
    scene.add_sphere("ball", 0.1, np.eye(3), "#ff0000")
    with refused(InputError, subject, found=found):
        act(scene)


# -- in a browser ----------------------------------------------------------------------------------


def test_the_page_plays_offline_and_moves_the_robot_as_pinocchio_says(tmp_path: Path) -> None:
    model, visual = a460()
    q = motion(model, 31)
    scene = Scene(fps=10, title="A460")
    scene.add_robot("arm", model, visual, q)
    scene.add_sphere("mark", np.linspace(0, 0.2, 31), np.zeros(3), np.linspace([1, 0, 0], [0, 1, 0], 31))
    data = model.createData()
    with open_page(scene.write(tmp_path / "scene.html")) as page:
        page.check_plays()
        assert page.evaluate("viewer.animator.duration") == pytest.approx(3.0)
        assert page.evaluate("viewer.gui.closed") is False
        assert page.evaluate("viewer.gui.__folders.Animations.closed") is False
        page.evaluate("viewer.animator.pause()")
        for frame in (0, 7, 30):
            page.evaluate(f"(viewer.animator.seek({frame / 10}), viewer.scene.updateMatrixWorld(true))")
            pin.forwardKinematics(model, data, q[frame])
            for joint, placement in zip(model.names[1:], data.oMi.tolist()[1:], strict=True):
                name = json.dumps(f"joint {joint}")
                found = page.evaluate(
                    f"(o => new MeshCat.THREE.Matrix4().copy(viewer.scene.matrixWorld).invert()"
                    f".multiply(o.matrixWorld).toArray())(viewer.scene.getObjectByName({name}))"
                )
                np.testing.assert_allclose(np.reshape(found, (4, 4)).T, placement.homogeneous, atol=1e-5)
        mark = "viewer.scene.getObjectByName('sphere mark')"
        assert page.evaluate(f"{mark}.scale.x") == pytest.approx(0.2)
        assert page.evaluate(f"{mark}.children[0].material.color.toArray()") == pytest.approx(
            [0, 1, 0], abs=1e-6
        )
        assert page.evaluate("document.querySelector('.failure').textContent") == ""


def test_real_meshes_are_shaded_and_hostile_names_do_nothing(tmp_path: Path) -> None:
    scene = hostile_scene()
    model, visual = ur5()
    scene.add_robot("ur5", model, visual, motion(model, 40))
    with open_page(scene.write(tmp_path / "scene.html"), size=(600, 400)) as page:
        page.check_plays()
        assert page.evaluate("document.querySelectorAll('img').length") == 0
        assert page.evaluate("document.querySelector('h1').textContent") == HOSTILE
        counts = page.evaluate(COUNT_NORMALS)
        assert counts["all"] > 50_000
        assert counts["unit"] > 0.99 * counts["all"]  # a triangle without area has no normal


COUNT_NORMALS = """(counts => (viewer.scene.traverse(object => {
    const n = object.isMesh ? object.geometry.attributes.normal.array : [];
    for (let k = 0; k < n.length; k += 3) {
        counts.all += 1;
        counts.unit += Math.abs(Math.hypot(n[k], n[k + 1], n[k + 2]) - 1) < 1e-3;
    }
}), counts))({all: 0, unit: 0})"""


def test_the_notebook_frame_plays(tmp_path: Path) -> None:
    scene = Scene()
    scene.add_sphere("ball", 0.3, np.linspace([-1, 0, 0], [1, 0, 0], 60), "#ff0000")
    path = tmp_path / "notebook.html"
    path.write_text(f"<!DOCTYPE html><body>{scene.html(300)}</body>", encoding="utf-8")
    with open_page(path, size=(600, 400)) as page:
        pictures: set[bytes] = set()
        end = time.monotonic() + 30
        while len(pictures) < 4 and time.monotonic() < end:
            pictures.add(page.screenshot(tmp_path / "picture.png").read_bytes())
        assert len(pictures) >= 4
        assert page.requests == []
        assert page.errors == []


def test_the_browser_reports_what_a_page_does_wrong(tmp_path: Path) -> None:
    path = tmp_path / "wrong.html"
    path.write_text(
        '<!DOCTYPE html><img src="http://pictures.invalid/x.png"><script>'
        'fetch("https://data.invalid/").catch(() => {}); new WebSocket("ws://socket.invalid/");'
        'console.error("seen"); alert("hello"); setTimeout(() => { throw new Error("thrown"); });</script>',
        encoding="utf-8",
    )
    with open_page(path) as page:
        page.wait_for("new Promise(done => setTimeout(() => done(true), 200))")
        hosts = {re.sub(r"^\w+://([^/]*)/.*", r"\1", address) for address in page.requests}
        assert hosts == {"pictures.invalid", "data.invalid", "socket.invalid"}
        for part in ("seen", "dialog: hello", "thrown"):
            assert any(part in error for error in page.errors), (part, page.errors)
        with pytest.raises(AssertionError, match="viewer"):  # the browser's words
            page.wait_for("viewer.animator.playing", timeout=1)


def test_shapes_of_revolution_stand_along_z() -> None:
    for solid in (shapes.cylinder(0.1, 0.6), shapes.capsule(0.1, 0.4), shapes.cylinder(0.1, 0.6, top=0)):
        np.testing.assert_allclose(np.ptp(shapes.corners(solid), axis=0), [0.2, 0.2, 0.6], atol=1e-12)


def test_html_is_escaped_once() -> None:
    assert html.unescape(Scene(title="a & b").html().split('srcdoc="')[1]).count("<h1>a &amp; b</h1>") == 1
