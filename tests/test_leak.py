"""Integrals of synchronization errors that leak: the proof holds for every leak from 0 to Lambda."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl.analysis import certify
from synctrl.control.controller import Controller
from synctrl.control.laws import SunMills
from synctrl.control.network import Ideal
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, carry_ur5, planar_four
from synctrl.experiments.planar_four import GAINS


@given(st.integers(0, 2**32 - 1))
def test_the_force_on_epsilon_feeds_the_springs_and_what_they_lose(seed):
    """sum r^T k sigma = (energies)' + losses, with r = w' + Lambda w + beta sigma + (Lambda - l) beta E."""
    rng = np.random.default_rng(seed)
    Lambda, beta, k = rng.uniform(0.1, 5, (3, 2))
    leak, S = Lambda * rng.uniform(0, 1, 2), rng.normal(size=(3, 4))
    w, w_dot, integral = rng.normal(size=(4, 2)), rng.normal(size=(4, 2)), rng.normal(size=(3, 2))
    epsilon, epsilon_dot = S @ w, S @ w_dot
    sigma, E = S.T @ epsilon, S.T @ integral
    r = w_dot + Lambda * w + beta * sigma + (Lambda - leak) * beta * E
    spring = k * (Lambda - leak) * beta
    rate = np.sum(epsilon * k * epsilon_dot) + np.sum(E * spring * (sigma - leak * E))
    loss = np.sum(epsilon * k * Lambda * epsilon) + np.sum(sigma * k * beta * sigma)
    loss += np.sum(E * leak * spring * E)
    assert np.sum(r * k * sigma) == pytest.approx(rate + loss, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("leak", [0.0, 5.0, 10.0])
def test_the_balance_of_v_closes_and_v_falls_with_every_leak(leak):
    certificate = certify(planar_four(gains=GAINS.replace(leak=leak)).simulate(0.5))
    assert certificate.certified
    powers = certificate.lyapunov.power
    lost = powers.get("leak", np.zeros(1))
    assert (lost <= 0).all() and (lost < 0).any() == (0 < leak < 10)


def test_integrals_forget_at_the_rate_of_the_leak():
    run = planar_four(gains=GAINS.replace(leak=4.0)).simulate(0.5)
    I, epsilon, h = run.sync_integral, run.sync_error, 1e-3
    rate = epsilon - 4.0 * I
    grown = h / 3 * (rate[:-2] + 4 * rate[1:-1] + rate[2:])  # by Simpson's rule
    assert np.abs(I[2:] - I[:-2] - grown).max() < 1e-3 * h * np.abs(rate).max()


@pytest.mark.parametrize("control", [{}, {"control_period": 2e-3}], ids=["continuous", "sampled"])
@pytest.mark.parametrize("make", [planar_four, a460_pair])
def test_both_engines_leak_alike(make, control):
    gains = make().gains.replace(leak=3.0)
    runs = [make(gains=gains).simulate(0.1, engine=e, **control) for e in ("pinocchio", "compiled")]
    for name in ("q", "tau", "sync_integral", "theta_hat"):
        a, b = (getattr(run, name) for run in runs)
        np.testing.assert_allclose(b, a, rtol=0, atol=1e-9 * (1 + np.abs(a).max()))
    plain = make().simulate(0.1, **control)
    assert not np.allclose(plain.sync_integral[-1], runs[0].sync_integral[-1], rtol=1e-3)


def test_a_leak_of_zero_changes_no_bit():
    runs = [planar_four(gains=gains).simulate(0.05) for gains in (None, GAINS.replace(leak=0.0))]
    assert np.array_equal(runs[0].q, runs[1].q) and runs[0].info["gains"] == runs[1].info["gains"]
    assert "leak" not in runs[0].info["gains"]


def test_a_leak_keeps_a_millimetre_of_error_from_becoming_force():
    """Where the object is held elsewhere than believed epsilon stays, and its integral need not grow."""

    def last_force(leak: float | bool) -> float:
        error = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
        run = carry_ur5(geometric_error=error, leak=leak).simulate(0.8, dt=2e-3, log_dt=0.02)
        return float(np.linalg.norm(run.outputs["internal_force"][-1, 0, :3]))

    assert last_force(True) < 0.7 * last_force(0.0)


def test_what_does_not_go_with_a_leak_is_refused():
    cell = planar_four().cell
    with refused(InputError, "leak", found=10.5):
        Controller(cell, GAINS.replace(leak=10.5))
    with refused(InputError, "leak"):
        GAINS.replace(leak=-1.0)
    with refused(InputError, "leak"):
        Ideal(-1.0)
    with refused(InputError, "network, leak"):
        Controller(cell, GAINS.replace(leak=1.0), network=Ideal())
    with refused(InputError, "network, leak"):
        Controller(cell, GAINS, law=SunMills(), network=Ideal(1.0))
