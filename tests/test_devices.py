"""Sensors and actuators: each part by its formula, and what runs with them are."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused

from synctrl import Experiment, Result
from synctrl.analysis.certify import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.control.adaptation import Natural
from synctrl.errors import InputError, SimulationError
from synctrl.experiments import a460_pair, carry_planar, carry_ur5, mixed_four
from synctrl.simulation.devices import (
    Bias,
    DeadTime,
    DifferencedVelocity,
    Lag,
    Noise,
    Quantisation,
    RateLimit,
    Ripple,
    TorqueQuantisation,
)

CELL = small_cell()
T = 2e-3  # s
ALL = {
    "sensors": [Bias(1e-4), Noise(1e-5, 1e-4, seed=3), Quantisation(1e-4), DifferencedVelocity(300.0)],
    "actuators": [TorqueQuantisation(1e-3), RateLimit(500.0), DeadTime(2.5e-3), Lag(2e-3), Ripple(0.02, 6)],
}


def small(**devices) -> Experiment:
    return Experiment(CELL, SMALL_GAINS, 0.1, **devices)


def run(duration: float = 0.04, dt: float = 1e-3, **devices) -> Result:
    return small(**devices).simulate(duration, dt=dt, control_period=T)


def motions(samples: int) -> np.ndarray:
    """Positions and velocities at samples, (samples, 2, n, nv)."""
    return np.random.default_rng(0).uniform(-1, 1, (samples, 2, CELL.n, CELL.nv))


def asked(result: Result) -> np.ndarray:
    """What the controller asked for at the samples, (samples, n, nv)."""
    return result.tau[::2]


# -- sensors -----------------------------------------------------------------------------------------------


def test_a_count_is_read_to_half_of_it_and_stays_until_the_next():
    step = np.array([0.05, 0.0])
    measure = Quantisation(step).bind(CELL, T)
    readings = np.array([measure(k, motion)[0] for k, motion in enumerate(motions(200))])
    q = motions(200)[:, 0]
    assert (np.abs(readings - q)[..., 0] <= 0.5 * step[0] * (1 + 1e-12)).all()
    np.testing.assert_allclose(readings[..., 0] / step[0], np.rint(readings[..., 0] / step[0]), atol=1e-9)
    np.testing.assert_array_equal(readings[..., 1], q[..., 1])


def test_noise_has_its_deviation_no_mean_and_no_memory():
    measure = Noise(2e-3, 0.1, seed=5).bind(CELL, T)
    drawn = np.array([measure(k, np.zeros((2, CELL.n, CELL.nv))) for k in range(4000)])
    for part, deviation in zip((drawn[:, 0], drawn[:, 1]), (2e-3, 0.1), strict=True):
        assert np.abs(part.mean(axis=0)).max() < 4 * deviation / np.sqrt(4000)
        np.testing.assert_allclose(part.std(axis=0), deviation, rtol=0.05)
    flat = drawn.reshape(4000, -1)
    joint = np.corrcoef(np.hstack((flat[1:], flat[:-1])), rowvar=False) - np.eye(2 * flat.shape[1])
    assert np.abs(joint).max() < 5 / np.sqrt(4000)


def test_noise_depends_on_the_number_of_the_sample_and_the_seed_alone():
    motion = motions(1)[0]
    one, two = (Noise(1e-3, seed=7).bind(CELL, T) for _ in range(2))
    forwards = [one(k, motion) for k in range(5)]
    backwards = [two(k, motion) for k in reversed(range(5))]
    np.testing.assert_array_equal(forwards, backwards[::-1])
    assert not np.array_equal(forwards[0], Noise(1e-3, seed=8).bind(CELL, T)(0, motion))


def test_a_bias_is_added():
    measure = Bias(0.1, [0.2, -0.2]).bind(CELL, T)
    np.testing.assert_allclose(measure(0, np.zeros((2, CELL.n, CELL.nv)))[:, 0], [[0.1, 0.1], [0.2, -0.2]])


def test_the_filter_of_differences_answers_a_step_of_velocity_by_its_formula():
    omega, speed = 150.0, 0.7
    measure, at_rest = DifferencedVelocity(omega).bind(CELL, T), np.zeros((2, CELL.n, CELL.nv))
    found = []
    for k in range(20):
        motion = at_rest.copy()
        motion[0] = speed * T * k  # moves from the start on, but was seen at rest there
        found.append(measure(k, motion)[1, 0, 0])
    np.testing.assert_allclose(found, speed * (1 - np.exp(-omega * T * np.arange(20))), rtol=1e-12)


def test_differences_without_a_filter_are_those_of_the_positions():
    measure, given = DifferencedVelocity().bind(CELL, T), motions(5)
    found = np.array([measure(k, motion) for k, motion in enumerate(given)])
    np.testing.assert_array_equal(found[0], given[0])
    np.testing.assert_allclose(found[1:, 1], np.diff(given[:, 0], axis=0) / T)


def test_sensors_measure_in_their_order():
    result = run(sensors=[Quantisation(1e-3), DifferencedVelocity()])
    q, v = (result.outputs[name][::2] for name in ("measured_q", "measured_v"))
    np.testing.assert_allclose(q / 1e-3, np.rint(q / 1e-3), atol=1e-9)
    np.testing.assert_allclose(v[1:], np.diff(q, axis=0) / T, atol=1e-12)


def test_joints_that_a_robot_does_not_have_stay_zero():
    cell = mixed_four().cell
    for sensor in (Bias(1.0, 1.0), Noise(1.0, 1.0)):
        found = sensor.bind(cell, T)(0, np.zeros((2, cell.n, cell.nv)))
        for robot, rows in zip(cell.robots, np.moveaxis(found, 1, 0), strict=True):
            assert (rows[:, : robot.nv] != 0).all() and (rows[:, robot.nv :] == 0).all()


# -- actuators ---------------------------------------------------------------------------------------------


def test_torque_acts_in_steps():
    result = run(actuators=[TorqueQuantisation(0.01)])
    torque = result.outputs["actuator_torque"]
    np.testing.assert_allclose(torque / 0.01, np.rint(torque / 0.01), atol=1e-9)
    assert np.abs(torque - result.tau).max() <= 0.005 * (1 + 1e-12)


def test_a_rate_limit_bounds_what_changes_in_a_period():
    rate = 5.0
    result = run(actuators=[RateLimit(rate)])
    torque = result.outputs["actuator_torque"][::2]
    assert np.abs(np.diff(asked(result), axis=0)).max() > 1.5 * rate * T
    assert np.abs(np.diff(torque, axis=0)).max() <= rate * T * (1 + 1e-12)
    np.testing.assert_array_equal(torque[0], asked(result)[0])


@pytest.mark.parametrize("periods", [1, 3])
def test_a_dead_time_of_periods_shifts_the_torque_by_exactly_that(periods):
    result = run(actuators=[DeadTime(periods * T)])
    torque = result.outputs["actuator_torque"][::2]
    np.testing.assert_array_equal(torque[periods:], asked(result)[:-periods])
    np.testing.assert_array_equal(torque[:periods], np.broadcast_to(result.tau[0], torque[:periods].shape))


def test_any_dead_time_shifts_the_torque_by_exactly_that():
    late = 0.7e-3  # between two multiples of dt
    result = run(dt=5e-4, actuators=[DeadTime(late)])
    torque, tau = result.outputs["actuator_torque"], result.tau
    for since, shift in ((0.0, 1), (0.5e-3, 1), (1e-3, 0), (1.5e-3, 0)):
        rows = np.arange(4, len(result.t) - 4, 4) + round(since / 5e-4)
        np.testing.assert_array_equal(torque[rows], tau[rows - 4 * shift])
    fine = run(dt=1e-4, actuators=[DeadTime(late)])
    np.testing.assert_allclose(fine.q[::5], result.q, atol=1e-9)


def test_a_lag_is_the_exponential_between_samples():
    constant = np.array([3e-3, 0.0])
    result = run(actuators=[Lag(constant)])
    torque, tau = result.outputs["actuator_torque"], result.tau
    np.testing.assert_array_equal(torque[..., 1], tau[..., 1])
    h = 1e-3
    expected = tau[:-1, :, 0] + (torque[:-1, :, 0] - tau[:-1, :, 0]) * np.exp(-h / constant[0])
    np.testing.assert_allclose(torque[1:, :, 0], expected, rtol=1e-9)
    np.testing.assert_array_equal(torque[0], tau[0])


def test_a_ripple_follows_the_angle_by_its_formula():
    result = run(actuators=[Ripple(0.1, order=12, phase=0.3)])
    expected = result.tau * (1 + 0.1 * np.sin(12 * result.q + 0.3))
    np.testing.assert_allclose(result.outputs["actuator_torque"], expected, rtol=1e-12)


def test_what_the_motors_give_is_what_moves_the_robots():
    result, k = run(dt=2e-4, actuators=ALL["actuators"]), 54  # within a period, away from every switch
    rate = (result.v[k + 1] - result.v[k - 1]) / (result.t[k + 1] - result.t[k - 1])
    for i, robot in enumerate(CELL.robots):
        torque = result.outputs["actuator_torque"][k, i]
        expected = robot.forward_dynamics(result.q[k, i], result.v[k, i], torque)
        np.testing.assert_allclose(rate[i], expected, rtol=1e-3, atol=1e-3)


# -- runs --------------------------------------------------------------------------------------------------


def test_devices_of_no_size_change_no_bit():
    nothing = {
        "sensors": [Bias(), Noise(), Quantisation(0.0)],
        "actuators": [TorqueQuantisation(0.0), RateLimit(1e9), DeadTime(0.0), Lag(0.0), Ripple(0.0)],
    }
    plain, fitted = run(), run(**nothing)
    for name in ("q", "v", "tau", "theta_hat", "v_error", "sync_integral", "coupled_error"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(fitted, name))
    np.testing.assert_array_equal(fitted.outputs["measured_q"][::2], plain.q[::2])


def test_the_controller_acts_on_what_is_measured_and_the_log_has_what_is_true():
    experiment = small(sensors=ALL["sensors"])
    result = experiment.simulate(0.02, dt=1e-3, control_period=T)
    controller = experiment.controller(T)
    measured = [result.outputs[name][::2] for name in ("measured_q", "measured_v")]
    for t, q, v, tau in zip(result.t[::2], *measured, asked(result), strict=True):
        np.testing.assert_allclose(controller.step(t, q, v), tau, rtol=1e-12)
    assert (measured[0] != result.q[::2]).any()
    for k in range(len(result.t)):
        for i, robot in enumerate(CELL.robots):
            np.testing.assert_allclose(robot.tip_position(result.q[k, i])[:2], result.x[k, i], atol=1e-12)


def test_the_same_seed_gives_the_same_bits_and_another_one_others():
    one, two, other = run(**ALL), run(**pickle.loads(pickle.dumps(ALL))), run(sensors=[Noise(1e-5, seed=4)])
    assert one == two
    assert not np.array_equal(other.q, run(sensors=[Noise(1e-5, seed=3)]).q)


def test_a_run_with_devices_survives_its_file_and_is_outside_the_theorem_by_name(tmp_path):
    result = run(**ALL)
    loaded = Result.load(result.save(tmp_path / "run.npz"))
    assert loaded == result and [part["name"] for part in loaded.info["actuators"]][-2:] == ["Lag", "Ripple"]
    certificate = certify(loaded, small(**ALL))
    assert certificate.verdict == "bounded by Theorem A"
    said = " ".join(certificate.outside)
    assert all(type(part).__name__ in said for parts in ALL.values() for part in parts)
    assert lyapunov(result).V.shape == result.t.shape


@pytest.mark.parametrize("role", ALL)
def test_an_experiment_with_other_devices_is_not_taken_for_the_one_of_a_run(role):
    result = run(**ALL)
    with refused(InputError, "experiment", found=role):
        certify(result, small(**{**ALL, role: ALL[role][:-1]}))


def test_devices_have_units_of_sliding_and_turning_joints_and_axes():
    result = run(**ALL)
    assert result.info["outputs"]["measured_v"] == {"unit": "rad/s", "axes": ["time", "robot", "joint"]}
    assert result.unit("actuator_torque") == "N·m"


def test_a_carried_object_and_another_adaptation_go_along_with_devices():
    held = carry_planar(**ALL).simulate(0.02, dt=5e-4, control_period=1e-3)
    assert held.status == "completed" and "internal_force" in held.outputs
    learned = a460_pair(adaptation=Natural(0.1), **ALL).simulate(0.02, dt=5e-4, control_period=1e-3)
    assert learned.status == "completed" and "adaptation_state" in learned.outputs
    assert certify(held).verdict == "outside the theorem"  # no theorem knows pins
    assert certify(learned).verdict == "bounded by Theorem A"


@pytest.mark.parametrize("roles", [("sensors",), ("actuators",), ("sensors", "actuators")])
def test_engines_agree_on_runs_with_devices(roles):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = small(**{role: ALL[role] for role in roles})
    one, two = (
        experiment.simulate(0.05, dt=1e-3, control_period=T, engine=engine)
        for engine in ("pinocchio", "compiled")
    )
    for name in ("q", "v", "tau", "x", "v_error", "theta_hat", "sync_integral", "sync_error"):
        np.testing.assert_allclose(getattr(two, name), getattr(one, name), rtol=1e-9, atol=1e-12)
    assert {*one.outputs} == {*two.outputs} and len(one.outputs) == len(roles) + ("sensors" in roles)
    for name, array in one.outputs.items():
        np.testing.assert_allclose(two.outputs[name], array, rtol=1e-9, atol=1e-12)


def test_engines_agree_on_a_carried_object_another_adaptation_and_torque_that_is_cut_off():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    smooth = {"sensors": [Noise(1e-6, 1e-4), DifferencedVelocity(400.0)], "actuators": ALL["actuators"][2:]}
    held = carry_ur5(geometric_error=True, tare=True, admittance=True, **smooth)
    for experiment in (held, replace(a460_pair(adaptation=Natural(0.1), **smooth), saturate=True)):
        one, two = (
            experiment.simulate(0.02, dt=5e-4, control_period=1e-3, engine=engine)
            for engine in ("pinocchio", "compiled")
        )
        for name in ("q", "v", "tau", "theta_hat"):
            scale = np.abs(getattr(one, name)).max()
            np.testing.assert_allclose(getattr(two, name), getattr(one, name), rtol=1e-9, atol=1e-9 * scale)


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
def test_what_fails_in_a_device_ends_the_run_and_hands_over_what_it_has(engine):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    with refused(SimulationError) as caught:
        small(sensors=[Dying()]).simulate(0.02, dt=1e-3, control_period=T, engine=engine)
    assert "the wire broke" in str(caught.value) and len(caught.value.result.t) == 5 * 2


# -- refusals ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("role", ALL)
@pytest.mark.parametrize("integrator", ["rk4", "RK45"])
def test_devices_are_refused_by_name_where_there_are_no_samples(role, integrator):
    with refused(InputError, role, found=type(ALL[role][0]).__name__):
        small(**{role: ALL[role]}).simulate(0.01, dt=1e-3, integrator=integrator)


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Quantisation(-1e-3), "step"),
        (lambda: Noise(-1.0), "q"),
        (lambda: Noise(seed=-1), "seed"),
        (lambda: Noise(seed=2**63), "seed"),
        (lambda: Bias(np.nan), "q"),
        (lambda: DifferencedVelocity(0.0), "omega"),
        (lambda: TorqueQuantisation("fine"), "step"),
        (lambda: RateLimit(-1.0), "rate"),
        (lambda: DeadTime(-1e-3), "time"),
        (lambda: Lag([-1e-3, 0.0]), "time_constant"),
        (lambda: Ripple(0.1, order=np.inf), "order"),
        (lambda: small(sensors=[Quantisation([1e-3] * 5)]), "step"),
        (lambda: small(actuators=[Lag([1e-3] * 5)]), "time_constant"),
        (lambda: small(sensors=Noise(1e-3)), "sensors"),
        (lambda: small(sensors=[Noise]), "sensors[0]"),
        (lambda: small(actuators=[1e-3]), "actuators[0]"),
        (lambda: small(actuators=[Noise(1e-3)]), "actuators[0]"),
        (lambda: small(sensors=[Noise(1e-3), Lag(1e-3)]), "sensors[1]"),
        (lambda: small(actuators=[Lag(1e-3), RateLimit(1.0)]), "actuators"),
        (lambda: small(actuators=[Lag(1e-3), Lag(2e-3)]), "actuators"),
        (lambda: small(actuators=[Ripple(0.1), Lag(2e-3)]), "actuators"),
    ],
)
def test_what_is_no_device_of_this_cell_is_refused_and_named(make, subject):
    with refused(InputError, subject):
        make()


class Dying:
    """A sensor that works five times."""

    def bind(self, cell, period):
        def measure(k, motion):
            if k == 5:
                raise RuntimeError("the wire broke")
            return motion

        return measure

    def as_dict(self):
        return {}


class Broken:
    """A sensor, and an actuator, that give too little."""

    def bind(self, cell, period):
        return lambda *given: given[-1][..., :1]

    def as_dict(self):
        return {}


@pytest.mark.parametrize("role", ALL)
def test_a_device_of_ones_own_that_gives_another_shape_is_named(role):
    with refused(InputError, f"{role[:-1]} Broken"):
        replace(small(), **{role: [Broken()]}).simulate(0.01, dt=1e-3, control_period=T)
