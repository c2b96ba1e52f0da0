"""An object in several hands in the compiled engine: the runs of the reference engine, or a refusal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from faults import check_fault, empty_cache, row, sources_of
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import random_robot, rod_arm
from refusals import refused
from test_compiled_plant import WAYS, both
from test_traced import evaluated

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Disturbance,
    Experiment,
    Friction,
    Gains,
    Hold,
    Member,
    Payload,
    Redundancy,
)
from synctrl.analysis.certify import certify
from synctrl.assembly import grasp as grasp_module
from synctrl.assembly.body import CarriedObject, Inertia, body_rate, with_share
from synctrl.assembly.grasp import Fixture, Grasp, fixture_wrenches, grasp_matrix, places_on
from synctrl.assembly.plant import CarryingPlant
from synctrl.compiled import program
from synctrl.compiled.carrying import _solve
from synctrl.compiled.header import functions_of
from synctrl.compiled.known import check_known
from synctrl.compiled.program import Program
from synctrl.control.adaptation import Leakage
from synctrl.control.laws import ComputedTorque
from synctrl.coupling.cell import Reference
from synctrl.errors import InputError, NonFiniteError
from synctrl.experiments import carry_planar, carry_ur5
from synctrl.experiments.ur5_payload import payload_motion
from synctrl.robots.payload import holding
from synctrl.simulation.closed_loop import ClosedLoop
from synctrl.sweep.worker import Prepared
from synctrl.tasks.rotations import exp

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

pytestmark = [
    pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning"),
    pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning"),
    pytest.mark.filterwarnings("ignore::synctrl.errors.GainWarning"),
]
SEEDS = st.integers(0, 2**32 - 1)
BODY = CarriedObject(0.8, (0.02, -0.01, 0.03), (0.01, 0.012, 0.014))
FIXTURE = Fixture((300.0, 4.0), (6.0, 0.1))
GAINS = Gains(4.0, 4.0, 1.0, 2.0, 0.2, leak=1.0)
#: which of the arms hold the object
HANDS = (0, 1, 3)


def arms() -> list:
    """Two kinds, one of them redundant, turned and in several places."""
    makes: tuple[Callable, ...] = (
        lambda: rod_arm((1.0, 0.5), (0.4, 0.3)),
        lambda: random_robot(3, joints=3, chain=True),
    )
    return [makes[k == 1]().placed((0.5 * k, 0.1, 0.2), (0, 0, 0.4 * k)) for k in range(4)]


def mixed(hands: tuple[int, ...] = HANDS, body: CarriedObject = BODY, fixture: Fixture = FIXTURE, **options):
    """Four arms of which some hold an object; the last one is wrong about where its tip is."""
    robots, q0 = arms(), [np.array([0.4, 1.1, 0.3])] * 4
    tips = [robot.tip_pose(q[: robot.nv]) for robot, q in zip(robots, q0, strict=True)]
    p, R = np.array([0.6, 0.3, 0.1]), exp(np.array([0.3, -0.2, 0.5]))
    grasps = [Grasp(k, R.T @ (tips[k].translation - p), R.T @ tips[k].rotation, fixture) for k in hands]
    members = []
    for k, (robot, q) in enumerate(zip(robots, q0, strict=True)):
        known = robot
        if k in hands:
            place = tips[k].rotation.T @ (p - tips[k].translation), tips[k].rotation.T @ R
            known = with_share(robot, body.parameters / len(hands), *place)
        if k == 3:
            known = holding(known, (0.01, 0.02, 0.0), exp(np.array([0.0, 0.1, 0.0])))
        q = q[: robot.nv]
        hold = Hold(known.tip_position(q)[:2] + 0.01 * k)
        members.append(Member(known, hold, q, friction=Friction(0.2, 0.1)))
    space = CartesianSpace("xy", redundancy=Redundancy([np.zeros(robot.nv) for robot in robots]))
    cell = Cell(members, Coupling.chain(4), space)
    parts = {"body": body, "grasps": grasps, "robots": robots, "desired": payload_motion()}
    options = {"gains": GAINS, "plant_type": partial(CarryingPlant, at=(p, R), **parts), **options}
    return Experiment(cell, duration=0.03, **options)


# -- the equations ----------------------------------------------------------------------------------------


def turned(rng: np.random.Generator) -> np.ndarray:
    return exp(rng.normal(size=3))


@settings(max_examples=10)
@given(seed=SEEDS, pin=st.booleans())
def test_fixtures_and_objects_are_the_same_in_symbols_as_in_numbers(seed, pin):
    """Also fixtures that do not resist turning."""
    rng = np.random.default_rng(seed)
    state, arm, K, D = rng.normal(size=13), rng.normal(size=(1, 3)), *rng.uniform(1, 9, (2, 1, 6))
    stiff = np.arange(6) < (3 if pin else 6)
    hand = rng.normal(size=(1, 3)), turned(rng)[None], rng.normal(size=(1, 6))
    row = rng.uniform(1, 2, 1), rng.normal(size=3), BODY.inertia, rng.normal(size=3)

    def computed(solve, state, arm, axes, K, D, p, R, nu, mass, com, inertia, g):
        *places, lever = places_on(state, arm, axes)
        on_object, on_hand = fixture_wrenches((p, R, nu), places, K, D)
        load = grasp_matrix(lever)[0] @ on_object[0]
        return load, on_hand, body_rate(Inertia(mass, com, inertia), state, load, g, solve)

    given_ = state, arm, turned(rng)[None], stiff * K, stiff * D, *hand, *row
    expected = computed(np.linalg.solve, *given_)
    for found, part in zip(evaluated(partial(computed, _solve), *given_), expected, strict=True):
        np.testing.assert_allclose(found, part, rtol=1e-9, atol=1e-9 * np.abs(part).max())


@pytest.fixture(scope="module")
def loops() -> dict[str, tuple[ClosedLoop, Program]]:
    """Closed loops, and what was compiled of them."""
    made = {"two UR5": carry_ur5(geometric_error=True, friction=True, leak=2.0), "mixed": mixed()}
    found = {name: experiment.closed_loop() for name, experiment in made.items()}
    return {name: (loop, Program(loop)) for name, loop in found.items()}


@pytest.mark.parametrize("name", ["two UR5", "mixed"])
@settings(max_examples=5)
@given(seed=SEEDS)
def test_both_engines_compute_the_same_rates_wherever_the_object_is(loops, name, seed):
    loop, compiled = loops[name]
    rng, cell = np.random.default_rng(seed), loop.cell
    y = loop.initial_state()
    y += rng.normal(size=y.size) * 1e-2
    reference = cell.references(np.array([0.01]))[0]
    reference = Reference(
        reference.desired + 1e-2 * rng.normal(size=reference.desired.shape), reference.weights
    )
    push = rng.normal(size=cell.v0.shape)
    for i, robot in enumerate(cell.robots):
        push[i, robot.nv :] = y[: cell.v0.size].reshape(cell.v0.shape)[i, robot.nv :] = 0
        y[cell.v0.size : 2 * cell.v0.size].reshape(cell.v0.shape)[i, robot.nv :] = 0
    rates = loop.evaluate(reference, y, push)[0], compiled.state_dot(reference, y, push)
    expected, found = map(loop.state, rates)
    for part in ("q", "v", "z", "memory", "hidden"):
        scale = np.abs(getattr(expected, part)).max()
        np.testing.assert_allclose(getattr(found, part), getattr(expected, part), rtol=0, atol=1e-9 * scale)
    assert np.abs(expected.hidden[7:]).max() > 1


# -- runs -------------------------------------------------------------------------------------------------

PUSH = Disturbance(0, np.array([10.0, 10.0, 10.0, 0.0, 0.0, 0.0]), 0.0103, 0.02)


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_two_ur5_carry_alike_in_both_engines(options):
    experiment = carry_ur5(geometric_error=True, friction=True, leak=2.0)
    run, found = both(replace(experiment, disturbances=[PUSH]), duration=0.03, dt=1e-3, **options)
    assert found.info["engine"] == "compiled" and found.info["grasps"] == run.info["grasps"]
    assert np.abs(found.outputs["internal_force"][-1]).max() > 0.1


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_arms_of_different_kinds_carry_alike_while_some_hold_nothing(options):
    """With loads, torque that is cut off, and pushes; edges on steps and between them."""
    loads = Payload(2, 0.3, start=0.0043), Payload(0, 0.2, start=0.01, stop=0.02)
    pushes = Disturbance(1, 0.3, 0.0052, 0.015), Disturbance(3, -0.3, 0.01, 0.02)
    experiment = mixed(payloads=loads, saturate=True, disturbances=pushes)
    run, _ = both(experiment, duration=0.03, dt=1e-3, **options)
    wrench = run.outputs["hand_wrench"]
    assert wrench.shape[1:] == (len(HANDS), 6) and np.abs(wrench[-1]).max() > 0.1


class Ball(Fixture):
    """One that does not resist turning, and holds more tightly along one axis than along others."""

    @property
    def K(self) -> np.ndarray:  # noqa: N802
        return np.array([300.0, 200.0, 400.0, 0.0, 0.0, 0.0])

    @property
    def D(self) -> np.ndarray:  # noqa: N802
        return np.array([6.0, 5.0, 4.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("way", ["continuous", "sampled and thinned"])
def test_arms_in_a_plane_carry_at_pins_alike(way):
    """The plant tells forces of its own, and moves as any that carries."""
    push = Disturbance(0, (1.0, 1.0), 0.0043, 0.01)
    experiment = replace(carry_planar(geometric_error=True, friction=True, leak=2.0), disturbances=[push])
    run, _ = both(experiment, duration=0.03, dt=1e-3, **WAYS[way])
    assert np.abs(run.outputs["internal_force"][-1]).max() > 0.1


def test_fixtures_that_let_the_object_turn_carry_alike():
    run, _ = both(mixed(fixture=Ball()), duration=0.02, dt=1e-3)
    assert np.abs(run.outputs["hand_wrench"][..., 3:]).max() == 0


PARTS = {
    "law": {"law": ComputedTorque(), "gains": GAINS.independent()},
    "adaptation": {"adaptation": Leakage(0.2, 1.0), "gains": GAINS.replace(Gamma=None)},
}


@pytest.mark.parametrize("parts", PARTS.values(), ids=PARTS)
def test_other_laws_and_ways_to_learn_carry_alike(parts):
    both(mixed(**parts), duration=0.02, dt=1e-3)


def test_a_run_that_breaks_down_ends_alike_with_an_object():
    ends = []
    for engine in ("pinocchio", "compiled"):
        with pytest.raises(NonFiniteError) as caught:
            mixed(gains=GAINS.replace(Gamma=1e9)).simulate(engine=engine)
        ends.append((caught.value.time, caught.value.robot, len(caught.value.result.t), str(caught.value)))
    assert ends[0] == ends[1]


def test_runs_of_both_engines_have_the_same_certificate():
    certificates = [certify(mixed().simulate(engine=engine)) for engine in ("pinocchio", "compiled")]
    one, other = ((found.verdict, found.closes, found.outside) for found in certificates)
    assert one == other


def test_a_run_with_an_object_is_repeated_bit_by_bit():
    one, other = (mixed().simulate(engine="compiled") for _ in range(2))
    for name, array in one.outputs.items():
        np.testing.assert_array_equal(array, other.outputs[name], err_msg=name)


def test_runs_of_a_sweep_are_those_of_single_runs_and_keep_to_the_longest_step():
    experiment = mixed()
    prepared = Prepared(experiment, 0.01)
    alone = experiment.simulate(0.01, engine="compiled")
    np.testing.assert_array_equal(prepared.simulate(experiment).q, alone.q)
    stiff = mixed(fixture=Fixture((1e6, 4.0), (1.0, 0.1)))
    with refused(InputError, "dt", found=1e-3):
        prepared.simulate(stiff)


# -- the code ---------------------------------------------------------------------------------------------


def test_other_objects_fixtures_and_hands_of_the_same_kinds_need_no_new_code():
    libraries: dict = {}
    heavy = CarriedObject(3.0, inertia=(0.1, 0.1, 0.1))
    for experiment in (mixed(), mixed(body=heavy), mixed(fixture=Fixture((50.0, 1.0), (1.0, 0.1)))):
        Program(experiment.closed_loop(), libraries)
    assert len(libraries) == 1


def test_where_hands_are_and_where_they_are_thought_to_be_needs_no_new_code():
    libraries: dict = {}
    for error in (True, False, np.full(6, 1e-3)):
        assert Program(carry_ur5(geometric_error=error).closed_loop(), libraries).kinds == 1
    assert len(libraries) == 1


def test_only_robots_that_hold_something_have_code_for_their_hands(loops):
    loop, _ = loops["mixed"]
    found = program.classify(loop)
    having = [k for k, kind in enumerate(found.kind_of) if "hand" in functions_of(found.kinds[kind])]
    assert tuple(having) == HANDS
    plain = program.classify(Experiment(loop.cell, GAINS, 0.1).closed_loop())
    assert not any("hand" in functions_of(kind) for kind in plain.kinds)


#: faults of the driver and of the lists before it: a text, and what stands in its place
FAULTS = {
    "only the last hand lifts": ("a->lift[j] += one;", "a->lift[j] = one;"),
    "hands do not pull": ("a->moving[i * nv + j] += a->pull[i * nv + j]", "(void)0"),
    "another robot's grasp": row("grasp", "hand*24"),
    "where the hand is": row("true_tool", "hand*12", "tool"),
    "where the robot stands": row("true_base", "12", "base"),
}


@pytest.fixture(scope="module")
def sources():
    return sources_of(mixed().closed_loop())


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_the_driver_that_carries_is_found(name, sources, monkeypatch, tmp_path):
    empty_cache(monkeypatch, tmp_path)
    check_fault(mixed().closed_loop(), sources, FAULTS[name], monkeypatch)


# -- what is refused --------------------------------------------------------------------------------------


class Telling(CarryingPlant):
    """One that tells something else of a run, and moves as the package's own."""

    def account(self, log):
        return {}, {"height": (log["plant_state"][:, 2], "m", ("time",))}


