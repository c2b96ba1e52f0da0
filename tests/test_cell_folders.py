"""Files that a cell file names lie below its folder, and what no file can say is refused."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
import pytest
from refusals import refused
from test_xacro import XMLNS, needs_xacro

from synctrl import (
    Cell,
    Coupling,
    Experiment,
    FunctionTrajectory,
    Gains,
    Hold,
    Member,
    Robot,
    SmoothWeights,
    SynchronizationFunction,
    load_robot,
)
from synctrl.cells import STARTER, CellFileError, read_cell, read_cell_file, write_cell
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four
from synctrl.robots.urdf import urdf_folder
from synctrl.simulation.plant import Plant


def line_of(text: str) -> int:
    """The first line of the starter that begins with a text."""
    return next(k for k, line in enumerate(STARTER.splitlines(), 1) if line.startswith(text))


ROBOT, MOTION = line_of("robot ="), line_of("motion =")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a robot, inside of another one that has a robot too."""
    for where in (tmp_path / "inside", tmp_path):
        copytree(urdf_folder() / "planar2r", where / "arms")
    return tmp_path / "inside"


def cell_with(folder: Path, robot: str, text: str = STARTER) -> Path:
    """A starter file whose first robot comes from there."""
    path = folder / "cell.toml"
    path.write_text(text.replace('"planar2r"', f'"{robot}"', 1), "utf-8")
    return path


def test_a_robot_of_a_file_below_the_folder_is_read(folder: Path) -> None:
    experiment = read_cell(cell_with(folder, "arms/planar2r.urdf"))
    named = read_cell(cell_with(folder, "planar2r"))
    assert experiment.simulate(5e-3).q.tobytes() == named.simulate(5e-3).q.tobytes()


def test_it_is_written_with_its_path_from_there(folder: Path) -> None:
    experiment = read_cell(cell_with(folder, "arms/planar2r.urdf"))
    (folder / "deeper").mkdir()
    assert 'robot = "arms/planar2r.urdf"' in write_cell(experiment, folder / "new.toml").read_text("utf-8")
    with refused(CellFileError, "robots[0].robot"):
        write_cell(experiment, folder / "deeper" / "new.toml")


def outside(folder: Path) -> list[str]:
    """Names of files that are there, and lie outside, or lead there."""
    (folder / "link.urdf").symlink_to(folder.parent / "arms" / "planar2r.urdf")
    (folder / "linked").symlink_to(folder.parent / "arms", target_is_directory=True)
    return [
        "../arms/planar2r.urdf",
        "arms/../../arms/planar2r.urdf",
        str(folder / "arms" / "planar2r.urdf"),
        "link.urdf",
        "linked/planar2r.urdf",
        r"..\\arms\\planar2r.urdf",
        "C:/arms/planar2r.urdf",
    ]


@pytest.mark.parametrize("k", range(7))
def test_a_path_that_leaves_the_folder_is_refused(k: int, folder: Path) -> None:
    with refused(CellFileError, "robots[0].robot", line=ROBOT):
        read_cell(cell_with(folder, outside(folder)[k]))


def test_a_link_that_stays_below_is_followed(folder: Path) -> None:
    (folder / "link.urdf").symlink_to(folder / "arms" / "planar2r.urdf")
    read_cell(cell_with(folder, "link.urdf"))


@pytest.mark.parametrize("name", ["arms/none.urdf", "arms/plana2r.urdf", "none/", "arms/none.xacro"])
def test_a_file_that_is_not_there_is_refused(name: str, folder: Path) -> None:
    with refused(CellFileError, "robots[0].robot", line=ROBOT, found=name):
        read_cell(cell_with(folder, name))


def test_a_robot_that_is_refused_is_named_with_both_files(folder: Path) -> None:
    urdf = folder / "arms" / "planar2r.urdf"
    urdf.write_text(urdf.read_text("utf-8").replace("<mass value", "<mass valu", 1), "utf-8")
    with refused(CellFileError, "robots[0]", file=str(folder / "cell.toml")) as caught:
        read_cell(cell_with(folder, "arms/planar2r.urdf"))
    assert f"{urdf.name}:" in str(caught.value)


