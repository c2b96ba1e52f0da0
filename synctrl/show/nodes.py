"""The scene as MeshCat commands: a tree of nodes with their shapes and rotations, and one animation of all.

The whole tree is one three.js object, in which equal geometries and materials are held once.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..checks import instance
from ..errors import InputError
from ..tasks.rotations import from_quaternion
from .shapes import Color, Solid, corners

ROOT = "/meshcat/<object>"  # where MeshCat puts the object of the path /meshcat
STILL = 1e-6  # m, and so on: motion below this is not seen
TINY = 1e-6  # m: too short to have a direction

JSON = dict[str, Any]

_EXT_CODES = {"float32": 0x17, "uint16": 0x14, "uint32": 0x16}  # msgpack-lite's codes of typed arrays


@dataclass
class Node:
    """A frame that carries shapes and other nodes, moving or not.

    Attributes:
        name: what the controls of the page call it; holds a space, see `label`.
        position: (T, 3) or (1, 3), m, in the parent.
        quaternion: (T, 4) or (1, 4), unit, x y z w.
        scale: (T, 3) or (1, 3).
        rgb: colour over time of all shapes of this node, (T, 3), or None.
    """

    name: str
    position: np.ndarray = field(default_factory=lambda: np.zeros((1, 3)))
    quaternion: np.ndarray = field(default_factory=lambda: np.array([[0.0, 0, 0, 1]]))
    scale: np.ndarray = field(default_factory=lambda: np.ones((1, 3)))
    rgb: np.ndarray | None = None
    shapes: list[Solid] = field(default_factory=list)
    children: list[Node] = field(default_factory=list)


def label(kind: str, name: str) -> str:
    """A node's name for MeshCat's controls: one level of its tree, and safe as a JavaScript key.

    The space keeps `constructor`, `__proto__` and the like from meeting what every JavaScript object has.
    """
    instance("name", name, str, "text")
    readable = name.encode("utf-8", "replace").decode("utf-8")
    return f"{kind} {readable.replace('/', '∕')}"


def paint(node: Node, color: Color) -> None:
    """Give all shapes of a node and of its children one colour."""
    node.shapes = [replace(shape, color=color) for shape in node.shapes]
    for child in node.children:
        paint(child, color)


def bounding_box(nodes: Iterable[Node]) -> np.ndarray | None:
    """Lowest and highest corner of all that the nodes ever cover, (2, 3), m, or None if that is nothing."""
    boxes = [box for box in map(_node_box, nodes) if box is not None]
    return np.array([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]]) if boxes else None


def _node_box(node: Node) -> np.ndarray | None:
    inner = [corners(shape) for shape in node.shapes]
    children = bounding_box(node.children)
    if children is not None:
        inner.append(corners(Solid({}, children, np.eye(4))))
    if not inner:
        return None
    points = np.vstack(inner) * node.scale[:, None]  # (T, k, 3)
    points = points @ from_quaternion(node.quaternion).mT + node.position[:, None]
    return np.array([points.min(axis=(0, 1)), points.max(axis=(0, 1))])


def scene_commands(nodes: Iterable[Node], fps: float) -> list[JSON]:
    """The MeshCat commands that build the nodes and move them: set_object, set_animation."""
    export = _Export()
    root = {"uuid": "root", "type": "Group", "name": "scene", "children": [export.node(n) for n in nodes]}
    scene = {
        "metadata": {"version": 4.5, "type": "Object"},
        "geometries": list(export.geometries.values()),
        "materials": list(export.materials.values()),
        "object": root,
    }
    return [
        {"type": "set_object", "path": "/meshcat", "object": scene},
        *_animation(export.tracks, fps),
    ]


def _animation(tracks: list[JSON], fps: float) -> list[JSON]:
    if not tracks:
        return []
    clip = {"fps": fps, "name": "default", "tracks": tracks}
    options = {"play": True, "repetitions": math.inf}
    animations = [{"path": ROOT, "clip": clip}]
    return [{"type": "set_animation", "animations": animations, "options": options}]


def pack(command: JSON) -> bytes:
    """A command as MeshCat reads it: msgpack, numpy arrays as typed arrays."""
    from umsgpack import Ext, packb

    def typed(array: np.ndarray) -> Any:
        return Ext(_EXT_CODES[array.dtype.name], array.tobytes())

    return packb(command, ext_handlers={np.ndarray: typed})


class _Export:
    """Collects geometries, materials and tracks while nodes become three.js objects."""

    def __init__(self) -> None:
        self.geometries: dict[str, JSON] = {}
        self.materials: dict[str, JSON] = {}
        self.tracks: list[JSON] = []
        self._count = 0

    def node(self, node: Node) -> JSON:
        uuid = self._uuid()
        self._track(f"{uuid}.position", "vector3", node.position)
        self._track(f"{uuid}.quaternion", "quaternion", node.quaternion)
        self._track(f"{uuid}.scale", "vector3", node.scale)
        shapes = [self._mesh(shape, k, node.rgb) for k, shape in enumerate(node.shapes)]
        return {
            "uuid": uuid,
            "type": "Group",
            "name": node.name,
            "matrix": _column_major(_first_pose(node)),
            "children": shapes + [self.node(child) for child in node.children],
        }

    def _mesh(self, shape: Solid, number: int, rgb: np.ndarray | None) -> JSON:
        uuid = self._uuid()
        material = _material(shape.color) | (_IN_FRONT if shape.in_front else {})
        if rgb is not None:
            material["name"] = uuid  # not to be shared: this one changes its colour
            self._track(f"{uuid}.material.color", "color", rgb)
        return {
            "uuid": uuid,
            "type": "Mesh",
            "name": label("shape", str(number)),
            **({"renderOrder": 1} if shape.in_front else {}),
            "geometry": _shared(self.geometries, shape.geometry),
            "material": _shared(self.materials, material),
            "matrix": _column_major(shape.matrix),
        }

    def _uuid(self) -> str:
        self._count += 1
        return f"n{self._count}"

    def _track(self, name: str, kind: str, values: np.ndarray) -> None:
        """A track, unless nothing moves; linear in time between the frames."""
        if np.abs(values - values[0]).max() > STILL:
            times = np.arange(len(values), dtype=np.float32)  # in frames: three.js divides by fps
            self.tracks.append(
                {"name": name, "type": kind, "times": times, "values": values.astype(np.float32)}
            )


def _shared(table: dict[str, JSON], data: JSON) -> str:
    """The uuid of equal data, which enters the table once."""
    uuid = hashlib.sha256(pack(data)).hexdigest()[:24]
    table.setdefault(uuid, {"uuid": uuid, **data})
    return uuid


def _material(color: tuple[float, ...]) -> JSON:
    r, g, b = (round(255 * c) for c in color[:3])
    opacity = float(color[3])
    return {
        "type": "MeshPhongMaterial",
        "color": r << 16 | g << 8 | b,
        "opacity": opacity,
        "transparent": opacity < 1,
        "side": 2,  # both: mesh files do not agree on which side is out
        "shininess": 30,
        "specular": 0x222222,
    }


#: of a material that nothing hides: drawn last, whatever is before it, and its front alone
_IN_FRONT: JSON = {"depthTest": False, "transparent": True, "side": 0}


def _first_pose(node: Node) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = from_quaternion(node.quaternion[0]) * node.scale[0]
    matrix[:3, 3] = node.position[0]
    return matrix


def _column_major(matrix: np.ndarray) -> list[float]:
    return [float(x) for x in matrix.T.ravel()]


def continuous(quaternion: np.ndarray) -> np.ndarray:
    """The same rotations, with the sign of each quaternion chosen so that neighbours in time are near."""
    turns = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0
    signs = np.cumprod(np.concatenate([[1.0], np.where(turns, -1.0, 1.0)]))
    return quaternion * signs[:, None]


def towards(along: np.ndarray, axis: tuple[float, float, float] = (0, 0, 1)) -> np.ndarray:
    """Quaternions, (T, 4), that turn an axis to directions, (T, 3), the shortest way; none for no length."""
    lengths, start = np.linalg.norm(along, axis=1, keepdims=True), np.array(axis, dtype=float)
    direction = np.where(lengths > TINY, along / np.maximum(lengths, TINY), start)
    # (a x d, 1 + a . d), normalized; towards -a every axis across it will do.
    turn = np.column_stack([np.cross(start, direction), 1 + direction @ start])
    turn[turn[:, 3] < 1e-12] = [*np.roll(start, 1), 0]
    return continuous(turn / np.linalg.norm(turn, axis=1, keepdims=True))


def unit(name: str, quaternion: np.ndarray) -> np.ndarray:
    """Quaternions, (T, 4), at length 1, each with the sign that is nearest to the one before.

    Raises:
        InputError: one is no rotation; the message begins with `name`.
    """
    norms = np.linalg.norm(quaternion, axis=1, keepdims=True)
    if norms.min() < TINY:
        found = norms.min()
        words = f"expected a rotation, found one of length {found:g}"
        raise InputError(words, subject=f"{name}: quaternion", found=found)
    return continuous(quaternion / norms)
