"""A cell file, how its runs are made, and making one, whatever ends it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import RunInterrupted, SynctrlError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .answer import Answer, code_of
from .engines import AUTO, fastest
from .progress import progress_bar

#: of what a run is made with, what all runs of a sweep may share
SHARED = ("duration", "dt", "engine", "control_period")


class Planned(NamedTuple):
    """A cell, and how its runs are made: arguments of `Experiment.simulate`, the engine among them.

    `said` are those of them that the file itself says.
    """

    experiment: Experiment
    how: dict[str, Any]
    said: dict[str, Any]

    @property
    def shared(self) -> dict[str, Any]:
        """What of it all runs of a sweep may share."""
        return {name: value for name, value in self.how.items() if name in SHARED}

    @property
    def kept(self) -> dict[str, Any]:
        """What of it a file keeps: all but what was chosen for this machine, or for the search."""
        chosen = {name: value for name, value in self.how.items() if name not in ("engine", "duration")}
        return chosen | {name: value for name, value in self.said.items() if name == "engine"}


def planned(answer: Answer, cell: Path, **asked: Any) -> Planned:
    """Read a cell file; what is asked for here goes before what the file says of its run.

    Args:
        answer: learns which engine it is to be, and why.
        cell: the file.
        asked: arguments of `Experiment.simulate`; those that are None are the file's.

    Raises:
        CellFileError: what is wrong with the file.
        InputError: a run that cannot be planned.
    """
    from ..cells import read_cell_file

    experiment, said = read_cell_file(cell)
    how = {**said, **{name: value for name, value in asked.items() if value is not None}}
    remark = ""
    if how.get("engine", AUTO) == AUTO:
        how["engine"], remark = fastest(experiment, how)
    answer.data |= {"engine": how["engine"], "engine_remark": remark}
    if remark:
        answer.show(f"By the reference engine, which is slower: {remark}", "")
    return Planned(experiment, how, dict(said))


def make_run(answer: Answer, experiment: Experiment, how: Mapping[str, Any]) -> Result:
    """A run; of one that had to stop, or was interrupted, what was computed, and the answer has its error.

    Raises:
        SynctrlError, RunInterrupted: nothing was computed.
    """
    try:
        title, total = experiment.title or experiment.cell.name, how.get("duration", experiment.duration)
        with progress_bar(title, total) as told:
            return experiment.simulate(**how, progress=told)
    except (SynctrlError, RunInterrupted) as error:
        result = error.result
        if not isinstance(result, Result) or not len(result.t):
            raise
        answer.fault(error, code_of(error))
        return result
