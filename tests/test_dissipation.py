"""Theorem A: what unmodelled torque can do at most, beside what it did."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from cells import random_experiment
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused
from scipy.optimize import minimize
from test_devices import ALL, small
from test_pages import DOCS
from test_pages import run as run_page
from test_saturation import pair
from theory_cells import GAINS, coupling, experiment

from synctrl import Cell, Disturbance, Experiment, Friction, Network, Payload, Result
from synctrl.analysis import Dissipation, certify, dissipation, modal_bounds
from synctrl.analysis.lyapunov import lyapunov
from synctrl.analysis.replay import Replay, replay
from synctrl.control.adaptation import Ball, Leakage
from synctrl.control.laws import ChungSlotine, MasterSlave
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, carry_ur5, panda_four, planar_four, ur5_payload
from synctrl.experiments.planar_four import GAINS as FOUR
from synctrl.robots.base_parameters import grouping
from synctrl.robots.parameters import FrictionParameters
from synctrl.simulation.result import LAYOUT

pytestmark = [
    pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning"),  # odd rings are meant
    pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning"),
    pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning"),
]
PUSH = Disturbance(robot=0, torque=2.0, start=0.01, stop=0.03)
SOURCES = {
    "friction": {"friction": Friction(0.5, 0.3, 0.1)},
    "disturbance": {"disturbances": (PUSH,)},
    "model error": {"gains": GAINS.replace(Gamma=0.0)},
    "weight rate": {"reference_acceleration": "paper", "gains": GAINS.replace(K_r=60.0, Gamma=1e-3)},
}


#: what quadrature may add where the bound is reached
ROUNDING = 1e-6


def keeps(found: Dissipation) -> bool:
    """Whether a run stays below what the theorem promises."""
    most = 1 + ROUNDING
    return found.reason is None and found.X_bound * most >= found.X and found.rest_bound * most >= found.rest


def acting(found: Dissipation) -> list[str]:
    """Names of the sources that are more than rounding."""
    floor = 1e-9 * max(1.0, found.X)
    return [name for name, D in found.sources.items() if floor < D]


# -- the balance -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("source", SOURCES)
def test_what_acts_is_named_and_the_balance_closes(source: str) -> None:
    run = replay(experiment(coupling("ring", 4, 2, "moving"), **SOURCES[source]).simulate(0.05, 1e-3))
    found, record = dissipation(run), lyapunov(run)
    assert keeps(found)
    assert acting(found) == [source]
    assert found.supply[-1] == pytest.approx(record.supplied[source], rel=1e-9)
    assert np.abs(found.gap).max() <= record.drift_bound


@pytest.mark.parametrize(
    "options",
    [
        {"adaptation": Leakage(0.3, 2.0)},
        {"adaptation": Ball(0.3, 0.5)},
        {"law": ChungSlotine(0.5), "gains": GAINS.replace(beta=0.0, K_eps=0.0)},
        {"gains": GAINS.replace(leak=1.0)},
        {"cartesian": True, "k_r_space": "task", "friction": Friction(0.5, 0.3, 0.1)},
    ],
)
def test_the_balance_closes_with_other_adaptations_laws_and_spaces(options: dict) -> None:
    if "adaptation" in options:
        options = {"gains": GAINS.replace(Gamma=None), **options}
    run = replay(experiment(coupling("ring", 4, 2), **options).simulate(0.05, 1e-3))
    found = dissipation(run)
    assert keeps(found)
    assert np.abs(found.gap).max() <= lyapunov(run).drift_bound


def test_friction_that_is_adapted_is_lost_and_no_torque() -> None:
    run = experiment(coupling("ring", 4, 2), friction=Friction(0.5, 0.3, 0.1))
    known = [FrictionParameters(member.robot, member.friction) for member in run.cell.members]
    members = [
        replace(member, parameters=each, theta_hat0=0.6 * each.theta)
        for member, each in zip(run.cell.members, known, strict=True)
    ]
    adapted = replay(replace(run, cell=Cell(members, run.cell.coupling)).simulate(0.05, 1e-3))
    found, record = dissipation(adapted), lyapunov(adapted)
    assert keeps(found)
    assert acting(found) == []
    assert np.abs(found.gap).max() <= record.drift_bound < 0.01 * abs(record.supplied["friction in Y"])


def test_under_sampled_control_the_balance_closes_with_the_square_of_the_step() -> None:
    found = [dissipation(small().simulate(0.06, dt, control_period=2e-3)) for dt in (1e-3, 5e-4)]
    assert all(map(keeps, found))
    assert acting(found[0]) == ["sampling"]
    coarse, fine = (np.abs(each.gap).max() for each in found)
    assert fine < coarse / 3 < 1e-3 * found[0].damped[-1]


def test_what_sensors_and_actuators_do_is_a_torque_and_the_balance_closes() -> None:
    found = dissipation(small(**ALL).simulate(0.06, 5e-4, control_period=2e-3))
    plain = dissipation(small().simulate(0.06, 5e-4, control_period=2e-3))
    assert keeps(found)
    assert acting(found) == ["sampling", "actuators"]
    assert found.sources["sampling"] > 2 * plain.sources["sampling"]
    assert np.abs(found.gap).max() < 1e-3 * found.damped[-1]


def test_what_samples_do_goes_to_zero_with_the_period() -> None:
    run = experiment(coupling("ring", 4, 2, "moving"))
    D = [dissipation(run.simulate(0.05, 5e-4, control_period=period)).D for period in (2e-3, 5e-4)]
    assert D[1] < D[0] / 3


def test_delays_enter_as_energy_and_no_torque() -> None:
    run = replay(planar_four(network=Network(delay=0.02)).simulate(0.1))
    found = dissipation(run)
    assert keeps(found)
    assert acting(found) == []
    network = lyapunov(run).supplied["network"]
    assert abs(network) > 20 * np.abs(found.gap).max()
    assert found.entering[-1] == pytest.approx(network, rel=1e-6)


def test_a_network_that_stands_still_between_messages_is_a_torque_too_but_v_jumps() -> None:
    hold = Network(period=4e-3, delay=4e-3, receiver="hold")
    found = dissipation(planar_four(network=hold).simulate(0.02))
    assert acting(found) == ["network"]
    assert found.reason is not None
    assert "V jumps" in found.reason


@pytest.mark.parametrize("period", [None, 2e-3])
def test_a_load_that_nobody_told_of_is_a_torque_as_any_other(period: float | None) -> None:
    cell = planar_four()
    load = Payload(robot=1, mass=0.2, start=0.01, stop=0.04)
    found = dissipation(replace(cell, payloads=(load,)).simulate(0.06, control_period=period))
    assert keeps(found)
    assert "other" in acting(found)
    assert np.abs(found.gap).max() < 1e-3 * found.damped[-1]


def test_what_robots_hold_together_pulls_on_each_of_them() -> None:
    found = dissipation(carry_ur5().simulate(0.01))
    assert keeps(found)
    assert acting(found) == ["what is held"]


# -- base parameters ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("cell", "full", "base"), [(a460_pair, 47.8, 2.73), (ur5_payload, 35.3, 6.31)])
def test_errors_that_no_torque_shows_are_not_in_v(cell, full: float, base: float) -> None:
    """Against the figures of the theorem's referee, who computed them by himself."""
    found = dissipation(cell().simulate(2e-3))
    assert abs(found.V0_full - full) < 0.05
    assert abs(found.V0 - base) < 0.005


