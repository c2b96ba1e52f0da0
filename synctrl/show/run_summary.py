"""The summary of a run: sentences on what happened, a row for each robot and one for each pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..analysis.metrics import SETTLING_FRACTION, ErrorMetrics, Metrics, row_names
from ..checks import printable
from ..simulation.result import Result
from .page import Table, number
from .plots import columns_by_unit
from .style import display

#: a run that came to its end says so in its status
COMPLETED = "completed"
#: limits that were left and are named one by one; of the others there is a number
MOST_LIMITS = 3
#: what an error is called, and its symbol
_CALLED = {"tracking_error": ("tracking error", "e"), "sync_error": ("synchronization error", "ε")}
#: captions of the tables
OF_ROBOTS = (
    "Errors of the coordinate in which each is largest; settled is from when on all errors stay within "
    f"{SETTLING_FRACTION:.0%} of the largest of all robots. The worst of every column is marked."
)
OF_PAIRS = (
    "Synchronization errors, in the same way; the number of a pair is the index of its ε in the figures."
)


class Column(NamedTuple):
    """A column of a table: its head, and for each row a number, how it is written, and whether it is bad."""

    head: str
    values: np.ndarray
    texts: list[str]
    bad: np.ndarray


@dataclass(frozen=True)
class Peak:
    """The largest error of a run: how large, when, of which row and coordinate; in the unit that is shown."""

    kind: str
    size: float
    unit: str
    time: float
    row: str
    axis: str

    def __str__(self) -> str:
        what = _CALLED[self.kind][0]
        where = f"of {self.row}, {self.axis}, at t = {number(self.time)} s"
        return f"Largest {what}: {number(self.size)} {self.unit} {where}."


def peaks(result: Result, kind: str) -> list[Peak]:
    """The largest error of a kind, one for each unit."""
    found = []
    e, names = np.abs(getattr(result, kind)), row_names(result, kind)
    for unit, columns in columns_by_unit(result.units(kind)[0]).items() if names else ():
        shown, factor = display(unit)
        t, row, axis = np.unravel_index(int(e[:, :, columns].argmax()), (*e.shape[:2], len(columns)))
        size = factor * float(e[t, row, columns[axis]])
        name = names[row] if kind == "tracking_error" else f"pair {names[row]}"
        found.append(
            Peak(kind, size, shown, float(result.t[t]), name, result.info["axes"][columns[int(axis)]])
        )
    return found


def robots_table(result: Result, computed: Metrics) -> Table:
    """A row for each robot: its errors, and its torque beside its limits."""
    errors = _error_columns(result, "tracking_error", computed.tracking_error)
    return _table("robot", result.names, [*errors, *_torques(result, computed)], OF_ROBOTS)


def pairs_table(result: Result, computed: Metrics) -> Table:
    """A row for each pair of robots that is compared: its synchronization errors."""
    columns = _error_columns(result, "sync_error", computed.sync_error)
    caption = (
        "Synchronization errors, in the same way; the number of a pair is the index of its ε in the figures."
    )
    return _table("pair", row_names(result, "sync_error"), columns, caption)


def _error_columns(result: Result, kind: str, computed: ErrorMetrics) -> list[Column]:
    found, symbol = [], _CALLED[kind][1]
    for unit, axes in columns_by_unit(result.units(kind)[0]).items():
        shown, factor = display(unit)
        for words, sizes in (
            ("largest |{}|", computed.peak),
            ("RMS {}", computed.rms),
            ("|{}| at the end", np.abs(computed.final)),
        ):
            found.append(_column(f"{words.format(symbol)}, {shown}", factor * sizes[:, axes].max(axis=1)))
        settled = computed.settling_time[:, axes].max(axis=1)
        found.append(_column("settled, s", settled, bad=np.isinf(settled)))
    return found


def _torques(result: Result, computed: Metrics) -> list[Column]:
    """The largest torques in each unit, and how near they came to a limit."""
    units = [[*row] for row in result.units("tau")]
    found = []
    for unit in dict.fromkeys(unit for row in units for unit in row):
        own = [[k for k, each in enumerate(row) if each == unit] for row in units]
        most = [row[columns].max(initial=0.0) for row, columns in zip(computed.peak_torque, own, strict=True)]
        found.append(_column(f"largest {'force' if unit == 'N' else 'torque'}, {unit}", np.array(most)))
    shares = np.array([torque_share(result, computed, i)[0] for i in range(len(result.names))])
    if np.isfinite(shares).any():
        head = "of its limit, %"
        found.append(_column(head, 100 * shares, bad=shares > 1))
    return found


def torque_share(result: Result, computed: Metrics, robot: int) -> tuple[float, str]:
    """How near the torque of a robot came to a limit of its description, as a share, and of which joint.

    NaN and no name if none of its joints has a limit.
    """
    about = result.info["robots"][robot]
    shares = [
        (float(most) / limit, name)
        for most, limit, name in zip(
            computed.peak_torque[robot], about.get("torque_limits") or (), about["joints"], strict=False
        )
        if limit is not None and 0 < limit < np.inf
    ]
    return max(shares, default=(float("nan"), ""))


def _column(head: str, values: np.ndarray, bad: np.ndarray | None = None) -> Column:
    return Column(
        head,
        values,
        [_written(value) for value in values],
        np.zeros(len(values), bool) if bad is None else bad,
    )


def _written(value: float) -> str:
    return "not yet" if np.isposinf(value) else "-" if np.isnan(value) else number(float(value))


def _table(what: str, names: Sequence[str], columns: Sequence[Column], caption: str) -> Table:
    rows = tuple((printable(name), *(column.texts[k] for column in columns)) for k, name in enumerate(names))
    marked = {(k, c) for c, column in enumerate(columns, start=1) for k in worst(column)}
    return Table((what, *(column.head for column in columns)), rows, caption, (), frozenset(marked))


def worst(column: Column) -> set[int]:
    """The rows of a column that are marked: what is bad, and the largest number where others are smaller."""
    found = {int(k) for k in np.flatnonzero(column.bad)}
    known = np.where(np.isnan(column.values), -np.inf, column.values)
    if len(known) > 1 and known.max() > known.min():
        found.add(int(known.argmax()))
    return found


# -- in words ----------------------------------------------------------------------------------------------


def headline(result: Result) -> tuple[str, bool]:
    """Whether the run came to its end, in a sentence, and as a truth value."""
    end, planned = float(result.t[-1]), result.info.get("duration")
    if result.status == COMPLETED:
        return f"The run came to its end, t = {number(end, 6)} s.", True
    of = f" of {number(planned, 6)} s" if isinstance(planned, int | float) else ""
    why = result.status.removeprefix("stopped: ")
    return f"The run stopped at t = {number(end, 6)} s{of}: {why}.", False


def sentences(result: Result, computed: Metrics) -> list[str]:
    """What is to be known first: what ran, the largest errors, and the torque nearest to a limit."""
    found = [_made_of(result)]
    found += [str(peak) for kind in _CALLED for peak in peaks(result, kind)]
    shares = [(*torque_share(result, computed, i), name) for i, name in enumerate(result.names)]
    known = [each for each in shares if not np.isnan(each[0])]
    if known:
        share, joint, name = max(known)
        found.append(f"Nearest to a limit of torque: {name}, {joint}, with {number(100 * share)}% of it.")
    return found


def warnings(result: Result) -> list[str]:
    """What speaks against trusting or repeating a run: limits that were left, too long a step."""
    return [*_limits(result), *_cut_off(result), *_step(result)]


def _made_of(result: Result) -> str:
    count, pairs = len(result.names), len(result.info["pairs"])
    law = (result.info.get("law") or {}).get("name", "a law without a name")
    robots = "1 robot" if count == 1 else f"{count} robots"
    compared = f"{pairs} comparison{'' if pairs == 1 else 's'} ({result.info.get('coupling', 'coupling')})"
    step = result.info.get("dt")
    steps = f", in steps of {number(1e3 * step)} ms" if step else ""
    return f"{robots} with {compared}, under {law}{steps}; {len(result.t)} instants are logged."


def _limits(result: Result) -> list[str]:
    left: Sequence[dict[str, Any]] = result.info.get("limits") or ()
    found = [
        f"{result.names[each['robot']]}, {_joint(result, each)}, left its limit of {each['kind']} at "
        f"t = {number(each['start'])} s: {_shown(each['reached'], each['unit'])}, limit "
        f"{_shown(each['limit'], each['unit'])}."
        for each in left[:MOST_LIMITS]
    ]
    more = len(left) - MOST_LIMITS
    return [*found, f"Limits were left {more} more times."] if more > 0 else found


def _cut_off(result: Result) -> list[str]:
    cut: Sequence[dict[str, Any]] = result.info.get("saturation") or ()
    if not cut:
        return []
    joints = dict.fromkeys(f"{result.names[each['robot']]}, {_joint(result, each)}" for each in cut)
    return [f"Torque was cut off at its limit: {'; '.join([*joints][:MOST_LIMITS])}."]


def _step(result: Result) -> list[str]:
    advised = (result.info.get("step_error") or {}).get("advised_step")
    return (
        [] if advised is None else [f"The step is too long: at most {number(1e3 * advised)} ms is advised."]
    )


def _joint(result: Result, entry: dict[str, Any]) -> str:
    return str(result.info["robots"][entry["robot"]]["joints"][entry["joint"]])


def _shown(value: float, unit: str) -> str:
    shown, factor = display(unit)
    return f"{number(factor * value)} {shown}"
