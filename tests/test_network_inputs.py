"""Whatever settings of a network are given that it cannot have, it refuses, and says what it was."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import chain
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused
from seams.posted_network import BoundPosted, Posted

from synctrl import Experiment, Network, Result
from synctrl.analysis.certify import certify
from synctrl.control.network.delayed import FINEST
from synctrl.errors import InputError, SynctrlError
from synctrl.experiments import bead_on_path, carry_planar
from synctrl.simulation.result import LAYOUT

NAN, INF = np.nan, np.inf
DT = 2e-3
#: none of these is one number
NO_NUMBER = (
    *("1", b"1", NAN, INF, -INF, True, 1j, [], {}, [0.1, 0.2], np.zeros(0), np.datetime64("2020"), 10**400),
    *(object(), Network, lambda: 0.1),
)
NOT_POSITIVE = (*NO_NUMBER, 0, -1.0)
#: none of these is a number, or one for every link between two robots
NO_LINKS = (
    *(
        *NO_NUMBER,
        None,
        -0.1,
        [[0, -0.1], [0.1, 0]],
        [[0, NAN], [0, 0]],
        np.zeros((3, 3)),
    ),
    *(np.zeros((2, 3)), np.zeros((2, 2, 2)), [[0, 1], [2]], [["0", "0"], ["0", "0"]], np.zeros((2, 2), bool)),
)
NO_SEED = ("1", 1.0, True, None, -1, 2**63, 2**128, 10**400, NAN, [1], 1j)
POSTED = {"period": 0.01}

Case = tuple[str, Callable[[], Any]]


def start(**parts: Any) -> Experiment:
    """Two arms for a hundredth of a second."""
    return Experiment(small_cell(), SMALL_GAINS, 0.01, **parts)


def connect(**settings: Any) -> Any:
    """A network between the two arms."""
    return start(network=Network(**settings)).closed_loop().controller.network


def bad(good: dict[str, Any], **values: Any) -> list[Case]:
    """For every setting one case per bad value, all others being good."""
    return [
        (f"{name}-{k}", partial(connect, **{**good, name: value}))
        for name, some in values.items()
        for k, value in enumerate(some)
    ]


CASES = list(
    chain(
        bad(
            POSTED,
            period=(*NOT_POSITIVE, 1e10),
            delay=(*NO_LINKS, 1e9, 1e300, [[0, 101], [0, 0]]),
            jitter=(*NO_LINKS, 1e9, 1e300),
            loss=(*NO_LINKS, 1, 1.5, [[0, 1], [0, 0]]),
            burst=(
                *(*NO_NUMBER[:9], 0.5, (0.5,), (0.1, 0.2, 0.3), (0.1, 0), (-0.1, 0.5), (1.1, 0.5)),
                *((0.5, 1.1), (NAN, 0.5), (True, True), ("0.1", "0.1"), ((0.1, 0.1),)),
            ),
            offset=(
                *(*NO_NUMBER[:9], None, [0.1], np.zeros(3), np.zeros((2, 2)), [0, NAN], [True, False]),
                *(1e300, -1e300),
            ),
            event=(*NO_NUMBER[:8], {}, 0, -1e-3, [1e-3], [1e-3, 0], [1e-3] * 3, np.ones((2, 2)), [1, INF]),
            receiver=("Filter", "", None, 1, b"filter", ["filter"], NAN),
            omega=(*NOT_POSITIVE, None, 1e10, 1e300),
            seed=NO_SEED,
        ),
        bad({**POSTED, "event": 1e-3}, heartbeat=NOT_POSITIVE),
        bad({**POSTED, "receiver": "extrapolate"}, horizon=(*NOT_POSITIVE, 10.0, 1e300)),
        bad({}, delay=(0.9 * FINEST, 1e-300, 1e9, 1e300, 9.0, [[0, 1e-12], [0.1, 0]])),
        bad({}, delay=([[0, 1e-300], [1e9, 0]],)),
        bad({}, jitter=(0.1,), loss=(0.1,), burst=((0.1, 0.1),), event=(1e-3,), heartbeat=(0.5,)),
        bad({}, horizon=(0.1,)),
        bad(POSTED, heartbeat=(0.5,), horizon=(0.1,)),
        bad({"receiver": "extrapolate", "delay": 0.9, "period": 1.0}, receiver=("extrapolate",)),
    )
)  # fmt: skip


@pytest.mark.parametrize(("name", "make"), CASES, ids=[name for name, _ in CASES])
def test_it_is_refused_and_the_setting_is_named(name: str, make: Callable[[], Any]) -> None:
    with pytest.raises(SynctrlError) as caught:
        make()
    setting, words = name.rsplit("-", 1)[0], str(caught.value)
    assert setting in words
    assert caught.value.subject and re.search("expect", words)


GOOD = (
    {},
    {"delay": 1e-3},
    {"delay": [[0, 1e-3], [5e-3, 0]], "offset": [0.01, 0]},
    {"period": 1e9, "seed": 2**63 - 1},
    {"period": 0.5, "receiver": "hold"},
    {"period": 2e-3, "delay": 3e-3, "jitter": [[0, 1e-3], [2e-3, 0]], "loss": 0.3, "burst": (0.1, 0.5)},
    {"period": 2e-3, "event": [1e-3, 2e-3], "heartbeat": 4e-3, "omega": 100.0},
    {"period": 2e-3, "receiver": "extrapolate", "horizon": 1e-3},
)


@pytest.mark.parametrize("settings", GOOD, ids=str)
def test_settings_go_there_and_back_as_plain_data_words_and_bytes(settings: dict[str, Any]) -> None:
    network = Network(**settings)
    told = network.as_dict()
    assert told.pop("name") == "Network" and told.keys() == settings.keys()
    for again in (
        Network(**told),
        eval(repr(network), {"Network": Network}),
        pickle.loads(pickle.dumps(network)),
    ):
        assert again.as_dict() == network.as_dict()
    run, same = (start(network=n).simulate(dt=DT) for n in (network, again))
    assert run == same and run.status == "completed"


@pytest.mark.parametrize("itself", [1.0, -1.0, NAN, INF])
@pytest.mark.parametrize("setting", ["delay", "jitter", "loss"])
def test_what_stands_on_the_diagonal_does_not_count(setting: str, itself: float) -> None:
    value = np.array([[itself, 0.25], [0.5, itself]])
    given = Network(0.1, **{setting: value})
    assert given.as_dict() == Network(0.1, **{setting: [[0, 0.25], [0.5, 0]]}).as_dict()
    assert value[0, 0] == itself or np.isnan(itself)  # the caller's own array is left alone


def test_words_about_a_network_have_what_is_not_as_by_default() -> None:
    assert repr(Network()) == "Network()"
    assert repr(Network(period=0.01, loss=0.2, seed=0)) == "Network(period=0.01, loss=0.2)"


def test_a_setting_is_changed_and_the_others_stay() -> None:
    network = Network(period=0.01, loss=[[0, 0.1], [0.2, 0]])
    assert network.replace(delay=0.02).as_dict() == {**network.as_dict(), "delay": 0.02}
    assert network.as_dict() == {"name": "Network", "period": 0.01, "loss": [[0, 0.1], [0.2, 0]]}
    with refused(InputError, "network", found="delya"):
        network.replace(delya=0.02)
    with refused(InputError, "loss"):
        network.replace(period=None)


# -- with the run ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wrong", [Network, "Network", 0.01, object(), {"period": 0.01}, lambda cell: cell])
def test_what_is_no_network_is_refused(wrong: Any) -> None:
    with refused(InputError, "network"):
        start(network=wrong)


def test_continuous_exchange_does_not_go_with_sampled_control() -> None:
    experiment = start(network=Network(delay=1e-3))
    with refused(InputError, "network"):
        experiment.simulate(dt=DT, control_period=DT)
    with refused(InputError, "network"):
        experiment.controller(DT)
    at_once = start(network=Network()).simulate(dt=DT, control_period=DT)
    for name in ("q", "tau"):  # without delays it is the same as everybody knowing everything
        ideal = getattr(start().simulate(dt=DT, control_period=DT), name)
        np.testing.assert_allclose(getattr(at_once, name), ideal, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    ("settings", "setting", "duration"),
    [
        *(({"period": period}, "period", 0.01) for period in (1e-300, 1e-12, 1e-9)),
        ({"delay": FINEST}, "delay", 1e7 * FINEST),
    ],
)
def test_far_too_many_messages_are_refused_before_the_run(
    settings: dict[str, Any], setting: str, duration: float
) -> None:
    experiment = start(network=Network(**settings))
    with refused(InputError, setting):
        experiment.plan(duration, DT)


@pytest.mark.parametrize("period", [1e-300, 1e-12, 1e-7])
def test_far_more_messages_than_samples_are_refused_before_the_run(period: float) -> None:
    experiment = start(network=Network(period=period))
    with pytest.raises(InputError) as caught:
        experiment.controller(DT)
    assert caught.value.subject in ("period", "network, messages")


def test_what_moves_the_desired_motion_refuses_a_network_of_messages_by_its_name() -> None:
    posted = {"network": Network(period=0.01)}
    for make in (
        lambda: carry_planar(admittance=True, **posted),
        lambda: replace(bead_on_path(override=True), **posted),
        lambda: replace(bead_on_path(override=True), network=Network(delay=0.01)),
    ):
        with refused(InputError, "network") as caught:
            make()
        assert re.search("BoundPosted|BoundDelayed", str(caught.value))


class Unheard(BoundPosted):
    def account(self, log):
        return {"messages": np.zeros(3)}


class Mute(BoundPosted):
    def account(self, log):
        return None


class Loud(BoundPosted):
    def account(self, log):
        return {"tau": (log["t"], "s", ("time",))}


@pytest.mark.parametrize(
    ("kind", "subject"), [(Unheard, "outputs, messages"), (Mute, "outputs"), (Loud, "outputs")]
)
def test_outputs_that_are_none_are_refused_with_their_network(kind: type, subject: str) -> None:
    class Wrong(Posted):
        def bind(self, cell):
            return kind(self.T, cell.coupling, cell.m)

    with refused(InputError, f"network {kind.__qualname__}, {subject}"):
        start(network=Wrong(4e-3)).simulate(dt=DT)


class Untold:
    def bind(self, cell):
        return Posted(4e-3).bind(cell)


def test_a_network_that_does_not_say_its_settings_is_refused() -> None:
    with refused(InputError, "network"):
        start(network=Untold())


# -- files and processes ----------------------------------------------------------------------------------

LOSSY = Network(period=2e-3, delay=1e-3, jitter=2e-3, loss=0.3, burst=(0.2, 0.5), seed=7)


def torque(experiment: Experiment) -> np.ndarray:
    return experiment.simulate(0.02, dt=DT).tau


def test_a_process_of_its_own_makes_the_same_run() -> None:
    experiment = start(network=LOSSY)
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        there = pool.submit(torque, experiment).result()
    np.testing.assert_array_equal(there, torque(experiment))


def test_a_saved_run_is_certified_with_its_own_network_and_no_other(tmp_path: Any) -> None:
    experiment = start(network=LOSSY)
    run = experiment.simulate(0.02, dt=DT)
    loaded = Result.load(run.save(tmp_path / "run.npz"))
    assert loaded == run and loaded.info["network"] == LOSSY.as_dict()
    assert certify(loaded, experiment).as_dict() == certify(run).as_dict()
    for other in (LOSSY.replace(loss=0.31), LOSSY.replace(seed=8), LOSSY.replace(receiver="hold"), None):
        with refused(InputError, "experiment"):
            certify(loaded, replace(experiment, network=other))


# -- what is counted --------------------------------------------------------------------------------------

TRAFFIC = {
    "at once": {},
    "late": {"delay": 5e-3},
    "unsteady": {"delay": [[0, 3e-3], [1e-3, 0]], "jitter": 4e-3},
    "lossy": {"loss": 0.4, "jitter": 4e-3},
    "in bursts": {"burst": (0.3, 0.3)},
    "events": {"event": 1e-3},
    "heartbeat": {"event": 10.0, "heartbeat": 8e-3},
}


@pytest.mark.parametrize("options", [{}, {"control_period": DT}], ids=["continuous", "sampled"])
@pytest.mark.parametrize("name", TRAFFIC)
def test_messages_are_counted_and_their_age_has_its_bound(name: str, options: dict[str, float]) -> None:
    network = Network(period=4e-3, **TRAFFIC[name])
    run = start(network=network).simulate(0.06, dt=DT, **options)
    sent, heard, age = (run.outputs[k] for k in ("messages_sent", "messages_heard", "message_age"))
    about = {k: (run.info["outputs"][k]["unit"], run.info["outputs"][k]["axes"]) for k in
             ("messages_sent", "messages_heard", "message_age")}  # fmt: skip
    assert about == {
        "messages_sent": ("1", ["time", "robot"]),
        "messages_heard": ("1", ["time", "link"]),
        "message_age": ("s", ["time", "link"]),
    }
    of_sender = sent[:, ::-1]  # robot 0 hears robot 1, and robot 1 hears robot 0
    assert (heard <= of_sender).all() and (age >= 0).all()
    for counted in (sent, heard):
        assert (np.diff(counted, axis=0) >= 0).all()
        np.testing.assert_array_equal(counted, np.round(counted))
    if name in ("at once", "events", "heartbeat"):
        np.testing.assert_array_equal(heard, of_sender)
    if name in ("at once", "late", "unsteady"):
        longest = network.period + float(np.max(network.delay + network.jitter))
        assert (age <= longest + DT * bool(options) + 1e-12).all()
    if name in ("lossy", "in bursts"):
        assert (heard[-1] < of_sender[-1]).any()
    if name == "heartbeat":
        assert (np.diff(sent[::4], axis=0) == 1).all() and age.max() <= 8e-3 + 1e-12


def test_counting_messages_changes_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    from synctrl.control.network import BoundPosted as Ours

    told = start(network=LOSSY).simulate(dt=DT)
    monkeypatch.delattr(Ours, "account")
    untold = start(network=LOSSY).simulate(dt=DT)
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(told, name), getattr(untold, name))
