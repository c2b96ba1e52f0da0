"""The page of laws shows what was compared, and learning trials measure what the runs did."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import open_page
from theory_cells import coupling, experiment

from synctrl.analysis import compare
from synctrl.analysis.comparison import RULES
from synctrl.control.adaptation import Gradient, Leakage, Natural
from synctrl.control.laws import ChungSlotine, SlotineLi
from synctrl.errors import StepWarning
from synctrl.experiments import a460_pair, planar_four
from synctrl.paper.adaptation_trials import torque_error, try_adaptations
from synctrl.paper.law_sections import adaptation_section, adaptation_verdict, comparison_section
from synctrl.show.law_figures import MARKERS, comparison_figure

SCRIPT = Path(__file__).resolve().parent.parent / "scripts" / "compare_laws.py"


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
    assert markup.index(found.summary[0]) < markup.index("<table>")
    assert markup.count("<li>") == len(found.sentences)


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
    assert natural.bodies == "yes"
    verdict, table, _ = adaptation_section("cell", [none, natural], ("rad", "rad", "N·m")).blocks
    assert "natural" in table.html()
    assert "All estimates are those of bodies" in verdict.html()
    assert "with natural, until 0.5 s" in adaptation_verdict([none, replace(natural, bodies="until 0.5 s")])


def test_parameters_that_are_not_those_of_bodies_are_said_to_be_none() -> None:
    (trial,) = try_adaptations(planar_four(), {"leaky": Leakage(0.1, 1.0)}, duration=0.01)
    assert trial.bodies == "none"
    assert "bodies" not in adaptation_verdict([trial])


def test_the_script_writes_a_page_of_both_cells_that_fits_a_screen(tmp_path: Path) -> None:
    short = ["--out", str(tmp_path), "--duration", "0.01", "--engine", "pinocchio"]
    done = subprocess.run([sys.executable, str(SCRIPT), *short], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "made in" in done.stdout
    text = (tmp_path / "laws.html").read_text("utf-8")
    assert text.count("<section") == 7
    assert text.count("<img") == 2
    for name in ("Natural(0.1)", "EModification", "MasterSlave", "PDGravity"):
        assert name in text
    with open_page(tmp_path / "laws.html") as page:
        tables = "[...document.querySelectorAll('.wide')]"
        assert page.evaluate(f"{tables}.every(each => each.scrollWidth <= each.clientWidth)")
