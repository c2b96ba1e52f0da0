"""Triangles as a picture without a graphics card: nearest in front, each in its colour, edges darkened."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from .shapes import Solid

#: samples of a pixel, in each direction
FINE = 2
#: how many samples are looked at in one go
AT_ONCE = 500_000
#: corners of round shapes
ROUND = 48
#: towards the light, in the axes of the picture: right, up, and out of it
LIGHT = np.array([-0.4, 0.6, 0.7])
#: of what is seen at a grazing angle of the light, the share that is seen all the same
AMBIENT = 0.45
#: a step in depth that is drawn as an edge, as a share of the depth of the whole
EDGE = 0.03


def triangles_of(solid: Solid) -> np.ndarray:
    """The surface of a shape in the node that carries it, (f, 3, 3), m: faces, corners, coordinates."""
    corners = _unplaced(solid.geometry)
    return corners @ solid.matrix[:3, :3].T + solid.matrix[:3, 3]


def _unplaced(geometry: dict[str, Any]) -> np.ndarray:
    """The surface of a geometry as three.js makes it; what is round is so about y."""
    import trimesh

    match geometry["type"]:
        case "BufferGeometry":
            data = geometry["data"]
            vertices = np.asarray(data["attributes"]["position"]["array"], float).reshape(-1, 3)
            return vertices[np.asarray(data["index"]["array"]).reshape(-1, 3).astype(int)]
        case "BoxGeometry":
            return np.asarray(trimesh.creation.box((1, 1, 1)).triangles)
        case "SphereGeometry":
            return np.asarray(trimesh.creation.icosphere(3).triangles)
        case "CylinderGeometry":
            profile = [(0, -0.5), (1, -0.5), (geometry["radiusTop"], 0.5), (0, 0.5)]
        case _:
            profile = [(point["x"], point["y"]) for point in geometry["points"]]
    turned = trimesh.creation.revolve(np.array(profile, float), sections=ROUND).triangles
    return np.asarray(turned)[..., [0, 2, 1]] * np.array([1.0, 1.0, -1.0])


def picture(triangles: np.ndarray, colors: np.ndarray, width: int, height: int) -> np.ndarray:
    """Draw triangles.

    Args:
        triangles: (f, 3, 3): of each corner pixels to the right, pixels up, and depth towards the eye.
        colors: red, green and blue of each from 0 to 1, (f, 3).
        width, height: of the picture, pixels.

    Returns:
        (height, width, 4), from 0 to 1, the upper row first; without opacity where there is nothing.
    """
    fine = triangles * np.array([FINE, FINE, 1.0])
    bright = colors * _shade(triangles)[:, None]
    shape = (height * FINE, width * FINE)
    depth, image = np.full(shape[0] * shape[1], -np.inf), np.zeros((shape[0] * shape[1], 4))
    low = np.clip(np.floor(fine[..., :2].min(axis=1)), 0, [shape[1], shape[0]]).astype(int)
    high = np.clip(np.ceil(fine[..., :2].max(axis=1)), 0, [shape[1], shape[0]]).astype(int)
    spans = np.maximum(high - low, 0)
    for chosen in _portions(spans.prod(axis=1)):
        which, at = _samples(low[chosen], spans[chosen])
        _fill(depth, image, shape, fine[chosen][which], bright[chosen][which], at)
    return _smaller(_edged(depth, image, shape))


def _portions(counts: np.ndarray) -> Iterator[slice]:
    """Consecutive ones that have about so many samples together as are looked at in one go."""
    ends = np.searchsorted(np.cumsum(counts), np.arange(AT_ONCE, counts.sum() + AT_ONCE, AT_ONCE))
    for start, end in pairwise([0, *(ends + 1).tolist()]):
        yield slice(start, end)


def _samples(low: np.ndarray, spans: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All samples in boxes, (k, 2), and in which box each is, (k,)."""
    counts = spans.prod(axis=1)
    which = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    wide = np.maximum(spans[which, 0], 1)
    return which, low[which] + np.stack([number % wide, number // wide], axis=1)


def _shade(triangles: np.ndarray) -> np.ndarray:
    """How bright faces are, (f,); which side is outside is not asked."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    normal *= np.where(normal[:, 2:] < 0, -1.0, 1.0)
    return AMBIENT + (1 - AMBIENT) * np.clip(normal @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)


def _fill(
    depth: np.ndarray,
    image: np.ndarray,
    shape: tuple[int, int],
    triangles: np.ndarray,
    colors: np.ndarray,
    at: np.ndarray,
) -> None:
    """Draw a sample, (f, 2), of each triangle, where it is inside and nothing is in front."""
    a, b, c = triangles.transpose(1, 0, 2)
    x, y = (at + 0.5 - a[:, :2]).T
    (ux, uy), (vx, vy) = (b - a)[:, :2].T, (c - a)[:, :2].T
    area = ux * vy - uy * vx
    safe = np.where(np.abs(area) > 1e-9, area, np.inf)
    s, t = (x * vy - y * vx) / safe, (ux * y - uy * x) / safe
    inside = (s >= -1e-6) & (t >= -1e-6) & (s + t <= 1 + 1e-6) & np.isfinite(safe)
    place = (shape[0] - 1 - at[inside, 1]) * shape[1] + at[inside, 0]
    near = (a[:, 2] + s * (b - a)[:, 2] + t * (c - a)[:, 2])[inside]
    np.maximum.at(depth, place, near)
    front = near >= depth[place]
    image[place[front], :3], image[place[front], 3] = colors[inside][front], 1.0


def _edged(depth: np.ndarray, image: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """The picture with lines where depth steps."""
    seen = np.isfinite(depth)
    span = np.ptp(depth[seen]) if seen.any() else 1.0
    z = np.where(seen, depth, (depth[seen].min() if seen.any() else 0.0) - span).reshape(shape)
    step = np.zeros(shape, bool)
    for axis in (0, 1):
        for shift in (-1, 1):
            step |= np.roll(z, shift, axis=axis) - z < -EDGE * span
    made = image.reshape(*shape, 4)
    made[step, :3] *= 0.45
    return made


def _smaller(fine: np.ndarray) -> np.ndarray:
    """The mean of the samples of every pixel, colours weighed by how much is seen of them."""
    height, width = fine.shape[0] // FINE, fine.shape[1] // FINE
    blocks = fine.reshape(height, FINE, width, FINE, 4)
    seen = blocks[..., 3:].mean(axis=(1, 3))
    color = (blocks[..., :3] * blocks[..., 3:]).mean(axis=(1, 3)) / np.maximum(seen, 1e-9)
    return np.concatenate([color, seen], axis=2)
