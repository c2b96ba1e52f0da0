"""Shapes as three.js reads them: a geometry, where it sits, what it covers, its colour.

Round and square shapes are unit shapes stretched by a matrix, so that all boxes of a scene are one geometry.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..renamed import names_elsewhere

Color = tuple[float, float, float, float]

GREY: Color = (0.7, 0.7, 0.7, 1.0)
TUBE_SIDES = 12


@dataclass(frozen=True)
class Solid:
    """One drawable body.

    Attributes:
        geometry: three.js geometry, without its uuid; arrays may be numpy arrays.
        bounds: lowest and highest corner of the geometry, (2, 3), m.
        matrix: placement and stretch of the geometry in the node that carries it, (4, 4).
        color: red, green, blue, opacity in [0, 1].
        in_front: whether it is seen through all that is before it.
    """

    geometry: dict[str, Any]
    bounds: np.ndarray
    matrix: np.ndarray
    color: Color = GREY
    in_front: bool = False


def box(size: np.ndarray, color: Color = GREY) -> Solid:
    """A box about the origin; `size` along x, y, z, (3,), m."""
    geometry = {"type": "BoxGeometry", "width": 1, "height": 1, "depth": 1}
    return Solid(geometry, _around(0.5, 0.5), _stretch(*size), color)


def ellipsoid(radii: np.ndarray, color: Color = GREY) -> Solid:
    """An ellipsoid about the origin; half axes `radii`, (3,), m."""
    geometry = {"type": "SphereGeometry", "radius": 1, "widthSegments": 32, "heightSegments": 20}
    return Solid(geometry, _around(1, 1), _stretch(*radii), color)


def cylinder(radius: float, length: float, color: Color = GREY, top: float = 1.0) -> Solid:
    """A cylinder about the origin along z, m; `top` = 0 makes it a cone that points up."""
    geometry = {"type": "CylinderGeometry", "radiusTop": top, "radiusBottom": 1, "height": 1}
    geometry["radialSegments"] = 40
    return Solid(geometry, _around(1, 0.5), _stretch(radius, radius, length) @ _UPRIGHT, color)


def capsule(radius: float, length: float, color: Color = GREY) -> Solid:
    """A cylinder of `length` along z, m, with a half ball at each end."""
    quarter = np.linspace(0, np.pi / 2, 9)
    angles = np.concatenate([-quarter[::-1], quarter])
    heights = radius * np.sin(angles) + np.repeat([-length / 2, length / 2], len(quarter))
    points = [{"x": float(x), "y": float(y)} for x, y in zip(radius * np.cos(angles), heights, strict=True)]
    geometry = {"type": "LatheGeometry", "points": points, "segments": 32}
    return Solid(geometry, _around(radius, radius + length / 2), _UPRIGHT, color)


def mesh(vertices: np.ndarray, faces: np.ndarray, color: Color = GREY) -> Solid:
    """A triangle mesh: `vertices` (k, 3) in m, `faces` (f, 3) counting from 0."""
    index = np.asarray(faces, dtype=np.uint16 if len(vertices) < 2**16 else np.uint32)
    attributes = {"position": _attribute(np.asarray(vertices, dtype=np.float32), 3)}
    geometry = {"type": "BufferGeometry", "data": {"attributes": attributes, "index": _attribute(index, 1)}}
    return Solid(geometry, np.array([np.min(vertices, axis=0), np.max(vertices, axis=0)]), np.eye(4), color)


def tube(points: np.ndarray, radius: float, color: Color = GREY, ball: float = 2.0) -> Solid:
    """A round line through `points`, (k, 3), m; where they all coincide a ball, `ball` times as thick.

    WebGL draws lines one pixel wide whatever width is asked for.
    """
    points = _apart(points, radius / 2)
    if len(points) == 1:
        point = ellipsoid(np.full(3, ball * radius), color)
        point.matrix[:3, 3] = points[0]
        return point
    normals, binormals = _frames(points)
    angles = np.linspace(0, 2 * np.pi, TUBE_SIDES, endpoint=False)[:, None]
    rings = np.cos(angles) * normals[:, None] + np.sin(angles) * binormals[:, None]  # (k, sides, 3)
    return mesh((points[:, None] + radius * rings).reshape(-1, 3), _quads(len(points)), color)


def prism(outline: np.ndarray, thickness: float, color: Color = GREY) -> Solid:
    """A plate about z = 0: its outline in x and y, (k, 2), m, does not cross itself."""
    turns_left = _double_area(*outline.T) > 0
    rim = outline if turns_left else outline[::-1]
    k, half = len(rim), np.full((len(rim), 1), thickness / 2)
    top, start = triangles(rim), np.arange(k)
    end = np.roll(start, -1)
    # Faces do not share points, so that the light does not round their edges.
    walls = [np.stack([start + k, end + k, end], axis=1), np.stack([start + k, end, start], axis=1)]
    ring = np.vstack([np.hstack([rim, half]), np.hstack([rim, -half])])
    faces = np.vstack([top, top[:, ::-1] + k, *(wall + 2 * k for wall in walls)])
    return mesh(np.vstack([ring, ring]), faces, color)


def triangles(rim: np.ndarray) -> np.ndarray:
    """Triangles that fill a rim, (k, 2), that turns left and does not cross itself: (k - 2, 3), from 0.

    Corner after corner is cut off, each where nothing of the rest lies inside the triangle.
    """
    left, cut = list(range(len(rim))), []
    while len(left) > 2:
        j = next((j for j in range(len(left)) if _is_ear(rim, left, j)), 0)
        cut.append((left[j - 1], left[j], left[(j + 1) % len(left)]))
        del left[j]
    return np.array(cut)


def _is_ear(rim: np.ndarray, left: list[int], j: int) -> bool:
    corners = rim[[left[j - 1], left[j], left[(j + 1) % len(left)]]]
    if _double_area(*corners.T) < 0:
        return False
    others = rim[left]
    sides = np.roll(corners, -1, axis=0) - corners
    way = others[None] - corners[:, None]  # (3, k, 2)
    inside = (sides[:, None, 0] * way[..., 1] - sides[:, None, 1] * way[..., 0] > 0).all(axis=0)
    return not inside.any()


def _double_area(x: np.ndarray, y: np.ndarray) -> float:
    """Twice the area of a rim, above 0 if it turns left."""
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


#: radius of the head of an arrow and its length at most, as multiples of the radius of its shaft
HEAD, HEAD_LENGTH = 2.4, 0.4


def arrow(color: Color = GREY) -> list[Solid]:
    """An arrow from the origin to z = 1 in front of all else, with a shaft of radius 1; to be stretched."""
    shaft, head = cylinder(1.0, 1 - HEAD_LENGTH, color), cylinder(HEAD, HEAD_LENGTH, color, top=0.0)
    shaft.matrix[2, 3], head.matrix[2, 3] = (1 - HEAD_LENGTH) / 2, 1 - HEAD_LENGTH / 2
    return [replace(part, in_front=True) for part in (shaft, head)]


def corners(shape: Solid) -> np.ndarray:
    """Corners of the shape's bounding box in the node that carries it, (8, 3), m."""
    picks = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8)
    local = np.stack([shape.bounds[picks[axis], axis] for axis in range(3)], axis=1)
    return local @ shape.matrix[:3, :3].T + shape.matrix[:3, 3]


