"""Generated code is compared with Pinocchio on one robot of each kind, near the origin, whatever the cell."""

from __future__ import annotations

import numpy as np
import pytest
from cells import SMALL_GAINS, random_experiment, small_cell, smooth_motion
from faults import check_fault, empty_cache, row, sources_of
from machines import random_robot, rod_arm
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Experiment,
    Friction,
    FrictionParameters,
    Gains,
    Hold,
    Member,
    PoseSpace,
    Redundancy,
    load_robot,
)
from synctrl.compiled import build, program
from synctrl.compiled.kind import classify
from synctrl.compiled.program import Program
from synctrl.compiled.specimen import Specimen
from synctrl.coupling.synchronization import SynchronizationFunction
from synctrl.errors import CompilationError, SingularJacobianError
from synctrl.robots.parameters import planar_two_link_parameters

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")


@pytest.fixture(autouse=True)
def own_code(tmp_path, monkeypatch):
    """Each test compiles its own."""
    empty_cache(monkeypatch, tmp_path / "cache")


def specimen(experiment: Experiment) -> Specimen:
    loop = experiment.closed_loop()
    return Specimen(loop, classify(loop))


def ring(n: int, distance: float) -> Experiment:
    """Planar arms, turned and far from each other, that hold still."""
    arm, q0 = load_robot("planar2r"), np.array([0.5, 1.2])
    members = []
    for i in range(n):
        robot = arm.placed((distance * i, 0, 0), (0, 0, 0.1 * i))
        hold = Hold(robot.tip_position(q0)[:2])
        members.append(Member(robot, hold, q0, parameters=planar_two_link_parameters(robot)))
    return Experiment(Cell(members, Coupling.signed_ring(n), CartesianSpace("xy")), SMALL_GAINS, 0.01)


def mixed() -> Experiment:
    """Two kinds, one of them redundant, each with friction among its parameters, and several placements."""
    robots = [rod_arm((1.0, 0.5), (0.4, 0.3)), random_robot(3, joints=3, chain=True)]
    members = []
    for i in range(4):
        robot = robots[i % 2].placed((0.5 * i, 0.1, 0.2), (0, 0, 0.4 * i))
        q0 = np.array([0.4, 1.1, 0.3])[: robot.nv]
        friction = Friction(0.2, 0.1)
        parameters = FrictionParameters(robot, friction, armature=True)
        members.append(
            Member(robot, Hold(robot.tip_position(q0)[:2]), q0, parameters=parameters, friction=friction)
        )
    space = CartesianSpace("xy", redundancy=Redundancy([np.zeros(robots[i % 2].nv) for i in range(4)]))
    gains = Gains(4.0, 4.0, 1.0, 2.0, 0.2)
    return Experiment(Cell(members, Coupling.chain(4), space), gains, 0.05, k_r_space="task")


# -- what is asked of a cell ------------------------------------------------------------------------------


def test_weights_that_are_made_for_a_short_run_compile():
    """They know no instant after the end of the run."""
    rng = np.random.default_rng(0)
    members = small_cell().members
    motions = [smooth_motion(rng, 2, 0.02, member.trajectory(0.0).x) for member in members]

    def function(first, second, t):
        turn = np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]])
        return turn @ (first - motions[0](t).x) - (second - motions[1](t).x)

    coupling = SynchronizationFunction(function, 2, 2).coupling(motions, 0.2)
    cell = Cell(
        [Member(m.robot, motion, m.q0) for m, motion in zip(members, motions, strict=True)],
        coupling,
        CartesianSpace("xy"),
    )
    experiment = Experiment(cell, SMALL_GAINS, 0.2)
    expected, found = experiment.simulate(), experiment.simulate(engine="compiled")
    assert np.abs(found.q - expected.q).max() < 1e-9


