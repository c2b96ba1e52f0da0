"""What is recorded of a scene: lines, solids and marks, checked as they come, with as many frames each."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, positive_number
from ..errors import InputError
from . import shapes
from .nodes import TINY, Node, label, paint, towards, unit
from .shapes import Solid
from .style import ColorLike, read_color, within_unit

#: of how many pieces a line that grows is made at most
PIECES = 150


class Recording:
    """Nodes of a scene by name, and the number of frames on which all that moves agrees; see `Scene`."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._frames: int | None = None

    def add_line(self, name: str, points: ArrayLike, color: ColorLike, width: float = 0.006) -> None:
        """A line that stands still, such as a desired path: `points` (k, 3) in m, `width` in m."""
        path = finite_array(f"{name}: points", points, (None, 3))
        if not len(path):
            raise InputError("expected at least one point, found none", subject=f"{name}: points", found=0)
        radius = positive_number(f"{name}: width", width) / 2
        self._add(Node(label("line", name), shapes=[shapes.tube(path, radius, read_color(name, color))]))

    def add_sphere(self, name: str, radius: ArrayLike, position: ArrayLike, color: ColorLike) -> None:
        """A ball at `position`, (T, 3) or (3,), m.

        A `radius` (T,) in m and a `color` (T,3) make it a mark that grows and changes with an error.
        """
        radii = self._lengths(f"{name}: radius", radius)
        solid = shapes.ellipsoid(np.ones(3))
        self._add_solid("sphere", name, solid, position, (0, 0, 0, 1), np.repeat(radii, 3, axis=1), color)

    def add_box(
        self,
        name: str,
        size: ArrayLike,
        position: ArrayLike,
        color: ColorLike,
        quaternion: ArrayLike = (0, 0, 0, 1),
    ) -> None:
        """A box of `size` (3,) in m, at `position` (T, 3) or (3,), turned by `quaternion` (T, 4) or (4,)."""
        extent = finite_array(f"{name}: size", size, (3,))
        if extent.min() <= 0:
            words = f"expected three lengths above 0, found {extent}"
            raise InputError(words, subject=f"{name}: size", found=extent)
        self._add_solid("box", name, shapes.box(extent), position, quaternion, np.ones((1, 3)), color)

    def add_cylinder(
        self,
        name: str,
        radius: float,
        length: float,
        position: ArrayLike,
        color: ColorLike,
        quaternion: ArrayLike = (0, 0, 0, 1),
    ) -> None:
        """A cylinder about its z, in m; `position` (T, 3) or (3,), `quaternion` (T, 4) or (4,)."""
        radius = positive_number(f"{name}: radius", radius)
        solid = shapes.cylinder(radius, positive_number(f"{name}: length", length))
        self._add_solid("cylinder", name, solid, position, quaternion, np.ones((1, 3)), color)

    def add_segment(
        self, name: str, start: ArrayLike, end: ArrayLike, radius: ArrayLike, color: ColorLike
    ) -> None:
        """A round bar between two points, moving and stretching with them.

        Args:
            name: what the controls call it.
            start: one end, (T, 3) or (3,), m.
            end: the other end, (T, 3) or (3,), m.
            radius: one number or (T,), m.
            color: one colour, or (T, 3): a colour over time.
        """
        first = self._series(f"{name}: start", start, 3)
        along = self._series(f"{name}: end", end, 3) - first
        lengths = np.linalg.norm(along, axis=1, keepdims=True)
        radii = self._lengths(f"{name}: radius", radius)
        radii, lengths = np.broadcast_arrays(radii, np.maximum(lengths, TINY))
        scale = np.hstack([radii, radii, lengths])
        self._add_solid(
            "segment", name, shapes.cylinder(1, 1), first + along / 2, towards(along), scale, color
        )

    def add_prism(
        self,
        name: str,
        outline: ArrayLike,
        thickness: float,
        position: ArrayLike,
        color: ColorLike,
        quaternion: ArrayLike = (0, 0, 0, 1),
    ) -> None:
        """A plate: an outline that does not cross itself, (k, 2) in m, along x and y, and a thickness, m.

        `position`, (T, 3) or (3,), is that of the outline's origin, halfway between both faces.
        """
        rim = finite_array(f"{name}: outline", outline, (None, 2))
        if len(rim) < 3:
            raise InputError.expected("at least three points", len(rim), f"{name}: outline")
        solid = shapes.prism(rim, positive_number(f"{name}: thickness", thickness))
        self._add_solid("plate", name, solid, position, quaternion, np.ones((1, 3)), color)

    def add_arrow(
        self, name: str, start: ArrayLike, along: ArrayLike, radius: float, color: ColorLike
    ) -> None:
        """An arrow from a point that moves and grows, seen through all that is before it.

        Args:
            name: what the controls call it.
            start: where it begins, (T, 3) or (3,), m.
            along: from there to its point, (T, 3) or (3,), m; one of no length is not seen.
            radius: of its shaft, m; its head is no longer than half of the arrow.
            color: its colour.
        """
        way = self._series(f"{name}: along", along, 3)
        lengths = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), TINY)
        thick = np.minimum(positive_number(f"{name}: radius", radius), lengths / (2 * shapes.HEAD))
        node = Node(label("arrow", name), scale=np.hstack([thick, thick, lengths]))
        node.position, node.quaternion = self._series(f"{name}: start", start, 3), towards(way)
        node.shapes = shapes.arrow()
        paint(node, read_color(name, color))
        self._add(node)

    def add_trail(
        self,
        name: str,
        points: ArrayLike,
        colors: ArrayLike,
        width: float,
        position: ArrayLike = (0, 0, 0),
        quaternion: ArrayLike = (0, 0, 0, 1),
    ) -> None:
        """A line that grows: at every frame it leads on to the next point, and keeps the colour it got there.

        Args:
            name: what the controls call it.
            points: one for each frame, (T, 3), m, in axes at `position`, turned by `quaternion`.
            colors: one for each frame, (T, 3).
            width: of the line, m.
            position, quaternion: of the axes in which it is laid, (T, 3) or (3,), and (T, 4) or (4,).
        """
        path = self._series(f"{name}: points", points, 3)
        rgb = within_unit(name, self._series(f"{name}: color", colors, 3))
        node = Node(label("trail", name))
        node.position = self._series(f"{name}: position", position, 3)
        node.quaternion = unit(name, self._series(f"{name}: quaternion", quaternion, 4))
        radius, frame = positive_number(f"{name}: width", width) / 2, np.arange(len(path))
        edges = np.unique(np.linspace(0, len(path) - 1, PIECES + 1).round().astype(int))
        for k, (first, last) in enumerate(pairwise(edges)):
            shown = np.where(frame >= last, 1.0, TINY)[:, None] * np.ones(3)
            color = read_color(name, rgb[first : last + 1].mean(axis=0))
            piece = shapes.tube(path[first : last + 1], radius, color, ball=1.0)
            node.children.append(Node(label("piece", str(k + 1)), scale=shown, shapes=[piece]))
        self._add(node)

    # -- checks and common work ---------------------------------------------------------------------------

    def _add(self, node: Node) -> None:
        if any(node.name == other.name for other in self.nodes):
            raise InputError(f"expected another name, found {node.name!r} twice", found=node.name)
        self.nodes.append(node)

    def _add_solid(
        self,
        kind: str,
        name: str,
        solid: Solid,
        position: ArrayLike,
        quaternion: ArrayLike,
        scale: np.ndarray,
        color: ColorLike,
    ) -> None:
        node = Node(label(kind, name), scale=scale)
        node.position = self._series(f"{name}: position", position, 3)
        node.quaternion = unit(name, self._series(f"{name}: quaternion", quaternion, 4))
        node.rgb = self._colors(name, color)
        node.shapes = [solid]
        paint(node, read_color(name, color if node.rgb is None else node.rgb[0]))
        self._add(node)

    def _series(self, name: str, value: ArrayLike, width: int) -> np.ndarray:
        """`value` as (T, width) or (1, width); T is agreed on by all that moves."""
        array = finite_array(name, value)
        if array.shape == (width,):
            return array[None]
        if array.ndim != 2 or array.shape[1] != width or not len(array):
            raise InputError.expected(f"shape ({width},) or (T, {width})", array.shape, name)
        if len(array) > 1:
            self._frames = self._frames or len(array)
            if len(array) != self._frames:
                raise InputError.expected(f"{self._frames} frames as before", len(array), name)
        return array

    def _lengths(self, name: str, value: ArrayLike) -> np.ndarray:
        """`value` as (T, 1) or (1, 1), not negative and never quite 0, where a matrix has no inverse."""
        array = finite_array(name, value)
        lengths = self._series(name, array.reshape(-1, 1) if array.ndim < 2 else array, 1)
        if lengths.min() < 0:
            raise InputError.expected("no length below 0", lengths.min(), name)
        return np.maximum(lengths, TINY)

    def _colors(self, name: str, color: ColorLike) -> np.ndarray | None:
        if isinstance(color, str) or np.ndim(color) != 2:
            return None
        return within_unit(name, self._series(f"{name}: color", color, 3))
