"""Adaptations, laws and networks as factors of a sweep: in its rows, files, processes and kept results."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from cells import SMALL_GAINS
from refusals import refused
from seams.lagging_network import Lagging
from seams.leaky_adaptation import Leaky
from seams.pulling_law import Pulling
from sweeps import DT, base, quiet

from synctrl import Experiment
from synctrl.control.adaptation import Gradient, Natural
from synctrl.control.laws import ChungSlotine, SunMills
from synctrl.control.network import Ideal
from synctrl.errors import InputError, ResultError
from synctrl.simulation.plant import Plant
from synctrl.simulation.result import LAYOUT
from synctrl.sweep import (
    Choice,
    Factor,
    Grid,
    Sweep,
    Uniform,
    adaptation,
    gain,
    gain_scale,
    law,
    load,
    model_error,
    network,
    trajectories,
    true_parameters,
    weights,
)
from synctrl.tune import tune

pytest.importorskip("pandas", reason="tables are read with pandas: pip install 'synctrl[sweep]'")
BANDS = {"tracking_error": 1e-3, "sync_error": 1e-3}
FACTORS = {
    "adaptation": (adaptation, (Gradient(0.2), Natural(0.1), Leaky(0.2, 0.1))),
    "law": (law, (SunMills(), ChungSlotine(0.3), Pulling(2.0))),
    "network": (network, (Ideal(), Lagging(0.01), Lagging(0.02))),
}


def start() -> Experiment:
    """Two arms whose first estimates are those of bodies, under gains that every law takes."""
    experiment = base(gains=SMALL_GAINS.independent())
    cell = experiment.cell
    members = [replace(member, theta_hat0=0.7 * member.theta) for member in cell.members]
    return replace(experiment, cell=type(cell)(members, cell.coupling, cell.space))


def parts_sweep(name: str, **options) -> Sweep:
    make, parts = FACTORS[name]
    options = {"dt": DT, "engine": "pinocchio", "bands": BANDS, **options}
    return Sweep(start(), [make(Grid(parts)), model_error(Uniform(-0.4, -0.1))], samples=2, **options)


@pytest.fixture(scope="module", params=FACTORS)
def made(request, tmp_path_factory):
    """A sweep over parts, its folder with every result, and its table."""
    folder = tmp_path_factory.mktemp(request.param)
    table = quiet(parts_sweep(request.param), folder, backend="serial", keep_every=1)
    return request.param, folder, table


def test_a_row_names_the_part_with_its_settings(made):
    name, folder, _ = made
    table, parts = load(folder), FACTORS[name][1]
    assert set(table["status"]) == {"completed"}, list(table["cause"])
    for run, label in table[name].items():
        settings = dict(parts[run // 2].as_dict())
        assert label.startswith(f"{settings.pop('name')}(")
        assert all(f"{key}={json.dumps(value)}" in label for key, value in settings.items())


def test_a_run_has_the_part_of_its_row_and_is_the_same_by_hand(made):
    name, folder, _ = made
    sweep, parts = parts_sweep(name), FACTORS[name][1]
    plain = Sweep(start(), [model_error(Grid([sweep.values(5)["model_error"]]))], dt=DT).experiment(0)
    gains = plain.gains.replace(Gamma=None) if name == "adaptation" else plain.gains
    by_hand = replace(plain, gains=gains, **{name: parts[2]}).simulate(dt=DT)
    kept = trajectories(folder, 5)
    for array in LAYOUT:
        np.testing.assert_array_equal(getattr(kept, array), getattr(by_hand, array), err_msg=array)
    assert kept.info[name] == parts[2].as_dict()


def test_runs_with_different_parts_differ(made):
    _, folder, _ = made
    torques = [trajectories(folder, run).tau for run in (0, 2, 4)]
    assert not np.array_equal(torques[0], torques[1])
    assert not np.array_equal(torques[1], torques[2])


def test_kept_results_have_the_states_of_parts(made):
    name, folder, _ = made
    own = {"adaptation": {"adaptation_state"}, "network": {"network_state"}, "law": set()}[name]
    assert trajectories(folder, 0).outputs.keys() == set()
    kept, whole = trajectories(folder, 2), parts_sweep(name).simulate(2)
    assert kept.outputs.keys() == own
    for state in own:
        np.testing.assert_array_equal(kept.outputs[state], whole.outputs[state])


@pytest.mark.parametrize("workers", [1, 2])
def test_processes_of_their_own_make_the_same_table(made, workers, tmp_path):
    pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    name, _, table = made
    assert quiet(parts_sweep(name), tmp_path, workers, batch=1) == table


def test_a_sweep_over_parts_goes_on_where_it_was(made, tmp_path):
    name, folder, table = made
    lines = (folder / "runs.jsonl").read_bytes().splitlines(keepends=True)
    (tmp_path / "sweep.json").write_bytes((folder / "sweep.json").read_bytes())
    (tmp_path / "runs.jsonl").write_bytes(b"".join(lines[3:]))
    assert quiet(parts_sweep(name), tmp_path, backend="serial", keep_every=1) == table
    assert (tmp_path / "runs.jsonl").read_bytes().startswith(b"".join(lines[3:]))


def test_a_folder_with_other_settings_of_a_part_is_refused_with_the_difference(tmp_path):
    def sweep(gamma):
        return Sweep(start(), [adaptation(Grid([Natural(gamma)]))], dt=DT, engine="pinocchio", bands=BANDS)

    quiet(sweep(0.1), tmp_path, backend="serial")
    with refused(ResultError, file=str(tmp_path)) as caught:
        quiet(sweep(0.2), tmp_path, backend="serial")
    there, here = caught.value.found.split(" there and ")
    assert "Natural(gamma=0.1," in there and "Natural(gamma=0.2," in here


@pytest.mark.parametrize("name", FACTORS)
def test_the_compiled_engine_makes_the_same_runs_or_refuses_the_part_by_name(name, tmp_path):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    sweeps = {engine: parts_sweep(name, engine=engine) for engine in ("pinocchio", "compiled")}
    tables = {}
    for engine, sweep in sweeps.items():
        quiet(sweep, tmp_path / engine, backend="serial")
        tables[engine] = load(tmp_path / engine)
    for run, row in tables["compiled"].iterrows():
        if row["status"] == "refused":
            assert "Lagging" in row["cause"] and "compiled" in row["cause"]
            continue
        for column in ("tracking_peak", "sync_rms", "peak_torque"):
            np.testing.assert_allclose(row[column], tables["pinocchio"].loc[run, column], rtol=1e-7)
    assert (tables["compiled"]["status"] == "refused").sum() == (4 if name == "network" else 0)


def test_other_factors_keep_the_parts_of_the_base_and_a_folder_knows_them(tmp_path):
    def sweep(T):
        gains = start().gains.replace(Gamma=None)
        mine = replace(start(), adaptation=Leaky(0.2, 0.1), law=Pulling(2.0), network=Lagging(T), gains=gains)
        factors = [
            gain("beta", Grid([1.0, 2.0])),
            model_error(Uniform(-0.4, -0.1)),
            true_parameters(Uniform(0.9, 1.1)),
            weights(Uniform(0.5, 2.0)),
        ]
        return Sweep(mine, factors, dt=DT, engine="pinocchio", bands=BANDS)

    quiet(sweep(0.01), tmp_path, backend="serial", keep_every=1)
    assert set(load(tmp_path)["status"]) == {"completed"}
    info = trajectories(tmp_path, 1).info
    assert [info[name] for name in FACTORS] == [
        {"name": "Leaky", "Gamma": 0.2, "nu": 0.1},
        {"name": "Pulling", "k": 2.0},
        {"name": "Lagging", "T": 0.01},
    ]
    with refused(ResultError, file=str(tmp_path), found="base.network.T is 0.01 there and 0.02 here"):
        quiet(sweep(0.02), tmp_path, backend="serial", keep_every=1)


def test_a_search_keeps_the_parts_of_its_base():
    mine = replace(start(), adaptation=Leaky(0.2, 0.1), gains=start().gains.replace(Gamma=None))
    options = {"generations": 1, "population": 5, "dt": DT, "engine": "pinocchio", "bands": BANDS}
    best = tune(mine, {"K_r": Uniform(0.5, 2.0)}, backend="serial", progress=False, **options)
    assert best.experiment.adaptation is mine.adaptation
    assert best.gains == mine.gains.replace(K_r=best.values["K_r"])
    assert best.measures["saturation"] == 0.0


def test_long_settings_are_shown_short_and_written_whole():
    part = Gradient(np.linspace(0.1, 0.2, 20))
    values = Grid([part])
    assert len(repr(adaptation(values))) < 100
    assert values.values[0] == f"Gradient(Gamma={json.dumps(part.as_dict()['Gamma'])})"


def test_parts_are_drawn_as_words_are():
    sweep = Sweep(start(), [network(Choice([Ideal(), Lagging(0.01)]))], samples=20, bands=BANDS)
    drawn = [sweep.values(run)["network"] for run in range(20)]
    assert set(drawn) == {"Ideal()", "Lagging(T=0.01)"}
    for run, label in enumerate(drawn):
        assert type(sweep.experiment(run).network).__name__ == label.split("(")[0]


def test_a_law_that_has_no_place_for_the_gains_is_a_refused_row(tmp_path):
    sweep = Sweep(base(), [law(Grid([SunMills(), ChungSlotine(0.3)]))], dt=DT, engine="pinocchio")
    quiet(sweep, tmp_path, backend="serial")
    table = load(tmp_path)
    assert list(table["status"]) == ["completed", "refused"]
    assert "ChungSlotine" in table.loc[1, "cause"]


class Untold(Leaky):
    """An adaptation that does not tell all its settings."""

    def as_dict(self):
        return {"name": "Untold"}


class Unplain(Leaky):
    """An adaptation whose settings are no plain data."""

    def as_dict(self):
        return {"name": "Unplain", "Gamma": np.eye(2)}


@pytest.mark.parametrize(
    ("wrong", "subject"),
    [
        (lambda: adaptation(Uniform(0, 1)), "adaptation"),
        (lambda: adaptation([Natural(0.1)]), "adaptation"),
        (lambda: law(Grid(["SunMills"])), "law"),
        (lambda: Grid([Natural]), "Grid"),
        (lambda: Grid([Untold(0.1, 0.1), Untold(0.2, 0.1)]), "Grid"),
        (lambda: Grid([Unplain(0.1, 0.1)]), "Unplain"),
        (lambda: Grid([ChungSlotine(0.1), ChungSlotine(0.1)]), "Grid"),
    ],
)
def test_what_is_no_list_of_different_parts_is_an_input_error(wrong, subject):
    with refused(InputError, subject):
        wrong()


class OfOneRobot(Plant):
    """A plant that gives the accelerations of its first robot alone, which numpy would take for all."""

    def move(self, q, v, tau, hidden):
        v_dot, hidden_dot = super().move(q, v, tau, hidden)
        return v_dot[0], hidden_dot


def plugged_in(experiment, wrong):
    return replace(experiment, plant_type=OfOneRobot if wrong else Plant)


def test_a_plant_that_a_factor_plugs_in_is_refused_where_a_single_run_refuses_it():
    with refused(InputError, "plant OfOneRobot", found=(2,)):
        plugged_in(start(), True).simulate(dt=DT)
    factors = [Factor("wrong", Grid([0, 1]), plugged_in)]
    sweep = Sweep(start(), factors, dt=DT, engine="pinocchio", bands=BANDS)
    good, bad = sweep.run_one(0), sweep.run_one(1)
    assert (good["status"], bad["status"]) == ("completed", "refused")
    assert "its acceleration" in bad["cause"]


@pytest.mark.parametrize("factor", [gain, gain_scale])
def test_a_gain_that_an_adaptation_has_replaced_cannot_be_varied(factor, tmp_path):
    factors = [adaptation(Grid([Natural(0.1)])), factor("Gamma", Grid([2.0]))]
    for order in (factors, factors[::-1]):
        with refused(InputError, "factors"):
            Sweep(start(), order, bands=BANDS)
    naturally = replace(start(), adaptation=Natural(0.1), gains=start().gains.replace(Gamma=None))
    with refused(InputError, "adaptation" if factor is gain else "Gamma_scale"):
        Sweep(naturally, factors[1:], bands=BANDS).experiment(0)
