"""The ready cells of real robots: they converge, certify, keep to their limits, and are shown whole."""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from browser import open_page
from refusals import refused

from synctrl import Experiment, Result
from synctrl.analysis.certify import certify
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, mixed_four, panda_four, ur5_payload
from synctrl.experiments.ur5_payload import PAYLOAD, hand_on_payload, payload_motion
from synctrl.show.animation import error_colors, formation_scene, payload_scene
from synctrl.tasks.rotations import exp

ROOT = Path(__file__).parent.parent
CELLS = {"four Pandas": panda_four, "mixed cell": mixed_four, "UR5 pair": ur5_payload}
STEP, DURATION = 2.5e-3, 1.0  # s


@cache
def run(cell: str, synchronized: bool = True) -> Result:
    return CELLS[cell](synchronized=synchronized).simulate(DURATION, dt=STEP)


@pytest.mark.parametrize("cell", CELLS)
def test_every_ready_cell_converges(cell):
    e = np.linalg.norm(run(cell).tracking_error, axis=2)
    assert (e[0] > 0.02).all(), "the arms start off their paths"
    assert (e[-1] < 0.25 * e[0]).all()
    epsilon = np.linalg.norm(run(cell).sync_error, axis=2)
    assert (epsilon[-1] < 0.1 * epsilon[0]).all()


@pytest.mark.parametrize("cell", CELLS)
def test_every_ready_cell_is_certified(cell):
    certificate = certify(run(cell))
    assert certificate.verdict == "covered by the theorem", str(certificate)


@pytest.mark.parametrize("cell", CELLS)
def test_synchronized_arms_are_closer_to_one_another_than_independent_ones(cell):
    late = run(cell).t > 0.3
    rms = [np.sqrt((run(cell, kind).sync_error[late] ** 2).mean()) for kind in (True, False)]
    assert rms[0] < 0.5 * rms[1]


@pytest.mark.parametrize("cell", CELLS)
def test_ready_cells_keep_to_the_limits_of_their_robots(cell):
    assert run(cell).info["limits"] == []


def test_the_payload_cell_holds_the_payload_where_its_hands_should_be():
    """Both desired hand poses come from one payload pose: they agree on it at every instant."""
    for t in (0.0, 1.3, 3.1):
        pose = payload_motion()(t).x
        for i, member in enumerate(ur5_payload().cell.members):
            xyz, rotation = hand_on_payload(i)
            hand = member.trajectory(t).x
            np.testing.assert_allclose(exp(hand[3:]), exp(pose[3:]) @ rotation, atol=1e-12)
            np.testing.assert_allclose(hand[:3], pose[:3] + exp(pose[3:]) @ xyz, atol=1e-12)
            towards_payload = exp(hand[3:])[:, 2] @ (pose[:3] - hand[:3])
            assert towards_payload > 0.99 * np.linalg.norm(pose[:3] - hand[:3])


def test_own_gains_are_used():
    gains = panda_four().gains.replace(Lambda=3.0)
    for cell in CELLS.values():
        assert isinstance(cell(), Experiment)
    assert panda_four(gains=gains).gains == gains
    assert panda_four(synchronized=False, gains=gains).gains == gains.independent()


# -- what is shown ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pages(tmp_path_factory) -> dict[str, Path]:
    """The files that the script writes, for a short run."""
    spec = importlib.util.spec_from_file_location("real_cells_script", ROOT / "scripts" / "real_cells.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return {path.stem: path for path in script.main(tmp_path_factory.mktemp("out"), duration=0.2)}


NAMES = ("panda_four", "mixed_four", "ur5_payload")


def test_the_script_writes_an_animation_per_cell_below_10_mb(pages):
    assert set(pages) == {f"{name}_{kind}" for name in NAMES for kind in ("synchronized", "independent")}
    assert all(path.stat().st_size < 10e6 for path in pages.values())


@pytest.mark.parametrize("name", NAMES)
def test_animations_of_ready_cells_play_offline(name, pages):
    with open_page(pages[f"{name}_synchronized"]) as page:
        page.check_plays()


def test_every_visual_of_every_robot_is_in_the_scene():
    for scene, result in (
        (formation_scene(run("mixed cell")), run("mixed cell")),
        (payload_scene(run("UR5 pair"), PAYLOAD), run("UR5 pair")),
    ):
        nodes = {node.name: node for node in scene.nodes}
        for name, robot in zip(result.names, result.experiment.cell.robots, strict=True):
            carriers = {robot.model.names[g.parentJoint] for g in robot.visual.geometryObjects}
            assert {link.name.split(" ", 1)[1] for link in nodes[f"robot {name}"].children} == carriers


def test_the_payload_lies_midway_between_the_hands():
    result = run("UR5 pair")
    scene = payload_scene(result, PAYLOAD, fps=20)
    box = next(node for node in scene.nodes if node.name == "box payload")
    k = len(box.position) - 1
    frame = np.searchsorted(result.t, k / 20)
    hands = result.x[frame, :, :3]
    np.testing.assert_allclose(box.position[k], hands.mean(0), atol=2e-3)


def test_colours_go_from_grey_to_red_with_the_synchronization_error():
    result = run("four Pandas")
    size = np.linalg.norm(result.sync_error, axis=2)
    colors = error_colors(result)
    worst, best = (np.unravel_index(f(size), size.shape) for f in (np.argmax, np.argmin))
    assert np.ptp(colors[worst]) > 0.5 > 0.1 > np.ptp(colors[best])
    assert colors[worst].argmax() == 0
    assert ((colors >= 0) & (colors <= 1)).all()


def test_scenes_of_other_runs_are_refused(tmp_path):
    loaded = Result.load(run("four Pandas").save(tmp_path / "run.npz"))
    with refused(InputError, "experiment", found="no experiment"):
        formation_scene(loaded)
    with refused(InputError, "result", found=()):
        payload_scene(run("four Pandas"), PAYLOAD)
    other = a460_pair().simulate(0.02)
    with refused(InputError, "result", found=("joint1", "joint2", "joint3")):
        formation_scene(other)