def _around(radius: float, half_length: float) -> np.ndarray:
    # three.js builds shapes of revolution about y; boxes and balls have the same extent on all axes.
    extent = np.array([radius, half_length, radius], dtype=float)
    return np.array([-extent, extent])


def _stretch(x: float, y: float, z: float) -> np.ndarray:
    return np.diag([float(x), float(y), float(z), 1.0])


_UPRIGHT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # y of three.js -> our z


def _attribute(array: np.ndarray, item_size: int) -> dict[str, Any]:
    kind = {"float32": "Float32Array", "uint16": "Uint16Array", "uint32": "Uint32Array"}[array.dtype.name]
    return {"itemSize": item_size, "type": kind, "array": array, "normalized": False}


def _apart(points: np.ndarray, gap: float) -> np.ndarray:
    """Points at least `gap` from the one before: directions of shorter steps are rounding noise."""
    kept = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) >= gap:
            kept.append(point)
    return np.array(kept)


def _frames(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across the line at each point, carried along it without twist."""
    steps = np.diff(points, axis=0)
    tangents = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    tangents = np.vstack([tangents, tangents[-1:]])
    normals = np.empty_like(points)
    normal = np.zeros(3)
    for k, tangent in enumerate(tangents):
        normal = normal - (normal @ tangent) * tangent
        if np.linalg.norm(normal) < 1e-3:  # the first point, or a turn into the direction of the normal
            normal = np.cross(tangent, np.eye(3)[np.argmin(np.abs(tangent))])
        normal = normals[k] = normal / np.linalg.norm(normal)
    return normals, np.cross(tangents, normals)


def _quads(rings: int) -> np.ndarray:
    """Two triangles for each side between neighbouring rings."""
    side = np.arange(TUBE_SIDES)
    here = (np.arange(rings - 1)[:, None] * TUBE_SIDES + side).ravel()
    beside = (np.arange(rings - 1)[:, None] * TUBE_SIDES + (side + 1) % TUBE_SIDES).ravel()
    first = np.stack([here, beside, here + TUBE_SIDES], axis=1)
    second = np.stack([beside, beside + TUBE_SIDES, here + TUBE_SIDES], axis=1)
    return np.vstack([first, second])


__getattr__ = names_elsewhere(__name__, ".shapes", Shape="Solid")
