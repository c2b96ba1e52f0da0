"""Robots that start as fast as their paths: no error of velocity at t = 0, in every space and engine."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Circle,
    Coupling,
    Experiment,
    Gains,
    Hold,
    Member,
    SmoothTrajectory,
    experiments,
    load_robot,
)
from synctrl.analysis.advice import resting
from synctrl.analysis.advise import advise_run
from synctrl.analysis.metrics import metrics
from synctrl.cells import STARTER, CellFileError, read_cell, write_cell
from synctrl.cli.made import Planned
from synctrl.cli.run_tables import run_tables
from synctrl.errors import InputError
from synctrl.sweep import Grid, Sweep, initial_positions, load

READY = (
    "planar_four",
    "a460_pair",
    "panda_four",
    "mixed_four",
    "ur5_payload",
    "carry_planar",
    "mobile_robot",
)


def moving(cell: Cell) -> Cell:
    """The cell with robots that start as fast as their paths."""
    members = [replace(member, v0="path") for member in cell.members]
    return Cell(members, cell.coupling, cell.space, cell.name, cell.clocks)


def velocity_error(cell: Cell) -> np.ndarray:
    """e' of every robot at t = 0, (n, m)."""
    table = cell.reference_table(np.zeros(1))
    return cell.task.measure(np.stack((cell.q0, cell.v0)), table.desired[0]).e_dot


def circles(radius: float, speed: float, phase: float = 0.0, **start: object) -> Cell:
    robot = load_robot("planar2r")
    members = [
        Member(robot.placed((x, 0, 0)), Circle((x, 0.35), radius, speed, phase), **start) for x in (0.0, 1.0)
    ]
    return Cell(members, Coupling.pair(), CartesianSpace("xy"))


@pytest.mark.parametrize("name", READY)
def test_ready_cells_start_without_an_error_of_velocity(name):
    cell = moving(getattr(experiments, name)().cell)
    np.testing.assert_allclose(velocity_error(cell), 0, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.02, 0.1), st.floats(-6, 6), st.floats(-3, 3))
def test_circles_of_any_speed_start_without_an_error_of_velocity(radius, speed, phase):
    at_rest, cell = circles(radius, speed, phase), circles(radius, speed, phase, v0="path")
    np.testing.assert_allclose(velocity_error(cell), 0, atol=1e-9)
    np.testing.assert_allclose(
        np.linalg.norm(velocity_error(at_rest), axis=1), radius * abs(speed), atol=1e-9
    )


def test_a_robot_that_is_not_asked_to_stays_at_rest():
    members = circles(0.05, 2.0).members
    cell = Cell([replace(members[0], v0="path"), members[1]], Coupling.pair(), CartesianSpace("xy"))
    assert cell.v0[0].any() and not cell.v0[1].any()


def test_a_cell_that_knows_its_masses_stays_on_the_path_from_the_first_step():
    """With exact estimates no error comes up but that of inverse kinematics; at rest there is one at once."""
    gains, peaks = Gains(Lambda=5, beta=5, K_r=1, K_eps=1, Gamma=0), []
    for start in ({}, {"v0": "path"}):
        cell = circles(0.05, 2.0, **start)
        known = [replace(m, theta_hat0=theta) for m, theta in zip(cell.members, cell.theta, strict=True)]
        cell = Cell(known, cell.coupling, cell.space)
        result = Experiment(cell, gains, 0.5).simulate()
        peaks.append(float(np.abs(result.tracking_error).max()))
    assert peaks[1] < 1e-5 < 1e-3 < peaks[0]


def test_what_was_asked_for_is_kept_by_copies_and_files(tmp_path):
    cell = circles(0.05, 2.0, v0="path")
    again = pickle.loads(pickle.dumps(cell))
    assert again.members[0].v0 == "path"
    assert (again.v0 == cell.v0).all()
    experiment = Experiment(cell, Gains(Lambda=5, beta=5, K_r=1, K_eps=1, Gamma=0), 0.01)
    write_cell(experiment, tmp_path / "cell.toml")
    assert (tmp_path / "cell.toml").read_text().count('v0 = "path"') == 2
    assert (read_cell(tmp_path / "cell.toml").cell.v0 == cell.v0).all()


def test_other_words_are_refused():
    with refused(InputError, "robot 1, v0"):
        circles(0.05, 2.0, v0="fast")