@needs_xacro
def test_a_xacro_file_takes_its_arguments_from_the_cell_file(folder: Path) -> None:
    urdf = (folder / "arms" / "planar2r.urdf").read_text("utf-8")
    inside = urdf.partition("<robot")[2].partition(">")[2]
    mass = re.search(r'<mass value="([^"]*)"', inside)
    assert mass is not None
    body = inside.replace(mass.group(0), '<mass value="$(arg mass)"')
    head = f'<?xml version="1.0"?>\n<robot name="arm" {XMLNS}><xacro:arg name="mass" default="1.0"/>'
    (folder / "arm.xacro").write_text(head + body, "utf-8")
    path = cell_with(
        folder, "arm.xacro", STARTER.replace("known = 0.7", "known = 0.7\nxacro = { mass = 2.5 }", 1)
    )
    heavy, plain = read_cell(path).cell.robots[0], load_robot("planar2r")
    changed = np.flatnonzero(heavy.inertial_parameters != plain.inertial_parameters)
    assert heavy.inertial_parameters[0] == 2.5
    assert changed[0] == 0
    again = read_cell(write_cell(read_cell(path), folder / "again.toml")).cell.robots[0]
    assert again.inertial_parameters.tobytes() == heavy.inertial_parameters.tobytes()


@pytest.mark.parametrize("name", ["../arms/planar2r.urdf", "linked/planar2r.urdf"])
def test_samples_and_packages_stay_below_too(name: str, folder: Path) -> None:
    outside(folder)
    path = cell_with(folder, "planar2r")
    text = path.read_text("utf-8")
    motion = text.replace(
        'kind = "circle", center = [-0.15, 0.35], radius = 0.08', f'kind = "samples", file = "{name}"'
    )
    path.write_text(motion.replace(', speed = "90 deg" }', " }", 1), "utf-8")
    with refused(CellFileError, "robots[0].motion.file"):
        read_cell(path)
    path.write_text(text.replace("known = 0.7", f'known = 0.7\npackages = ["{name}"]', 1), "utf-8")
    with refused(CellFileError, "robots[0].packages[0]"):
        read_cell(path)


@pytest.mark.parametrize("head", ["", "\ufeff", "t,x,y\n", "\ufefft,x,y\n"])
def test_samples_are_a_motion_through_all_of_them(head: str, folder: Path) -> None:
    t = np.linspace(0.0, 4.0, 41)
    points = np.column_stack((-0.15 + 0.08 * np.cos(t), 0.35 + 0.08 * np.sin(t)))
    rows = [",".join(map(repr, row)) for row in np.column_stack((t, points)).tolist()]
    (folder / "way.csv").write_text(head + "\n".join(rows) + "\n\n", "utf-8")
    path = cell_with(folder, "planar2r")
    text = path.read_text("utf-8").replace(
        '{ kind = "circle", center = [-0.15, 0.35], radius = 0.08, speed = "90 deg" }',
        '{ kind = "samples", file = "way.csv" }',
    )
    path.write_text(text, "utf-8")
    motion = read_cell(path).cell.members[0].trajectory
    assert np.abs(motion(t).x - points).max() < 1e-12
    assert np.abs(motion(t).x_dot - 0.08 * np.column_stack((-np.sin(t), np.cos(t)))).max() < 1e-5
    again = read_cell(write_cell(read_cell(path), folder / "again.toml")).cell.members[0].trajectory
    assert again(t).x_ddot.tobytes() == motion(t).x_ddot.tobytes()


