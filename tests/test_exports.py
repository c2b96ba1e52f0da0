"""Results in other tools: each format, read by the library whose it is, has the numbers, names and units."""

from __future__ import annotations

import csv
import errno
import json
import os
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray
from exported import RUNS, arrays, axes_of, has, made
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from refusals import refused
from scipy.io import loadmat

from synctrl import Coupling, Result
from synctrl.control.network.links import Links
from synctrl.errors import InputError, MissingDependencyError, ResultError
from synctrl.export.identifiers import identifiers
from synctrl.export.names import ARRAYS, shared_names
from synctrl.export.quantities import quantities
from synctrl.simulation.result import LAYOUT

NOTATION = (Path(__file__).parents[1] / "docs" / "notation.md").read_text("utf-8")
SMALL = ["mixed", "carried", "network", "sliding", "stopped", "empty"]


@pytest.fixture(params=[*RUNS])
def run(request) -> Result:
    return made(request.param)


@pytest.fixture(params=SMALL)
def some(request) -> Result:
    return made(request.param)


# -- what is what ----------------------------------------------------------------------------------------


def test_equation_numbers_are_those_of_the_notation():
    rows = re.findall(r"^\|.*`result\.(\w+)`.*\| ([^|]*) \|$", NOTATION, flags=re.MULTILINE)
    assert dict(rows) == {name: equations for name, (_, equations) in ARRAYS.items() if equations}
    assert ARRAYS.keys() == LAYOUT.keys()


def test_every_number_has_its_name_and_its_unit_and_what_a_robot_does_not_have_is_left_out(run):
    found = quantities(run)
    assert [each.name for each in found] == [*arrays(run)]
    for each in found:
        assert len(each.entries) == has(run, each.name).sum()
        np.testing.assert_array_equal(each.flat(), run_values(run, each.name))
        units = dict.fromkeys(entry.unit for entry in each.entries)
        if axes_of(run, each.name) == ("robot", "joint"):
            assert [*units] == run.unit(each.name).split(", ")


def run_values(run: Result, name: str) -> np.ndarray:
    return arrays(run)[name][:, has(run, name)]


def test_joints_that_slide_are_in_other_units_than_joints_that_turn():
    entries = {each.name: each.entries for each in quantities(made("sliding"))}
    units = {(entry.row, entry.column): entry.unit for entry in entries["tau"]}
    names = made("sliding").names
    assert units[names[0], "rail"] == "N" and units[names[1], "shoulder"] == "N·m"
    assert units[names[1], "lift"] == "N"


def test_poses_and_wrenches_say_the_unit_of_each_of_their_numbers():
    entries = {each.name: each.entries for each in quantities(made("carried"))}
    assert [(e.row, e.unit) for e in entries["object_pose"]] == [
        *zip("xyz", "mmm", strict=True),
        *((name, "1") for name in ("qx", "qy", "qz", "qw")),
    ]
    wrench = entries["hand_wrench"]
    assert [entry.unit for entry in wrench[:6]] == ["N", "N", "N", "N·m", "N·m", "N·m"]
    hands = [made("carried").names[grasp["robot"]] for grasp in made("carried").info["grasps"]]
    assert [*dict.fromkeys(entry.row for entry in wrench)] == hands


@pytest.mark.parametrize(
    "coupling", [Coupling.ring(4), Coupling.sum(4), Coupling.complete(4), Coupling.star(4, leader=2)]
)
def test_links_are_called_by_who_hears_whom(coupling):
    run = made("network")
    info = {**run.info, "pairs": coupling.edges.tolist(), "signs": coupling.signs.tolist()}
    links = Links(coupling)
    expected = [
        f"{run.names[i]} hears {run.names[j]}" for i, j in zip(links.hearer, links.sender, strict=True)
    ]
    assert shared_names(replace_info(run, info), "link", links.count) == expected


def replace_info(run: Result, info: dict) -> Result:
    return replace(run, info=info)


@given(st.lists(st.text(max_size=80), max_size=12), st.integers(10, 63))
def test_identifiers_are_such_and_no_two_are_alike(names, longest):
    found = identifiers(names, longest)
    assert len(found) == len(names) == len({name.lower() for name in found})
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) and len(name) <= longest for name in found)


