"""Where runs are made: here, in processes of this machine (joblib), or on a cluster (Dask)."""

from __future__ import annotations

import ast
import contextlib
import logging
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import chain, islice
from pathlib import Path
from traceback import walk_stack
from types import ModuleType
from typing import Any

from ..checks import instance
from ..errors import InputError, MissingDependencyError, SweepError
from .tasks import Job, Outcome, Task
from .worker import Runner, run_batch, runner_of

GUARD = 'if __name__ == "__main__":'

Batch = Sequence[Task]
#: batches -> outcomes of each, in any order
Crew = Callable[[Iterable[Batch]], Iterator[list[Outcome]]]


class WorkerDied(SweepError):
    """A process ended in the middle of its work."""


@contextlib.contextmanager
def serial(runner: Runner, *_: Any) -> Iterator[Crew]:
    """One run after another, in this process."""
    yield lambda batches: ([*runner.outcomes(batch)] for batch in batches)


@contextlib.contextmanager
def joblib(runner: Runner, workers: int, *_: Any) -> Iterator[Crew]:
    """Workers of this machine: processes, or threads for runs that are made side by side.

    Those leave the interpreter for the library, which serves as many processors as there are threads.
    """
    _need("joblib")
    payload = pickled(runner.job)
    runners, together = deque([runner]), False

    def crew(batches: Iterable[Batch]) -> Iterator[list[Outcome]]:
        nonlocal together
        waiting = iter(batches)
        for first in waiting:
            together = together or runner.go_together(first)
            make = _threads(runners, payload, workers) if together else _processes(payload, workers)
            yield from make(chain([first], waiting))

    yield crew


def _processes(payload: bytes, workers: int) -> Crew:
    """Processes, which start at the first batch."""
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    def crew(batches: Iterable[Batch]) -> Iterator[list[Outcome]]:
        parallel = Parallel(n_jobs=workers, backend="loky", return_as="generator_unordered", batch_size=1)
        outcomes = parallel(delayed(run_batch)(payload, batch) for batch in [*batches])
        try:
            yield from outcomes
        except TerminatedWorkerError as error:
            raise _died(error) from error

    return crew


def _threads(runners: deque[Runner], payload: bytes, workers: int) -> Crew:
    """Threads of this process: each takes a runner that is free, or makes one, and puts it back."""

    def run(batch: Batch) -> list[Outcome]:
        try:
            runner = runners.pop()
        except IndexError:
            runner = runner_of(payload)
        try:
            return [*runner.outcomes(batch)]
        finally:
            runners.append(runner)

    def crew(batches: Iterable[Batch]) -> Iterator[list[Outcome]]:
        waiting = iter(batches)
        with ThreadPoolExecutor(workers) as pool:
            running = deque(pool.submit(run, batch) for batch in islice(waiting, 2 * workers))
            try:
                while running:
                    yield running.popleft().result()
                    running.extend(pool.submit(run, batch) for batch in islice(waiting, 1))
            finally:
                for each in running:
                    each.cancel()

    return crew


@contextlib.contextmanager
def dask(runner: Runner, workers: int, client: Any) -> Iterator[Crew]:
    """A Dask cluster: a client, the address of a scheduler, or None for a cluster on this machine."""
    _need("distributed", "dask[distributed]")
    from distributed import KilledWorker, as_completed

    payload = pickled(runner.job)
    with _connected(client, workers) as connected:

        def submit(batch: Batch) -> Any:
            return connected.submit(run_batch, payload, batch, pure=False)

        def crew(batches: Iterable[Batch]) -> Iterator[list[Outcome]]:
            waiting = iter(batches)
            width = 2 * max(1, sum(connected.nthreads().values()))
            running = as_completed([submit(batch) for batch in islice(waiting, width)])
            try:
                for future in running:
                    yield future.result()
                    for batch in islice(waiting, 1):
                        running.add(submit(batch))
            except KilledWorker as error:
                raise _died(error) from error
            finally:
                connected.cancel(list(running.futures))

        yield crew


