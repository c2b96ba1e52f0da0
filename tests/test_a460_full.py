"""The A460 with six joints in the plant, of which the controller knows three."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from refusals import refused

from synctrl import Payload, Result, load_robot
from synctrl.analysis.certify import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.errors import InputError, NonFiniteError
from synctrl.experiments import a460_full_pair, a460_pair
from synctrl.experiments.a460_pair import WRIST
from synctrl.robots.documents import lock
from synctrl.robots.mechanism import joint_limits
from synctrl.robots.urdf import describe
from synctrl.simulation.advance import Sample
from synctrl.simulation.guard import Guard
from synctrl.simulation.held_joints import HELD as OUTPUTS
from synctrl.simulation.held_joints import HeldJointsPlant, Pid

HELD = {"joint4": 0.0, "joint5": 0.0, "joint6": 0.0}


@pytest.fixture(scope="module")
def full_run():
    """Runs with six joints, each computed once."""
    runs = {kind: a460_full_pair(synchronized=kind).simulate(2.5, dt=2e-3) for kind in (True, False)}
    return runs.__getitem__


def test_the_three_joint_arm_is_the_six_joint_arm_with_its_wrist_locked() -> None:
    reduced, known = describe(lock("a460_full", HELD)).model, load_robot("a460")
    for ours, theirs in zip(reduced.inertias, known.model.inertias, strict=True):
        np.testing.assert_allclose(ours.toDynamicParameters(), theirs.toDynamicParameters(), atol=1e-12)


def test_the_plant_moves_as_six_joints_under_the_torques_of_both_controllers() -> None:
    rng = np.random.default_rng(0)
    loop = a460_full_pair(friction=False).closed_loop()
    plant = loop.plant
    q, v, tau = rng.normal(size=(3, 2, 3))
    hidden = rng.normal(size=(2, 3, 3))
    v_dot, hidden_dot = plant.move(q, v, tau, hidden.ravel())
    hidden_dot = hidden_dot.reshape(2, 3, 3)
    for i, robot in enumerate(plant.robots):
        q_wrist, v_wrist, integral = hidden[i]
        held = -WRIST.P * q_wrist - WRIST.D * v_wrist + WRIST.I * integral
        a = np.concatenate([v_dot[i], hidden_dot[i, 1]])
        needed = robot.inverse_dynamics(np.append(q[i], q_wrist), np.append(v[i], v_wrist), a)
        np.testing.assert_allclose(needed, np.append(tau[i], held), atol=1e-9)
        np.testing.assert_array_equal(hidden_dot[i, 0], v_wrist)
        np.testing.assert_array_equal(hidden_dot[i, 2], -q_wrist)


def test_the_wrist_starts_in_balance() -> None:
    loop = a460_full_pair().closed_loop()
    cell, plant = loop.cell, loop.plant
    tau = np.array(
        [robot.gravity(np.append(q, np.zeros(3)))[:3] for robot, q in zip(plant.robots, cell.q0, strict=True)]
    )
    v_dot, hidden_dot = plant.move(cell.q0, cell.v0, tau, plant.hidden0)
    assert np.abs(v_dot).max() < 1e-9
    assert np.abs(hidden_dot).max() < 1e-9


def test_with_a_stiffer_wrist_the_run_comes_closer_to_the_ideal_one() -> None:
    ideal = a460_pair(friction=False).simulate(0.4)
    gaps = []
    for speed in (0.4, 1, 2.5):
        wrist = Pid(speed**2 * WRIST.P, speed**3 * WRIST.I, speed * WRIST.D)
        run = a460_full_pair(wrist=wrist, friction=False).simulate(0.4)
        gaps.append(np.abs(run.q - ideal.q).max())
    assert gaps[0] > 1.5 * gaps[1] > 2.25 * gaps[2] > 0


def test_synchronization_helps_on_every_joint_here_too(full_run) -> None:
    synchronized, independent = (np.abs(full_run(kind).sync_error).max(axis=(0, 1)) for kind in (True, False))
    assert (synchronized < independent).all()


def test_the_result_says_how_far_the_wrist_gave_way(full_run, tmp_path) -> None:
    result = full_run(True)
    for held in result.info["held_joints"]:
        assert held["joints"] == ["joint4", "joint5", "joint6"]
        assert 0 < max(held["largest"]) < np.deg2rad(0.5)
        assert all(final <= largest for final, largest in zip(held["final"], held["largest"], strict=True))
    assert Result.load(result.save(tmp_path / "run.npz")) == result


# -- the certificate --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def certified():
    """A run with half the usual step, and its certificate."""
    run = a460_full_pair().simulate(1.0, dt=5e-4)
    return run, certify(run)


def test_six_joints_are_outside_the_theorem_by_friction_and_by_the_wrist_and_by_nothing_else(
    certified,
) -> None:
    certificate = certified[1]
    assert certificate.verdict == "bounded by Theorem A" and certificate.closes
    friction, wrist = certificate.outside
    assert "friction that the model does not contain" in friction
    assert "forces that the model does not contain" in wrist and "HeldJointsPlant" in wrist


def test_without_friction_the_wrist_alone_is_outside_and_the_usual_step_will_do() -> None:
    certificate = certify(a460_full_pair(friction=False).simulate(0.5))
    (wrist,) = certificate.outside
    assert certificate.closes and not certificate.doubts and "HeldJointsPlant" in wrist


def fastest(friction: bool, six: bool) -> float:
    """The fastest rate of a plant at rest under no change of torque, 1/s."""
    loop = (a460_full_pair if six else a460_pair)(friction=friction).closed_loop()
    plant, q, (n, nv) = loop.plant, loop.cell.q0, loop.cell.q0.shape
    x0 = np.concatenate((q.ravel(), np.zeros(n * nv), plant.hidden0))

    def rate(x: np.ndarray) -> np.ndarray:
        position, v = x[: 2 * n * nv].reshape(2, n, nv)
        v_dot, hidden_dot = plant.move(position, v, np.zeros((n, nv)), x[2 * n * nv :])
        return np.concatenate((v.ravel(), v_dot.ravel(), hidden_dot))

    columns = [(rate(x0 + 1e-7 * d) - rate(x0 - 1e-7 * d)) / 2e-7 for d in np.eye(x0.size)]
    return float(np.abs(np.linalg.eigvals(np.stack(columns, axis=1))).max())


def test_friction_at_rest_is_faster_with_a_free_wrist_and_at_the_limit_of_the_usual_step() -> None:
    """The wrist itself is slow; but a joint that does not carry it rigidly is lighter for friction to stop.

    The classical Runge-Kutta method is stable for real rates up to 2.785 per step.
    """
    step = 1e-3
    assert fastest(friction=True, six=False) < 0.9 * fastest(friction=True, six=True)
    assert 0.95 * 2.785 < step * fastest(friction=True, six=True) < 1.05 * 2.785
    assert step * fastest(friction=False, six=True) < 0.3


def test_what_the_balance_misses_with_the_usual_step_it_misses_while_friction_lets_go() -> None:
    run = a460_full_pair().simulate(0.5)
    drift = np.abs(lyapunov(run).drift)
    assert drift[run.t > 0.02].min() > 0.9 * drift.max()
    assert run.info["step_error"]["time"] < 0.02


def test_motion_and_torque_of_the_held_joints_are_logged_with_units(certified) -> None:
    run = certified[0]
    position, velocity, torque = (run.outputs[name] for name in OUTPUTS)
    assert [run.unit(name) for name in OUTPUTS] == ["rad", "rad/s", "N·m"]
    assert position.shape == velocity.shape == torque.shape == (len(run.t), 2, 3)
    assert run.info["outputs"]["held_torque"]["axes"] == ["time", "robot", "held joint"]
    rate = (position[2:] - position[:-2]) / (run.t[2:] - run.t[:-2])[:, None, None]
    started = slice(10, None)  # the wrist has been let go of at t = 0
    np.testing.assert_allclose(rate[started], velocity[1:-1][started], atol=1e-2 * np.abs(velocity).max())
    for i, held in enumerate(run.info["held_joints"]):
        assert held["largest"] == np.abs(position[:, i]).max(axis=0).tolist()


def test_the_torque_of_the_held_joints_is_the_one_that_moves_them(certified) -> None:
    run, k = certified[0], 1000
    plant, (position, velocity, torque) = (
        a460_full_pair().closed_loop().plant,
        (run.outputs[n] for n in OUTPUTS),
    )
    v_dot = (run.v[k + 1] - run.v[k - 1]) / (run.t[k + 1] - run.t[k - 1])
    held_dot = (velocity[k + 1] - velocity[k - 1]) / (run.t[k + 1] - run.t[k - 1])
    for i, robot in enumerate(plant.robots):
        state = [np.append(a[k, i], b[k, i]) for a, b in ((run.q, position), (run.v, velocity))]
        needed = robot.inverse_dynamics(*state, np.append(v_dot[i], held_dot[i]))
        np.testing.assert_allclose(needed[3:], torque[k, i], atol=1e-3 * np.abs(torque[k]).max() + 1e-4)


def test_the_certificate_of_six_joints_survives_the_file(certified, tmp_path) -> None:
    run, certificate = certified
    loaded = Result.load(run.save(tmp_path / "run.npz"))
    assert certify(loaded, a460_full_pair()).as_dict() == certificate.as_dict()


def test_torque_of_held_joints_stays_within_their_limits_where_the_plant_saturates() -> None:
    experiment = replace(a460_full_pair(wrist=Pid(1e4, 0.0, 1e2)), saturate=True)
    plant = experiment.closed_loop().plant
    limits = joint_limits(plant.robots[0]).torque[3:]
    torque = plant.outputs(np.full((1, plant.hidden0.size), 0.1))["held_torque"][0]
    assert np.isfinite(limits).all()
    np.testing.assert_allclose(torque, np.broadcast_to(-limits, torque.shape))


def test_mujoco_moves_six_joints_the_same_way() -> None:
    experiment = a460_full_pair()
    ours, theirs = experiment.simulate(0.1), experiment.simulate(0.1, plant="mujoco")
    np.testing.assert_allclose(theirs.tracking_error, ours.tracking_error, atol=1e-13)


@pytest.mark.parametrize("options", [{"integrator": "RK45"}, {"control_period": 1e-3}])
def test_other_ways_through_time_carry_the_wrist_along(options: dict) -> None:
    experiment = a460_full_pair()
    expected, found = experiment.simulate(0.15), experiment.simulate(0.15, **options)
    np.testing.assert_allclose(found.q, expected.q, atol=1e-5)
    assert found.info["held_joints"][0]["largest"][1] > 1e-5


def test_the_flange_can_carry_a_payload() -> None:
    experiment = a460_full_pair()
    loaded = replace(experiment, payloads=(Payload(0, 1.0, frame="flange", start=0.1),))
    free, carried = experiment.simulate(0.2), loaded.simulate(0.2)
    np.testing.assert_allclose(carried.q[free.t <= 0.1], free.q[free.t <= 0.1], atol=1e-12)
    wrist = [run.info["held_joints"][0]["largest"][1] for run in (free, carried)]
    assert wrist[1] > 2 * wrist[0]


def test_a_state_without_the_wrist_is_refused() -> None:
    loop = a460_full_pair().closed_loop()
    known = loop.initial_state()[: loop.size - loop.plant.hidden0.size]
    with refused(InputError, "state", found=0):
        loop.evaluate(loop.cell.references(np.array([0.0]))[0], known, np.zeros((2, 3)))


def test_a_wrist_that_is_no_longer_finite_stops_the_run() -> None:
    loop = a460_full_pair().closed_loop()
    y = loop.initial_state()
    y[-1] = np.nan
    with refused(NonFiniteError, time=0.3, robot=None):
        Guard(loop).check(Sample(0.3, y, np.zeros((2, 3)), None))


def test_the_compiled_engine_says_that_it_has_no_held_joints() -> None:
    with refused(InputError, "plant", found="synctrl.simulation.held_joints.HeldJointsPlant"):
        a460_full_pair().simulate(0.1, engine="compiled")


def test_robots_that_are_not_those_of_the_cell_are_refused() -> None:
    experiment = a460_pair()
    for robots, found in (
        ([load_robot("a460_full")], 1),
        ([load_robot("ur5")] * 2, "joint1, joint2, joint3"),
        ([load_robot("a460_full"), load_robot("a460")], None),
    ):
        with refused(InputError, "robots", found=found):
            replace(experiment, plant_type=partial(HeldJointsPlant, robots=robots, pid=WRIST))
    with refused(InputError, "I", found=-1.0):
        Pid(1.0, -1.0, 0.0)


@pytest.mark.parametrize(
    ("subject", "changes"),
    [
        ("pid, P", {"pid": Pid([1.0, 2.0], 0.0, 0.0)}),
        ("pid, I", {"pid": Pid(1.0, np.ones((2, 3)), 0.0)}),
        ("at", {"at": [0.1, 0.2]}),
    ],
)
def test_numbers_that_do_not_fit_the_held_joints_are_refused_by_name(subject: str, changes: dict) -> None:
    given = {"robots": [load_robot("a460_full")] * 2, "pid": WRIST, **changes}
    with refused(InputError, subject):
        replace(a460_pair(), plant_type=partial(HeldJointsPlant, **given))
