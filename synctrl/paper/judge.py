"""An independent judge: cells that run with plants by Pinocchio and by MuJoCo, and how far these agree.

MuJoCo reads the URDF on its own, so that an error in a robot's model or its dynamics would show here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..checks import instance
from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..errors import InputError
from ..renamed import names_elsewhere
from ..robots.catalog import load_robot
from ..robots.friction import Friction
from ..show.legends import plain
from ..show.panels import power_of_ten
from ..show.plots import new_figure, style
from ..show.style import ACCENT, robot_color
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from ..tasks.trajectories import Cubic
from .report import Section, Table, Text, as_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: what counts as agreement, relative to the largest error
AGREEMENT = 1e-4
TITLE = "An independent judge"
#: smaller differences are drawn here: below rounding there is nothing to see
FLOOR = 1e-18

GAINS = Gains(Lambda=5.0, beta=2.0, K_r=5.0, K_eps=5.0, Gamma=0.05)
MOTION_TIME, DURATION = 0.6, 0.4  # s
#: share of the true parameters that the controller starts with
KNOWN = 0.5


def joint_pair(name: str) -> Experiment:
    """Two robots of one kind, turned and tilted differently, that move all their joints together.

    Args:
        name: of the robot in the catalogue.
    """
    members = []
    for i in range(2):
        robot = load_robot(name).placed((0.3 * i, 1.0, -0.2), (0.3, -0.4 * i, 0.5 + i))
        start = np.linspace(-0.7, 0.9, robot.nv) + 0.2 * i
        path = Cubic(start, start + np.linspace(0.5, -0.4, robot.nv), MOTION_TIME)
        theta_hat0 = KNOWN * robot.inertial_parameters
        members.append(Member(robot, path, theta_hat0=theta_hat0, friction=Friction()))
    cell = Cell(members, Coupling.pair(), name=f"two {name}")
    return Experiment(cell, GAINS, DURATION, title=f"two {name} in joint space")


@dataclass(frozen=True, eq=False)
class Agreement:
    """How far the errors of two runs of one cell are apart.

    Attributes:
        title: of the first run.
        t: (T,), s.
        tracking, sync: largest difference of tracking and of synchronization errors over all robots or pairs
            and axes, relative to the largest error of the first run, (T,).
    """

    title: str
    t: np.ndarray
    tracking: np.ndarray
    sync: np.ndarray

    @property
    def agrees(self) -> bool:
        """Whether both errors are the same to `AGREEMENT` at every instant."""
        return bool(max(self.tracking.max(), self.sync.max()) <= AGREEMENT)


def compare_runs(ours: Result, theirs: Result) -> Agreement:
    """Compare two runs of one cell at equal instants.

    Raises:
        InputError: other instants, or another cell.
    """
    for run in (ours, theirs):
        instance("runs", run, Result, "a Result")
    if not len(ours.t):
        raise InputError(
            "expected at least one logged instant, found none", subject=f"run '{ours.info['title']}'"
        )
    if not np.array_equal(ours.t, theirs.t) or ours.x.shape != theirs.x.shape:
        raise InputError(
            f"expected the same instants of the same cell, found {ours!r} and {theirs!r}",
            subject="runs",
        )
    tracking = _relative(ours.tracking_error, theirs.tracking_error)
    return Agreement(str(ours.info["title"]), ours.t, tracking, _relative(ours.sync_error, theirs.sync_error))


def _relative(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    return np.abs(ours - theirs).max(axis=(1, 2)) / np.abs(ours).max()


def judge_section(cells: Sequence[Agreement], folder: Path) -> Section:
    """Runs by Pinocchio against the same by MuJoCo; without any, a sentence on what is missing.

    Args:
        cells: how far the two agree, for each cell.
        folder: where the figure goes.
    """
    if not cells:
        missing = "MuJoCo is not installed, so this comparison was not made: pip install 'synctrl[mujoco]'."
        return Section(TITLE, (Text(missing, "note"),))
    words = (
        "The same controller drives the same robots once more, with accelerations by MuJoCo. It reads the "
        "URDF with its own parser: of Pinocchio's numbers it gets none but the vector of gravity. Integrator "
        "and steps are the same, and there is no friction."
    )
    caption = "Differences of the errors, relative to the largest error of each run."
    head = ("cell", "length, s", "largest difference of e", "of ε", f"within {AGREEMENT:g}")
    rows = tuple(
        (
            cell.title,
            f"{cell.t[-1]:g}",
            f"{cell.tracking.max():.1e}",
            f"{cell.sync.max():.1e}",
            "yes" if cell.agrees else "NO",
        )
        for cell in cells
    )
    return Section(
        TITLE, (Text(words), as_picture(differences(cells), folder / "judge", caption), Table(head, rows))
    )


def differences(cells: Sequence[Agreement]) -> Figure:
    """Relative differences of tracking and synchronization errors over time, a line per cell."""
    with style():
        figure, panels = new_figure(3.2, 1, 2, width=8.4, sharey=True)
        for panel, kind in zip(panels[0], ("tracking", "sync"), strict=True):
            for k, cell in enumerate(cells):
                values = np.maximum(getattr(cell, kind), FLOOR)
                panel.semilogy(cell.t, values, color=robot_color(k), label=plain(cell.title))
            panel.axhline(AGREEMENT, color=ACCENT, linestyle="--", linewidth=1.0, label="asked for")
            panel.set_xlabel("time, s")
            panel.yaxis.set_major_formatter(power_of_ten)
            panel.margins(x=0)
        panels[0, 0].set_ylabel("difference / largest error")
        panels[0, 0].set_title("tracking error e", loc="left")
        panels[0, 1].set_title("synchronization error ε", loc="left")
        figure.legend(handles=panels[0, 0].get_lines(), loc="outside lower center", ncols=3)
    return figure


__getattr__ = names_elsewhere(__name__, ".judge", Comparison="Agreement")