def test_names_that_are_identifiers_stay_as_they_are():
    assert identifiers(["tau", "x_desired", "Tau", "robot 1"]) == ["tau", "x_desired", "Tau_2", "robot_1"]


# -- xarray and netCDF -----------------------------------------------------------------------------------


def test_a_dataset_has_every_number_and_nan_where_a_robot_has_no_joint(run):
    dataset = run.to_xarray()
    np.testing.assert_array_equal(dataset["time"], run.t)
    for name, array in arrays(run).items():
        variable = dataset[name]
        assert variable.dims[0] == "time" and variable.dtype == array.dtype
        there = has(run, name)
        np.testing.assert_array_equal(variable.values[:, there], array[:, there])
        assert np.isnan(variable.values[:, ~there]).all()
        assert variable.attrs["units"] == (run.unit(name) or "1") and variable.attrs["long_name"]
        assert variable.attrs.get("equation", "") == (ARRAYS[name][1] if name in ARRAYS else "")
    assert json.loads(dataset.attrs["info"]) == dict(run.info)
    assert (dataset.attrs["title"], dataset.attrs["status"]) == (run.info["title"], run.status)


def test_numbers_of_a_dataset_are_found_by_the_names_of_robots_joints_and_coordinates():
    run = made("mixed")
    dataset = run.to_xarray()
    np.testing.assert_array_equal(
        dataset.tracking_error.sel(robot="Panda", axis="y"), run.tracking_error[:, 2, 1]
    )
    joint = [*dataset.joint_name.sel(robot="xArm7").values].index("joint5")
    np.testing.assert_array_equal(dataset.tau.sel(robot="xArm7").isel(joint=joint), run.tau[:, 3, 4])
    assert [*dataset.joint_name.sel(robot="UR5").values][-1] == ""
    np.testing.assert_array_equal(
        dataset.sync_error.sel(pair="UR10, Panda", axis="x"), run.sync_error[:, 1, 0]
    )
    for i, robot in enumerate(run.info["robots"]):
        np.testing.assert_array_equal(dataset.theta[i, : len(robot["theta"])], robot["theta"])
        limits = dataset.torque_limit[i, : len(robot["joints"])]
        np.testing.assert_array_equal(limits, np.array(robot["torque_limits"], dtype=float))


def test_joints_that_all_robots_call_the_same_are_a_coordinate():
    run = made("carried")
    found = run.to_xarray().tau.sel(robot=run.names[2], joint="joint2")
    np.testing.assert_array_equal(found, run.tau[:, 2, 1])


def test_what_is_computed_with_a_dataset_is_computed_with_the_run(run):
    mean = (run.to_xarray().tau.astype(float) ** 2).mean()  # without joints that are not there
    np.testing.assert_allclose(mean, np.mean(run_values(run, "tau") ** 2.0) if len(run.t) else np.nan, 1e-6)


def test_a_netcdf_file_gives_the_dataset_back(run, tmp_path):
    dataset = run.to_xarray()
    with xarray.open_dataset(run.to_netcdf(tmp_path / "run.nc"), engine="h5netcdf") as file:
        found = file.load()
    assert json.loads(found["info"].item()) == json.loads(dataset.attrs.pop("info")) == dict(run.info)
    xarray.testing.assert_identical(found.drop_vars("info"), dataset)


# -- tables ----------------------------------------------------------------------------------------------


def test_a_table_has_a_column_for_every_number_that_there_is(run):
    table = run.to_pandas()
    np.testing.assert_array_equal(table.index, run.t)
    for name in arrays(run):
        column = table[name].to_numpy().reshape(len(run.t), has(run, name).sum())
        np.testing.assert_array_equal(column, run_values(run, name))
        assert table.attrs["units"][name] == (run.unit(name) or "1")
    assert len(table.columns) == sum(has(run, name).sum() for name in arrays(run))
    assert table.attrs["status"] == run.status


def test_columns_of_a_table_are_found_by_name():
    run = made("mixed")
    table = run.to_pandas()
    np.testing.assert_array_equal(table["q", "Panda", "panda_joint6"], run.q[:, 2, 5])
    assert [*table["tau"]["UR5"].columns] == run.info["robots"][0]["joints"]
    assert table.attrs["equations"]["sync_error"] == "(7), (28)"