BACKENDS = {"joblib": joblib, "dask": dask, "serial": serial}


@contextlib.contextmanager
def _connected(client: Any, workers: int) -> Iterator[Any]:
    """A client as it is; or one made from an address, or for a cluster of this machine, and closed again."""
    from distributed import Client

    if isinstance(client, Client):
        yield client
        return
    if client is not None:
        instance("client", client, str, "a Dask client or an address")
    with contextlib.ExitStack() as stack:
        if client is None:
            client = stack.enter_context(_local_cluster(workers))
        yield stack.enter_context(Client(client))


def _local_cluster(workers: int) -> Any:
    """A Dask cluster of this machine, which says what is wrong by errors and not in its log."""
    from distributed import LocalCluster

    check_main_guard("a Dask cluster of this machine")
    options = {"threads_per_worker": 1, "dashboard_address": None, "silence_logs": logging.CRITICAL}
    try:
        return LocalCluster(n_workers=workers, processes=True, **options)
    except RuntimeError as error:
        raise SweepError(
            f"a Dask cluster of this machine does not start: {_root(error)}; use backend='joblib', or start "
            "one yourself and give its address as `client`"
        ) from None


def pickled(job: Job) -> bytes:
    """A job as bytes for processes that this one starts or trusts; never written to a file.

    Raises:
        InputError: a part of it cannot be sent.
    """
    _need("cloudpickle")
    import cloudpickle

    try:
        return bytes(cloudpickle.dumps(job))
    except Exception as error:
        raise InputError(
            f"it cannot be sent to other processes: {error}; use backend='serial'", subject="sweep"
        ) from error


def check_main_guard(what: str) -> None:
    """Refuse to start processes from a line of the main script that each of them would run again.

    Nothing is refused where no script is imported again, as in a notebook or under `python -m package`.

    Args:
        what: what starts the processes.

    Raises:
        SweepError: the script is no file, or its line that is being run has no main guard; the message names
            file and line.
    """
    main = sys.modules["__main__"]
    file, spec = getattr(main, "__file__", None), getattr(main, "__spec__", None)
    if file is None or (spec is not None and spec.name.endswith("__main__")):
        return
    if not Path(file).is_file():
        raise SweepError(f"{what} starts processes that import '{file}', which is no file; put it into one")
    line = _running_line(main)
    if line is not None and not _is_guarded(Path(file), line):
        raise SweepError(
            f"{what} starts processes that import '{file}', and its line {line} would start more of them "
            f"there; put that line below `{GUARD}`"
        )


def _running_line(main: ModuleType) -> int | None:
    """The line of the main script that is being run, or None if it is another thread that runs it."""
    for frame, line in walk_stack(sys._getframe()):
        if frame.f_globals is vars(main) and frame.f_code.co_name == "<module>":
            return line
    return None


def _is_guarded(file: Path, line: int) -> bool:
    """Whether a line of a script stands in an `if` that asks for `__name__`."""
    tree = ast.parse(file.read_bytes())
    return any(
        node.lineno <= line <= (node.end_lineno or line) and "__name__" in ast.unparse(node.test)
        for node in ast.walk(tree)
        if isinstance(node, ast.If)
    )


def _need(module: str, package: str | None = None) -> None:
    from importlib.util import find_spec

    if find_spec(module) is None:
        raise MissingDependencyError(
            "it is not installed: pip install 'synctrl[sweep]'; or use backend='serial'",
            subject=package or module,
        )


def _root(error: BaseException) -> BaseException:
    """What an error began with."""
    while before := error.__cause__ or error.__context__:
        error = before
    return error


def _died(error: Exception) -> WorkerDied:
    reason = str(error).strip().splitlines()[0]
    return WorkerDied(f"it ended in the middle of its work: {reason}", subject="worker process")
