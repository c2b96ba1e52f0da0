"""An object in the hands of several robots: its motion, the fixtures, and the forces inside."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import load_robot
from synctrl.assembly.body import CarriedObject, moved_parameters, place_of, pose_rate, with_share
from synctrl.assembly.forces import internal_wrenches, stick_wrenches
from synctrl.assembly.grasp import Fixture, Grasp, fixture_wrenches, grasp_matrix
from synctrl.assembly.plant import CarryingPlant
from synctrl.assembly.step import largest_step
from synctrl.coupling.cell import Cell, Member
from synctrl.errors import InputError, SimulationError
from synctrl.experiments import carry_ur5
from synctrl.robots.payload import Payload, carrying, holding
from synctrl.tasks.measurement import Tips
from synctrl.tasks.rotations import exp, skew

UR5 = load_robot("ur5")
BODY = CarriedObject(4.0, (0.03, 0.01, -0.02), (0.02, 0.06, 0.05))
SEEDS = st.integers(0, 2**32 - 1)


def turned(rng, size: float = 1.0) -> np.ndarray:
    return exp(rng.normal(size=3) * size)


# -- the object -------------------------------------------------------------------------------------------


@given(SEEDS)
def test_an_object_moves_as_a_free_flyer_of_pinocchio(seed):
    rng = np.random.default_rng(seed)
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "object")
    model.appendBodyToJoint(1, pin.Inertia.FromDynamicParameters(BODY.parameters), pin.SE3.Identity())
    R, nu, nu_dot = turned(rng), rng.normal(size=6), rng.normal(size=6)
    q = np.concatenate((rng.normal(size=3), pin.Quaternion(R).coeffs()))
    into = np.kron(np.eye(2), R.T)  # the joint's velocity is in the object's axes
    spin = np.concatenate((np.cross(nu[3:], nu[:3]), np.zeros(3)))
    force = pin.rnea(model, model.createData(), q, into @ nu, into @ (nu_dot - spin))
    found = BODY.mass_matrix(R) @ nu_dot + BODY.bias(R, nu[3:], model.gravity.linear)
    np.testing.assert_allclose(into @ found, force, atol=1e-11)


@given(SEEDS)
def test_the_rate_of_a_pose_turns_it_with_the_angular_velocity(seed):
    rng = np.random.default_rng(seed)
    nu, q = rng.normal(size=6), rng.normal(size=4)
    pose, h = np.concatenate((rng.normal(size=3), q / np.linalg.norm(q))), 1e-6
    moved = [place_of(pose + sign * h * pose_rate(pose, nu)) for sign in (1, -1)]
    np.testing.assert_allclose((moved[0][0] - moved[1][0]) / (2 * h), nu[:3], atol=1e-8)
    R_dot = (moved[0][1] - moved[1][1]) / (2 * h)
    np.testing.assert_allclose(R_dot, skew(nu[3:]) @ place_of(pose)[1], atol=1e-8)


@given(SEEDS)
def test_a_share_weighs_like_a_load_welded_on(seed):
    rng = np.random.default_rng(seed)
    d, G = 0.3 * rng.normal(size=3), turned(rng)
    shared = with_share(UR5, BODY.parameters, d, G)
    at_tip = Payload(0, BODY.mass, d + G @ BODY.com, G @ BODY.inertia @ G.T)
    q, v, a = rng.normal(size=(3, 6))
    torque = carrying(UR5, at_tip).inverse_dynamics(q, v, a)
    np.testing.assert_allclose(shared.inverse_dynamics(q, v, a), torque, atol=1e-9 * np.abs(torque).max())


@given(SEEDS)
def test_parameters_moved_there_and_back_are_the_same(seed):
    rng = np.random.default_rng(seed)
    d, R = rng.normal(size=3), turned(rng)
    back = moved_parameters(moved_parameters(BODY.parameters, d, R), -R.T @ d, R.T)
    np.testing.assert_allclose(back, BODY.parameters, atol=1e-12)


def test_a_robot_that_holds_something_is_controlled_there():
    rng = np.random.default_rng(0)
    robot, d, G = load_robot("ur5"), rng.normal(size=3), turned(rng)
    q = rng.normal(size=6)
    hand, held = robot.tip_pose(q), holding(robot, d, G, "thing").tip_pose(q)
    np.testing.assert_allclose(held.translation, hand.translation + hand.rotation @ d, atol=1e-12)
    np.testing.assert_allclose(held.rotation, hand.rotation @ G, atol=1e-12)
    with refused(InputError, "name", found=robot.tip):
        holding(robot, d, G, robot.tip)


# -- forces inside ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("split", [internal_wrenches, stick_wrenches])
@given(SEEDS)
def test_internal_wrenches_do_not_move_the_object_and_a_second_split_changes_nothing(split, seed):
    rng = np.random.default_rng(seed)
    hands = rng.integers(2, 5)
    h, arms = rng.normal(size=(hands, 6)), rng.normal(size=(hands, 3))
    inner = split(h, arms)
    assert np.abs(np.matvec(grasp_matrix(arms), inner).sum(axis=0)).max() < 1e-9
    np.testing.assert_allclose(split(inner, arms), inner, atol=1e-9)


@given(SEEDS)
def test_the_split_does_not_depend_on_the_origin(seed):
    rng = np.random.default_rng(seed)
    h, arms = rng.normal(size=(3, 6)), rng.normal(size=(3, 3))
    np.testing.assert_allclose(
        internal_wrenches(h, arms + rng.normal(size=3)), internal_wrenches(h, arms), atol=1e-9
    )


def test_a_beam_that_two_pure_forces_hold_has_no_internal_wrench_but_the_virtual_stick_calls_it_one():
    h, arms = np.zeros((2, 6)), np.array([[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0]])
    h[:, 2] = 20.0
    assert np.abs(internal_wrenches(h, arms)).max() < 1e-12
    assert np.abs(stick_wrenches(h, arms)[:, 3:]).max() == pytest.approx(20.0 * 0.2)


# -- fixtures ---------------------------------------------------------------------------------------------


@given(SEEDS)
def test_fixtures_store_and_lose_all_the_power_that_goes_into_them(seed):
    rng = np.random.default_rng(seed)
    p_h, p_g, nu_h, nu_g = rng.normal(size=3), rng.normal(size=3), rng.normal(size=6), rng.normal(size=6)
    R_g = turned(rng)
    R_h = turned(rng, 0.5) @ R_g
    fixture = Fixture((800.0, 90.0), (7.0, 3.0))
    K, D = fixture.K[None], fixture.D[None]

    def moved(h: float):
        hand = p_h + h * nu_h[:3], exp(h * nu_h[3:]) @ R_h, nu_h
        place = p_g + h * nu_g[:3], exp(h * nu_g[3:]) @ R_g, nu_g
        return tuple(part[None] for part in hand), tuple(part[None] for part in place)

    def spring(h: float) -> float:
        wrench, _ = fixture_wrenches(*moved(h), K, 0 * D)
        return float(0.5 * np.sum(wrench**2 / K))

    on_object, on_hand = fixture_wrenches(*moved(0.0), K, D)
    power = float(np.sum(on_object * nu_g) + np.sum(on_hand * nu_h))
    rate = (on_object - fixture_wrenches(*moved(0.0), K, 0 * D)[0]) / D
    h = 1e-5
    stored = (spring(h) - spring(-h)) / (2 * h)
    lost = float(np.sum(rate * D * rate))
    assert power == pytest.approx(-stored - lost, rel=1e-6, abs=1e-5 * (abs(stored) + lost))


def energies(plant, q, v, hidden) -> float:
    """Kinetic and potential energy of arms, object and springs."""
    (p, R), nu = place_of(hidden[:7]), hidden[7:]
    g = plant.robots[0].gravity_vector
    total = 0.5 * nu @ plant.body.mass_matrix(R) @ nu - plant.body.mass * g @ (p + R @ plant.body.com)
    for robot, q_i, v_i in zip(plant.robots, q, v, strict=True):
        data, q_i, v_i = robot.model.createData(), q_i[: robot.nv], v_i[: robot.nv]
        total += 0.5 * v_i @ robot.mass_matrix(q_i) @ v_i
        total += pin.computePotentialEnergy(robot.model, data, robot.configuration(q_i))
    wrench = plant._wrenches(q, v, hidden)[0]
    damped = plant.D * rates_of_fixtures(plant, q, v, hidden)
    return float(total + 0.5 * np.sum((wrench - damped) ** 2 / plant.K))


def rates_of_fixtures(plant, q, v, hidden) -> np.ndarray:
    """d', (k, 6), from two dampings."""
    kept = plant.D
    wrench = plant._wrenches(q, v, hidden)[0]
    plant.D = 2 * kept
    twice = plant._wrenches(q, v, hidden)[0]
    plant.D = kept
    return (twice - wrench) / kept


