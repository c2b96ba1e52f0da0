"""A vehicle with two driven wheels, as their angles move it over the ground."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, positive_number
from ..errors import InputError
from ..simulation.result import Result
from ..tasks import rotations
from .runs import check_run, frame_times
from .scene import Scene

BODY, WHEEL, SPOKE, NOSE = "#c9d3de", "#26282b", "#ee8730", "#2f6fb3"
DESIRED, DRIVEN = "#3a9d5d", "#c2403a"
LINE = 0.012  # m
X, Y, Z = np.eye(3)


def vehicle_path(angles: ArrayLike, wheel_radius: float, track: float) -> np.ndarray:
    """Where wheels that roll without slip take a vehicle that starts at the origin, towards +x.

    The heading is r (q_2 - q_1) / b. Between two instants the centre between the wheels moves on an arc.

    Args:
        angles: of the left and the right wheel, (T, 2), rad.
        wheel_radius: r, m.
        track: distance b of the wheels, m.

    Returns:
        x, y and heading, (T, 3), in m and rad.
    """
    q = finite_array("angles", angles, (None, 2))
    way = positive_number("wheel_radius", wheel_radius) * (q - q[:1])
    heading = (way[:, 1] - way[:, 0]) / positive_number("track", track)
    turn, arc = np.diff(heading), np.diff(way.mean(axis=1))
    chord = arc * np.sinc(turn / (2 * np.pi))
    middle = heading[:-1] + turn / 2
    steps = chord[:, None] * np.stack([np.cos(middle), np.sin(middle)], axis=1)
    return np.column_stack([np.vstack([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), heading])


def vehicle_animation(result: Result, wheel_radius: float, track: float, fps: float = 30) -> Scene:
    """The vehicle of a run with two wheels, left and right, driving its path.

    Args:
        result: a run of two robots with one joint each, in joint space.
        wheel_radius, track: of the vehicle, m.
        fps: frames per second.

    Raises:
        InputError: a run of other robots.
    """
    check_run(result, "x", "x_desired")
    if result.x.shape[1:] != (2, 1):
        raise InputError(
            f"expected two wheels with one angle each, found {result.x.shape[1]} robots with "
            f"{result.x.shape[2]} coordinates",
            subject="result",
            found=(result.x.shape[1], result.x.shape[2]),
        )
    times = frame_times(result, fps)
    frames = np.searchsorted(0.5 * (result.t[1:] + result.t[:-1]), times)  # the nearest logged instants
    driven = vehicle_path(result.x[:, :, 0], wheel_radius, track)
    desired = vehicle_path(result.x_desired[:, :, 0], wheel_radius, track)
    scene = Scene(fps=fps, title=str(result.info["title"]), caption="The wheels' angles move the vehicle.")
    for name, path, color, height in (("desired", desired, DESIRED, 0.0), ("driven", driven, DRIVEN, LINE)):
        scene.add_line(f"{name} path", np.column_stack([path[frames, :2], 0 * times + height]), color, LINE)
        scene.add_legend(f"{name} path", color)
    _add_body(scene, driven[frames], wheel_radius, track)
    for i, name in enumerate(("left wheel", "right wheel")):
        side = (0.5, -0.5)[i] * track
        _add_wheel(scene, name, driven[frames], result.x[frames, i, 0], side, wheel_radius)
    return scene


def _add_body(scene: Scene, poses: np.ndarray, r: float, track: float) -> None:
    turned = rotations.quaternion(_heading(poses))
    size = np.array([1.1 * track, 0.7 * track, 0.5 * r])
    scene.add_box("body", size, _at(poses, 0.15 * track, 0.0, 1.2 * r), BODY, turned)
    scene.add_sphere("caster", 0.35 * r, _at(poses, 0.55 * track, 0.0, 0.35 * r), WHEEL)
    scene.add_box("nose", size * [0.1, 0.5, 0.6], _at(poses, 0.7 * track, 0.0, 1.2 * r), NOSE, turned)


def _add_wheel(scene: Scene, name: str, poses: np.ndarray, angle: np.ndarray, side: float, r: float) -> None:
    rolled = _heading(poses) @ rotations.exp(np.outer(angle, Y))
    axle = rolled @ rotations.exp(np.pi / 2 * X)
    centre = _at(poses, 0.0, side, r)
    scene.add_cylinder(name, r, 0.35 * r, centre, WHEEL, rotations.quaternion(axle))
    size = [1.7 * r, 0.4 * r, 0.3 * r]
    scene.add_box(f"spoke of {name}", size, centre, SPOKE, rotations.quaternion(rolled))


def _heading(poses: np.ndarray) -> np.ndarray:
    """Orientations of the vehicle, (T, 3, 3)."""
    return rotations.exp(np.outer(poses[:, 2], Z))


def _at(poses: np.ndarray, ahead: float, left: float, height: float) -> np.ndarray:
    """A point of the vehicle in the world, (T, 3), m."""
    return poses * [1, 1, 0] + _heading(poses) @ [ahead, left, height]
