"""How many operations generated code has, and that code with fewer of them computes the same."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused

from synctrl import Cell, Coupling, Cubic, Experiment, Gains, Member, load_robot
from synctrl.compiled import weighing
from synctrl.compiled.kind import classify
from synctrl.compiled.operations import counted, operations
from synctrl.compiled.trace import SHORT
from synctrl.compiled.weighing import weighing_of
from synctrl.coupling.weights import SmoothWeights, Weights
from synctrl.errors import CompilationError
from synctrl.robots.documents import planar_arm, write_urdf
from synctrl.robots.lumped import bodies_of, lumped_bodies
from synctrl.robots.mechanism import mechanism
from synctrl.robots.symbolic import Symbols

ca = pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

AGREEMENT = 1e-9


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    """A cache of this module's own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SYNCTRL_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def same_run(experiment, duration=0.05):
    """That both engines compute the same run."""
    expected = experiment.simulate(duration)
    found = experiment.simulate(duration, engine="compiled")
    for name in ("q", "v", "tau", "theta_hat", "sync_error", "coupled_error"):
        a, b = getattr(expected, name), getattr(found, name)
        assert np.abs(b - a).max() <= AGREEMENT * (np.abs(a).max() + 1e-12), name


# -- weights ----------------------------------------------------------------------------------------------


def turning(t):
    """Matrices that move."""
    c, s = np.cos(0.3 * t), np.sin(0.3 * t)
    turn = np.array([[c, -s], [s, c]])
    return np.stack((2 * turn, -turn))


def breathing(t):
    """Diagonals that move."""
    return np.array([[2 + np.sin(t), 1.5], [-1.0, -2 + 0.5 * np.cos(t)]])


#: couplings by the structure of their weights, from few operations to many
COUPLINGS = {
    "ONE": lambda: Coupling.pair(c=np.ones(2)),
    "DIAGONAL": lambda: Coupling.pair(c=[[2.0, 0.5], [-1.0, -3.0]]),
    "MOVING_DIAGONAL": lambda: Coupling.pair(c=SmoothWeights.from_function(breathing, 0.1, 2)),
    "CONSTANT": lambda: Coupling.pair(c=turning(1.0)),
    "MOVING": lambda: Coupling.pair(c=SmoothWeights.from_function(turning, 0.1, 2)),
}


def weighted(name):
    return Experiment(small_cell(coupling=COUPLINGS[name]()), SMALL_GAINS, 0.05)


@pytest.mark.parametrize("name", COUPLINGS)
def test_every_structure_of_weights_is_found_and_computes_the_same(name):
    experiment = weighted(name)
    assert weighing_of(experiment.cell) == getattr(weighing, name)
    same_run(experiment)


def test_weights_of_which_more_is_known_need_fewer_operations():
    counts = []
    for name in COUPLINGS:
        (kind,) = classify(weighted(name).closed_loop()).kinds
        counts.append([operations(kind)[part] for part in ("measure", "control")])
    one, diagonal, moving_diagonal, constant, moving = map(np.array, counts)
    for less, more in [
        (one, diagonal),
        (diagonal, moving_diagonal),
        (diagonal, constant),
        (constant, moving),
    ]:
        assert (less < more).all()
    assert (moving_diagonal < moving).all()


def test_weights_that_a_function_gives_may_be_anything():
    coupling = Coupling.pair(c=lambda t: (np.ones(2), np.zeros(2), np.zeros(2)))
    assert weighing_of(small_cell(coupling=coupling)) == weighing.MOVING


@pytest.mark.parametrize("name", COUPLINGS)
def test_numbers_of_weights_are_all_that_is_needed_to_have_them_again(name):
    cell = small_cell(coupling=COUPLINGS[name]())
    known, weights = weighing_of(cell), cell.weights(np.array([0.01, 0.02]))
    numbers = known.numbers(weights)
    assert numbers.shape == (2, cell.n, known.count(cell.m))
    for t, i in np.ndindex(2, cell.n):
        for found, expected in zip(known.weights(numbers[t, i], cell.m), weights, strict=True):
            np.testing.assert_array_equal(found, expected[t, i])


#: a structure, and weights that do not have it
MISFITS = [
    ("ONE", "DIAGONAL"), ("ONE", "CONSTANT"), ("DIAGONAL", "CONSTANT"), ("CONSTANT", "MOVING"),
    ("MOVING_DIAGONAL", "MOVING"),
]  # fmt: skip


