"""Cells of real robots, with their meshes: arms in formation, and arms that carry a payload."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..errors import InputError
from ..simulation.result import Result
from ..tasks import rotations
from ..tasks.poses import Attached
from .arms import add_bars, arms_scene, error_color
from .runs import check_run, frame_indices
from .scene import Scene
from .style import DESIRED, robot_color

#: synchronization error that is shown fully red, as a share of the largest of the run
RED = 0.3
LINE, BAR, BALL = 0.005, 0.008, 0.018  # m
#: arrays of a run that its scene is made of
DRAWN = "x", "x_desired", "sync_error", "q"


def formation_scene(result: Result, fps: float = 25) -> Scene:
    """Arms with their desired paths, and a bar between the tips of every pair that is compared.

    A bar turns from grey to red with the synchronization error of its pair.

    Args:
        result: a run in Cartesian space along x, y, z, still with its experiment.
        fps: frames per second.

    Raises:
        InputError: a run in another space, or one without its experiment.
    """
    check_run(result, *DRAWN)
    if list(result.info["axes"]) != ["x", "y", "z"]:
        found = ", ".join(result.info["axes"])
        raise InputError(f"expected tips along x, y and z, found the coordinates {found}", subject="result")
    frames = frame_indices(result, fps)
    caption = "Bars between compared tips turn red with the synchronization error."
    scene = arms_scene(result, None, frames, fps, caption)
    tips = result.x[frames]
    for i, name in enumerate(result.names):
        scene.add_line(f"desired path of {name}", result.x_desired[frames, i], robot_color(i), LINE)
        scene.add_sphere(f"tip of {name}", BALL, tips[:, i], robot_color(i))
    share = _error_share(result)[frames]
    add_bars(scene, "pair", result.info["pairs"], tips, np.full_like(share, BAR), share)
    return scene


def payload_scene(result: Result, size: ArrayLike, fps: float = 25) -> Scene:
    """Two arms whose hands hold a box that lies midway between where each of them holds it.

    The box turns from grey to red with the synchronization error; it is drawn, not simulated.

    Args:
        result: a run in pose space with `Attached` desired motions, still with its experiment.
        size: of the box in the payload's axes, (3,), m.
        fps: frames per second.

    Raises:
        InputError: a run of other desired motions, or one without its experiment.
    """
    check_run(result, *DRAWN)
    frames = frame_indices(result, fps)
    caption = "The payload turns red with the synchronization error; it has no mass."
    scene = arms_scene(result, None, frames, fps, caption)
    hands = [member.trajectory for member in result.experiment.cell.members]
    if len(hands) != 2 or not all(isinstance(hand, Attached) for hand in hands):
        raise InputError(
            "expected two robots whose desired motions are Attached to a payload", subject="result"
        )
    position, orientation = _held(result.x[frames], hands)
    extent = finite_array("size", size, (3,))
    color = error_colors(result)[frames, 0]
    scene.add_box("payload", extent, position, color, rotations.quaternion(orientation))
    scene.add_line("desired path", hands[0].body(result.t[frames]).x[:, :3], DESIRED, LINE)
    scene.add_legend("desired path of the payload", DESIRED)
    return scene


def error_colors(result: Result) -> np.ndarray:
    """A colour per instant and pair, (T, p, 3), which reddens with the synchronization error."""
    check_run(result, "sync_error")
    return error_color(_error_share(result))


def _error_share(result: Result) -> np.ndarray:
    """Synchronization errors from 0 to 1, (T, p): from none to fully red."""
    size = np.linalg.norm(result.sync_error[:, :, :3], axis=2)
    return np.clip(size / max(RED * float(size.max()), 1e-12), 0, 1)


def _held(x: np.ndarray, hands: list[Attached]) -> tuple[np.ndarray, np.ndarray]:
    """Position, (T, 3), and orientation, (T, 3, 3), midway between where the two hands hold the payload."""
    first, second = (rotations.exp(x[:, i, 3:]) @ hand.rotation.T for i, hand in enumerate(hands))
    half = 0.5 * rotations.log(second @ np.swapaxes(first, 1, 2))
    places = [
        x[:, i, :3] - R @ hand.xyz for i, (R, hand) in enumerate(zip((first, second), hands, strict=True))
    ]
    return 0.5 * (places[0] + places[1]), rotations.exp(half) @ first