def test_nothing_that_a_user_has_plugged_in_is_asked_at_an_instant_of_its_own():
    asked = []

    def weights(t):
        asked.append(t)
        return (1.0, -1.0), (0.0, 0.0), (0.0, 0.0)

    class Watched(Hold):
        def __call__(self, t):
            asked.append(t)
            return super().__call__(t)

    cell = small_cell(coupling=Coupling.pair(c=weights))
    members = [Member(m.robot, Watched(m.trajectory(0.0).x), m.q0) for m in cell.members]
    loop = Experiment(Cell(members, cell.coupling, cell.space), SMALL_GAINS, 0.05).closed_loop()
    asked.clear()
    Program(loop)
    assert asked == []


@pytest.mark.parametrize("distance", [1.0, 1e3, 1e6])
def test_where_robots_stand_does_not_matter_to_the_check(distance):
    Program(ring(5, distance).closed_loop())


def test_a_large_cell_compiles_on_an_empty_cache():
    Program(ring(400, 1.5).closed_loop())


def test_the_check_does_not_grow_with_the_cell():
    small, large = specimen(ring(3, 1.5)), specimen(ring(50, 1.5))
    assert small.loop.size == large.loop.size
    assert large.loop.cell.n == 3
    assert set(specimen(mixed()).index) == {0, 1}


def test_the_check_takes_a_robot_that_is_turned():
    """Robots that are turned differently have code for that, and at one that is not it would not show."""
    robot = specimen(ring(30, 1.5)).loop.cell.robots[0]
    assert np.trace(robot.model.jointPlacements[1].rotation) < 0


def test_the_check_looks_at_large_errors_of_orientation_too():
    """Where generated code has closed forms, and where it has series."""
    ur5 = load_robot("ur5")
    q = np.array([0.3, -1.2, 1.5, -0.5, 0.4, 0.2])
    hold = Hold(np.append(ur5.tip_position(q), [0.1, 0.2, 0.3]))
    cell = Cell([Member(ur5, hold, q), Member(ur5, hold, q)], Coupling.pair(), PoseSpace())
    small = specimen(Experiment(cell, Gains(4, 4, 10, 1, 0.1), 0.1))
    angles = []
    for reference, y, _ in small.cases():
        state = small.loop.state(y)
        error = small.loop.cell.task.measure(state.motion, reference.desired).e[:, 3:]
        angles += np.linalg.norm(error, axis=1).tolist()
    assert min(angles) < 0.2
    assert 0.5 < max(angles) < 3


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
def test_a_cell_that_starts_singular_is_told_so_and_not_that_code_differs(engine):
    arm = load_robot("planar2r")
    robots = [arm, arm.placed((1, 0, 0))]
    q0 = np.zeros(2)
    members = [Member(robot, Hold(robot.tip_position(q0)[:2]), q0) for robot in robots]
    cell = Cell(members, Coupling.pair(), CartesianSpace("xy"))
    with pytest.raises(SingularJacobianError):
        Experiment(cell, SMALL_GAINS, 0.05).simulate(engine=engine)


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
def test_a_cell_that_is_singular_everywhere_is_told_so(engine):
    """An arm of three joints in a plane has no way to z."""
    arm = random_robot(0, joints=3, chain=True)
    flat = load_robot("planar2r")
    robots = [arm, flat]
    q0 = [np.array([0.4, 1.1, 0.3]), np.array([0.4, 1.1])]
    members = [
        Member(robot, Hold(robot.tip_position(q)[[0, 2]]), q) for robot, q in zip(robots, q0, strict=True)
    ]
    cell = Cell(members, Coupling.pair(), CartesianSpace("xz"))
    with pytest.raises(SingularJacobianError):
        Experiment(cell, SMALL_GAINS, 0.05).simulate(engine=engine)


@pytest.mark.parametrize("seed", range(2))
def test_cells_that_nobody_chose_pass_the_check(seed):
    Program(random_experiment(seed, "tip", "chain").closed_loop())