class Slipping(CarryingPlant):
    """One whose fixtures are computed elsewhere."""

    def _wrenches(self, q, v, hidden):
        return super()._wrenches(q, v, hidden)


class Soft(CarriedObject):
    pass


def changed(**parts) -> Experiment:
    experiment = mixed()
    plant_type = experiment.plant_type
    return replace(experiment, plant_type=partial(plant_type.func, **{**plant_type.keywords, **parts}))


REFUSED = {
    "a plant": (
        lambda: replace(mixed(), plant_type=partial(Slipping, **mixed().plant_type.keywords)),
        ("plant", f"{__name__}.Slipping"),
    ),
    "an object": (lambda: changed(body=Soft(0.8)), ("object", f"{__name__}.Soft")),
}


def test_a_plant_that_only_tells_something_else_is_run():
    experiment = mixed()
    run = partial(Telling, **experiment.plant_type.keywords)
    found = replace(experiment, plant_type=run).simulate(0.01, engine="compiled")
    expected = experiment.simulate(0.01, engine="compiled").outputs["object_pose"][:, 2]
    assert (found.outputs["height"] == expected).all() and "object_pose" not in found.outputs


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_the_packages_own_is_refused_by_name(name):
    make, (subject, found) = REFUSED[name]
    with refused(InputError, subject, found=found):
        check_known(make().closed_loop())


@pytest.mark.parametrize(
    ("events", "hidden", "found"),
    [
        ([0.01], 13, "a plant with events"),
        ([], 14, "a plant with a state of its own"),
    ],
)
def test_an_object_with_events_or_more_of_a_state_is_refused(events, hidden, found):
    loop = mixed().closed_loop()
    loop.plant.events, loop.plant.hidden0 = events, np.resize(loop.plant.hidden0, hidden)
    with refused(InputError, "plant", found=found):
        check_known(loop)


def test_lines_of_the_fixtures_that_somebody_has_exchanged_are_refused(monkeypatch, tmp_path):
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path))
    loop = mixed().closed_loop()
    monkeypatch.setattr(grasp_module, "fixture_wrenches", lambda *given: fixture_wrenches(*given))
    with refused(InputError, "function 'fixture_wrenches' of synctrl.assembly.grasp"):
        Program(loop)
