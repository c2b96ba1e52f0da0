"""Tasks of assembly on the page: every run has its row, and verdicts follow from runs and not from hopes."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np
import pytest
from browser import open_page
from refusals import refused

from synctrl import Result
from synctrl.assembly.body import place_of
from synctrl.errors import InputError
from synctrl.experiments import bead_on_edge, bead_on_path, carry_ur5
from synctrl.experiments.carry import GEOMETRIC_ERROR
from synctrl.paper.carry_task import CARRY, integral_curves
from synctrl.paper.claims import Claim
from synctrl.paper.claims_of_carrying import along_error, force, pull, whole_millimetre
from synctrl.paper.edge_task import EDGE
from synctrl.paper.path_task import PATH, gap_there
from synctrl.paper.report import Section, SideBySide, Table, Verdicts, number, write_page
from synctrl.paper.tasks import Task, planned_runs, root_mean_square, runs_of, since_push, task_section


@pytest.fixture(scope="module")
def run() -> Result:
    return carry_ur5(geometric_error=True).simulate(0.02)


def pulling(run: Result, newtons: float, turning: float = 0.0) -> Result:
    """The run with an internal force that pulls along the geometric error, and a moment about it, N·m."""
    _, R = place_of(run.outputs["object_pose"])
    along = R @ (GEOMETRIC_ERROR[:3] / np.linalg.norm(GEOMETRIC_ERROR[:3]))
    inside = 0 * run.outputs["internal_force"]
    inside[:, 0, :3], inside[:, 1, :3] = -newtons * along, newtons * along
    inside[:, 0, 3:], inside[:, 1, 3:] = -turning * along, turning * along
    return replace(run, outputs={**run.outputs, "internal_force": inside})


#: force in N and moment in N·m of runs of which all claims but one hold
SEEN = {
    "exact_alone": (5.0,),
    "exact": (2.0,),
    "alone": (7.0, 4.0),
    "leak": (8.0,),
    "yielding": (6.0, 1.0),
    "whole": (2.0,),
    "rough_alone": (9.0,),
    "rough_paper": (50.0,),
    "rough_yielding": (6.0,),
    "rough_whole": (2.9,),
}
HOLD = [True, True, True, False, True, True, True, True]


def forces(run: Result) -> dict[str, Result]:
    return {name: pulling(run, *SEEN.get(name, (whole_millimetre(run),))) for name in CARRY.planned}


@pytest.mark.parametrize(
    ("name", "seen", "others"),
    [
        ("exact", (6.0,), {0}),
        ("paper", (45.0,), {1}),
        ("paper", (15.0,), {1, 2}),
        ("alone", (45.0, 4.0), {1, 3}),
        ("alone", (5.5, 4.0), {4, 5}),
        ("leak", (45.0,), {2}),
        ("yielding", (6.0, 3.0), {4}),
        ("whole", (3.0,), {5}),
        ("rough_alone", (6.5,), {6}),
        ("rough_whole", (4.0,), {6, 7}),
        ("rough_yielding", (5.0,), {7}),
        ("rough_paper", (1.0,), set()),
    ],
)
def test_verdicts_are_those_of_the_runs(run, name, seen, others):
    runs = forces(run)
    assert [claim.holds for claim in CARRY.claims(runs)] == HOLD
    changed = CARRY.claims({**runs, name: pulling(run, *seen)})
    assert {k for k, claim in enumerate(changed) if claim.holds != HOLD[k]} == others


@pytest.fixture(scope="module")
def edge() -> Result:
    return bead_on_edge().simulate(0.02, dt=4e-3)


@pytest.fixture(scope="module")
def path() -> Result:
    return bead_on_path().simulate(0.02, dt=4e-3)


def missing(edge: Result, bead: float, nozzle: float = 0.0) -> Result:
    """The run with a bead and a nozzle that are off by so much, m."""
    error = 0 * edge.tracking_error
    error[:, 1, 1] = nozzle
    outputs = {**edge.outputs, "bead_error": np.full((len(edge.t), 3), bead) / np.sqrt(3)}
    return replace(edge, outputs=outputs, tracking_error=error)


@pytest.mark.parametrize(
    ("alone", "stiff", "together", "holds"),
    [
        ((30.0, 2.0), (10.0,), (3.0, 5.0), [True, True, True]),
        ((30.0, 2.0), (10.0,), (16.0, 1.0), [False, False, False]),
        ((30.0, 2.0), (40.0,), (3.0, 1.0), [True, False, False]),
        ((30.0, 2.0), (5.0,), (3.0, 5.0), [True, False, True]),
    ],
)
def test_verdicts_on_the_edge_are_those_of_the_runs(edge, alone, stiff, together, holds):
    named = {"alone": alone, "stiff": stiff, "together": together}
    runs = {name: missing(edge, *(1e-3 * np.array(off))) for name, off in named.items()}
    assert [claim.holds for claim in EDGE.claims(runs)] == holds


def gaping(path: Result, gap: float, point: float = 0.0, speed: float = 0.0, before: float = 0.0) -> Result:
    """The run with a gap and a point that are off by so much in the end, mm, as by how much a gap before."""
    one = np.ones(len(path.t))
    gaps = 1e-3 * gap * one
    gaps[-2] = 1e-3 * max(before, abs(gap))
    beads, speeds = 0 * path.outputs["bead_error"], 0 * path.outputs["speed_error"]
    beads[..., 0], speeds[:, 1] = 1e-3 * point, 1e-3 * speed
    seen = {"gap_error": gaps, "bead_error": beads, "speed_error": speeds}
    about = {**path.info, "disturbances": [{**path.info["disturbances"][0], "start": 0.0}]}
    return replace(path, outputs={**path.outputs, **seen}, info=about)


MET = {
    "alone": (15.0, -2.4, 6.0),
    "stiff": (5.0,),
    "gap": (-1.2, -3.0, 45.0),
    "weighted": (-0.5, 0.0, 0.0, 2.0),
    "phase": (14.0, -0.5),
}


@pytest.mark.parametrize(
    ("name", "seen", "others"),
    [
        ("alone", (2.0, 0.0, 6.0), {0, 1}),
        ("alone", (15.0, 0.0, 30.0), {4}),
        ("stiff", (2.0,), {1}),
        ("stiff", (20.0,), {1}),
        ("gap", (-8.0, -3.0, 45.0), {0, 1, 2, 3}),
        ("gap", (-1.2, -0.7, 3.0), {3, 4}),
        ("weighted", (-1.5, 0.0, 0.0, 2.0), {2}),
        ("weighted", (-0.5, 0.0, 0.0, 1.0), {2}),
        ("phase", (2.0, -0.5), {3}),
        ("phase", (14.0, -2.0), {3}),
    ],
)
def test_verdicts_on_the_path_are_those_of_the_runs(path, name, seen, others):
    runs = {each: gaping(path, *values) for each, values in MET.items()}
    assert all(claim.holds for claim in PATH.claims(runs))
    changed = PATH.claims({**runs, name: gaping(path, *seen)})
    assert {k for k, claim in enumerate(changed) if not claim.holds} == others


def test_what_is_seen_where_beads_meet_is_at_the_phase_at_which_they_should(path):
    late = gaping(path, 1.0)
    gaps, phase = np.linspace(0.0, 1.0, len(path.t)), np.linspace(0.0, 0.8, len(path.t))
    about = {**late.info, "path": {**late.info["path"], "duration": 0.4}}
    plain = replace(late, info=about, outputs={**late.outputs, "gap_error": gaps})
    assert gap_there(plain) == 1.0  # the run ends before
    described = {**about["outputs"], "phase": {"unit": "s", "axes": ["time"]}}
    slowed = replace(plain, info={**about, "outputs": described}, outputs={**plain.outputs, "phase": phase})
    assert gap_there(slowed) == pytest.approx(0.5)


def test_since_a_push_is_from_its_start_on_and_never_nothing(path):
    (push,) = path.info["disturbances"]
    at = [{**push, "start": start} for start in (path.t[2], path.t[3])]
    values = np.arange(len(path.t))
    assert list(since_push(replace(path, info={**path.info, "disturbances": at}), values)) == list(values[2:])
    assert list(since_push(path, values)) == [values[-1]]  # a run that ends before


def test_a_pull_along_the_error_turns_with_the_payload(run):
    np.testing.assert_allclose(pull(pulling(run, 3.0)), 3.0)
    np.testing.assert_allclose(force(pulling(run, -3.0)), 3.0)
    start = along_error(run, run.sync_error[:, 0, :3])[0]
    assert start == pytest.approx(-np.linalg.norm(GEOMETRIC_ERROR[:3]), rel=1e-3)
    drawn, left = integral_curves(run)
    np.testing.assert_array_equal(drawn.values[:, 0], pull(run))
    assert left.values[0, 0] == pytest.approx(-1e3 * start)


def test_a_root_mean_square_is_that_of_lengths():
    assert root_mean_square(np.full(7, -2.0)) == pytest.approx(2.0)
    assert root_mean_square(np.tile([3.0, 4.0], (5, 1))) == pytest.approx(5.0)


def test_runs_of_a_task_are_found_by_their_names_and_missing_ones_refused(run):
    every = dict.fromkeys(planned_runs([CARRY]), run)
    assert runs_of(CARRY, every).keys() == CARRY.planned.keys() == CARRY.labels.keys()
    assert all(set(drawing.runs) <= set(CARRY.planned) for drawing in CARRY.drawings)
    del every["carry_leak"]
    with refused(InputError, "claims", found=("carry_leak",)):
        runs_of(CARRY, every)


@pytest.mark.parametrize("task", [CARRY, EDGE, PATH], ids=lambda task: task.name)
def test_the_section_of_a_task_has_its_figures_its_animation_and_a_row_per_run(task, request, tmp_path):
    made = request.getfixturevalue("run" if task is CARRY else task.name)
    runs = forces(made) if task is CARRY else dict.fromkeys(task.planned, made)
    section, claims = section_of(task, runs, tmp_path)
    assert not any(isinstance(block, SideBySide) for block in section.blocks)
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    assert [row[0] for row in table.rows] == [task.labels[name] for name in task.planned]
    assert all(len(row) == len(table.head) for row in table.rows)
    (verdicts,) = (block for block in section.blocks if isinstance(block, Verdicts))
    assert list(verdicts.claims) == claims
    assert {path.stem for path in (tmp_path / "figures").glob("*.svg")} == {d.stem for d in task.drawings}
    with open_page(write_page(tmp_path / "index.html", "page", [section])) as page:
        assert page.evaluate("document.querySelectorAll('figure img').length") == len(task.drawings)
        assert page.errors == []
    animation = (tmp_path / "animations" / f"{task.name}.html").read_text("utf-8")
    assert all(escape(task.labels[name]) in animation for name in task.animated)


def section_of(task: Task, runs: dict[str, Result], folder: Path) -> tuple[Section, list[Claim]]:
    claims = task.claims(runs)
    return task_section(task, runs, claims, folder), claims


def test_the_table_has_what_was_measured_of_each_run(run, tmp_path):
    runs = forces(run)
    section, _ = section_of(CARRY, runs, tmp_path)
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    assert [row[1] for row in table.rows] == [number(force(runs[name])[0]) for name in CARRY.planned]


def test_the_table_says_which_engine_made_each_run(run, tmp_path):
    compiled = replace(run, info={**run.info, "engine": "compiled"})
    runs = {**forces(run), "leak": pulling(compiled, *SEEN["leak"])}
    section, _ = section_of(CARRY, runs, tmp_path)
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    engines = {row[0]: row[-1] for row in table.rows}
    assert engines.pop(CARRY.labels["leak"]) == "compiled"
    assert set(engines.values()) == {"pinocchio"}
