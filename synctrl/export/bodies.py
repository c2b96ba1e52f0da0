"""What a scene shows, apart: frames that move, and bodies of simple shapes that stay in them.

`synctrl.show` makes scenes for three.js; here its shapes become boxes, balls, cylinders and triangles, in
axes whose z is up, so that any viewer can be told of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..show.nodes import Node
from ..show.shapes import Solid

#: the frame that stands still
WORLD = "world"
#: sides of a capsule
SIDES = 24
#: our axes, in which cylinders stand along z, in those of three.js, in which they stand along y
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame of a scene.

    Attributes:
        name, parent: of the frame and of the one in which its pose is.
        position: (T, 3) or (1, 3), m.
        quaternion: (T, 4) or (1, 4), x y z w.
    """

    name: str
    parent: str
    position: np.ndarray
    quaternion: np.ndarray


@dataclass(frozen=True, eq=False)
class Body:
    """Shapes that are in one frame, and may stretch, and change their colour, over time.

    Attributes:
        name: no two of a scene have the same.
        frame: name of its frame.
        node: its shapes, scales and colours.
        grows: whether it is a piece of a line that grows.
    """

    name: str
    frame: str
    node: Node
    grows: bool

    @property
    def changes(self) -> bool:
        """Whether it is not the same in every picture."""
        return len(self.node.scale) > 1 or self.node.rgb is not None

    def seen(self, k: int) -> bool:
        """Whether a piece of a line is there already in picture k."""
        return not self.grows or bool(_at(self.node.scale, k)[0] > 0.5)

    def shapes(self, k: int) -> list[Shape]:
        """Its shapes in picture k."""
        rgb = None if self.node.rgb is None else _at(self.node.rgb, k)
        return [_shape(solid, _at(self.node.scale, k), rgb) for solid in self.node.shapes]


@dataclass(frozen=True, eq=False)
class Shape:
    """A box, a ball, a cylinder along z, or triangles.

    Attributes:
        kind: "box", "ball", "cylinder" or "triangles".
        color: red, green, blue, opacity.
        position, rotation, size: where it is, (3,), m, how it is turned, (3, 3), and how long along each of
            its axes, (3,), m; of triangles, which have none, 0, 1 and 1.
        top: radius of the upper end of a cylinder, as a multiple of that of the lower one.
        vertices, faces: of triangles, (k, 3), m, and (f, 3), counted from 0.
    """

    kind: str
    color: np.ndarray
    position: np.ndarray
    rotation: np.ndarray
    size: np.ndarray
    top: float = 1.0
    vertices: np.ndarray | None = None
    faces: np.ndarray | None = None


def as_triangles(shape: Shape) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles of a cylinder, a cone, or of triangles.

    Returns:
        Corners, (k, 3), m, triangles, (f, 3), counted from 0, and directions in which corners look, (k, 3).
    """
    vertices, faces = shape.vertices, shape.faces
    if vertices is None or faces is None:
        below, above = (0.5, -0.5), (0.5 * shape.top, 0.5)
        lines = ((0.0, -0.5), below), (below, above), (above, (0.0, 0.5))  # parts do not share their rims
        parts = [_turned(np.array(line)) for line in lines]
        before = np.cumsum([0, *(len(corners) for corners, _ in parts)])
        faces = np.vstack([each + start for (_, each), start in zip(parts, before, strict=False)])
        upright = np.vstack([corners for corners, _ in parts]) @ UPRIGHT
        vertices = (upright * shape.size) @ shape.rotation.T + shape.position
    return vertices, faces, _normals(vertices, faces)


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Directions in which corners look: those of the triangles around, the more of the larger ones."""
    first, second, third = (vertices[faces[:, k]] for k in range(3))
    across, found = np.cross(second - first, third - first), np.zeros(vertices.shape)
    for k in range(3):
        np.add.at(found, faces[:, k], across)
    return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-300)


