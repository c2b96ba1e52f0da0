"""Two robots that spread adhesive on one path until their beads meet, and motion that waits for robots."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from seams.posted_network import Posted

from synctrl import Experiment, Hold, Result
from synctrl.analysis import certify
from synctrl.analysis.replay import replay
from synctrl.assembly.meeting import MeetingPlant, lag_of_friction
from synctrl.control.adaptation import Gradient, Override, Paced
from synctrl.control.adaptation.protocol import check_still
from synctrl.control.admittance import Admittance
from synctrl.control.network import Ideal
from synctrl.coupling.cell import Cell, Reference
from synctrl.errors import GainWarning, InputError
from synctrl.experiments import bead_on_path, carry_ur5, planar_four
from synctrl.experiments.bead_on_path import GAINS, MODES
from synctrl.tasks.sliding import SlidingSpace

EAGER = Override(scale=2e-4)  # so small that what wrong estimates do to a start is enough to be waited for

pytestmark = pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")  # friction of light last joints


@lru_cache
def met(mode: str) -> Result:
    """A run under friction and a push until the beads have met."""
    return bead_on_path(mode).simulate(4.0, dt=2e-3, log_dt=0.01, engine="compiled")


@lru_cache
def slowed() -> Result:
    return bead_on_path("gap_weighted", EAGER, push=False, friction=False).simulate(0.3, dt=2e-3)


def shown(run: Result, name: str) -> float:
    """Size of an output from the push on, at most."""
    start = run.info["path"]["duration"] - 0.8
    return float(np.abs(run.outputs[name][run.t >= start]).max())


# -- what synchronization does ----------------------------------------------------------------------------


def test_a_coupled_gap_is_kept_against_a_push_and_independent_robots_leave_it():
    errors = {mode: abs(met(mode).info["meeting"]["gap_error"]) for mode in MODES}
    assert max(errors["gap"], errors["gap_weighted"]) < 0.1 * errors["independent"]
    assert shown(met("gap"), "gap_error") < 0.1 * shown(met("independent"), "gap_error")


def test_weights_near_the_meeting_make_the_gap_smaller_there_and_larger_before():
    at_meeting = [abs(met(mode).info["meeting"]["gap_error"]) for mode in ("gap_weighted", "gap")]
    assert at_meeting[0] < at_meeting[1]
    assert shown(met("gap_weighted"), "gap_error") > shown(met("gap"), "gap_error")


def test_a_coupled_phase_keeps_the_point_and_not_the_gap():
    off = {mode: abs(met(mode).info["meeting"]["off"]) for mode in MODES}
    assert off["phase"] < 0.5 * min(off[mode] for mode in MODES if mode != "phase")
    assert abs(met("phase").info["meeting"]["gap_error"]) > 5e-3


def test_robot_2_gives_up_some_of_its_speed_for_robot_1():
    peaks = {mode: np.abs(met(mode).outputs["speed_error"][300:]).max(axis=0) for mode in MODES}
    assert peaks["gap"][0] < peaks["independent"][0] and peaks["gap"][1] > peaks["independent"][1]


@pytest.mark.parametrize(
    ("mode", "at_meeting", "peak", "off"),
    [("independent", 15.2e-3, 31.7e-3, -2.4e-3), ("gap", -1.24e-3, 1.73e-3, -3.1e-3)],
)
def test_gaps_are_those_of_a_second_program(mode, at_meeting, peak, off):
    """One that has nothing of this package but the equations, to the digits that it printed."""
    meeting = met(mode).info["meeting"]
    assert meeting["gap_error"] == pytest.approx(at_meeting, rel=0.01)
    assert shown(met(mode), "gap_error") == pytest.approx(peak, rel=0.01)
    assert meeting["off"] == pytest.approx(off, rel=0.02)


def test_a_faster_independent_controller_lies_in_between():
    made = bead_on_path("independent", gains=GAINS.replace(Lambda=26.0))
    run = made.simulate(4.0, dt=2e-3, log_dt=0.01, engine="compiled")
    of_gap, found, alone = (
        abs(r.info["meeting"]["gap_error"]) for r in (met("gap"), run, met("independent"))
    )
    assert of_gap < found < 0.3 * alone
    assert (
        np.abs(run.outputs["speed_error"][300:, 1]).max()
        < 0.2 * np.abs(met("gap").outputs["speed_error"][300:, 1]).max()
    )


# -- what a result says -----------------------------------------------------------------------------------


def test_outputs_are_what_their_names_say():
    run = met("gap")
    out, path = run.outputs, bead_on_path().cell.members[0].trajectory.position.path
    np.testing.assert_allclose(out["bead_points"], run.x[..., :3], atol=1e-9)
    miss = run.x[..., :3] - run.x_desired[..., :3]
    np.testing.assert_allclose(
        np.linalg.norm(out["bead_error"], axis=-1), np.linalg.norm(miss, axis=-1), atol=1e-9
    )
    s = path.project(out["bead_points"], np.array([0.3, 0.4]))
    wanted = path.project(run.x_desired[..., :3], s)
    np.testing.assert_allclose(out["gap_error"], np.diff(s - wanted, axis=1)[:, 0], atol=1e-8)
    moved = np.gradient(s, run.t, axis=0) * [1, -1]
    assert np.abs(moved - out["bead_speed"])[5:-5].max() < 5e-3
    assert {name: run.info["outputs"][name]["unit"] for name in ("gap_error", "bead_speed")} == {
        "gap_error": "m",
        "bead_speed": "m/s",
    }


def test_they_meet_when_both_have_gone_their_way_and_not_before():
    meeting, about = met("gap").info["meeting"], met("gap").info["path"]
    assert meeting["time"] == pytest.approx(about["duration"])
    wanted = np.linalg.norm(np.array(about["points"]) - meeting["point"], axis=1)
    assert wanted.argmin() == pytest.approx(0.55 * 100, abs=1)
    short = bead_on_path().simulate(0.05, engine="compiled")
    assert short.info["meeting"] is None and "phase" not in short.outputs


def test_a_result_keeps_its_beads_in_a_file(tmp_path):
    run = bead_on_path(override=EAGER, friction=False).simulate(0.02, dt=5e-3)
    loaded = Result.load(run.save(tmp_path / "run.npz"))
    for name in ("bead_error", "gap_error", "phase", "feed"):
        assert np.array_equal(loaded.outputs[name], run.outputs[name])
    assert loaded.info["path"] == run.info["path"] and loaded.info["adaptation"]["name"] == "Paced"
    assert certify(loaded, experiment=run.experiment).lyapunov.V[0] > 0


@pytest.mark.parametrize("mode", ["gap_weighted", "phase"])
def test_both_engines_agree(mode):
    runs = [bead_on_path(mode).simulate(0.05, engine=engine) for engine in ("pinocchio", "compiled")]
    for name in ("q", "tau", "sync_error", "theta_hat"):
        a, b = (getattr(run, name) for run in runs)
        np.testing.assert_allclose(b, a, rtol=0, atol=1e-9 * (1 + np.abs(a).max()))
    for name, array in runs[0].outputs.items():
        np.testing.assert_allclose(runs[1].outputs[name], array, rtol=0, atol=1e-8)


# -- the proof --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", [*MODES])
def test_v_never_grows_without_friction_and_push(mode):
    run = bead_on_path(mode, push=False, friction=False).simulate(0.2, dt=2e-3, engine="compiled")
    certificate = certify(run)
    assert certificate.certified and not certificate.outside
    assert (np.diff(certificate.lyapunov.V) < 0).all()


def test_v_never_grows_where_the_motion_waits_for_the_robots():
    assert slowed().outputs["feed"].min() < 0.8
    certificate = certify(slowed())
    assert certificate.certified and not certificate.outside
    assert (np.diff(certificate.lyapunov.V) < 0).all()


# -- feed override ----------------------------------------------------------------------------------------


def test_what_is_desired_has_the_rates_that_it_says_where_the_feed_changes():
    """xd', xd'', c' and c'' along the run, which go by the feed, against differences."""
    run, adaptation = slowed(), slowed().experiment.closed_loop().controller.adaptation
    nothing = Reference(np.full((3, 2, 6), np.nan), None, 0.0)  # type: ignore[arg-type]
    zs, motions = run.outputs["adaptation_state"], np.stack((run.q, run.v), axis=1)
    seen = [adaptation.pace(z, motion, nothing) for z, motion in zip(zs, motions, strict=True)]
    xd = np.array([reference.desired for reference in seen])
    xd[:, 0, :, 3:] = 0.0  # rotation vectors, which stand still
    c = np.array([np.stack(reference.weights[:3]) for reference in seen])
    for of in (xd, c):
        slopes = (of[2:, :2] - of[:-2, :2]) / 4e-3
        for slope, rate in zip(slopes.swapaxes(0, 1), of[1:-1, 1:].swapaxes(0, 1), strict=True):
            np.testing.assert_allclose(slope, rate, atol=5e-3 * np.abs(rate).max())


def test_a_run_gone_through_again_has_the_weights_of_its_phase():
    rows = replay(slowed()).rows
    phase, feed = (slowed().outputs[name][-1] for name in ("phase", "feed"))
    weights = slowed().experiment.cell.weights(np.array([phase]))
    np.testing.assert_allclose(rows.c[-1], weights.c[0], atol=1e-12)
    np.testing.assert_allclose(rows.c_dot[-1], feed * weights.c_dot[0], atol=1e-12)


def test_phase_and_feed_follow_their_equations():
    run, h = slowed(), 2e-3
    phase, feed = run.outputs["phase"], run.outputs["feed"]
    assert phase[0] == 0.0 and feed[0] == 1.0 and (np.diff(phase) > 0).all() and phase[-1] < run.t[-1]
    gone = h / 3 * (feed[:-2] + 4 * feed[1:-1] + feed[2:])  # by Simpson's rule
    np.testing.assert_allclose(phase[2:] - phase[:-2], gone, atol=1e-8)
    lags = run.outputs["bead_error"][..., 0] * [-1, 1]
    behind = np.maximum(lags, 0.0) / EAGER.scale
    wanted = EAGER.floor + (1 - EAGER.floor) / (1 + (behind**2).sum(axis=1))
    growth = np.gradient(feed, h)[2:-2]
    assert np.abs(growth - EAGER.rate * (wanted - feed)[2:-2]).max() < 0.05 * np.abs(growth).max()


def test_robots_that_do_not_lag_are_not_waited_for():
    """With true estimates and no friction nobody lags, and the override changes next to nothing."""
    runs = []
    for override in (None, True):
        made = bead_on_path("gap", override, push=False, friction=False)
        members = [replace(m, theta_hat0=m.robot.inertial_parameters) for m in made.cell.members]
        cell = Cell(members, made.cell.coupling, made.cell.space)
        runs.append(replace(made, cell=cell).simulate(0.06, dt=4e-3))
    assert runs[1].outputs["feed"].min() > 1 - 1e-6
    np.testing.assert_allclose(runs[1].q, runs[0].q, atol=1e-7)


def test_a_sampled_controller_waits_too():
    """And once they have caught up the feed goes back to one."""
    sampled = slowed().experiment.simulate(0.6, dt=4e-3, control_period=4e-3).outputs
    for name in ("phase", "feed"):
        here = slowed().outputs[name][::2]
        np.testing.assert_allclose(sampled[name][: len(here)], here, atol=0.04)
    assert sampled["feed"].min() < 0.7 and sampled["feed"][-1] > 0.95


@given(st.floats(0.01, 1.0), st.floats(1e-4, 1.0), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_the_feed_asked_for_is_between_floor_and_one_and_falls_with_the_lag(floor, scale, one, other):
    override = Override(floor, scale)
    feed = override.feed(np.array([one, other]))
    assert floor <= feed <= 1.0
    assert override.feed(np.array([max(one, 0.0) + 0.01, other])) <= feed
    assert override.feed(np.array([-0.1, -0.2])) == pytest.approx(1.0)


# -- refusals ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "subject"),
    [
        ({"mode": "together"}, "mode"),
        ({"meeting": 0.0}, "meeting"),
        ({"meeting": 1.0}, "meeting"),
        ({"meeting": -0.2}, "meeting"),
        ({"gap": 0.004}, "gap"),
        ({"gap": -0.02}, "gap"),
        ({"push": 1}, "push"),
        ({"friction": "no"}, "friction"),
        ({"override": 0.2}, "override"),
    ],
)
def test_what_cannot_be_meant_is_refused(given, subject):
    with refused(InputError, subject):
        bead_on_path(**given)


@pytest.mark.parametrize(("name", "value"), [("floor", 0.0), ("floor", -0.1), ("floor", 1.1), ("scale", 0.0)])
def test_an_override_that_could_stand_still_or_run_ahead_is_refused(name, value):
    with refused(InputError, f"override, {name}"):
        Override(**{name: value})


def test_a_scale_below_the_lag_that_friction_leaves_is_warned_of():
    with pytest.warns(GainWarning, match="friction leaves a lag"):  # a warning has no data
        bead_on_path(override=Override(scale=2e-3))
    controller = bead_on_path().closed_loop().controller
    assert lag_of_friction(controller, 2.0) > 2e-3
    assert lag_of_friction(bead_on_path(friction=False).closed_loop().controller, 2.0) == 0.0


def test_friction_leaves_about_the_lag_that_is_reckoned():
    run = bead_on_path("independent", push=False).simulate(1.0, dt=2e-3, engine="compiled")
    lags = np.maximum(run.outputs["bead_error"][-1, :, 0] * [-1, 1], 0.0)
    reckoned = lag_of_friction(bead_on_path().closed_loop().controller, 1.0)
    assert 0.5 < np.linalg.norm(lags) / reckoned < 2.0


def test_the_compiled_engine_refuses_an_override_by_name():
    with refused(InputError, "adaptation"):
        bead_on_path(override=True).simulate(0.01, engine="compiled")


def test_an_override_needs_motions_that_know_their_lag_and_nobody_else_who_moves_them():
    planar = planar_four()
    learning = Gradient(planar.gains.Gamma)
    with refused(InputError, f"{planar.cell.names[0]}, trajectory"):
        Paced(learning, Override()).bind(planar.cell)
    cell = bead_on_path().cell
    with refused(InputError, "adaptation", found="Paced"):
        Paced(Paced(learning, Override()), Override()).bind(cell)
    with refused(InputError, "override"):
        Paced(learning, 0.2)  # type: ignore[arg-type]
    with refused(InputError, "network"):
        bead_on_path(override=True, network=Posted(0.01))
    with refused(InputError, "adaptation", found="Paced"):
        check_still("Hedged", Paced(learning, Override()), Paced(learning, Override()).bind(cell))
    with refused(InputError, "space", found="SlidingSpace"):
        Paced(learning, Override()).bind(Cell(cell.members, cell.coupling, SlidingSpace()))
    carried, paced = carry_ur5().cell, Paced(learning, Override()).bind(cell)
    with refused(InputError, "adaptation", found="BoundPaced"):
        Admittance().bind(carried, paced, Ideal().bind(carried))


def test_a_motion_that_a_caller_gives_is_refused_where_the_adaptation_has_its_own():
    made = bead_on_path(override=True)
    controller, desired = made.controller(1e-3), made.cell.references(np.zeros(1))[0].desired
    controller.reset(0.0, made.cell.q0, made.cell.v0)
    with refused(InputError, "desired"):
        controller.step(0.0, made.cell.q0, made.cell.v0, desired)
    assert np.isfinite(controller.step(0.0, made.cell.q0, made.cell.v0)).all()


def test_the_beads_belong_to_two_robots_on_one_path():
    made = bead_on_path()
    with refused(InputError, "cell", found=4):
        MeetingPlant(planar_four().cell, duration=1.0)
    other = replace(made.cell.members[1], trajectory=bead_on_path().cell.members[1].trajectory)
    with refused(InputError, "trajectory"):
        MeetingPlant(Cell([made.cell.members[0], other], made.cell.coupling, made.cell.space), duration=1.0)
    held = replace(made.cell.members[1], trajectory=Hold(np.zeros(6)), q0=made.cell.q0[1])
    with refused(InputError, "trajectory"):
        MeetingPlant(Cell([made.cell.members[0], held], made.cell.coupling, made.cell.space), duration=1.0)


def test_gains_act_along_the_path_alone():
    assert GAINS.beta.tolist() == [20.0, 0, 0, 0, 0, 0] and GAINS.K_eps.tolist() == [2000.0, 0, 0, 0, 0, 0]
    made: Experiment = bead_on_path(gains=GAINS.replace(K_eps=0.0), override=True)
    assert made.gains.Gamma is None and not made.gains.K_eps.any()
    assert isinstance(made.plant_type, partial)
