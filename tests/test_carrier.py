"""Arms that carry an object, made from what is known of it."""

import pickle
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from refusals import refused

from synctrl import (
    Cell,
    Coupling,
    Cubic,
    Experiment,
    Friction,
    Gains,
    PoseSpace,
    PoseTrajectory,
    Result,
    load_robot,
)
from synctrl.analysis import certify
from synctrl.assembly.body import CarriedObject
from synctrl.assembly.carrier import carrier
from synctrl.assembly.grasp import Fixture, Grasp
from synctrl.assembly.plant import CarryingPlant
from synctrl.assembly.tare import disagreement, tared
from synctrl.coupling.cell import Member
from synctrl.errors import InputError
from synctrl.tasks.rotations import exp, log

BOX = CarriedObject(3.0, (0.02, 0.0, 0.01), box=(0.5, 0.12, 0.12), name="box")
MOTION = PoseTrajectory(Cubic((0.0, 0.0, 0.35), (0.0, 0.15, 0.5), duration=1.5))
SIDES = (-1.0, 0.0), (1.0, np.pi)  # of which they stand, and how they are turned
ARMS = [load_robot("panda").placed((0.7 * x, 0, 0), (0, 0, turn), name=f"panda {x}") for x, turn in SIDES]
FIXTURE = Fixture((2e4, 100.0), (200.0, 1.0))
GRASPS = [Grasp(i, (0.2 * x, 0, 0.06), np.diag([-x, x, -1.0]), FIXTURE) for i, (x, _) in enumerate(SIDES)]
ERROR = np.array([1e-3, 0.0, 0.0, 0.0, 0.01, 0.0])
GAINS = Gains(Lambda=6, beta=6, K_r=(20, 20, 20, 5, 2, 0.5, 0.3), K_eps=50, Gamma=0.003)


def made(i: int = 0, **options: Any) -> Member:
    return carrier(ARMS[i], GRASPS[i], BOX, MOTION, **options)


def run(*, tare: bool = False, error: np.ndarray = ERROR) -> Experiment:
    members = [made(0, known=0.5, error=error), made(1, known=0.5)]
    members = [replace(member, friction=Friction()) for member in members]
    cell = Cell(members, Coupling.pair(), PoseSpace())
    plant = partial(CarryingPlant, body=BOX, grasps=GRASPS, robots=ARMS, desired=MOTION)
    return Experiment(tared(cell) if tare else cell, GAINS, duration=1.5, plant_type=plant)


def test_the_hand_starts_where_its_grasp_says_on_an_object_at_the_start_of_its_motion() -> None:
    for i in range(2):
        hand = ARMS[i].tip_pose(made(i).q0)
        np.testing.assert_allclose(hand.translation, MOTION(0.0).x[:3] + GRASPS[i].xyz, atol=1e-10)
        np.testing.assert_allclose(hand.rotation, GRASPS[i].rotation, atol=1e-10)


def test_the_arm_is_told_its_own_place_of_the_object_and_starts_from_the_true_one() -> None:
    at = np.array([0.0, 0.02, 0.4]), exp(np.array([0.0, 0.0, 0.1]))
    right, wrong = made(at=at), made(at=at, error=ERROR)
    tips = [member.robot.tip_pose(member.q0) for member in (right, wrong)]
    np.testing.assert_array_equal(right.q0, wrong.q0)
    np.testing.assert_allclose(tips[0].translation, at[0], atol=1e-10)
    np.testing.assert_allclose(at[1].T @ (tips[1].translation - tips[0].translation), ERROR[:3], atol=1e-9)
    np.testing.assert_allclose(log(tips[0].rotation.T @ tips[1].rotation), ERROR[3:], atol=1e-9)


def test_shares_that_add_up_to_one_add_the_whole_object_to_the_arms() -> None:
    added = 0.0
    for i, share in enumerate((0.3, 0.7)):
        member = made(i, share=share)
        added += member.robot.mass_matrix(member.q0)[0, 0] - ARMS[i].mass_matrix(member.q0)[0, 0]
    far = BOX.com[:2] + MOTION(0.0).x[:2] - np.array([[-0.7, 0.0], [0.7, 0.0]])
    turning = BOX.inertia[2, 2] + BOX.mass * (far * far).sum(axis=1)  # about the first joint of either arm
    assert added == pytest.approx(np.array([0.3, 0.7]) @ turning, rel=1e-9)


def test_the_first_estimate_has_the_arm_and_as_much_of_its_share_as_is_known() -> None:
    nothing, half, all_of_it = (made(known=known).theta_hat0 for known in (0.0, 0.5, 1.0))
    np.testing.assert_array_equal(nothing, ARMS[0].inertial_parameters)
    np.testing.assert_allclose(all_of_it, made().robot.inertial_parameters, atol=1e-12)
    np.testing.assert_allclose(half, 0.5 * (nothing + all_of_it), atol=1e-12)


def test_a_grasp_without_a_place_is_refused() -> None:
    with refused(InputError, "grasp, xyz"):
        carrier(ARMS[0], Grasp(0), BOX, MOTION)


def test_a_place_of_the_object_has_to_be_said_or_to_follow_from_its_motion() -> None:
    with refused(InputError, "at"):
        CarryingPlant(run().cell, body=BOX, grasps=GRASPS, robots=ARMS)


def test_after_a_tare_arms_squeeze_as_those_do_that_are_not_wrong() -> None:
    wrong, right = run(), run(tare=True)
    np.testing.assert_allclose(np.abs(disagreement(wrong.cell)[1]), np.abs(ERROR), atol=1e-5)
    np.testing.assert_allclose(disagreement(right.cell), 0.0, atol=1e-12)
    with pytest.warns(match="take a tare"):  # our own warning, which has no data
        mistaken = squeeze(wrong)
    exact = squeeze(run(error=0 * ERROR))  # without that warning
    assert np.abs(squeeze(right) - exact).max() < 0.2 * np.abs(mistaken - exact).max()


def squeeze(experiment: Experiment) -> np.ndarray:
    """Force inside along the line between the hands, N, after a moment."""
    return experiment.simulate(0.05, dt=1e-3, log_dt=0.01).outputs["internal_force"][-1, :, 0]


def test_a_run_is_the_same_bits_again_from_a_pickle_and_from_a_file(tmp_path) -> None:
    experiment = run(tare=True)
    first, again = (
        some.simulate(0.02, dt=1e-3) for some in (experiment, pickle.loads(pickle.dumps(experiment)))
    )
    first.save(tmp_path / "run.npz")
    loaded = Result.load(tmp_path / "run.npz")
    for name, values in first.outputs.items():
        np.testing.assert_array_equal(again.outputs[name], values)
        np.testing.assert_array_equal(loaded.outputs[name], values)
    assert str(certify(loaded, experiment)) == str(certify(first))
