"""What surrounds the scene: camera, light, background and ground."""

from __future__ import annotations

from typing import Any

import numpy as np

from .rotations import TINY

JSON = dict[str, Any]

FIELD_OF_VIEW = 40.0  # degrees, vertical
ASPECT = 4 / 3  # narrowest window, width over height, in which everything is seen
MARGIN = 1.04
GRID_STEP = 0.5  # m, squares of the viewer's grid
GRID_COLOR = [1.26, 1.35, 1.43, 1.0]  # by which the viewer's grey lines are multiplied


def fit_camera(box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Camera position and target, (3,) each in m, from which the whole box, (2, 3), is seen.

    Flat scenes are looked at from high above, tall ones from the side; x points right.
    """
    target = box.mean(axis=0)
    extent = box[1] - box[0]
    height = min(1.0, extent[2] / max(min(extent[0], extent[1]), TINY))
    azimuth, elevation = np.radians([-75 + 15 * height, 58 - 30 * height])
    back = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    return target + _distance(box - target, back) * back, target


def _distance(box: np.ndarray, back: np.ndarray) -> float:
    """Distance from the box's centre at which its corners are inside the picture."""
    right = np.cross([0, 0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    points = np.array(np.meshgrid(*box.T)).reshape(3, 8)
    slope = np.tan(np.radians(FIELD_OF_VIEW / 2))
    needed = back @ points + MARGIN * np.maximum(abs(up @ points), abs(right @ points) / ASPECT) / slope
    return max(float(needed.max()), 0.1)


def viewer_axes(point: np.ndarray) -> list[float]:
    """A point of the world, (3,), as the viewer's camera counts it: y up."""
    x, y, z = (float(c) for c in point)
    return [x, z, -y]


def view_commands(position: np.ndarray, target: np.ndarray, box: np.ndarray) -> list[JSON]:
    """Commands for background, ground, camera and light; the page itself sets what the camera aims at."""
    size = max(float(np.linalg.norm(box[1] - box[0])), 0.1)
    return [*_background(), *_ground(box), *_camera(position, target), *_lights(box.mean(axis=0), size)]


def _background() -> list[JSON]:
    return [
        _property("/Background", "top_color", [0.96, 0.97, 0.98]),
        _property("/Background", "bottom_color", [0.76, 0.81, 0.86]),
        _property("/Axes", "visible", False),
    ]


def _camera(position: np.ndarray, target: np.ndarray) -> list[JSON]:
    camera = "/Cameras/default/rotated/<object>"
    distance = float(np.linalg.norm(position - target))
    return [
        _property(camera, "fov", FIELD_OF_VIEW),
        _property(camera, "near", distance / 500),
        _property(camera, "far", distance * 100),
        _property(camera, "position", viewer_axes(position)),
    ]


def _lights(centre: np.ndarray, size: float) -> list[JSON]:
    """Two lamps above the scene, whatever its place and size, so dim that white bodies keep their shading."""
    commands = [
        _property("/Lights/AmbientLight/<object>", "intensity", 0.5),
        _property("/Lights/FillLight/<object>", "intensity", 0.2),
    ]
    for lamp, intensity in (("/Lights/PointLightNegativeX", 0.35), ("/Lights/PointLightPositiveX", 0.3)):
        commands.append(_transform(lamp, centre, size))
        commands.append(_property(f"{lamp}/<object>", "intensity", intensity))
        commands.append(_property(f"{lamp}/<object>", "distance", 0))  # of no decay
    return commands


def _ground(box: np.ndarray) -> list[JSON]:
    """The viewer's own grid below the box, at z = 0 or lower, its squares a round part of the box's size.

    Its two dark lines are the x and y axes of the world, unless the scene is far from them.
    """
    step = _round_step(max(*(box[1] - box[0]), 0.1) / 6)
    x, y, _ = 10 * step * np.round(box.mean(axis=0) / (10 * step))
    place = np.array([x, y, min(0.0, box[0, 2])])
    return [
        _transform("/Grid", place, step / GRID_STEP),
        _property("/Grid/<object>", "color", GRID_COLOR),
    ]


def _round_step(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `length`."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(m for m in (1, 2, 5) if m * power <= length * (1 + 1e-9)))


def _property(path: str, name: str, value: object) -> JSON:
    return {"type": "set_property", "path": path, "property": name, "value": value}


def _transform(path: str, position: np.ndarray, scale: float) -> JSON:
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = position
    return {"type": "set_transform", "path": path, "matrix": [float(x) for x in matrix.T.ravel()]}
