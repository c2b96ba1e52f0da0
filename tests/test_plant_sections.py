"""The page's sections on other plants, on what is learned, and on the independent judge."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from refusals import refused

from synctrl.analysis.convergence import identify
from synctrl.errors import InputError
from synctrl.experiments import a460_full_pair, a460_pair
from synctrl.paper.judge import AGREEMENT, compare_runs, differences, joint_pair, judge_section
from synctrl.paper.plant_sections import friction_section, full_a460_section, identification_section
from synctrl.paper.report import SideBySide, write_page
from synctrl.paper.reproduction import PLANNED, judge_runs, judged
from synctrl.show.plots import joint_trajectories, save


@pytest.fixture(scope="module")
def runs():
    """Short runs of what the sections show."""
    make = {
        "synchronized": a460_pair,
        "independent": partial(a460_pair, synchronized=False),
        "full": a460_full_pair,
        "full_alone": partial(a460_full_pair, synchronized=False),
        "friction_unknown": a460_pair,
        "friction_adapted": partial(a460_pair, adapt_friction=True),
    }
    return {name: experiment().simulate(0.05) for name, experiment in make.items()}


def test_the_page_shows_three_and_six_joints_side_by_side(runs, tmp_path) -> None:
    of_the_paper = {
        2: ("synchronized", 0),
        3: ("synchronized", 1),
        5: ("independent", 0),
        6: ("independent", 1),
    }
    for figure, (kind, robot) in of_the_paper.items():
        save(joint_trajectories(runs[kind], robot), tmp_path / f"figure_{figure:02d}")
    section = full_a460_section(runs, tmp_path)
    page = write_page(tmp_path / "index.html", "page", [section]).read_text("utf-8")
    rows = [block for block in section.blocks if isinstance(block, SideBySide)]
    assert len(rows) == 6
    for figure, row in enumerate(rows, start=2):
        for picture, joints in zip(row.blocks, ("three", "six"), strict=True):
            assert f"Figure {figure}, " in picture.caption
            assert f"{joints} joints" in picture.caption
            assert picture.caption in page
            assert f"figure_{figure:02d}" in picture.svg.name
    assert all(rows[k - 2].blocks[0].svg == tmp_path / f"figure_{k:02d}.svg" for k in of_the_paper)
    assert "joint5" in page


def test_the_page_compares_friction_unknown_and_adapted_at_equal_times(runs, tmp_path) -> None:
    page = write_page(tmp_path / "index.html", "page", [friction_section(runs, tmp_path)]).read_text("utf-8")
    assert "friction adapted" in page
    assert PLANNED["a460_pair_friction_unknown"].duration == PLANNED["a460_pair_friction_adapted"].duration


def test_the_page_says_what_was_learned(runs, tmp_path) -> None:
    found = {"the <run>": identify(runs["synchronized"])}
    page = write_page(tmp_path / "index.html", "page", [identification_section(found)]).read_text("utf-8")
    assert "the &lt;run&gt;: robot 2" in page
    assert page.count("<td>15</td>") == 2


def test_runs_that_differ_are_told_from_those_that_agree(runs) -> None:
    run = runs["synchronized"]
    same = compare_runs(run, run)
    assert same.agrees
    assert same.tracking.max() == same.sync.max() == 0
    shifted = replace(run, sync_error=run.sync_error + 2 * AGREEMENT * np.abs(run.sync_error).max())
    other = compare_runs(run, shifted)
    assert not other.agrees
    np.testing.assert_allclose(other.sync, 2 * AGREEMENT)
    with refused(InputError, "runs"):
        compare_runs(run, a460_pair().simulate(0.04))


def test_the_judges_section_has_a_line_and_a_row_per_cell(runs, tmp_path) -> None:
    comparison = compare_runs(runs["synchronized"], runs["independent"])
    lines = differences([comparison, comparison]).axes[0].get_lines()
    assert len(lines) == 3
    section = judge_section([comparison], tmp_path)
    page = write_page(tmp_path / "index.html", "page", [section]).read_text("utf-8")
    assert "<td>NO</td>" in page
    assert "not installed" not in page


def test_without_mujoco_the_page_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:
    monkeypatch.setattr("synctrl.paper.reproduction.find_spec", lambda name: None)
    assert judge_runs() == {}
    page = write_page(tmp_path / "index.html", "page", [judge_section(judged({}), tmp_path)])
    assert "MuJoCo is not installed" in page.read_text("utf-8")


def test_runs_of_the_judge_are_found_in_pairs() -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is an extra: pip install 'synctrl[mujoco]'")
    planned = judge_runs()
    assert {planned[name].plant for name in planned} == {"pinocchio", "mujoco"}
    experiment = joint_pair("planar2r")
    pair = {
        "judge_x": experiment.simulate(0.02),
        "judge_x_mujoco": experiment.simulate(0.02, plant="mujoco"),
    }
    assert [comparison.agrees for comparison in judged({**pair, "other": pair["judge_x"]})] == [True]
