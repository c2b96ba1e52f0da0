"""Memory: a log that will not fit is refused before the run, and a run takes little beyond its log."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from memory_use import cell_use, memory_use, size
from refusals import refused

from synctrl import Experiment, simulate
from synctrl.errors import InputError, SynctrlError
from synctrl.simulation import memory
from synctrl.simulation.clock import Clock, make_clock
from synctrl.sweep.worker import Prepared

MB = 1_000_000


def suggested(error: InputError) -> float:
    """The interval that would fit, s."""
    return float(re.search(r"log_dt=(\S+) would", str(error))[1])


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
def test_a_log_that_will_not_fit_is_refused_before_the_run_with_one_that_would(engine, monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 100_000)
    experiment, told = Experiment(small_cell(), SMALL_GAINS, 1.0), []
    with refused(InputError, "log_dt") as caught:
        experiment.simulate(engine=engine, progress=told.append)
    assert told == []
    log_dt = suggested(caught.value)
    with refused(InputError, "log_dt"):
        experiment.simulate(engine=engine, log_dt=log_dt - 1e-3)
    run = experiment.simulate(engine=engine, log_dt=log_dt)
    assert size(run) <= 100_000


def test_runs_that_were_prepared_are_held_to_the_same(monkeypatch):
    experiment = Experiment(small_cell(), SMALL_GAINS, 1.0)
    prepared = Prepared(experiment, dt=1e-3, engine="pinocchio")
    thin = Prepared(experiment, dt=1e-3, engine="pinocchio", log_dt=0.1)
    monkeypatch.setattr(memory, "available_memory", lambda: 100_000)
    with refused(InputError, "log_dt"):
        prepared.simulate(experiment)
    run = thin.simulate(experiment)
    assert len(run.t) == 11
    assert run == experiment.simulate(log_dt=0.1)


def test_a_log_of_which_not_even_the_ends_fit_says_so(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 100)
    with refused(InputError, "log_dt"):
        simulate(small_cell(), SMALL_GAINS, 0.1)


def test_a_machine_that_does_not_tell_is_trusted(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: None)
    assert simulate(small_cell(), SMALL_GAINS, 0.01).status == "completed"


def test_the_memory_of_this_machine_is_known():
    available = memory.available_memory()
    assert available is None or available > 0


def test_a_control_group_leaves_what_it_does_not_use_and_what_it_can_give_back(tmp_path):
    (tmp_path / "memory.max").write_text("5000000\n")
    (tmp_path / "memory.current").write_text("3000000\n")
    (tmp_path / "memory.stat").write_text("anon 1000000\ninactive_file 500000\n")
    assert 2_500_000 in list(memory._of_group(str(tmp_path)))
    (tmp_path / "memory.max").write_text("max\n")
    assert list(memory._of_group(str(tmp_path))) == []


CHILD = """
import resource
from synctrl.errors import InputError
from synctrl.experiments import planar_four

with open("/proc/self/statm") as file:
    used = int(file.read().split()[0]) * resource.getpagesize()
limit = used + 300_000_000
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
try:
    planar_four().simulate(36_000.0)
except InputError as error:
    print("refused")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="limits of an address space are read from /proc")
def test_the_limit_of_a_process_is_no_memory_error():
    child = subprocess.run([sys.executable, "-c", CHILD], capture_output=True, text=True, check=False)
    assert (child.returncode, child.stdout, child.stderr) == (0, "refused\n", "")


# -- the clock --------------------------------------------------------------------------------------------


def test_stretches_of_a_clock_are_the_whole_run():
    clock = make_clock(1.0003, 1e-3, [0.0402, 0.3, 0.77777], [0.1, 0.50001], log_dt=4e-3)
    for length in (1, 7, 100, 5000):
        parts = [clock.stretch(first, last) for first, last in clock.stretches(length)]
        starts = np.concatenate([part.starts for part in parts])
        np.testing.assert_array_equal(np.append(starts, clock.end), clock.times)
        logged = np.concatenate([part.logged for part in parts])
        np.testing.assert_array_equal(np.append(starts[logged], clock.end), clock.logged)
        checked = np.concatenate([part.checked for part in parts])
        assert set(starts[~checked]) == set(clock.jumps) - set(make_clock(1.0003, 1e-3, [], [0.1]).times)
    assert len(clock.logged) == clock.rows


def test_a_clock_of_a_day_holds_no_instants():
    clock = make_clock(86_400.0, 1e-3, [0.5], [1.0], log_dt=0.1)
    assert isinstance(clock, Clock) and clock.steps == 86_400_000 and clock.rows == 864_001
    last = clock.stretch(clock.steps - 2, clock.steps)
    np.testing.assert_array_equal(last.times, [86_399_998 * 1e-3, 86_399_999 * 1e-3, 86_400.0])
    assert clock.jumps.size == 2 and not any(np.size(part) > 2 for part in vars(clock).values())


# -- runs -------------------------------------------------------------------------------------------------


def test_a_run_takes_little_beyond_the_arrays_of_its_result():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    use = memory_use("compiled", 40.0, 0.01)
    assert use.rows == 4001
    assert use.beyond < 20 * MB


def test_a_run_into_a_folder_takes_as_little_however_long_it_is(tmp_path):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    use = memory_use("compiled", 90.0, 1e-3, tmp_path / "run")
    assert use.arrays > 70 * MB
    assert use.beyond < 10 * MB
    whole = sum(file.stat().st_size for file in (tmp_path / "run").glob("*.npy"))
    assert use.arrays < whole < use.arrays + 0.1 * MB


#: robot -> bytes for each of many of them, from the robot to the first steps of the compiled engine
EACH = {"planar2r": 60_000, "ur5": 120_000}


@pytest.mark.parametrize(("robot", "n"), [("planar2r", 500), ("planar2r", 2000), ("ur5", 400)])
def test_a_large_cell_takes_little_memory_for_each_of_its_robots(robot, n):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    assert cell_use(robot, n) < n * EACH[robot]


def test_too_many_steps_are_refused():
    with refused(SynctrlError, "dt"):
        make_clock(1e6, 1e-3, [])