def test_v_of_base_parameters_is_the_least_that_gives_the_same_torque_and_changes_as_v_does() -> None:
    run = replay(experiment(coupling("ring", 4, 2, "moving"), friction=Friction(0.5)).simulate(0.05, 1e-3))
    found, record, cell = dissipation(run), lyapunov(run), run.loop.cell
    least, rate = 0.0, np.sqrt(float(GAINS.Gamma))
    for i, parameters in enumerate(cell.parameters):  # min 1/2 x^T Gamma^-1 x of all x with K x = K tilde
        K = grouping(parameters, cell.robots[i].nv).K
        x = np.linalg.lstsq(K * rate, K @ (cell.theta[i] - cell.theta_hat0[i]))[0]
        least += 0.5 * x @ x
    rest = record.V[0] - record.energy["parameter"][0]
    assert abs(found.V0 - least - rest) < 1e-9 * least
    np.testing.assert_allclose(found.V - found.V0, record.V - record.V[0], atol=1e-10 * record.V[0])
    assert found.V0_full == pytest.approx(record.V[0])


# -- the bound ---------------------------------------------------------------------------------------------


@settings(max_examples=15)
@given(data=st.data())
def test_no_run_exceeds_its_bound(data: st.DataObject) -> None:
    kind = data.draw(st.sampled_from(["pair", "ring", "signed graph", "all-to-all"]))
    n, joints = 2 if kind == "pair" else data.draw(st.integers(2, 4)), data.draw(st.integers(1, 2))
    size, some = st.floats(0.2, 8.0), st.sampled_from([0.0, 0.02, 0.3])
    gains = GAINS.replace(
        Lambda=data.draw(size), beta=data.draw(st.floats(0.0, 8.0)), K_r=data.draw(size),
        K_eps=data.draw(st.floats(0.0, 4.0)), Gamma=[data.draw(some) for _ in range(10 * joints)],
    )  # fmt: skip
    torque = data.draw(st.floats(-3.0, 3.0))
    run = experiment(
        coupling(kind, n, joints, data.draw(st.sampled_from(["scalar", "constant", "moving"]))), gains,
        joints=joints, known=data.draw(st.floats(0.0, 2.0)),
        friction=Friction(data.draw(st.floats(0.0, 1.0)), data.draw(st.floats(0.0, 1.0)), 0.1),
        disturbances=[Disturbance(0, torque, 0.005, 0.02), Disturbance(1, -torque, 0.01, 0.03)],
        network=data.draw(st.sampled_from([None, Network(period=2e-3, delay=4e-3)])),
    )  # fmt: skip
    period = data.draw(st.sampled_from([None, 2e-3]))
    assert keeps(dissipation(run.simulate(0.04, 1e-3, control_period=period)))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("space", ["joint", "cartesian"])
