"""Recordings for Foxglove: numbers, joints, frames and scenes, as the reader of MCAP files finds them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from exported import RUNS, arrays, has, made
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from refusals import refused
from scipy.spatial.transform import Rotation

from synctrl.errors import InputError, RobotWarning
from synctrl.export.bodies import take_apart
from synctrl.export.pictures import update
from synctrl.robots.written import read_robot
from synctrl.show import scene_of
from synctrl.show.scene import Scene

WITH_SCENES = ["mixed", "held", "carried", "bead", "network", "sliding", "single"]
#: frames per second, so that short runs have some
FPS = 250.0


class Recording:
    """What a reader that knows nothing of synctrl finds in a file, and in the layout beside it."""

    def __init__(self, path: Path):
        self.messages: dict[str, list[tuple[int, Any]]] = {}
        self.schemas: dict[str, str] = {}
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            self.order = []
            for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
                self.schemas[channel.topic] = schema.name
                self.messages.setdefault(channel.topic, []).append((message.log_time, decoded))
                self.order.append(message.log_time)
        with path.open("rb") as file:
            self.metadata = {each.name: each.metadata for each in make_reader(file).iter_metadata()}
        self.layout = json.loads(path.with_suffix(".layout.json").read_text("utf-8"))

    def numbers(self, topic: str) -> np.ndarray:
        """What a topic of numbers holds, a row for each message."""
        about = json.loads(self.metadata["quantities"][topic])
        return np.array([[reach(each, path) for path in about["fields"]] for _, each in self.messages[topic]])

    def last(self, topic: str, time: int) -> Any:
        """The message of a topic that holds at a time."""
        return [each for at, each in self.messages[topic] if at <= time][-1]


def reach(message: Any, path: str) -> float:
    for name in path.split("."):
        message = getattr(message, name)
    return message


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Recordings of runs by name, each written and read once."""
    kept: dict[str, Recording] = {}

    def read(name: str) -> Recording:
        if name not in kept:
            path = tmp_path_factory.mktemp("recordings") / "run.mcap"
            kept[name] = Recording(made(name).to_mcap(path, fps=FPS))
        return kept[name]

    return read


def nanoseconds(run) -> list[int]:
    return [round(t * 1e9) for t in run.t.tolist()]


# -- numbers ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in RUNS if name != "empty"])
def test_every_number_of_every_instant_is_there_at_its_time(recording, name):
    run, found = made(name), recording(name)
    for topic, array in arrays(run).items():
        assert [at for at, _ in found.messages[f"/{topic}"]] == nanoseconds(run)
        np.testing.assert_array_equal(found.numbers(f"/{topic}"), array[:, has(run, topic)])
        assert json.loads(found.metadata["quantities"][f"/{topic}"])["unit"] == (run.unit(topic) or "1")
    assert json.loads(found.metadata["run"]["info"]) == dict(run.info)
    assert found.metadata["run"]["status"] == run.status


def test_numbers_are_found_by_names(recording):
    run, found = made("mixed"), recording("mixed")
    last = found.messages["/tau"][-1][1]
    assert last.Panda.panda_joint3 == run.tau[-1, 2, 2] and last.UR5.elbow_joint == run.tau[-1, 0, 2]
    assert found.messages["/sync_error"][0][1].UR5__UR10.y == run.sync_error[0, 0, 1]
    fields = json.loads(found.metadata["quantities"]["/sync_error"])["fields"]
    assert fields["UR5__UR10.y"] == ["UR5, UR10", "y", "m"]


@pytest.mark.parametrize("name", ["mixed", "sliding", "stopped"])
def test_joint_states_are_those_of_the_run_under_the_names_of_the_description(recording, name):
    run, found = made(name), recording(name)
    for i, robot in enumerate(run.info["robots"]):
        topic = f"/{robot['name'].replace(' ', '_')}/joint_states"
        assert found.schemas[topic] == "foxglove.JointStates"
        for k, (at, states) in enumerate(found.messages[topic]):
            assert [joint.name for joint in states.joints] == robot["joints"]
            assert states.timestamp.seconds * 10**9 + states.timestamp.nanos == at
            count = len(robot["joints"])
            for field, array in (("position", run.q), ("velocity", run.v), ("effort", run.tau)):
                np.testing.assert_array_equal([getattr(j, field) for j in states.joints], array[k, i, :count])


@pytest.mark.parametrize("name", [name for name in RUNS if name != "empty"])
def test_messages_are_written_in_time(recording, name):
    assert recording(name).order == sorted(recording(name).order)


