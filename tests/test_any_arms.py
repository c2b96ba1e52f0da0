"""Objects in the hands of any arms: several, of different kinds, redundant ones, in any task space."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from test_assembly import energies, rates_of_fixtures

from synctrl import (
    AxisRotation,
    CartesianSpace,
    Cell,
    Coupling,
    Experiment,
    Friction,
    Gains,
    Hold,
    JointSpace,
    Member,
    PoseSpace,
    PoseTrajectory,
    Robot,
    load_robot,
)
from synctrl.assembly.body import CarriedObject, place_of
from synctrl.assembly.grasp import Fixture, Grasp, grasp_matrix
from synctrl.assembly.plant import CarryingPlant
from synctrl.simulation.plant import Plant

BODY = CarriedObject(3.0, (0.02, 0.01, -0.03), (0.05, 0.06, 0.08))
SOFT = Fixture((5e3, 50.0), (40.0, 0.1))
UR = (0.0, -1.5, 2.0, -0.5, np.pi / 2, 0.0)
POSTURES = {
    "ur3": UR, "ur5": UR, "ur10": UR,
    "panda": (0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8),
    "xarm7": (0.0, -0.3, 0.0, 1.2, 0.0, 1.5, 0.0),
    "kinova": (0.0, 2.9, 1.3, 4.2, 1.4, 0.0),
    "a460": (0.0, 0.5, -1.0),
}  # fmt: skip
#: kinds of arms, and the space in which they are told what to do
CELLS = {
    "poses of three kinds, one redundant": (("ur5", "panda", "ur10"), PoseSpace()),
    "positions of arms with three to seven joints": (
        ("a460", "xarm7", "kinova"),
        CartesianSpace("xyz"),
    ),
    "joints of five arms": (("ur5", "ur3", "ur10", "kinova", "ur5"), JointSpace()),
}


def standstill(robot: Robot, q: np.ndarray, space):
    """The motion of a robot that stays where it is."""
    if isinstance(space, JointSpace):
        return Hold(q)
    pose = robot.tip_pose(q)
    place = Hold(pose.translation)
    return place if space.m == 3 else PoseTrajectory(place, AxisRotation.fixed(pose.rotation))


def cell_of(kinds: tuple[str, ...], space) -> Cell:
    """Arms on a circle, at rest."""
    members = []
    for i, kind in enumerate(kinds):
        turn, q = 2 * np.pi * i / len(kinds), np.array(POSTURES[kind])
        base = -0.8 * np.array([np.cos(turn), np.sin(turn), 0.0])
        robot = load_robot(kind).placed(base, (0.0, 0.0, turn), name=f"{kind} {i + 1}")
        motion = standstill(robot, q, space)
        members.append(Member(robot, motion, q0=q, friction=Friction(), name=robot.name))
    return Cell(members, Coupling.signed_ring(len(kinds)), space)


def carrying(name: str, hands: Iterable[int] | None = None) -> Experiment:
    """A cell in which all robots, or some, hold an object between them."""
    cell = cell_of(*CELLS[name])
    grasps = [Grasp(i, compliance=SOFT) for i in (range(cell.n) if hands is None else hands)]
    at = (np.array([0.05, -0.02, 0.4]), np.eye(3))
    gains = Gains(Lambda=4.0, beta=4.0, K_r=0.1, K_eps=1.0, Gamma=0.0)
    plant = partial(CarryingPlant, body=BODY, grasps=grasps, at=at)
    return Experiment(cell, gains, 0.5, plant_type=plant)


def somewhere(plant: CarryingPlant, seed: int) -> tuple[np.ndarray, ...]:
    """q, v, tau and the state of the object near the start, where springs are stretched."""
    rng, moving = np.random.default_rng(seed), moving_joints(plant.robots)
    q, v, tau = (size * rng.normal(size=moving.shape) * moving for size in (1e-2, 0.2, 5.0))
    hidden = plant.hidden0.copy()
    hidden[7:] = 0.1 * rng.normal(size=6)
    return plant.cell.q0 + q, v, tau, hidden


def moving_joints(robots: Sequence[Robot]) -> np.ndarray:
    """1 where a robot has such a joint, (n, nv)."""
    most = max(robot.nv for robot in robots)
    return np.array([np.arange(most) < robot.nv for robot in robots], float)


@pytest.mark.parametrize("name", CELLS)
def test_arms_of_any_kinds_keep_their_energy_with_the_object_but_for_torque_and_damping(name):
    plant = carrying(name).closed_loop().plant
    q, v, tau, hidden = somewhere(plant, 1)
    rates, h = plant.move(q, v, tau, hidden), 1e-6

    def energy(s: float) -> float:
        return energies(plant, q + s * v, v + s * rates[0], hidden + s * rates[1])

    slips = rates_of_fixtures(plant, q, v, hidden)
    power = float(np.sum(tau * v) - np.sum(plant.D * slips**2))
    assert (energy(h) - energy(-h)) / (2 * h) == pytest.approx(power, rel=1e-4)


@pytest.mark.parametrize("name", CELLS)
def test_the_hands_of_a_run_carry_the_weight_and_what_they_squeeze_beside_it_cancels(name):
    run = carrying(name).simulate(0.02, dt=2e-4)
    R = place_of(run.outputs["object_pose"])[1]
    nu, h = run.outputs["object_twist"], run.outputs["hand_wrench"]
    com = nu[:, :3] + np.cross(nu[:, 3:], R @ BODY.com)
    load = h[..., :3].sum(axis=1) + BODY.mass * np.array([0.0, 0.0, -9.81])
    gained = make_interp_spline(run.t, load, k=3).antiderivative()(run.t)
    np.testing.assert_allclose(BODY.mass * com, gained, atol=1e-6)
    arms = np.array([grasp["arm"] for grasp in run.info["grasps"]]) @ R.mT
    squeeze = np.matvec(grasp_matrix(arms), run.outputs["internal_force"]).sum(axis=1)
    assert h.shape == (len(run.t), len(CELLS[name][0]), 6) and np.abs(h).max() > 0.1
    np.testing.assert_allclose(squeeze, 0.0, atol=1e-9)


def test_an_arm_with_an_empty_hand_moves_as_it_does_alone():
    name = "joints of five arms"
    plant = carrying(name, hands=(3, 0)).closed_loop().plant
    q, v, tau, hidden = somewhere(plant, 2)
    free = Plant(plant.cell).acceleration(q, v, tau)
    held = plant.move(q, v, tau, hidden)[0]
    np.testing.assert_array_equal(held[[1, 2, 4]], free[[1, 2, 4]])
    assert (np.abs(held[[0, 3]] - free[[0, 3]]).max(axis=1) > 1e-3).all()