def test_no_random_robot_exceeds_its_bound(seed: int, space: str) -> None:
    assert keeps(dissipation(random_experiment(seed, space).simulate(0.02, 1e-3)))


@pytest.mark.parametrize("period", [None, 2e-3])
def test_torque_that_saturation_takes_away_is_bounded(period: float | None) -> None:
    found = dissipation(pair(way=60.0).simulate(0.05, control_period=period))
    assert keeps(found)
    assert "saturation" in acting(found)


def test_pose_and_redundant_cells_keep_the_bound() -> None:
    for cell in (ur5_payload(), panda_four()):
        run = replace(cell, disturbances=(Disturbance(0, 3.0, 0.0, 0.02),))
        assert keeps(dissipation(run.simulate(0.02)))


def test_the_bound_is_where_v_at_the_start_what_entered_and_the_work_of_d_are_spent() -> None:
    friction, forgets = Friction(0.5, 0.3, 0.1), Leakage(0.3, 20.0)
    run = experiment(coupling("pair", 2, 2), GAINS.replace(Gamma=None), friction=friction, adaptation=forgets)
    found = dissipation(run.simulate(0.1, 1e-3))
    assert keeps(found)
    assert found.entering.max() > 1e-3 * found.V0
    given = found.V0 + found.entering.max()
    assert found.X_bound**2 == pytest.approx(given + found.X_bound * found.D, rel=1e-12)
    assert found.rest_bound == pytest.approx(given + 0.25 * found.D**2, rel=1e-12)


# -- that it is not empty ----------------------------------------------------------------------------------


