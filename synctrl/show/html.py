"""The page around a scene: one HTML file that plays MeshCat commands offline, with camera and light."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ..errors import MissingDependencyError
from .nodes import JSON, TINY

#: how the words on the page look, and what plays the commands
STYLE, PLAYER = (Path(__file__).with_name(name).read_text("utf-8") for name in ("scene.css", "scene.js"))


@dataclass(frozen=True)
class Pane:
    """A scene of a page.

    Attributes:
        commands: packed MeshCat commands, in order.
        target: what the camera aims at and turns about, in the viewer's axes.
        aspect: width over height of the narrowest pane in which the camera sees everything; in one that is
            narrower all is shown smaller.
        title: heading; text, never markup.
        caption: line below it; text, never markup.
        legend: label and colour (#rrggbb) pairs.
        remarks: lines below the legend; text, never markup.
    """

    commands: Sequence[bytes]
    target: Sequence[float]
    aspect: float
    title: str = ""
    caption: str = ""
    legend: Sequence[tuple[str, str]] = ()
    remarks: Sequence[str] = ()


def page(title: str, *panes: Pane) -> str:
    """A self-contained HTML page that shows scenes side by side and asks nothing of the network.

    All scenes play at one time, and are seen from one place.

    Raises:
        MissingDependencyError: MeshCat's viewer is not installed.
    """
    library = _viewer_source("dist/main.min.js")
    licences = "\n".join(map(_viewer_source, ("LICENSE", "dist/main.min.js.LICENSE.txt")))
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy()}">',
            '<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">',
            f"<title>{escape(title) or 'Scene'}</title><style>{STYLE}</style></head><body>",
            f'<script type="text/plain" id="licences">{licences}</script>',
            *map(_view, panes),
            f"<script>{library}</script><script>{PLAYER}</script></body></html>\n",
        ]
    )


def _view(pane: Pane) -> str:
    """A part of the page: where the scene is drawn, what is said of it, and its commands."""
    lines = "\n".join(base64.b64encode(gzip.compress(c, mtime=0)).decode() for c in pane.commands)
    target = json.dumps(list(pane.target))
    return "\n".join(
        [
            f'<div class="view"><div class="pane" data-target="{target}" data-aspect="{pane.aspect}"></div>',
            f'<div class="words">{_words(pane)}</div>',
            f'<script type="text/plain" class="commands">{lines}</script></div>',
        ]
    )


def frame(page: str, height: int) -> str:
    """A page inside another one, as an `<iframe>` with its own, closed world."""
    style = f"width: 100%; height: {height}px; border: 0"
    return (
        f'<iframe sandbox="allow-scripts allow-downloads" style="{style}" srcdoc="{escape(page)}"></iframe>'
    )


def _words(pane: Pane) -> str:
    entries = [
        f'<span><i style="background: {escape(color)}"></i>{escape(label)}</span>'
        for label, color in pane.legend
    ]
    paragraphs = [escape(pane.caption), "".join(entries), *map(escape, pane.remarks)]
    heading = f"<h1>{escape(pane.title)}</h1>" if pane.title else ""
    text = "".join(f"<p>{p}</p>" for p in paragraphs if p)
    return f'{heading}{text}<p class="time"></p><p class="failure"></p>'


def policy() -> str:
    """Content security policy of a page with scenes: what plays them and nothing else, and no requests.

    Raises:
        MissingDependencyError: MeshCat's viewer is not installed.
    """
    scripts = _viewer_source("dist/main.min.js"), PLAYER
    hashes = (base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts)
    allowed = " ".join(f"'sha256-{h}'" for h in hashes)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        "img-src data: blob:; worker-src blob:; base-uri 'none'; form-action 'none'"
    )


def _viewer_source(name: str) -> str:
    """A file of MeshCat's viewer as text for a script element; the Python package is not imported."""
    spec = find_spec("meshcat")
    path = Path(spec.submodule_search_locations[0], "viewer", name) if spec else Path(name)  # type: ignore
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise MissingDependencyError(
            f"MeshCat's viewer is not where it is expected ({path.name} is missing); "
            "install meshcat 0.3.2 or later"
        ) from error
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")


# -- camera, light and ground -----------------------------------------------------------------------------

FIELD_OF_VIEW = 40.0  # degrees, vertical
_SLOPE = np.tan(np.radians(FIELD_OF_VIEW / 2))
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


def narrowest(box: np.ndarray, position: np.ndarray, target: np.ndarray) -> float:
    """Width over height of the narrowest picture in which a camera sees the whole box, (2, 3), m."""
    back = (position - target) / np.linalg.norm(position - target)
    right, _, points = _in_view(box - position, back)
    return float((abs(right @ points) / -(back @ points)).max() / _SLOPE)


def _distance(box: np.ndarray, back: np.ndarray) -> float:
    """Distance from the box's centre at which its corners are inside the picture."""
    right, up, points = _in_view(box, back)
    needed = back @ points + MARGIN * np.maximum(abs(up @ points), abs(right @ points) / ASPECT) / _SLOPE
    return max(float(needed.max()), 0.1)


def _in_view(box: np.ndarray, back: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What is right and up for a camera that looks against back, (3,) each, and corners of a box, (3, 8)."""
    right = np.cross([0, 0, 1.0], back)
    right /= np.linalg.norm(right)
    return right, np.cross(back, right), np.array(np.meshgrid(*box.T)).reshape(3, 8)


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
