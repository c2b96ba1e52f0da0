"""Results and errors travel: copied or pickled, they are what they were, and process pools tell the truth."""

from __future__ import annotations

import copy
import importlib
import inspect
import pickle
import pkgutil
import traceback
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell

import synctrl
from synctrl import Experiment, Result, simulate
from synctrl.errors import NonFiniteError, SimulationError, SynctrlError
from synctrl.simulation.result import LAYOUT


@pytest.fixture(scope="module")
def result():
    return simulate(small_cell(), SMALL_GAINS, 0.02, dt=5e-3)


WAYS = {"pickle": lambda x: pickle.loads(pickle.dumps(x)), "copy": copy.copy, "deepcopy": copy.deepcopy}


@pytest.fixture(params=WAYS.values(), ids=WAYS.keys())
def again(request):
    """A way to get the same thing once more."""
    return request.param


# -- results ----------------------------------------------------------------------------------------------


def test_a_result_is_the_same_and_still_frozen(result, again):
    same = again(result)
    assert type(same) is Result and same == result and same is not result
    assert not any(getattr(same, name).flags.writeable for name in LAYOUT)
    with pytest.raises(TypeError):
        same.info["status"] = "better"
    with pytest.raises(TypeError):
        same.outputs["more"] = np.zeros(5)


def test_copies_share_the_experiment_and_pickles_leave_it_behind(result):
    """It may hold functions that cannot be pickled."""
    unpicklable = Experiment(result.experiment.cell, SMALL_GAINS, 1.0)
    object.__setattr__(unpicklable, "title", lambda: "a function")
    run = result.decimated(1)
    object.__setattr__(run, "experiment", unpicklable)
    assert copy.copy(run).experiment is copy.deepcopy(run).experiment is unpicklable
    assert pickle.loads(pickle.dumps(run)).experiment is None


def test_a_deep_copy_shares_no_arrays(result):
    same = copy.deepcopy(result)
    assert not any(np.shares_memory(getattr(same, name), getattr(result, name)) for name in LAYOUT)
    assert same.info["robots"] is not result.info["robots"]


# -- errors -----------------------------------------------------------------------------------------------


def import_everything() -> None:
    for module in pkgutil.walk_packages(synctrl.__path__, "synctrl."):
        importlib.import_module(module.name)


def kinds(root: type[BaseException]) -> Iterator[type[BaseException]]:
    for kind in root.__subclasses__():
        if kind.__module__.startswith("synctrl."):
            yield kind
        yield from kinds(kind)


import_everything()
#: also those that are no errors, as warnings and interrupts
KINDS = sorted({SynctrlError, *kinds(BaseException)}, key=lambda kind: kind.__name__)
#: a value for every argument that an error has beside its message
VALUES = {
    "time": 0.5,
    "robot": 1,
    "joint": 2,
    "cause": "step",
    **{"order": 2, "row": 0, "error": 3.0},
    "frame": "tol",
    "available": ("tool", "flange"),
    "place": ("robots", 0, "q0"),
    **{"subject": "link 'arm'", "found": 0.25, "file": "arm.urdf", "line": 7},
}


def example(kind: type[BaseException], result: Result) -> BaseException:
    """An error of a kind with all that it can carry."""
    try:
        asked = inspect.signature(kind).parameters
    except ValueError:  # of the interpreter's own
        return kind("what was wrong")
    values = {**VALUES, "message": "what was wrong", "result": result}
    if all(p.kind is p.VAR_POSITIONAL or p.kind is p.VAR_KEYWORD for p in asked.values()):
        return kind("what was wrong")
    unknown = asked.keys() - values.keys()
    assert not unknown, f"give an example of {unknown} of {kind.__name__} in VALUES"
    given = {name: values[name] for name in asked}
    message = [given.pop("message")] if "message" in given else []
    return kind(*message, **given)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_error_keeps_its_message_and_all_it_carries(kind, result, again):
    error = example(kind, result)
    error.added_later = {"by": "a handler"}
    error.add_note("a note")
    try:
        raise error from ValueError("the cause")
    except BaseException as caught:
        same = again(caught)
    assert type(same) is type(error) and str(same) == str(error) and same.args == error.args
    assert vars(same) == vars(error)
    assert repr(same) == repr(error)


def test_a_kind_that_somebody_adds_needs_nothing_for_that(again):
    class Custom(SynctrlError):
        def __init__(self, *, where, found):
            self.where, self.found = where, found
            super().__init__(f"{where}: found {found}")

    globals()["Custom"] = Custom  # pickles name classes by module
    Custom.__qualname__ = "Custom"
    same = again(Custom(where="here", found=[1, 2]))
    assert (same.where, same.found, str(same)) == ("here", [1, 2], "here: found [1, 2]")


# -- process pools ----------------------------------------------------------------------------------------


def diverge() -> Result:
    """A run that must stop: its step is far too long for its gains."""
    gains = SMALL_GAINS.replace(Lambda=1e5)
    return Experiment(small_cell(), gains, 1.0).simulate(dt=1e-2)


def in_executor(job):
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(job).result()


def in_loky(job):
    joblib = pytest.importorskip("joblib")
    return joblib.Parallel(n_jobs=2)([joblib.delayed(job)()])[0]


@pytest.mark.parametrize("pool", [in_executor, in_loky], ids=["concurrent.futures", "joblib"])
def test_a_process_pool_shows_the_real_failure_and_hands_over_the_run(pool):
    with pytest.raises(SimulationError) as here:
        diverge()
    with pytest.raises(SimulationError) as there:
        pool(diverge)
    assert type(there.value) is type(here.value) and str(there.value) == str(here.value)
    assert (there.value.time, there.value.robot) == (here.value.time, here.value.robot)
    assert there.value.result == here.value.result
    assert "diverge" in "".join(traceback.format_exception(there.value))


@pytest.mark.parametrize("pool", [in_executor, in_loky], ids=["concurrent.futures", "joblib"])
def test_a_process_pool_returns_results(pool, result):
    job = partial(simulate, small_cell(), SMALL_GAINS, 0.02, dt=5e-3)
    assert pool(job) == result


def test_an_error_without_a_run_says_so(again):
    same = again(NonFiniteError("too early"))
    assert same.result is None and same.time is None and same.robot is None
