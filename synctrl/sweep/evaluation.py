"""Making runs and writing them down: what sweeps and tuning have in common."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from time import perf_counter
from typing import Any

from ..checks import choice, count
from .backends import BACKENDS, WorkerDied
from .journal import Journal, kept_file
from .measures import Doubt, worst_first
from .rows import Row
from .tasks import Job, Outcome, Task
from .worker import Runner

#: how long a batch should take, s: what it costs to send one is then far below a hundredth of it
BATCH_TIME = 1.0
#: batches per worker at least, so that all of them have something to do until the end
SHARES = 4
#: of how many runs at most whose step was too long one that does is looked for
LOOKED_INTO = 4
#: how often the rest is begun again after a worker has died without a single run being finished in between
RETRIES = 2


class Evaluation:
    """Makes runs of a job, some at a time, and knows those made before.

    Args:
        job: what is run.
        journal: where rows go, or None to keep them in memory only.
        workers: number of processes (or of workers of a new Dask cluster).
        backend: "joblib" for processes of this machine, "dask" for a cluster, "serial" for none of both.
        client: for "dask", a client or the address of a scheduler; by default a cluster of this machine.
        batch: runs per task of a worker; by default as many as take about a second, or fill the lanes.

    Attributes:
        rows: of all runs that are made, by number of the run.
    """

    def __init__(
        self,
        job: Job,
        journal: Journal | None,
        workers: int = 2,
        backend: str = "joblib",
        client: Any = None,
        batch: int | None = None,
    ):
        self.workers, self._batch = count("workers", workers), batch
        self._backend, self._client = choice("backend", backend, tuple(BACKENDS)), client
        if batch is not None:
            count("batch", batch)
        self._runner, self._journal = Runner(job), journal  # whatever has to be compiled is compiled here
        self.rows: dict[int, Row] = {} if journal is None else journal.rows
        self._doubts: dict[int, Doubt] = {}

    @contextlib.contextmanager
    def open(self) -> Iterator[None]:
        """Have the workers ready."""
        with BACKENDS[self._backend](self._runner, self.workers, self._client) as self._crew:
            yield

    def run(self, tasks: Sequence[Task]) -> Iterator[list[Row]]:
        """Make those of the runs that are not made yet; yields rows as soon as they are written.

        Raises:
            ResultError: a row cannot be written.
            SweepFileError: a run made before has other values than its task.
            SweepError: workers die again and again, or a function of the user fails.
        """
        at_once = self._runner.lanes == 1 or self.rows  # else values are drawn while others run
        todo = [task for task in tasks if not self._has(task)] if at_once else tasks
        if todo and self._batch is None:
            first, todo = [*todo[: self._runner.lanes]], todo[self._runner.lanes :]
            yield self._first(first, len(todo))
        attempts = RETRIES
        while todo:
            try:
                size = self._batch or 1
                batches = ([*todo[k : k + size]] for k in range(0, len(todo), size))
                for outcomes in self._crew(batches):
                    yield self._write(outcomes)
                return
            except WorkerDied:
                left = [task for task in todo if task.run not in self.rows]
                attempts = RETRIES if len(left) < len(todo) else attempts - 1
                if attempts < 0:
                    raise
                todo = left

    def look_into_doubts(self) -> dict[int, Doubt]:
        """What is to be doubted of runs that were made here, to their end, by number of the run.

        The worst of those with too long a step are made again, to find out which step would do.
        """
        count = len(self._runner.job.factors)
        for run in worst_first(self._doubts)[:LOOKED_INTO]:
            again = self._runner.outcome(Task(run, tuple(self.rows[run][1 : 1 + count])))
            if again.doubt is not None:
                self._doubts[run] = again.doubt
        return self._doubts

    def _first(self, tasks: Sequence[Task], left: int) -> list[Row]:
        """Make some runs here, to see how long one takes."""
        together = self._runner.go_together(tasks)
        start = perf_counter()
        outcomes = [*self._runner.outcomes(tasks)]
        took = (perf_counter() - start) / len(tasks)
        share = -(-left // (SHARES * self.workers))
        size = max(1, min(int(BATCH_TIME / took), share))
        if together:  # fewer runs side by side take as long
            size = max(size, min(self._runner.lanes, -(-left // self.workers)))
        self._batch = max(size - size % self._runner.lanes, min(size, self._runner.lanes))
        return self._write(outcomes)

    def _has(self, task: Task) -> bool:
        return task.run in self.rows if self._journal is None else self._journal.has(*task)

    def _write(self, outcomes: Sequence[Outcome]) -> list[Row]:
        rows = [outcome.row for outcome in outcomes]
        self._doubts.update({each.row[0]: each.doubt for each in outcomes if each.doubt is not None})
        if self._journal is None:
            self.rows.update({row[0]: row for row in rows})
            return rows
        for outcome in outcomes:
            if outcome.kept is not None:
                outcome.kept.save(kept_file(self._journal.folder, outcome.row[0]))
        self._journal.append(rows)
        return rows


#: an evaluation of a job and a journal, if there is one, by workers that were chosen before
Evaluator = Callable[[Job, Journal | None], Evaluation]


def progress_bar(total: int, done: int, shown: bool) -> Any:
    """A progress bar with rate and time left."""
    from tqdm import tqdm

    return tqdm(total=total, initial=done, unit="run", disable=not shown, smoothing=0.1)
