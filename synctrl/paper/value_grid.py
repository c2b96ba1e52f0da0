"""What the verdicts on the A460 pair owe to the values that were invented for it.

The time of the motion, the estimate at the start and friction are ours. Each is varied, and the two claims of
section V-A that have a threshold are judged in every case.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import NamedTuple
from warnings import catch_warnings, simplefilter

import numpy as np

from ..coupling.cell import Cell
from ..errors import StepWarning
from ..experiments.a460_pair import DURATION, FINAL, FRICTION, INITIAL, KNOWN, MOTION_TIME, a460_pair
from ..robots.friction import Friction
from ..simulation.simulate import Experiment
from ..tasks.trajectories import Cubic
from .claims import MUCH, REACHED, factors_of_sync_errors
from .claims_of_cells import share_of_way
from .report import Block, Section, Table, Text, number
from .reproduction import fastest_engine

#: what is varied, with its values and what the paper's page has
VALUES: Mapping[str, tuple[float, ...]] = {
    "motion": (1.0, 2.0, 3.0),
    "estimate": (0.5, 0.7, 0.9),
    "friction": (0.5, 1.0, 2.0),
}
#: how a value of each is said
SAID = {"motion": "a motion of {} s", "estimate": "an estimate of {}", "friction": "friction × {}"}


class Case(NamedTuple):
    """Motion time, s, share of the true parameters known at the start, and factor of friction."""

    motion: float
    estimate: float
    friction: float


CHOSEN = Case(MOTION_TIME, KNOWN, 1.0)
CASES = tuple(Case(*values) for values in product(*VALUES.values()))


@dataclass(frozen=True)
class Judged:
    """What the claims with a threshold are judged by.

    Attributes:
        left: largest share of the way that a joint of either run has left at the end.
        factor: smallest factor by which synchronization makes peak or RMS of a synchronization error smaller.
    """

    left: float
    factor: float

    @property
    def reaches(self) -> bool:
        """Whether both runs reach their targets."""
        return self.left <= REACHED

    @property
    def smaller(self) -> bool:
        """Whether all synchronization errors are much smaller."""
        return self.factor >= MUCH


def varied(case: Case, synchronized: bool = True) -> Experiment:
    """The A460 pair with other values."""
    made, scale = a460_pair(synchronized=synchronized), np.array(case.friction)
    friction = Friction(scale * FRICTION.viscous, scale * FRICTION.coulomb, FRICTION.smoothing)
    members = [
        replace(
            member,
            trajectory=Cubic(start, end, case.motion),
            theta_hat0=case.estimate * member.robot.inertial_parameters,
            friction=friction,
        )
        for member, start, end in zip(made.cell.members, INITIAL, FINAL, strict=True)
    ]
    return replace(made, cell=Cell(members, made.cell.coupling, made.cell.space, made.cell.name))


def judge_case(case: Case, duration: float = DURATION) -> Judged:
    """Run one case, synchronized and independent, and measure what the claims ask for."""
    with catch_warnings():
        simplefilter("ignore", StepWarning)
        runs = [varied(case, kind).simulate(duration, engine=fastest_engine()) for kind in (True, False)]
    left = max(float(share_of_way(run).max()) for run in runs)
    return Judged(left, min(float(factors.min()) for factors in factors_of_sync_errors(*runs)))


def judge_grid(duration: float = DURATION) -> dict[Case, Judged]:
    """All cases of the grid."""
    return {case: judge_case(case, duration) for case in CASES}


def flips(grid: Mapping[Case, Judged], size: str, threshold: float) -> Iterator[str]:
    """Where a size crosses its threshold when one value moves and the others are as chosen, in words.

    Between two values of the grid it is interpolated, logarithm over logarithm.
    """
    for name, values in VALUES.items():
        line = [(value, getattr(grid[CHOSEN._replace(**{name: value})], size)) for value in values]
        for (a, low), (b, high) in pairwise(line):
            if (low <= threshold) != (high <= threshold):
                share = np.log(threshold / low) / np.log(high / low)
                yield SAID[name].format(number(a * (b / a) ** share))


def grid_section(grid: Mapping[Case, Judged], duration: float) -> Section:
    """In how many cases each verdict holds, where it flips, and all cases in a table."""
    blocks: list[Block] = [Text(_ABOUT), Text(verdict(grid, duration)), grid_table(grid)]
    return Section("What invented values decide", tuple(blocks))


def verdict(grid: Mapping[Case, Judged], duration: float) -> str:
    """What the grid says, in words."""
    reach, small = (sum(getattr(case, name) for case in grid.values()) for name in ("reaches", "smaller"))
    first, second = (_listed(flips(grid, *at)) for at in (("left", REACHED), ("factor", MUCH)))
    return (
        f"After {duration:g} s both arms reach their targets, synchronized and independent, in {reach} of "
        f"{len(grid)} cases; the synchronization errors are much smaller, all of them, in {small}. Beginning "
        f"at the values of this page and moving one of them, the first verdict flips at {first}, the second "
        f"at {second}."
    )


def grid_table(grid: Mapping[Case, Judged]) -> Table:
    """A row for each motion time and estimate, a column for each friction and claim."""
    factors = VALUES["friction"]
    head = ("motion, estimate", *(f"friction × {f:g}" for _ in range(2) for f in factors))
    groups = (
        ("share of the way left, % (asked: at most 5)", 3),
        ("smallest factor of ε (asked: at least 2)", 3),
    )
    rows = []
    for motion, estimate in product(VALUES["motion"], VALUES["estimate"]):
        judged = [grid[Case(motion, estimate, f)] for f in factors]
        left = [_marked(number(100 * each.left), each.reaches) for each in judged]
        factor = [_marked(number(each.factor), each.smaller) for each in judged]
        rows.append((f"{motion:g} s, {estimate:g}", *left, *factor))
    return Table(head, tuple(rows), _CAPTION, groups)


def _marked(text: str, holds: bool) -> str:
    return f"{text} {'✓' if holds else '✗'}"


def _listed(places: Iterator[str]) -> str:
    return " and ".join(places) or "no value in this range"


_ABOUT = (
    "The time of the motion, the estimate at the start and all of the A460's friction are ours. The claims "
    "of section V-A with a threshold, that arms reach their targets and that ε is much smaller, are judged "
    "again with others: a motion of 1, 2 or 3 s, estimates of 0.5, 0.7 or 0.9 of the true parameters, and "
    "friction times 0.5, 1 or 2."
)
_CAPTION = "✓ holds, ✗ does not. The page's own values: a motion of 2 s, an estimate of 0.7, friction × 1."
