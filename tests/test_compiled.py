"""The compiled engine: the same trajectories as the reference engine, and a cache that can be trusted."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from faults import row
from refusals import refused

from synctrl import CartesianSpace, Cell, Circle, Coupling, Disturbance, Gains, Member, load_robot
from synctrl.compiled import build, tables
from synctrl.compiled.program import Program
from synctrl.compiled.quantities import DESIRED
from synctrl.compiled.weighing import weighing_of
from synctrl.errors import (
    CompilationError,
    InputError,
    MissingDependencyError,
    NonFiniteError,
    SingularJacobianError,
)
from synctrl.experiments import a460_pair, planar_four
from synctrl.simulation.result import LAYOUT
from synctrl.simulation.simulate import Experiment

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

AGREEMENT = 1e-9


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    """A cache of this module's own."""
    patch = pytest.MonkeyPatch()
    folder = tmp_path_factory.mktemp("cache")
    patch.setenv("SYNCTRL_CACHE", str(folder))
    yield folder
    patch.undo()


def assert_same_run(experiment, **options):
    reference = experiment.simulate(**options)
    compiled = experiment.simulate(engine="compiled", **options)
    assert compiled.info["engine"] == "compiled"
    for name in LAYOUT:
        expected, found = getattr(reference, name), getattr(compiled, name)
        scale = np.abs(expected).max() + 1e-12
        assert np.abs(found - expected).max() <= AGREEMENT * scale, name


CASES = {
    "four arms": lambda: planar_four(),
    "independent": lambda: planar_four(synchronized=False),
    "disturbed": lambda: planar_four(disturbance="torque"),
    "disturbed between steps": lambda: planar_four(disturbance=Disturbance(2, 0.4, 0.10003, 0.20007)),
    "damping in task space": lambda: planar_four(k_r_space="task"),
    "other circles": lambda: planar_four(radii="table", phi=0.2),
    "A460 with friction": lambda: a460_pair(),
    "A460 without friction": lambda: a460_pair(friction=False, reference_acceleration="paper"),
}


@pytest.mark.parametrize("name", CASES)
def test_both_engines_compute_the_same_run(name):
    assert_same_run(CASES[name](), duration=0.5)


@pytest.mark.parametrize("name", ["four arms", "A460 with friction"])
def test_both_engines_hold_the_same_samples(name):
    assert_same_run(CASES[name](), duration=0.3, control_period=3e-3)


def weights(t):
    """Non-diagonal weights that change."""
    c = np.array([[[2 + np.sin(t), 0.3], [-0.2, 1.5]], [[-1.0, 0.1 * t], [0.0, -2 + 0.5 * np.cos(t)]]])
    c_dot = np.array([[[np.cos(t), 0.0], [0.0, 0.0]], [[0.0, 0.1], [0.0, -0.5 * np.sin(t)]]])
    c_ddot = np.array([[[-np.sin(t), 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, -0.5 * np.cos(t)]]])
    return c, c_dot, c_ddot


def planar_cell(n, coupling, gains=None, rotated=False):
    """n planar arms on circles."""
    arm = load_robot("planar2r")
    members = []
    for i in range(n):
        robot = arm.placed((i, 0, 0), (0, 0, 0.3 * i if rotated else 0.0))
        q0 = np.array([0.5, 1.2])
        tip = robot.tip_position(q0)[:2]
        path = Circle(tip - [0.05, 0.0], 0.05, speed=1.0 + 0.01 * i)
        members.append(Member(robot, path, q0, theta_hat0=0.5 * robot.inertial_parameters))
    gains = gains or Gains(Lambda=10, beta=5, K_r=2, K_eps=3, Gamma=0.1)
    return Experiment(Cell(members, coupling, CartesianSpace("xy")), gains, duration=0.3)


@pytest.mark.parametrize("acceleration", ["exact", "paper"])
def test_weights_that_change_agree(acceleration):
    experiment = planar_cell(2, Coupling.pair(c=weights))
    assert_same_run(Experiment(experiment.cell, experiment.gains, 0.5, reference_acceleration=acceleration))


@pytest.mark.parametrize(
    "coupling", [Coupling.signed_ring(5), Coupling.star(5), Coupling.complete(5), Coupling.sum(5)]
)
def test_every_graph_agrees(coupling):
    assert_same_run(planar_cell(5, coupling))


def test_robots_that_are_turned_share_one_kind():
    experiment = planar_cell(3, Coupling.chain(3), rotated=True)
    assert_same_run(experiment)
    program = Program(experiment.closed_loop())
    assert program.kinds == 1


def test_code_does_not_grow_with_the_number_of_robots(cache):
    Program(planar_cell(3, Coupling.signed_ring(3)).closed_loop())
    before = sorted(cache.glob("*.so"))
    Program(planar_cell(40, Coupling.signed_ring(40)).closed_loop())
    assert sorted(cache.glob("*.so")) == before


def test_gains_weights_estimates_and_starts_need_no_new_code(cache):
    Program(planar_four().closed_loop())
    before = sorted(cache.glob("*.so"))
    gains = Gains(Lambda=3, beta=1, K_r=0.5, K_eps=2, Gamma=0.01)
    assert_same_run(planar_four(gains=gains, phi=0.15, disturbance="torque"), duration=0.1)
    assert sorted(cache.glob("*.so")) == before