def pushed(torques: np.ndarray, window: float, gains=GAINS, known: float = 1.0, **options) -> Experiment:
    """Two arms with one joint each, under torques that are constant for a while, (windows, 2)."""
    pushes = [
        Disturbance(robot, torque, k * window, (k + 1) * window)
        for k, row in enumerate(torques)
        for robot, torque in enumerate(row)
    ]
    options = {"joints": 1, "gravity": 0.0, **options}
    return experiment(coupling("pair", 2, 1), gains, known=known, disturbances=pushes, **options)


def test_torque_that_undoes_damping_reaches_the_bound() -> None:
    """d = share K_r s gives X^2 (1 - share) = V(0), which is equality; so is X^2 = V(0) without it."""
    share, window, K_r = 0.5, 2e-3, 2.0
    bare = GAINS.replace(beta=0.0, K_eps=0.0, Gamma=0.0)
    less = pushed(np.zeros((1, 2)), window, bare.replace(K_r=(1 - share) * K_r)).simulate(0.3, 1e-3)
    s = less.v_error[1::2, :, 0]  # in the middle of every window
    run = pushed(-share * K_r * s, window, bare).simulate(0.3, 1e-3)
    found, free = dissipation(run), dissipation(pushed(np.zeros((1, 2)), window, bare).simulate(0.3, 1e-3))
    assert 0.99 < found.X / found.X_bound < 1 + ROUNDING
    assert 0.99 < free.X / free.X_bound < 1 + ROUNDING
    assert found.X > 1.2 * free.X


def test_the_worst_torque_that_can_be_found_comes_near_the_bound_and_stays_below() -> None:
    """The whole law, with springs and adaptation, against torque in two windows on either arm."""
    shares: list[float] = []

    def short_of(torques: np.ndarray) -> float:
        run = pushed(3.0 * torques.reshape(2, 2), 0.36, GAINS).simulate(0.72, 1.2e-2)
        found = dissipation(run)
        shares.append(found.X / found.X_bound)
        return 1 - shares[-1]

    minimize(short_of, [1.0, 0.3, -1.0, 0.5], method="L-BFGS-B", options={"maxfun": 25, "eps": 1e-3})
    assert abs(shares[0] - 0.82) < 0.01, "the page says where it began"
    assert abs(max(shares) - 0.94) < 0.01, "and how near it came"


# -- what is said ------------------------------------------------------------------------------------------


def test_where_the_theorem_does_not_reach_nothing_is_promised_and_the_certificate_agrees() -> None:
    run = experiment(coupling("pair", 2, 2), GAINS.replace(beta=0.0, K_eps=0.0), law=MasterSlave())
    result = run.simulate(0.02, 1e-3)
    found, certificate = dissipation(result), certify(result)
    assert found.reason == "; ".join(certificate.unbounded)
    assert certificate.dissipation is not None
    assert certificate.dissipation.as_dict() == found.as_dict()
    assert certificate.verdict == "outside the theorem"
    assert found.X_bound == found.rest_bound == float("inf")
    assert found.as_dict()["X_bound"] is None
    assert found.reason in str(certificate)


def test_every_certificate_has_the_bounds_beside_the_actual_values() -> None:
    result = experiment(coupling("ring", 4, 2), friction=Friction(0.5)).simulate(0.03, 1e-3)
    certificate, found = certify(result), dissipation(result)
    assert certificate.verdict == "bounded by Theorem A"
    assert json.loads(json.dumps(certificate.as_dict()))["dissipation"] == found.as_dict()
    for line in found.lines:
        assert line in str(certificate)
    assert found.mean_square * 0.03 == pytest.approx(found.X**2)


def test_a_log_that_is_too_coarse_for_its_integrals_says_so() -> None:
    result = experiment(coupling("pair", 2, 2), GAINS.replace(K_r=20.0), known=1.0).simulate(0.2, 1e-3)
    thinned = result.decimated(100)
    fine, coarse = dissipation(result), dissipation(thinned)
    assert fine.unresolved is None
    assert len(fine.lines) == 2
    assert coarse.X_bound < coarse.X  # that is what the warning is for
    for found in (coarse, modal_bounds(thinned)):
        assert found.unresolved is not None
        assert found.unresolved in str(found)
        assert found.as_dict()["unresolved"] == found.unresolved


