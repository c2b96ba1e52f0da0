"""Tasks of assembly on the page: every run has its row, and verdicts follow from runs and not from hopes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from browser import open_page
from refusals import refused

from synctrl import Result
from synctrl.assembly.body import place_of
from synctrl.errors import InputError
from synctrl.experiments import carry_ur5
from synctrl.experiments.carry import GEOMETRIC_ERROR
from synctrl.paper.carry_task import CARRY, along_error, force, integral_curves, pull, whole_millimetre
from synctrl.paper.report import SideBySide, Table, Verdicts, write_page
from synctrl.paper.tasks import planned_runs, root_mean_square, runs_of, task_section


@pytest.fixture(scope="module")
def run() -> Result:
    return carry_ur5(geometric_error=True).simulate(0.02)


def pulling(run: Result, newtons: float) -> Result:
    """The run with an internal force of a size that pulls along the geometric error."""
    _, R = place_of(run.outputs["object_pose"])
    along = R @ (GEOMETRIC_ERROR[:3] / np.linalg.norm(GEOMETRIC_ERROR[:3]))
    inside = 0 * run.outputs["internal_force"]
    inside[:, 0, :3], inside[:, 1, :3] = -newtons * along, newtons * along
    return replace(run, outputs={**run.outputs, "internal_force": inside})


def forces(run: Result, **newtons: float) -> dict[str, Result]:
    return {name: pulling(run, newtons[name]) for name in CARRY.planned}


def test_verdicts_are_those_of_the_runs(run):
    predicted = whole_millimetre(run)
    seen = forces(run, exact_alone=5.0, exact=2.0, alone=7.0, paper=predicted, leak=8.0)
    assert [claim.holds for claim in CARRY.claims(seen)] == [True, True, True, False]
    for name, newtons, expected in (
        ("exact", 6.0, [False, True, True, False]),
        ("paper", 0.9 * predicted, [True, False, True, False]),
        ("alone", 0.9 * predicted, [True, False, True, True]),
        ("leak", 0.9 * predicted, [True, True, False, False]),
    ):
        changed = {**seen, name: pulling(run, newtons)}
        assert [claim.holds for claim in CARRY.claims(changed)] == expected, name


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
    del every["carry_leak"]
    with refused(InputError, "claims", found=("carry_leak",)):
        runs_of(CARRY, every)


def test_the_section_of_a_task_has_its_figures_its_animation_and_a_row_per_run(run, tmp_path):
    runs = forces(run, exact_alone=5.0, exact=2.0, alone=7.0, paper=50.0, leak=8.0)
    section = task_section(CARRY, runs, CARRY.claims(runs), tmp_path)
    assert not any(isinstance(block, SideBySide) for block in section.blocks)
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    labels = [CARRY.labels[name] for name in CARRY.planned]
    assert [row[0] for row in table.rows] == labels
    assert [row[1] for row in table.rows] == ["5", "2", "7", "50", "8"]
    (verdicts,) = (block for block in section.blocks if isinstance(block, Verdicts))
    assert len(verdicts.claims) == 4
    assert {path.stem for path in (tmp_path / "figures").glob("*.svg")} == {d.stem for d in CARRY.drawings}
    with open_page(write_page(tmp_path / "index.html", "page", [section])) as page:
        assert page.evaluate("document.querySelectorAll('figure img').length") == len(CARRY.drawings)
        assert page.errors == []
    assert "geometric error, independent" in (tmp_path / "animations" / "carry.html").read_text("utf-8")
