"""Where runs are made: here, in processes of this machine (joblib), or on a cluster (Dask)."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from typing import Any

from ..errors import InputError, MissingDependencyError, SweepError
from .main_guard import check_main_guard
from .worker import Job, Outcome, Runner, Task, run_batch

Batch = Sequence[Task]
#: batches -> outcomes of each, in any order
Crew = Callable[[Iterable[Batch]], Iterator[list[Outcome]]]


class WorkerDied(SweepError):
    """A process ended in the middle of its work."""


@contextlib.contextmanager
def serial(runner: Runner) -> Iterator[Crew]:
    """One run after another, in this process."""
    yield lambda batches: ([runner.outcome(task) for task in batch] for batch in batches)


@contextlib.contextmanager
def joblib(job: Job, workers: int) -> Iterator[Crew]:
    """Worker processes of this machine."""
    _need("joblib")
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    payload = pickled(job)

    def crew(batches: Iterable[Batch]) -> Iterator[list[Outcome]]:
        parallel = Parallel(n_jobs=workers, backend="loky", return_as="generator_unordered", batch_size=1)
        outcomes = parallel(delayed(run_batch)(payload, batch) for batch in batches)
        try:
            yield from outcomes
        except TerminatedWorkerError as error:
            raise WorkerDied(_died(str(error))) from error

    yield crew


@contextlib.contextmanager
def dask(job: Job, workers: int, client: Any) -> Iterator[Crew]:
    """A Dask cluster: a client, the address of a scheduler, or None for a cluster on this machine."""
    _need("distributed", "dask[distributed]")
    from distributed import KilledWorker, as_completed

    payload = pickled(job)
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
                raise WorkerDied(_died(str(error))) from error
            finally:
                connected.cancel(list(running.futures))

        yield crew


@contextlib.contextmanager
def _connected(client: Any, workers: int) -> Iterator[Any]:
    """A client as it is; or one made from an address, or for a cluster of this machine, and closed again."""
    from distributed import Client

    if isinstance(client, Client):
        yield client
        return
    if client is not None and not isinstance(client, str):
        raise InputError(
            f"expected a Dask client or an address, found {type(client).__name__}", subject="client"
        )
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
            f"this sweep cannot be sent to other processes: {error}; use backend='serial'"
        ) from error


def _need(module: str, package: str | None = None) -> None:
    from importlib.util import find_spec

    if find_spec(module) is None:
        raise MissingDependencyError(
            f"this needs {package or module}: pip install 'synctrl[sweep]'; or use backend='serial'"
        )


def _root(error: BaseException) -> BaseException:
    """What an error began with."""
    while before := error.__cause__ or error.__context__:
        error = before
    return error


def _died(message: str) -> str:
    return f"a worker process ended in the middle of its work: {message.strip().splitlines()[0]}"