def test_a_loaded_run_has_the_same_dissipation(tmp_path) -> None:
    run = small(**ALL)
    result = run.simulate(0.02, 1e-3, control_period=2e-3)
    loaded = Result.load(result.save(tmp_path / "run.npz"))
    with refused(InputError, "experiment"):
        dissipation(loaded)
    assert dissipation(loaded, run).as_dict() == dissipation(result).as_dict()


@pytest.mark.parametrize("period", [None, 1e-3])
def test_a_run_that_came_no_farther_than_its_first_instant_has_a_balance(period: float | None) -> None:
    run = experiment(coupling("pair", 2, 1), joints=1)
    result = run.simulate(2e-3, 1e-3, control_period=period)
    first = replace(result, **{name: getattr(result, name)[:1] for name in LAYOUT})
    found = dissipation(first)
    assert found.X == found.D == 0.0
    assert found.VT == found.V0
    json.dumps(certify(first).as_dict(), allow_nan=False)


def test_a_replay_is_used_as_it_is() -> None:
    run = replay(experiment(coupling("pair", 2, 1), joints=1).simulate(0.01, 1e-3))
    assert isinstance(run, Replay)
    assert dissipation(run).t is run.result.t


# -- the page and the figure -------------------------------------------------------------------------------

PAGE = (DOCS / "theorem_a.md").read_text("utf-8")
NUDGE = Disturbance(0, -1.0, 0.1, 0.2)
ROWS: dict[str, tuple[Callable[[], Experiment], float | None]] = {
    "planar_four": (planar_four, None),
    "planar_four, pushed": (lambda: planar_four(disturbance=NUDGE), None),
    "planar_four, not adapted": (lambda: planar_four(gains=FOUR.replace(Gamma=0.0)), None),
    "a460_pair": (a460_pair, None),
    "a460_pair, held for 2 ms": (lambda: a460_pair(friction=False), 2e-3),
    "ur5_payload": (ur5_payload, None),
}


def test_the_example_of_the_page_prints_what_the_page_says() -> None:
    for line in run_page("theorem_a.md")["found"].lines:
        assert f"    {line}\n" in PAGE


@pytest.mark.parametrize("row", ROWS)
def test_the_table_of_the_page_is_that_of_the_runs(row: str) -> None:
    make, period = ROWS[row]
    found = dissipation(make().simulate(0.3, 1e-3, control_period=period))
    numbers = (found.D, found.V0, found.X, found.X_bound, found.rest, found.rest_bound)
    told = next(line for line in PAGE.splitlines() if line.startswith(f"| {row} |")).split("|")[2:-1]
    np.testing.assert_allclose(numbers, [float(number) for number in told], rtol=6e-3, atol=1e-9)


def test_the_figure_has_the_sum_below_its_bound_and_no_bound_where_there_is_none() -> None:
    pytest.importorskip("matplotlib", reason="figures are an extra: pip install 'synctrl[plot]'")
    from synctrl.show.dissipation_figures import dissipation_figure

    found = dissipation(experiment(coupling("pair", 2, 1), joints=1).simulate(0.02, 1e-3))
    lines = {line.get_label(): line for line in dissipation_figure(found).axes[0].get_lines()}
    total = found.V + found.damped + found.lost
    np.testing.assert_array_equal(lines["sum"].get_ydata(), total)
    np.testing.assert_array_equal(lines["at most"].get_ydata(), found.bound**2)
    assert (found.bound**2 >= total * (1 - ROUNDING)).all()
    without = dissipation_figure(replace(found, reason="no law"))
    assert "at most" not in [line.get_label() for panel in without.axes for line in panel.get_lines()]


def test_where_nothing_acts_d_is_said_to_be_0() -> None:
    found = dissipation(experiment(coupling("pair", 2, 1), joints=1).simulate(0.02, 1e-3))
    assert found.D < 1e-9 and "D = 0 sqrt(N·m) (nothing)" in str(found)
