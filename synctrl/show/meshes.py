"""Visual shapes of a robot: Pinocchio's geometry objects and their mesh files, whole and in colour."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import RobotError
from ..robots.urdf.packages import Unusable
from .mesh_files import merged, read_mesh
from .shapes import Color, Shape, box, capsule, cylinder, ellipsoid

if TYPE_CHECKING:
    import pinocchio as pin


class MeshLibrary:
    """Mesh files, each read once.

    Attributes:
        faults: why a mesh file cannot be shown, for all files that cannot.
    """

    def __init__(self) -> None:
        self.faults: dict[Path, str] = {}
        self._files: dict[Path, list[tuple[Shape, Color | None]]] = {}

    def shapes(self, visual: pin.GeometryObject) -> list[Shape]:
        """What to draw for one visual of a robot, in the frame of the joint that carries it.

        A mesh gives one shape for each colour of its file, and none if it cannot be shown, see `faults`. The
        colour of the robot description, where it has one, replaces them.

        Raises:
            RobotError: the shape cannot be drawn (a plane, for instance).
        """
        color: Color = tuple(float(c) for c in visual.meshColor)  # type: ignore[assignment]
        placement = visual.placement.homogeneous
        path = Path(visual.meshPath)
        if not path.suffix:
            return [_placed(_primitive(visual, color), placement)]
        stretch = placement @ np.diag([*visual.meshScale, 1.0])
        keep = not visual.overrideMaterial
        return [
            _placed(replace(shape, color=own if own and keep else color), stretch)
            for shape, own in self._read(path)
        ]

    def _read(self, path: Path) -> list[tuple[Shape, Color | None]]:
        if path not in self._files:
            try:
                self._files[path] = read_mesh(path)
            except Unusable as fault:
                self._files[path], self.faults[path] = [], str(fault)
        return self._files[path]


def _placed(shape: Shape, placement: np.ndarray) -> Shape:
    return replace(shape, matrix=placement @ shape.matrix)


def _primitive(visual: pin.GeometryObject, color: Color) -> Shape:
    shape = visual.geometry
    match type(shape).__name__:
        case "Box":
            return box(2 * shape.halfSide, color)
        case "Sphere":
            return ellipsoid(np.full(3, shape.radius), color)
        case "Ellipsoid":
            return ellipsoid(shape.radii, color)
        case "Cylinder":
            return cylinder(shape.radius, 2 * shape.halfLength, color)
        case "Cone":
            return cylinder(shape.radius, 2 * shape.halfLength, color, top=0)
        case "Capsule":
            return capsule(shape.radius, 2 * shape.halfLength, color)
        case kind if hasattr(shape, "tri_indices"):
            return _triangles(shape, color)
    raise RobotError(
        f"visual '{visual.name}' is a {kind}, which cannot be drawn; expected a box, sphere, ellipsoid, "
        "cylinder, cone, capsule or a mesh"
    )


def _triangles(shape: Any, color: Color) -> Shape:
    """A mesh that was built in memory, already scaled."""
    import trimesh

    triangles = [[shape.tri_indices(k)[corner] for corner in range(3)] for k in range(shape.num_tris)]
    return replace(merged([trimesh.Trimesh(shape.vertices(), triangles, process=False)]), color=color)
