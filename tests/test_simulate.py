"""Runs: repeatable to the bit, causal, the same wherever the cell stands, decentralized where promised."""

from __future__ import annotations

import inspect

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Cubic,
    Disturbance,
    Experiment,
    ExponentialApproach,
    Friction,
    Gains,
    Member,
    Payload,
    load_robot,
    simulate,
)
from synctrl.errors import InputError, SingularJacobianError
from synctrl.experiments import a460_pair, planar_four
from synctrl.robots.parameters import planar_two_link_parameters
from synctrl.simulation.result import LAYOUT

ARM = load_robot("planar2r")


def assert_same(one, two, names=LAYOUT):
    for name in names:
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), err_msg=name)


# -- bits -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [planar_four, a460_pair])
@pytest.mark.parametrize("integrator", ["rk4", "LSODA"])
def test_the_same_input_gives_the_same_bits(make, integrator):
    runs = [make().simulate(duration=0.02, integrator=integrator) for _ in range(2)]
    assert runs[0] == runs[1]


def test_an_experiment_is_not_used_up_by_running_it():
    experiment = planar_four()
    first = experiment.simulate(duration=0.03)
    experiment.simulate(duration=0.05, dt=2e-3)
    assert experiment.simulate(duration=0.03) == first


def test_independent_robots_do_not_feel_the_push_on_robot_one(planar_run):
    alone, pushed = planar_run(False, None), planar_run(False, "torque")
    for name in ("x", "tracking_error", "q", "v", "v_error", "tau", "theta_hat"):
        same = getattr(alone, name)[:, 1:], getattr(pushed, name)[:, 1:]
        np.testing.assert_array_equal(*same, err_msg=name)
    np.testing.assert_array_equal(alone.sync_error[:, 1:3], pushed.sync_error[:, 1:3])
    np.testing.assert_array_equal(alone.sync_integral[:, 1:3], pushed.sync_integral[:, 1:3])


def test_robot_one_does_feel_it_and_with_it_epsilon_one_and_four(planar_run):
    alone, pushed = planar_run(False, None), planar_run(False, "torque")
    during = (alone.t > 0.5) & (alone.t <= 0.75)
    assert (np.abs(alone.x - pushed.x)[during, 0].max(axis=1) > 0).all()
    for pair in (0, 3):
        assert np.abs(pushed.sync_error[:, pair]).max() > 2 * np.abs(alone.sync_error[during, pair]).max()
    before = alone.t <= 0.5
    for name in ("q", "v", "theta_hat", "sync_error"):
        np.testing.assert_array_equal(getattr(alone, name)[before], getattr(pushed, name)[before])


def test_synchronized_robots_all_feel_the_push_but_not_before_it(planar_run):
    alone, pushed = planar_run(True, None), planar_run(True, "torque")
    before = alone.t <= 0.5
    np.testing.assert_array_equal(alone.q[before], pushed.q[before])
    during = (alone.t > 0.5) & (alone.t <= 0.75)
    for robot in range(4):
        assert np.abs(alone.x - pushed.x)[during, robot].max() > 1e-5


def test_the_torque_acts_from_its_first_instant_until_before_its_last(planar_run):
    run = planar_run(False, "torque")
    window = (run.t >= 0.5) & (run.t < 0.75)
    assert window.sum() == 250
    np.testing.assert_array_equal(run.disturbance[window, 0], 1.0)
    np.testing.assert_array_equal(run.disturbance[~window], 0.0)
    np.testing.assert_array_equal(run.disturbance[:, 1:], 0.0)


@pytest.mark.parametrize("integrator", ["rk4", "DOP853"])
def test_what_comes_later_does_not_change_what_was(integrator):
    disturbance = [Disturbance(0, 0.5, 0.3, 0.35)]
    experiment = Experiment(small_cell(), SMALL_GAINS, 0.4, disturbance)
    long = experiment.simulate(dt=0.01, integrator=integrator)
    short = Experiment(small_cell(), SMALL_GAINS, 0.4).simulate(duration=0.3, dt=0.01, integrator=integrator)
    for name in ("q", "v", "theta_hat", "tau"):
        before, alone = getattr(long, name)[:30], getattr(short, name)[:30]
        if integrator == "rk4":
            np.testing.assert_array_equal(before, alone, err_msg=name)
        else:  # the solver's last step before 0.3 s is the same, its dense output too
            np.testing.assert_allclose(before, alone, rtol=0, atol=1e-10, err_msg=name)


def test_a_push_of_nothing_changes_nothing():
    cell = small_cell()
    plain = simulate(cell, SMALL_GAINS, 0.1, dt=5e-3)
    idle = simulate(cell, SMALL_GAINS, 0.1, dt=5e-3, disturbances=[Disturbance(0, 0.0, 0.02, 0.05)])
    late = simulate(cell, SMALL_GAINS, 0.1, dt=5e-3, disturbances=[Disturbance(0, 9.0, 0.1, 0.2)])
    assert_same(plain, idle)
    assert_same(plain, late)


