"""Two arms, a plate that one carries, and a bead that the other one lays on its moving edge."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from synctrl import Coupling, Experiment, Hold, PoseSpace, PoseTrajectory, Result
from synctrl.analysis import certify
from synctrl.analysis.gain_condition import gain_condition_in_box
from synctrl.assembly.bead import BeadPlant
from synctrl.compiled.engine import Compiled, Tables
from synctrl.coupling.cell import Cell, Reference
from synctrl.errors import InputError, NonFiniteError
from synctrl.experiments import bead_on_edge
from synctrl.experiments.bead_on_edge import GAINS, PLATE, POSTURES, PUSH
from synctrl.show import scene_of
from synctrl.simulation.plant import Plant
from synctrl.simulation.result import LAYOUT
from synctrl.tasks.inverse_kinematics import reach
from synctrl.tasks.rotations import exp, from_quaternion
from synctrl.tasks.sliding import Carrier
from synctrl.tasks.trajectories import Motion

AGREEMENT = 1e-9
#: a push early enough for a short run
EARLY = replace(PUSH, start=0.02, stop=0.04)


@cache
def made() -> Experiment:
    return bead_on_edge(push=False)


@cache
def pushed() -> Result:
    """A short run with a push in it, every step of it logged."""
    return replace(made(), disturbances=[EARLY]).simulate(0.06)


def with_plant(**changes) -> Experiment:
    return replace(made(), plant_type=partial(BeadPlant, **{"body": PLATE, **changes}))


def with_cell(**changes) -> Experiment:
    cell = made().cell
    parts = {"members": cell.members, "coupling": cell.coupling, "space": cell.space, **changes}
    return replace(made(), cell=Cell(**parts))


# -- what the outputs say ---------------------------------------------------------------------------------


def test_epsilon_is_the_error_of_the_bead_against_the_plate():
    run = pushed()
    R = from_quaternion(run.outputs["object_pose"][:, 3:])
    error = run.outputs["bead_error"]
    np.testing.assert_allclose(np.matvec(R, error), run.sync_error[:, 0, :3], atol=1e-12)
    assert np.linalg.norm(error, axis=1).max() > 1e-4


def test_the_angle_to_the_normal_is_that_of_nozzle_and_plate_and_a_turn_about_the_nozzle_is_none():
    run = pushed()
    frame = run.experiment.cell.members[0].trajectory.frame
    R = from_quaternion(run.outputs["object_pose"][:, 3:])
    wanted = np.matvec(R, frame.orientation(run.t).R[..., 2])
    actual = exp(run.x[:, 1, 3:])[..., 2]
    angle = run.outputs["normal_angle"]
    np.testing.assert_allclose(2 * np.sin(angle / 2), np.linalg.norm(actual - wanted, axis=1), atol=1e-12)
    assert (angle <= np.linalg.norm(run.sync_error[:, 0, 3:], axis=1) + 1e-6).all() and angle.max() > 1e-5


def test_the_speed_along_the_edge_is_off_by_the_rate_of_the_error_along_it():
    run = pushed()
    tangent = run.experiment.cell.members[0].trajectory.frame.tangent(run.t)
    rate = np.gradient(run.outputs["bead_error"], run.t, axis=0, edge_order=2)
    off = run.outputs["bead_speed"] - run.outputs["bead_speed_desired"]
    np.testing.assert_allclose(np.vecdot(rate, tangent), off, atol=2e-2 * np.abs(off).max())


def test_the_bead_begins_on_the_edge_and_stays_as_close_to_it_as_its_errors_say():
    run = pushed()
    frame, bead = run.experiment.cell.members[0].trajectory.frame, run.outputs["bead_points"][:, 0]
    there = frame.edge.at(frame.way(run.t).x[..., 0]).p
    np.testing.assert_allclose(bead[0], there[0], atol=1e-6)
    room = np.linalg.norm(run.outputs["bead_error"], axis=1)
    room += frame.edge.stand_off * run.outputs["normal_angle"]
    assert (np.linalg.norm(bead - there, axis=1) <= room + 1e-9).all()


def test_poses_of_the_plate_are_those_of_the_tip_that_carries_it():
    run = pushed()
    for name, x in (("object_pose", run.x), ("object_desired", run.x_desired)):
        pose = run.outputs[name]
        np.testing.assert_allclose(pose[:, :3], x[:, 0, :3], atol=1e-12)
        np.testing.assert_allclose(from_quaternion(pose[:, 3:]), exp(x[:, 0, 3:]), atol=1e-12)


def test_the_result_has_plate_and_outline_as_plain_data_and_can_be_drawn_and_kept(tmp_path):
    run = pushed()
    about = run.info["edge"]
    outline = np.array(json.loads(json.dumps(about))["outline"])
    around = np.linalg.norm(np.diff(outline, axis=0, append=outline[:1]), axis=1).sum()
    assert around == pytest.approx(about["length"], rel=1e-3)
    assert run.info["object"]["name"] == "plate" and (about["carrier"], about["nozzle"]) == (0, 1)
    assert len(run.outputs) == len(run.info["outputs"])
    assert scene_of(run).page()
    assert Result.load(run.save(tmp_path / "run.npz")) == run


# -- the theory -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("leak", [0.0, 6.0])
def test_v_never_grows_and_the_proof_covers_the_run_while_nobody_pushes(leak):
    run = bead_on_edge(push=False, gains=GAINS.replace(leak=leak)).simulate(0.02)
    certificate = certify(run)
    assert certificate.certified and not certificate.outside
    V = certificate.lyapunov.V
    assert (np.diff(V) <= 1e-12 * V[0]).all() and V[-1] < V[0]


def test_a_push_is_named_as_outside_of_the_proof():
    assert certify(pushed()).outside


def test_the_drift_belongs_to_the_reference_of_the_arm_that_carries():
    """Where all errors are zero, robots that move as desired have reference velocities that are their own."""
    experiment = made()
    controller, cell = experiment.closed_loop().controller, experiment.cell
    reference = cell.references(np.array([0.3]))[0]
    starts = zip(cell.robots, reference.xd, POSTURES, strict=True)
    q = np.array([reach(robot, x, np.array(posture), PoseSpace()) for robot, x, posture in starts])
    still = np.stack((q, np.zeros_like(q)))
    task = cell.task.measure(still, reference.desired)
    assert np.abs(task.e).max() < 1e-6
    v, _ = cell.task.to_joints(task, *task.rates)
    signals = controller.evaluate(
        reference, np.stack((q, v)), controller.adaptation.start(), controller.network.start()
    )
    np.testing.assert_allclose(signals.v_ref, v, atol=1e-4)
    body = cell.robots[0].jacobian(q[0]) @ v[0]
    np.testing.assert_allclose(body, reference.xd_dot[0], atol=1e-5)  # and not the nozzle's, which slides


# -- both engines, and the controller alone ---------------------------------------------------------------


@pytest.mark.parametrize("period", [None, 2e-3], ids=["continuous", "sampled"])
def test_both_engines_agree_while_a_point_slides(period):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = replace(made(), disturbances=[EARLY])
    runs = [experiment.simulate(0.06, control_period=period, engine=e) for e in ("pinocchio", "compiled")]
    expected, found = ({**{n: getattr(run, n) for n in LAYOUT}, **run.outputs} for run in runs)
    assert expected.keys() == found.keys()
    for name, array in expected.items():
        assert np.abs(found[name] - array).max() <= AGREEMENT * (np.abs(array).max() + 1e-12), name


def test_what_was_tabulated_for_a_space_in_which_nothing_slides_is_not_taken_for_one_in_which_it_does():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    engine, still = Compiled({}, Tables()), with_cell(space=PoseSpace())
    runs = [experiment.simulate(0.01, engine=engine) for experiment in (still, made(), still)]
    np.testing.assert_array_equal(runs[0].q, runs[2].q)
    assert (runs[1].q != runs[0].q).any()
    np.testing.assert_allclose(runs[1].q, made().simulate(0.01).q, atol=AGREEMENT)


def test_a_loop_of_ones_own_gives_the_torques_of_a_sampled_run_whoever_says_what_is_desired():
    run = made().simulate(0.012, control_period=2e-3)
    controller = made().controller(2e-3)
    controller.reset(0.0, run.q[0], run.v[0])
    for k in range(0, len(run.t) - 1, 2):
        desired = run.experiment.cell.references(run.t[k : k + 1])[0].desired
        tau = controller.step(run.t[k], run.q[k], run.v[k], desired if k % 4 else None)
        np.testing.assert_array_equal(tau, run.tau[k])
    with refused(InputError, "desired"):
        controller.step(run.t[-1], run.q[-1], run.v[-1], desired[:3])


class Quiet(Plant):
    """The plant of the package, which says something of its own."""

    def outputs_along(self, q, v, hidden, t):
        return {"speed": (np.abs(v).max(axis=(1, 2)), "rad/s", ("time",))}

    def report(self, hidden):
        return {"said": True}


class Heavier(Quiet):
    """One that moves otherwise."""

    def move(self, q, v, tau, hidden):
        return super().move(q, v, 0.5 * tau, hidden)


class Other(Quiet):
    """One that has other robots than it says."""

    def __init__(self, cell, **options):
        super().__init__(cell, **options)
        self.robots = tuple(reversed(self.robots))


class Late(Quiet):
    """One in which something happens."""

    events = (0.01,)


def test_the_compiled_engine_takes_a_plant_that_only_tells_and_refuses_one_that_moves_otherwise():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    runs = [replace(made(), plant_type=Quiet).simulate(0.01, engine=e) for e in ("pinocchio", "compiled")]
    for run in runs:
        np.testing.assert_array_equal(run.outputs["speed"], np.abs(run.v).max(axis=(1, 2)))
        assert run.info["said"]
    for plant in (Heavier, Other, Late):
        with refused(InputError, "plant"):
            replace(made(), plant_type=plant).simulate(0.01, engine="compiled")


# -- what is claimed --------------------------------------------------------------------------------------


CASES = {
    "independent": GAINS.independent(),
    "independent, Lambda 26": GAINS.independent().replace(Lambda=26.0),
    "beta 20, K_eps 2000": GAINS,
}


def measured(experiment: Experiment, engine: Compiled) -> list[float]:
    """Largest errors from 2 to 3 s: bead, across the edge, speed, normal; then the bead's rms."""
    run = experiment.simulate(dt=1e-3, log_dt=5e-3, engine=engine)
    tangent = run.experiment.cell.members[0].trajectory.frame.tangent(run.t)
    bead, outputs = run.outputs["bead_error"], run.outputs
    across = bead - np.vecdot(bead, tangent)[:, None] * tangent
    speed = np.abs(outputs["bead_speed"] - outputs["bead_speed_desired"])
    size, aside = (np.linalg.norm(part, axis=1) for part in (bead, across))
    window, late = (run.t >= 2) & (run.t <= 3), run.t >= 3
    peaks = [part[window].max() for part in (1e3 * size, 1e3 * aside, 1e3 * speed)]
    normal = np.rad2deg(outputs["normal_angle"])[window].max()
    return [*map(float, peaks), float(normal), 1e3 * float(np.sqrt(np.mean(size[late] ** 2)))]


