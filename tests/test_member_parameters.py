"""What a member adapts describes its robot, as it is placed, and its friction, which is stated once."""

from __future__ import annotations

import pickle
import warnings
from dataclasses import replace

import numpy as np
import pytest
from cells import SMALL_GAINS
from hypothesis import given, settings
from machines import random_robot, seeds
from refusals import refused

from synctrl import (
    BaseParameters,
    Cell,
    Coupling,
    Experiment,
    Friction,
    FrictionParameters,
    FullParameters,
    Hold,
    LinearParameters,
    Member,
    Robot,
    load_robot,
)
from synctrl.errors import InputError
from synctrl.experiments import a460_pair
from synctrl.robots.parameters import planar_two_link_parameters
from synctrl.sweep.variations import with_scaled_bodies

ARM, A460 = load_robot("planar2r"), load_robot("a460")
RUBBING = Friction(viscous=(1.0, 2.0, 3.0), coulomb=(0.5, 0.0, 2.0), smoothing=0.1)


def whole(robot: Robot) -> LinearParameters:
    """The map of full size."""
    return LinearParameters(
        robot,
        np.eye(10 * robot.body_count),
        robot.inertial_parameters,
        robot.inertial_parameter_names,
    )


KINDS = {
    "full": FullParameters,
    "base": BaseParameters,
    "linear": whole,
    "friction": lambda robot: FrictionParameters(robot),
    "friction of base": lambda robot: FrictionParameters(robot, base=BaseParameters(robot), armature=True),
}


def cell_of(robot: Robot, parameters: object, friction: Friction | None = None) -> Cell:
    still = Hold(np.zeros(robot.nv))
    other = Member(robot, still)
    member = Member(robot, still, parameters=parameters, friction=friction or Friction())  # type: ignore[arg-type]
    return Cell([other, member], Coupling.pair())


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(seed=seeds)
def test_parameters_made_for_the_robot_are_taken_whatever_it_is_called(kind: str, seed: int) -> None:
    robot = random_robot(seed, 3).with_armature(np.random.default_rng(seed).uniform(0, 1, 3))
    cell_of(robot, KINDS[kind](robot), RUBBING)
    cell_of(robot.placed(name="another name"), KINDS[kind](robot), RUBBING)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(seed=seeds)
def test_parameters_of_another_robot_with_as_many_joints_are_refused(kind: str, seed: int) -> None:
    robot, other = (random_robot(seed + k, 3, chain=True) for k in range(2))
    with refused(InputError, "robot 2, parameters"):
        cell_of(robot, KINDS[kind](other))


@pytest.mark.parametrize("kind", KINDS)
def test_parameters_of_the_robot_placed_differently_are_refused(kind: str) -> None:
    with refused(InputError, "robot 2, parameters"):
        cell_of(A460.placed(rpy=(0.4, 0.0, 0.0)), KINDS[kind](A460))


@pytest.mark.parametrize("kind", KINDS)
def test_a_place_that_changes_no_torque_changes_nothing(kind: str) -> None:
    cell_of(A460.placed((3.0, -2.0, 1.0), (0.0, 0.0, 1.0)), KINDS[kind](A460))


@pytest.mark.parametrize("kind", KINDS)
def test_parameters_with_other_true_masses_are_refused(kind: str) -> None:
    pi = A460.inertial_parameters.reshape(-1, 10)
    pi[2] *= 1.001
    with refused(InputError, "robot 2, parameters"):
        cell_of(A460.with_parameters(pi.ravel()), KINDS[kind](A460))


def test_few_parameters_of_an_arm_in_the_plane_are_refused_for_one_that_leans() -> None:
    cell_of(ARM.placed((1.0, 2.0, 0.0), (0.0, 0.0, 2.0)), planar_two_link_parameters(ARM))
    with refused(InputError, "robot 2, parameters"):
        cell_of(ARM.placed(rpy=(0.1, 0.0, 0.0)), planar_two_link_parameters(ARM))


def test_a_balanced_wheel_has_one_torque_in_every_place_but_not_one_regressor() -> None:
    wheel = load_robot("wheel")
    with refused(InputError, "robot 2, parameters"):
        cell_of(wheel.placed(rpy=(0.7, 0.0, 0.0)), FullParameters(wheel))


class OwnKind:
    """A kind of parameters that a user wrote: torque itself, with or without friction and rotors."""

    names = ("share",)
    theta = np.ones(1)

    def __init__(self, robot: Robot, shares: tuple[int, int, int], factor: float = 1.0):
        self.robot, self.shares, self.factor = robot, shares, factor

    def regressor(self, q, v, v_ref, a_ref):
        robot = self.robot
        tau = robot.inverse_dynamics(q, v_ref, a_ref) - robot.armature * a_ref
        viscous, coulomb, rotors = self.shares
        tau = tau + viscous * RUBBING.viscous * v_ref + rotors * robot.armature * a_ref
        tau = tau + coulomb * RUBBING.coulomb * np.tanh(v / RUBBING.smoothing)
        return self.factor * tau[:, None]


