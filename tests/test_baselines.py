"""Fair comparisons: gains match as claimed, parts are switched off as named, and words follow the numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from theory_cells import GAINS, coupling, experiment

from synctrl.errors import InputError, SimulationError
from synctrl.experiments import a460_pair, planar_four
from synctrl.paper.baselines import Comparison, ablation, compare
from synctrl.paper.trials import Bench, match_peak_torque, measure

SHORT = {"duration": 0.05, "dt": 1e-3}


@pytest.fixture(scope="module")
def planar() -> Comparison:
    return compare(planar_four(), **SHORT)


def small():
    return experiment(coupling("pair", 2, 1), joints=1)


def test_the_matched_controller_is_independent_and_has_the_same_peak_torque(planar: Comparison) -> None:
    match = planar.match
    run = replace(planar_four(), gains=match.gains)
    assert not run.gains.beta.any()
    assert not run.gains.K_eps.any()
    assert match.factor == pytest.approx(float(run.gains.Lambda) / 10.0)
    np.testing.assert_array_equal(run.gains.K_r, planar_four().gains.K_r)
    again = np.abs(run.simulate(**SHORT).tau).max()
    assert again == match.peak_torque
    assert again == pytest.approx(planar.trials[0].peak_torque, rel=1e-3)


def test_a_common_factor_scales_all_the_gains_named() -> None:
    match = match_peak_torque(Bench(small(), SHORT), 2.5, ("Lambda", "K_r"))
    np.testing.assert_allclose(match.gains.Lambda, match.factor * GAINS.Lambda)
    np.testing.assert_allclose(match.gains.K_r, match.factor * GAINS.K_r)
    assert match.peak_torque == pytest.approx(match.target, rel=1e-3)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_factor_is_found_above_and_below_one(share: float) -> None:
    bench = Bench(planar_four(), SHORT)
    independent = bench.peak_torque(bench.experiment.gains.independent())
    match = match_peak_torque(bench, share * independent)
    assert (match.factor > 1) == (share > 1)
    assert match.peak_torque == pytest.approx(share * independent, rel=1e-3)


class Hill(Bench):
    """Peak torque that is largest at the gains given, and falls when they grow or shrink."""

    def peak_torque(self, gains) -> float:
        return 2.0 - np.log(float(gains.Lambda) / float(GAINS.Lambda)) ** 2


def test_of_several_factors_the_one_above_one_is_taken() -> None:
    match = match_peak_torque(Hill(small(), {}), 1.0)  # also reached at a factor of 1 / e
    assert match.factor == pytest.approx(np.e, rel=1e-3)


def test_gains_under_which_a_run_has_to_stop_count_as_too_much_torque() -> None:
    bench, base = Bench(small(), {"duration": 0.4, "dt": 0.04}), small().gains.independent()
    with pytest.raises(SimulationError):  # the search tries a factor of 4
        bench.trial("", base.replace(K_r=4 * base.K_r, Lambda=4 * base.Lambda))
    start = bench.peak_torque(base)
    match = match_peak_torque(bench, 3.5 * start, ("K_r", "Lambda"))
    assert match.peak_torque == pytest.approx(3.5 * start, rel=1e-2)
    assert 2 < match.factor < 4


def test_a_peak_torque_that_no_factor_gives_is_refused() -> None:
    with refused(InputError, "gains"):
        match_peak_torque(Bench(planar_four(), {"duration": 0.01}), 1e3)
    with refused(InputError, "target"):
        match_peak_torque(Bench(small(), SHORT), -1.0)


def test_an_independent_controller_with_lambda_110_tracks_better_than_the_papers(planar: Comparison) -> None:
    ours, _, stiff, _ = planar.trials
    assert stiff.gains["Lambda"] == pytest.approx(110.0)
    assert stiff.tracking_peak < ours.tracking_peak
    assert stiff.tracking_rms < ours.tracking_rms
    assert stiff.peak_torque > ours.peak_torque
    assert stiff.sync_rms > ours.sync_rms  # what it does not do better


def test_at_the_papers_four_arm_gains_beta_does_the_work(planar: Comparison) -> None:
    nothing, beta, k_eps, adaptation = planar.ablation[:4]
    assert beta.sync_rms < 0.2 * nothing.sync_rms
    assert k_eps.sync_rms > 0.9 * nothing.sync_rms
    assert adaptation.sync_rms > 0.9 * nothing.sync_rms


def test_every_combination_of_the_parts_is_tried_once_and_named() -> None:
    bench = Bench(small(), SHORT)
    trials = ablation(bench)
    on = {t.name: tuple(bool(np.any(t.gains[k])) for k in ("beta", "K_eps", "Gamma")) for t in trials}
    assert len(set(on.values())) == len(on) == 8
    assert on["none of them"] == (False, False, False)
    assert on["β"] == (True, False, False)
    assert on["K_ε"] == (False, True, False)
    assert on["adaptation"] == (False, False, True)
    assert on["K_ε + adaptation"] == (False, True, True)
    assert trials[-1].gains == small().gains.as_dict()
    assert trials[3].gains == small().gains.independent().as_dict()


def test_gains_that_were_tried_are_not_run_again() -> None:
    bench = Bench(small(), SHORT)
    first = bench.trial("first", GAINS)
    assert replace(bench.trial("again", GAINS), name="first") == first
    assert bench.runs == 1
    bench.trial("other", GAINS.independent())
    assert bench.runs == 2


def test_a_trial_measures_what_the_run_did() -> None:
    result = small().simulate(**SHORT)
    found = measure("run", result)
    assert found.tracking_peak == np.abs(result.tracking_error).max()
    assert found.sync_peak == np.abs(result.sync_error).max()
    assert found.peak_torque == np.abs(result.tau).max()
    span = result.t[-1]
    square = np.trapezoid((result.sync_error**2).mean(axis=(1, 2)), result.t) / span
    assert found.sync_rms == pytest.approx(np.sqrt(square))


def test_the_findings_are_computed_from_the_numbers(planar: Comparison) -> None:
    ours, independent = planar.trials[:2]
    text = " ".join(planar.findings())
    assert f"{independent.sync_rms / ours.sync_rms:.3g} times smaller" in text
    worse = replace(ours, sync_rms=2 * independent.sync_rms)
    turned = replace(planar, trials=(worse, *planar.trials[1:]))
    assert "synchronization error that is 2 times larger" in " ".join(turned.findings())
    assert f"by {planar.match.factor:.3g}" in text
    assert "gravity takes 0%" in text


def test_it_is_said_where_gravity_takes_most_of_the_peak_torque(planar: Comparison) -> None:
    ours = replace(planar.trials[0], gravity_torque=0.8 * planar.trials[0].peak_torque)
    heavy = replace(planar, trials=(ours, *planar.trials[1:]))
    assert any("means little" in s and "80%" in s for s in heavy.findings())
    assert not any("means little" in s for s in planar.findings())


def test_gravity_takes_most_of_the_peak_torque_of_the_a460_and_nothing_of_the_planar_arms() -> None:
    loaded, level = (measure("", run.simulate(0.01)) for run in (a460_pair(), planar_four()))
    assert loaded.gravity_torque > 0.5 * loaded.peak_torque
    assert level.gravity_torque == 0


def test_a_comparison_needs_a_synchronized_controller_and_known_gains() -> None:
    run = small()
    with refused(InputError, "experiment"):
        compare(replace(run, gains=GAINS.independent()))
    with refused(InputError, "scaled"):
        compare(run, ("gain",), **SHORT)


def test_a_comparison_is_plain_data(planar: Comparison) -> None:
    data = planar.as_dict()
    assert [t["name"] for t in data["trials"]][:2] == ["synchronized", "independent"]
    assert data["matched"]["factor"] == planar.match.factor
    assert data["units"] == ["m", "m²"]
    assert data["findings"] == planar.findings()
