"""Visual shapes of a robot: Pinocchio's geometry objects and their mesh files, whole and in colour."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import RobotError
from .shapes import Color, Shape, box, capsule, cylinder, ellipsoid, mesh

if TYPE_CHECKING:
    import pinocchio as pin

FORMATS = (".dae", ".glb", ".obj", ".ply", ".stl")
CREASE = np.radians(35)  # faces that meet at less than this are shaded as one


class MeshLibrary:
    """Mesh files, each read once."""

    def __init__(self) -> None:
        self._files: dict[Path, list[tuple[Shape, Color | None]]] = {}

    def shapes(self, visual: pin.GeometryObject) -> list[Shape]:
        """What to draw for one visual of a robot, in the frame of the joint that carries it.

        A mesh gives one shape for each colour of its file. The colour of the robot description, where it has
        one, replaces them.

        Raises:
            RobotError: the shape cannot be drawn (a plane, for instance), or its mesh file cannot be read.
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
            for shape, own in self._read(visual.name, path)
        ]

    def _read(self, visual: str, path: Path) -> list[tuple[Shape, Color | None]]:
        if path not in self._files:
            try:
                self._files[path] = _read_mesh(path)
            except Exception as error:  # each format has its own library, and each library its own errors
                raise RobotError(
                    f"visual '{visual}': mesh {path} cannot be read ({type(error).__name__}: {error}); "
                    f"expected one of {', '.join(FORMATS)}"
                ) from error
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
    return replace(_merged([trimesh.Trimesh(shape.vertices(), triangles, process=False)]), color=color)


def _read_mesh(path: Path) -> list[tuple[Shape, Color | None]]:
    """One shape for each colour of a mesh file; the colour is None where the file gives none."""
    import trimesh

    groups: dict[Color | None, list[Any]] = {}
    for part in _load(path):
        bare = trimesh.Trimesh(part.vertices, part.faces, process=False)
        groups.setdefault(_color(part), []).append(bare)
    return [(_merged(parts), color) for color, parts in groups.items()]


def _load(path: Path) -> list[Any]:
    import trimesh

    if path.suffix.lower() not in FORMATS:
        raise ValueError(f"unknown format {path.suffix}")
    if path.suffix.lower() == ".dae" and b"<!ENTITY" in path.read_bytes():
        raise ValueError("it defines XML entities, which are refused")
    scene = trimesh.load_scene(path, process=False)
    parts = [part for part in scene.dump() if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    if not parts:
        raise ValueError("it holds no triangles")
    return parts


def _color(part: Any) -> Color | None:
    visual = part.visual
    if visual.kind is None:
        return None
    rgb = visual.material.main_color[:3] if visual.kind == "texture" else visual.main_color[:3]
    r, g, b = (float(c) / 255 for c in rgb)
    # Opaque: exporters disagree on whether 0 or 1 means transparent in a DAE file.
    return r, g, b, 1.0


def _merged(parts: list[Any]) -> Shape:
    """One mesh whose faces share vertices, and so are shaded as one, where they meet at less than CREASE."""
    import trimesh

    whole = trimesh.util.concatenate(parts)
    whole.merge_vertices(merge_norm=True, merge_tex=True)
    smooth = trimesh.graph.smooth_shade(whole, CREASE, facet_minarea=None)
    return mesh(smooth.vertices, smooth.faces)
