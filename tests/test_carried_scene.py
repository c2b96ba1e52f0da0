"""Scenes of what hands hold: the object, its hands, forces inside as arrows, and adhesive as it is laid."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from browser import open_page
from cells import SMALL_GAINS
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from test_animation import ends, node

from synctrl import Cell, Coupling, Experiment, Hold, Member, Result, load_robot
from synctrl.assembly.body import CarriedObject, place_of
from synctrl.assembly.grasp import Fixture, Grasp
from synctrl.assembly.handling import HandlingPlant
from synctrl.assembly.outline import Outline
from synctrl.assembly.plant import CarryingPlant
from synctrl.errors import InputError
from synctrl.experiments import bead_on_edge, bead_on_path
from synctrl.show import scene_of, side_by_side
from synctrl.show.arms import ALARM
from synctrl.show.carried_scene import ARROW, LAID, OPEN
from synctrl.show.nodes import TINY
from synctrl.show.scene import Scene
from synctrl.show.shapes import prism, triangles
from synctrl.show.side_by_side import SideBySide
from synctrl.show.style import read_color
from synctrl.tasks.rotations import from_quaternion

FPS = 1e3
RIM = np.array([[0.2, 0.0], [0.2, 0.1], [0.0, 0.02], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1]])


@pytest.fixture(scope="module")
def run() -> Result:
    """Two planar arms that hold a plate, whose desired joint positions do not fit it."""
    arm = load_robot("planar2r")
    arms = arm.placed((-0.6, 0, 0), name="left"), arm.placed((0.6, 0, 0), (0, 0, np.pi), name="right")
    starts = np.array([[1.2, -1.6], [-1.2, 1.6]])
    hands = [robot.tip_pose(q) for robot, q in zip(arms, starts, strict=True)]
    middle = 0.5 * (hands[0].translation + hands[1].translation)
    fixture = Fixture((1e4, 20.0), (50.0, 0.1))
    grasps = [Grasp(i, hand.translation - middle, hand.rotation, fixture) for i, hand in enumerate(hands)]
    members = [Member(robot, Hold(q + 0.05), q0=q) for robot, q in zip(arms, starts, strict=True)]
    plate = CarriedObject(0.5, shape=(0.43, 0.1, 0.02), name="plate")
    plant = partial(CarryingPlant, body=plate, grasps=grasps, at=(middle, np.eye(3)))
    cell = Cell(members, Coupling.pair())
    return Experiment(cell, SMALL_GAINS, 0.02, plant_type=plant).simulate(dt=2e-4, log_dt=1e-3)


def with_output(run: Result, name: str, values: np.ndarray, unit: str, axes: tuple[str, ...]) -> Result:
    about = {**run.info["outputs"], name: {"unit": unit, "axes": ["time", *axes]}}
    return replace(run, outputs={**run.outputs, name: values}, info={**run.info, "outputs": about})


def spread(run: Result) -> Result:
    """The run with two beads on the object, of which the second is twice as far off as the first."""
    along = np.linspace(0.0, 0.1, len(run.t))
    points, error = np.zeros((2, len(run.t), 2, 3))
    points[..., 0], points[..., 1] = along[:, None], (-0.02, 0.02)
    error[:, 0, 1], error[:, 1, 2] = 0.01 * along, -0.02 * along
    laid = with_output(run, "bead_points", points, "m", ("bead", "coordinate"))
    return with_output(laid, "bead_error", error, "m", ("bead", "coordinate"))


def places(run: Result, frames: int) -> np.ndarray:
    """Where the grasps are, (T, k, 3)."""
    p, R = place_of(run.outputs["object_pose"][:frames])
    arms = np.array([grasp["arm"] for grasp in run.info["grasps"]])
    return p[:, None] + arms @ R.mT


def test_hands_touch_the_object_where_they_hold_it_and_reach_back_to_the_wrist(run):
    scene, arms = scene_of(run, fps=FPS), run.experiment.cell.robots
    for k, name in enumerate(run.names):
        palm, wrist = node(scene, f"segment hand of {name}"), node(scene, f"segment wrist of {name}")
        start, end = ends(palm)
        np.testing.assert_allclose(end, places(run, len(end))[:, k], atol=1e-9)
        np.testing.assert_allclose(ends(wrist)[1], start, atol=1e-9)
        joint = arms[k].with_tip(arms[k].joint_frames[-1])
        elbow = [joint.tip_position(q) for q in run.q[: len(end), k]]
        np.testing.assert_allclose(ends(wrist)[0], elbow, atol=1e-9)


def test_arrows_begin_at_the_hands_and_are_as_long_as_the_forces(run):
    scene = scene_of(run, fps=FPS)
    force = run.outputs["internal_force"][..., :3]
    size = np.linalg.norm(force, axis=2)
    lengths = []
    for k, name in enumerate(run.names):
        arrow = node(scene, f"arrow force inside at {name}")
        shown = slice(0, len(arrow.position))
        np.testing.assert_allclose(arrow.position, places(run, len(arrow.position))[:, k], atol=1e-12)
        seen = size[shown, k] > 1e-3
        direction = from_quaternion(arrow.quaternion)[seen, :, 2]
        np.testing.assert_allclose(direction, force[shown, k][seen] / size[shown, k][seen, None], atol=1e-6)
        lengths.append(arrow.scale[:, 2])
    ratio = np.array(lengths).T[3:] / size[3 : len(lengths[0])]
    np.testing.assert_allclose(ratio, ratio[-1, 0], rtol=1e-4)
    doubled = node(scene_of(run, fps=FPS, force=2 * size.max()), f"arrow force inside at {run.names[0]}")
    np.testing.assert_allclose(doubled.scale[3:, 2], lengths[0][3:] / 2, rtol=1e-4)


def test_the_legend_says_how_much_force_an_arrow_is(run):
    scene = scene_of(run, fps=FPS, force=20.0)
    (text,) = [text for text, _ in scene._legend if "internal force" in text]
    length, force = float(text.split(", ")[1].split(" cm")[0]) / 100, float(text.split("for ")[1].split()[0])
    arrow = node(scene, f"arrow force inside at {run.names[0]}")
    size = np.linalg.norm(run.outputs["internal_force"][: len(arrow.scale), 0, :3], axis=1)
    np.testing.assert_allclose(arrow.scale[-1, 2], length * size[-1] / force, rtol=0.02)
    assert length > ARROW * 0.5


def test_no_bars_are_drawn_between_hands_of_one_object(run):
    scene = scene_of(run, fps=FPS)
    assert not any(n.name.startswith(("segment ε", "sphere tip")) for n in scene.nodes)
    assert "Bars" not in scene.caption


def test_adhesive_goes_with_the_object_and_keeps_the_colour_it_was_laid_with(run):
    laid = spread(run)
    scene = scene_of(laid, fps=FPS)
    for k in range(2):
        trail = node(scene, f"trail bead {k + 1}")
        np.testing.assert_allclose(trail.position, run.outputs["object_pose"][: len(trail.position), :3])
        for j, piece in enumerate(trail.children, start=1):
            shown = piece.scale[:, 0]
            assert (shown[:j] == TINY).all() and (shown[j:] == 1).all()
    last = [np.array(node(scene, f"trail bead {k}").children[-1].shapes[0].color[:3]) for k in (1, 2)]
    first = np.array(node(scene, "trail bead 1").children[0].shapes[0].color[:3])
    near = [np.linalg.norm(color - LAID) for color in (first, *last)]
    assert near[0] < near[1] < near[2]
    far = scene_of(laid, fps=FPS, bead_error=1e-9)
    np.testing.assert_allclose(node(far, "trail bead 2").children[-1].shapes[0].color[:3], ALARM)


def test_adhesive_of_a_run_without_an_object_lies_in_the_world(run):
    laid = spread(run)
    outputs, about = (
        {name: part for name, part in kept.items() if name.startswith("bead")}
        for kept in (laid.outputs, laid.info["outputs"])
    )
    bare = replace(laid, outputs=outputs, info={**laid.info, "outputs": about})
    trail = node(scene_of(bare, fps=FPS), "trail bead 1")
    assert not trail.position.any()


def test_a_plate_is_drawn_as_its_outline(run):
    about = CarriedObject(1.0, shape=Outline(RIM, 0.02), name="L").as_dict()
    plate = node(scene_of(replace(run, info={**run.info, "object": about}), fps=FPS), "plate L")
    np.testing.assert_allclose(plate.shapes[0].bounds[:, :2], [RIM.min(axis=0), RIM.max(axis=0)], atol=1e-6)
    np.testing.assert_allclose(plate.position, run.outputs["object_pose"][: len(plate.position), :3])


# -- hands that open ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def handed(run) -> Result:
    """The plate goes from the left hand to the right one, and back."""
    soft, parts = Fixture((1e4, 20.0), (50.0, 0.1)), run.experiment.plant_type.keywords
    windows = (0, 0.0, 0.01), (1, 0.005, 0.02), (0, 0.015, None)
    grasps = [Grasp(i, compliance=soft, since=since, until=until) for i, since, until in windows]
    plant = partial(HandlingPlant, body=parts["body"], at=parts["at"], grasps=grasps)
    return replace(run.experiment, plant_type=plant, duration=0.025).simulate(dt=1e-4, log_dt=1e-3)


def test_a_hand_is_wide_and_grey_while_it_is_open_and_stays_on_its_link(handed):
    scene = scene_of(handed, fps=FPS)
    for i, (name, robot) in enumerate(zip(handed.names, handed.experiment.cell.robots, strict=True)):
        palm = node(scene, f"segment hand of {name}")
        tips = np.array([robot.tip_position(q) for q in handed.q[: len(palm.position), i]])
        np.testing.assert_allclose(ends(palm)[1], tips, atol=1e-3)
        held = [grasp["robot"] == i for grasp in handed.info["grasps"]]
        closed = handed.outputs["hand_closed"][: len(tips), held].any(axis=1)
        assert {*closed} == {True, False}
        wide = palm.scale[:, 0] > 1.1 * palm.scale[:, 0].min()
        np.testing.assert_array_equal(wide, ~closed)
        np.testing.assert_allclose(palm.rgb[~closed] - read_color("open", OPEN)[:3], 0.0, atol=1e-12)


def test_every_grasp_of_a_robot_has_an_arrow_of_its_own(handed):
    names = [n.name for n in scene_of(handed, fps=FPS).nodes if n.name.startswith("arrow")]
    assert len(names) == len(handed.info["grasps"])


# -- nozzles ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def on_edge() -> Result:
    return bead_on_edge().simulate(0.01)


@pytest.fixture(scope="module")
def on_path() -> Result:
    return bead_on_path(friction=False).simulate(0.01)


def test_a_nozzle_is_drawn_to_its_point_where_no_ball_hides_the_bead(on_edge, on_path):
    for run, nozzles in ((on_edge, [1]), (on_path, [0, 1])):
        scene = scene_of(run, fps=FPS)
        for i in nozzles:
            tip = [run.experiment.cell.robots[i].tip_position(q) for q in run.q[:, i]]
            needle = ends(node(scene, f"segment nozzle of {run.names[i]}"))[1]
            np.testing.assert_allclose(needle, tip[: len(needle)], atol=1e-7)
        assert not any(n.name.startswith("sphere tip") for n in scene.nodes)


def test_a_plate_whose_edge_gets_a_bead_is_drawn_within_that_edge_and_has_a_bar_under_it(on_edge):
    scene = scene_of(on_edge, fps=FPS)
    plate, rim = node(scene, "plate plate"), np.array(on_edge.info["edge"]["outline"])
    np.testing.assert_allclose(
        plate.shapes[0].bounds[:, :2], [f(rim[:, :2], 0) for f in (np.min, np.max)], atol=1e-3
    )
    p, R = place_of(on_edge.outputs["object_pose"][:1])
    top = (plate.position[:1] - p) @ R[0] + [0, 0, plate.shapes[0].bounds[1, 2]]
    np.testing.assert_allclose(top[0], rim[0] * [0, 0, 1], atol=1e-9)
    end = (ends(node(scene, "segment hand of UR5 1"))[1][0] - p[0]) @ R[0]
    assert end[2] < top[0, 2] - 1e-3
    assert not any(n.name.startswith("segment ε") for n in scene.nodes)


def test_a_loaded_run_shows_what_a_fresh_one_does(on_path, tmp_path):
    on_path.save(tmp_path / "run.npz")
    fresh, loaded = (scene_of(run, fps=FPS) for run in (on_path, Result.load(tmp_path / "run.npz")))
    for one, other in zip(fresh.nodes, loaded.nodes, strict=True):
        assert one.name == other.name
        assert [len(link.shapes) for link in one.children] == [len(link.shapes) for link in other.children]


# -- plates -----------------------------------------------------------------------------------------------


@given(st.integers(3, 40), st.integers(0, 2**32 - 1), st.booleans())
def test_triangles_of_a_star_shaped_rim_turn_as_it_does_and_have_its_area(corners, seed, turned):
    rng = np.random.default_rng(seed)
    angle = (np.arange(corners) + rng.uniform(0, 0.5, corners)) * 2 * np.pi / corners
    rim = rng.uniform(0.2, 1.0, (corners, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
    a, b, c = np.swapaxes(rim[triangles(rim)], 0, 1)
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    next_ = np.roll(rim, -1, axis=0)
    area = 0.5 * np.sum(rim[:, 0] * next_[:, 1] - rim[:, 1] * next_[:, 0])
    assert areas.min() > -1e-12
    assert areas.sum() == pytest.approx(area)
    assert volume(prism(rim[::-1] if turned else rim, 0.3)) == pytest.approx(0.3 * area, rel=1e-5)


def volume(solid) -> float:
    """What a closed mesh whose faces turn left as seen from outside contains."""
    attributes = solid.geometry["data"]
    points = attributes["attributes"]["position"]["array"].reshape(-1, 3).astype(float)
    a, b, c = np.swapaxes(points[attributes["index"]["array"].reshape(-1, 3)], 0, 1)
    return float((a * np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Outline(RIM[:2], 0.1), "outline, points"),
        (lambda: Outline(RIM, 0.0), "outline, thickness"),
        (lambda: Outline(np.repeat(RIM, 2, axis=0), 0.1), "outline, points"),
        (lambda: Outline([[0, 0], [1, 1], [1, 0], [0, 1]], 0.1), "outline, points"),
        (lambda: CarriedObject(1.0, shape=(1.0, 2.0, 0.0)), "object, shape"),
        (lambda: CarriedObject(1.0, shape=Outline(RIM, 0.1), box=(1.0, 1.0, 1.0)), "object, shape"),
        (lambda: Scene().add_prism("p", RIM[:2], 0.1, (0, 0, 0), "red"), "p: outline"),
        (lambda: Scene().add_prism("p", RIM, 0.0, (0, 0, 0), "red"), "p: thickness"),
    ],
)
def test_what_is_no_shape_of_an_object_is_refused(make, subject):
    with refused(InputError, subject):
        make()


def test_an_object_with_another_mass_keeps_its_shape():
    for body in (CarriedObject(1.0, shape=Outline(RIM, 0.1)), CarriedObject(1.0, box=(0.1, 0.2, 0.3))):
        assert replace(body, mass=2.0).as_dict()["outline"] == body.as_dict()["outline"]
        assert replace(body, mass=2.0).as_dict()["box"] == body.as_dict()["box"]
    assert CarriedObject(1.0, shape=(0.1, 0.2, 0.3)).box is not None


# -- side by side -----------------------------------------------------------------------------------------


def test_runs_side_by_side_share_what_an_arrow_and_a_colour_mean(run):
    weaker = {**run.outputs, "internal_force": 0.5 * run.outputs["internal_force"]}
    runs = {"strong": run, "weak": replace(run, outputs=weaker)}
    strong, weak = (
        node(scene, f"arrow force inside at {run.names[0]}").scale[:, 2]
        for scene in side_by_side(runs, fps=FPS).scenes
    )
    np.testing.assert_allclose(weak[5:], 0.5 * strong[5:], rtol=1e-6)


def test_a_page_of_runs_side_by_side_plays_them_at_one_time_from_one_place(run, tmp_path):
    path = side_by_side({"one": run, "other": spread(run)}, fps=500).write(tmp_path / "both.html")
    with open_page(path, size=(800, 400)) as page:
        page.check_plays()
        assert page.evaluate("viewers.length") == 2
        page.evaluate("viewer.animator.pause(); viewer.animator.display_progress(0.012)")
        page.wait_for("viewers[1].animator.time === 0.012")
        page.evaluate("viewers[1].camera.position.x += 1; viewers[1].controls.update()")
        page.wait_for("viewers[0].camera.position.distanceTo(viewers[1].camera.position) < 1e-9")
        headings = page.evaluate("[...document.querySelectorAll('h1')].map(h => h.textContent)")
        assert headings == ["one", "other"]


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: side_by_side({}), "scenes"),
        (lambda: side_by_side([1]), "runs"),
        (lambda: side_by_side({"a": 1}), "runs, a"),
        (lambda: SideBySide("t", Scene(fps=10), Scene(fps=20)), "scenes"),
        (lambda: SideBySide("t", 3), "scene 1"),
    ],
)
def test_what_cannot_stand_side_by_side_is_refused(make, subject):
    with refused(InputError, subject):
        make()
