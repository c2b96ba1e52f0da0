"""How seldom robots may send: receivers between messages, and the cell over one period of them."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused
from ur5_joints import GAINS, ur5_joints

from synctrl import Cell
from synctrl.analysis import delay_margin, period_margin
from synctrl.analysis.delay_margin import growth
from synctrl.analysis.frozen import Frozen, freeze
from synctrl.analysis.period_margin import Exchange, first_loss, monodromy, receiver_of, sampled_growth
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four


@pytest.fixture(scope="module")
def ur5() -> Cell:
    return ur5_joints()


@pytest.fixture(scope="module")
def frozen(ur5) -> Frozen:
    return freeze(ur5, GAINS)


#: printed in whole milliseconds where the law of the network is derived, found there by trying periods
KNOWN = [
    ("planar", "hold", 0.0, np.inf),
    ("planar", "extrapolate", 0.0, 8),
    ("planar", "filter", 50.0, np.inf),
    ("planar", "filter", 200.0, 56),
    ("A460", "extrapolate", 0.0, 95),
    ("UR5", "hold", 0.0, 43),
    ("UR5", "extrapolate", 0.0, 28),
    ("UR5", "filter", 50.0, np.inf),
    ("UR5", "filter", 100.0, 59),
    ("UR5", "filter", 200.0, 50),
]


@pytest.mark.parametrize(("name", "receiver", "omega", "known"), KNOWN)
def test_the_longest_periods_are_those_found_elsewhere(ur5, name, receiver, omega, known):
    paper = {"planar": planar_four, "A460": lambda: a460_pair(friction=False)}
    cell, gains = (ur5, GAINS) if name == "UR5" else ((e := paper[name]()).cell, e.gains)
    longest = 0.995
    found = period_margin(cell, gains, receiver=receiver, omega=omega or 1.0, horizon=np.inf, longest=longest)
    assert found == known if np.isinf(known) else known <= 1e3 * found < known + 1


@pytest.mark.parametrize("receiver", ["hold", "extrapolate", "filter"])
def test_a_longer_period_loses_what_a_shorter_one_keeps(ur5, frozen, receiver):
    period = period_margin(ur5, GAINS, receiver=receiver, omega=200.0)
    at = {share: Exchange(share * period, 0.0, receiver, 200.0, frozen.horizon) for share in (0.99, 1.01)}
    assert sampled_growth(frozen, at[0.99]) < 0 < sampled_growth(frozen, at[1.01])


@pytest.mark.parametrize("delay", [0.01, 0.03])
def test_messages_that_come_ever_faster_are_the_continuous_exchange(frozen, delay):
    expected = growth(frozen, delay)
    held = [Exchange(period, delay - 0.5 * period, "hold") for period in (4e-3, 2e-3)]  # half a period old
    coarse, fine = (abs(sampled_growth(frozen, exchange) - expected) for exchange in held)
    assert fine < 0.02 and fine < 0.5 * coarse + 1e-9


def test_a_filter_comes_to_rest_at_what_was_sent():
    receiver = receiver_of(Exchange(0.03, 0.0, "filter", 70.0), np.zeros(1))
    rest = np.linalg.solve(receiver.flow[1:, 1:], -receiver.flow[1:, 0])
    np.testing.assert_allclose(rest, [1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("receiver", ["hold", "extrapolate", "filter"])
@pytest.mark.parametrize("share", [0.4, 1.0, 2.7])
def test_messages_under_way_are_heard_in_the_order_in_which_they_were_sent(receiver, share):
    """A sender that moves by itself, and one that hears nothing of it: what is received can be said."""
    a, period = -1.3, 0.1
    sent = np.array([[1.0, 0.0], [a, 0.0], [a * a, 0.0]])
    heard = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    own = np.array([[a, 0.0], [0.0, 0.0]])
    alone = Frozen(own, heard, sent, np.zeros(1), np.inf, (1,), np.ones(1), False)
    exchange = Exchange(period, share * period, receiver, 40.0)
    M = monodromy(alone, exchange)
    values = np.linalg.eigvals(M)
    assert np.abs(values - np.exp(a * period)).min() < 1e-12  # nothing of the network moves the sender
    state = np.zeros(len(M))
    state[0] = 1.0
    for _ in range(60):
        state = M @ state / np.exp(a * period)
    receiving = state[2:5] / state[0]
    age = (np.floor(share) + 1) * period  # of what was heard last, just before the next message is sent
    past, grown = np.exp(-a * age), a * age
    if receiver == "filter":
        held = past * np.exp(-a * period * np.arange(60))[::-1]
        times = np.append(np.full(59, period), period * (1 - share % 1))
        np.testing.assert_allclose(receiving, (past, *filtered(held, times, 40.0)), rtol=1e-9)
    else:
        believed = past * (1.0 if receiver == "hold" else 1 + grown + 0.5 * grown**2)
        assert receiving[0] == pytest.approx(believed, rel=1e-9)


def filtered(held, times, omega):
    """What a filter of second order has after it was pulled to values, each for a time, and its rate."""
    value = rate = 0.0
    for target, t in zip(held, times, strict=True):
        off, fades = value - target, np.exp(-omega * t)
        slope = rate + omega * off
        value, rate = target + (off + slope * t) * fades, (rate - omega * slope * t) * fades
    return value, rate


def test_extrapolation_stops_at_its_horizon():
    cell, gains = (e := planar_four()).cell, e.gains
    without = period_margin(cell, gains, receiver="extrapolate", horizon=np.inf)
    within = period_margin(cell, gains, receiver="extrapolate")
    assert freeze(cell, gains).horizon == 1 / (100 * 2)  # 1/(beta a)
    assert without < within < np.inf


def test_what_is_held_is_half_a_period_old_on_top_of_its_delay(ur5, frozen):
    """Where messages are frequent, their ages add up to the delay that may be had at all."""
    most, period = delay_margin(ur5, GAINS).delay, 4e-3
    delays = (share * most - 0.5 * period for share in (0.97, 1.03))
    below, above = (sampled_growth(frozen, Exchange(period, delay, "hold")) for delay in delays)
    assert below < 0 < above


def test_a_delay_of_a_period_is_tolerated_as_far_as_was_found_elsewhere(frozen):
    below, above = (sampled_growth(frozen, Exchange(period, period, "hold")) for period in (0.015, 0.016))
    assert below < 0 < above  # 15 ms


def test_what_is_lost_first_is_found_between_two_points_of_the_grid():
    assert first_loss(lambda x: x > 0.37, np.linspace(0.1, 1, 5)) == pytest.approx(0.37, rel=1e-3)
    assert first_loss(lambda x: True, np.array([0.1, 0.2])) == 0.0
    assert first_loss(lambda x: False, np.array([0.1, 0.2])) == np.inf


@pytest.mark.parametrize(
    ("wrong", "subject"),
    [
        ({"receiver": "guess"}, "receiver"),
        ({"omega": 0.0}, "omega"),
        ({"delay": -1.0}, "delay"),
        ({"longest": 0.0}, "longest"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(ur5, wrong, subject):
    with refused(InputError, subject):
        period_margin(ur5, GAINS, **wrong)
