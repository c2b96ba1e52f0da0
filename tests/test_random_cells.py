"""Cells that nobody chose, by both engines: the same run, or a refusal of something by its name."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from machines import seeds
from random_cells import RandomCell
from side_by_side import Outcome, apart, differing, in_lanes, outcome

from synctrl.compiled import compiler
from synctrl.compiled.batch import Batch
from synctrl.errors import InputError, RobotError, SynctrlError

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")


def quickly(patch: pytest.MonkeyPatch, folder) -> None:
    """Compile quickly, into a folder: bits do not depend on how it was done."""
    quick = tuple("-O0" if flag.startswith("-O") else flag for flag in compiler.FLAGS)
    patch.setenv("SYNCTRL_CACHE", str(folder))
    patch.setattr(compiler, "FLAGS", quick)


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    """A cache of this module's own."""
    with pytest.MonkeyPatch.context() as patch:
        quickly(patch, tmp_path_factory.mktemp("cache"))
        yield


def check(seed: int) -> str:
    """See to it that both engines make the same run of a cell; what became of it, in a word."""
    made = RandomCell(seed)
    try:
        expected = outcome(made.experiment, "pinocchio", **made.options)
    except SynctrlError as error:  # a motion that cannot be reached
        with pytest.raises(type(error)):
            in_lanes(made.experiment, made.width, **made.options)
        return "refused"
    try:
        found = in_lanes(made.experiment, made.width, **made.options)
    except (InputError, RobotError) as error:
        assert error.subject and "pinocchio" in str(error), seed
        return "refused"
    assert not differing(in_lanes(made.experiment, 1, **made.options), found), seed
    if expected.error is not None:
        assert found.error is not None and found.error[0] is expected.error[0], seed
        return "stopped"
    assert found.error is None and not apart(expected, found), (seed, apart(expected, found))
    check_beside_others(made, found)
    return "agreed"


def check_beside_others(made: RandomCell, expected: Outcome) -> None:
    """See to it that a run has the same measures in a lane beside others that start elsewhere."""
    options = {name: made.options.get(name) for name in ("duration", "control_period", "log_dt")}
    run = made.experiment.plan(options.pop("duration"), 1e-3, **options)
    q = np.repeat(made.experiment.cell.q0[None], made.width + 2, axis=0)
    q[1:-1] += 1e-3 * np.arange(1, made.width + 1)[:, None, None]
    bands = {"tracking_error": 1e-3, "sync_error": 1e-3}
    found = Batch(run, bands, width=made.width).measure({"q": q}, len(q))
    for k in (0, -1):  # also in the group that comes later, and is not full
        assert found.peak_torque[k].tobytes() == np.abs(expected.arrays["tau"]).max(axis=0).tobytes()
        for kind in bands:
            assert getattr(found, kind).final[k].tobytes() == expected.arrays[kind][-1].tobytes(), kind


@settings(max_examples=10)
@given(seeds)
@pytest.mark.filterwarnings("ignore")
def test_both_engines_make_the_same_run_of_any_cell(seed):
    check(seed)


@pytest.mark.filterwarnings("ignore")
def test_most_of_these_cells_run_and_few_are_refused():
    found = [check(seed) for seed in range(4)]
    assert found.count("agreed") >= 3
