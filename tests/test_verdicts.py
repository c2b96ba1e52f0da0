"""docs/verdicts.md: it has every ready cell, and what it says is what the certificate says."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import pytest

from synctrl import Disturbance, experiments
from synctrl.analysis.certify import VERDICTS, certify

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "verdicts.md").read_text("utf-8")
ROWS = dict(re.findall(r"(?m)^\| `(.*?)` \| (.*) \|$", PAGE))

spec = importlib.util.spec_from_file_location("verdicts_script", ROOT / "scripts" / "verdicts.py")
assert spec is not None and spec.loader is not None
script = importlib.util.module_from_spec(spec)
sys.modules["verdicts_script"] = script  # where dataclasses look for the names of their types
spec.loader.exec_module(script)
TRIALS = {trial.name: trial for trial in script.TRIALS}


def test_the_table_has_every_trial_of_the_script_once_and_in_its_order() -> None:
    assert list(ROWS) == [trial.name for trial in script.TRIALS]
    assert len(TRIALS) == len(script.TRIALS)
    assert PAGE.startswith(script.head())


def test_the_table_has_every_ready_cell() -> None:
    cells = {trial.make.__name__ for trial in script.TRIALS}
    assert cells == {*experiments.__all__} - {"quadratic_analysis"}


def test_every_row_has_one_of_the_verdicts_and_a_reason_that_goes_with_it() -> None:
    assert {found.split(" | ")[0] for found in ROWS.values()} == {*VERDICTS}
    for found in ROWS.values():
        verdict, reason = found.split(" | ")
        assert (verdict == VERDICTS[0]) == (reason == script.NOTHING)


#: what decides acts from the start, and is resolved early
EARLY = (
    "planar_four()",
    "planar_four(synchronized=False)",
    "planar_four().simulate(control_period=0.001)",
    "a460_pair(friction=False)",
    "a460_pair(adapt_friction=True)",
    "rigid_object(disturbed=False)",
    "mobile_robot(disturbed=False)",
)


@pytest.mark.parametrize("name", EARLY)
def test_a_short_run_has_the_verdict_of_the_whole_one(name: str) -> None:
    (line,) = script.lines([TRIALS[name]], 0.03)
    assert line == f"| `{name}` | {ROWS[name]} |"


def test_reasons_are_named_without_numbers_that_were_measured() -> None:
    pushed = experiments.planar_four(disturbance=Disturbance(0, 1.0, 0.05, 0.1))
    reasons = script.reasons(certify(pushed.simulate(0.15, dt=5e-3)))
    assert len(reasons) == 2 and reasons[1] == "torque from outside"  # after that the step is too long
    assert not any(re.search(r"\d", reason) for reason in reasons)
