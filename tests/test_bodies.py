"""The page says of every run whether its estimates are those of bodies that can exist."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from synctrl.analysis.consistency import Consistency
from synctrl.paper.bodies import bodies_are_left, bodies_of, bodies_section
from synctrl.paper.report import Table
from synctrl.paper.reproduction import PLANNED
from synctrl.show.consistency_plots import consistency_figure

T = np.array([0.0, 0.1, 0.2])


@pytest.fixture
def left() -> Consistency:
    inside = np.full((3, 2), 0.5)
    outside = np.array([[0.5, 0.4], [0.5, -0.1], [0.5, -0.2]])
    return Consistency(T, ("one", "two"), (inside, outside))


def test_runs_of_bodies_are_found_and_those_of_other_parameters_left_out() -> None:
    names = ("a460_pair_frictionless", "planar_four_synchronized")
    runs = {name: PLANNED[name].make().simulate(0.005) for name in names}
    found = bodies_of(runs)
    assert [*found] == ["a460_pair_frictionless"]
    assert found["a460_pair_frictionless"].holds


def test_the_finding_holds_if_a_body_is_left_and_says_when(left: Consistency) -> None:
    claim = bodies_are_left("run", left)
    assert claim.holds
    assert {figure.value for figure in claim.figures if figure.unit == "s"} == {0.1}
    kept = replace(left, smallest=(left.smallest[0],) * 2)
    assert not bodies_are_left("run", kept).holds


def test_the_table_has_the_smallest_eigenvalue_of_every_body(left: Consistency, tmp_path: Path) -> None:
    section = bodies_section({"a_run": left}, "a_run", tmp_path / "bodies")
    table = next(block for block in section.blocks if isinstance(block, Table))
    assert [row[1:] for row in table.rows] == [("0.5", "0.5", "yes"), ("0.5", "-0.2", "until 0.1 s")]


def test_the_figure_has_a_line_for_every_body(left: Consistency) -> None:
    for panel, values in zip(consistency_figure(left).axes, left.smallest, strict=True):
        lines = [line for line in panel.get_lines() if str(line.get_label()).startswith("body")]
        assert len(lines) == values.shape[1]
        np.testing.assert_array_equal(lines[1].get_ydata(), values[:, 1])


def test_a_run_is_consistent_until_the_first_body_is_left(left: Consistency) -> None:
    assert left.until == 0.1
    assert replace(left, smallest=(left.smallest[0],) * 2).until is None
