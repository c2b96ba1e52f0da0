"""What turns is in rad, rad/s and N·m, what slides in m, m/s and N: in results, metrics and messages."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from machines import random_robot, seeds
from refusals import refused
from sliders import GANTRY, SCARA, load, pair

from synctrl import CartesianSpace, Cell, Coupling, Disturbance, JointSpace, Member, Result, load_robot
from synctrl.analysis.metrics import as_data, metrics
from synctrl.errors import InputError, NonFiniteError, SaturationWarning
from synctrl.robots.model import joined, joint_poses, unit_for
from synctrl.simulation.result import LAYOUT
from synctrl.simulation.simulate import Experiment
from synctrl.sweep import Grid, Sweep, gain
from synctrl.sweep import load as table
from synctrl.sweep.measures import definitions

SCARA_UNITS = ("rad", "rad", "m", "rad")


@pytest.fixture(scope="module")
def gantries(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    robot = load(tmp_path_factory.mktemp("gantry"), "gantry", GANTRY)
    return pair((robot, robot))


@pytest.fixture(scope="module")
def scaras(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    robot = load(tmp_path_factory.mktemp("scara"), "scara", SCARA)
    return pair((robot, robot))


@settings(max_examples=20)
@given(seed=seeds)
def test_a_joint_is_in_metres_where_its_motion_turns_nothing(seed):
    robot = random_robot(seed, 4)
    q = np.array([robot.configuration(row) for row in np.vstack([np.zeros(4), np.eye(4)])])
    rest, *moved = joint_poses(robot.model, q)[:, 1:, 3:]
    for k, unit in enumerate(robot.joint_units):
        assert (unit == "m") == np.allclose(moved[k][k], rest[k], atol=1e-9)


def test_a_unit_of_a_turning_joint_has_its_counterpart_for_one_that_slides():
    assert unit_for("N·m", "rad") == "N·m" and unit_for("N·m", "m") == "N"
    assert unit_for("rad/s", "m") == "m/s" and unit_for("°C", "m") == "°C"
    assert joined(("m", "rad", "m")) == "m, rad"


def test_a_run_of_slides_speaks_of_metres_and_newtons_everywhere(gantries):
    run = gantries.simulate(dt=2e-3)
    assert run.info["robots"][0]["joint_units"] == ["m"] * 3
    assert run.info["axes"] == [
        "rail",
        "bridge",
        "lift",
    ]
    assert (run.unit("q"), run.unit("v"), run.unit("tau"), run.unit("disturbance")) == ("m", "m/s", "N", "N")
    assert (run.unit("x"), run.unit("tracking_error"), run.unit("sync_integral")) == ("m", "m", "m·s")
    assert all("rad" not in unit and "N·m" not in unit for unit in run.info["units"].values())


def test_a_run_of_mixed_arms_has_a_unit_for_every_joint(scaras):
    run = scaras.simulate(dt=2e-3)
    assert run.units("q") == (SCARA_UNITS,) * 2 and run.units("tracking_error") == (SCARA_UNITS,) * 2
    assert run.units("sync_error") == (SCARA_UNITS,)
    assert run.units("tau")[1] == ("N·m", "N·m", "N", "N·m")
    assert run.unit("tau") == "N·m, N" and run.unit("t") == "s" and run.units("theta_hat") == (("SI",),)
    assert run.info["units"] == {name: run.unit(name) for name in LAYOUT}


def test_units_come_back_from_a_file(scaras, tmp_path):
    run = scaras.simulate(dt=2e-3)
    found = Result.load(run.save(tmp_path / "run.npz"))
    assert found == run and found.units("v") == run.units("v")


def test_a_result_that_says_nothing_of_its_joints_is_one_of_turning_ones(scaras):
    run = scaras.simulate(dt=2e-3)
    robots = [{k: v for k, v in robot.items() if k != "joint_units"} for robot in run.info["robots"]]
    info = {k: v for k, v in run.info.items() if k not in ("axis_units", "weighted_units")}
    old = replace(run, info={**info, "robots": robots})
    assert old.unit("tau") == "N·m" and old.units("x") == ((run.info["task_unit"],) * 4,) * 2


def test_metrics_of_mixed_arms_name_joints_and_units(scaras):
    run = scaras.simulate(dt=2e-3)
    data = as_data(run, metrics(run))
    assert [*data["tracking_error"]["values"]["robot 1"]] == ["shoulder", "elbow", "lift", "wrist"]
    assert data["tracking_error"]["units_by_axis"]["lift"]["ise"] == "m²·s"
    assert data["tracking_error"]["units_by_axis"]["wrist"]["peak"] == "rad"
    assert data["peak_torque"]["units"]["robot 2"] == dict(
        zip(run.info["axes"], run.units("tau")[1], strict=True)
    )
    assert definitions(scaras.cell)["peak_torque"].unit == "N·m, N"


def test_the_band_of_a_joint_is_made_from_errors_in_its_own_unit(scaras):
    run = scaras.simulate(dt=2e-3)
    e = np.abs(run.tracking_error).max(axis=(0, 1))
    found = metrics(run).tracking_error.band
    turning = max(e[0], e[1], e[3])
    np.testing.assert_allclose(found, 0.05 * np.array([turning, turning, e[2], turning]))


def test_a_sweep_keeps_the_bands_of_all_joints(scaras, tmp_path):
    sweep = Sweep(scaras, [gain("beta", Grid([4.0, 5.0]))], dt=2e-3, duration=0.02, engine="pinocchio")
    for _ in range(2):  # the second time from the folder
        sweep.run(tmp_path, backend="serial", progress=False)
    assert len(table(tmp_path)) == 2
    about = json.loads((tmp_path / "sweep.json").read_text(encoding="utf-8"))
    assert len(about["settling_bands"]["tracking_error"]) == 4


def test_weights_with_a_unit_multiply_the_unit_of_each_coordinate(scaras):
    cell = Cell(scaras.cell.members, Coupling.pair(unit="m"))
    assert cell.weighted_units == ("m·rad", "m·rad", "m²", "m·rad") and cell.weighted_unit == "m·rad, m²"


def test_joints_of_one_number_and_other_kinds_are_in_either_unit(gantries, tmp_path):
    turning = tuple((name, "revolute", axis) for name, _, axis in GANTRY)
    other = load(tmp_path, "turning", turning)
    assert JointSpace().units((gantries.cell.robots[0], other)) == ("m or rad",) * 3


def test_a_stop_of_a_slide_is_told_in_metres_and_newtons(gantries):
    push = Disturbance(robot=0, torque=np.array([0, 0, 1e12]), start=0.02, stop=0.1)
    with pytest.raises(NonFiniteError) as caught:
        replace(gantries, disturbances=(push,)).simulate(dt=2e-3)
    assert "1e+12 N accelerates" in str(caught.value) and "m/s²" in str(caught.value)
    fast = [replace(member, v0=np.array([0, 0, 1e4])) for member in gantries.cell.members]
    with refused(NonFiniteError, robot=0, joint=2, cause="start") as caught:
        replace(gantries, cell=Cell(fast, gantries.cell.coupling)).simulate(dt=2e-3)
    assert "1e+04 m/s," in str(caught.value)


def test_a_gain_that_is_too_large_is_told_in_the_unit_of_its_joint(gantries, scaras):
    for cell, unit in ((gantries, "N·s/m"), (scaras, "N·m·s/rad")):
        with pytest.raises(NonFiniteError) as caught:
            replace(cell, gains=replace(cell.gains, K_r=1e7)).simulate(dt=2e-3)
        assert f"K_r = 1e+07 {unit} " in str(caught.value)


def test_torque_that_was_cut_off_and_limits_that_were_left_are_in_newtons(tmp_path):
    robot = load(tmp_path, "weak", GANTRY, effort=1.0)
    with pytest.warns(SaturationWarning, match=r"asked for [\d.]+ N of its 1"):
        run = replace(pair((robot, robot)), saturate=True).simulate(dt=2e-3)
    assert {entry["unit"] for entry in run.info["saturation"]} == {"N"}
    assert {entry["unit"] for entry in run.info["limits"] if entry["kind"] == "torque"} == {"N"}
    assert run.unit("applied_torque") == "N"


def test_a_space_with_too_few_units_is_refused():
    class Short(CartesianSpace):
        units = ("m",)

    arm = load_robot("planar2r")
    members = [Member(arm.placed((i, 0, 0)), lambda t: None, q0=[0.1, 1.0]) for i in range(2)]  # type: ignore
    with pytest.raises(InputError):
        Cell(members, Coupling.pair(), Short("xy"))