def test_a_run_without_instants_is_a_file_without_messages(recording):
    found = recording("empty")
    assert not found.messages and found.metadata["run"]["title"] == made("empty").info["title"]


# -- frames and scenes -----------------------------------------------------------------------------------


def matrix(position: Any, turned: Any) -> np.ndarray:
    """A pose of Foxglove's."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_quat([turned.x, turned.y, turned.z, turned.w]).as_matrix()
    found[:3, 3] = position.x, position.y, position.z
    return found


def frames(message: Any) -> dict[str, np.ndarray]:
    """Poses in the world of all frames of a message."""
    found = {"world": np.eye(4)}
    for each in message.transforms:  # parents come first
        found[each.child_frame_id] = found[each.parent_frame_id] @ matrix(each.translation, each.rotation)
    return found


def meshes(entity: Any) -> Iterator[tuple[trimesh.Trimesh, Any]]:
    """What an entity shows, in its frame, with the colour."""
    for cube in entity.cubes:
        made = trimesh.creation.box((cube.size.x, cube.size.y, cube.size.z))
        yield made.apply_transform(matrix(cube.pose.position, cube.pose.orientation)), cube.color
    for ball in entity.spheres:
        made = trimesh.creation.icosphere(3, 0.5)
        made.vertices *= (ball.size.x, ball.size.y, ball.size.z)
        yield made.apply_transform(matrix(ball.pose.position, ball.pose.orientation)), ball.color
    for can in entity.cylinders:
        made = trimesh.creation.cylinder(0.5, 1.0)
        upper = made.vertices[:, 2] > 0
        made.vertices[:, :2] *= np.where(upper, can.top_scale, can.bottom_scale)[:, None]
        made.vertices *= (can.size.x, can.size.y, can.size.z)
        yield made.apply_transform(matrix(can.pose.position, can.pose.orientation)), can.color
    for triangles in entity.triangles:
        points = [(p.x, p.y, p.z) for p in triangles.points]
        faces = np.array(triangles.indices).reshape(-1, 3)
        yield trimesh.Trimesh(points, faces, process=False), triangles.color


def shown(found: Recording, time: int, *topics: str) -> list[tuple[str, trimesh.Trimesh, Any]]:
    """What is seen at a time by whoever looks at the last message of each of the topics: in the world."""
    placed = frames(found.last("/tf", time))
    return [
        (entity.id, mesh.apply_transform(placed[entity.frame_id]), color)
        for topic in topics or [topic for topic in found.messages if topic.startswith("/scene")]
        for entity in found.last(topic, time).entities
        for mesh, color in meshes(entity)
    ]


@pytest.mark.parametrize("name", WITH_SCENES)
def test_links_are_where_forward_kinematics_has_them(recording, name):
    run, found = made(name), recording(name)
    assert found.schemas["/tf"] == "foxglove.FrameTransforms" and len(found.messages["/tf"]) > 2
    times = nanoseconds(run)
    for i, about in enumerate(run.info["robots"]):
        robot = read_robot(about, about["name"], about["joints"])
        data = robot.model.createData()
        seen = 0
        for at, message in found.messages["/tf"]:
            row = run.q[times.index(at), i, : robot.nv].astype(float)
            pin.forwardKinematics(robot.model, data, robot.configuration(row))
            placed = frames(message)
            for joint, joint_name in enumerate(robot.model.names):
                if f"{about['name']}/{joint_name}" in placed:
                    seen += 1
                    expected = data.oMi[joint].homogeneous
                    np.testing.assert_allclose(placed[f"{about['name']}/{joint_name}"], expected, atol=1e-7)
        assert seen >= len(found.messages["/tf"]) * (robot.nv - 1)


@pytest.mark.parametrize("name", WITH_SCENES)
def test_all_that_is_ever_seen_fills_the_box_of_the_scene(recording, name):
    found = recording(name)
    corners = [
        mesh.vertices
        for at, _ in found.messages["/tf"]
        for _, mesh, _ in shown(found, at)
        if len(mesh.vertices)
    ]
    points = np.vstack(corners)
    box = scene_of(made(name), fps=FPS).box()
    # The scene's box is made of boxes of shapes, which are larger where these are turned.
    size = np.linalg.norm(box[1] - box[0])
    assert (points.min(axis=0) >= box[0] - 1e-6).all() and (points.max(axis=0) <= box[1] + 1e-6).all()
    assert (np.abs([points.min(axis=0) - box[0], points.max(axis=0) - box[1]]) < 0.12 * size).all()


@pytest.mark.parametrize("name", ["carried", "network"])
def test_bars_and_arrows_lead_where_the_scene_has_them(recording, name):
    found = recording(name)
    scene = {node.name: node for node in scene_of(made(name), fps=FPS).nodes}
    lengths = dict.fromkeys(label for label in scene if label.startswith(("segment", "arrow")))
    for k, (at, _) in enumerate(found.messages["/scene/changing"]):
        parts: dict[str, list[np.ndarray]] = {}
        for label, mesh, _ in shown(found, at, "/scene/changing"):
            parts.setdefault(label, []).append(mesh.vertices)
        for label in lengths:
            node, points = scene[label], np.vstack(parts[label])
            along = (points - node.position[k]) @ Rotation.from_quat(node.quaternion[k]).as_matrix()[:, 2]
            length = lengths[label] = node.scale[k, 2]
            start = -length / 2 if label.startswith("segment") else 0.0  # from the middle, or from the tail
            np.testing.assert_allclose([along.min(), along.max()], [start, start + length], atol=1e-9)
    assert max(lengths.values()) > 0.05


def test_bars_have_the_colour_of_the_error_in_every_picture(recording):
    found = recording("network")
    scene = {node.name: node for node in scene_of(made("network"), fps=FPS).nodes}
    reddened = [name for name, node in scene.items() if node.rgb is not None]
    assert reddened
    for k, (at, message) in enumerate(found.messages["/scene/changing"]):
        assert {entity.id for entity in message.entities} >= {*reddened}
        colors = {label: (c.r, c.g, c.b) for label, _, c in shown(found, at, "/scene/changing")}
        for name in reddened:
            np.testing.assert_allclose(colors[name], scene[name].rgb[k])


def test_a_line_that_grows_has_at_every_time_as_many_pieces_as_the_scene(recording):
    found, scene = recording("bead"), scene_of(made("bead"), fps=FPS)
    counts = []
    for k, (at, _) in enumerate(found.messages["/tf"]):
        pieces = [piece for node in scene.nodes for piece in node.children if piece.name.startswith("piece")]
        expected = sum(bool(piece.scale[k, 0] == 1) for piece in pieces)
        assert len(found.last("/scene/growing", at).entities) == expected
        counts.append(expected)
    assert counts[0] == 0 and counts[-1] == len(pieces) and counts == sorted(counts)


def test_every_entity_is_in_a_frame_that_is_there_and_goes_with_it(recording):
    for name in WITH_SCENES:
        found = recording(name)
        placed = frames(found.messages["/tf"][0][1])
        for topic in (topic for topic in found.messages if topic.startswith("/scene")):
            assert found.schemas[topic] == "foxglove.SceneUpdate"
            for _, message in found.messages[topic]:
                ids = [entity.id for entity in message.entities]
                assert len({*ids}) == len(ids)
                assert all(entity.frame_locked and entity.frame_id in placed for entity in message.entities)


def test_shapes_are_as_large_as_they_should_be_and_look_outwards(tmp_path):
    """Balls, boxes, cylinders, cones, capsules and mirrored meshes, by their volumes."""
    shapes = pin.GeometryModel()
    turn = pin.SE3(pin.rpy.rpyToMatrix(0.3, 0.4, 0.5), np.array([0.1, 0.2, 0.3]))
    volumes = {
        "ball": (coal.Sphere(0.2), 4 / 3 * np.pi * 0.008),
        "egg": (coal.Ellipsoid(0.1, 0.2, 0.3), 4 / 3 * np.pi * 0.006),
        "box": (coal.Box(0.1, 0.2, 0.3), 0.006),
        "can": (coal.Cylinder(0.1, 0.5), np.pi * 0.005),
        "cone": (coal.Cone(0.1, 0.5), np.pi * 0.005 / 3),
        "pill": (coal.Capsule(0.1, 0.5), np.pi * 0.005 + 4 / 3 * np.pi * 0.001),
    }
    for name, (geometry, _) in volumes.items():
        shapes.addGeometryObject(pin.GeometryObject(name, 0, 0, turn, geometry))
    file = tmp_path / "corner.stl"
    trimesh.creation.icosphere(2, 0.1).export(file)
    mirrored = pin.GeometryObject("mirrored", 0, 0, turn, coal.Sphere(0.1), str(file), np.array([-1.0, 2, 3]))
    shapes.addGeometryObject(mirrored)
    model = pin.Model()
    model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "joint")
    scene = Scene()
    scene.add_robot("robot", model, shapes, np.zeros(1))
    (body,) = take_apart(scene.nodes)[1]
    expected = [*(volume for _, volume in volumes.values()), 6 * trimesh.creation.icosphere(2, 0.1).volume]
    (entity,) = update([body], 0, 0.0).entities
    found = sorted(mesh.volume for mesh, _ in meshes(entity))
    np.testing.assert_allclose(found, sorted(expected), rtol=0.03)
    cone = next(mesh for mesh, _ in meshes(entity) if np.isclose(mesh.volume, np.pi * 0.005 / 3, rtol=0.03))
    np.testing.assert_allclose(cone.center_mass, turn.act(np.array([0, 0, -0.125])), atol=1e-3)  # point up
    pill = next(mesh for mesh, _ in meshes(entity) if len(mesh.vertices) == len(entity.triangles[0].points))
    np.testing.assert_allclose(pill.centroid, turn.translation, atol=1e-6)


# -- the layout ------------------------------------------------------------------------------------------


def leaves(tree: Any) -> list[str]:
    """Panels of a layout."""
    if isinstance(tree, str):
        return [tree]
    assert tree.keys() == {"first", "second", "direction", "splitPercentage"}
    assert tree["direction"] in ("row", "column") and 0 < tree["splitPercentage"] < 100
    return leaves(tree["first"]) + leaves(tree["second"])


@pytest.mark.parametrize("name", [*WITH_SCENES, "stopped"])
def test_a_layout_shows_what_is_in_the_recording(recording, name):
    found = recording(name)
    panels = found.layout["configById"]
    assert sorted(leaves(found.layout["layout"])) == sorted(panels)
    for panel in (panel for key, panel in panels.items() if key.startswith("Plot!")):
        for path in panel["paths"]:
            _, topic, *fields = path["value"].replace("/", ".").split(".")
            assert np.isfinite(reach(found.messages[f"/{topic}"][-1][1], ".".join(fields)))
            assert path["label"]
    scene = panels["3D!scene"]
    assert {topic for topic in found.messages if topic.startswith("/scene")} <= {*scene["topics"]}
    assert scene["followTf"] == "world"
    hidden = {key.removeprefix("frame:") for key, each in scene["transforms"].items() if not each["visible"]}
    assert hidden == {*frames(found.messages["/tf"][0][1])}  # axes of all frames would hide the cell


def test_the_camera_of_the_layout_sees_the_whole_scene(recording):
    camera = recording("mixed").layout["configById"]["3D!scene"]["cameraState"]
    box = scene_of(made("mixed"), fps=FPS).box()
    half = np.linalg.norm(box[1] - box[0]) / 2
    np.testing.assert_allclose(camera["targetOffset"], box.mean(axis=0))
    assert half < camera["distance"] * np.sin(np.radians(camera["fovy"] / 2)) * 1.2
    assert camera["near"] < camera["distance"] - half and camera["far"] > camera["distance"] + half


# -- what cannot be shown --------------------------------------------------------------------------------


def test_a_run_whose_robots_cannot_be_drawn_is_recorded_without_a_scene(tmp_path):
    run = made("network")
    robots = [{key: robot[key] for key in robot if key != "urdf"} for robot in run.info["robots"]]
    unknown = replace(run, info={**run.info, "robots": robots}, experiment=None)
    with pytest.warns(RobotWarning):
        path = unknown.to_mcap(tmp_path / "run.mcap")
    found = Recording(path)
    assert "/tf" not in found.messages and len(found.messages["/tau"]) == len(run.t)
    assert leaves(found.layout["layout"]) == ["Plot!tracking_error", "Plot!sync_error", "Plot!tau"]


@pytest.mark.parametrize("fps", [0.0, -1.0, float("nan"), 1e9, "30"])
def test_frames_that_no_recording_can_have_are_refused(fps, tmp_path):
    with refused(InputError, "fps"):
        made("network").to_mcap(tmp_path / "run.mcap", fps=fps)
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("shift", [-1.0, 1e11])
def test_times_that_no_recording_can_have_are_refused(shift, tmp_path):
    run = made("network")
    with refused(InputError, "result, t"):
        replace(run, t=run.t + shift).to_mcap(tmp_path / "run.mcap")
    assert not [*tmp_path.iterdir()]


def test_the_same_run_is_written_to_the_same_bytes(tmp_path):
    first, second = (made("network").to_mcap(tmp_path / f"{k}" / "run.mcap") for k in range(2))
    assert first.read_bytes() == second.read_bytes()
