"""Scene: a recorder of moving things that becomes one MeshCat animation."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, positive_number, printable
from ..errors import InputError, RobotWarning, warn
from ..renamed import names_elsewhere
from ..robots.model import joint_poses
from .html import ASPECT, Pane, fit_camera, narrowest, page, view_commands, viewer_axes
from .meshes import MeshLibrary
from .nodes import TINY, Node, bounding_box, continuous, label, pack, paint, scene_commands
from .recording import Recording
from .shown import Shown
from .style import ColorLike, hex_color, read_color

if TYPE_CHECKING:
    import pinocchio as pin

EMPTY = np.array([[-0.5, -0.5, 0.0], [0.5, 0.5, 0.5]])  # what the camera shows of a scene with nothing in it


class Scene(Recording, Shown):
    """Robots, lines and solids over T frames, exported as one HTML file that plays offline.

    Positions are in the world, in m, z up; quaternions are x y z w, as Pinocchio's. A colour is one that
    matplotlib knows, such as "#ffd700" or "gold", or three or four numbers in [0, 1]. What moves is given at
    all T frames, the same T for all; what stands still is given once. Names are text: nothing in them is ever
    markup or script.

    Args:
        fps: frames per second, at which all samples are taken and played.
        title: heading of the page.
        caption: a line below it.
        meshes: the mesh files that were read for other scenes; by default none.

    Raises:
        InputError: from every method, for a wrong shape, a number that is not finite, or a name given twice.
    """

    def __init__(
        self, *, fps: float = 30, title: str = "", caption: str = "", meshes: MeshLibrary | None = None
    ):
        self.fps = positive_number("fps", fps)
        for what, text in (("title", title), ("caption", caption)):
            instance(what, text, str, "text")
        self.title, self.caption = title, caption
        super().__init__()
        self._legend: list[tuple[str, str]] = []
        self._remarks: list[str] = []
        self._camera: tuple[np.ndarray, np.ndarray] | None = None
        self._meshes = MeshLibrary() if meshes is None else meshes

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

    def box(self) -> np.ndarray:
        """Lowest and highest corner of all that the scene ever covers, (2, 3), m."""
        found = bounding_box(self.nodes)
        return EMPTY if found is None else found

    def commands(self, box: np.ndarray | None = None) -> list[dict]:
        """The scene as MeshCat commands, the animation last; numpy arrays stand for typed arrays.

        Args:
            box: what has to be in view unless a camera was set, (2, 3), m; by default the scene.
        """
        seen = self.box() if box is None else box
        position, target = self._camera or fit_camera(seen)
        return view_commands(position, target, seen) + scene_commands(self.nodes, self.fps)

    def pane(self, box: np.ndarray | None = None) -> Pane:
        """The scene as a part of a page; `box` as for `commands`."""
        seen = self.box() if box is None else box
        position, target = self._camera or fit_camera(seen)
        aspect = narrowest(seen, position, target) if self._camera is None else ASPECT
        packed, words = [pack(command) for command in self.commands(box)], (self.title, self.caption)
        return Pane(packed, viewer_axes(target), aspect, *words, self._legend, self._remarks)

    def page(self) -> str:
        """The scene as the text of a self-contained HTML page."""
        return page(self.title, self.pane())

    # -- common work --------------------------------------------------------------------------------------

    def _say_faults(self, name: str, files: Iterable[Path]) -> None:
        found = {file: fault for file in files if (fault := self._meshes.faults.get(file))}
        for file, fault in found.items():
            warn(f"robot '{name}': mesh {file} is not shown: {fault}", RobotWarning)
        self.add_hidden(name, (file.name for file in found))


__getattr__ = names_elsewhere(__name__, ".shown", "NOTEBOOK_LIMIT")
