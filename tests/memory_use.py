"""How much memory a run takes beyond the arrays of its result; run as a process of its own.

`python tests/memory_use.py ENGINE DURATION LOG_DT` prints rows, bytes of the arrays, and bytes beyond them.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from typing import NamedTuple

from synctrl import Result
from synctrl.experiments import planar_four
from synctrl.simulation.result import LAYOUT


class Use(NamedTuple):
    """What a run took: logged instants, bytes of its arrays, and the peak beyond them."""

    rows: int
    arrays: int
    beyond: int


def memory_use(engine: str, duration: float, log_dt: float) -> Use:
    """Make a run of the four arms in another process, at a step of a millisecond."""
    command = [sys.executable, __file__, engine, str(duration), str(log_dt)]
    child = subprocess.run(command, capture_output=True, text=True, check=True)
    return Use(*(int(number) for number in child.stdout.split()))


def size(result: Result) -> int:
    """Bytes of all arrays."""
    return sum(getattr(result, name).nbytes for name in LAYOUT)


def peak() -> int:
    """Most memory that this process has had so far, bytes."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def main(engine: str, duration: str, log_dt: str) -> None:
    """Measure and print; a short run comes first, so that what is imported and compiled is not counted."""
    experiment = planar_four()
    experiment.simulate(0.5, engine=engine, log_dt=float(log_dt))
    before = peak()
    result = experiment.simulate(float(duration), engine=engine, log_dt=float(log_dt))
    print(len(result.t), size(result), peak() - before - size(result))


if __name__ == "__main__":
    main(*sys.argv[1:])
