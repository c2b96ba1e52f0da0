"""Two versions of the package side by side: a checkout of a commit, and processes that take turns."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Timer
from typing import Any, NamedTuple, TypeVar

import numpy as np

SCRIPTS = Path(__file__).resolve().parent
REPOSITORY = SCRIPTS.parent
#: how long one job may take, s
LONGEST = 900.0
Key = TypeVar("Key", bound=Hashable)


class Unmeasured(Exception):
    """What a version does not have, or what this machine cannot do."""


class Worker:
    """A process that does jobs for the package in a folder; one that ended is started anew.

    Args:
        folder: has the package.
        cache: of compiled code.
    """

    def __init__(self, folder: Path, cache: Path):
        self.folder, self._cache = folder, cache
        self._process: subprocess.Popen[str] | None = None

    def ask(self, do: str, **job: Any) -> dict[str, Any]:
        """What a job found.

        Raises:
            Unmeasured: with what went wrong.
        """
        process = self._process = self._process or self._start()
        assert process.stdin is not None and process.stdout is not None
        watch = Timer(LONGEST, process.kill)
        watch.start()
        try:
            process.stdin.write(json.dumps({"do": do, **job}) + "\n")
            process.stdin.flush()
            line = process.stdout.readline()
        except BrokenPipeError:
            line = ""
        finally:
            watch.cancel()
        if not line:
            self.close()
            raise Unmeasured(f"its process ended, or took more than {LONGEST:g} s")
        answer = json.loads(line)
        if "error" in answer:
            raise Unmeasured(answer["error"])
        return answer

    def once(self, do: str, **job: Any) -> dict[str, Any]:
        """What a job finds in a process of its own."""
        fresh = Worker(self.folder, self._cache)
        try:
            return fresh.ask(do, **job)
        finally:
            fresh.close()

    def script(self, name: str, *arguments: str) -> None:
        """Run one of the version's scripts.

        Raises:
            Unmeasured: it failed; with its last words.
        """
        command = [sys.executable, str(self.folder / "scripts" / name), *arguments]
        run = subprocess.run(command, env=self._environment(), capture_output=True, text=True, check=False)
        if run.returncode:
            raise Unmeasured(f"{name} ended with {run.returncode}: {run.stderr.strip().splitlines()[-1:]}")

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            with suppress(OSError):  # what was not written is of no use any more
                self._process.communicate(timeout=10)
            self._process = None

    def _start(self) -> subprocess.Popen[str]:
        command = [sys.executable, str(SCRIPTS / "benchmark_worker.py")]
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        return subprocess.Popen(
            command, text=True, env=self._environment(), stderr=subprocess.DEVNULL, **pipes
        )

    def _environment(self) -> dict[str, str]:
        """Variables with which this package is found, and its cache."""
        own = {"PYTHONPATH": str(self.folder), "SYNCTRL_CACHE": str(self._cache)}
        return {**os.environ, **own, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}


class Pair(NamedTuple):
    """The working tree and another commit, and what they are called."""

    now: Worker
    then: Worker
    now_is: str
    then_is: str

    @property
    def workers(self) -> dict[str, Worker]:
        """By the names that jobs have for them."""
        return {"now": self.now, "then": self.then}


class Job(NamedTuple):
    """A measurement: by which worker, of what, and the arguments."""

    by: str
    do: str
    arguments: Mapping[str, Any]


def in_turns(
    pair: Pair, jobs: Mapping[Key, Job], rounds: int
) -> tuple[dict[Key, np.ndarray], dict[Key, str]]:
    """Seconds, per robot, of every job in every round, (rounds,), and why others have none.

    Jobs take turns, forwards in one round and backwards in the next.
    """
    found: dict[Key, list[float]] = {key: [] for key in jobs}
    failed: dict[Key, str] = {}
    for number in range(rounds):
        for key in list(jobs)[:: 1 if number % 2 == 0 else -1]:
            by, do, arguments = jobs[key]
            if key in failed:
                continue
            try:
                answer = pair.workers[by].ask(do, **arguments)
                found[key].append(answer["seconds"] / answer.get("robots", 1))
            except Unmeasured as reason:
                failed[key] = str(reason)
    return {key: np.array(times) for key, times in found.items() if key not in failed}, failed


@contextmanager
def side_by_side(commit: str) -> Iterator[Pair]:
    """The working tree and a commit of the repository, in a temporary folder.

    Raises:
        Unmeasured: there is no such commit, or the package that is found is another one.
    """
    with tempfile.TemporaryDirectory(prefix="benchmark-") as name:
        folder = Path(name)
        archive = _git("archive", "--format=tar", commit)
        with tarfile.open(fileobj=io.BytesIO(archive)) as files:
            files.extractall(folder / "then", filter="data")
        trees = {"now": REPOSITORY, "then": folder / "then"}
        workers = {key: Worker(tree, folder / f"cache-{key}") for key, tree in trees.items()}
        try:
            for worker in workers.values():
                _check_home(worker)
            yield Pair(*workers.values(), _here(), _called(commit))
        finally:
            for worker in workers.values():
                worker.close()


def _check_home(worker: Worker) -> None:
    """Raise if a worker runs another package than that of its folder."""
    found = Path(worker.ask("hello")["package"])
    if not found.is_relative_to(worker.folder.resolve()):
        raise Unmeasured(f"expected the package of '{worker.folder}', found '{found}'")


def _git(*arguments: str) -> bytes:
    command = ["git", "-C", str(REPOSITORY), *arguments]
    run = subprocess.run(command, capture_output=True, check=False)
    if run.returncode:
        raise Unmeasured(run.stderr.decode(errors="replace").strip())
    return run.stdout


def _short(commit: str) -> str:
    return _git("rev-parse", "--short=7", f"{commit}^{{commit}}").decode().strip()


def _called(commit: str) -> str:
    """What a commit is called in the tables."""
    return "version 0.1" if _short(commit) == VERSION_0_1 else _short(commit)


def _here() -> str:
    """The commit of the working tree, and whether something of the package is different."""
    changed = _git("status", "--porcelain", "--", "synctrl", "scripts").strip()
    return _short("HEAD") + (" with changes" if changed else "")


#: the commit of version 0.1
VERSION_0_1 = "1e460aa"
