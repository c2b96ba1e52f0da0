"""Cases of invented values: each is the cell that it says, and what is said of all is counted from them."""

from __future__ import annotations

import numpy as np
import pytest

from synctrl.experiments import a460_pair
from synctrl.paper import claims, claims_of_cells
from synctrl.paper.claims import MUCH, REACHED
from synctrl.paper.report import write_page
from synctrl.paper.value_grid import (
    CASES,
    CHOSEN,
    VALUES,
    Case,
    Judged,
    flips,
    grid_section,
    grid_table,
    judge_case,
    varied,
    verdict,
)

SHORT = {"duration": 0.05, "engine": "compiled"}
pytestmark = pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")


@pytest.mark.parametrize("synchronized", [True, False])
def test_the_chosen_case_is_the_cell_of_the_page(synchronized: bool) -> None:
    ours, page = (made.simulate(**SHORT) for made in (varied(CHOSEN, synchronized), a460_pair(synchronized)))
    np.testing.assert_array_equal(ours.q, page.q)
    np.testing.assert_array_equal(ours.tau, page.tau)


def test_a_case_has_the_motion_the_estimate_and_the_friction_that_it_names() -> None:
    made, page = varied(Case(3.0, 0.5, 2.0)).cell, a460_pair().cell
    assert made.members[0].trajectory.duration == 3.0
    np.testing.assert_allclose(7 * made.theta_hat0, 5 * page.theta_hat0)
    for part in ("viscous", "coulomb"):
        ours, theirs = (np.array(getattr(cell.members[1].friction, part)) for cell in (made, page))
        np.testing.assert_allclose(ours, 2 * theirs)


def test_a_case_is_judged_as_the_claims_of_the_page_are() -> None:
    runs = [a460_pair(kind).simulate(engine="compiled") for kind in (True, False)]
    judged = judge_case(CHOSEN)
    assert judged.reaches == all(claims_of_cells.arms_reach_their_targets(run).holds for run in runs)
    smaller = claims.sync_error_is_much_smaller(*runs, "here")
    assert judged.smaller == smaller.holds
    assert judged.factor == min(figure.value for figure in smaller.figures)


def grid_of(left, factor) -> dict[Case, Judged]:
    return {case: Judged(left(case), factor(case)) for case in CASES}


def test_cases_are_counted_and_flips_are_where_the_size_crosses_its_threshold() -> None:
    """Sizes that are powers of the values are interpolated exactly."""
    grid = grid_of(lambda case: REACHED * (case.friction / 1.5) ** 2, lambda case: MUCH * case.motion / 1.25)
    assert [*flips(grid, "left", REACHED)] == ["friction × 1.5"]
    assert [*flips(grid, "factor", MUCH)] == ["a motion of 1.25 s"]
    said = verdict(grid, 4.0)
    assert "in 18 of 27 cases" in said
    assert "all of them, in 18" in said


def test_where_nothing_flips_it_is_said() -> None:
    grid = grid_of(lambda _: 0.1 * REACHED, lambda _: 10 * MUCH)
    assert verdict(grid, 4.0).count("no value in this range") == 2


def test_the_table_has_every_case_once_and_marks_what_does_not_hold(tmp_path) -> None:
    grid = grid_of(lambda case: REACHED * case.friction, lambda case: MUCH * case.motion)
    table = grid_table(grid)
    cells = [cell for row in table.rows for cell in row[1:]]
    assert len(cells) == 2 * len(CASES) == 2 * 27
    assert sum(cell.endswith("✗") for cell in cells) == 9  # friction × 2 is above what is asked
    text = write_page(tmp_path / "page.html", "page", [grid_section(grid, 4.0)]).read_text("utf-8")
    assert text.count("<tr><th scope='row'>") == len(VALUES["motion"]) * len(VALUES["estimate"])
