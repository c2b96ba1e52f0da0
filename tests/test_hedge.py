"""The hedge: what gives way while torque is cut off, comes back afterwards, and is in the balance of V."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from synctrl import Cell, Coupling, Disturbance, Experiment
from synctrl.analysis.certify import certify
from synctrl.control.adaptation import Composite, Gradient, Hedged, Natural
from synctrl.control.network import Ideal
from synctrl.errors import InputError, SaturationWarning
from synctrl.experiments import a460_pair, planar_four, ur5_payload
from synctrl.simulation.result import LAYOUT

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "scripts"))

from anti_windup import gravity, hedged, with_limits

pytestmark = [
    pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning"),  # torque is meant to be cut
    pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning"),
]


def weak_joints() -> Experiment:
    """Limits a little below what gravity takes of two A460."""
    free = a460_pair(friction=False)
    return hedged(with_limits(free, np.maximum(24 / 28 * gravity(free), 12.0)))


def weak_tips() -> Experiment:
    """Limits of half of what four planar arms ask for at first."""
    free = planar_four()
    return hedged(with_limits(free, 0.5 * np.abs(free.simulate(0.01).tau).max(axis=0)))


def pushed() -> Experiment:
    """Two A460 with a push above the limits of the first for a short while."""
    push = Disturbance(0, 400.0, 0.05, 0.15)
    return hedged(replace(a460_pair(friction=False), disturbances=[push], saturate=True), 20.0)


@pytest.fixture(scope="module")
def shock():
    return pushed().simulate(1.5)


@pytest.mark.parametrize("make", [weak_joints, weak_tips])
def test_the_hedge_is_in_the_balance_of_v(make):
    """V' by the chain rule at every instant, and its integral over the run."""
    record = certify(make().simulate(0.02, dt=1e-4)).lyapunov
    assert np.abs(record.power["hedge"]).max() > 100 * record.rounding.max()
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert record.largest_drift < 1e-3 * np.abs(record.power["hedge"]).mean() * record.t[-1]


def test_a_certificate_names_the_hedge_and_what_was_cut_off():
    outside = certify(weak_joints().simulate(0.1)).outside
    assert any("hedge" in text for text in outside)
    assert any("torque that saturation takes away" in text for text in outside)


def test_the_warning_of_saturation_says_that_the_desired_motion_gave_way():
    with pytest.warns(SaturationWarning, match="desired motion gave way") as caught:
        weak_joints().simulate(0.02)
    assert not any("as if it had got it" in str(warning.message) for warning in caught)


def test_nothing_is_learned_while_much_torque_is_missing():
    run = pushed().simulate(0.15)
    missing = np.abs(run.outputs["applied_torque"] - run.tau)
    limits = np.array(run.info["robots"][0]["torque_limits"])
    much = (missing[:, 0] > 0.5 * limits).any(axis=1)
    steady = much[:-1] & much[1:]
    assert steady.sum() > 20
    learned = np.abs(np.diff(run.theta_hat[:, 0], axis=0)).max(axis=1)
    assert learned[steady].max() < 1e-6 < learned.max()


def test_what_gave_way_comes_back_after_the_last_cut(shock):
    cut = np.flatnonzero((shock.outputs["applied_torque"] != shock.tau).any(axis=(1, 2)))[-1]
    size = np.abs(shock.outputs["hedge"]).max(axis=(1, 2))
    assert shock.t[cut] < 0.75
    assert size.max() > 0.1
    assert size[-1] < 0.01 * size.max()
    assert np.abs(shock.x_desired[-1] - shock.x[-1]).max() < 0.05


def test_errors_are_those_of_the_motion_that_gave_way_and_the_log_keeps_the_users(shock):
    desired = np.array([shock.experiment.cell.references(shock.t[[k]])[0].desired[0] for k in (100, 400)])
    np.testing.assert_array_equal(shock.x_desired[[100, 400]], desired)
    expected = shock.x_desired - shock.outputs["hedge"] - shock.x
    np.testing.assert_allclose(shock.tracking_error, expected, atol=1e-12)


@pytest.mark.parametrize("options", [{}, {"control_period": 2e-3}], ids=["continuous", "sampled"])
@pytest.mark.parametrize("make", [planar_four, a460_pair])
def test_without_a_cut_a_hedge_is_the_adaptation_itself_bit_for_bit(make, options):
    for saturate in (False, True):
        cell = make().cell
        strong = with_limits(make(), np.full((cell.n, cell.nv), 1e6))
        found = replace(hedged(strong), saturate=saturate).simulate(0.05, **options)
        expected = make().simulate(0.05, **options)
        for name in LAYOUT:
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
        assert not found.outputs["hedge"].any()


@pytest.mark.parametrize("adaptation", [Natural(0.1), Composite(0.3, 2.0, 20.0)])
def test_a_hedge_goes_from_sample_to_sample_as_the_adaptation_does(adaptation):
    found, expected = (
        a460_pair(adaptation=each).simulate(0.05, control_period=5e-3)
        for each in (Hedged(adaptation, 5.0), adaptation)
    )
    np.testing.assert_array_equal(found.theta_hat, expected.theta_hat)


def test_sampled_control_hedges_as_continuous_control_does():
    continuous, sampled = (weak_joints().simulate(0.1, **way) for way in ({}, {"control_period": 1e-3}))
    size = np.abs(continuous.outputs["hedge"]).max()
    assert size > 1e-3
    assert np.abs(sampled.outputs["hedge"] - continuous.outputs["hedge"]).max() < 0.1 * size


def unknowing() -> Cell:
    """A cell whose first estimate is of bodies without mass."""
    members = [replace(m, theta_hat0=0.0 * m.robot.inertial_parameters) for m in a460_pair().cell.members]
    return Cell(members, Coupling.pair())


def waving() -> Cell:
    """A cell with weights that move."""
    cell = a460_pair().cell

    def weights(t):
        one = np.broadcast_to(np.eye(3), (2, 3, 3))
        return (1.0 + 0.1 * t) * one, 0.1 * one, 0.0 * one

    return Cell(cell.members, Coupling.pair(weights))


class Posted(Ideal):
    """A network that has messages."""

    def bind(self, cell):
        bound = super().bind(cell)
        bound.messages = lambda start, end: np.zeros(0)
        return bound


@pytest.mark.parametrize(
    ("subject", "make"),
    [
        ("pull", lambda: Hedged(Gradient(0.3), 0.0)),
        ("speed", lambda: Hedged(Gradient(0.3), 8.0, -1.0)),
        ("adaptation", lambda: Hedged(0.3, 8.0)),
        ("adaptation", lambda: a460_pair(adaptation=Hedged(Hedged(Gradient(0.3), 8.0), 8.0))),
        ("space", lambda: ur5_payload(adaptation=Hedged(Gradient(0.3), 8.0))),
        ("theta_hat0 of robot 1", lambda: Hedged(Gradient(0.3), 8.0).bind(unknowing())),
        ("coupling", lambda: Hedged(Gradient(0.3), 8.0).bind(waving())),
        ("network", lambda: a460_pair(adaptation=Hedged(Gradient(0.3), 8.0), network=Posted())),
        ("adaptation", lambda: weak_joints().simulate(0.01, engine="compiled")),
    ],
)
def test_what_cannot_be_hedged_is_refused(subject, make):
    with refused(InputError, subject):
        make()
