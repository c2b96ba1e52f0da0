"""Diffusive coupling: robots tell each other r, and pull on what differs, whatever the constant delay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from scipy.interpolate import make_interp_spline
from theory_cells import GAINS, coupling, experiment

from synctrl import Coupling, Experiment, Network
from synctrl.analysis.balance import supplied
from synctrl.analysis.certify import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.analysis.replay import replay
from synctrl.control.adaptation import Composite
from synctrl.control.laws import DIFFUSION, SunMills
from synctrl.control.network import Ideal, Links
from synctrl.errors import InputError

K_2 = np.array([0.8, 0.3])
LAW = SunMills(diffusion=K_2)
#: of robot 1 from robot 2, and the other way
UNEQUAL = np.array([[0.0, 6e-3], [14e-3, 0.0]])


def pair(network, law: SunMills | None = LAW, weight: str = "moving", gains=GAINS, **options) -> Experiment:
    made = experiment(coupling("pair", 2, 2, weight), gains, **options)
    return replace(made, network=network, law=law)


def weighed(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """x^T K_2 y of rows, summed over all axes but the first."""
    return (x * K_2 * y).reshape(len(x), -1).sum(axis=1)


# -- the identity -----------------------------------------------------------------------------------------


def test_what_coupling_gives_and_what_is_on_the_way_add_up_to_squares():
    rng = np.random.default_rng(0)
    edges = [(0, 1), (1, 2), (2, 3), (1, 4)]
    signs = [(1.0, 1.0), (1.0, -2.0), (-3.0, 1.0), (1.0, 0.5)]
    links = Links(Coupling(5, edges, signs, np.ones(5)))
    r, old = rng.normal(size=(5, 2)), rng.normal(size=(links.count, 2))
    size, sign = np.abs(links.weight)[:, None], np.sign(links.weight)[:, None]
    weight, told = links.slips(old, np.ones(links.count))
    given = -(r * K_2 * (weight * r + told)).sum()
    stored = 0.5 * (size * K_2 * (r[links.sender] ** 2 - old**2)).sum()
    x = r[links.hearer] + sign * old
    assert given + stored == pytest.approx(-0.5 * (size * K_2 * x**2).sum(), rel=1e-14)


# -- at once ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cartesian", [False, True])
def test_robots_that_hear_each_other_at_once_lose_by_squares_of_what_they_differ_by(cartesian):
    run = pair(Network(), cartesian=cartesian).simulate(0.02, 1e-3)
    found, r = certify(run), replay(run).rows.r
    apart = r[:, 0] + np.sign(Links(run.experiment.cell.coupling).weight[0]) * r[:, 1]
    record = found.lyapunov
    assert found.certified, str(found)
    np.testing.assert_allclose(record.power[DIFFUSION], -weighed(apart, apart), rtol=1e-10)
    assert (np.abs(record.power["other"]) <= record.rounding).all()


@pytest.mark.parametrize(
    "network",
    [
        Network(),
        Network(delay=UNEQUAL),
        Network(period=4e-3, loss=0.3),
        Network(period=4e-3, receiver="hold"),
    ],
    ids=["at once", "delays", "filter", "hold"],
)
def test_telling_r_changes_nothing_else_and_without_gain_there_is_no_coupling(network):
    runs = [
        pair(network, SunMills(diffusion=gain)).simulate(0.02, 1e-3) for gain in (0.0, (1e-300, 0.0))
    ]  # the second is told r, and takes less of it than rounding
    runs.append(pair(network, SunMills()).simulate(0.02, 1e-3))
    for run in runs[1:]:
        for name in ("q", "v", "tau", "theta_hat", "sync_integral"):
            assert np.array_equal(getattr(run, name), getattr(runs[0], name))
    assert runs[0].info["law"] == runs[2].info["law"] and "diffusion" in runs[1].info["law"]


# -- constant delays --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("leak", "weight"), [(0.0, "moving"), (2.0, "scalar")])
def test_what_robots_hear_of_r_is_what_it_was_a_delay_ago(leak, weight):
    delay = 1e-3 * np.array([[0, 4, 0, 8], [6, 0, 0, 0], [0, 6, 0, 4], [2, 0, 4, 0]])
    made = experiment(coupling("ring", 4, 2, weight), GAINS.replace(leak=leak))
    made = replace(made, network=Network(delay=delay), law=LAW)
    run = replay(made.simulate(0.04, 5e-4))
    rows, links = run.rows, run.loop.controller.network.links
    r, told = rows.r[run.logged], rows.slips[run.logged]
    expected = np.zeros_like(told[:, 1])
    for i, j, A in zip(links.hearer, links.sender, links.weight, strict=True):
        ago = round(delay[i, j] / 5e-4)
        expected[ago:, i] += A * r[: len(r) - ago, j]
    interpolated = 1e-6 * np.abs(r).max()  # between instants of the grid
    np.testing.assert_allclose(told[20:, 1], expected[20:], atol=interpolated)
    np.testing.assert_allclose(told[:, 0], 2.0)


def before(run, t: np.ndarray) -> np.ndarray:
    """r of both robots before the beginning, (T, n, m), where w stood still."""
    cell, gains = run.loop.cell, run.experiment.gains
    w = np.matvec(run.rows.c[0], run.result.tracking_error[0])
    A, t = float(Links(cell.coupling).weight[0]), t[:, None, None]
    sigma = w + A * w[::-1]
    late = UNEQUAL.sum(axis=1)[:, None]
    E = t * w + A * (t - late) * w[::-1]
    return gains.beta * sigma + gains.Lambda * (w + gains.beta * E)


def storage(run) -> np.ndarray:
    """1/2 sum_i sum_j |A_ij| int_{t-d}^t r_j^T K_2 r_j, (T,), by splines through r and its past."""
    t, r, total = run.result.t, run.rows.r[run.logged], 0.0
    for j, d in enumerate(UNEQUAL.sum(axis=0)):
        past = np.linspace(-0.02, 0.0, 41)
        old = make_interp_spline(
            past, weighed(before(run, past)[:, j], before(run, past)[:, j])
        ).antiderivative()
        new = make_interp_spline(t, weighed(r[:, j], r[:, j])).antiderivative()
        since = np.where(t < d, old(0.0) - old(t - d), 0.0) + new(t) - new(np.maximum(t - d, 0.0))
        total = total + 0.5 * since
    return total


def balance(adaptation, dt: float) -> tuple[float, float, np.ndarray]:
    """What is missing in the balance of V and the storage, what squares took, and V with the storage."""
    gains = GAINS.replace(K_eps=0.0, Gamma=GAINS.Gamma if adaptation is None else None)
    run = replay(pair(Network(delay=UNEQUAL), gains=gains, adaptation=adaptation).simulate(0.06, dt))
    record, (weight, told) = lyapunov(run), run.rows.slips.swapaxes(0, 1)
    x = run.rows.r + told  # A is 1 or -1
    took = 0.5 * supplied(run, weighed(x, x))
    total = record.V + storage(run)
    given = sum(power for name, power in record.supplied.items() if name != DIFFUSION)
    assert (weight == 1).all()
    return abs(total[-1] - total[0] - given + took), took, total


@pytest.mark.parametrize("adaptation", [None, Composite(0.02, 0.1, 10.0)], ids=["gradient", "composite"])
def test_v_and_what_is_on_the_way_fall_by_squares_whatever_the_delays(adaptation):
    (coarse, _, _), (fine, took, total) = (balance(adaptation, dt) for dt in (2e-3, 1e-3))
    assert fine < 1e-5 * took and fine < coarse / 8  # the fourth power of the step would be 16
    assert (np.diff(total) < 0).all()


def test_v_alone_may_be_given_power_and_the_certificate_says_whose():
    found = certify(pair(Network(delay=UNEQUAL)).simulate(0.03, 1e-3))
    record = found.lyapunov
    assert record.closes and (np.abs(record.power["other"]) <= record.rounding).all()
    assert found.verdict == "bounded by Theorem A" and DIFFUSION not in record.inside
    assert found.delay_condition.theorem is None and found.doubts == ()


# -- messages ---------------------------------------------------------------------------------------------

PERIOD = 4e-3


def test_a_message_that_is_lost_takes_the_coupling_of_its_link_with_it():
    run = replay(pair(Network(period=PERIOD, loss=0.5, seed=3)).simulate(0.1, 1e-3))
    come = run.result.outputs["messages_heard"][::4]
    weight = run.rows.slips[run.logged, 0, :, 0]
    for k in range(1, len(come) - 1):
        heard = come[k] > come[k - 1]
        np.testing.assert_array_equal(weight[4 * k : 4 * k + 4], np.tile(heard, (4, 1)))
    assert 0.2 < weight.mean() < 0.8
    silent = weight == 0
    assert (run.rows.slips[run.logged, 1][silent] == 0).all()


@pytest.mark.parametrize("chance", [{}, {"delay": 5e-3}, {"delay": 1e-3, "jitter": 6e-3}], ids=str)
def test_while_every_message_comes_every_link_counts(chance):
    rows = replay(pair(Network(period=PERIOD, **chance)).simulate(0.04, 1e-3)).rows
    assert (rows.slips[:, 0] == 1).all()


def test_a_message_has_r_of_its_sender_and_it_holds_until_the_next_one():
    run = replay(pair(Network(period=PERIOD, delay=PERIOD)).simulate(0.04, 1e-3))
    A = float(run.loop.controller.network.links.weight[0])
    r, told = run.rows.r[run.logged], run.rows.slips[run.logged, 1]
    for k in range(1, 10):
        sent = r[4 * (k - 1), ::-1]
        np.testing.assert_allclose(told[4 * k : 4 * k + 4], np.tile(A * sent, (4, 1, 1)), rtol=1e-12)


def test_sampled_control_is_told_r_by_messages_too():
    made = pair(Network(period=PERIOD, loss=0.3, seed=1))
    run = made.simulate(0.04, 1e-3, control_period=2e-3)
    assert run.status == "completed"
    without = replace(made, law=SunMills()).simulate(0.04, 1e-3, control_period=2e-3)
    assert np.abs(run.tau - without.tau).max() > 1e-3 * np.abs(without.tau).max()


# -- what does not go together ----------------------------------------------------------------------------


@pytest.mark.parametrize("network", [None, Ideal()], ids=["none", "Ideal"])
def test_a_network_whose_robots_do_not_tell_r_is_refused(network):
    with refused(InputError, "network", "Ideal"):
        pair(network).simulate(0.01, 1e-3)


@pytest.mark.parametrize("gain", [-1.0, np.nan, (1.0, -0.1), "much"])
def test_a_gain_that_is_none_is_refused(gain):
    with refused(InputError, "diffusion"):
        SunMills(diffusion=gain)


def test_a_gain_of_another_size_is_refused():
    with refused(InputError, "diffusion"):
        pair(Network(), SunMills(diffusion=(1.0, 2.0, 3.0))).simulate(0.01, 1e-3)


def test_generated_code_and_agents_that_know_nothing_of_r_refuse_the_law():
    made = pair(Network(period=PERIOD))
    with refused(InputError, "law"):
        made.simulate(0.01, 1e-3, engine="compiled")
    with refused(InputError, "law"):
        made.agents(2e-3)


def test_diffusion_stands_in_results_if_there_is_some():
    assert SunMills(diffusion=0.5).as_dict()["diffusion"] == 0.5
    assert "diffusion" not in SunMills(diffusion=0.0).as_dict()