@pytest.mark.parametrize(("less", "more"), MISFITS)
def test_weights_that_do_not_fit_a_structure_are_refused(less, more):
    weights = weighted(more).cell.weights(np.array([0.01]))
    with refused(CompilationError, "weights"):
        getattr(weighing, less).numbers(weights)


@pytest.mark.parametrize("name", COUPLINGS)
def test_any_weights_are_made_to_fit_a_structure(name):
    known, parts = getattr(weighing, name), np.random.default_rng(0).normal(size=(3, 4, 3, 3))
    made = known.like(*parts)
    assert known.numbers(made).shape == (4, known.count(3))
    np.testing.assert_allclose(made.c @ made.c_inv, np.broadcast_to(np.eye(3), (4, 3, 3)), atol=1e-10)
    assert isinstance(made, Weights)


def test_robots_of_one_cell_have_weights_of_one_structure():
    """Else robots that are equal would have code of their own, and could not go side by side."""
    coupling = Coupling.pair(c=[np.eye(2), [[1.0, 0.5], [0.0, 1.0]]])
    assert (
        len(classify(Experiment(small_cell(coupling=coupling), SMALL_GAINS, 0.05).closed_loop()).kinds) == 1
    )


def test_the_structure_of_weights_is_part_of_the_key():
    keys = {str(kind.key()) for name in COUPLINGS for kind in classify(weighted(name).closed_loop()).kinds}
    assert len(keys) == len(COUPLINGS)
    (kind,) = classify(weighted("ONE").closed_loop()).kinds
    assert replace(kind, weighing=weighing.MOVING).key() != kind.key()


# -- bodies -----------------------------------------------------------------------------------------------


def plant_of(robot, bodies):
    """Operations of the bias and the mass matrix of bodies that are made somehow, and a function for both."""
    fixed, base = mechanism(robot)
    q, v, pi = (ca.SX.sym(name, size * robot.nv) for name, size in (("q", 1), ("v", 1), ("pi", 10)))
    recursion = Symbols(fixed, q, ca.sin(q), ca.cos(q))
    made = bodies(fixed, pi)
    gravity = ca.SX(base.rotation.T @ robot.gravity_vector)
    found = [recursion.bias(made, v, gravity), recursion.mass_matrix(made)]
    function = ca.Function("plant", [q, v, pi], ca.cse(found))
    return counted(function), function


@pytest.mark.parametrize("name", ["planar2r", "a460", "ur5", "panda"])
def test_lumped_bodies_move_alike_with_fewer_operations(name):
    robot = load_robot(name)
    (many, whole), (few, lumped) = (
        plant_of(robot, way) for way in (lambda fixed, pi: bodies_of(pi), lumped_bodies)
    )
    assert few < many
    state = np.random.default_rng(0).uniform(-1, 1, (2, robot.nv))
    parts = zip(
        whole(*state, robot.inertial_parameters), lumped(*state, robot.inertial_parameters), strict=True
    )
    for expected, found in parts:
        expected, found = np.array(expected), np.array(found)
        assert np.abs(found - expected).max() <= 1e-13 * (1 + np.abs(expected).max())


def chain(joints):
    """Two arms in a plane, as heavy with few joints as with many."""
    with tempfile.TemporaryDirectory() as folder:
        document = planar_arm([1 / joints] * joints, [6 / joints] * joints, f"planar{joints}r")
        arm = load_robot(write_urdf(document, Path(folder) / "arm.urdf"))
    start = np.full(joints, 0.3 / joints)
    members = [
        Member(arm, Cubic(start, 2 * start, 1.0), theta_hat0=0.7 * arm.inertial_parameters) for _ in range(2)
    ]
    return Experiment(Cell(members, Coupling.pair()), Gains(4, 4, 1e-3, 0.01, 1e-4), 0.01)


def test_a_long_chain_computes_the_same_and_costs_the_same_per_joint():
    same_run(chain(SHORT + 1), 0.01)
    counts = []
    for joints in (12, 16, 20):
        (kind,) = classify(chain(joints).closed_loop()).kinds
        counts.append(operations(kind)["evaluation"])
    few, some, many = counts
    assert many - some == some - few


def test_operations_are_counted_and_nothing_else():
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    assert counted(ca.Function("f", [x, y], [x * y + 2, x])) == 2
    assert counted(ca.Function("f", [x, y], [ca.sin(x) / y])) == 2
