"""Fair comparisons of the page: parts are switched off as named, and findings follow the numbers."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from theory_cells import coupling, experiment

from synctrl import Experiment
from synctrl.analysis import Comparison, compare, side_by_side
from synctrl.analysis.free_gain import under
from synctrl.analysis.trial_rows import AS_GIVEN, Row
from synctrl.control.adaptation import Gradient
from synctrl.control.laws import ChungSlotine, SlotineLi
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four
from synctrl.paper.fairness import (
    AS_MUCH_TORQUE,
    FAIR,
    STIFF,
    STIFFEST,
    TORQUE,
    another_law_does_better,
    as_much_torque,
    compare_laws,
    compare_parts,
    fair_section,
    taken_apart,
    what_parts_do,
)
from synctrl.paper.report import write_page

SHORT = {"duration": 0.05, "dt": 1e-3}


def small() -> Experiment:
    return experiment(coupling("pair", 2, 1), joints=1)


@pytest.fixture(scope="module")
def parts() -> Comparison:
    return side_by_side(taken_apart(planar_four()), **SHORT)


def rows(found: Comparison) -> dict[str, Row]:
    return {row.law: row for row in found.rows}


def test_every_combination_of_the_parts_is_tried_once_and_named() -> None:
    made = taken_apart(small())
    on = {
        name: tuple(bool(np.any(getattr(run.gains, gain))) for gain in ("beta", "K_eps", "Gamma"))
        for name, run in made.items()
    }
    del on[STIFF], on[STIFFEST]
    assert len(set(on.values())) == len(on) == 8
    assert next(iter(on)) == "β + K_ε + adaptation"
    assert on["none of them"] == (False, False, False)
    assert on["β"] == (True, False, False)
    assert on["K_ε + adaptation"] == (False, True, True)
    assert made["adaptation"].gains.as_dict() == small().gains.independent().as_dict()


def test_what_learns_by_a_part_of_ones_own_is_taken_apart_without_it() -> None:
    gains = small().gains.replace(Gamma=None)
    made = taken_apart(replace(small(), gains=gains, adaptation=Gradient(0.3)))
    assert [*made] == ["β + K_ε", "β", "K_ε", "none of them", STIFF, STIFFEST]


def test_the_stiff_controller_is_independent_and_has_lambda_plus_beta() -> None:
    gains = taken_apart(planar_four())[STIFF].gains
    assert not gains.beta.any() and not gains.K_eps.any()
    assert gains.Lambda == planar_four().gains.Lambda + planar_four().gains.beta


@pytest.mark.parametrize(("make", "most"), [(planar_four, 410.0), (a460_pair, 24.0)])
def test_the_stiffest_controller_has_the_largest_gain_that_synchronization_has(make, most: float) -> None:
    """In the direction in which S'S has its largest eigenvalue, u is Lambda + beta lambda times the error."""
    whole = make()
    S, gains = whole.cell.coupling.matrix, whole.gains
    _, vectors = np.linalg.eigh(S.T @ S)
    gain = gains.Lambda * vectors[:, -1] + gains.beta * (S.T @ (S @ vectors[:, -1]))
    stiffest = taken_apart(whole)[STIFFEST].gains
    np.testing.assert_allclose(gain, stiffest.Lambda * vectors[:, -1], atol=1e-9)
    assert not stiffest.beta.any() and not stiffest.K_eps.any()
    assert stiffest.Lambda == pytest.approx(most)


def test_with_as_much_torque_under_friction_the_rms_of_epsilon_and_its_peak_say_opposite_things() -> None:
    whole, options = a460_pair(), {"duration": 0.8, "engine": "compiled"}
    made = {"whole": whole, **as_much_torque(whole, **options)}
    found = side_by_side(made, **options)
    ours, alone = (row.disturbed for row in found.rows)
    assert alone.peak_torque == pytest.approx(ours.peak_torque, rel=1e-2)
    assert ours.sync_rms < alone.sync_rms
    assert ours.sync_peak > alone.sync_peak
    (sentence,) = found.sentences
    said = sentence.partition("disturbed, ")[2]
    assert re.search(r"RMS ε [\d.]+ times larger, peak ε [\d.]+ times smaller", said)
    assert found.rows[1].law == AS_MUCH_TORQUE


def test_what_the_parts_do_is_said_from_the_numbers(parts: Comparison) -> None:
    assert "Most is done by β." in what_parts_do(parts)
    swapped = {"β": rows(parts)["K_ε"].quiet, "K_ε": rows(parts)["β"].quiet}
    others = tuple(replace(row, quiet=swapped.get(row.law, row.quiet)) for row in parts.rows)
    assert "Most is done by K_ε." in what_parts_do(replace(parts, rows=others))


