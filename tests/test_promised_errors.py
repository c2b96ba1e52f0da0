"""What the page tells of Theorems B and C and of the tube is what these give, beside what the runs did."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from theory_cells import coupling, experiment

from synctrl import Experiment
from synctrl.analysis import RatesOverGamma, exponential_rate, modal_bounds, tube
from synctrl.experiments import a460_pair, planar_four
from synctrl.experiments.a460_pair import MOTION_TIME
from synctrl.paper.promised_errors import caption, modal_table, promised_errors, tube_table, tube_words
from synctrl.paper.promised_rates import PERIOD, about_a460, about_planar, late_rate, rates_caption
from synctrl.paper.report import Section, number, write_page
from synctrl.show.style import display
from synctrl.simulation.result import Result


@pytest.fixture(scope="module")
def made() -> Experiment:
    return experiment(coupling("pair", 2, 1), joints=1)


@pytest.fixture(scope="module")
def run(made: Experiment) -> Result:
    return made.simulate(0.2, 1e-3)


def test_every_mode_and_axis_has_its_gains_and_its_bounds(made, run) -> None:
    bounds = modal_bounds(run, made)
    common, differences = modal_table(bounds).rows
    Lambda, beta = (float(np.mean(gain)) for gain in (made.gains.Lambda, made.gains.beta))
    assert common[1:3] == (number(1 / Lambda),) * 2
    assert differences[1:3] == (number(1 / (Lambda + 2 * beta)), number(1 / Lambda))
    factor = display(bounds.unit).factor
    for j, row in enumerate((common, differences)):
        sizes = bounds.peak.actual[j, 0], bounds.peak.bound[j, 0], bounds.peak.a_priori[j, 0]
        assert row[6:] == tuple(number(factor * size) for size in sizes)
        assert sizes[0] <= sizes[1] <= sizes[2]


def test_the_caption_says_what_beta_does_in_this_run(made, run) -> None:
    bounds = modal_bounds(run, made)
    assert "β makes the gain from r to the differences" in caption(bounds)
    alone = replace(made, gains=made.gains.independent())
    assert "β makes" not in caption(modal_bounds(alone.simulate(0.05, 1e-3)))
    assert caption(replace(bounds, unbounded="K_r is 0")).endswith("Limits: K_r is 0.")


def test_the_tube_stands_beside_the_largest_errors_of_the_run(made, run) -> None:
    before = tube(made.cell, made.gains, duration=0.2)
    rows = tube_table(modal_bounds(run, made), before, run).rows
    shown = display(before.parts[0].unit)
    for i, row in enumerate(rows):
        largest = np.abs(run.tracking_error[:, i]).max()
        assert row[1:3] == (number(shown.factor * largest), number(shown.factor * before.largest[i, 0]))
        assert largest <= before.largest[i, 0]


def test_it_is_said_whether_the_tube_excludes_singularities(made) -> None:
    before = tube(made.cell, made.gains, duration=0.2)
    for excluded, words in ((True, "that excludes"), (False, "does not exclude"), (None, "cannot tell")):
        assert words in tube_words(replace(before, excludes_singularities=excluded))
    assert "κ is sampled" in tube_words(replace(before, sampled=True))
    assert "κ is sampled" not in tube_words(replace(before, sampled=False))


def test_errors_that_were_promised_are_blocks_of_a_page(made, run, tmp_path) -> None:
    blocks = promised_errors(run, made, tmp_path / "modal")
    text = write_page(tmp_path / "page.html", "page", [Section("promises", tuple(blocks))]).read_text("utf-8")
    assert text.count("<tr><th scope='row'>") == 2 + 2
    assert (tmp_path / "modal.svg").is_file()


def test_the_a460_at_rest_falls_in_the_end_at_the_rate_of_theorem_c() -> None:
    """The later half of a run of 24 s, within 3 %: by then only the slowest direction is left."""
    made = a460_pair(friction=False)
    rate = exponential_rate(made, PERIOD, MOTION_TIME)
    run = made.simulate(24.0, engine="compiled", log_dt=2e-2)
    assert late_rate(run) == pytest.approx(rate.excited_rate, rel=0.03)
    said = about_a460(rate, {"left_gravity": run, "left_both": run})
    assert f"fall at {number(rate.excited_rate)} 1/s" in said
    assert f"{number(late_rate(run))} 1/s without friction" in said


def test_the_caption_of_the_rates_has_the_rate_of_the_papers_gamma_and_the_best_one() -> None:
    rates = RatesOverGamma(np.array([0.5, 1.0, 2.0]), np.array([0.1, 0.2, 0.15]), float("inf"), ())
    assert "gives 0.2 1/s, the best of these, 1 times as much, 0.2 1/s" in rates_caption(rates)
    other = replace(rates, rates=np.array([0.1, 0.2, 0.7]))
    assert "gives 0.2 1/s, the best of these, 2 times as much, 0.7 1/s" in rates_caption(other)


def test_the_planar_arms_fall_as_their_motion_ends() -> None:
    made = planar_four()
    run = made.simulate(5.0, engine="compiled", log_dt=1e-2)
    said = about_planar(run, made)
    assert late_rate(run) == pytest.approx(made.cell.members[0].trajectory.rate, rel=0.05)
    assert f"falls at {number(late_rate(run))} 1/s; the motion ends at 1 1/s, and Λ is 10 1/s" in said
