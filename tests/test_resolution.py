"""Encoders that count: what is bounded, and what a run does."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from cells import SMALL_GAINS
from ur5_joints import GAINS, ur5_joints

from synctrl import Cell, Coupling, Experiment, Hold, JointSpace, Member, load_robot
from synctrl.analysis.equipped import Equipment
from synctrl.analysis.frozen import freeze
from synctrl.analysis.resolution import peak_gain, resolution_error
from synctrl.simulation.devices import DifferencedVelocity, Quantisation

STEP, T = 1e-3, 2e-3


def planar() -> Cell:
    arm = load_robot("planar2r")
    places = [np.array([0.3301, 1.2003]), np.array([0.5004, 1.1002])]
    members = [Member(arm, Hold(q), q + 0.004, theta_hat0=arm.inertial_parameters) for q in places]
    return Cell(members, Coupling.pair(), JointSpace())


def test_no_joint_is_nearer_than_its_reading():
    gain = peak_gain(freeze(ur5_joints(), GAINS), Equipment())
    assert (gain.diagonal() >= 1 - 1e-3).all()  # a reading that is off for ever is followed


@pytest.mark.parametrize("omega", [100.0, 400.0])
def test_a_run_with_encoders_comes_to_rest_within_the_bound(omega):
    cell, gains = planar(), SMALL_GAINS.replace(Gamma=0.0)
    sensors = [Quantisation(STEP), DifferencedVelocity(omega)]
    experiment = Experiment(cell, gains, 4.0, sensors=sensors)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        error = np.abs(experiment.simulate(dt=T, control_period=T).tracking_error)
    bound = resolution_error(cell, gains, STEP, sensors=sensors, control_period=T)
    settled = error[error.shape[0] * 3 // 4 :].max(axis=0)
    assert (settled <= bound).all() and settled.max() > 0.2 * bound.max()


def test_the_bound_is_in_proportion_to_the_count():
    cell, sensors = planar(), [DifferencedVelocity(100.0)]
    small, large = (
        resolution_error(cell, SMALL_GAINS, step, sensors=sensors, control_period=T)
        for step in (STEP, 2 * STEP)
    )
    np.testing.assert_allclose(large, 2 * small)
    assert (small >= 0.5 * STEP * (1 - 1e-3)).all()
