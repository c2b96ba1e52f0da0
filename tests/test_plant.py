"""The true cell: what moves it, and what the controller does not know of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Experiment,
    Friction,
    Gains,
    Hold,
    Member,
    Payload,
    load_robot,
)
from synctrl.errors import InputError
from synctrl.simulation.plant import Plant


def mixed(*frictions: Friction) -> Cell:
    """An arm with three joints and one with seven, held in one plane each."""
    members = [
        Member(load_robot(name), Hold(np.zeros(2)), q0=np.full(nv, 0.3), friction=friction)
        for name, nv, friction in zip(("a460", "panda"), (3, 7), frictions, strict=True)
    ]
    return Cell(members, Coupling.pair(), CartesianSpace("xz"))


ROUGH = (Friction((1.0, 2.0, 3.0), 0.5, 0.1), Friction(0.2, 0.1))


def state() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q, v, tau = np.random.default_rng(0).normal(size=(3, 2, 7))
    for part in (q, v, tau):
        part[0, 3:] = 0
    return q, v, tau


@pytest.mark.parametrize("frictions", [(Friction(), Friction()), ROUGH])
def test_torque_less_friction_is_what_the_motion_needs(frictions) -> None:
    cell = mixed(*frictions)
    q, v, tau = state()
    v_dot = Plant(cell).acceleration(q, v, tau)
    for i, (robot, friction) in enumerate(zip(cell.robots, frictions, strict=True)):
        k = slice(0, robot.nv)
        needed = robot.inverse_dynamics(q[i, k], v[i, k], v_dot[i, k]) + friction.torque(v[i, k])
        np.testing.assert_allclose(needed, tau[i, k], atol=1e-9)
    np.testing.assert_array_equal(v_dot[0, 3:], 0)


def test_one_acceleration_survives_the_next() -> None:
    plant = Plant(mixed(*ROUGH))
    q, v, tau = state()
    first = plant.acceleration(q, v, tau)
    kept = first.copy()
    plant.acceleration(q, v, 2 * tau)
    np.testing.assert_array_equal(first, kept)


def test_a_plant_whose_robots_carry_nothing_is_the_same_at_all_times() -> None:
    plant = Plant(mixed(*ROUGH))
    assert plant.at(0.0) is plant.at(5.0) is plant


def test_a_plant_is_another_one_while_something_is_carried() -> None:
    plant = Plant(mixed(*ROUGH), payloads=(Payload(1, 1.0, start=0.5, stop=1.5),))
    assert plant.at(0.2) is plant
    assert plant.at(0.5) is plant.at(1.4) is not plant
    assert plant.at(1.0).at(0.2) is plant
    q, v, tau = state()
    np.testing.assert_array_equal(plant.at(1.5).acceleration(q, v, tau), plant.acceleration(q, v, tau))
    changed = plant.at(1.0).acceleration(q, v, tau) - plant.acceleration(q, v, tau)
    assert np.abs(changed[1]).max() > 0.01
    np.testing.assert_array_equal(changed[0], 0)


def test_an_experiment_is_refused_with_a_payload_on_a_robot_it_does_not_have() -> None:
    cell = mixed(*ROUGH)
    gains = Gains(Lambda=5.0, beta=1.0, K_r=5.0, K_eps=1.0, Gamma=0.1)
    experiment = Experiment(cell, gains, 0.1)
    with refused(InputError, "payload, robot"):
        replace(experiment, payloads=(Payload(2, 1.0),))
