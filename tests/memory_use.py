"""How much memory runs and large cells take; measured in processes of their own.

`python tests/memory_use.py run ENGINE DURATION LOG_DT [FOLDER]` prints rows, bytes of the arrays, and bytes
beyond them; `python tests/memory_use.py cell ROBOT N` prints bytes of a cell of so many robots, from its
robots to the first steps of the compiled engine.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from synctrl import CartesianSpace, Cell, Coupling, Cubic, Experiment, Gains, Member, Result, load_robot
from synctrl.experiments import planar_four
from synctrl.simulation.result import LAYOUT


class Use(NamedTuple):
    """What a run took: logged instants, bytes of its arrays, and the peak beyond them."""

    rows: int
    arrays: int
    beyond: int


def memory_use(engine: str, duration: float, log_dt: float, folder: Path | None = None) -> Use:
    """Make a run of the four arms in another process, at a step of a millisecond, into memory or a folder."""
    more = [] if folder is None else [str(folder)]
    return Use(*_asked("run", engine, str(duration), str(log_dt), *more))


def cell_use(robot: str, n: int) -> int:
    """Most memory, bytes, that a cell of n robots takes in another process until its first steps are made."""
    return _asked("cell", robot, str(n))[0]


def _asked(*arguments: str) -> list[int]:
    child = subprocess.run([sys.executable, __file__, *arguments], capture_output=True, text=True, check=True)
    return [int(number) for number in child.stdout.split()]


def size(result: Result) -> int:
    """Bytes of all arrays."""
    return sum(getattr(result, name).nbytes for name in LAYOUT)


def peak() -> int:
    """Most memory that this process has had so far, bytes."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def measure_run(engine: str, duration: str, log_dt: str, folder: str | None = None) -> None:
    """Measure and print; a short run comes first, so that what is imported and compiled is not counted."""
    experiment = planar_four()
    experiment.simulate(0.5, engine=engine, log_dt=float(log_dt))
    before = peak()
    result = experiment.simulate(float(duration), engine=engine, log_dt=float(log_dt), log_to=folder)
    print(len(result.t), size(result), peak() - before - (0 if folder else size(result)))


def measure_cell(robot: str, n: str) -> None:
    """Measure and print; a small cell comes first, as above."""
    ring(robot, 4).simulate(2e-3, engine="compiled")
    before = peak()
    ring(robot, int(n)).simulate(2e-3, engine="compiled")
    print(peak() - before)


def ring(name: str, n: int) -> Experiment:
    """n equal robots in a row and a signed ring: planar arms with tasks of the tip, others of the joints."""
    robot, planar = load_robot(name), name == "planar2r"
    q0, theta = (
        np.array([0.4, 1.2]) if planar else np.linspace(-0.6, 0.8, robot.nv),
        robot.inertial_parameters,
    )
    members = []
    for i in range(n):
        placed = robot.placed((1.5 * i, 0, 0))
        start = placed.tip_position(q0)[:2] if planar else q0
        members.append(Member(placed, Cubic(start, start + 0.02, 1.0), q0, theta_hat0=theta))
    space = CartesianSpace("xy") if planar else None
    return Experiment(Cell(members, Coupling.signed_ring(n), space), Gains(4, 4, 0.5, 1, 0.01), 1.0)


if __name__ == "__main__":
    {"run": measure_run, "cell": measure_cell}[sys.argv[1]](*sys.argv[2:])
