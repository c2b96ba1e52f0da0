"""Estimates under torque limits: without a bound they run away, in a ball they cannot."""

from __future__ import annotations

import numpy as np
import pytest

from synctrl import Cell, Coupling, Cubic, Experiment, Gains, Member, Robot, load_robot
from synctrl.analysis.certify import certify
from synctrl.control.adaptation import Ball, Gradient
from synctrl.control.adaptation.gradient import MetricGradient

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


class Accountant(Gradient):
    """(14), with a count of the torque that is cut off, N·m·s."""

    def bind(self, cell):
        return BoundAccountant(cell, super().bind(cell).metric)


class BoundAccountant(MetricGradient):
    """Its z is theta_hat, and behind it the count."""

    def start(self):
        return np.concatenate((self.theta_hat0, np.zeros((len(self.theta_hat0), 2))), axis=1)

    def estimate(self, z):
        return z[:, :-2]

    def rate(self, z, seen):
        return np.concatenate((super().rate(z, seen), seen.applied - seen.tau), axis=1)


@pytest.mark.parametrize("control", [{}, {"control_period": 2e-3}], ids=["continuous", "sampled"])
def test_an_adaptation_sees_the_torque_that_limits_leave_in_both_engines(control):
    experiment = weak_pair(Accountant(GAMMA))
    runs = [experiment.simulate(0.2, engine=engine, **control) for engine in ("pinocchio", "compiled")]
    counts = [run.outputs["adaptation_state"][..., -2:] for run in runs]
    cut = runs[0].outputs["applied_torque"] - runs[0].tau
    expected = np.sum(cut[:-1], axis=0) * 1e-3
    assert np.abs(expected).max() > 0.1
    assert counts[0][-1] == pytest.approx(expected, rel=0.03, abs=0.01)
    np.testing.assert_allclose(counts[1], counts[0], rtol=1e-9, atol=1e-9)


def test_without_limits_all_torque_is_applied():
    experiment = weak_pair(Gradient(GAMMA))
    loop = Experiment(experiment.cell, experiment.gains, 1.0, adaptation=Gradient(GAMMA)).closed_loop()
    signals = loop.look(loop.cell.references(np.zeros(1))[0], loop.state(loop.initial_state()))
    assert signals.seen.applied is signals.tau
