"""Runs over a network: what a reader sees of them, and what they say when they had to stop."""

import numpy as np
import pytest
from refusals import refused

from synctrl import Network
from synctrl.errors import NonFiniteError
from synctrl.experiments import planar_four


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