@pytest.mark.parametrize("seed", range(2))
def test_robots_that_nobody_chose_pass_the_check(seed):
    robots = [random_robot(10 * seed + k, joints=4, chain=True) for k in range(2)]
    members = [Member(robot, Hold(np.zeros(4))) for robot in robots]
    cell = Cell(members, Coupling.pair())
    Program(Experiment(cell, Gains(4, 4, 10, 1, 0.1), 0.1).closed_loop())


# -- what the check finds ---------------------------------------------------------------------------------

#: how Gamma is handed to the law
GAMMA = row("Gamma", "P")
#: faults of the driver and of the lists before it: a text, and what stands in its place
FAULTS = {
    "a sign of S is lost": ("add(c, sum, c->sign[t], rows", "add(c, sum, splat(1), rows"),
    "a share takes another pair": ("c->incident + t * LANES", "c->incident"),
    "a share's sign is lost": ("vec sign = c->incident_sign[t]", "vec sign = splat(1)"),
    "the place of the base": row("base", "12"),
    "the posture's gain": row("gain", "nv", "posture"),
    "the weights of W": row("W_inv", "nv", "gain"),
    "another robot's damping": row("K_r", "K"),
    "another robot's true parameters": row("pi", "bodies"),
    "Coulomb friction": ("* v_tanh(fast / load(smoothing + j))", "* (fast / load(smoothing + j))"),
    "the cosines": ("store(cosine + j, c)", "store(cosine + j, s)"),
    "the disturbance": ("+ a->disturbance[j]", ""),
    "what adapts": GAMMA,
    "which kind a robot is": ("kinds[c->kind[i]].function(", "kinds[c->kind[0]].function("),
    "the integral's rate": ("a->memory_dot[j] = a->epsilon[j]", "a->memory_dot[j] = a->epsilon_dot[j]"),
    "the leak of the integral": (" - a->leak[j % m] * a->integral[j]", ""),
    "the order of what is desired": row("desired_dot", "m", "desired_ddot"),
}  # fmt: skip


@pytest.fixture(scope="module")
def sources():
    return sources_of(mixed().closed_loop())


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_the_driver_is_found(name, sources, monkeypatch, tmp_path):
    check_fault(mixed().closed_loop(), sources, FAULTS[name], monkeypatch)
    assert not list((tmp_path / "cache").iterdir())


def test_code_that_was_made_from_a_wrong_line_of_the_law_is_found(monkeypatch):
    """As in the cache of somebody who has tried another law without changing the key."""
    loop = mixed().closed_loop()
    from synctrl.control import law

    with monkeypatch.context() as patch:
        patch.setattr(law, "compute_weighted_errors", lambda weights, error: 2 * error)
        wrong = sources_of(loop)
    monkeypatch.setattr(program, "generate", lambda kinds, width: iter(wrong))
    with refused(CompilationError, "generated code") as caught:
        Program(loop)
    assert not caught.value.found <= program.AGREEMENT


def test_a_wrong_library_in_the_cache_is_built_again(sources, monkeypatch, tmp_path):
    broken = [source.replace(*GAMMA) for source in sources]
    with monkeypatch.context() as patch:
        patch.setattr(program, "generate", lambda kinds, width: iter(broken))
        patch.setattr(program, "_compare", lambda *arguments: None)
        Program(mixed().closed_loop())
    (before,) = (path.read_bytes() for path in (tmp_path / "cache").glob("*.so"))
    monkeypatch.setattr(build, "_CHECKED", {})
    Program(mixed().closed_loop())
    (after,) = (path.read_bytes() for path in (tmp_path / "cache").glob("*.so"))
    assert after != before


def test_the_check_runs_once_for_the_runs_of_a_sweep_and_of_a_process(monkeypatch):
    compare, calls = program._compare, []
    monkeypatch.setattr(program, "_compare", lambda *a: (calls.append(1), compare(*a)))
    for _ in range(3):
        small = Experiment(small_cell(), SMALL_GAINS, 0.05)
        small.simulate(0.01, engine="compiled")
    assert len(calls) == 1
