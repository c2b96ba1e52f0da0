"""Estimates under torque limits: without a bound they run away, in a ball they cannot."""

from __future__ import annotations

import numpy as np
import pytest

from synctrl import Cell, Coupling, Cubic, Experiment, Gains, Member, Robot, load_robot
from synctrl.analysis.certify import certify
from synctrl.control.adaptation import Ball, Gradient

pytestmark = [
    pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning"),  # torque is meant to be cut
    pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning"),  # estimates that run away ask for less
]
GAMMA, RADIUS = 5.0, 0.5


def weak_pair(adaptation) -> Experiment:
    """Two arms with limits of 1 N·m, far less than their motion needs."""
    strong = load_robot("planar2r")
    model = strong.model.copy()
    model.effortLimit[:] = 1.0
    path = Cubic([0.3, 1.0], [2.3, 2.0], 0.5)
    cell = Cell([Member(Robot(model, strong.tip), path) for _ in range(2)], Coupling.pair())
    gains = Gains(Lambda=10.0, beta=5.0, K_r=4.0, K_eps=2.0)
    return Experiment(cell, gains, 1.0, adaptation=adaptation, saturate=True)


def test_estimates_run_away_under_torque_limits_but_not_in_a_ball():
    plain, bounded = (weak_pair(law).simulate(dt=1e-3) for law in (Gradient(GAMMA), Ball(GAMMA, RADIUS)))
    drift = [np.linalg.norm(run.theta_hat - run.theta_hat[0], axis=-1).max() for run in (plain, bounded)]
    assert drift[1] <= RADIUS * np.sqrt(GAMMA) * (1 + 1e-9)
    assert drift[0] > 100 * drift[1]
    assert np.abs(bounded.tau).max() < np.abs(plain.tau).max()


def test_a_certificate_names_what_torque_limits_take_and_a_ball_only_takes_from_the_storage():
    certificate = certify(weak_pair(Ball(GAMMA, RADIUS)).simulate(0.3, dt=5e-4))
    assert not certificate.certified
    assert any("torque that saturation takes away" in text for text in certificate.outside)
    powers, rounding = certificate.lyapunov.power, certificate.lyapunov.rounding
    assert (np.abs(powers["saturation"]) > rounding).any()
    assert (powers["projection"] <= rounding).all()