def test_an_independent_controller_with_lambda_110_tracks_better_than_the_papers(parts: Comparison) -> None:
    ours, stiff = parts.rows[0].quiet, rows(parts)[STIFF].quiet
    assert stiff.tracking_peak < ours.tracking_peak
    assert stiff.tracking_rms < ours.tracking_rms
    assert stiff.peak_torque > ours.peak_torque
    assert stiff.sync_rms > ours.sync_rms  # what it does not do better


def test_at_the_papers_four_arm_gains_beta_does_the_work(parts: Comparison) -> None:
    nothing, beta, k_eps, adaptation = (
        rows(parts)[name].quiet.sync_rms for name in ("none of them", "β", "K_ε", "adaptation")
    )
    assert beta < 0.2 * nothing
    assert k_eps > 0.9 * nothing
    assert adaptation > 0.9 * nothing


@pytest.fixture(scope="module")
def laws() -> Comparison:
    found = compare(small(), [SlotineLi()], ["equal pole", TORQUE], **SHORT)
    return replace(found, disturbed=True, rows=tuple(replace(row, disturbed=row.quiet) for row in found.rows))


def better_by(laws: Comparison, tracking: float, sync: float) -> Comparison:
    ours, *others = laws.rows
    sizes = ours.disturbed
    sizes = replace(
        sizes,
        tracking_rms=sizes.tracking_rms / tracking,
        tracking_peak=sizes.tracking_peak / tracking,
        sync_rms=sizes.sync_rms / sync,
        sync_peak=sizes.sync_peak / sync,
    )
    return replace(laws, rows=(ours, *(replace(row, disturbed=sizes) for row in others)))


@pytest.mark.parametrize(("tracking", "sync"), [(2.0, 2.0), (2.0, 0.5), (0.5, 2.0), (1.01, 1.01)])
def test_another_law_does_better_if_both_errors_are_smaller(laws: Comparison, tracking, sync) -> None:
    claim = another_law_does_better(better_by(laws, tracking, sync), "SlotineLi")
    assert claim.holds == (min(tracking, sync) == 2.0)
    figures = {figure.name: figure.value for figure in claim.figures}
    assert figures["RMS e disturbed, SunMills"] == pytest.approx(
        tracking * figures["RMS e disturbed, SlotineLi"]
    )
    assert figures["quiet peak torque, SlotineLi"] == pytest.approx(
        figures["quiet peak torque, SunMills"], rel=1e-2
    )


@pytest.mark.parametrize("size", ["tracking_peak", "sync_peak"])
def test_a_law_with_a_larger_peak_does_not_do_better(laws: Comparison, size: str) -> None:
    better = better_by(laws, 2.0, 2.0)
    ours, *others = better.rows
    peaks = tuple(
        replace(r, disturbed=replace(r.disturbed, **{size: getattr(ours.disturbed, size)})) for r in others
    )
    assert not another_law_does_better(replace(better, rows=(ours, *peaks)), "SlotineLi").holds


def test_under_the_push_another_law_does_better_at_equal_quiet_peak_torque() -> None:
    pushed = planar_four(disturbance="torque")
    damped = under(pushed, ChungSlotine(5.33))
    ours, other = side_by_side({"paper's": pushed, "damped": damped}, duration=1.0).rows
    assert other.quiet.peak_torque == pytest.approx(ours.quiet.peak_torque, rel=1e-2)
    assert other.disturbed.tracking_rms < ours.disturbed.tracking_rms
    assert other.disturbed.sync_rms < ours.disturbed.sync_rms


def test_a_law_whose_run_is_missing_does_not_do_better(laws: Comparison) -> None:
    gone = replace(laws, rows=(laws.rows[0], *(replace(r, disturbed=None) for r in laws.rows[1:])))
    assert not another_law_does_better(gone, "SlotineLi").holds


def test_a_law_that_was_not_compared_is_refused_by_name(laws: Comparison) -> None:
    with refused(InputError, "comparison", found="ChungSlotine"):
        another_law_does_better(laws, "ChungSlotine")


def test_the_section_shows_the_laws_and_every_part(
    laws: Comparison, parts: Comparison, tmp_path: Path
) -> None:
    section = fair_section(laws, parts, tmp_path / "fair")
    text = write_page(tmp_path / "page.html", "page", [section]).read_text()
    assert text.count("<tr><th scope='row'>") == len(laws.rows) + len(parts.rows)
    assert laws.summary[0] in text


@pytest.mark.parametrize("name", FAIR)
def test_both_cells_are_compared_over_no_more_than_the_limit(name: str) -> None:
    for found in (compare_laws(name, 0.003), compare_parts(name, 0.003)):
        assert found.duration == 0.003
        assert {row.rule for row in found.rows[1:]} <= {AS_GIVEN, *FAIR[name].rules}