def test_the_table_of_the_page_is_what_runs_give_and_synchronization_keeps_the_bead_on_the_edge():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    whole = (Path(__file__).parents[1] / "docs" / "assembly.md").read_text("utf-8")
    page = whole.partition("## A bead on a moving edge")[2]  # other tables have rows of the same name
    experiment, engine = bead_on_edge(), Compiled({}, Tables())  # what is desired is tabulated once
    rows = {name: measured(replace(experiment, gains=gains), engine) for name, gains in CASES.items()}
    for name, found in rows.items():
        told = re.search(rf"^\| {re.escape(name)} \|(.*)\|$", page, re.MULTILINE)
        assert told is not None, name
        for number, text in zip(found, told[1].split("|"), strict=True):
            decimals = len(text.strip().partition(".")[2])
            assert f"{number:.{decimals}f}" == text.strip(), (name, found)
    alone, quick, together = rows.values()
    assert all(a > b > c for a, b, c in zip(alone, quick, together, strict=True))
    assert together[0] < 0.2 * alone[0] and together[0] < 0.4 * quick[0]


# -- what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        pytest.param(lambda: Coupling.pair([np.zeros((3, 6))] * 2).weights(np.zeros(1), 6), "c", id="c"),
        pytest.param(lambda: with_plant(body=1.0), "body", id="no body"),
        pytest.param(lambda: with_plant(nozzle=0), "carrier, nozzle", id="one robot for both"),
        pytest.param(lambda: with_plant(nozzle=2), "carrier, nozzle", id="a robot that is not there"),
        pytest.param(lambda: with_plant(carrier=-1), "carrier", id="a robot below 0"),
        pytest.param(lambda: with_plant(carrier=1, nozzle=0), "carrier, trajectory", id="no carrier"),
        pytest.param(lambda: bead_on_edge(push=1), "push", id="no yes or no"),
        pytest.param(lambda: bead_on_edge(friction="much"), "friction", id="friction by a word"),
    ],
)
def test_what_makes_no_bead_is_refused(make, subject):
    with refused(InputError, subject):
        make()


