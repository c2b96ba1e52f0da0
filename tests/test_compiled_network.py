"""Networks in the compiled engine: the runs of the reference engine, with messages between two calls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from seams.pulling_law import Pulling

from synctrl import CartesianSpace, Cell, Coupling, Experiment, Network
from synctrl.compiled.program import Program
from synctrl.control.adaptation import Natural
from synctrl.control.network import BoundPosted
from synctrl.control.network.receivers import Hold
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, carry_planar, planar_four, ur5_payload
from synctrl.simulation.devices import Lag, Noise
from synctrl.simulation.result import LAYOUT
from synctrl.sweep.variations import with_moved_start

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

#: by which the engines may differ, of the largest entry: generated code is compared to the same
AGREEMENT = 1e-9
#: what the two engines have to have in common to the last bit: only messages write it
COUNTED = "messages_sent", "messages_heard"

UNEQUAL = np.array([[0, 4, 9, 0], [7, 0, 0, 5], [3, 8, 0, 6], [4, 4, 11, 0]]) * 1e-3
NETWORKS = {
    "at once": Network(),
    "delays": Network(delay=UNEQUAL),
    "hold": Network(0.01, delay=0.003, receiver="hold"),
    "extrapolate": Network(0.004, loss=0.4, receiver="extrapolate"),
    "filter": Network(0.01, delay=0.012, jitter=0.004, loss=0.3, seed=1),
    "events": Network(0.004, delay=0.003, burst=(0.2, 0.4), event=1e-3, heartbeat=0.03),
}
MESSAGES = {name: network for name, network in NETWORKS.items() if network.period is not None}


def assert_close(expected, found, name):
    scale = np.abs(expected).max(initial=0.0) + 1e-12
    assert np.abs(found - expected).max(initial=0.0) <= AGREEMENT * scale, name


def assert_same_run(experiment, duration=0.06, **options):
    reference = experiment.simulate(duration, **options)
    compiled = experiment.simulate(duration, engine="compiled", **options)
    for name in LAYOUT:
        assert_close(getattr(reference, name), getattr(compiled, name), name)
    assert compiled.outputs.keys() == reference.outputs.keys()
    for name, expected in reference.outputs.items():
        if name != "network_state":
            assert_close(expected, compiled.outputs[name], name)
    network = experiment.closed_loop().controller.network
    parts = (vars(network.parts(run.outputs["network_state"])) for run in (reference, compiled))
    for (name, expected), found in zip(next(parts).items(), next(parts).values(), strict=True):
        assert_close(expected, found, name)  # part by part: an arrival that never comes is a large number
    for name in COUNTED if isinstance(network, BoundPosted) else ():
        np.testing.assert_array_equal(compiled.outputs[name], reference.outputs[name])
    return compiled


@pytest.mark.parametrize("name", NETWORKS)
def test_both_engines_compute_the_same_run_over_a_network(name):
    assert_same_run(planar_four(network=NETWORKS[name]))


@pytest.mark.parametrize("name", MESSAGES)
def test_both_engines_hold_the_same_samples_over_a_network(name):
    assert_same_run(planar_four(network=MESSAGES[name]), control_period=2e-3)


@pytest.mark.parametrize("name", ["hold", "filter"])
def test_what_robots_tell_is_what_their_sensors_measure_in_both_engines(name):
    devices = {"sensors": [Noise(q=1e-5, v=1e-4)], "actuators": [Lag(1e-3)]}
    experiment = planar_four(network=MESSAGES[name], **devices)
    noisy = assert_same_run(experiment, duration=0.03, control_period=2e-3)
    exact = replace(experiment, sensors=()).simulate(0.03, control_period=2e-3, engine="compiled")
    parts = experiment.closed_loop().controller.network.parts
    held = [parts(run.outputs["network_state"]).held for run in (noisy, exact)]
    first = 1 if name == "hold" else -1  # w is what is measured now, W what was so until now
    assert (held[0][first] != held[1][first]).any()


def test_messages_that_fall_between_steps_and_samples_come_at_the_same_instants():
    network = Network(0.0073, delay=0.0011, jitter=0.0031, receiver="hold")
    assert_same_run(planar_four(network=network))
    assert_same_run(planar_four(network=network), control_period=3e-3, duration=0.045)  # a sample at the end


@pytest.mark.parametrize("name", ["at once", "filter"])
def test_links_of_any_sign_and_weight_agree(name):
    experiment = planar_four()
    cell, coupling = experiment.cell, Coupling.star(4).weighted([0.5, 1.0, 2.0])
    weighted = Cell(cell.members, coupling, CartesianSpace("xy"))
    assert_same_run(
        Experiment(weighted, experiment.gains.replace(beta=5.0), 0.03, network=NETWORKS[name]), 0.03
    )


@pytest.mark.parametrize("receiver", ["hold", "filter"])
@pytest.mark.parametrize("make, dt", [(a460_pair, 2e-4), (ur5_payload, 1e-3)])
def test_cells_of_six_axes_agree_over_a_network(make, dt, receiver):
    assert_same_run(make(network=Network(0.01, loss=0.2, receiver=receiver)), duration=0.024, dt=dt)


@pytest.mark.parametrize("receiver", ["hold", "extrapolate", "filter"])
def test_integrals_that_leak_agree_over_a_network(receiver):
    experiment = planar_four(network=Network(0.004, delay=0.001, receiver=receiver))
    assert_same_run(replace(experiment, gains=experiment.gains.replace(leak=3.0)))


@pytest.mark.parametrize("moved", [0.0, 1e-3])
def test_delays_agree_where_integrals_leak(moved):
    experiment = with_moved_start(planar_four(network=NETWORKS["delays"]), moved, "q0", robot=0)
    assert_same_run(replace(experiment, gains=experiment.gains.replace(leak=3.0)))  # moved: w(0) is not 0


def test_robots_that_carry_an_object_agree_over_a_network():
    assert_same_run(replace(carry_planar(), network=Network(0.01, delay=0.005)), duration=0.03, dt=5e-4)


def test_another_law_and_another_adaptation_agree_over_a_network():
    experiment = a460_pair(network=Network(0.01, delay=0.005))
    gains = experiment.gains.replace(Gamma=None)
    assert_same_run(
        replace(experiment, gains=gains, law=Pulling(0.3), adaptation=Natural(0.1)), 0.02, dt=5e-4
    )


def test_a_run_over_a_network_is_the_same_bit_for_bit_when_it_is_repeated():
    experiment = planar_four(network=NETWORKS["filter"])
    one, other = (experiment.simulate(0.06, engine="compiled") for _ in range(2))
    np.testing.assert_array_equal(one.tau, other.tau)
    np.testing.assert_array_equal(one.outputs["network_state"], other.outputs["network_state"])


def test_the_code_of_a_cell_is_the_same_over_every_network():
    libraries = {}
    for network in (None, *NETWORKS.values()):
        Program(planar_four(network=network).closed_loop(), libraries, widest=1)
    assert len(libraries) == 1


class Deaf(Hold):
    """A receiver that believes what it likes."""

    def believed(self, t, now, leak):
        return 0 * super().believed(t, now, leak)


class OwnPosted(BoundPosted):
    """A network of messages of a user's own."""


def with_own(part, kind):
    """An experiment in which a part of the network is of another type."""
    experiment = planar_four(network=NETWORKS["hold"])
    loop = experiment.closed_loop()
    network = loop.controller.network
    (network if part is None else getattr(network, part)).__class__ = kind
    return loop


@pytest.mark.parametrize(
    "part, kind, subject", [(None, OwnPosted, "network"), ("receiver", Deaf, "receiver of the network")]
)
def test_parts_of_a_network_that_are_of_another_type_are_refused_by_name(part, kind, subject):
    with refused(InputError, subject, found=f"{__name__}.{kind.__qualname__}"):
        Program(with_own(part, kind))


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
def test_delays_in_continuous_time_are_refused_with_sampled_control_by_both_engines(engine):
    with refused(InputError, "network"):
        planar_four(network=NETWORKS["delays"]).simulate(0.01, control_period=1e-3, engine=engine)