def test_a_csv_file_has_the_same_columns_with_units_and_every_digit(run, tmp_path):
    with open(run.to_csv(tmp_path / "run.csv"), encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert len(set(head)) == len(head) and head[0] == "time [s]"
    numbers = np.array([[float(field or "nan") for field in row] for row in rows]).reshape(-1, len(head))
    expected = [run_values(run, name) for name in arrays(run)]
    np.testing.assert_array_equal(numbers, np.hstack([run.t[:, None], *expected]))
    names = [name.partition("/")[0].partition(" [")[0] for name in head[1:]]
    assert [*dict.fromkeys(names)] == [*arrays(run)]


def test_columns_of_a_csv_file_say_robot_joint_and_unit(tmp_path):
    head = made("sliding").to_csv(tmp_path / "run.csv").read_text("utf-8").partition("\n")[0].split(",")
    first, second = made("sliding").names
    assert {f"tau/{first}/rail [N]", f"tau/{second}/shoulder [N·m]", f"q/{second}/lift [m]"} <= {*head}


def test_what_has_no_value_is_an_empty_field(tmp_path):
    run = made("network")
    age = np.array(run.outputs["message_age"])
    age[1, 0] = np.nan
    gap = replace(run, outputs={**run.outputs, "message_age": age})
    lines = gap.to_csv(tmp_path / "run.csv").read_text("utf-8").splitlines()
    assert "nan" not in lines[2] and lines[2].count(",,") == 1 and ",," not in lines[1]


# -- MATLAB ----------------------------------------------------------------------------------------------


def test_a_mat_file_has_every_array_and_says_what_it_is(run, tmp_path):
    found = loadmat(run.to_mat(tmp_path / "run.mat"))
    assert found["t"].shape == (len(run.t), 1) or not len(run.t)
    for name, array in arrays(run).items():
        there, values = has(run, name), found[name].reshape(array.shape)
        np.testing.assert_array_equal(values[:, there], array[:, there])
        assert np.isnan(values[:, ~there]).all()
    plain = loadmat(tmp_path / "run.mat", simplify_cells=True)
    assert json.loads(plain["info"]) == dict(run.info)
    for name, each in plain["quantities"].items():
        assert each["units"] == (run.unit(name) or "1") and each["long_name"]
        assert [*np.atleast_1d(each["dimensions"])] == ["time", *axes_of(run, name)]
    assert plain["quantities"]["tau"]["equation"] == "(8), (13)"
    for robot, about in zip(plain["robots"], run.info["robots"], strict=True):
        assert robot["name"] == about["name"] and [*np.atleast_1d(robot["joints"])] == about["joints"]
        np.testing.assert_array_equal(robot["theta"], about["theta"])


def test_names_in_a_mat_file_are_those_of_robots_and_pairs(tmp_path):
    found = loadmat(made("mixed").to_mat(tmp_path / "run.mat"), simplify_cells=True)
    assert [*found["axes"]] == ["x", "y", "z"] and found["pairs"][0] == "UR5, UR10"
    assert [*found["robots"][3]["joint_units"]] == 7 * ["rad"]


# -- whatever is in it -----------------------------------------------------------------------------------

words = st.sampled_from(["tau", "robot", "time", "theta", "info", "tf", "scene", "grasp", "φ", "x_2"])
axis = st.sampled_from(["robot", "axis", "joint", "grasp", "coordinate", "a b", "tau", "theta", "time"])


@st.composite
def with_outputs(draw) -> Result:
    """The run of the network with outputs that nobody expects."""
    run = made("network")
    lengths = {**run.info["sizes"], "time": len(run.t)}
    outputs, about = {}, {}
    for name in draw(st.lists(words, unique=True, max_size=4)):
        axes = ["time", *draw(st.lists(axis, max_size=3))]
        shape = [lengths[a] if a in lengths else draw(st.integers(0, 7)) for a in axes]
        outputs[name] = np.arange(float(np.prod(shape))).reshape(shape)
        about[name] = {"unit": draw(st.sampled_from(["", "m", "N, N·m"])), "axes": axes}
    robots = [dict(robot) for robot in run.info["robots"]]
    robots[0]["name"] = draw(st.sampled_from(["a/b", 'a "b", c', "√", " "]))
    info = {**run.info, "outputs": about, "robots": robots}
    return Result(**{name: getattr(run, name) for name in LAYOUT}, info=info, outputs=outputs)


@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(with_outputs())
def test_any_outputs_and_names_come_across(tmp_path, run):
    found = quantities(run)
    names = {each.name for each in found}
    assert len(names) == len(found) == len(LAYOUT) - 1 + len(run.outputs)
    with xarray.open_dataset(run.to_netcdf(tmp_path / "run.nc"), engine="h5netcdf") as file:
        for each in found:
            np.testing.assert_array_equal(file[each.name].values, each.values)
        assert file["robot"].values[0] == run.names[0]
    read = loadmat(run.to_mat(tmp_path / "run.mat"))
    for name, each in zip(identifiers(each.name for each in found), found, strict=True):
        np.testing.assert_array_equal(read[name].ravel(), each.values.ravel())
    with open(run.to_csv(tmp_path / "run.csv"), encoding="utf-8", newline="") as file:
        width = 1 + sum(len(each.entries) for each in found)
        assert {len(row) for row in csv.reader(file)} == {width}
    assert run.to_pandas().shape == (len(run.t), width - 1)


# -- files are whole, and what is missing is said --------------------------------------------------------

WRITERS = {"to_csv": "csv", "to_mat": "mat", "to_netcdf": "nc", "to_mcap": "mcap"}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("method", WRITERS)
def test_a_file_appears_in_a_folder_that_is_made_for_it_and_nothing_else_does(method, tmp_path):
    path = tmp_path / "a" / "b" / f"run.{WRITERS[method]}"
    assert getattr(made("network"), method)(str(path)) == path
    layout = {"run.layout.json"} if method == "to_mcap" else set()
    assert contents(path.parent).keys() == {path.name} | layout


@pytest.mark.parametrize("method", WRITERS)
def test_a_disk_that_fails_leaves_the_former_file_whole(method, tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(errno.ENOSPC, "no space left on device")

    write = getattr(made("network"), method)
    path = write(tmp_path / f"run.{WRITERS[method]}")
    before = contents(tmp_path)
    monkeypatch.setattr(os, "fsync", full)
    with refused(ResultError, file=str(path), found="no space left on device"):
        write(path)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("method", WRITERS)
@pytest.mark.parametrize("kind", [KeyboardInterrupt, MemoryError])
def test_an_interrupt_before_all_is_done_leaves_the_former_file_whole(method, kind, tmp_path, monkeypatch):
    write = getattr(made("network"), method)
    path = write(tmp_path / f"run.{WRITERS[method]}")
    before = contents(tmp_path)

    def interrupted(self, target):
        assert self.stat().st_size  # all is written, under another name
        raise kind

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(kind):
        write(path)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("method", WRITERS)
def test_what_is_no_path_of_a_file_is_refused(method, tmp_path):
    write = getattr(made("network"), method)
    with refused(ResultError, file=str(tmp_path)):
        write(tmp_path)
    (tmp_path / "file").write_text("in the way")
    with refused(ResultError):
        write(tmp_path / "file" / "run")
    with refused(InputError, "path"):
        write(3)
    assert contents(tmp_path) == {"file": b"in the way"}


@pytest.mark.parametrize(
    ("method", "module", "package"),
    [
        ("to_xarray", "xarray", "xarray"),
        ("to_pandas", "pandas", "pandas"),
        ("to_netcdf", "h5netcdf", "h5netcdf"),
        ("to_netcdf", "h5py", "h5py"),
        ("to_mcap", "mcap.writer", "mcap"),
        ("to_mcap", "mcap_protobuf.schema", "mcap_protobuf"),
        ("to_mcap", "foxglove_schemas_protobuf.JointStates_pb2", "foxglove_schemas_protobuf"),
    ],
)
def test_a_package_that_is_not_installed_is_named_with_the_extra_that_brings_it(
    method, module, package, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, module, None)
    arguments = [] if method in ("to_xarray", "to_pandas") else [tmp_path / "run"]
    with refused(MissingDependencyError, found=package) as caught:
        getattr(made("network"), method)(*arguments)
    assert "synctrl[data]" in str(caught.value) and not contents(tmp_path)