def test_arms_object_and_fixtures_together_keep_their_energy_but_for_torque_and_damping():
    rng = np.random.default_rng(3)
    experiment = carry_ur5()
    plant = experiment.closed_loop().plant
    q, v = experiment.cell.q0 + 1e-3 * rng.normal(size=(2, 6)), 0.1 * rng.normal(size=(2, 6))
    hidden, tau, h = plant.hidden0.copy(), 5 * rng.normal(size=(2, 6)), 1e-6
    hidden[7:] = 0.1 * rng.normal(size=6)
    rates = plant.move(q, v, tau, hidden)
    ends = [
        energies(plant, q + s * h * v, v + s * h * rates[0], hidden + s * h * rates[1]) for s in (1.0, -1.0)
    ]
    power = float(np.sum(tau * v) - np.sum(plant.D * rates_of_fixtures(plant, q, v, hidden) ** 2))
    assert (ends[0] - ends[1]) / (2 * h) == pytest.approx(power, rel=1e-4)


@pytest.mark.parametrize("speed", [0.0, 0.3])
def test_a_grasp_begins_with_no_force_and_an_object_that_moves_with_the_hands(speed):
    experiment = carry_ur5()
    kept, cell = experiment.plant_type.keywords, experiment.cell
    nu = speed * np.arange(1.0, 7.0)
    members = [moving_along(member, kept["at"][0], nu) for member in cell.members]
    plant = CarryingPlant(Cell(members, cell.coupling, cell.space), **kept)
    np.testing.assert_allclose(plant.hidden0[7:], nu, atol=1e-9)
    wrench = plant._wrenches(plant.cell.q0, plant.cell.v0, plant.hidden0)[0]
    assert np.abs(wrench / plant.K).max() < 1e-10


