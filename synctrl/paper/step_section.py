"""The section of the page on what the fixed step costs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..checks import instance
from ..simulation.result import Result
from .report import Section, Table, Text

TITLE = "What the step costs"


def step_section(runs: Mapping[str, Result]) -> Section:
    """The estimated error of the worst step of every run, with those above the limit in a table.

    Args:
        runs: by name; those of methods that choose their steps, or from before estimates, are left out.

    Raises:
        InputError: something that is no result.
    """
    for name, run in runs.items():
        instance(f"runs, {name}", run, Result, "a Result")
    known = {name: run for name, run in runs.items() if (run.info.get("step_error") or {}).get("estimate")}
    over = {n: run for n, run in known.items() if run.info["step_error"]["advised_step"] is not None}
    estimated = Text(
        "Every run estimates what its worst step errs in velocity, as a share of the largest velocity of the "
        "run, from derivatives that it computes anyway. The error itself is about a third of that."
    )
    advice = ", and would do with the step in the last column." if over else "."
    verdict = Text(f"{len(over)} of {len(known)} runs are above the limit{advice}")
    return Section(TITLE, (estimated, verdict, *([_table(over)] if over else [])))


def _table(runs: Mapping[str, Result]) -> Table:
    titles = [str(run.info["title"]) for run in runs.values()]
    names = [
        name.replace("_", " ") if titles.count(t) > 1 else t for name, t in zip(runs, titles, strict=True)
    ]
    head = ("run", "step, ms", "estimate, %", "limit, %", "at", "t, s", "advised step, ms")
    rows = zip(names, runs.values(), strict=True)
    return Table(head, tuple(_row(name, run, run.info["step_error"]) for name, run in rows))


def _row(name: str, run: Result, found: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        name,
        f"{1e3 * run.info['dt']:g}" if "dt" in run.info else "",
        f"{100 * found['estimate']:.2g}",
        f"{100 * found['limit']:.2g}",
        f"{run.names[found['robot']]}, joint {found['joint'] + 1}",
        f"{found['time']:g}",
        f"{1e3 * found['advised_step']:.2g}",
    )
