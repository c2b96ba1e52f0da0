"""The figure of a front draws what the table says, and nothing that has no place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from test_front import DAMPING, LONG, TWO, tuned

from synctrl.errors import InputError
from synctrl.show.front_figures import front_figure, words_of
from synctrl.show.plots import save
from synctrl.show.style import display
from synctrl.sweep.measures import MEASURES

pytest.importorskip("optuna", reason="pip install 'synctrl[tune]'")


@pytest.fixture(scope="module")
def two():
    free = tuned()
    limit = float(np.quantile([row["tracking_rms"] for row in free.history], 0.8))
    return tuned(limits={"tracking_rms": limit})


@pytest.fixture(scope="module")
def three():
    return tuned(DAMPING, maximize="delay_margin", duration=LONG)


def drawn(panel, label):
    """The points of what a panel's legend calls so, as a set."""
    (line,) = (line for line in panel.get_lines() if str(line.get_label()).startswith(label))
    return {tuple(point) for point in line.get_xydata().tolist()}


def told(found, rows, goals):
    factors = [display(found.definitions[goal.name].unit).factor for goal in goals]
    return {tuple(f * row[goal.name] for f, goal in zip(factors, goals, strict=True)) for row in rows}


def test_two_goals_are_one_panel_with_the_runs_of_the_table(two):
    (panel,) = front_figure(two).axes
    beyond = [row for row in two.history if two.judge.fault(row)]
    others = [row for row in two.history if row not in two.front and row not in beyond]
    assert beyond and others
    assert drawn(panel, f"front: {len(two.front)}") == told(two, two.front, two.goals)
    assert drawn(panel, f"other runs: {len(others)}") == told(two, others, two.goals)
    assert drawn(panel, f"beyond a limit: {len(beyond)}") == told(two, beyond, two.goals)
    assert drawn(panel, f"chosen: run {two.run}") == told(two, [two.history[two.run]], two.goals)


@pytest.mark.parametrize("larger", [(False, False), (False, True), (True, False), (True, True)])
def test_on_the_better_side_of_the_steps_there_is_no_run_that_counts(larger):
    goals = [name for name, most in zip(TWO, larger, strict=True) if not most]
    found = tuned(minimize=goals, maximize=[name for name, most in zip(TWO, larger, strict=True) if most])
    (panel,) = front_figure(found).axes
    line = next(line for line in panel.get_lines() if "steps" in line.get_drawstyle())
    x, y = line.get_xydata().T
    assert (np.diff(x) >= 0).all()
    corners = [
        (x[k + 1], y[k]) if line.get_drawstyle() == "steps-post" else (x[k], y[k + 1])
        for k in range(len(x) - 1)
    ]
    signs = np.array([-1.0 if goal.larger else 1.0 for goal in found.goals])
    points = signs * np.array(sorted(told(found, found.history, found.goals)))
    for corner in signs * np.array(corners).reshape(-1, 2):
        assert not (points < corner).all(axis=1).any()


def test_three_goals_are_three_panels_with_the_whole_front_in_each(three):
    panels = front_figure(three).axes
    pairs = [(0, 1), (0, 2), (1, 2)]
    assert len(panels) == 3
    for panel, pair in zip(panels, pairs, strict=True):
        goals = [three.goals[k] for k in pair]
        assert drawn(panel, "front") == told(three, three.front, goals)
        for axis, goal in zip("xy", goals, strict=True):
            label = getattr(panel, f"get_{axis}label")()
            unit = display(three.definitions[goal.name].unit).unit
            assert label.startswith(f"{words_of(goal.name)}, {unit}")
            assert ("larger is better" in label) == goal.larger


def test_runs_without_numbers_are_counted_and_not_drawn(two):
    lost = [row["run"] for row in two.history if row not in two.front][:3]
    blank = {"status": "stopped", "stop_time": 0.005, **dict.fromkeys(MEASURES)}
    history = [{**row, **blank} if row["run"] in lost else row for row in two.history]
    (panel,) = front_figure(replace(two, history=history)).axes
    assert drawn(panel, "no numbers: 3") == set()
    points = sum(len(drawn(panel, label)) for label in ("front", "other runs", "beyond"))
    assert points == len(told(two, [row for row in history if row["sync_rms"] is not None], two.goals))


@pytest.mark.parametrize("width", [3.5, 6.4])
def test_nothing_sticks_out_of_the_figure(width, two, three, tmp_path):
    for found in (two, three):
        figure = front_figure(found, width=width)
        save(figure, tmp_path / "front")
        size = figure.bbox
        for box in [legend.get_window_extent() for legend in figure.legends] + [
            panel.get_tightbbox() for panel in figure.axes
        ]:
            assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= size.x1 + 1 and box.y1 <= size.y1 + 1


def test_the_search_for_one_goal_has_no_such_figure():
    with refused(InputError, "found"):
        front_figure(tuned(minimize="sync_rms", generations=1))


def test_the_script_tunes_the_four_arms(tmp_path, monkeypatch):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(Path(__file__).parent.parent / "scripts")
    import tune_cell

    monkeypatch.setattr(tune_cell, "DURATION", 0.1)
    for name, goals in tune_cell.GOALS.items():
        tune_cell.tune_cell(tmp_path / name, 1, 1, goals)
        assert (tmp_path / name / "front.png").stat().st_size > 5_000
        assert (tmp_path / name / "front.csv").read_text("utf-8").count("\n") >= 2