@pytest.mark.parametrize(
    "text",
    ["", "0,1,2\n1,2", "t,x\n0,a\n", "0,O,0\n1,1,1\n2,2,2\n", "0,1\n0,1\n", "0;1\n", "0\n1\n", b"\xff\xfe"],
)
def test_samples_that_are_none_are_refused(text: str | bytes, folder: Path) -> None:
    (folder / "way.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    path = cell_with(folder, "planar2r")
    path.write_text(
        path.read_text("utf-8").replace(
            'kind = "circle", center = [-0.15, 0.35], radius = 0.08, speed = "90 deg"',
            'kind = "samples", file = "way.csv"',
        ),
        "utf-8",
    )
    with refused(CellFileError, line=MOTION):
        read_cell(path)


# -- files that are none -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "content", ["a = ", "a = 1\na = 2", "[[a]\n", 'x = "\n', "[" * 5000, "a = " + "1" * 5000, b"\xff"]
)
def test_a_file_that_is_no_toml_is_refused_with_its_line(content: str | bytes, tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with refused(CellFileError, None, file=str(path)) as caught:
        read_cell(path)
    assert caught.value.line >= 1


def test_no_file_is_refused(tmp_path: Path) -> None:
    with refused(CellFileError, None, file=str(tmp_path / "none.toml"), line=None):
        Experiment.from_file(tmp_path / "none.toml")
    with refused(CellFileError, None, file=str(tmp_path)):
        read_cell(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with refused(CellFileError, None, file=str(tmp_path / "pipe")):
        read_cell(tmp_path / "pipe")


def test_all_that_is_wrong_is_said_at_once(tmp_path: Path) -> None:
    text = STARTER.replace("duration = 6.0", "duratoin = 4.0").replace("Gamma = 2.0", 'Gamma = "2"')
    (tmp_path / "cell.toml").write_text(text, "utf-8")
    with refused(CellFileError, "duratoin", line=line_of("duration")) as caught:
        read_cell(tmp_path / "cell.toml")
    (other,) = caught.value.others
    assert (other.subject, other.found) == ("gains.Gamma", "2")
    assert str(other) in str(caught.value)


def test_motions_that_go_round_in_circles_are_refused(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(
        STARTER + '[motions.a]\nkind = "attached"\nbody = "b"\n[motions]\nb = "a"\n', "utf-8"
    )
    text = (tmp_path / "cell.toml").read_text("utf-8")
    circle = '{ kind = "circle", center = [0.15, 0.35], radius = 0.08, speed = "90 deg" }'
    (tmp_path / "cell.toml").write_text(text.replace(circle, '"a"'), "utf-8")
    with refused(CellFileError, "motions.b"):
        read_cell(tmp_path / "cell.toml")


def test_how_it_is_run_is_read_and_written(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(STARTER + '[run]\ndt = 5e-4\nengine = "compiled"\n', "utf-8")
    found = read_cell_file(tmp_path / "cell.toml")
    assert found.run == {"dt": 5e-4, "engine": "compiled"}
    written = write_cell(found.experiment, tmp_path / "again.toml", run=found.run)
    assert read_cell_file(written).run == found.run


@pytest.mark.parametrize("run", [{"foo": 1}, {"dt": "x"}, {"engine": "mujoco"}, {"duration": 1.0}])
def test_a_way_to_run_that_could_not_be_read_is_not_written(run: dict, tmp_path: Path) -> None:
    with refused(CellFileError, f"run.{next(iter(run))}"):
        write_cell(planar_four(), tmp_path / "cell.toml", run=run)
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("path", [None, 3, "a\0b"])
def test_what_is_no_path_is_refused(path) -> None:
    for use in (read_cell, lambda path: write_cell(planar_four(), path)):
        with refused(InputError):
            use(path)


# -- what no file can say ----------------------------------------------------------------------------------


def own_motion() -> Experiment:
    made = planar_four()
    fixed = made.cell.members[0].trajectory(0.0).x
    zero = np.zeros(2)
    own = FunctionTrajectory(lambda t: fixed, lambda t: zero, lambda t: zero)
    return with_member(made, replace(made.cell.members[0], trajectory=own))


def with_member(made: Experiment, member: Member) -> Experiment:
    cell = made.cell
    return replace(made, cell=Cell([member, *cell.members[1:]], cell.coupling, cell.space, cell.name))


def own_robot() -> Experiment:
    made = a460_pair()
    robot = made.cell.robots[0]
    return with_member(made, replace(made.cell.members[0], robot=Robot(robot.model, robot.tip)))


def own_weights() -> Experiment:
    made = a460_pair()
    weights = SmoothWeights.from_function(lambda t: np.array([1.0, -1.0 - 0.1 * np.sin(t)]), 4.0, 3)
    cell = Cell(made.cell.members, Coupling.pair(weights), made.cell.space)
    return replace(made, cell=cell)


def own_task() -> Experiment:
    members = [Member(load_robot("planar2r").placed((i, 0, 0)), Hold((0.1, 0.2))) for i in range(2)]
    task = SynchronizationFunction(lambda x_1, x_2, t: (1 + 0.1 * np.sin(t)) * (x_1 - x_2), 2, 2)
    coupling = task.coupling([member.trajectory for member in members], 1.0)
    return Experiment(Cell(members, coupling), Gains(1.0, 1.0, 1.0, 1.0, 1.0), 1.0)


class OwnPlant(Plant):
    pass


class OwnHold(Hold):
    pass


def own_kind() -> Experiment:
    made = a460_pair()
    return with_member(made, replace(made.cell.members[0], trajectory=OwnHold(made.cell.q0[0])))


OWN: list[tuple[Callable[[], Any], str, Any]] = [
    (own_motion, "robots[0].motion", "FunctionTrajectory"),
    (own_kind, "robots[0].motion", "OwnHold"),
    (own_robot, "robots[0].robot", "A460_planar"),
    (own_weights, "coupling", "SmoothWeights"),
    (own_task, "coupling", "SmoothWeights"),
    (lambda: replace(a460_pair(), plant_type=OwnPlant), "plant", "OwnPlant"),
]


@pytest.mark.parametrize(("make", "key", "found"), OWN, ids=[str(k) for k in range(len(OWN))])
def test_what_is_ones_own_is_refused_by_its_name(make, key, found, tmp_path):
    with refused(CellFileError, key) as caught:
        make().to_file(tmp_path / "cell.toml")
    assert found == caught.value.found or key == "robots[0].robot"
    assert not (tmp_path / "cell.toml").exists()
