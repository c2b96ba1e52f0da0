"""Settings of sensors and actuators as factors of a sweep."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from sweeps import DT, base, quiet

from synctrl import sweep
from synctrl.errors import InputError
from synctrl.simulation.devices import Bias, DifferencedVelocity, Lag, Noise, Quantisation, RateLimit
from synctrl.sweep import Grid, Sweep, Uniform, control_period, load
from synctrl.sweep import devices as factors
from synctrl.sweep.devices import KINDS, with_device

#: every factor, with the device and the setting that it changes
FACTORS = {
    "encoder_resolution": ("Quantisation", "step"),
    "encoder_bias": ("Bias", "q"),
    "noise": ("Noise", "q"),
    "velocity_noise": ("Noise", "v"),
    "noise_seed": ("Noise", "seed"),
    "velocity_filter": ("DifferencedVelocity", "omega"),
    "torque_resolution": ("TorqueQuantisation", "step"),
    "torque_rate": ("RateLimit", "rate"),
    "dead_time": ("DeadTime", "time"),
    "torque_lag": ("Lag", "time_constant"),
    "torque_ripple": ("Ripple", "share"),
}
BANDS = {"tracking_error": 1e-3, "sync_error": 1e-3}


@pytest.mark.parametrize("name", FACTORS)
def test_a_factor_is_the_setting_of_its_device_and_changes_the_run(name):
    device, setting = FACTORS[name]
    value = {"noise_seed": 7, "velocity_filter": 50.0, "torque_rate": 0.5}.get(name, 3e-3)
    start = base(sensors=[Noise(1e-4)]) if name == "noise_seed" else base()
    study = Sweep(
        start,
        [getattr(sweep, name)(Grid([value]))],
        dt=DT,
        engine="pinocchio",
        control_period=DT,
        bands=BANDS,
    )
    role = KINDS[device][0]
    (part,) = study.simulate(0).info[role]
    assert part["name"] == device and part[setting] == value
    assert not np.array_equal(study.simulate(0).q, start.simulate(0.01, DT, control_period=DT).q)


def test_every_factor_is_exported_and_in_the_table_of_the_page():
    text = (Path(__file__).parents[1] / "docs" / "sweeps.md").read_text("utf-8")
    public = {name for name in sweep.__all__ if getattr(sweep, name).__module__ == factors.__name__}
    assert public == {*FACTORS}
    assert all(f"`{name}`" in text for name in FACTORS)


def test_a_device_that_is_there_keeps_its_other_settings_and_its_place():
    start = base(sensors=[DifferencedVelocity(90.0), Noise(1e-4, 1e-3, seed=5)])
    changed = with_device(start, 2e-4, "Noise", "q").sensors
    assert [type(part) for part in changed] == [DifferencedVelocity, Noise]
    assert (changed[1].q, changed[1].v, changed[1].seed) == (2e-4, 1e-3, 5)
    assert start.sensors[1].q == 1e-4


def test_a_device_that_is_not_there_takes_its_place_in_the_order_of_a_robot():
    start = base()
    for device, setting in (("DifferencedVelocity", "omega"), ("Quantisation", "step"), ("Bias", "q")):
        start = with_device(start, 1e-3, device, setting)
    for device, setting in (("Lag", "time_constant"), ("RateLimit", "rate")):
        start = with_device(start, 1e-3, device, setting)
    assert [type(part) for part in start.sensors] == [Bias, Quantisation, DifferencedVelocity]
    assert [type(part) for part in start.actuators] == [RateLimit, Lag]


def study(**options) -> Sweep:
    """Noise and a lag, with the period as a factor too."""
    drawn = [sweep.noise(Uniform(0, 1e-4)), sweep.torque_lag(Uniform(0, 1e-2))]
    options = {"samples": 2, "seed": 1, "engine": "pinocchio", **options}
    return Sweep(base(), [*drawn, control_period(Grid([DT, 2 * DT]))], dt=DT, bands=BANDS, **options)


def test_a_sweep_that_was_sent_elsewhere_draws_the_same_noise(tmp_path):
    sent = pickle.loads(pickle.dumps(study()))
    assert quiet(sent, tmp_path / "one", backend="serial") == quiet(
        study(), tmp_path / "two", backend="serial"
    )


def test_a_sweep_of_continuous_control_has_rows_that_were_refused_by_name(tmp_path):
    plain = Sweep(base(), [sweep.noise(Grid([1e-4]))], dt=DT, engine="pinocchio", bands=BANDS)
    quiet(plain, tmp_path, backend="serial")
    (row,) = load(tmp_path).to_dict("records")
    assert row["status"] == "refused" and "Noise" in row["cause"]


def test_a_value_that_a_device_does_not_take_is_refused_and_named():
    with refused(InputError, "step"):
        with_device(base(), -1.0, "Quantisation", "step")
    for seed in (0.5, "three"):
        with refused(InputError, "seed"):
            sweep.noise_seed(Grid([seed])).change(base(), seed)
