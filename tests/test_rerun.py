"""Recordings for Rerun: numbers and scenes, as Rerun's own reader finds them."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from exported import arrays, has, made
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from scipy.spatial.transform import Rotation

from synctrl.errors import InputError, MissingDependencyError, ResultError
from synctrl.export.bodies import Shape, as_triangles
from synctrl.robots.written import read_robot

pytest.importorskip("rerun", reason="belongs to an extra of its own")
from rerun.chunk import RrdReader

#: pictures per second, so that short runs have some
FPS = 250.0


def chunks(path: Path) -> Iterator[tuple[str, bool, dict[str, list]]]:
    """Path, whether it is for all times, and columns of all that is in a file."""
    for chunk in RrdReader(path).stream():
        yield chunk.entity_path.replace("\\", ""), chunk.is_static, chunk.to_record_batch().to_pydict()


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Recordings of runs by name, each written and read once: changing columns and constant ones by path."""
    kept: dict[str, tuple[dict, dict]] = {}

    def read(name: str) -> tuple[dict, dict]:
        if name not in kept:
            path = made(name).to_rerun(tmp_path_factory.mktemp("rerun") / "run.rrd", fps=FPS)
            found: tuple[dict, dict] = {}, {}
            for entity, static, columns in chunks(path):
                for column, values in columns.items():
                    found[static].setdefault(entity, {}).setdefault(column, []).extend(values)
            kept[name] = found
        return kept[name]

    return read


def seconds(column: list) -> list[float]:
    return [each.total_seconds() for each in column]


@pytest.mark.parametrize("name", ["sliding", "network", "carried", "stopped", "single"])
def test_every_number_of_every_instant_is_there_under_its_name(recording, name):
    run, (changing, constant) = made(name), recording(name)
    for quantity, array in arrays(run).items():
        paths = [path for path in constant if path.split("/")[1] == quantity]
        assert sum(len(constant[path]["SeriesLines:names"][0]) for path in paths) == has(run, quantity).sum()
        columns = []
        for path in sorted(paths, key=[*changing].index):
            np.testing.assert_allclose(seconds(changing[path]["time"]), run.t, atol=1e-9)
            columns.append(np.array(changing[path]["Scalars:scalars"]))
        np.testing.assert_array_equal(np.hstack(columns), array[:, has(run, quantity)])
    assert json.loads(constant["/info"]["TextDocument:text"][0][0]) == dict(run.info)


def test_curves_are_called_by_robot_joint_and_unit(recording):
    first, second = made("sliding").names
    constant = recording("sliding")[True]
    assert constant[f"/tau/{first}"]["SeriesLines:names"][0][0] == f"{first}, rail [N]"
    assert constant[f"/tau/{second}"]["SeriesLines:names"][0][2] == f"{second}, lift [N]"


@pytest.mark.parametrize("name", ["sliding", "carried", "network"])
def test_links_are_where_forward_kinematics_has_them(recording, name):
    run, changing = made(name), recording(name)[False]
    times, seen = np.round(run.t, 9).tolist(), 0
    for i, about in enumerate(run.info["robots"]):
        robot = read_robot(about, about["name"], about["joints"])
        data = robot.model.createData()
        for joint, joint_name in enumerate(robot.model.names):
            path = f"/scene/{about['name']}/{joint_name}"
            if path not in changing:
                continue
            poses = (changing[path][f"Transform3D:{part}"] for part in ("translation", "quaternion"))
            for at, (place,), (turned,) in zip(seconds(changing[path]["time"]), *poses, strict=True):
                row = run.q[times.index(round(at, 9)), i, : robot.nv]
                pin.forwardKinematics(robot.model, data, robot.configuration(row))
                np.testing.assert_allclose(place, data.oMi[joint].translation, atol=1e-6)
                R = Rotation.from_quat(turned).as_matrix()
                np.testing.assert_allclose(R, data.oMi[joint].rotation, atol=1e-6)
                seen += 1
    assert seen > 2 * len(run.names)


def test_bars_change_in_every_picture_and_shapes_of_robots_in_none(recording):
    changing, constant = recording("network")
    pictures = len(changing["/scene/robot 1/joint1"]["time"])
    assert pictures > 2
    bars = [path for path in changing if path.startswith("/scene/segment") and "shape" in path]
    assert bars and all(len(changing[path]["Cylinders3D:radii"]) == pictures for path in bars)
    assert any(path.startswith("/scene/robot 1/joint1/shape") for path in constant)
    assert not any(path.startswith("/scene/robot 1/joint1/shape") for path in changing)


def test_pieces_of_a_line_come_one_after_another_and_stay(recording):
    changing = recording("bead")[False]
    times = [seconds(columns["time"]) for path, columns in changing.items() if "trail bead 1/" in path]
    assert len(times) > 2 and all(len(each) == 1 for each in times)
    assert len({each[0] for each in times}) == len(times)


sizes = st.floats(0.01, 2)


@given(sizes, sizes, sizes, st.floats(0, 1.5), st.tuples(*[st.floats(-3, 3)] * 6))
def test_cylinders_and_cones_as_triangles_have_their_volume_and_look_outwards(x, y, z, top, pose):
    turn = Rotation.from_rotvec(pose[:3]).as_matrix()
    size = np.array([x, y, z])
    shape = Shape("cylinder", np.ones(4), np.array(pose[3:]), turn, size, top)
    vertices, faces, normals = as_triangles(shape)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    expected = np.pi * x * y / 4 * z * (1 + top + top**2) / 3
    np.testing.assert_allclose(mesh.volume, expected, rtol=0.03)
    own = (vertices - pose[3:]) @ turn / size  # in the axes of the shape, one unit long
    np.testing.assert_allclose([own[:, 2].min(), own[:, 2].max()], [-0.5, 0.5], atol=1e-6)
    looking = normals @ turn
    there = np.linalg.norm(looking, axis=1) > 0.5
    assert (np.einsum("ij,ij->i", own[:, :2], looking[:, :2])[there] > -1e-3).all()


def test_a_file_is_whole_or_not_there(tmp_path, monkeypatch):
    path = made("network").to_rerun(tmp_path / "deep" / "run.rrd")
    before = path.read_bytes()
    assert [each.name for each in path.parent.iterdir()] == ["run.rrd"]

    def full(descriptor):
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with refused(ResultError, file=str(path), found="no space left on device"):
        made("stopped").to_rerun(path)
    assert path.read_bytes() == before and [each.name for each in path.parent.iterdir()] == ["run.rrd"]


def test_a_run_without_instants_and_frames_that_cannot_be(tmp_path):
    path = made("empty").to_rerun(tmp_path / "run.rrd")
    assert not any(columns["time"] for _, static, columns in chunks(path) if not static)
    with refused(InputError, "fps"):
        made("network").to_rerun(path, fps=0.0)
    with refused(InputError, "path"):
        made("network").to_rerun(None)


def test_what_is_missing_is_said_with_its_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with refused(MissingDependencyError, found="rerun") as caught:
        made("network").to_rerun(tmp_path / "run.rrd")
    assert "synctrl[rerun]" in str(caught.value)
