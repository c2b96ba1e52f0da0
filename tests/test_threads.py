"""Threads that share a robot, a controller, a cell or a result get what one thread gets, bit for bit.

Here a few pieces of work each; `tests/stress/test_long_threads.py` has many.
"""

from __future__ import annotations

import copy
import pickle
import warnings
import weakref
from concurrent.futures import ThreadPoolExecutor

import matplotlib
import numpy as np
import pytest
import scipy
from at_once import at_once, differing
from cells import look
from refusals import refused
from shared_work import (
    KINDS,
    base_parameters,
    certificates,
    evaluations,
    figures,
    loading,
    margins,
    questions,
    reaching,
    runs,
    variations,
)

from synctrl import CartesianSpace, Coupling, PoseSpace
from synctrl.errors import CouplingWarning, InputError
from synctrl.experiments import mixed_four, planar_four
from synctrl.robots.model import PerThread

#: duration of a run, s
SHORT = 4e-3


@pytest.fixture(autouse=True)
def _extras(request):
    """Skips what needs an extra that is not installed."""
    for word, library in (("MuJoCo", "mujoco"), ("compiled", "casadi")):
        if word in request.node.name:
            pytest.importorskip(library, reason=f"{library} is an extra")


@pytest.mark.parametrize("kind", KINDS)
def test_runs_of_one_experiment_in_threads_are_those_of_one_thread(kind):
    assert differing(lambda: runs(KINDS[kind], SHORT), 8) == []


@pytest.mark.parametrize("kind", ["joints", "positions", "sampled"], ids="compiled {}".format)
def test_compiled_runs_of_one_experiment_in_threads_are_those_of_one_thread(kind):
    assert differing(lambda: runs(KINDS[kind], SHORT, engine="compiled"), 8) == []


@pytest.mark.parametrize("kind", [kind for kind in KINDS if KINDS[kind].options.keys() <= {"plant"}])
def test_threads_may_share_a_closed_loop(kind):
    assert differing(lambda: evaluations(KINDS[kind]), 32) == []


@pytest.mark.parametrize("name", ["planar2r", "ur5", "panda", "random"])
def test_threads_may_ask_one_robot(name):
    assert differing(lambda: questions(name), 400) == []


def test_threads_may_load_robots_and_make_couplings():
    assert differing(lambda: loading(["planar2r", "a460"]), 8) == []


@pytest.mark.parametrize(
    ("space", "name"), [(CartesianSpace(), "panda"), (PoseSpace(), "ur5")], ids=["position", "pose"]
)
def test_threads_may_solve_inverse_kinematics_of_one_robot(space, name):
    assert differing(lambda: reaching(space, name), 8) == []


def test_threads_may_look_for_base_parameters_of_one_robot():
    assert differing(lambda: base_parameters("a460"), 4) == []


@pytest.mark.parametrize("kind", ["joints", "positions", "friction among the parameters"])
def test_threads_may_certify_one_result(kind):
    assert differing(lambda: certificates(KINDS[kind]), 4) == []


def test_threads_may_look_at_one_gain_condition():
    assert differing(lambda: margins(KINDS["weights of a function"]), 4) == []


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
def test_threads_may_share_what_was_prepared_for_many_runs(engine):
    assert differing(lambda: variations(engine), 12) == []


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda loop: pickle.loads(pickle.dumps(loop))])
@pytest.mark.parametrize("make", [planar_four, mixed_four])
def test_a_copy_of_a_closed_loop_that_was_used_computes_the_same(make, duplicate):
    loop = make().closed_loop()
    y = loop.initial_state() + 0.01
    expected = look(loop, 0.1, y)[0]
    look(loop, 0.0, loop.initial_state())  # leaves other numbers in its memory
    np.testing.assert_array_equal(look(duplicate(loop), 0.1, y)[0], expected)


def test_each_thread_makes_one_of_its_own_when_it_asks_and_drops_it_at_its_end():
    class Memory:
        pass

    made: list[weakref.ref] = []

    def make() -> Memory:
        memory = Memory()
        made.append(weakref.ref(memory))
        return memory

    shared = PerThread(make)
    assert not made
    mine = shared.own
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(lambda: shared.own is shared.own).result()
        assert pool.submit(lambda: shared.own is not mine).result()
    assert shared.own is mine
    assert [memory() is mine for memory in made] == [True, False]
    assert made[1]() is None


def test_couplings_made_in_threads_leave_the_filters_of_warnings_alone():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CouplingWarning)
        ring = Coupling.ring(3)
    before = list(warnings.filters)
    at_once(lambda k: [ring.normalized().matrix, ring.weighted([1.0, 2.0, 3.0]).matrix], 400)
    assert list(warnings.filters) == before


def test_figures_drawn_in_threads_are_those_of_one_thread_and_leave_matplotlib_as_it_was(tmp_path):
    before = matplotlib.rcParams.copy()
    assert differing(lambda: figures(KINDS["joints"], tmp_path), 3, threads=3) == []
    assert matplotlib.rcParams == before


def test_lsoda_of_an_older_scipy_is_for_the_main_thread_only(monkeypatch):
    monkeypatch.setattr(scipy, "__version__", "1.16.3")
    experiment = planar_four()
    experiment.simulate(duration=2e-3, integrator="LSODA")
    with ThreadPoolExecutor(1) as pool:
        run = pool.submit(experiment.simulate, duration=2e-3, integrator="LSODA")
        with refused(InputError, "integrator"):
            run.result()