def test_overlapping_pushes_add_up():
    cell = small_cell()
    both = [Disturbance(0, 0.2, 0.0, 0.06), Disturbance(0, (0.1, 0.3), 0.03, 0.08)]
    split = [
        Disturbance(0, 0.2, 0.0, 0.03),
        Disturbance(0, (0.2 + 0.1, 0.2 + 0.3), 0.03, 0.06),
        Disturbance(0, (0.1, 0.3), 0.06, 0.08),
    ]
    runs = [simulate(cell, SMALL_GAINS, 0.1, dt=5e-3, disturbances=d) for d in (both, split)]
    assert_same(*runs)


# -- where and how it is logged ---------------------------------------------------------------------------


def test_the_log_has_every_step_and_the_end():
    run = simulate(small_cell(), SMALL_GAINS, 0.0107, dt=2e-3)
    np.testing.assert_allclose(run.t, [0, 2e-3, 4e-3, 6e-3, 8e-3, 10e-3, 10.7e-3], atol=1e-17)
    np.testing.assert_array_equal(run.q[0], small_cell().q0)


def test_edges_between_two_logged_instants_are_met_but_not_logged():
    cell, gains = small_cell(), SMALL_GAINS.replace(K_r=0.01)
    run = simulate(cell, gains, 0.02, dt=5e-3, disturbances=[Disturbance(0, 5.0, 0.0061, 0.0069)])
    assert len(run.t) == 5 and not run.disturbance.any()
    plain = simulate(cell, gains, 0.02, dt=5e-3)
    np.testing.assert_array_equal(run.q[:2], plain.q[:2])
    # momentum of the push: M dv = 5 N·m times 0.8 ms
    kick = np.linalg.solve(cell.robots[0].mass_matrix(plain.q[2, 0]), [5.0, 5.0]) * 0.8e-3
    np.testing.assert_allclose(run.v[2, 0] - plain.v[2, 0], kick, rtol=0.1)


def test_progress_is_told_every_logged_instant():
    for integrator in ("rk4", "DOP853"):
        told: list[float] = []
        run = simulate(small_cell(), SMALL_GAINS, 0.03, dt=5e-3, integrator=integrator, progress=told.append)
        np.testing.assert_array_equal(told, run.t)


def test_a_function_and_an_experiment_run_the_same_with_every_option():
    options = {"payloads": [Payload(0, 0.5)], "saturate": True, "title": "both", "disturbances": []}
    run = {"dt": 5e-3, "control_period": 1e-2, "log_dt": 2e-2, "rtol": 1e-6, "atol": 1e-8}
    by_function = simulate(small_cell(), SMALL_GAINS, 0.05, **options, **run)
    assert by_function == Experiment(small_cell(), SMALL_GAINS, 0.05, **options).simulate(**run)
    assert by_function.info["title"] == "both" and by_function.info["payloads"]


def test_a_function_and_an_experiment_run_the_same():
    by_function = simulate(small_cell(), SMALL_GAINS, 0.05, dt=5e-3, reference_acceleration="paper")
    experiment = Experiment(small_cell(), SMALL_GAINS, 0.05, reference_acceleration="paper")
    assert by_function == experiment.simulate(dt=5e-3)
    assert experiment.simulate(dt=5e-3).experiment is experiment


OPTIONS = {
    "continuous": {},
    "sampled": {"control_period": 6e-3},
    "DOP853": {"integrator": "DOP853"},
    "RK45": {"integrator": "RK45"},
    "LSODA": {"integrator": "LSODA"},
    "compiled": {"engine": "compiled"},
    "compiled, sampled": {"engine": "compiled", "control_period": 6e-3},
}


@pytest.mark.parametrize("name", OPTIONS)
@pytest.mark.parametrize("duration", [0.06, 0.0617])
def test_a_log_at_longer_intervals_is_a_part_of_the_whole_log(name, duration):
    if "compiled" in name:
        pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    push = [Disturbance(0, 0.3, 0.0203, 0.0451)]
    experiment = Experiment(small_cell(), SMALL_GAINS, duration, push)
    whole = experiment.simulate(dt=2e-3, **OPTIONS[name])
    for every in (1, 4, 7, 100):
        thin = experiment.simulate(dt=2e-3, log_dt=every * 2e-3, **OPTIONS[name])
        assert thin.info["log_dt"] == every * 2e-3 and thin.info["dt"] == whole.info["log_dt"] == 2e-3
        assert_same(thin, whole.decimated(every))


