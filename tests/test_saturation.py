"""Torque that is cut off while the controller goes on learning: warned of, and written down."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from synctrl import Cell, Coupling, Cubic, Experiment, Gains, Member, Result, load_robot
from synctrl.errors import SaturationWarning, SimulationError
from synctrl.simulation.limits import applied_torque, warn_of_saturation
from synctrl.simulation.plant import torque_limits

ARM = load_robot("planar2r")
LIMITS = torque_limits(Cell([Member(ARM, Cubic([0, 0], [1, 1], 1.0))] * 2, Coupling.pair()))[0]


def pair(way=1.0, Gamma=0.5, saturate=True, K_r=4.0) -> Experiment:
    """Two arms that know nothing; the second is asked for `way` rad within half a second."""
    paths = [Cubic([0.3, 1.0], [0.3, 1.0], 0.5), Cubic([0.3, 1.0], [0.3 + way, 1.0 + way], 0.5)]
    cell = Cell([Member(ARM, path) for path in paths], Coupling.pair())
    return Experiment(cell, Gains(10.0, 5.0, K_r, 2.0, Gamma), 0.1, saturate=saturate)


def cut_run(**options) -> Result:
    """A run in which torque is cut off."""
    with pytest.warns(SaturationWarning):
        return pair(way=60.0).simulate(**options)


@pytest.mark.parametrize(
    "options",
    [{}, {"control_period": 2e-3}, {"integrator": "RK45", "rtol": 1e-4, "atol": 1e-6}, {"log_dt": 0.01}],
)
def test_a_run_says_which_joints_were_cut_off_how_often_and_by_how_much(options):
    run = cut_run(**options)
    assert run.status == "completed"
    size = np.abs(run.tau)
    found = {(entry["robot"], entry["joint"]): entry for entry in run.info["saturation"]}
    assert found.keys() == {(i, j) for i in range(2) for j in range(2) if (size[:, i, j] > LIMITS[j]).any()}
    for (i, j), entry in found.items():
        assert entry["limit"] == LIMITS[j] < entry["largest"] == size[:, i, j].max()
        assert entry["share"] == (size[:, i, j] > LIMITS[j]).mean() > 0
        known = np.abs(run.theta_hat[:, i])
        assert entry["theta_hat"] == [known[0].max(), known.max()]


def test_the_applied_torque_is_logged_beside_the_asked_one():
    run = cut_run()
    applied = run.outputs["applied_torque"]
    np.testing.assert_array_equal(applied, np.clip(run.tau, -LIMITS, LIMITS))
    assert (applied != run.tau).any()
    assert run.unit("applied_torque") == run.unit("tau")
    assert run.info["outputs"]["applied_torque"]["axes"] == ["time", "robot", "joint"]
    np.testing.assert_array_equal(applied_torque(run), applied)


def test_the_applied_torque_is_what_moves_the_robots():
    run = cut_run(dt=1e-4, duration=0.05)
    k = int(np.abs(run.tau).max(axis=(1, 2))[1:-1].argmax()) + 1
    rate = (run.v[k + 1] - run.v[k - 1]) / (run.t[k + 1] - run.t[k - 1])
    expected = ARM.forward_dynamics(run.q[k, 1], run.v[k, 1], run.outputs["applied_torque"][k, 1])
    asked = ARM.forward_dynamics(run.q[k, 1], run.v[k, 1], run.tau[k, 1])
    assert np.abs(rate[1] - expected).max() < 0.05 * np.abs(asked - expected).max()


def test_the_warning_says_what_was_learned_meanwhile():
    with pytest.warns(SaturationWarning) as caught:
        run = pair(way=60.0).simulate()
    (warning,) = [each for each in caught if each.category is SaturationWarning]
    text = str(warning.message)
    assert warning.filename == __file__
    start, largest = max((entry["theta_hat"] for entry in run.info["saturation"]), key=lambda pair: pair[1])
    assert f"theta_hat went from {start:.3g} to {largest:.3g}" in text
    assert "Estimates and integrals" in text
    assert run.names[1] in text


@pytest.mark.parametrize("settings", [{"name": "Mine"}, {"name": "Mine", "adaptation": "other"}, {}])
def test_the_warning_takes_whatever_settings_an_adaptation_of_ones_own_has(settings):
    run = cut_run()
    with pytest.warns(SaturationWarning, match="adaptation=Guarded"):
        warn_of_saturation(replace(run, info={**run.info, "adaptation": settings}))


@pytest.mark.parametrize(("largest", "mentioned"), [(5.88, False), (5.9, False), (6.0, True)])
def test_estimates_that_hardly_grew_are_not_mentioned(largest, mentioned):
    run = cut_run()
    found = [{**entry, "theta_hat": [5.88, largest]} for entry in run.info["saturation"]]
    with pytest.warns(SaturationWarning) as caught:
        warn_of_saturation(replace(run, info={**run.info, "saturation": found}))
    assert ("theta_hat" in str(caught[0].message)) is mentioned


@pytest.mark.parametrize("experiment", [pair(way=0.01, K_r=0.1), pair(saturate=False)])
def test_nothing_is_said_where_nothing_is_cut_off(experiment):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = experiment.simulate()
    assert run.info["saturation"] == []
    assert ("applied_torque" in run.outputs) == experiment.saturate


def enough(t):
    """Progress that is stopped by its user."""
    if t > 0.05:
        raise ValueError("enough")


def test_a_run_that_stops_says_it_in_its_result_and_not_by_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(SimulationError) as stop:
            pair(way=60.0).simulate(progress=enough)
    assert stop.value.result.info["saturation"]
    assert "applied_torque" in stop.value.result.outputs


def test_what_was_cut_off_survives_saving_and_thinning(tmp_path):
    run = cut_run()
    loaded = Result.load(run.save(tmp_path / "run.npz"))
    assert loaded == run
    assert loaded.info["saturation"] == run.info["saturation"]
    np.testing.assert_array_equal(applied_torque(loaded.decimated(5)), applied_torque(run.decimated(5)))


def test_results_of_earlier_versions_have_an_applied_torque_too():
    run = cut_run()
    info = {name: value for name, value in run.info.items() if name not in ("outputs", "saturation")}
    arrays = {name: getattr(run, name) for name in ("t", "x", "x_desired", "tracking_error", "sync_error")}
    arrays |= {name: getattr(run, name) for name in ("sync_integral", "coupled_error", "q", "v", "v_error")}
    arrays |= {name: getattr(run, name) for name in ("tau", "disturbance", "theta_hat")}
    np.testing.assert_array_equal(applied_torque(Result(**arrays, info=info)), applied_torque(run))
