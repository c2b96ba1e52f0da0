"""The page of laws shows what was compared, and learning trials measure what the runs did."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from theory_cells import coupling, experiment

from synctrl.analysis import compare
from synctrl.analysis.comparison import RULES
from synctrl.control.adaptation import Gradient, Natural
from synctrl.control.laws import ChungSlotine, SlotineLi
from synctrl.errors import StepWarning
from synctrl.experiments import a460_pair
from synctrl.paper.adaptation_trials import torque_error, try_adaptations
from synctrl.paper.law_sections import adaptation_section, comparison_section
from synctrl.show.law_figures import MARKERS, comparison_figure


@pytest.fixture(scope="module")
def found():
    laws = {"alone": SlotineLi(), "not damped": ChungSlotine(0.0)}
    return compare(experiment(coupling("pair", 2, 1), joints=1), laws, duration=0.02)


def test_every_row_that_was_run_has_a_mark_and_the_others_have_none(found) -> None:
    panel = comparison_figure(found).axes[0]
    marks = {tuple(dots.get_offsets()[0]) for dots in panel.collections if len(dots.get_offsets())}
    run = [row.quiet for row in found.rows if row.quiet is not None]
    assert len(run) < len(found.rows)
    assert len(panel.collections) == len(run)
    e, epsilon = np.sort(np.array(sorted(marks)).T)
    np.testing.assert_allclose(
        e[-1] / e[0], max(r.tracking_rms for r in run) / min(r.tracking_rms for r in run)
    )
    assert (epsilon > 0).all()


def test_every_rule_has_a_mark_of_its_own() -> None:
    assert {*MARKERS} == {"as given", *RULES}
    assert len({*MARKERS.values()}) == len(MARKERS)


def test_the_section_has_every_law_and_the_whole_verdict(found, tmp_path: Path) -> None:
    section = comparison_section(found, tmp_path / "laws", "A note.")
    markup = "".join(block.html() for block in section.blocks)
    assert "A note." in markup
    assert markup.count("<tr><th scope='row'>") == len(found.rows)
    assert markup.count('<p class="plain">') == 1 + len(found.verdict)


def test_estimates_that_are_true_have_no_torque_error_and_scaled_ones_have_their_scale() -> None:
    cell = a460_pair().cell
    assert torque_error(cell, cell.theta) == 0
    assert torque_error(cell, 0.7 * cell.theta) == pytest.approx(0.3)


def test_a_learning_trial_says_what_its_run_did() -> None:
    none, natural = try_adaptations(
        a460_pair(), {"none": Gradient(0.0), "natural": Natural(0.1)}, duration=0.02
    )
    with pytest.warns(StepWarning):  # friction at rest
        run = a460_pair(adaptation=Natural(0.1)).simulate(0.02)
    assert natural.tracking_peak == np.abs(run.tracking_error).max()
    assert natural.torque_error == torque_error(a460_pair().cell, run.theta_hat[-1])
    assert none.torque_error == pytest.approx(0.3)
    assert "consistent" in natural.consistency
    table = adaptation_section("cell", [none, natural], ("rad", "rad", "N·m")).blocks[1].html()
    assert "natural" in table