def failure(experiment, **options):
    with pytest.raises((NonFiniteError, SingularJacobianError)) as caught:
        experiment.simulate(**options)
    return caught.value


@pytest.mark.parametrize("gains", [Gains(10, 100, 1, 1, 1e9), Gains(1e5, 0, 1e5, 0, 0.1)])
def test_a_run_that_breaks_down_ends_alike(gains):
    experiment = planar_four(gains=gains)
    expected = failure(experiment, duration=0.5)
    found = failure(experiment, duration=0.5, engine="compiled")
    assert type(found) is type(expected)
    assert found.time == expected.time
    assert found.robot == expected.robot
    assert len(found.result.t) == len(expected.result.t)


def test_what_the_compiled_engine_does_not_do_is_said():
    with refused(InputError, "integrator"):
        planar_four().simulate(integrator="DOP853", engine="compiled")
    with refused(InputError, "engine"):
        planar_four().simulate(engine="fortran")


def test_a_missing_compiler_is_said(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with refused(MissingDependencyError, "CC", found="'no-such-compiler' was not found"):
        planar_four().simulate(duration=0.1, engine="compiled")


def test_a_missing_casadi_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    with refused(MissingDependencyError, "CasADi"):
        planar_four().simulate(duration=0.1, engine="compiled")


def test_a_damaged_entry_is_built_again(monkeypatch, tmp_path):
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path))
    loop = planar_four().closed_loop()
    Program(loop)
    (library,) = tmp_path.glob("*.so")
    good = library.read_bytes()
    library.unlink()
    library.write_bytes(good[: len(good) // 2])
    Program(loop)
    (digest,) = tmp_path.glob("*.sha256")
    assert library.stat().st_size > len(good) // 2
    digest.write_text("stale", encoding="ascii")
    Program(loop)
    assert len(digest.read_text(encoding="ascii")) == 64


def test_code_that_differs_from_pinocchio_is_refused(monkeypatch, tmp_path):
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path))
    compile_sources = build.compile_library

    def tampered(sources, folder):
        broken = [source.replace(*row("Gamma", "P", "pi")) for source in sources]
        return compile_sources(broken, folder)

    monkeypatch.setattr(build, "compile_library", tampered)
    with refused(CompilationError, "generated code") as caught:
        Program(planar_four().closed_loop())
    assert caught.value.found > AGREEMENT
    assert not list(tmp_path.glob("*.so"))


def test_code_that_the_compiler_refuses_leaves_nothing_behind(monkeypatch, tmp_path):
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path))
    sources = iter(["int good(void) { return 0; }", "int bad(void) {", "int unfinished(void) {"])
    with refused(CompilationError, "C compiler", found="refused generated code"):
        build.cached_library("key", lambda: sources, lambda library: None)
    assert not list(tmp_path.iterdir())


def test_what_goes_wrong_while_code_is_written_comes_through(monkeypatch, tmp_path):
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path))

    def write():
        yield "int good(void) { return 0; }"
        raise InputError("no more", subject="source")

    with refused(InputError, "source"):
        build.cached_library("key", write, lambda library: None)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("coupling", [Coupling.pair(), Coupling.pair(c=weights)])
def test_tables_hold_what_the_cell_desires(coupling):
    cell = planar_cell(2, coupling).cell
    instants = np.array([[0.0, 0.1], [0.05, 0.15], [0.1, 0.2]])
    found = tables.tabulated(cell, instants)
    desired = np.stack([found[name] for name in DESIRED], axis=2).reshape(3, 2, 2, 3, 2)
    weighing = weighing_of(cell)
    numbers = np.broadcast_to(found["weights"], (6, 2, weighing.count(2))).reshape(3, 2, 2, -1)
    for stage, times in enumerate(instants):
        for step, reference in enumerate(cell.references(times)):
            np.testing.assert_allclose(desired[stage, step].swapaxes(0, 1), reference.desired)
            for each, *c in zip(numbers[stage, step], *reference.weights, strict=True):
                np.testing.assert_allclose(weighing.weights(each, 2), c)


def test_two_processes_may_build_the_same_code_at_once(monkeypatch, tmp_path):
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path))
    code = (
        "from synctrl.experiments import planar_four; "
        "r = planar_four().simulate(duration=0.05, engine='compiled'); print(r.q.tobytes().hex()[-64:])"
    )
    runs = [subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) for _ in range(2)]
    printed = {run.communicate(timeout=120)[0] for run in runs}
    assert [run.returncode for run in runs] == [0, 0]
    assert len(printed) == 1
    assert len(list(tmp_path.glob("*.so"))) == 1
    assert not list(tmp_path.glob("building-*"))


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
def test_what_a_stopped_run_hands_over_is_finite(engine):
    with pytest.raises(NonFiniteError) as caught:
        a460_pair(gains=Gains(8, 8, 1e6, 10, 0.3)).simulate(0.5, 5e-3, engine=engine)
    for name in LAYOUT:
        assert np.isfinite(getattr(caught.value.result, name)).all(), name
