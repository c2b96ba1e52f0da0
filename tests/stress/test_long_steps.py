"""Steps against references of 20 microseconds: every bad run is flagged, and what is advised does."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell

from synctrl import Cell, Experiment, Friction, Result
from synctrl.errors import SimulationError, StepWarning
from synctrl.experiments import a460_pair, mobile_robot, planar_four, ur5_payload
from synctrl.simulation.step_error import LIMIT

#: step of the references, s; all steps are multiples of it
FINE = 2e-5
STEPS = (2e-4, 5e-4, 1e-3, 2e-3, 4e-3)
#: Coulomb friction, N·m, and viscous friction, N·m·s/rad
FRICTIONS = ((0.0, 0.0), (0.1, 0.1), (0.5, 0.0), (5.0, 0.0), (0.0, 20.0))
#: velocity error above which a run is bad, as a share of the largest velocity
BAD = 1e-3
DURATION = 0.24

CELLS: dict[str, Callable[[], Experiment]] = {
    "two planar arms": lambda: Experiment(small_cell(), SMALL_GAINS, DURATION),
    "two firm planar arms": lambda: Experiment(
        small_cell(), SMALL_GAINS.replace(K_r=5.0, Lambda=10.0), DURATION
    ),
    "four planar arms": planar_four,
    "two A460": lambda: a460_pair(friction=False),
    "two UR5": ur5_payload,
    "a vehicle": mobile_robot,
}


def rubbed(experiment: Experiment, coulomb: float, viscous: float) -> Experiment:
    """The same with friction at every joint."""
    cell = experiment.cell
    members = [
        replace(m, friction=Friction(np.full(m.robot.nv, viscous), np.full(m.robot.nv, coulomb)))
        for m in cell.members
    ]
    return replace(experiment, cell=Cell(members, cell.coupling, cell.space, cell.name))


def run(experiment: Experiment, dt: float) -> Result:
    """A run, or what there was of it until it stopped."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)
        try:
            return experiment.simulate(DURATION, dt, engine="compiled")
        except SimulationError as error:
            return error.result


def error_of(found: Result, reference: Result) -> float:
    """Largest velocity error as a share of the largest velocity; infinite for a run that stopped."""
    if found.status != "completed":
        return np.inf
    every = round(found.t[1] / FINE)
    return float(np.abs(found.v - reference.v[::every]).max() / np.abs(reference.v).max())


@pytest.fixture(scope="module")
def table() -> list[tuple[str, float, float, float | None]]:
    """Per run: what it was, its error, its estimate, and the estimate with the advised step."""
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    rows = []
    for name, make in CELLS.items():
        for coulomb, viscous in FRICTIONS:
            experiment = rubbed(make(), coulomb, viscous)
            reference = run(experiment, FINE)
            if reference.status != "completed" or reference.info["step_error"]["estimate"] > LIMIT / 10:
                continue  # friction for which even this step is no reference
            for dt in STEPS:
                found = run(experiment, dt)
                report = found.info["step_error"]
                advised = report["advised_step"]
                then = None if advised is None else run(experiment, advised).info["step_error"]["estimate"]
                what = f"{name}, {coulomb:g} N·m, {viscous:g} N·m·s/rad, {dt:g} s"
                rows.append((what, error_of(found, reference), report["estimate"], then))
    return rows


def test_every_bad_run_is_flagged_and_hardly_a_good_one(table, record_property) -> None:
    bad = [row for row in table if row[1] > BAD]
    good = [row for row in table if row[1] <= BAD]
    missed = [row for row in bad if row[2] <= LIMIT]
    false = [row for row in good if row[2] > LIMIT]
    record_property(
        "figure",
        f"{len(table)} runs against {FINE:g} s: {len(bad) - len(missed)} of {len(bad)} bad ones flagged, "
        f"{len(false)} of {len(good)} good ones flagged, with errors of "
        f"{', '.join(f'{row[1]:.2g}' for row in false) or 'none'}",
    )
    assert len(bad) > 18 and len(good) > 73 / 2
    assert missed == []
    assert len(false) <= 0.1 * len(good)
    assert all(row[1] > BAD / 10 for row in false)  # what is flagged is not far from bad


def test_the_advised_step_clears_every_flag(table, record_property) -> None:
    flagged = [row for row in table if row[2] > LIMIT]
    cleared = [row for row in flagged if row[3] is not None and row[3] <= LIMIT]
    record_property("figure", f"{len(cleared)} of {len(flagged)} flags cleared by the advised step")
    assert cleared == flagged
