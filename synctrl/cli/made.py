"""Making a run, whatever ends it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..errors import RunInterrupted, SynctrlError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .answer import Answer, code_of
from .engines import chosen
from .progress import progress_bar


@dataclass(frozen=True)
class How:
    """How a run is made; the names are those of `Experiment.simulate`, times in s."""

    duration: float | None
    dt: float
    engine: str
    control_period: float | None = None
    log_dt: float | None = None
    plant: str = "pinocchio"


def make_run(answer: Answer, experiment: Experiment, how: How) -> Result:
    """A run; of one that had to stop, or was interrupted, what was computed, and the answer has its error.

    Raises:
        SynctrlError, RunInterrupted: nothing was computed.
    """
    engine, remark = chosen(how.engine, experiment, how.dt, how.control_period)
    answer.data |= {"engine": engine, "engine_remark": remark}
    if remark:
        answer.show(f"By the reference engine, which is slower: {remark}")
    total = experiment.duration if how.duration is None else how.duration
    options: dict[str, Any] = {"engine": engine, "plant": how.plant}
    options |= {"control_period": how.control_period, "log_dt": how.log_dt}
    title = experiment.title or experiment.cell.name
    try:
        with progress_bar(title, total) as told:
            return experiment.simulate(how.duration, how.dt, progress=told, **options)
    except (SynctrlError, RunInterrupted) as error:
        result = error.result
        if not isinstance(result, Result) or not len(result.t):
            raise
        answer.fault(error, code_of(error))
        return result
