"""Lags of sensors, actuators and sampling in the frozen cell."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused
from ur5_joints import GAINS, ur5_joints

from synctrl import Cell
from synctrl.analysis import delay_margin
from synctrl.analysis.equipped import Equipment, dead_time, equipment, equipped, lag
from synctrl.analysis.frozen import Frozen, freeze
from synctrl.errors import InputError
from synctrl.simulation.devices import DeadTime, DifferencedVelocity, Lag

#: two arms whose damping a lag of some milliseconds does not turn into the opposite
SOFT = GAINS.replace(Lambda=3.0, beta=3.0, K_r=0.2 * GAINS.K_r, K_eps=10.0)


@pytest.fixture(scope="module")
def ur5() -> Cell:
    return ur5_joints()


@pytest.fixture(scope="module")
def frozen(ur5) -> Frozen:
    return freeze(ur5, SOFT)


def response(part, s: complex) -> complex:
    """What a filter makes of e^{st}."""
    return complex((part.C @ np.linalg.solve(s * np.eye(len(part.A)) - part.A, part.B) + part.D)[0, 0])


def test_a_lag_and_a_dead_time_are_what_they_are_called():
    s = 30j - 2.0
    assert response(lag(0.01), s) == pytest.approx(1 / (1 + 0.01 * s), rel=1e-12)
    for time, error in ((0.02, 1e-3), (0.01, 1e-4)):
        assert abs(response(dead_time(time), s) - np.exp(-s * time)) < error


@pytest.mark.parametrize(
    "parts",
    [
        Equipment(velocity_lag=0.004),
        Equipment(dead_time=0.003),
        Equipment(torque_lag=0.005),
        Equipment(0.004, 0.003, 0.005),
    ],
)
def test_the_roots_are_those_of_the_loop_with_the_responses_of_its_parts(frozen, parts):
    J = sum(frozen.joints)
    whole = equipped(frozen, parts)
    roots = np.linalg.eigvals(whole.own + whole.delayed)
    for s in roots[np.argsort(-roots.real)][:20]:
        velocity = response(lag(parts.velocity_lag), s) if parts.velocity_lag else 1.0
        torque = response(dead_time(parts.dead_time), s) if parts.dead_time else 1.0
        torque *= response(lag(parts.torque_lag), s) if parts.torque_lag else 1.0
        plain = (frozen.own + frozen.delayed).astype(complex)
        plain[-J:] *= torque
        plain[-J:, -J:] *= velocity
        assert np.abs(np.linalg.eigvals(plain) - s).min() < 1e-6 * max(1.0, abs(s))


def test_what_hardly_lags_hardly_moves_the_margin(ur5):
    expected = delay_margin(ur5, SOFT).delay
    quick = delay_margin(ur5, SOFT, actuators=[Lag(1e-5)])
    assert quick.delay == pytest.approx(expected, rel=1e-2) and quick.by == "analysis"


@pytest.mark.parametrize(
    ("sensors", "actuators"),
    [([DifferencedVelocity(200.0)], []), ([], [DeadTime(1e-3)]), ([], [Lag(1e-3)])],
)
def test_growth_changes_its_sign_at_the_margin_with_any_device(ur5, sensors, actuators):
    margin = delay_margin(ur5, GAINS, sensors=sensors, actuators=actuators, control_period=1e-3)
    assert margin.growth(0.999 * margin.delay) < 0 < margin.growth(1.001 * margin.delay)


def test_differences_lag_by_half_a_period_and_their_filter_by_its_time():
    T = 1e-3
    plain = equipment([DifferencedVelocity()], control_period=T)
    assert plain.velocity_lag == plain.dead_time == 0.5 * T
    filtered = equipment([DifferencedVelocity(50.0)], control_period=T)
    assert filtered.velocity_lag == pytest.approx(1 / 50.0, rel=1e-3)


def test_actuators_add_up_and_the_slowest_joint_counts():
    parts = equipment(actuators=[Lag(np.array([0.01, 0.02])), DeadTime(0.003)])
    assert parts == Equipment(0.0, 0.003, 0.02)


def test_a_cell_that_its_actuators_alone_bring_down_has_no_margin(ur5):
    margin = delay_margin(ur5, GAINS, actuators=[Lag(0.2)])
    assert margin.delay == 0.0 and margin.rate > 0 and "without delay" in str(margin)


def test_differences_without_a_period_are_refused(ur5):
    with refused(InputError, "control_period"):
        delay_margin(ur5, GAINS, sensors=[DifferencedVelocity(50.0)])
