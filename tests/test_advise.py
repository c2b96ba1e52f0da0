"""Advice about gains: its numbers are those of runs, and to follow it cures what was wrong."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from synctrl import Cell, Coupling, Cubic, Experiment, Friction, FrictionParameters, Gains, Hold, Member
from synctrl import CartesianSpace, Network, Redundancy, load_robot, simulate
from synctrl.analysis import advise, advise_run
from synctrl.analysis.linear_loop import Linearized, Place
from synctrl.control.laws import ChungSlotine
from synctrl.errors import InputError, SimulationError, UnreachableError
from synctrl.experiments import a460_pair, planar_four, ur5_payload

UR5, PLANAR, A460 = (load_robot(name) for name in ("ur5", "planar2r", "a460"))
Q0 = np.array([0.1, -1.2, 1.4, -0.6, 0.5, 0.3])


def resting(robot=UR5, q=Q0, knows=1.0, friction=Friction(), **more) -> Cell:
    """Two robots that stay where they are, and know a share of their parameters."""
    members = []
    for _ in range(2):
        member = Member(robot, Hold(q), q0=q, friction=friction, **more)
        members.append(member)
    cell = Cell(members, Coupling.pair())
    told = [replace(m, theta_hat0=knows * p.theta) for m, p in zip(members, cell.parameters, strict=True)]
    return Cell(told, Coupling.pair())


def moving(robot=UR5, q=Q0, by=0.4, duration=0.6, knows=0.7, off=0.0, **more) -> Cell:
    """Two robots that swing out."""
    way = Cubic(q, q + by, duration)
    guess = knows * robot.inertial_parameters
    return Cell([Member(robot, way, q0=q + off, theta_hat0=guess, **more)] * 2, Coupling.pair())


def good(cell: Cell, **more) -> Gains:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return Gains.suggest(cell, 8.0, duration=1.0, **more)


def fate(cell: Cell, gains: Gains, duration: float = 1.0, **more) -> tuple[str, float]:
    """How a run ends, and the largest error in its last tenth."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = simulate(cell, gains, duration, **more)
        except SimulationError:
            return "diverged", np.inf
    return result.status, float(np.abs(result.e[-len(result.t) // 10 :]).max())


# -- poles -------------------------------------------------------------------------------------------------


def derivative(experiment: Experiment, h: float = 1e-5) -> np.ndarray:
    """Eigenvalues of the whole closed loop, by central differences of its right-hand side."""
    loop = experiment.closed_loop()
    y, rest = loop.initial_state(), np.zeros_like(loop.cell.q0)
    reference = loop.cell.references(np.zeros(1))[0]

    def rate(state: np.ndarray) -> np.ndarray:
        return loop.evaluate(reference, state, rest)[0].copy()

    assert np.abs(rate(y)).max() < 1e-8  # a place of rest
    columns = [(rate(y + h * unit) - rate(y - h * unit)) / (2 * h) for unit in np.eye(len(y))]
    return np.linalg.eigvals(np.array(columns).T)


def tips(robot, q, **space) -> Cell:
    member = Member(robot, Hold(robot.tip_position(q)), q0=q, theta_hat0=robot.inertial_parameters)
    space = CartesianSpace("xyz", **space)
    return Cell([replace(member, friction=Friction())] * 3, Coupling.signed_ring(3), space)


KINDS = {
    "joints": lambda: resting(),
    "friction that is known of": lambda: resting(friction=Friction(3.0), parameters=FrictionParameters(UR5)),
    "friction that is not": lambda: resting(friction=Friction(3.0)),
    "a ring of tips": lambda: tips(UR5, Q0),
    "tips that prefer a posture": lambda: tips(UR5, Q0, redundancy=Redundancy(Q0, gain=1.5)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_the_poles_are_those_of_the_closed_loop_itself(kind):
    cell = KINDS[kind]()
    experiment = Experiment(cell, Gains(5.0, 3.0, 30.0, 40.0, 0.2), 1.0)
    loop, still = experiment.closed_loop(), np.zeros_like(cell.q0)
    poles = Linearized(loop, Place(0.0, cell.q0, still, still), loop.plant.viscous).loop().poles
    found = derivative(experiment)
    found = found[np.abs(found) > 1e-5]
    for pole in poles[np.abs(poles) > 1e-5]:
        assert np.abs(found - pole).min() < 1e-5 * (1 + abs(pole))
    for value in found:
        assert np.abs(poles - value).min() < 1e-5 * (1 + abs(value))
