"""Verdicts follow from runs: what is true of a run holds, and what is not does not."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from refusals import refused

from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four
from synctrl.experiments.planar_four import GAINS
from synctrl.paper import claims, claims_of_cells
from synctrl.paper.claims import OURS_OF_THE_PAPER, Claim, tally
from synctrl.paper.offsets import CAUSES, offsets_are_due_to_friction_and_gravity
from synctrl.paper.paper_sections import introduction, made_by
from synctrl.paper.report import Verdicts


@pytest.fixture(scope="module")
def planar(planar_run):
    return {
        "synchronized": planar_run(),
        "independent": planar_run(False),
        "synchronized_disturbed": planar_run(True, "torque"),
        "independent_disturbed": planar_run(False, "torque"),
    }


def with_error(run, **arrays):
    """A run whose arrays are not what was computed: synthetic, to make a claim fail."""
    return replace(run, **{name: np.array(value) for name, value in arrays.items()})


def test_the_claims_on_the_four_arms_hold(planar):
    found = claims_of_cells.planar_four_claims(planar)
    assert len(found) == 7
    for claim in found:
        assert claim.holds, claim.text
        assert all(np.isfinite(figure.value) for figure in claim.figures)


def test_a_touched_robot_is_noticed(planar):
    before, after = planar["independent"], planar["independent_disturbed"]
    assert claims_of_cells.others_are_untouched(before, after).holds
    x = np.array(after.x)
    x[-1, 2, 0] = np.nextafter(x[-1, 2, 0], np.inf)
    assert not claims_of_cells.others_are_untouched(before, with_error(after, x=x)).holds
    assert not claims_of_cells.others_are_untouched(before, before).holds, "nothing was disturbed"


def test_a_changed_synchronization_error_is_noticed(planar):
    before, after = planar["independent"], planar["independent_disturbed"]
    epsilon = np.array(after.sync_error)
    epsilon[7, 1, 0] += 1e-12
    assert not claims_of_cells.only_adjacent_sync_errors_grow(
        before, with_error(after, sync_error=epsilon)
    ).holds
    assert not claims_of_cells.only_adjacent_sync_errors_grow(before, before).holds


def test_an_error_that_stays_does_not_converge(planar):
    run = planar["synchronized"]
    assert claims.errors_converge(run, "here").holds
    stuck = with_error(run, tracking_error=np.ones_like(run.tracking_error))
    assert not claims.errors_converge(stuck, "here").holds


def test_synchronization_that_helps_one_axis_only_is_not_enough(planar):
    ours, theirs = planar["synchronized"], planar["independent"]
    assert claims.sync_error_is_much_smaller(ours, theirs, "here").holds
    mixed = np.array(ours.sync_error)
    mixed[:, 0, 1] = theirs.sync_error[:, 0, 1]
    assert not claims.sync_error_is_much_smaller(with_error(ours, sync_error=mixed), theirs, "here").holds


def test_robots_that_do_not_follow_are_noticed(planar):
    assert not claims_of_cells.others_move_along(planar["independent"], planar["independent_disturbed"]).holds


def test_missing_runs_are_named():
    with refused(InputError, "claims", found=("independent", "frictionless")):
        claims_of_cells.a460_claims({"synchronized": None})
    with refused(InputError, "claims", found=("left_gravity", "left_neither")):
        offsets_are_due_to_friction_and_gravity({"left_both": None, "left_friction": None})


def test_a_claim_is_plain_data(planar):
    data = asdict(claims.errors_converge(planar["synchronized"], "theorem 2"))
    assert data["holds"] is True
    assert data["source"] == "theorem 2"
    assert {"name", "value", "unit"} == set(data["figures"][0])


# -- verdicts that do not depend on when a run ends --------------------------------------------------------

HORIZONS = 4.0, 5.0, 6.0, 8.0


@pytest.fixture(scope="module")
def left():
    """What friction and gravity leave, each alone, both and neither."""
    acting = {"left_both": (True, True), "left_friction": (True, False), "left_gravity": (False, True)}
    return {
        name: a460_pair(friction=friction, gravity=gravity).simulate(8.0, engine="compiled", log_dt=1e-2)
        for name, (friction, gravity) in {**acting, "left_neither": (False, False)}.items()
    }


def until(run, end):
    """A run that ends earlier."""
    logged = run.t <= end + 1e-9
    arrays = {name: getattr(run, name)[logged] for name in ("t", "x_desired", "tracking_error", "sync_error")}
    return replace(run, **arrays)


@pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")
def test_what_converges_does_so_at_every_horizon(left, planar):
    for end in HORIZONS:
        assert claims.errors_converge(until(left["left_gravity"], end), "here").holds, end
    for end in (3.5, 4.0, 5.0):
        assert claims.errors_converge(until(planar["synchronized"], end), "here").holds, end


def test_an_offset_that_stays_is_no_convergence_at_any_horizon(left):
    run = left["left_gravity"]
    offset = with_error(run, tracking_error=run.tracking_error + np.abs(run.tracking_error).max())
    for end in HORIZONS:
        assert not claims.errors_converge(until(offset, end), "here").holds, end


def test_residual_offsets_are_due_to_friction_and_gravity_at_every_horizon(left):
    for end in HORIZONS:
        assert offsets_are_due_to_friction_and_gravity({n: until(r, end) for n, r in left.items()}).holds, end


@pytest.mark.parametrize("idle", [name for name in CAUSES if name != "left_neither"])
def test_a_cause_that_leaves_no_more_than_nothing_does_is_none_at_any_horizon(left, idle):
    runs = {**left, idle: left["left_neither"]}
    for end in HORIZONS:
        found = offsets_are_due_to_friction_and_gravity({n: until(r, end) for n, r in runs.items()})
        assert not found.holds, end


def test_what_a_gain_contributes_is_judged_over_the_whole_run_and_not_at_the_peak_alone(planar):
    paper = planar["synchronized"]
    assert claims_of_cells.gain_contributes_little("a gain", paper, paper).holds
    late = np.array(paper.sync_error)
    late[paper.t > 0.05] *= 2.0
    changed = with_error(paper, sync_error=late)
    assert np.abs(late).max() == np.abs(paper.sync_error).max()
    assert not claims_of_cells.gain_contributes_little("a gain", paper, changed).holds


def test_the_adaptation_changes_the_synchronization_of_the_four_arms_little_over_five_seconds(planar):
    without = planar_four(gains=GAINS.replace(Gamma=0.0)).simulate(5.0, engine="compiled")
    found = claims_of_cells.gain_contributes_little("the adaptation", planar["synchronized"], without)
    assert "over 5 s" in found.explanation
    assert found.holds


# -- whose claims they are ----------------------------------------------------------------------------------


def test_the_papers_claims_are_counted_apart_from_ours():
    papers = [Claim("so", "section V", holds, (), "") for holds in (True, False, True)]
    built = replace(papers[0], by_construction="it is so by definition")
    ours = [Claim("so", OURS_OF_THE_PAPER, holds, (), "") for holds in (True, False, False, False)]
    assert tally([*papers, *ours]) == "2 of 3 of the paper's claims hold; 1 of 4 of ours."
    words = introduction([*papers, built, *ours], {}).blocks[-1].paragraph
    assert words.startswith(
        "3 of 4 of the paper's claims hold, of which 1 could hardly have failed; 1 of 4 of ours."
    )


def test_the_page_says_which_engine_made_which_runs(planar):
    run = planar["synchronized"]
    run = replace(run, info={**run.info, "engine": "pinocchio"})
    compiled = replace(run, info={**run.info, "engine": "compiled"})
    assert made_by({"one": run, "two": run}).startswith("All runs are made by the reference engine.")
    assert "generated C: all but one run, which" in made_by({"one_run": run, "two": compiled})
    assert "generated C: all. " in made_by({"two": compiled})


def test_what_could_hardly_have_failed_is_named_and_is_about_robots_that_nothing_connects(planar):
    built = [claim for claim in claims_of_cells.planar_four_claims(planar) if claim.by_construction]
    assert all("independent" in claim.text for claim in built)
    assert len(built) == 2
    shown = Verdicts(tuple(built)).html()
    assert shown.count("Could hardly have failed: ") == 2


def test_a_disturbed_run_in_shorter_steps_responds_at_the_instants_of_the_other(planar):
    undisturbed, disturbed = planar["synchronized"].decimated(2), planar["synchronized_disturbed"]
    expected = (disturbed.tracking_error - planar["synchronized"].tracking_error)[::2]
    np.testing.assert_array_equal(claims.response(disturbed, undisturbed), expected)
    with refused(InputError, "claims"):
        claims.response(undisturbed, disturbed)