def test_other_words_in_a_file_are_refused_with_their_line(tmp_path):
    file = tmp_path / "cell.toml"
    file.write_text(STARTER.replace('v0 = "path"', 'v0 = "fast"', 1))
    with pytest.raises(CellFileError, match='expected a list of numbers or "path"'):
        read_cell(file)


def test_a_robot_that_cannot_move_along_its_path_is_refused():
    """Stretched out, and the path goes on outwards: no joint velocities do that."""
    robot = load_robot("planar2r")
    out = robot.tip_position(np.zeros(2))[:2]
    members = [
        Member(robot, Circle(out - [0, 0.05], 0.05, 1.0, np.pi / 2), np.zeros(2), v0="path"),
        Member(robot, Hold(out)),
    ]
    with refused(InputError, "robot 1, v0"):
        Cell(members, Coupling.pair(), CartesianSpace("xy"))


def test_the_starter_needs_no_other_gains(tmp_path):
    """Nothing is found wanting, and robots that rest are told of when they do."""
    file = tmp_path / "cell.toml"
    file.write_text(STARTER)
    found = advise_run(read_cell(file))
    assert not found.changes
    assert "at rest where" not in str(found)
    file.write_text(STARTER.replace('v0 = "path"', "", 1))
    assert 'at rest where the path begins with a speed: left; v0 = "path"' in str(advise_run(read_cell(file)))


def test_clocks_move_no_robot():
    """Who is told of another time starts where its path begins, and as fast as it is there."""
    cell = circles(0.05, 2.0, v0="path")
    ahead = cell.with_clocks([0.0, 0.5])
    assert (ahead.q0 == cell.q0).all()
    assert (ahead.v0 == cell.v0).all()


def test_a_start_near_a_singularity_is_refused():
    robot = load_robot("planar2r")
    q0 = np.array([0.5, 1e-6])
    at = robot.tip_position(q0)[:2]
    members = [Member(robot, Circle(at - [0.05, 0], 0.05, 1.0), q0, v0="path"), Member(robot, Hold(at))]
    with refused(InputError, "robot 1, v0"):
        Cell(members, Coupling.pair(), CartesianSpace("xy"))


def test_runs_with_moved_starts_are_the_same_one_by_one_and_side_by_side(tmp_path):
    """What is added to q0 is added to q0 alone."""
    for package in ("casadi", "joblib", "pandas"):
        pytest.importorskip(package)
    gains = Gains(Lambda=5, beta=5, K_r=1, K_eps=1, Gamma=0.1)
    experiment = Experiment(circles(0.05, 2.0, v0="path"), gains, 0.05)
    factors = [initial_positions(Grid([0.1, 0.3]))]
    measured = []
    for engine in ("pinocchio", "compiled"):
        Sweep(experiment, factors, dt=1e-3, engine=engine).run(tmp_path / engine, workers=1)
        measured.append(np.array(load(tmp_path / engine)["tracking_rms"], float))
    assert np.ptp(measured[0]) > 1e-3
    np.testing.assert_allclose(measured[0], measured[1], rtol=1e-9)


@pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning")
def test_torque_beyond_a_limit_is_told_of_unless_it_was_cut_off():
    experiment = Experiment(circles(0.05, 2.0), Gains(Lambda=5, beta=5, K_r=600.0, K_eps=1, Gamma=0), 0.01)
    told = [
        run_tables(run, metrics(run))
        for run in (experiment.simulate(dt=1e-5), replace(experiment, saturate=True).simulate(dt=1e-5))
    ]
    assert ["more torque than there is" in " ".join(map(str, each)) for each in told] == [True, False]


@pytest.mark.parametrize(("said", "kept"), [({}, {}), ({"engine": "compiled"}, {"engine": "compiled"})])
def test_a_file_keeps_the_engine_that_it_names_and_no_other(said, kept):
    how = {"engine": "pinocchio", "duration": 1.0, "dt": 1e-4}
    assert Planned(None, how, said).kept == {"dt": 1e-4, **kept}


def test_a_path_that_begins_at_rest_is_not_told_of_for_rounding():
    robot = load_robot("planar2r")

    def place(t):
        return [0.1 - 0.05 * np.cos(np.pi * t / 3), 0.35]

    way = SmoothTrajectory(place, duration=6.0)
    cell = Cell([Member(robot, way), Member(robot, way)], Coupling.pair(), CartesianSpace("xy"))
    assert 0 < np.abs(way(0.0).x_dot).max() < 1e-9
    assert not resting(cell)
    assert resting(circles(0.05, 2.0)) == ["robot 1", "robot 2"]
