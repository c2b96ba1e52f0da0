"""The frozen analysis of delays against runs of the nonlinear cell that begin a hair off what is desired."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from ur5_joints import GAINS, ur5_joints

from synctrl import Cell, Experiment, Member, Network
from synctrl.analysis import DelayMargin, delay_margin
from synctrl.analysis.period_margin import Exchange, sampled_growth
from synctrl.errors import StepWarning
from synctrl.simulation.devices import DeadTime, DifferencedVelocity, Lag

#: how far joint 6 of one robot begins off its place, rad; the other one as far to the other side
HAIR = 1e-7


@pytest.fixture(scope="module")
def cell() -> Cell:
    """Two UR5 of which joint 6, the one with too little damping, begins a hair off its place."""
    still, shift = ur5_joints(), np.zeros((2, 6))
    shift[:, 5] = HAIR, -HAIR
    members = [
        Member(m.robot, m.trajectory, m.q0 + off, theta_hat0=m.theta, name=m.name)
        for m, off in zip(still.members, shift, strict=True)
    ]
    return Cell(members, still.coupling, still.space)


@pytest.fixture(scope="module")
def margin() -> DelayMargin:
    return delay_margin(ur5_joints(), GAINS)


def errors(cell: Cell, network: Network, duration: float, dt: float) -> np.ndarray:
    """Errors of joint 6 of one robot minus that of the other, at every step."""
    experiment = Experiment(cell, GAINS.replace(Gamma=0.0), duration, network=network)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)
        error = experiment.simulate(dt=dt).tracking_error
    return error[:, 0, 5] - error[:, 1, 5]


def root(x: np.ndarray, apart: float, lag: int) -> complex:
    """s of x = Re(A e^{st}) from x at instants that are some time apart, s: x_{k+2l} = a x_{k+l} + b x_k."""
    rows = np.stack((x[lag:-lag], x[: -2 * lag]), axis=1)
    a, b = np.linalg.lstsq(rows, x[2 * lag :], rcond=None)[0]
    return complex(np.log(np.roots([1, -a, -b]).astype(complex)[0])) / (lag * apart)


@pytest.mark.parametrize("share", [0.8, 1.6])
def test_the_nonlinear_cell_has_the_root_of_the_frozen_one(cell, margin, share):
    delay, dt = share * margin.delay, 4e-3
    x = errors(cell, Network(delay=delay), 0.8, dt)[100:]
    quarter = round(0.5 * np.pi / margin.frequency / dt)
    s = root(x, dt, quarter)
    frozen = margin.frozen
    matrix = frozen.own + np.exp(-s * delay) * frozen.delayed
    assert np.abs(np.linalg.eigvals(matrix) - s).min() < 0.02 * abs(s.real)
    if share > 1:
        assert s.real == pytest.approx(margin.growth(delay), rel=0.02)
    else:
        assert s.real < 0 and margin.growth(delay) < 0


@pytest.mark.parametrize(
    ("receiver", "period", "delay"), [("hold", 0.06, 0.0), ("hold", 0.06, 0.01), ("filter", 0.07, 0.0)]
)
def test_the_nonlinear_cell_grows_from_message_to_message_as_the_frozen_one(
    cell, margin, receiver, period, delay
):
    dt, count = 5e-3, 16
    network = Network(period=period, delay=delay, receiver=receiver, omega=100.0)
    x = errors(cell, network, count * period, dt)[:: round(period / dt)]
    expected = sampled_growth(margin.frozen, Exchange(period, delay, receiver, 100.0))
    assert root(x[6:], period, 1).real == pytest.approx(expected, rel=0.05)
    assert expected > 1.0


SENSING = [DifferencedVelocity(200.0)]


@pytest.mark.parametrize(
    ("sensors", "actuators"), [((), ()), (SENSING, ()), (SENSING, [DeadTime(2e-3), Lag(2e-3)])]
)
def test_the_nonlinear_cell_grows_with_its_devices_as_the_frozen_one(cell, sensors, actuators):
    """What is heard at a sample is as old as the delay exactly, as messages come with the samples."""
    T, delay = 4e-3, 0.036
    network = Network(period=T, delay=delay, receiver="hold")
    experiment = Experiment(
        cell, GAINS.replace(Gamma=0.0), 0.7, network=network, sensors=sensors, actuators=actuators
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        error = experiment.simulate(dt=T, control_period=T).tracking_error[75:]
    s = root(error[:, 0, 5] - error[:, 1, 5], T, 6)
    margin = delay_margin(ur5_joints(), GAINS, sensors=sensors, actuators=actuators, control_period=T)
    assert s.real == pytest.approx(margin.growth(delay), rel=0.05)
