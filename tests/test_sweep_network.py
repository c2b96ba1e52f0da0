"""Settings of a network as factors of a sweep: each changes its own, and rows are the same anywhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from seams.lagging_network import Lagging
from sweeps import DT, base, quiet

from synctrl import Network, sweep
from synctrl.control.network import Ideal
from synctrl.errors import InputError
from synctrl.sweep import (
    Grid,
    LogUniform,
    Sweep,
    Uniform,
    load,
    network_burst_end,
    network_burst_start,
    network_delay,
    network_jitter,
    network_loss,
    network_offset,
    network_period,
    network_receiver,
    network_seed,
)

POSTED = Network(period=4e-3, event=1e-3, receiver="extrapolate")
VALUES = {
    **{"period": 0.02, "delay": 5e-3, "jitter": 3e-3, "loss": 0.25, "event": 1e-2, "heartbeat": 8e-3},
    **{"receiver": "hold", "omega": 20.0, "horizon": 1e-3, "seed": 3, "offset": 0.01},
}


def network_after(*factors, start=POSTED):
    return Sweep(base(network=start), factors).experiment(0).network


@pytest.mark.parametrize("setting", VALUES)
def test_a_factor_changes_its_setting_and_no_other(setting):
    factor = getattr(sweep, f"network_{setting}")(Grid([VALUES[setting]]))
    found, value = network_after(factor), VALUES[setting]
    assert (
        found.as_dict()
        == POSTED.replace(**{setting: [value] * 2 if setting == "offset" else value}).as_dict()
    )
    assert type(found.seed) is int and POSTED.as_dict()["period"] == 4e-3


def test_every_setting_has_a_factor_and_every_factor_is_in_the_table_of_the_documents():
    known = {"burst_start", "burst_end", *VALUES}
    assert known == {name.removeprefix("network_") for name in sweep.__all__ if name.startswith("network_")}
    assert set(VALUES) | {"burst"} == set(vars(Network()))
    text = (Path(__file__).parents[1] / "docs" / "sweeps.md").read_text()
    parts = {"Choice", "Factor", "Grid", "LogUniform", "Normal", "Uniform", "load", "trajectories"}
    parts |= {"OwnMeasure", "Sweep"}
    table = text[text.index("| factor |") : text.index("`values` is")]
    assert [name for name in sweep.__all__ if name not in parts and f"`{name}" not in table] == []


@pytest.mark.parametrize("start", [None, Ideal(), Network()])
def test_an_experiment_whose_robots_know_everything_begins_with_messages_of_the_period(start):
    found = network_after(network_period(Grid([0.02])), network_loss(Grid([0.3])), start=start)
    assert found.as_dict() == {"name": "Network", "period": 0.02, "loss": 0.3}


def test_bursts_have_both_their_ends_in_either_order():
    turns, heals = network_burst_start(Grid([0.1])), network_burst_end(Grid([0.4]))
    assert network_after(turns, heals).burst == network_after(heals, turns).burst == (0.1, 0.4)
    assert network_after(turns).burst == (0.1, 1.0)


def test_the_clock_of_one_robot_is_ahead_and_others_stay():
    start = POSTED.replace(offset=[0.01, 0.02])
    found = network_after(network_offset(Grid([-0.005]), robot=1), start=start)
    np.testing.assert_array_equal(found.offset, [0.01, -0.005])
    with refused(InputError, "robot"):
        network_after(network_offset(Grid([0.1]), robot=2))


def test_what_has_no_such_setting_is_refused_by_name():
    with refused(InputError, "network", found="Lagging"):
        network_after(network_delay(Grid([0.1])), start=Lagging(0.01))
    with refused(InputError, "loss"):
        network_after(network_loss(Grid([0.1])), start=None)
    with refused(InputError, "seed"):
        network_after(network_seed(Grid([0.5])))
    with refused(InputError, "receiver"):
        network_after(network_receiver(Grid(["guess"])))


def drawn() -> Sweep:
    factors = [
        network_period(LogUniform(1e-3, 5e-3)),
        network_delay(Uniform(0, 4e-3)),
        network_jitter(Uniform(0, 2e-3)),
        network_loss(Grid([0.2, 1.0])),
        network_receiver(Grid(["filter", "hold"])),
    ]
    bands = {"tracking_error": 1e-3, "sync_error": 1e-3}
    return Sweep(base(), factors, samples=2, dt=DT, engine="pinocchio", bands=bands)


def test_rows_are_the_same_in_processes_of_their_own_and_losing_all_is_a_refused_row(tmp_path):
    pytest.importorskip("pandas", reason="tables are read with pandas: pip install 'synctrl[sweep]'")
    pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    here = quiet(drawn(), tmp_path / "here", backend="serial")
    assert quiet(drawn(), tmp_path / "there", 2, batch=1) == here
    table = load(tmp_path / "here")
    lost = table["network_loss"] == 1.0
    assert set(table["status"][lost]) == {"refused"} and set(table["status"][~lost]) == {"completed"}
    assert set(table["network_receiver"]) == {"filter", "hold"}
    assert all("loss" in cause for cause in table["cause"][lost])