def test_a_run_stops_at_the_same_instant_whatever_is_logged():
    strict = Cell(small_cell().members, Coupling.pair(), CartesianSpace("xy", max_condition=5))
    experiment = Experiment(strict, SMALL_GAINS, 1.0, [Disturbance(1, (0.0, -8.0), 0.1, 0.4)])
    stops = []
    for every in (1, 10):
        with pytest.raises(SingularJacobianError) as stop:
            experiment.simulate(dt=5e-3, log_dt=every * 5e-3)
        stops.append(stop.value)
    whole, thin = stops
    assert str(thin) == str(whole) and thin.time == whole.time
    np.testing.assert_array_equal(thin.result.q, whole.result.q[::10])


@pytest.mark.parametrize("log_dt", [0, -1.0, 1.5e-3, np.nan])
def test_an_interval_that_is_no_multiple_of_the_step_is_refused(log_dt):
    with refused(InputError, "log_dt"):
        planar_four().simulate(0.1, log_dt=log_dt)


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
@pytest.mark.parametrize(("duration", "due"), [(0.012, True), (0.014, False), (0.0113, False)])
def test_a_torque_of_sampled_control_acts_from_its_instant_on(engine, duration, due):
    options = {"dt": 1e-3, "control_period": 4e-3, "engine": engine}
    run = simulate(small_cell(), SMALL_GAINS, duration, **options)
    longer = simulate(small_cell(), SMALL_GAINS, 0.04, **options)
    held = np.repeat(longer.tau[::4], 4, axis=0)
    np.testing.assert_array_equal(longer.tau, held[: len(longer.tau)])
    last = 12 if duration > 0.0115 else 11
    np.testing.assert_array_equal(run.tau[:last], longer.tau[:last])
    # at the end, too, it is the torque that would act from then on
    if due:
        np.testing.assert_array_equal(run.tau[-1], longer.tau[12])
        assert (run.tau[-1] != run.tau[-2]).any()
    else:
        np.testing.assert_array_equal(run.tau[-1], run.tau[-2])


def test_the_function_takes_whatever_an_experiment_and_its_run_take():
    function = inspect.signature(simulate).parameters
    fields = {**inspect.signature(Experiment).parameters, **inspect.signature(Experiment.simulate).parameters}
    options = {name: option for name, option in fields.items() if name not in ("self", "duration")}
    assert function.keys() == {*options, "duration"}
    for name, option in options.items():
        assert function[name].default == option.default, name


# -- laws of the closed loop ------------------------------------------------------------------------------


def test_a_robot_that_knows_itself_and_starts_on_the_path_stays_on_it():
    members = [
        Member(
            robot := ARM.placed((i, 0, 0)),
            Cubic([0.2 * i, 1.0], [0.5, 1.5], 0.5),
            theta_hat0=robot.inertial_parameters,
        )
        for i in range(3)
    ]
    run = simulate(Cell(members, Coupling.chain(3)), SMALL_GAINS, 0.6, dt=5e-3)
    assert np.abs(run.tracking_error).max() < 1e-6
    assert np.abs(run.v[30]).max() > 0.5
    np.testing.assert_allclose(
        run.theta_hat, np.broadcast_to(run.theta_hat[0], run.theta_hat.shape), atol=1e-6
    )


