"""How much delay, how long a period of messages and how much loss cells take, on the page: by analysis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..analysis.delay_map import DelayMap, delay_map
from ..analysis.delay_margin import delay_margin
from ..analysis.period_margin import period_margin
from ..control.gains import Gains
from ..control.network import Network
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..experiments.a460_pair import a460_pair
from ..experiments.planar_four import planar_four
from ..experiments.ur5_payload import ur5_payload
from ..show.delay_figures import delay_map_figure
from ..tasks.spaces import JointSpace
from ..tasks.trajectories import Hold
from .report import Picture, Section, Table, Text, as_picture, number

#: receivers, and what the page calls them
RECEIVERS: Mapping[str, str] = {"hold": "hold", "extrapolate": "extrapolate", "filter": "filter, 50 rad/s"}
#: of the maps: period, delays, and shares of messages that are lost
PERIOD, DELAYS, LOSSES = 0.01, np.arange(0.0, 0.101, 0.01), np.arange(0.0, 0.91, 0.15)
#: beyond which no longer period is looked for, s
LONGEST = 0.5


@dataclass(frozen=True, eq=False)
class Talking:
    """A cell whose robots talk, and its gains."""

    cell: Cell
    gains: Gains


def talking_cells() -> dict[str, Talking]:
    """The cells of the section: the paper's two, and two UR5 in pose space and joint by joint."""
    planar, a460, ur5 = planar_four(), a460_pair(friction=False), ur5_payload()
    return {
        "planar_four": Talking(planar.cell, planar.gains),
        "a460_pair": Talking(a460.cell, a460.gains),
        "ur5_payload": Talking(ur5.cell, ur5.gains),
        "ur5_payload, joint by joint": Talking(joint_by_joint(ur5.cell), ur5.gains),
    }


def joint_by_joint(cell: Cell) -> Cell:
    """The two arms of a cell, whose joints are compared one by one, and should stay where they start."""
    pairs = zip(cell.robots, cell.q0, strict=True)
    members = [Member(robot, Hold(q), q, name=robot.name) for robot, q in pairs]
    return Cell(members, Coupling.pair(), JointSpace(), name=f"{cell.name}, joint by joint")


def margin_section(out: Path) -> Section:
    """How much delay, how long a period and how much loss the cells take, by frozen analysis.

    Args:
        out: the folder of the page.
    """
    return margins_told(margin_table(talking_cells()), map_picture(out))


def margins_told(table: Table, picture: Picture) -> Section:
    """The section of a `margin_table` and a `map_picture`."""
    words = (Text(each) for each in _MARGINS)
    return Section("How much delay can this cell take?", (*words, table, picture))


def map_picture(out: Path) -> Picture:
    """The maps of the first three cells, drawn into the folder of the page."""
    maps = maps_of(talking_cells())
    return as_picture(delay_map_figure(maps), out / "figures" / "delay_map", map_caption(maps))


def margin_table(cells: Mapping[str, Talking]) -> Table:
    """The margins of delay, and of period for every receiver, of cells by name."""
    rows = []
    for name, each in cells.items():
        margin = delay_margin(each.cell, each.gains)
        lost = "–" if margin.robot is None else f"robot {margin.robot + 1}, joint {(margin.joint or 0) + 1}"
        periods = [
            _time(
                period_margin(each.cell, each.gains, receiver=kind, longest=LONGEST), f"> {1e3 * LONGEST:g}"
            )
            for kind in RECEIVERS
        ]
        rows.append(
            (name, number(min(margin.least_eigenvalue)), _time(margin.delay, "every"), lost, *periods)
        )
    head = ("", "least eigenvalue, N·m·s/rad", "delay, ms", "lost first", *RECEIVERS.values())
    groups = (("constant delay", 3), ("longest period without delay, ms", len(RECEIVERS)))
    return Table(head, tuple(rows), _TABLE, groups)


def _time(value: float, beyond: str) -> str:
    """A time in ms, or words for an infinite one."""
    return number(1e3 * value) if np.isfinite(value) else beyond


def maps_of(cells: Mapping[str, Talking]) -> dict[str, dict[str, DelayMap]]:
    """The maps of the first three cells, by receiver and by cell."""
    shown = list(cells.items())[:3]
    return {
        kind: {
            name: delay_map(each.cell, each.gains, Network(PERIOD, receiver=kind), DELAYS, LOSSES, trials=3)
            for name, each in shown
        }
        for kind in ("hold", "filter")
    }


def map_caption(maps: Mapping[str, Mapping[str, DelayMap]]) -> str:
    """What the maps show, and at how many of their points errors grow."""
    grow = {}
    for kind, row in maps.items():
        stable = np.concatenate([found.stable.ravel() for found in row.values()])
        grow[kind] = f"{int((~stable).sum())} of {stable.size}"
    return _MAP.format(**grow)


_MARGINS = (
    "Robots that hear of each other late may swing, although each of them alone is well damped. Linear "
    "equations of small errors, frozen at the start, say from which delay on, and how seldom robots may "
    "send. If K_r − a/(4Λ) Jᵀ cᵀ K_ε c J is positive definite for every robot, where a is the largest "
    "entry on the diagonal of SᵀS, every "
    "constant delay is tolerated: a theorem, with nothing to be computed but the least eigenvalue.",
    "Between messages a robot holds what it has heard, or extrapolates it, at most 1/(βa) long, or "
    "follows it with a filter of second order. In the maps robots send every 10 ms.",
)
_TABLE = (
    "Margins of cells frozen at their start. Lost first: which joint moves most in the mode that a longer "
    "delay makes swing."
)
_MAP = (
    "Growth of small errors over delay and loss, messages every 10 ms; the worst of three trials of 4 s. "
    "Blue falls, red grows, the black line is between them. Errors grow at {hold} of the points with "
    "“hold”, and at {filter} with “filter”. A loss is not a delay: where much is lost, arms that would "
    "swing together hardly hear of each other. Larger errors are another matter: what jumps when a "
    "message comes may be too much for robots that are not linear."
)
