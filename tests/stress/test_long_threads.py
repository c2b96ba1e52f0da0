"""Many threads that share one thing and interrupt each other every few instructions."""

from __future__ import annotations

import pytest
from at_once import differing
from shared_work import (
    COMPILED,
    KINDS,
    base_parameters,
    certificates,
    evaluations,
    loading,
    margins,
    questions,
    reaching,
    runs,
    variations,
)

from synctrl import CartesianSpace, PoseSpace

RUNS, THREADS, DURATION = 64, 8, 0.01
ROBOTS = ("planar2r", "a460", "ur5", "panda", "kinova", "random")


@pytest.fixture
def agree(record_property):
    """Asserts that all pieces are those of one thread, and says how many there were."""

    def check(make, count: int = RUNS) -> None:
        wrong = differing(make, count, THREADS)
        equal = f"{count - len(wrong)} of {count} equal bit for bit to those of one thread"
        record_property("figure", f"{equal}, in {THREADS} threads")
        assert wrong == []

    return check


@pytest.mark.parametrize("kind", KINDS)
def test_runs_of_one_experiment(kind, agree):
    agree(lambda: runs(KINDS[kind], DURATION))


@pytest.mark.parametrize("kind", COMPILED)
def test_compiled_runs_of_one_experiment(kind, agree):
    agree(lambda: runs(KINDS[kind], DURATION, engine="compiled"))


def test_compiled_runs_of_one_experiment_on_an_empty_cache(agree, tmp_path, monkeypatch):
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path / "cache"))
    agree(lambda: runs(KINDS["positions"], DURATION, engine="compiled"))


@pytest.mark.parametrize("kind", [kind for kind in KINDS if KINDS[kind].options.keys() <= {"plant"}])
def test_evaluations_of_one_closed_loop(kind, agree):
    agree(lambda: evaluations(KINDS[kind]), 400)


@pytest.mark.parametrize("name", ROBOTS)
def test_questions_to_one_robot(name, agree):
    agree(lambda: questions(name), 1000)


def test_robots_and_couplings_made_at_once(agree):
    agree(lambda: loading(ROBOTS[:-1]))


@pytest.mark.parametrize("name", ["ur5", "panda", "kinova"])
@pytest.mark.parametrize("space", [CartesianSpace(), PoseSpace()], ids=repr)
def test_inverse_kinematics_of_one_robot(space, name, agree):
    agree(lambda: reaching(space, name), 32)


@pytest.mark.parametrize("name", ROBOTS[:-1])
def test_base_parameters_of_one_robot(name, agree):
    agree(lambda: base_parameters(name), 8)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("hidden joints", "MuJoCo")])
def test_certificates_of_one_result(kind, agree):
    agree(lambda: certificates(KINDS[kind]), 8)


def test_gain_conditions_of_one_experiment(agree):
    agree(lambda: margins(KINDS["weights of a function"]), 16)


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
def test_variations_of_what_was_prepared(engine, agree):
    agree(lambda: variations(engine), RUNS)
