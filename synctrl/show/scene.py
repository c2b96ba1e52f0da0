"""Scene: a recorder of moving things that becomes one MeshCat animation."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, positive_number, printable
from ..errors import InputError, RobotWarning, warn
from ..files import write_whole
from ..robots.model import joint_poses
from . import shapes
from .html import fit_camera, frame, page, view_commands, viewer_axes
from .meshes import MeshLibrary
from .nodes import TINY, Node, bounding_box, continuous, label, pack, paint, scene_commands, towards, unit
from .shapes import Solid
from .style import ColorLike, hex_color, read_color, within_unit

if TYPE_CHECKING:
    import pinocchio as pin

NOTEBOOK_LIMIT = 10_000_000  # characters; notebooks with larger outputs become slow to open and to save
EMPTY = np.array([[-0.5, -0.5, 0.0], [0.5, 0.5, 0.5]])  # what the camera shows of a scene with nothing in it


class Scene:
    """Robots, lines and solids over T frames, exported as one HTML file that plays offline.

    Positions are in the world, in m, z up; quaternions are x y z w, as Pinocchio's. A colour is one that
    matplotlib knows, such as "#ffd700" or "gold", or three or four numbers in [0, 1]. What moves is given at
    all T frames, the same T for all; what stands still is given once. Names are text: nothing in them is ever
    markup or script.

    Args:
        fps: frames per second, at which all samples are taken and played.
        title: heading of the page.
        caption: a line below it.

    Raises:
        InputError: from every method, for a wrong shape, a number that is not finite, or a name given twice.
    """

    def __init__(self, *, fps: float = 30, title: str = "", caption: str = ""):
        self.fps = positive_number("fps", fps)
        for what, text in (("title", title), ("caption", caption)):
            instance(what, text, str, "text")
        self.title, self.caption = title, caption
        self.nodes: list[Node] = []
        self._legend: list[tuple[str, str]] = []
        self._remarks: list[str] = []
        self._camera: tuple[np.ndarray, np.ndarray] | None = None
        self._frames: int | None = None
        self._meshes = MeshLibrary()

    # -- what is in it ------------------------------------------------------------------------------------

    def add_robot(
        self,
        name: str,
        model: pin.Model,
        visual: pin.GeometryModel,
        q: ArrayLike,
        color: ColorLike | None = None,
    ) -> None:
        """A robot, whole: each joint frame moves, the visuals sit in it.

        Args:
            name: what the controls call it.
            model: its kinematics.
            visual: its shapes.
            q: configurations as Pinocchio stores them, (T, nq) or (nq,).
            color: one colour for all its shapes; by default each has its own.

        Raises:
            RobotError: a shape cannot be drawn.

        Warns:
            RobotWarning: a mesh file cannot be shown; the page says so too.
        """
        poses = joint_poses(model, self._series(f"{name}: q", q, model.nq))
        links = [Node(label("joint", joint)) for joint in model.names]
        for link, pose in zip(links, poses.transpose(1, 0, 2), strict=True):
            link.position, link.quaternion = pose[:, :3], continuous(pose[:, 3:])
        for geometry in visual.geometryObjects:
            links[geometry.parentJoint].shapes += self._meshes.shapes(geometry)
        self._say_faults(name, (Path(geometry.meshPath) for geometry in visual.geometryObjects))
        robot = Node(label("robot", name), children=[link for link in links if link.shapes])
        if color is not None:
            paint(robot, read_color(name, color))
        self._add(robot)

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

    def add_legend(self, text: str, color: ColorLike) -> None:
        """An entry of the legend in the corner of the page."""
        self._legend.append((text, hex_color(read_color(text, color))))

    def add_hidden(self, name: str, meshes: Iterable[str]) -> None:
        """A line that says which meshes of a robot cannot be shown; none if all can."""
        files = list(dict.fromkeys(printable(mesh.rpartition("/")[2])[:60] for mesh in meshes))
        if files:
            more = f" and {len(files) - 3} more" if len(files) > 3 else ""
            self._remarks.append(f"Not shown of {name}: {', '.join(files[:3])}{more}")

    # -- how it is seen -----------------------------------------------------------------------------------

    def camera(self, position: ArrayLike, target: ArrayLike) -> None:
        """Look from `position` to `target`, (3,) each in m; without this call everything is in view."""
        eye = finite_array("camera position", position, (3,))
        aim = finite_array("camera target", target, (3,))
        if np.linalg.norm(eye - aim) < TINY:
            words = f"position and target are the same point {eye}; expected two points"
            raise InputError(words, subject="camera", found=eye)
        self._camera = eye, aim

    # -- what comes out -----------------------------------------------------------------------------------

    def commands(self) -> list[dict]:
        """The scene as MeshCat commands, the animation last; numpy arrays stand for typed arrays."""
        position, target, box = self._view()
        return view_commands(position, target, box) + scene_commands(self.nodes, self.fps)

    def page(self) -> str:
        """The scene as the text of a self-contained HTML page."""
        _, target, _ = self._view()
        packed = [pack(command) for command in self.commands()]
        return page(packed, viewer_axes(target), self.title, self.caption, self._legend, self._remarks)

    def write(self, path: str | Path) -> Path:
        """Write the scene to one HTML file that plays offline; its folder is made.

        Raises:
            InputError: the file cannot be written.
        """
        path = Path(path)
        try:
            write_whole(path, self.page().encode("utf-8", "replace"))
        except OSError as error:
            words = f"animation '{path}' cannot be written: {error.strerror}"
            raise InputError(words, file=path, found=error.strerror) from error
        return path

    def html(self, height: int = 480) -> str:
        """The scene for a notebook: an `<iframe>` that holds the whole page, `height` pixels high.

        Raises:
            InputError: the page is larger than a notebook should hold.
        """
        text = self.page()
        if len(text) > NOTEBOOK_LIMIT:
            raise InputError(
                f"the scene takes {len(text) / 1e6:.1f} MB, of which a notebook holds "
                f"{NOTEBOOK_LIMIT / 1e6:.0f} MB; use write() and link to the file",
                found=len(text),
            )
        return frame(text, round(positive_number("height", height)))

    def _repr_html_(self) -> str:
        """The scene in a notebook; where it is too large, what to do instead."""
        try:
            return self.html()
        except InputError as error:
            return f"<p>{escape(str(error))}</p>"

    # -- checks and common work ---------------------------------------------------------------------------

    def _view(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Camera position, its target, and the box that holds the scene."""
        found = bounding_box(self.nodes)
        box = EMPTY if found is None else found
        return *(self._camera or fit_camera(box)), box

    def _say_faults(self, name: str, files: Iterable[Path]) -> None:
        found = {file: fault for file in files if (fault := self._meshes.faults.get(file))}
        for file, fault in found.items():
            warn(f"robot '{name}': mesh {file} is not shown: {fault}", RobotWarning)
        self.add_hidden(name, (file.name for file in found))

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
