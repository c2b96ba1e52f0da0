"""Theorem C: the linear system of small errors, its multipliers, and the closed loop itself."""

from __future__ import annotations

import numpy as np
import pytest
from machines import rod_arm

from synctrl import Cell, Coupling, Experiment, FunctionTrajectory, Gains, Member
from synctrl.analysis import exponential_rate
from synctrl.analysis.decay import simulated_decay
from synctrl.robots.parameters import planar_two_link_parameters

#: of the arms' rods, kg and m
MASSES, LENGTHS = (1.0, 0.8), (0.4, 0.3)
GAINS = Gains(Lambda=4.0, beta=3.0, K_r=0.8, K_eps=0.4, Gamma=0.05)
PERIOD = 0.5


def sines(center, size, turns, phase, period: float = PERIOD) -> FunctionTrajectory:
    """Whole numbers of turns in a period, about a center."""
    size, w = np.asarray(size), 2 * np.pi / period * np.asarray(turns)
    return FunctionTrajectory(
        lambda t: center + size * np.sin(np.multiply.outer(t, w) + phase),
        lambda t: size * w * np.cos(np.multiply.outer(t, w) + phase),
        lambda t: -size * w**2 * np.sin(np.multiply.outer(t, w) + phase),
    )


def pair(gains: Gains = GAINS, size=(0.5, 0.5), turns=(1, 2), coupling=None) -> Experiment:
    """Two arms of rods in joint space, with the three parameters of (50)."""
    arm = rod_arm(MASSES, LENGTHS)
    members = [
        Member(
            arm,
            sines(np.array([0.3, 1.0]), size, turns, np.array([0.4 * i, 1.0 + i])),
            parameters=planar_two_link_parameters(arm, MASSES, LENGTHS),
            name=f"arm {i + 1}",
        )
        for i in range(2)
    ]
    return Experiment(Cell(members, coupling or Coupling.pair()), gains, PERIOD)


@pytest.mark.parametrize("Gamma", [0.005, 0.05, 0.5])
def test_a_simulated_error_falls_by_the_multiplier_in_a_period(Gamma: float) -> None:
    experiment = pair(GAINS.replace(Gamma=Gamma))
    rate = exponential_rate(experiment, PERIOD)
    assert rate.stable and rate.rate == rate.excited_rate > 0
    assert simulated_decay(experiment, rate, dt=5e-4, engine="compiled").misfit < 0.01
