"""Visual shapes of a robot, whole and in colour: Pinocchio's geometry objects, and mesh files in metres.

Files are read by trimesh, which opens none by itself.
"""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import RobotError
from ..robots.urdf.mesh_files import MAX_MESH_BYTES, check_mesh
from ..robots.urdf.meshes import mean_of
from ..robots.urdf.packages import Packages, Unusable, read_regular
from .shapes import Color, Solid, box, capsule, cylinder, ellipsoid, mesh

if TYPE_CHECKING:
    import pinocchio as pin

CREASE = np.radians(35)  # faces that meet at less than this are shaded as one
FARTHEST = 1e6  # m: no robot reaches there, and a camera that shows it shows nothing else


def read_mesh(path: Path) -> list[tuple[Solid, Color | None]]:
    """One shape for each colour of a mesh file; the colour is None where the file gives none.

    Coordinates are taken as those of the link, whatever axis the file calls up, as RViz and Pinocchio do.

    Raises:
        Unusable: the file is of no use, see `check_mesh`, or trimesh cannot read it.
    """
    groups: dict[Color | None, list[Any]] = {}
    for part, color in _parts(path):
        if not np.abs(part.vertices).max() < FARTHEST:
            raise Unusable("it has corners that are nowhere")
        groups.setdefault(color, []).append(part)
    if not groups:
        raise Unusable("it holds no triangles")
    return [(merged(parts), color) for color, parts in groups.items()]


def merged(parts: list[Any]) -> Solid:
    """One mesh whose faces share vertices, and so are shaded as one, where they meet at less than CREASE."""
    import trimesh

    whole = trimesh.util.concatenate(parts)
    whole.merge_vertices(merge_norm=True, merge_tex=True)
    smooth = trimesh.graph.smooth_shade(whole, CREASE, facet_minarea=None)
    return mesh(smooth.vertices, smooth.faces)


def _parts(path: Path) -> list[tuple[Any, Color | None]]:
    """The parts of a mesh file, each in its place and with its colour, and nothing else of it."""
    import trimesh

    data = io.BytesIO(check_mesh(path))
    try:
        scene = trimesh.load_scene(data, path.suffix[1:].lower(), resolver=_Package(path), process=False)
        return [_part(scene, node) for node in scene.graph.nodes_geometry if _is_solid(scene, node)]
    except Exception as error:  # each format has its own library, and each library its own errors
        raise Unusable(f"it cannot be read ({type(error).__name__}: {error})") from error


def _is_solid(scene: Any, node: str) -> bool:
    return len(getattr(scene.geometry[scene.graph[node][1]], "faces", ())) > 0


def _part(scene: Any, node: str) -> tuple[Any, Color | None]:
    import trimesh

    placement, name = scene.graph[node]
    part = scene.geometry[name]
    meter = trimesh.units.unit_conversion(part.units, "meters") if part.units else 1.0
    bare = trimesh.Trimesh(part.vertices, part.faces, process=False)
    return bare.apply_transform(placement).apply_scale(meter), _color(part.visual)


class _Package:
    """Gives trimesh the files that a mesh names: regular ones in its package, or below its folder."""

    def __init__(self, path: Path) -> None:
        self._packages = Packages(path)

    def get(self, name: str) -> bytes:
        """The content of a file, by a path from the folder of the mesh."""
        file = self._packages.here / name.strip().removeprefix("file://")
        if not file.resolve().is_relative_to(self._packages.home.resolve()):
            raise FileNotFoundError(name)
        try:
            return read_regular(file, MAX_MESH_BYTES)
        except Unusable as error:
            raise FileNotFoundError(name) from error

    __getitem__ = get


def _color(visual: Any) -> Color | None:
    """The mean colour of a part, opaque: exporters disagree on whether 0 or 1 means transparent."""
    if visual.kind is None:
        return None
    if visual.kind == "texture":
        return _material_color(visual.material)
    colors = visual.vertex_colors if visual.kind == "vertex" else visual.face_colors
    return _opaque(np.mean(colors, axis=0) / 255)


def _material_color(material: Any) -> Color:
    """The mean of its texture, tinted as it says; its colour if it has none that can be shown."""
    tint = material.main_color / 255
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    try:
        return _opaque(tint if image is None else tint * mean_of(image))
    except Unusable:
        return _opaque(tint)


def _opaque(rgba: np.ndarray) -> Color:
    r, g, b = (float(c) for c in rgba[:3])
    return r, g, b, 1.0


class MeshLibrary:
    """Mesh files, each read once.

    Attributes:
        faults: why a mesh file cannot be shown, for all files that cannot.
    """

    def __init__(self) -> None:
        self.faults: dict[Path, str] = {}
        self._files: dict[Path, list[tuple[Solid, Color | None]]] = {}

    def shapes(self, visual: pin.GeometryObject) -> list[Solid]:
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

    def _read(self, path: Path) -> list[tuple[Solid, Color | None]]:
        if path not in self._files:
            try:
                self._files[path] = read_mesh(path)
            except Unusable as fault:
                self._files[path], self.faults[path] = [], str(fault)
        return self._files[path]


def _placed(shape: Solid, placement: np.ndarray) -> Solid:
    return replace(shape, matrix=placement @ shape.matrix)


def _primitive(visual: pin.GeometryObject, color: Color) -> Solid:
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
        f"it is a {kind}, which cannot be drawn; expected a box, sphere, ellipsoid, cylinder, cone, capsule "
        "or a mesh",
        subject=f"visual '{visual.name}'",
        found=kind,
    )


def _triangles(shape: Any, color: Color) -> Solid:
    """A mesh that was built in memory, already scaled."""
    import trimesh

    triangles = [[shape.tri_indices(k)[corner] for corner in range(3)] for k in range(shape.num_tris)]
    return replace(merged([trimesh.Trimesh(shape.vertices(), triangles, process=False)]), color=color)
