"""Verdicts follow from runs: what is true of a run holds, and what is not does not."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from refusals import refused

from synctrl.errors import InputError
from synctrl.paper import claims, claims_of_cells


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


def test_a_claim_is_plain_data(planar):
    data = asdict(claims.errors_converge(planar["synchronized"], "theorem 2"))
    assert data["holds"] is True
    assert data["source"] == "theorem 2"
    assert {"name", "value", "unit"} == set(data["figures"][0])