@pytest.mark.parametrize("shares", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1), (0, 0, 1)])
def test_a_kind_of_ones_own_may_leave_friction_and_rotors_out_but_nothing_of_the_bodies(shares) -> None:
    robot = A460.with_armature(0.4)
    cell_of(robot, OwnKind(robot, shares), RUBBING)
    with refused(InputError, "robot 2, parameters"):
        cell_of(robot, OwnKind(robot, shares, factor=1.01), RUBBING)


@pytest.mark.parametrize(
    ("change", "subject"),
    [
        ({"theta": np.array([np.nan])}, "robot 2, parameters, theta"),
        ({"theta": np.ones((1, 1))}, "robot 2, parameters, theta"),
        ({"names": ("one", "two")}, "robot 2, parameters"),
        ({"regressor": lambda *state: np.full((3, 1), np.nan)}, "robot 2, parameters"),
        ({"regressor": lambda *state: np.ones((3, 2))}, "robot 2, parameters"),
    ],
)
def test_a_kind_of_ones_own_that_is_malformed_is_named(change, subject) -> None:
    own = OwnKind(A460, (0, 0, 0))
    vars(own).update(change)
    with refused(InputError, subject):
        cell_of(A460, own)


@pytest.mark.parametrize("given_", [FullParameters, 3, ["m"], "most"])
def test_what_are_no_parameters_is_refused(given_) -> None:
    with refused(InputError, "robot 2, parameters"):
        cell_of(A460, given_)


# -- friction, stated once --------------------------------------------------------------------------------


def test_friction_among_the_parameters_is_that_of_the_member() -> None:
    parameters = FrictionParameters(A460)
    with refused(InputError, "friction"):
        _ = parameters.theta
    cell = cell_of(A460, parameters, RUBBING)
    np.testing.assert_array_equal(cell.parameters[1].theta[30:], [1, 2, 3, 0.5, 0, 2])
    assert cell.parameters[1].smoothing == RUBBING.smoothing
    assert parameters.friction is None
    np.testing.assert_array_equal(cell.members[1].theta, cell.parameters[1].theta)
    assert cell.parameters[1].names == parameters.names


@pytest.mark.parametrize(
    "other",
    [
        Friction(),
        Friction((1.0, 2.0, 3.1), RUBBING.coulomb, 0.1),
        Friction(RUBBING.viscous, (0.5, 0.1, 2.0), 0.1),
        Friction(RUBBING.viscous, RUBBING.coulomb, 0.2),
    ],
)
def test_friction_that_is_stated_twice_with_different_values_is_refused(other: Friction) -> None:
    for stated, true in ((RUBBING, other), (other, RUBBING)):
        with refused(InputError, "robot 2, parameters"):
            cell_of(A460, FrictionParameters(A460, stated), true)


def test_friction_that_is_stated_twice_alike_is_taken_with_a_word() -> None:
    again = Friction(RUBBING.viscous, RUBBING.coulomb, RUBBING.smoothing)
    with pytest.warns(DeprecationWarning, match="robot 2: its friction is stated twice") as told:
        cell_of(A460, FrictionParameters(A460, again), RUBBING)
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cell = cell_of(A460, FrictionParameters(A460, RUBBING), RUBBING)
        pickle.loads(pickle.dumps(cell))


def test_friction_of_a_robot_with_other_joints_is_named() -> None:
    with refused(InputError, "robot 2, parameters"):
        cell_of(A460, FrictionParameters(ARM), RUBBING)


def test_a_smoothing_that_smooths_nothing_is_no_difference() -> None:
    assert Friction(1.0, 0.0, 0.1).equals(Friction((1.0, 1.0), 0.0, 0.2))
    assert not Friction(1.0, 0.1, 0.1).equals(Friction(1.0, 0.1, 0.2))


def test_the_pair_of_the_paper_adapts_the_friction_of_its_members() -> None:
    cell = a460_pair(adapt_friction=True).cell
    for member, parameters in zip(cell.members, cell.parameters, strict=True):
        expected = FrictionParameters(member.robot, member.friction).theta
        np.testing.assert_array_equal(parameters.theta, expected)


def test_a_sweep_over_true_bodies_keeps_what_is_adapted() -> None:
    experiment = a460_pair(adapt_friction=True)
    changed = with_scaled_bodies(experiment, 1.2)
    before, after = (e.cell.parameters[0].theta for e in (experiment, changed))
    np.testing.assert_allclose(after[:30], 1.2 * before[:30], rtol=1e-12)
    np.testing.assert_array_equal(after[30:], before[30:])


def test_a_sweep_does_not_put_a_ready_kind_in_the_place_of_a_users_own() -> None:
    class Own(FullParameters):
        pass

    member = Member(ARM, Hold([0.0, 0.0]), parameters=Own(ARM))
    experiment = Experiment(Cell([member, replace(member)], Coupling.pair()), SMALL_GAINS, 1.0)
    with refused(InputError, "true parameters"):
        with_scaled_bodies(experiment, 1.2)
