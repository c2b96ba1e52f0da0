"""Events of one's own: a robot that catches what was at rest, and a network that posts messages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from seams.catching_plant import Catching
from seams.posted_network import BoundPosted, Posted

from synctrl import Experiment, Payload, Result
from synctrl.analysis.certify import certify
from synctrl.analysis.growth import first_growth
from synctrl.errors import InputError, NonFiniteError, ResultError, SimulationError
from synctrl.experiments import a460_pair
from synctrl.simulation.plant import Plant
from synctrl.sweep import Grid, Sweep, gain

CATCH, RELEASE = 0.05, 0.1
BOX = Payload(0, 2.0, (0.05, 0.02, 0.1), start=CATCH, stop=RELEASE)
WAYS = {"continuous": {}, "sampled": {"control_period": 5e-3}, "adaptive": {"integrator": "DOP853"}}


def catching(**parts) -> Experiment:
    return replace(a460_pair(friction=False), plant_type=Catching, payloads=[BOX], **parts)


@pytest.fixture(scope="module")
def runs() -> Callable[[str], Result]:
    """A catch and a release on instants of the log, each way computed once."""
    made = {name: catching().simulate(0.15, dt=5e-4, **options) for name, options in WAYS.items()}
    return made.__getitem__


# -- the plant --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", WAYS)
def test_what_a_robot_catches_takes_its_share_of_the_momentum(runs, way):
    run, options = runs(way), WAYS[way]
    until = catching().simulate(CATCH, dt=5e-4, **options)  # it ends before the catch
    k, plant = int(np.abs(run.t - CATCH).argmin()), catching().closed_loop().plant
    q = run.q[k]
    np.testing.assert_array_equal(q, until.q[-1])
    for i in range(2):
        free, loaded = (plant.at(t).robots[i].mass_matrix(q[i]) for t in (0.0, CATCH))
        np.testing.assert_allclose(loaded @ run.v[k, i], free @ until.v[-1, i], rtol=1e-10)
    np.testing.assert_array_equal(run.v[k, 1], until.v[-1, 1])
    before, after = (
        0.5 * v @ plant.at(t).robots[0].mass_matrix(q[0]) @ v
        for t, v in ((0.0, until.v[-1, 0]), (CATCH, run.v[k, 0]))
    )
    assert after < 0.99 * before  # the impact is not elastic


@pytest.mark.parametrize("way", ["continuous", "adaptive"])
@pytest.mark.parametrize("t", [0.02, 0.07, 0.12], ids=["before", "meanwhile", "after"])
def test_the_mass_stays_until_it_is_let_go_of(runs, way, t):
    run, robots = runs(way), catching().closed_loop().plant.at(t).robots
    k, h = int(np.abs(run.t - t).argmin()), 5e-4
    rate = (8 * (run.v[k + 1] - run.v[k - 1]) - (run.v[k + 2] - run.v[k - 2])) / (12 * h)
    for i, robot in enumerate(robots):
        expected = robot.forward_dynamics(run.q[k, i], run.v[k, i], run.tau[k, i])
        np.testing.assert_allclose(rate[i], expected, atol=1e-5 * np.abs(rate).max())


@pytest.mark.parametrize("way", WAYS)
def test_letting_go_moves_nothing(runs, way):
    run, until = runs(way), catching().simulate(RELEASE, dt=5e-4, **WAYS[way])
    k = int(np.abs(run.t - RELEASE).argmin())
    for name in ("q", "v", "theta_hat", "sync_integral"):
        np.testing.assert_array_equal(getattr(run, name)[k], getattr(until, name)[-1])


class Charging(Plant):
    """A plant that counts its events."""

    hidden0, events = np.zeros(1), (-1.0, 0.0, 2e-3, 0.0045, 0.01, 1.0)

    def meet(self, t, q, v, hidden):
        return q, v, hidden + 1


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_every_event_before_the_end_happens_once(options):
    run = replace(a460_pair(friction=False), plant_type=Charging).simulate(0.01, dt=1e-3, **options)
    expected = np.searchsorted([0.0, 2e-3, 0.0045], run.t + 1e-9, side="right")
    np.testing.assert_array_equal(run.outputs["plant_state"][:, 0], expected)
    assert run.info["events"] == [{"t": t, "part": "Charging"} for t in (0.0, 2e-3, 0.0045)]


# -- the certificate --------------------------------------------------------------------------------------


class Kicked(Plant):
    """A plant in which somebody kicks the robots away from where they want to be."""

    events = (0.05, 0.0803)

    def meet(self, t, q, v, hidden):
        return q, v + 0.5, hidden


@pytest.mark.parametrize("log_dt", [5e-4, 4e-3], ids=["whole", "thinned"])
def test_a_jump_of_v_at_an_event_is_no_growth_and_is_named(log_dt):
    run = replace(a460_pair(friction=False), plant_type=Kicked).simulate(0.15, dt=5e-4, log_dt=log_dt)
    certificate = certify(run)
    record = certificate.lyapunov
    assert (np.diff(record.V) > 1e-3).any()
    assert certificate.growth is None and record.closes
    assert certificate.verdict == ("outside the theorem")
    intervals = f"2 of {len(run.t) - 1} intervals of the log"
    assert certificate.outside == (f"events of the plant Kicked move the state in {intervals}, first until "
                                   f"t = {run.t[record.events[0] + 1]:g} s: V jumps there",)  # fmt: skip
    assert first_growth(replace(record, events=())) is not None


def test_the_events_of_both_parts_are_named():
    run = catching(network=Posted(0.02)).simulate(0.15, dt=5e-4)
    certificate = certify(run)
    assert "events of the plant Catching and the network Posted move the state in 8 of " in str(certificate)
    assert certificate.closes and certificate.growth is None


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_runs_with_events_are_saved_loaded_and_certified_again(options, tmp_path):
    experiment = catching(network=Posted(0.02))
    run = experiment.simulate(0.12, dt=1e-3, **options)
    loaded = Result.load(run.save(tmp_path / "run.npz"))
    assert loaded == run
    assert certify(loaded, experiment).as_dict() == certify(run).as_dict()


# -- the sweep --------------------------------------------------------------------------------------------


class Later(Kicked):
    events = (0.05, 0.0804)


class Harder(Kicked):
    def meet(self, t, q, v, hidden):
        return q, v + 0.6, hidden


@pytest.mark.parametrize("kind", [Later, Harder])
def test_the_folder_of_a_sweep_takes_no_runs_with_other_events(kind, tmp_path):
    def sweep(plant: type[Plant]) -> Sweep:
        experiment = replace(a460_pair(friction=False), plant_type=plant)
        return Sweep(experiment, [gain("beta", Grid([1.0]))], duration=0.06, engine="pinocchio")

    sweep(Kicked).run(tmp_path, backend="serial", progress=False)
    sweep(Kicked).run(tmp_path, backend="serial", progress=False)
    with refused(ResultError, file=str(tmp_path)) as caught:
        sweep(kind).run(tmp_path, backend="serial", progress=False)
    assert "base.digest.dynamics" in caught.value.found


# -- what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("experiment", "part", "name"),
    [
        (catching(), "plant", "seams.catching_plant.Catching"),
        (replace(a460_pair(), network=Posted(0.02)), "network", "seams.posted_network.BoundPosted"),
    ],
    ids=["plant", "network"],
)
def test_the_compiled_engine_refuses_parts_with_events_by_name(experiment, part, name):
    with refused(InputError, part, found=name):
        experiment.simulate(0.01, engine="compiled")


class Shifted(BoundPosted):
    def messages(self, start, end):
        return super().messages(start, end) + 2 * self.T


class Backwards(BoundPosted):
    def messages(self, start, end):
        return super().messages(start, end)[::-1]


class Narrow(BoundPosted):
    def meet(self, t, w, memory):
        return memory[1:]


class Timeless(BoundPosted):
    def messages(self, start, end):
        return [np.nan]


class Wordy(BoundPosted):
    def messages(self, start, end):
        return ["soon"]


class Silent(BoundPosted):
    def messages(self, start, end):
        return None


@pytest.mark.parametrize(
    ("kind", "method"),
    [
        *((kind, "messages") for kind in (Shifted, Backwards, Timeless, Wordy, Silent)),
        (Narrow, "meet"),
    ],
)
@pytest.mark.parametrize("options", [{}, {"control_period": 2e-3}], ids=["continuous", "sampled"])
def test_messages_that_are_none_are_refused_with_their_network(kind, method, options):
    class Wrong(Posted):
        def bind(self, cell):
            return kind(self.T, cell.coupling, cell.m)

    with refused(InputError, f"network {kind.__qualname__}, {method}"):
        replace(a460_pair(), network=Wrong(1e-3)).simulate(0.01, **options)


class Endless(BoundPosted):
    def meet(self, t, w, memory):
        return memory + np.inf


@pytest.mark.parametrize("options", [{}, {"control_period": 2e-3}], ids=["continuous", "sampled"])
def test_a_message_that_makes_memory_infinite_ends_the_run_with_what_it_made(options):
    class Wrong(Posted):
        def bind(self, cell):
            return Endless(self.T, cell.coupling, cell.m)

    with refused(NonFiniteError, "network Endless, meet", cause="part") as caught:
        replace(a460_pair(), network=Wrong(1e-3)).simulate(0.01, **options)
    assert np.isinf(caught.value.found).all() and caught.value.found


class Flat(Plant):
    events = (2e-3,)

    def meet(self, t, q, v, hidden):
        return q, v[0], hidden


class Short(Flat):
    def meet(self, t, q, v, hidden):
        return q, v


class Mute(Flat):
    def meet(self, t, q, v, hidden):
        return None


class Broken(Flat):
    def meet(self, t, q, v, hidden):
        raise ZeroDivisionError("no hands")


class Torn(Flat):
    def meet(self, t, q, v, hidden):
        return q, v * np.inf, hidden


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize(
    ("kind", "error", "data"),
    [
        (Flat, InputError, {"subject": "plant Flat", "found": (3,)}),
        (Short, InputError, {"subject": "plant Short", "found": 2}),
        (Mute, InputError, {"subject": "plant Mute", "found": "NoneType"}),
        (Broken, SimulationError, {"cause": None}),
        (Torn, NonFiniteError, {"cause": "part", "time": 2e-3}),
    ],
)
def test_an_event_that_goes_wrong_ends_the_run_which_hands_over_what_it_has(kind, error, data, options):
    with refused(error, **data) as stop:
        replace(a460_pair(), plant_type=kind).simulate(0.02, dt=1e-3, **options)
    assert kind.__name__ in str(stop.value)
    assert len(stop.value.result.t) == 2 and stop.value.result.status.startswith("stopped")


@pytest.mark.parametrize("events", [(np.nan,), ("soon",), 0.1, None])
def test_events_that_are_no_instants_are_refused(events):
    class Vague(Plant):
        pass

    Vague.events = events
    with refused(InputError) as caught:
        replace(a460_pair(), plant_type=Vague)
    assert caught.value.subject.startswith("events of the plant")
