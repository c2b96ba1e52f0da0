"""Payloads picked up and put down during a run, of which the controller is not told."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from machines import random_robot, seeds
from refusals import refused

from synctrl import Cell, Coupling, Cubic, Experiment, Gains, Member, Payload, Result, Robot, load_robot
from synctrl.errors import FrameNotFound, InputError
from synctrl.robots.documents import weld
from synctrl.robots.payload import carrying
from synctrl.robots.urdf import describe

BOX = np.array([[0.02, 0.003, 0.0], [0.003, 0.03, -0.002], [0.0, -0.002, 0.025]])
GAINS = Gains(Lambda=6.0, beta=3.0, K_r=20.0, K_eps=5.0, Gamma=0.05)


def pair(robot: Robot, *payloads: Payload) -> Experiment:
    """Two A460 that roughly know their own parameters, and nothing of payloads."""
    members = []
    for i in range(2):
        start = np.linspace(0.3, 1.0, robot.nv) + 0.2 * i
        path = Cubic(start, start + 0.5, 0.5)
        members.append(Member(robot, path, theta_hat0=0.8 * load_robot("a460").inertial_parameters))
    return Experiment(Cell(members, Coupling.pair()), GAINS, 0.5, payloads=payloads)


def welded(mass: float) -> Robot:
    """The A460 with a box at its wrist, described as one robot."""
    description = describe(weld("a460", "wrist", mass, com=(0.05, 0.02, 0.1), inertia=BOX), tip="wrist")
    return Robot(description.model, "wrist", name="a460", document=description.document)


def box(mass: float, **window: float) -> Payload:
    return Payload(0, mass, (0.05, 0.02, 0.1), BOX, "wrist", **window)


@settings(max_examples=20)
@given(seed=seeds)
def test_a_loaded_robot_has_the_energy_and_momentum_of_robot_and_load(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(seed)
    load = Payload(0, rng.uniform(0.1, 3), rng.normal(size=3), BOX)
    loaded = carrying(robot, load)
    q, v = rng.normal(size=(2, robot.nv))
    pose, J = robot.tip_pose(q), robot.jacobian(q)
    arm = pose.rotation @ np.array(load.com)
    J_com = J[:3] + np.cross(J[3:].T, arm).T
    I = pose.rotation @ load.inertia @ pose.rotation.T
    added = load.mass * J_com.T @ J_com + J[3:].T @ I @ J[3:]
    np.testing.assert_allclose(loaded.mass_matrix(q) - robot.mass_matrix(q), added, atol=1e-10)
    kinetic = load.mass * (J_com @ v) @ (J_com @ v) / 2 + (J[3:] @ v) @ I @ (J[3:] @ v) / 2
    both = v @ robot.mass_matrix(q) @ v / 2 + kinetic
    assert v @ loaded.mass_matrix(q) @ v / 2 == pytest.approx(both, rel=1e-10)
    weight = -load.mass * J_com.T @ robot.gravity_vector
    np.testing.assert_allclose(loaded.gravity(q) - robot.gravity(q), weight, atol=1e-9)


def test_carrying_all_the_time_is_the_robot_with_the_payload_welded_on() -> None:
    carried = pair(load_robot("a460"), box(1.5)).simulate()
    own = Cell(
        [
            Member(robot, m.trajectory, theta_hat0=m.theta_hat0)
            for m, robot in zip(
                pair(load_robot("a460")).cell.members, (welded(1.5), load_robot("a460")), strict=True
            )
        ],
        Coupling.pair(),
    )
    expected = Experiment(own, GAINS, 0.5).simulate()
    np.testing.assert_allclose(carried.q, expected.q, atol=1e-10)
    np.testing.assert_allclose(carried.tau, expected.tau, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("options", [{}, {"integrator": "DOP853"}, {"control_period": 1e-3}])
def test_until_it_is_picked_up_nothing_changes_and_then_the_robot_and_its_neighbour_move_aside(
    options: dict,
) -> None:
    free = pair(load_robot("a460")).simulate(**options)
    loaded = pair(load_robot("a460"), box(2.0, start=0.2, stop=0.35)).simulate(**options)
    before, after = free.t <= 0.2, free.t > 0.21
    np.testing.assert_allclose(loaded.q[before], free.q[before], atol=1e-9)
    assert (np.abs(loaded.q - free.q)[after].max(axis=(1, 2)) > 1e-5).all()
    assert np.abs(loaded.q - free.q)[after, 1].max() > 1e-6, "the neighbour does not notice"


def test_events_between_two_instants_are_met_exactly() -> None:
    payload = box(2.0, start=0.10033, stop=0.30071)
    coarse = pair(load_robot("a460"), payload).simulate(dt=4e-3)
    fine = pair(load_robot("a460"), payload).simulate(dt=5e-4)
    np.testing.assert_allclose(coarse.q, fine.q[::8], atol=1e-7)
    assert coarse.t.shape == (126,)


def test_velocities_are_continuous_and_accelerations_jump() -> None:
    experiment = pair(load_robot("a460"), box(2.0, start=0.2))
    result = experiment.simulate()
    k = int(np.flatnonzero(result.t == 0.2)[0])
    steps = np.abs(np.diff(result.v, axis=0)).max(axis=(1, 2))
    assert steps[k - 1] < 2 * steps[k - 2]
    plant = experiment.closed_loop().plant
    state = result.q[k], result.v[k], result.tau[k]
    jump = plant.at(0.2).acceleration(*state) - plant.at(0.1999).acceleration(*state)
    assert np.abs(jump[0]).max() > 1
    np.testing.assert_array_equal(jump[1], 0)


def lyapunov(result: Result, experiment: Experiment, k: int, t: float) -> float:
    """V of the proof, with the true parameters of what the robots carry at time t."""
    gains, cell = experiment.gains, experiment.cell
    robots = experiment.closed_loop().plant.at(t).robots
    s, epsilon = result.v_error[k], result.sync_error[k]
    E = cell.coupling.matrix.T @ result.sync_integral[k]
    V = 0.5 * gains.K_eps * ((epsilon**2).sum() + gains.Lambda * gains.beta * (E**2).sum())
    for i, robot in enumerate(robots):
        tilde = robot.inertial_parameters - result.theta_hat[k, i]
        V += 0.5 * s[i] @ robot.mass_matrix(result.q[k, i]) @ s[i] + 0.5 * tilde @ tilde / gains.Gamma
    return float(V)


def test_v_of_the_proof_falls_between_events_and_jumps_at_them_because_the_true_parameters_do() -> None:
    experiment = pair(load_robot("a460"), box(2.0, start=0.2, stop=0.35))
    result = experiment.simulate()
    for first, last in ((0, 199), (200, 349), (350, 500)):
        inside = 0.5 * (result.t[first] + result.t[last])
        V = [lyapunov(result, experiment, k, inside) for k in range(first, last + 1, 5)]
        assert (np.diff(V) <= 1e-9 * np.abs(V[0])).all()
    before, after = (experiment.closed_loop().plant.at(t).robots[0] for t in (0.1, 0.2))
    k = 200
    s, theta_hat, q = result.v_error[k, 0], result.theta_hat[k, 0], result.q[k, 0]
    kinetic = 0.5 * s @ (after.mass_matrix(q) - before.mass_matrix(q)) @ s
    tilde = [robot.inertial_parameters - theta_hat for robot in (before, after)]
    known = kinetic + 0.5 * (tilde[1] @ tilde[1] - tilde[0] @ tilde[0]) / experiment.gains.Gamma
    jump = lyapunov(result, experiment, k, 0.2) - lyapunov(result, experiment, k, 0.1)
    assert jump == pytest.approx(known, rel=1e-9)
    assert abs(jump) > 0.1


def test_mujoco_carries_the_same_payload() -> None:
    experiment = pair(load_robot("a460").placed(rpy=(0.2, 0.1, 0.4)), box(2.0, start=0.05, stop=0.1))
    ours, theirs = experiment.simulate(0.15), experiment.simulate(0.15, plant="mujoco")
    np.testing.assert_allclose(theirs.tracking_error, ours.tracking_error, atol=1e-12)


def test_two_payloads_add_up() -> None:
    robot = load_robot("a460")
    plant = pair(robot, box(1.0), box(0.5)).closed_loop().plant
    np.testing.assert_allclose(
        plant.robots[0].mass_matrix(np.ones(3)) - robot.mass_matrix(np.ones(3)),
        welded(1.0).mass_matrix(np.ones(3)) + welded(0.5).mass_matrix(np.ones(3))
        - 2 * robot.mass_matrix(np.ones(3)),
        atol=1e-12,
    )  # fmt: skip


def test_a_result_says_what_was_carried(tmp_path) -> None:
    result = pair(load_robot("a460"), box(1.0, start=0.1)).simulate(0.02)
    assert result.info["payloads"][0]["mass"] == 1.0
    assert result.info["payloads"][0]["stop"] is None
    assert Result.load(result.save(tmp_path / "run.npz")) == result


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Payload(0, -1.0), "payload, mass"),
        (lambda: Payload(0, 1.0, start=0.3, stop=0.2), "payload"),
        (lambda: Payload(0, 1.0, start=np.nan), "payload, start"),
        (lambda: Payload(0, 1.0, inertia=(1.0, 1.0, 3.0)), "payload, inertia"),
        (lambda: Payload(0, 1.0, inertia=np.triu(np.ones((3, 3)))), "payload, inertia"),
        (lambda: Payload(0, 1.0, com=(0, 0)), "payload, com"),
        (lambda: Payload(0, 1.0, inertia="round"), "payload, inertia"),
        (lambda: Payload(0, 1.0, frame=3), "payload, frame"),
        (lambda: pair(load_robot("a460"), Payload(2, 1.0)), "payload, robot"),
        (lambda: pair(load_robot("a460"), Payload(0, 1.0, frame="base")), "payload, frame"),
        (lambda: pair(load_robot("a460"), "box"), "payloads"),
    ],
)
def test_impossible_payloads_are_refused(make, subject: str) -> None:
    with refused(InputError, subject):
        make()


def test_an_unknown_frame_is_refused_with_the_known_ones() -> None:
    with refused(FrameNotFound, robot="a460", frame="wirst"):
        pair(load_robot("a460"), Payload(0, 1.0, frame="wirst"))