def take_apart(nodes: Sequence[Node]) -> tuple[list[Frame], list[Body]]:
    """Frames and bodies of a scene's nodes."""
    frames: list[Frame] = []
    bodies: list[Body] = []
    for node in nodes:
        _visit(node, WORLD, "", frames, bodies)
    return frames, bodies


def _visit(node: Node, parent: str, above: str, frames: list[Frame], bodies: list[Body]) -> None:
    name = f"{above}/{node.name.partition(' ')[2]}" if above else node.name.removeprefix("robot ")
    frame = parent
    if len(node.position) > 1 or len(node.quaternion) > 1 or np.any(node.position):
        frame = name
        frames.append(Frame(name, parent, node.position, node.quaternion))
    if node.shapes:
        bodies.append(Body(name, frame, node, node.name.startswith("piece ")))
    for child in node.children:
        _visit(child, frame, name, frames, bodies)


def _at(values: np.ndarray, k: int) -> np.ndarray:
    """What stands still, or row k of what moves."""
    return np.asarray(values[k if len(values) > 1 else 0])


def _shape(solid: Solid, scale: np.ndarray, rgb: np.ndarray | None) -> Shape:
    """A solid that its node stretches along its axes, or alike in all directions."""
    matrix = np.diag([*scale, 1.0]) @ solid.matrix
    color = np.array(solid.color if rgb is None else (*rgb, solid.color[3]), dtype=float)
    geometry = solid.geometry
    if geometry["type"] not in _KINDS:
        return _mesh(*_triangles(geometry), matrix, color)
    kind, extent, turn = _KINDS[geometry["type"]]
    axes = matrix[:3, :3] @ turn
    lengths = np.linalg.norm(axes, axis=0)
    rotation = axes / lengths
    if np.linalg.det(rotation) < 0:  # a mirrored ball is a ball
        rotation[:, 0] *= -1
    top = float(geometry.get("radiusTop", 1.0))
    return Shape(kind, color, matrix[:3, 3], rotation, lengths * extent, top)


def _mesh(vertices: np.ndarray, faces: np.ndarray, matrix: np.ndarray, color: np.ndarray) -> Shape:
    """Triangles, moved; where that mirrors them they are turned so that they look outwards still."""
    moved = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    faces = faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else faces
    return Shape("triangles", color, np.zeros(3), np.eye(3), np.ones(3), vertices=moved, faces=faces)


#: shape of three.js -> ours, how long the unit shape is along our axes, and these in its own
_KINDS = {
    "BoxGeometry": ("box", np.ones(3), np.eye(3)),
    "SphereGeometry": ("ball", np.full(3, 2.0), np.eye(3)),
    "CylinderGeometry": ("cylinder", np.array([2.0, 2.0, 1.0]), UPRIGHT),
}


def _triangles(geometry: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Corners, (k, 3), and triangles, (f, 3), of a mesh, or of what is turned about y."""
    if geometry["type"] == "LatheGeometry":
        return _turned(np.array([(point["x"], point["y"]) for point in geometry["points"]]))
    data = geometry["data"]
    vertices, index = data["attributes"]["position"]["array"], data["index"]["array"]
    return np.asarray(vertices, dtype=float), np.asarray(index, dtype=int)


def _turned(profile: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of radii and heights, (k, 2), from below, turned about y; they look outwards."""
    angles = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)
    radius, height = profile[:, :1], np.broadcast_to(profile[:, 1:], (len(profile), SIDES))
    vertices = np.stack([radius * np.sin(angles), height, radius * np.cos(angles)], axis=2).reshape(-1, 3)
    k, side = np.meshgrid(np.arange(len(profile) - 1) * SIDES, np.arange(SIDES), indexing="ij")
    here, beside = (k + side).ravel(), (k + (side + 1) % SIDES).ravel()
    first = np.stack([here, beside, here + SIDES], axis=1)
    second = np.stack([beside, beside + SIDES, here + SIDES], axis=1)
    return vertices, np.vstack([first, second])
