"""Damping of singular configurations: both engines compute and report the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from synctrl import (
    AxisRotation,
    CartesianSpace,
    Cell,
    Coupling,
    Cubic,
    Damping,
    Experiment,
    Gains,
    Member,
    PoseSpace,
    PoseTrajectory,
    Redundancy,
    load_robot,
)
from synctrl.control.laws import SunMills
from synctrl.simulation.limits import spans
from synctrl.simulation.result import LAYOUT

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

BENT = {
    "planar2r": np.array([0.3, 0.5]),
    "panda": np.array([0.3, -0.6, 0.2, -1.2, 0.1, 1.0, 0.4]),
    "ur5": np.array([0.3, -1.2, 1.5, -0.5, 0.15, 0.2]),
}


def outwards(name: str, space: CartesianSpace, share: float) -> Member:
    """An arm that reaches out towards a singular configuration."""
    robot = load_robot(name)
    start = robot.tip_position(BENT[name])[space.rows]
    path = Cubic(start, share * start, 0.2)
    return Member(robot, path, BENT[name], theta_hat0=0.9 * robot.inertial_parameters)


def pair(space, members) -> Experiment:
    gains = Gains(Lambda=10.0, beta=5.0, K_r=2.0, K_eps=2.0, Gamma=0.1)
    return Experiment(Cell(members, Coupling.pair(), space), gains, 0.25)


def planar() -> Experiment:
    space = CartesianSpace("xy", singularity="damped")
    return pair(space, [outwards("planar2r", space, share) for share in (1.02, 1.025)])


def mixed() -> Experiment:
    """A redundant arm with a posture beside one that is not."""
    posture = [BENT["panda"], np.zeros(2)]
    space = CartesianSpace("xy", singularity=Damping(0.8, 0.2), redundancy=Redundancy(posture, 2.0))
    return pair(space, [outwards("panda", space, 1.1), outwards("planar2r", space, 1.02)])


def poses() -> Experiment:
    robot = load_robot("ur5")
    pose = robot.tip_pose(BENT["ur5"])
    members = []
    for step in (0.05, 0.08):
        straight = Cubic(pose.translation, pose.translation + step * np.array([1, 1, 0]), 0.2)
        path = PoseTrajectory(straight, AxisRotation.fixed(pose.rotation))
        members.append(Member(robot, path, BENT["ur5"], theta_hat0=0.9 * robot.inertial_parameters))
    return pair(PoseSpace(singularity=Damping(0.2, 0.1)), members)


CASES = {
    "two joints": (planar, {}),
    "two joints, sampled": (planar, {"control_period": 2e-3}),
    "mixed": (mixed, {}),
    "poses": (poses, {}),
}


class OtherCommand(SunMills):
    """The paper's law, which logs something else than c xref' as its command."""

    def bind(self, cell, gains):
        bound = super().bind(cell, gains)

        class Bound:
            def command(self, errors):
                asked = bound.command(errors)
                return asked._replace(u=2 * asked.u)

        return Bound()


@pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")
def test_the_velocity_that_is_lost_is_that_which_the_law_asks_for_whatever_it_calls_its_command():
    run, other = planar().simulate(), replace(planar(), law=OtherCommand()).simulate()
    np.testing.assert_array_equal(other.q, run.q)
    assert other.info["damping"] == run.info["damping"] != []


@pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")
@pytest.mark.parametrize("name", CASES)
def test_both_engines_damp_alike_and_report_the_same(name):
    make, options = CASES[name]
    reference, compiled = (make().simulate(engine=e, **options) for e in ("pinocchio", "compiled"))
    for array in LAYOUT:
        expected = getattr(reference, array)
        scale = np.abs(expected).max() + 1e-12
        np.testing.assert_allclose(getattr(compiled, array), expected, rtol=0, atol=1e-9 * scale)
    assert {entry["robot"] for entry in reference.info["damping"]} == {0, 1}
    for expected, found in zip(reference.info["damping"], compiled.info["damping"], strict=True):
        assert found == pytest.approx(expected, rel=1e-9)


def test_spans_are_the_runs_of_true_in_a_row():
    assert spans(np.array([True, False, True, True, False])) == [(0, 0), (2, 3)]
    assert spans(np.zeros(3, dtype=bool)) == []