def moving_along(member: Member, origin: np.ndarray, nu: np.ndarray) -> Member:
    """A robot whose tip, at the object's origin, moves with the twist nu."""
    motion, _, J, _ = Tips([member.robot]).poses(member.q0[None], np.zeros((1, 6)))
    np.testing.assert_allclose(motion[0, 0], origin, atol=1e-6)
    return replace(member, v0=np.linalg.solve(J[0], nu))


@given(st.floats(10.0, 1e4))
def test_the_longest_step_of_a_spring_and_of_a_damper_are_those_of_the_method(rate):
    """The growth of a step is 1 again at z^2 = 8 for a spring, at the root of a cubic for a damper."""
    one, none = np.eye(1), np.zeros((1, 1))
    spring = largest_step(one, rate**2 * one, none) * rate
    assert spring == pytest.approx(np.sqrt(8), rel=1e-3)
    z = largest_step(one, none, rate * one) * rate
    assert -1 + z / 2 - z**2 / 6 + z**3 / 24 == pytest.approx(0.0, abs=1e-9)


class Unchecked(CarryingPlant):
    """The same plant, which lets steps be as long as one likes."""

    def longest_step(self, K_r: np.ndarray) -> float:
        return float("inf")


@pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")
@pytest.mark.parametrize("fixture", [Fixture(), Fixture((1e6, 1e4), (800.0, 6.0))])
def test_a_run_is_stable_up_to_the_step_that_is_computed_and_refused_beyond(fixture):
    experiment = carry_ur5(grasp=fixture)
    loop = experiment.closed_loop()
    limit = loop.plant.longest_step(loop.controller.K_r)
    run = experiment.simulate(100 * 0.95 * limit, dt=0.95 * limit)
    wrench = np.linalg.norm(run.outputs["hand_wrench"], axis=(1, 2))
    assert wrench[50:].max() < 1.1 * wrench[:50].max()
    with refused(InputError, "dt", found=1.01 * limit):
        experiment.simulate(10 * limit, dt=1.01 * limit)
    unchecked = replace(experiment, plant_type=partial(Unchecked, **experiment.plant_type.keywords))
    with refused(SimulationError):
        unchecked.simulate(100 * 1.1 * limit, dt=1.1 * limit)


