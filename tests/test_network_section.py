"""The page's section on robots that talk: what is tabulated and drawn, and claims that can fail."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from ur5_joints import GAINS, ur5_joints

from synctrl import Network
from synctrl.analysis import DelayMap, delay_margin
from synctrl.experiments import a460_pair, planar_four
from synctrl.paper.margin_section import Talking, joint_by_joint, map_caption, margin_table
from synctrl.paper.network_section import (
    NETWORK,
    a_filter_costs_almost_nothing,
    every_delay_is_tolerated,
    holding_doubles,
    messages,
    rms,
    size_of_epsilon,
)
from synctrl.paper.report import Table
from synctrl.paper.tasks import task_section
from synctrl.show.delay_figures import delay_map_figure


@pytest.fixture(scope="module")
def short():
    """A run of four arms that send every 10 ms."""
    return planar_four(network=Network(0.01)).simulate(0.05, 1e-3)


def larger(run, factor):
    """The same run with larger synchronization errors."""
    return replace(run, sync_error=factor * run.sync_error)


def test_the_filter_may_cost_almost_nothing_and_holding_has_to_cost_much(short):
    assert a_filter_costs_almost_nothing(larger(short, 1.01), short).holds
    assert not a_filter_costs_almost_nothing(larger(short, 1.2), short).holds
    assert holding_doubles(larger(short, 2.1), short).holds
    assert not holding_doubles(larger(short, 1.9), short).holds


@pytest.mark.parametrize(("end", "holds"), [(0.1, True), (0.9, False)])
def test_every_delay_is_tolerated_only_if_errors_fade(end, holds):
    makes = {"long": planar_four, "long_a460": partial(a460_pair, friction=False)}
    runs = {}
    for name, make in makes.items():
        run = make(network=Network(delay=0.1)).simulate(0.02, 2e-3)
        fading = np.linspace(1.0, end, len(run.t))[:, None, None] * np.ones_like(run.sync_error)
        runs[name] = replace(run, sync_error=fading)
    assert every_delay_is_tolerated(runs).holds is holds


def test_sizes_are_those_of_all_pairs_together_and_messages_those_of_all_robots(short):
    np.testing.assert_allclose(size_of_epsilon(short) ** 2, (short.sync_error**2).sum(axis=(1, 2)))
    assert rms(short) == pytest.approx(np.sqrt(np.mean(size_of_epsilon(short) ** 2)))
    assert messages(short) == 4 * 5  # at 0, 10, ... 40 ms
    assert messages(planar_four().simulate(0.01, 1e-3)) == 0


def test_the_table_of_margins_says_what_every_cell_takes():
    a460 = a460_pair(friction=False)
    cells = {"all": Talking(a460.cell, a460.gains), "less": Talking(ur5_joints(), GAINS)}
    table = margin_table(cells)
    every, less = table.rows
    margin = delay_margin(ur5_joints(), GAINS)
    assert every[2:4] == ("every", "–")
    assert float(less[2]) == pytest.approx(1e3 * margin.delay, rel=0.01)
    assert less[3] == f"robot {margin.robot + 1}, joint {margin.joint + 1}"
    assert len(every) == len(table.head) == 1 + sum(width for _, width in table.groups)


def test_joints_compared_one_by_one_are_those_of_the_same_arms():
    cell = a460_pair(friction=False).cell
    joints = joint_by_joint(cell)
    assert joints.m == cell.nv
    np.testing.assert_allclose(joints.q0, cell.q0)


def test_the_boundary_is_drawn_where_errors_begin_to_grow():
    delays, losses = np.array([0.0, 0.1]), np.array([0.0, 0.5, 0.9])
    falls = DelayMap(delays, losses, np.full((2, 3), -1.0), 0.01)
    grows = DelayMap(delays, losses, np.array([[-1.0] * 3, [1.0] * 3]), 0.01)
    figure = delay_map_figure({"hold": {"one": falls, "two": grows}})
    one, two = figure.axes[:2]
    assert [len(one.collections), len(two.collections)] == [1, 2]
    (line,) = two.collections[1].get_paths()
    np.testing.assert_allclose(line.vertices[:, 0], 50.0)  # ms, half way


def test_the_section_has_a_row_for_every_run_and_says_how_many_messages_were_sent(short, tmp_path):
    section = task_section(NETWORK, dict.fromkeys(NETWORK.planned, short), (), tmp_path)
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    assert [row[0] for row in table.rows] == list(NETWORK.labels.values())
    assert {row[3] for row in table.rows} == {"20"}
    assert (tmp_path / "figures" / "network_epsilon.svg").is_file()


def test_the_caption_counts_the_points_at_which_errors_grow():
    delays, losses = np.array([0.0, 0.1]), np.array([0.0, 0.5])
    found = DelayMap(delays, losses, np.array([[-1.0, -1.0], [2.0, -1.0]]), 0.01)
    caption = map_caption({"hold": {"one": found, "two": found}, "filter": {"one": found}})
    assert "2 of 8 of the points with “hold”" in caption
    assert "1 of 4 with “filter”" in caption


def test_all_runs_of_the_section_can_be_made_by_the_compiled_engine():
    assert {run.engine for run in NETWORK.planned.values()} == {"compiled"}
    networks = {name: run.make().network for name, run in NETWORK.planned.items()}
    assert networks.pop("ideal") is None
    assert all(isinstance(network, Network) for network in networks.values())
