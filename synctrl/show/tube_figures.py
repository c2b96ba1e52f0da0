"""The tube of errors with a run inside it: over time, and in a plane where the arm would be singular, too."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..analysis.clearance import two_links
from ..analysis.tube import Tube
from ..checks import index
from ..coupling.cell import Cell
from ..errors import InputError
from ..simulation.result import Result
from ..tasks.spaces import CartesianSpace
from .legends import plain
from .plots import new_figure, style
from .style import ACCENT, DESIRED, display, robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: colour of a tube, and how much of the plane is shown around it, as a share of it
TUBE, AROUND = "#d6e6f2", 0.06


def tube_figure(tube: Tube, cell: Cell, result: Result, robot: int = 0) -> Figure:
    """The errors of one robot in a run below the radius of its tube, over time, a panel for each part.

    In two axes of `CartesianSpace` the first panel has the plane: the tube around the path of the tip, with
    the run inside it, and in red the circles on which an arm of two links is singular.

    Args:
        tube: of `synctrl.analysis.tube`.
        cell: the same cell.
        result: a run of it.
        robot: index of the robot, counted from 0.

    Raises:
        InputError: no such robot, or a tube of another cell.
    """
    index("robot", robot, cell.n)
    if (tube.names, tube.parts[-1].stop) != (cell.names, cell.m):
        raise InputError.expected(f"a tube of {cell.name!r}, with its robots and axes", tube.cell, "tube")
    flat = isinstance(cell.space, CartesianSpace) and cell.m == 2
    with style():
        figure, axes = new_figure(3.6 if flat else 2.6, 1, flat + len(tube.parts))
        if flat:
            _in_plane(axes[0][0], tube, cell, result, robot)
        else:
            axes[0][0].set_title(plain(cell.names[robot]))
        for part, panel in enumerate(axes[0][flat:]):
            _over_time(panel, tube, result, robot, part)
        _legend(figure, robot, flat)
    return figure


def _in_plane(panel: Axes, tube: Tube, cell: Cell, result: Result, i: int) -> None:
    """Path, tube and run, and singular positions, in the plane of the task."""
    from matplotlib.patches import Circle

    path, radius = cell.motion(i, tube.t).x, tube.radius[:, i, 0]
    for center, size in zip(path, radius, strict=True):
        panel.add_patch(Circle(tuple(center), size, color=TUBE, linewidth=0, zorder=1))
    panel.plot(*path.T, color=DESIRED, linestyle="--", zorder=3)
    panel.plot(*result.x[:, i].T, color=robot_color(i), zorder=4)
    low, high = (path - radius[:, None]).min(0), (path + radius[:, None]).max(0)
    border = AROUND * (high - low).max()
    links, axis = two_links(cell.robots[i], cell.space), cell.robots[i].model.jointPlacements[1].translation
    for distance in () if links is None else (abs(links[0] - links[1]), sum(links)):
        center = tuple(axis[cell.space.rows])  # type: ignore[attr-defined]
        panel.add_patch(Circle(center, distance, fill=False, color=ACCENT, linewidth=1.2, zorder=2))
    panel.set(xlim=(low[0] - border, high[0] + border), ylim=(low[1] - border, high[1] + border))
    panel.set(
        aspect="equal", xlabel=f"{cell.labels[0]}, m", ylabel=f"{cell.labels[1]}, m", title=cell.names[i]
    )


def _over_time(panel: Axes, tube: Tube, result: Result, i: int, part: int) -> None:
    """Radius of the tube and length of the error over time."""
    unit, factor = display(tube.parts[part].unit)
    panel.fill_between(tube.t, 0, factor * tube.radius[:, i, part], color=TUBE, linewidth=0)
    panel.plot(result.t, factor * tube.sizes(result.tracking_error)[:, i, part], color=robot_color(i))
    panel.set(xlim=(0, tube.t[-1] or 1), xlabel="t, s", ylabel=f"|e({tube.parts[part].name})|, {unit}")
    panel.set_ylim(bottom=0)


def _legend(figure: Figure, i: int, flat: bool) -> None:
    """Names of what the panels show."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    lines = {"run": (robot_color(i), "-")}
    if flat:
        lines |= {"desired": (DESIRED, "--"), "singular": (ACCENT, "-")}
    drawn = [Line2D([], [], color=color, ls=ls, label=name) for name, (color, ls) in lines.items()]
    figure.legend(handles=[Patch(color=TUBE, label="tube"), *drawn], loc="outside lower center", ncols=4)