def test_a_frame_that_is_on_no_edge_has_no_bead():
    carrier, rider = made().cell.members
    still = PoseTrajectory(Hold([0.0, 0.0, 0.0]))
    other = replace(carrier, trajectory=Carrier(carrier.trajectory, still))
    with refused(InputError, "carrier, frame"):
        with_cell(members=[other, rider])


def test_a_reference_without_what_slides_is_refused_and_a_point_that_is_lost_is_named():
    experiment = made()
    controller, cell = experiment.closed_loop().controller, experiment.cell
    whole = cell.references(np.zeros(1))[0]
    with refused(InputError, "reference: xd, xd' and xd''"):
        controller.evaluate(
            Reference(whole.desired[:3], whole.weights),
            np.stack((cell.q0, cell.v0)),
            controller.adaptation.start(),
            controller.network.start(),
        )


class Lost:
    """A place on the plate that is lost at 5 ms."""

    dimension, breaks = 3, ()

    def __call__(self, t):
        place = np.zeros((*np.shape(t), 3)) + np.where(np.asarray(t) > 5e-3, np.nan, 0.0)[..., None]
        return Motion(place, place, place)


def test_a_point_that_is_lost_is_named_with_its_robot_and_its_time():
    experiment = bead_on_edge(push=False)
    carrier, rider = experiment.cell.members
    motion = PoseTrajectory(carrier.trajectory.position, carrier.trajectory.orientation)
    lost = replace(carrier, trajectory=Carrier(motion, PoseTrajectory(Lost())))
    cell = Cell([lost, rider], experiment.cell.coupling, experiment.cell.space)
    with refused(NonFiniteError, robot=0, cause="motion") as caught:
        Experiment(cell, experiment.gains, 0.01).simulate(dt=1e-3)
    assert 5e-3 < caught.value.time < 7e-3


def test_the_gain_condition_in_a_box_looks_where_the_point_is():
    q0 = made().cell.q0
    assert gain_condition_in_box(made(), q0, q0, duration=0.1, samples=1).holds