def test_runs_with_fixtures_keep_the_order_of_the_method():
    experiment = carry_ur5()
    runs = [experiment.simulate(8e-3, dt=8e-4 / 2**k) for k in range(4)]
    ends = [np.concatenate((run.outputs["plant_state"][-1], run.q[-1].ravel())) for run in runs]
    errors = [np.linalg.norm(end - ends[-1]) for end in ends[:-1]]
    assert errors[0] > 12 * errors[1] > 144 * errors[2] > 0


def squeezed(**options) -> np.ndarray:
    """Force inside at hand 1 over .8 s, N."""
    run = carry_ur5(**options).simulate(0.8, dt=2e-3, log_dt=0.02, engine="compiled")
    return np.linalg.norm(run.outputs["internal_force"][:, 0, :3], axis=1)


def test_synchronization_takes_force_out_of_a_closed_chain_whose_geometry_is_exact():
    assert squeezed()[-1] < 0.5 * squeezed(synchronized=False)[-1]


def test_the_papers_integral_lets_force_grow_for_a_millimetre_of_error_and_the_independent_law_does_not():
    error = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    paper, alone = (squeezed(geometric_error=error, synchronized=way)[10:] for way in (True, False))
    assert (np.diff(paper) > 0).all() and paper[-1] > 1.5 * alone[-1]
    assert np.ptp(alone) < 0.1 * alone.max()


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Fixture((0.0, 1.0)), "fixture, stiffness"),
        (lambda: Fixture(damping=(1.0, -1.0)), "fixture, damping"),
        (lambda: Grasp(-1), "grasp, robot"),
        (lambda: Grasp(0, rotation=np.ones((3, 3))), "grasp, rotation"),
        (lambda: CarriedObject(-1.0), "payload, mass"),
        (lambda: CarriedObject(1.0, name="two\nlines"), "object, name"),
        (lambda: holding(load_robot("ur5"), np.zeros(3), np.ones((3, 3))), "rotation"),
        (lambda: holding(load_robot("ur5"), np.zeros(3), np.eye(3), 5), "name"),
        (lambda: with_share(load_robot("ur5"), np.zeros(10), np.zeros(2), np.eye(3)), "xyz"),
        (lambda: with_share(load_robot("ur5"), np.zeros(10), np.zeros(3), -np.eye(3)), "rotation"),
        (lambda: CarriedObject(1.0, box=(1.0, 0.0, 1.0)), "object, box"),
        (lambda: carry_ur5(grasp="glue"), "grasp"),
        (lambda: carry_ur5(geometric_error=1.0), "geometric_error"),
    ],
)
def test_what_cannot_be_carried_is_refused(make, subject):
    with refused(InputError, subject):
        make()


@pytest.mark.parametrize(
    ("changed", "subject"),
    [
        (lambda kept: {"at": kept["at"][:1]}, "at"),
        (lambda kept: {"at": (kept["at"][0], np.ones((3, 3)))}, "at, orientation"),
        (lambda kept: {"at": (kept["at"][0][:2], np.eye(3))}, "at, position"),
        (lambda kept: {"body": 4.0}, "body"),
        (lambda kept: {"desired": kept["at"]}, "desired"),
        (lambda kept: {"grasps": kept["grasps"][:1] * 2}, "grasps"),
        (lambda kept: {"grasps": []}, "grasps"),
        (lambda kept: {"grasps": [replace(kept["grasps"][0], robot=2)]}, "grasps"),
        (lambda kept: {"robots": kept["robots"][:1]}, "robots"),
        (lambda kept: {"robots": [load_robot("planar2r")] * 2}, "robots"),
        (lambda kept: {"at": (kept["at"][0] + [0, 2e-6, 0], kept["at"][1])}, "grasps, robot 'UR5 1'"),
        (
            lambda kept: {"at": (kept["at"][0], exp(np.full(3, 2e-6)) @ kept["at"][1])},
            "grasps, robot 'UR5 1'",
        ),
    ],
)
def test_a_plant_refuses_what_does_not_fit_its_robots(changed, subject):
    experiment = carry_ur5()
    kept = experiment.plant_type.keywords
    with refused(InputError, subject):
        CarryingPlant(experiment.cell, **{**kept, **changed(kept)})