def rotated(angle: float) -> Cell:
    """The same cell, turned about z."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    members = []
    for i in range(3):
        q0, base = np.array([0.3 * i, 1.2]), turn @ [1.0 * i, 0.5]
        start = base + turn @ ARM.tip_position(q0)[:2]
        robot = ARM.placed((*base, 0), (0, 0, angle))
        members.append(Member(robot, ExponentialApproach(start, start + turn @ [0.05, 0.02 * i], 3.0), q0))
    return Cell(members, Coupling.chain(3), CartesianSpace("xy"))


def test_nothing_depends_on_where_the_cell_stands():
    here, there = (simulate(rotated(angle), SMALL_GAINS, 0.3, dt=5e-3) for angle in (0.0, 0.8))
    np.testing.assert_allclose(there.q, here.q, rtol=0, atol=1e-11)
    np.testing.assert_allclose(there.tau, here.tau, rtol=0, atol=1e-10)
    turn = np.array([[np.cos(0.8), -np.sin(0.8)], [np.sin(0.8), np.cos(0.8)]])
    np.testing.assert_allclose(there.sync_error, here.sync_error @ turn.T, rtol=0, atol=1e-11)


def test_the_number_of_a_robot_is_only_a_number():
    members = small_cell(4).members
    c = np.array([1.0, -2.0, 3.0, -1.5])
    plain = simulate(Cell(members, Coupling.ring(4, c=c), CartesianSpace("xy")), SMALL_GAINS, 0.2, dt=5e-3)
    shift = [1, 2, 3, 0]
    moved = Cell([members[i] for i in shift], Coupling.ring(4, c=c[shift]), CartesianSpace("xy"))
    run = simulate(moved, SMALL_GAINS, 0.2, dt=5e-3)
    np.testing.assert_allclose(run.q, plain.q[:, shift], rtol=0, atol=1e-12)
    np.testing.assert_allclose(run.sync_error, plain.sync_error[:, shift], rtol=0, atol=1e-12)


def test_the_order_of_the_axes_is_only_an_order():
    def swapped(path):
        return ExponentialApproach(path.start[::-1], path.end[::-1], path.rate)

    cell = small_cell()
    other = Cell(
        [Member(m.robot, swapped(m.trajectory), m.q0) for m in cell.members],
        Coupling.pair(),
        CartesianSpace("yx"),
    )
    gains = SMALL_GAINS.replace(Lambda=[3.0, 5.0], beta=[2.0, 6.0], K_eps=[1.0, 2.0])
    back = SMALL_GAINS.replace(Lambda=[5.0, 3.0], beta=[6.0, 2.0], K_eps=[2.0, 1.0])
    xy, yx = simulate(cell, gains, 0.2, dt=5e-3), simulate(other, back, 0.2, dt=5e-3)
    np.testing.assert_allclose(yx.q, xy.q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(yx.x, xy.x[..., ::-1], rtol=0, atol=1e-12)


def test_robots_with_different_numbers_of_parameters_are_padded():
    few = planar_two_link_parameters(ARM)
    cell = small_cell()
    first = Member(cell.members[0].robot, cell.members[0].trajectory, cell.members[0].q0, parameters=few)
    mixed = Cell([first, cell.members[1]], Coupling.pair(), CartesianSpace("xy"))
    run = simulate(mixed, SMALL_GAINS, 0.1, dt=5e-3)
    assert run.theta_hat.shape == (21, 2, 20)
    assert run.theta_hat[-1, 0, :3].any() and not run.theta_hat[:, 0, 3:].any()
    assert [len(robot["parameters"]) for robot in run.info["robots"]] == [3, 20]


def test_two_robots_may_be_one_object():
    start, end = [0.3, 1.0], [0.6, 0.7]
    shared = [Member(ARM, Cubic(start, end, 0.2), v0=[0.1 * i, 0.0]) for i in range(2)]
    own = [Member(load_robot("planar2r"), Cubic(start, end, 0.2), v0=[0.1 * i, 0.0]) for i in range(2)]
    runs = [simulate(Cell(members, Coupling.pair()), SMALL_GAINS, 0.1, dt=5e-3) for members in (shared, own)]
    assert_same(*runs)


def test_friction_opposes_the_motion_the_controller_does_not_know_it_and_may_differ_by_robot():
    path = Cubic([0.3, 1.0], [0.3, 1.0], 1.0)
    known = ARM.inertial_parameters
    smooth = Member(ARM, path, v0=[1.0, 0.5], theta_hat0=known)
    rough = Member(
        ARM, path, v0=[1.0, 0.5], theta_hat0=known, friction=Friction((0.4, 0.2), (0.1, 0.3), 0.05)
    )
    loop = Experiment(Cell([smooth, rough], Coupling.pair()), SMALL_GAINS.independent(), 1.0).closed_loop()
    y = loop.initial_state()
    y_dot, signals = loop.evaluate(loop.cell.references(np.zeros(1))[0], y, np.zeros((2, 2)))
    np.testing.assert_array_equal(signals.tau[0], signals.tau[1])
    v, v_dot = loop.split(y_dot)[0], loop.split(y_dot)[1]
    lost = ARM.mass_matrix([0.3, 1.0]) @ (v_dot[0] - v_dot[1])
    expected = np.array([0.4, 0.2]) * v[1] + np.array([0.1, 0.3]) * np.tanh(v[1] / 0.05)
    np.testing.assert_allclose(lost, expected, rtol=1e-9)


def test_without_adaptation_the_estimates_stay():
    run = simulate(small_cell(), SMALL_GAINS.replace(Gamma=0.0), 0.1, dt=5e-3)
    np.testing.assert_array_equal(run.theta_hat, np.zeros_like(run.theta_hat))


def test_gains_may_differ_between_robots():
    strong = Gains(
        Lambda=4.0, beta=0.0, K_r=[[1.0, 1.0], [9.0, 9.0]], K_eps=0.0, Gamma=[[0.2] * 20, [0.0] * 20]
    )
    alone = simulate(small_cell(), strong, 0.1, dt=5e-3)
    weak = simulate(small_cell(), SMALL_GAINS.independent(), 0.1, dt=5e-3)
    np.testing.assert_array_equal(alone.q[:, 0], weak.q[:, 0])
    assert np.abs(alone.q[:, 1] - weak.q[:, 1]).max() > 1e-4
    assert not alone.theta_hat[:, 1].any()
