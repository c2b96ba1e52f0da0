"""Advice about gains: its numbers are those of runs, and to follow it cures what was wrong."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Cubic,
    Experiment,
    Friction,
    FrictionParameters,
    Gains,
    Hold,
    Member,
    Network,
    Redundancy,
    SmoothTrajectory,
    SynctrlError,
    load_robot,
    simulate,
)
from synctrl.analysis import advise, advise_run, period_margin
from synctrl.analysis.advise import at_rest, first_change
from synctrl.analysis.gain_case import longest_by_rates
from synctrl.analysis.linear_loop import LinearLoop
from synctrl.control.laws import SunMills
from synctrl.errors import InputError, NonFiniteError, SimulationError, UnreachableError
from synctrl.experiments import a460_pair, planar_four, ur5_payload
from synctrl.robots.documents import planar_arm, write_urdf
from synctrl.simulation import diagnosis
from synctrl.simulation.devices import DeadTime, DifferencedVelocity

UR5, PLANAR, A460 = (load_robot(name) for name in ("ur5", "planar2r", "a460"))
Q0 = np.array([0.1, -1.2, 1.4, -0.6, 0.5, 0.3])


A, NONE = np.array([0.3, 1.0, -2.8]), Friction()


def resting(robot=UR5, q=Q0, friction=NONE, **more) -> Cell:
    """Two robots that stay where they are, and know their parameters."""
    member = Member(robot, Hold(q), q0=q, friction=friction, **more)
    known = Cell([member] * 2, Coupling.pair()).parameters[0].theta
    return Cell([replace(member, theta_hat0=known)] * 2, Coupling.pair())


def moving(robot=UR5, q=Q0, by=0.4, duration=0.6, knows=0.7, off=0.0, friction=NONE) -> Cell:
    """Two robots that swing out."""
    way = Cubic(q, q + by, duration)
    guess = knows * robot.inertial_parameters
    return Cell([Member(robot, way, q0=q + off, theta_hat0=guess, friction=friction)] * 2, Coupling.pair())


def good(cell: Cell, **more) -> Gains:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return Gains.suggest(cell, 8.0, duration=1.0, **more)


def fate(cell: Cell, gains: Gains, duration: float = 1.0, **more) -> tuple[str, float]:
    """How a run ends, and the largest error in its last tenth."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = simulate(cell, gains, duration, **more)
        except SimulationError:
            return "diverged", np.inf
    return result.status, float(np.abs(result.tracking_error[-len(result.t) // 10 :]).max())


# -- poles -------------------------------------------------------------------------------------------------


def derivative(experiment: Experiment, h: float = 1e-5) -> np.ndarray:
    """Eigenvalues of the whole closed loop, by central differences of its right-hand side."""
    loop = experiment.closed_loop()
    y, rest = loop.initial_state(), np.zeros_like(loop.cell.q0)
    reference = loop.cell.references(np.zeros(1))[0]

    def rate(state: np.ndarray) -> np.ndarray:
        return loop.evaluate(reference, state, rest)[0].copy()

    assert np.abs(rate(y)).max() < 1e-8  # a place of rest
    columns = [(rate(y + h * unit) - rate(y - h * unit)) / (2 * h) for unit in np.eye(len(y))]
    return np.linalg.eigvals(np.array(columns).T)


def tips(robot, q, **space) -> Cell:
    member = Member(robot, Hold(robot.tip_position(q)), q0=q, theta_hat0=robot.inertial_parameters)
    space = CartesianSpace("xyz", **space)
    return Cell([replace(member, friction=Friction())] * 3, Coupling.signed_ring(3), space)


KINDS = {
    "joints": lambda: resting(),
    "friction that is known of": lambda: resting(friction=Friction(3.0), parameters=FrictionParameters(UR5)),
    "friction that is not": lambda: resting(friction=Friction(3.0)),
    "a ring of tips": lambda: tips(UR5, Q0),
    "tips that prefer a posture": lambda: tips(UR5, Q0, redundancy=Redundancy(Q0, gain=1.5)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_the_poles_are_those_of_the_closed_loop_itself(kind):
    cell = KINDS[kind]()
    experiment = Experiment(cell, Gains(5.0, 3.0, 30.0, 40.0, 0.2), 1.0)
    poles = at_rest(experiment.closed_loop()).loop().poles
    found = derivative(experiment)
    found = found[np.abs(found) > 1e-5]
    for pole in poles[np.abs(poles) > 1e-5]:
        assert np.abs(found - pole).min() < 1e-5 * (1 + abs(pole))
    for value in found:
        assert np.abs(poles - value).min() < 1e-5 * (1 + abs(value))


def near(cell: Cell, gains: Gains, size: float = 1e-4) -> tuple[Experiment, LinearLoop, np.ndarray]:
    """A cell that starts with small errors of joint positions, its linear loop, and these errors."""
    y = size * np.random.default_rng(1).standard_normal(cell.q0.shape)
    moved = [replace(member, q0=member.q0 - row) for member, row in zip(cell.members, y, strict=True)]
    experiment = Experiment(Cell(moved, cell.coupling, cell.space), gains, 1.0)
    return experiment, at_rest(Experiment(cell, gains, 1.0).closed_loop()).loop(), y


def test_a_small_error_falls_in_a_run_as_the_linear_loop_says():
    from scipy.linalg import expm

    cell = resting()
    experiment, linear, y = near(cell, Gains(5.0, 3.0, 30.0, 40.0, 0.2))
    x = np.zeros(len(linear.A))
    x[linear.parts[1]] = y.ravel()
    result = experiment.simulate(0.5)
    for k in (50, 200, 500):
        expected = (expm(result.t[k] * linear.A) @ x)[linear.parts[1]]
        np.testing.assert_allclose((cell.q0 - result.q[k]).ravel(), expected, atol=1e-2 * np.abs(y).max())


MARGINS = {
    "damping": Gains(5.0, 3.0, 90.0, 40.0, 0.01),
    "learning": Gains(5.0, 3.0, 12.0, 40.0, 8.0),
    "synchronization": Gains(5.0, 60.0, 30.0, 4000.0, 0.01),
}


def growth(experiment: Experiment, dt: float, control_period: float | None = None) -> float:
    """The errors of the last third of a run over those of the second third; infinite if it ran away."""
    steps = round((control_period or dt) / dt)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = experiment.simulate(240 * steps * dt, dt, control_period=control_period)
    except NonFiniteError:
        return np.inf
    moved = np.abs(experiment.cell.members[0].trajectory(0.0).x - result.q).max(axis=(1, 2))
    third = len(moved) // 3
    return float(moved[-third:].max() / moved[third:-third].max())


@pytest.mark.parametrize("word", MARGINS)
def test_held_torque_is_stable_up_to_the_period_that_is_told_and_not_beyond(word):
    experiment, linear, _ = near(resting(A460, A), MARGINS[word], 1e-8)
    below, beyond = (share * linear.longest_period for share in (0.95, 1.05))
    assert growth(experiment, below / 4, below) < 1 < growth(experiment, beyond / 4, beyond)


def test_rk4_is_stable_up_to_the_step_that_is_told_and_not_beyond():
    experiment, linear, _ = near(resting(A460, A), MARGINS["damping"], 1e-8)
    below, beyond = (share * linear.longest_step for share in (0.97, 1.03))
    assert growth(experiment, below) < 1 < growth(experiment, beyond)


def test_rates_never_promise_a_longer_step_than_poles_do():
    """What cells with very many joints are told: sums of rates are at least the largest pole."""
    for cell, gains in (
        (moving(), Gains(8.0, 4.0, 40.0, 40.0, 0.1)),
        (moving(A460, A), good(moving(A460, A))),
    ):
        loop = Experiment(cell, gains, 1.0).closed_loop()
        linear = at_rest(loop).loop()
        step, period = longest_by_rates(loop)
        assert step <= linear.longest_step and period <= linear.longest_period


# -- torque ------------------------------------------------------------------------------------------------

STARTS = {
    "on the path": moving(),
    "off the path": moving(off=0.02),
    "knows half": moving(knows=0.5, duration=0.4),
    "with friction": moving(A460, A, friction=Friction(5.0, 4.0, 0.05)),
}


@pytest.mark.parametrize("start", STARTS)
def test_the_peak_of_torque_is_that_of_a_run(start):
    cell = STARTS[start]
    gains = good(cell)
    expected = advise(cell, gains, duration=1.0).torque
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = simulate(cell, gains, 1.0)
    peak = np.abs(result.tau).max(axis=0)
    np.testing.assert_allclose(expected.first, np.abs(result.tau[0]), rtol=1e-9)
    matters = peak > 0.1 * peak.max()
    np.testing.assert_allclose(expected.peak[matters], peak[matters], rtol=0.1)


def test_torque_on_the_path_alone_is_inverse_dynamics():
    cell = moving()
    torque = advise(cell, good(cell), duration=1.0).torque
    t = np.linspace(0, 0.6, 2001)
    motion = cell.motion(0, t)
    tau = [UR5.inverse_dynamics(*row) for row in zip(*motion, strict=True)]
    np.testing.assert_allclose(torque.path[0], np.abs(tau).max(axis=0), rtol=2e-3)


def test_errors_of_the_start_that_take_too_much_torque_ask_for_a_smaller_lambda_that_cures():
    cell = moving(off=0.12)
    gains = good(cell)
    advice = advise(cell, gains, duration=1.0)
    assert advice.torque.share.max() > 1 and advice.first.urgency == "torque"
    assert advice.first.what == "Lambda" and advice.first.to < advice.first.found
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        before, after = (simulate(cell, each, 1.0) for each in (gains, advice.first.gains))
    limits = advice.torque.limit
    assert (np.abs(before.tau) > limits).any() and (np.abs(after.tau) < limits).all()


def test_a_motion_that_is_too_fast_has_to_take_longer_by_as_much_as_is_told():
    fast = moving(by=1.0, duration=0.25, knows=1.0)
    advice = advise(fast, good(fast), duration=0.5)
    assert advice.first.what == "time"
    slower = moving(by=1.0, duration=0.25 * advice.first.to, knows=1.0)
    torque = advise(slower, good(slower), duration=1.0).torque
    assert (torque.path <= 1.001 * torque.limit).all()
    assert (torque.path > 0.98 * torque.limit).any()


# -- what to change ----------------------------------------------------------------------------------------

CELLS = {
    "ur5": lambda: moving(),
    "planar": lambda: moving(PLANAR, np.array([0.3, 0.6])),
    "a460": lambda: moving(A460, A),
}
BAD = [("K_r", 30), ("Gamma", 1e6), ("K_eps", 1e5), ("Lambda", 300), ("beta", 300)]
TRIED = [("ur5", *BAD[0]), ("ur5", *BAD[1]), *((name, *bad) for name in ("planar", "a460") for bad in BAD)]
PERIOD = 2e-3


@pytest.mark.parametrize(("name", "gain", "factor"), TRIED)
def test_a_cell_that_diverges_converges_once_it_is_changed_as_told(name, gain, factor):
    cell, sampled = CELLS[name](), {"control_period": PERIOD}
    gains = good(cell, period=PERIOD)
    bad = gains.replace(**{gain: factor * getattr(gains, gain)})
    advice = advise(cell, bad, duration=1.0, **sampled)
    assert fate(cell, bad, **sampled)[0] == "diverged"
    assert advice.diverges and advice.first.what == gain
    assert advice.first.found > advice.first.to
    assert f"{gain}" in str(advice).splitlines()[0]
    status, left = fate(cell, advice.changed, **sampled)
    assert status == "completed" and left < 5e-3


def test_nothing_is_said_to_diverge_that_does_not():
    for make in CELLS.values():
        cell = make()
        for period in (None, PERIOD):
            advice = advise(cell, good(cell, period=period), duration=1.0, control_period=period)
            assert not advice.changes and advice.first is None
            assert advice.changed == advice.gains and "nothing has to be changed" in str(advice)


def test_a_step_that_is_longer_than_usual_is_shortened_rather_than_any_gain():
    ready = planar_four()
    advice = advise(ready.cell, ready.gains, dt=0.02)
    assert (advice.first.what, advice.first.found) == ("dt", 0.02)
    assert advice.first.gains == ready.gains
    assert fate(ready.cell, ready.gains, 0.5, dt=0.02)[0] == "diverged"
    assert fate(ready.cell, ready.gains, 0.5, dt=round(advice.first.to, 4))[0] == "completed"


def test_changes_one_after_another_come_to_an_end_that_converges():
    """Everything is wrong at once, and only the first change is ever made."""
    cell = CELLS["planar"]()
    gains = good(cell, period=PERIOD)
    gains = Gains(300 * gains.Lambda, 300 * gains.beta, 50 * gains.K_r, 1e4 * gains.K_eps, 1e5 * gains.Gamma)
    for _ in range(12):
        advice = advise(cell, gains, duration=1.0, control_period=PERIOD)
        if advice.first is None:
            break
        gains = advice.first.gains
    assert not advice.changes
    assert fate(cell, gains, control_period=PERIOD)[1] < 5e-3


def test_rates_of_learning_that_only_swing_are_told_as_such_and_are_calmed():
    cell = moving(A460, A)
    gains = good(cell)
    wild = gains.replace(Gamma=1e3 * gains.Gamma)
    advice = advise(cell, wild, duration=1.0)
    assert [change.urgency for change in advice.changes] == ["swings"]
    np.testing.assert_allclose(advice.changed.Gamma, gains.Gamma, rtol=1e-9)
    swing = min(mode.damping for mode in advice.modes)
    calm = min(mode.damping for mode in advise(cell, advice.changed, duration=1.0).modes)
    assert swing < 0.25 < calm


def test_a_robot_that_is_slower_than_lambda_gets_the_damping_that_is_suggested():
    cell = moving()
    gains = good(cell)
    advice = advise(cell, gains.replace(K_r=0.05 * gains.K_r), duration=1.0)
    assert advice.changes[-1].urgency == "slow" and advice.changes[-1].what == "K_r"
    np.testing.assert_allclose(advice.changed.K_r, gains.K_r, rtol=1e-6)


def test_messages_that_come_too_late_ask_for_less_coupling():
    cell, network = moving(), Network(period=0.01, delay=0.05, receiver="hold")
    gains = good(cell)
    stiff = gains.replace(K_eps=300 * gains.K_eps)
    advice = advise(cell, stiff, duration=1.0, network=network)
    assert (advice.first.urgency, advice.first.what) == ("late", "K_eps")
    assert fate(cell, stiff, network=network)[1] > 10 * fate(cell, advice.changed, network=network)[1]
    assert not advise(cell, gains, duration=1.0, network=network).changes


def test_messages_that_come_too_seldom_ask_for_a_shorter_period():
    ready = planar_four()
    seldom, often = (Network(period=period, receiver="filter", omega=200.0) for period in (0.1, 0.04))
    late = [c for c in advise(ready.cell, ready.gains, network=seldom).changes if c.urgency == "late"]
    assert late[-1].what == "network period" and late[-1].found == 0.1
    margin = period_margin(ready.cell, late[-1].gains, receiver="filter", omega=200.0)
    assert 0.85 * margin < late[-1].to <= 0.9 * margin * (1 + 1e-3)
    assert "late" not in {c.urgency for c in advise(ready.cell, ready.gains, network=often).changes}


def test_sensors_and_actuators_that_lag_ask_for_less_damping_that_cures():
    cell = moving(A460, A)
    gains = good(cell, period=PERIOD)
    late = {"sensors": [DifferencedVelocity(100.0)], "actuators": [DeadTime(0.01)], "control_period": PERIOD}
    advice = advise(cell, gains, duration=1.0, **late)
    assert (advice.first.urgency, advice.first.what) == ("late", "K_r")
    assert fate(cell, gains, **late)[0] == "diverged"
    assert fate(cell, advice.changed, **late)[0] == "completed"
    quick = late | {"sensors": [DifferencedVelocity(2000.0)], "actuators": [DeadTime(1e-3)]}
    assert not advise(cell, gains, duration=1.0, **quick).changes
    assert fate(cell, gains, **quick)[1] < 5e-3


# -- what it says ------------------------------------------------------------------------------------------


def test_the_table_has_a_row_for_every_joint_and_all_of_it_is_plain():
    advice = advise_run(ur5_payload())
    rows = advice.rows
    assert [(row["robot"], row["joint"]) for row in rows] == [
        (name, k) for name in ("UR5 1", "UR5 2") for k in range(1, 7)
    ]
    assert all(row["rate"] == row["K_r"] / row["inertia"] for row in rows)
    told = json.loads(json.dumps(advice.to_dict(), allow_nan=False))
    assert told["joints"] == rows and told["delay_margin"] == advice.delay.delay
    assert str(advice) == repr(advice) and str(advice).count("UR5") >= 12


def test_cells_with_very_many_joints_are_told_what_needs_no_poles():
    few, many = (Cell([moving().members[0]] * n, Coupling.signed_ring(n)) for n in (4, 12))
    gains = good(few)
    gains = gains.replace(K_r=gains.K_r[0], Gamma=gains.Gamma[0])
    advice, close = (advise(cell, gains, duration=1.0) for cell in (many, few))
    assert advice.modes == () and close.modes and "so many joints" in str(advice)
    assert advice.longest_step <= close.longest_step * (1 + 1e-9)
    np.testing.assert_allclose(advice.torque.path[0], close.torque.path[0])
    bad = advise(many, gains.replace(K_r=30 * gains.K_r), duration=1.0)
    assert (bad.first.urgency, bad.first.what) == ("diverges", "K_r")
    assert not advise(many, bad.changed, duration=1.0).diverges


def test_the_damping_ratio_of_a_joint_alone_is_that_of_its_poles(tmp_path):
    """One joint: M s' + K s + p = 0 and p' = G s swing with the ratio K/(2 sqrt(M G))."""
    rod = load_robot(write_urdf(planar_arm([0.5], [2.0]), tmp_path / "rod.urdf"))
    cell = resting(rod.placed(rpy=(np.pi / 2, 0, 0)), np.array([0.4]))
    advice = advise(cell, Gains(3.0, 0.0, 1.0, 0.0, 5.0), duration=0.1)
    found = min(mode.damping for mode in advice.modes)
    assert advice.rows[0]["damping_ratio"] == pytest.approx(found, rel=1e-6) and found < 1


def test_ready_cells_are_not_said_to_diverge():
    for ready in (planar_four, a460_pair, ur5_payload):
        assert not advise_run(ready()).diverges


@pytest.mark.parametrize(
    ("subject", "changes"),
    [
        ("dt", {"dt": 0.0}),
        ("control_period", {"control_period": -1.0}),
        ("duration", {"duration": "long"}),
        ("law", {"law": SunMills(injection=True)}),
        ("gains", {"gains": "good"}),
        ("cell", {"cell": "pair"}),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(subject, changes):
    cell = moving()
    with refused(InputError, subject):
        advise(**{"cell": cell, "gains": Gains(8, 4, 40, 40, 0.1), **changes})
    with refused(InputError, "experiment"):
        advise_run(cell)


def test_a_path_out_of_reach_is_refused():
    member = Member(UR5, Hold([5.0, 0.0, 0.0]), q0=Q0)
    with refused(UnreachableError):
        advise(Cell([member] * 2, Coupling.pair(), CartesianSpace("xyz")), Gains(8, 4, 40, 40, 0.1))


def test_a_motion_that_ends_before_what_is_looked_at_is_told_which_argument_says_so():
    way = SmoothTrajectory(lambda t: Q0 + 0.1 * np.sin(t), duration=1.0)
    cell = Cell([Member(UR5, way, theta_hat0=UR5.inertial_parameters, friction=NONE)] * 2, Coupling.pair())
    for ask in (lambda: Gains.suggest(cell, 8.0), lambda: advise(cell, Gains(8, 4, 40, 40, 0.1))):
        with pytest.raises(SynctrlError) as caught:
            ask()
        assert "`duration`" in caught.value.__notes__[0]
    assert advise(cell, good(cell), duration=1.0).first is None


# -- messages of runs --------------------------------------------------------------------------------------


def stopped(cell: Cell, gains: Gains) -> NonFiniteError:
    with pytest.raises(NonFiniteError) as caught:
        simulate(cell, gains, 1.0, control_period=PERIOD)
    return caught.value


@pytest.fixture
def wild() -> tuple[Cell, Gains]:
    cell = moving()
    gains = good(cell, period=PERIOD)
    return cell, gains.replace(K_r=30 * gains.K_r)


def test_a_run_that_diverges_says_what_to_change_first(wild):
    cell, gains = wild
    error = stopped(cell, gains)
    change = first_change(Experiment(cell, gains, 1.0).closed_loop(), 1e-3, PERIOD)
    assert change.told(cell.names) in str(error) and change.what == error.cause == "K_r"
    assert error.result.status == f"stopped: {error}"


@pytest.mark.parametrize("broken", ["synctrl.analysis.nowhere", "synctrl.analysis.modal"])
def test_advice_that_fails_hides_nothing(wild, monkeypatch, broken):
    whole = stopped(*wild)
    monkeypatch.setattr(diagnosis, "ADVICE", (broken, "first_change"))
    bare = stopped(*wild)
    assert str(whole).startswith(str(bare)) and len(str(bare)) < len(str(whole))
    about = ("cause", "robot", "joint", "time")
    assert [getattr(bare, name) for name in about] == [getattr(whole, name) for name in about]
