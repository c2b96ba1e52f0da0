"""Runs over a network: what a reader sees of them, and what they say when they had to stop."""

import pickle

import numpy as np
import pytest
from refusals import refused

from synctrl import Cell, Coupling, Experiment, Gains, Member, Network
from synctrl.errors import NonFiniteError
from synctrl.experiments import planar_four
from synctrl.robots.catalog import load_robot
from synctrl.tasks.trajectories import Hold


def test_a_run_that_held_messages_tear_apart_says_so():
    with refused(NonFiniteError, cause="network"):
        planar_four(network=Network(period=0.05, receiver="hold")).simulate(0.2, engine="compiled")


@pytest.mark.parametrize("control_period", [None, 1e-3])
def test_without_delay_or_loss_exchange_is_what_the_paper_assumes(control_period: float | None):
    runs = [
        planar_four(network=network).simulate(0.1, control_period=control_period)
        for network in (None, Network())
    ]
    np.testing.assert_allclose(runs[1].q, runs[0].q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(runs[1].sync_integral, runs[0].sync_integral, rtol=0, atol=1e-13)


def test_chance_is_a_matter_of_the_seed_alone():
    def heard(seed: int) -> np.ndarray:
        network = Network(period=5e-3, loss=0.5, jitter=0.01, seed=seed)
        return planar_four(network=network).simulate(0.1, engine="compiled").outputs["messages_heard"]

    np.testing.assert_array_equal(heard(1), heard(1))
    assert (heard(1) != heard(2)).any()


@pytest.mark.parametrize("receiver", ["filter", "hold", "extrapolate"])
def test_a_controller_goes_elsewhere_with_its_messages_on_the_way(receiver: str):
    network = Network(1e-3, delay=1.5e-3, jitter=2e-3, loss=0.3, burst=(0.1, 0.5), receiver=receiver)
    experiment = planar_four(network=network)
    cell, here = experiment.cell, experiment.controller(1e-3)
    here.reset(0.0, cell.q0, cell.v0)
    samples = 1e-3 * np.arange(12)
    for t in samples[:6]:
        here.step(t, cell.q0, cell.v0)
    there = pickle.loads(pickle.dumps(here))
    for t in samples[6:]:
        np.testing.assert_array_equal(there.step(t, cell.q0 + t, cell.v0), here.step(t, cell.q0 + t, cell.v0))


def test_instants_of_messages_grow_with_the_robots_only_with_jitter():
    arm = load_robot("planar2r")

    def instants(n: int, network: Network) -> int:
        members = [Member(arm.placed((2.0 * i, 0, 0)), Hold([0.3, 1.0]), q0=[0.3, 1.0]) for i in range(n)]
        cell, gains = Cell(members, Coupling.signed_ring(n)), Gains(10.0, 5.0, 4.0, 2.0, 0.5)
        loop = Experiment(cell, gains, 0.1, network=network).closed_loop()
        return len(loop.messages.between(0.0, 0.1))

    for steady in (Network(0.01, delay=0.023, loss=0.3), Network(delay=0.023)):
        assert instants(12, steady) == instants(4, steady)
    unsteady = Network(0.01, delay=0.023, jitter=0.004)
    assert instants(12, unsteady) > 2 * instants(4, unsteady)
