"""Which theorem covers robots that hear each other late, in certificates, and the balance of V with them."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from theory_cells import GAINS, coupling, experiment

from synctrl import Coupling, Experiment, Network, Result
from synctrl.analysis.certify import Certificate, certify
from synctrl.analysis.delay_condition import delay_condition
from synctrl.analysis.lyapunov import lyapunov
from synctrl.analysis.replay import replay
from synctrl.control.laws import ChungSlotine, SunMills
from synctrl.control.network import Ideal
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four

FREE = GAINS.replace(K_eps=0.0)
UNEQUAL = Network(delay=[[0.0, 0.010], [0.0173, 0.0]])
FILTER = Network(period=4e-3, delay=5e-3, jitter=3e-3, loss=0.5)


def pair(network, gains=GAINS, weight: str = "moving", **options) -> Experiment:
    return replace(experiment(coupling("pair", 2, 2, weight), gains, **options), network=network)


def certificate(network, gains=GAINS, **options) -> Certificate:
    return certify(pair(network, gains, **options).simulate(0.05, 1e-3))


# -- theorems ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("network", "gains", "theorem"),
    [
        (UNEQUAL, FREE, "constant delays"),
        (UNEQUAL, GAINS, "constant delays"),
        (FILTER, FREE, "a filter under any loss"),
    ],
    ids=["delays", "delays and K_eps", "filter"],
)
def test_a_run_that_a_theorem_covers_is_certified_and_says_which(network, gains, theorem):
    found = certificate(network, gains)
    assert found.certified and found.delay_condition.theorem == theorem
    assert found.delay_condition.needed == bool(gains.K_eps.any())
    assert theorem in str(found)
    data = json.loads(json.dumps(found.as_dict(), allow_nan=False))["delay_condition"]
    assert data["margin"] == found.delay_condition.margin and data["holds"]


@pytest.mark.parametrize(
    ("network", "gains", "options", "reason"),
    [
        (FILTER, GAINS, {}, "K_eps = 0"),
        (UNEQUAL, GAINS.replace(K_r=1e-3), {}, "margin"),
        (Network(period=0.01, receiver="hold"), FREE, {}, "jumps at messages"),
        (Network(period=0.01, receiver="extrapolate"), FREE, {}, "jumps at messages"),
        (UNEQUAL, FREE, {"reference_acceleration": "paper"}, "exact reference acceleration"),
    ],
    ids=["filter and K_eps", "margin", "hold", "extrapolate", "paper"],
)
def test_a_run_that_no_theorem_covers_is_outside_and_says_why(network, gains, options, reason):
    found = certificate(network, gains, **options)
    assert not found.certified and found.delay_condition.theorem is None
    assert reason in found.delay_condition.reason
    assert any(found.delay_condition.reason in words for words in found.outside)


def test_sampled_control_and_other_laws_are_outside():
    run = pair(FILTER, FREE).simulate(0.02, 1e-3, control_period=2e-3)
    assert "continuous control" in certify(run).delay_condition.reason
    other = replace(pair(UNEQUAL, FREE.replace(beta=0.0)), law=ChungSlotine(0.3)).simulate(0.02, 1e-3)
    assert "ChungSlotine" in certify(other).delay_condition.reason


def test_a_coupling_of_all_robots_in_one_row_is_outside_for_a_robot_hears_more_of_others_than_of_itself():
    crowd = experiment(Coupling.sum(4), FREE)
    found = certify(replace(crowd, network=Network(delay=0.01)).simulate(0.01, 1e-3)).delay_condition
    assert found.theorem is None and "3 times" in found.reason


@pytest.mark.parametrize("network", [None, Ideal(), Network()])
def test_robots_that_hear_everything_at_once_need_no_theorem_of_delays(network):
    found = certificate(network)
    assert found.certified and found.delay_condition is None and "network" not in found.lyapunov.power


# -- the margin -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cartesian", [False, True])
@pytest.mark.parametrize("k_r_space", ["joint", "task"])
def test_the_margin_is_the_least_that_damping_has_beyond_what_delays_may_take(cartesian, k_r_space):
    link, gains = coupling("ring", 4, 2, "moving"), GAINS.replace(Lambda=[4.0, 7.0], K_eps=[1.5, 0.4])
    made = replace(
        experiment(link, gains, cartesian=cartesian, k_r_space=k_r_space), network=Network(delay=0.01)
    )
    run = made.simulate(0.02, 1e-3)
    found, cell = delay_condition(run), run.experiment.cell
    least = []
    for q, reference in zip(run.q, cell.references(run.t), strict=True):
        for robot, q_i, c in zip(cell.robots, q, reference.c, strict=True):
            T = c @ robot.jacobian(q_i)[:2] if cartesian and k_r_space == "joint" else c
            taken = 2 / 4 * T.T @ np.diag(np.array([1.5, 0.4]) / [4.0, 7.0]) @ T  # a = 2 on a ring
            least.append(np.linalg.eigvalsh(2.0 * np.eye(2) - taken)[0])
    assert found.margin == pytest.approx(min(least), rel=1e-9)
    assert found.robot == int(np.argmin(least)) % 4 and found.time == run.t[int(np.argmin(least)) // 4]


# -- the balance ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("receiver", ["hold", "extrapolate"])
def test_the_balance_closes_between_messages_that_make_v_jump(receiver):
    run = pair(Network(period=0.01, receiver=receiver)).simulate(0.05, 1e-3)
    record = lyapunov(run)
    assert record.events == (9, 19, 29, 39) and record.closes and record.drift_bound < 1e-6
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert np.abs(record.power["network"]).max() > 1e3 * record.rounding.max()
    jumps = np.diff(record.V)[list(record.events)]
    assert np.abs(jumps).max() > 1e-6


@pytest.mark.parametrize(
    "network",
    [Network(delay=[[0.0, 0.010], [0.016, 0.0]]), Network(period=4e-3, delay=8e-3, loss=0.5)],
    ids=["delays", "filter"],
)
def test_v_does_not_jump_at_messages_of_the_filter_and_of_delays(network):
    experiment = pair(network, FREE)
    records = [lyapunov(experiment.simulate(0.06, dt)) for dt in (2e-3, 1e-3, 5e-4)]
    for record in records:
        assert record.events == ()
        assert (np.abs(record.power["other"]) <= record.rounding).all()
        np.testing.assert_array_less(np.abs(record.power["network"]), record.rounding + 1e-300)
        np.testing.assert_array_less(record.V_dot - record.power["damping"], record.rounding)
    drifts = [record.largest_drift for record in records]
    # rates of what is heard jump on the log, so V' has kinks there: the quadrature is of second order
    assert drifts[0] > 3.5 * drifts[1] > 12 * drifts[2], drifts


@pytest.mark.parametrize(
    ("network", "bound"),  # kinks of V' on the log cost two orders with the filter
    [
        (UNEQUAL, 1e-8),
        (Network(period=4e-3, delay=4e-3), 2e-6),
        (Network(period=0.01, receiver="hold"), 1e-9),
        (Network(period=0.01, receiver="extrapolate"), 1e-9),
    ],
    ids=["delays", "filter", "hold", "extrapolate"],
)
def test_with_integrals_that_leak_v_changes_by_its_powers_too(network, bound):
    record = lyapunov(pair(network, GAINS.replace(leak=2.0)).simulate(0.03, 2.5e-4))
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert record.largest_drift < bound


def test_a_loaded_run_is_certified_again(tmp_path):
    made = pair(FILTER, FREE)
    run = made.simulate(0.02, 1e-3)
    loaded = Result.load(run.save(tmp_path / "run.npz"))
    assert certify(loaded, made).as_dict() == certify(run).as_dict()


# -- injection --------------------------------------------------------------------------------------------

WEAK = GAINS.replace(K_r=0.05)
INJECTION = SunMills(injection=True)


@pytest.mark.parametrize("cartesian", [False, True])
@pytest.mark.parametrize("coupled", ["pair", "ring"])
def test_injection_damps_r_by_what_delays_may_take_and_is_inside_the_theorem_without_them(coupled, cartesian):
    link = coupling(coupled, 2 if coupled == "pair" else 4, 2, "moving")
    run = replace(experiment(link, cartesian=cartesian), law=INJECTION).simulate(0.02, 1e-3)
    found, run = certify(run), replay(run)
    a = 1 if coupled == "pair" else 2
    r = run.rows.r
    expected = -(a / (4 * 4.0) * 1.5 * r**2).sum(axis=(1, 2))  # Lambda = 4, K_eps = 1.5
    assert found.certified
    np.testing.assert_allclose(found.lyapunov.power["injection"], expected, rtol=1e-12)
    assert (np.abs(found.lyapunov.power["other"]) <= found.lyapunov.rounding).all()


def test_injection_makes_the_condition_hold_by_itself():
    without, made = (
        replace(pair(UNEQUAL, WEAK), law=law).simulate(0.03, 1e-3) for law in (SunMills(), INJECTION)
    )
    assert not delay_condition(without).holds and certify(without).verdict == "bounded by Theorem A"
    assert delay_condition(made).margin == pytest.approx(0.05) and certify(made).certified


def test_injection_is_a_setting_of_the_law_that_stands_in_results():
    made = replace(pair(UNEQUAL), law=INJECTION)
    assert made.simulate(2e-3, 1e-3).info["law"]["injection"] is True
    assert "injection" not in SunMills().as_dict()
    with refused(InputError, "injection"):
        SunMills(injection="yes")  # type: ignore[arg-type]


def test_the_compiled_engine_injects_the_same():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    made = replace(experiment(coupling("pair", 2, 2), cartesian=True), law=INJECTION)
    ours, theirs = (made.simulate(0.02, 1e-3, engine=engine) for engine in ("compiled", "pinocchio"))
    for name in ("q", "v", "tau", "theta_hat"):
        expected = getattr(theirs, name)
        np.testing.assert_allclose(getattr(ours, name), expected, atol=1e-9 * np.abs(expected).max())


# -- the page ---------------------------------------------------------------------------------------------

PAGE = (Path(__file__).parents[1] / "docs" / "network.md").read_text("utf-8")


@pytest.mark.parametrize("make", [planar_four, partial(a460_pair, friction=False)], ids=["planar", "A460"])
def test_both_cells_of_the_paper_are_inside_the_theorem_with_the_margin_that_the_page_names(make):
    found = delay_condition(make(network=Network(delay=0.05)).simulate(2e-3, 1e-3))
    assert found.theorem and found.needed and f"{found.margin:.3g}" in PAGE


def test_the_example_of_the_page_runs():
    for block in re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL):
        exec(compile(block.replace("simulate(0.5", "simulate(0.01"), "docs/network.md", "exec"), {})


def test_the_page_names_tests_that_exist():
    for file, names in re.findall(r"\[`(test_\w+\.py)`: ([^\]]+)\]", PAGE):
        text = (Path(__file__).parent / file).read_text("utf-8")
        for name in re.findall(r"`(\w+)`", names):
            assert f"def {name}(" in text, name
