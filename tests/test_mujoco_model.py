"""A whole cell as one MuJoCo model: the same bodies, friction and gravity, and a loop of one's own in it."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from cells import small_cell
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    DiscreteController,
    Experiment,
    Friction,
    Gains,
    Hold,
    Member,
    Robot,
    load_robot,
    mujoco_model,
)
from synctrl.errors import InputError, MissingDependencyError
from synctrl.experiments import ur5_payload
from synctrl.simulation.mujoco import JointMap, MujocoArm

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is an extra: pip install 'synctrl[mujoco]'")

ROOT = Path(__file__).parents[1]
#: equal up to rounding in chains of seven bodies
SAME = 1e-10

CELLS = {
    "two of a kind": ("ur5", "ur5"),
    "of different kinds": ("panda", "a460", "planar2r"),
    "same names of links and joints": ("a460", "a460_full", "a460"),
    "others": ("xarm7", "kinova"),
}


def standing(names: Sequence[str], friction: Friction | None = None) -> Cell:
    """Robots that stand turned and tilted, with rotors, and hold still."""
    rng = np.random.default_rng(len(names))
    members = []
    for name in names:
        robot = load_robot(name).placed(rng.normal(size=3), rng.uniform(-2, 2, 3)).with_armature(0.02)
        members.append(Member(robot, Hold(np.zeros(robot.nv)), friction=friction or Friction()))
    width = members[0].robot.nv
    if any(member.robot.nv != width for member in members):
        return mixed(members)
    return Cell(members, Coupling.pair())


def mixed(members: Sequence[Member]) -> Cell:
    """A cell for robots with different numbers of joints: it is about one coordinate of their tips."""

    def held(member: Member) -> Member:
        q = np.full(member.robot.nv, 0.3)
        tip = member.robot.tip_position(q)[:1]
        return Member(member.robot, Hold(tip), q, friction=member.friction)

    size = len(members)
    coupling = Coupling.chain(size) if size > 2 else Coupling.pair()
    return Cell([held(member) for member in members], coupling, CartesianSpace("x"))


def random_motion(joints: JointMap, seed: int = 0) -> np.ndarray:
    """q, v and tau, (3, n, nv), zero where there is no joint."""
    shape = joints.mask.shape
    return np.random.default_rng(seed).uniform(-2, 2, (3, *shape)) * joints.mask


def accelerations(model, joints: JointMap, motion: np.ndarray) -> np.ndarray:
    """v', (n, nv), that MuJoCo finds."""
    data = mujoco.MjData(model)
    joints.write(data, *motion[:2]), joints.command(data, motion[2])
    mujoco.mj_forward(model, data)
    found = np.zeros(joints.mask.shape)
    found[joints.mask] = data.qacc[joints.dof]
    return found


@pytest.mark.parametrize("name", CELLS)
def test_what_is_written_is_read_again_and_every_joint_has_its_motor(name):
    model, joints = mujoco_model(standing(CELLS[name]))
    data = mujoco.MjData(model)
    q, v, tau = random_motion(joints)
    joints.write(data, q, v), joints.command(data, tau)
    np.testing.assert_array_equal(joints.read(data), (q, v))
    mujoco.mj_forward(model, data)
    torques = np.zeros(q.shape)
    torques[joints.mask] = data.qfrc_actuator[joints.dof]
    np.testing.assert_allclose(torques, tau, atol=1e-14)
    assert model.nv == model.nu == joints.mask.sum() == sum(robot.nv for robot in joints.cell.robots)


@pytest.mark.parametrize("name", CELLS)
def test_a_cell_accelerates_as_its_robots_do_one_by_one(name):
    cell = standing(CELLS[name])
    model, joints = mujoco_model(cell)
    arms = [MujocoArm(robot) for robot in cell.robots]
    for seed in range(5):
        motion = random_motion(joints, seed)
        found = accelerations(model, joints, motion)
        for i, robot in enumerate(cell.robots):
            own = motion[:, i, : robot.nv]
            for expected in (robot.forward_dynamics(*own), arms[i].acceleration(*own)):
                assert np.abs(found[i, : robot.nv] - expected).max() <= SAME * np.abs(expected).max()


@pytest.mark.parametrize("name", CELLS)
def test_the_mass_matrix_is_that_of_the_robots(name):
    cell = standing(CELLS[name])
    model, joints = mujoco_model(cell)
    data = mujoco.MjData(model)
    q, v, _ = random_motion(joints, 7)
    joints.write(data, q, v)
    mujoco.mj_forward(model, data)
    product, unit, at = np.zeros(model.nv), np.eye(model.nv), 0
    for i, robot in enumerate(cell.robots):
        expected, own = robot.mass_matrix(q[i, : robot.nv]), joints.dof[at : at + robot.nv]
        for k in range(robot.nv):
            mujoco.mj_mulM(model, data, product, unit[own[k]])
            np.testing.assert_allclose(product[own], expected[k], atol=SAME * np.abs(expected).max())
            assert not np.delete(product, own).any()
        at += robot.nv


def test_viscous_friction_acts_as_on_the_plant():
    friction = Friction(viscous=3.0)
    cell = standing(("a460", "a460"), friction)
    model, joints = mujoco_model(cell)
    motion = random_motion(joints)
    plant = Experiment(cell, Gains(1, 1, 1, 1, 1), 0.1).closed_loop().plant
    expected = plant.acceleration(*motion)
    np.testing.assert_allclose(
        accelerations(model, joints, motion), expected, atol=SAME * np.abs(expected).max()
    )


def moved(cell: Cell, v: float, tau: float) -> np.ndarray:
    """How far the joints have moved after 0.2 s, (n, nv), rad, from a speed and under a constant torque."""
    model, joints = mujoco_model(cell)
    data = mujoco.MjData(model)
    joints.write(data, cell.q0, np.full(cell.q0.shape, v))
    joints.command(data, np.full(cell.q0.shape, tau))
    for _ in range(200):
        mujoco.mj_step(model, data)
    return joints.read(data)[0] - cell.q0


def test_dry_friction_brakes_and_holds():
    """MuJoCo's own kind: what moves is braked by it, and what stands is held against less than it."""
    cell = small_cell()
    dry = [Member(m.robot, m.trajectory, m.q0, friction=Friction(coulomb=0.5)) for m in cell.members]
    rough = Cell(dry, cell.coupling, cell.space)
    for motion in ((0.5, 0.0), (0.0, 0.1)):
        assert np.linalg.norm(moved(rough, *motion)) < 0.6 * np.linalg.norm(moved(cell, *motion))
    braked, free = (mujoco_model(each)[0].dof_frictionloss for each in (rough, cell))
    assert set(braked) == {0.5} and not free.any()


def test_joints_have_no_stops_and_no_friction_but_that_of_the_members():
    model, joints = mujoco_model(standing(("panda", "panda")))
    motion = random_motion(joints)
    motion[0] = 5.0
    found = accelerations(model, joints, motion)
    for i, robot in enumerate(joints.cell.robots):
        expected = robot.forward_dynamics(*motion[:, i])
        np.testing.assert_allclose(found[i], expected, atol=1e-9 * np.abs(expected).max())


def test_what_is_drawn_weighs_nothing_and_touches_nothing():
    cell = ur5_payload().cell
    model, joints = mujoco_model(cell)
    assert model.ngeom >= 6 * cell.n
    assert not model.geom_contype.any() and not model.geom_conaffinity.any()
    data = mujoco.MjData(model)
    joints.write(data, cell.q0, cell.v0)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    elbow = data.body("0/forearm_link").xpos
    upper_arm = int(model.body("0/upper_arm_link").geomadr[0])
    ends = data.geom_xpos[upper_arm] + np.outer(
        (-1, 1), model.geom_size[upper_arm, 1] * data.geom_xmat[upper_arm].reshape(3, 3)[:, 2]
    )
    assert np.linalg.norm(ends - elbow, axis=1).min() < 1e-9


@pytest.mark.parametrize("bad", [np.zeros((2, 3)), np.full((2, 2), np.nan), "torque", None])
def test_arrays_of_another_kind_are_refused_and_nothing_is_written(bad):
    model, joints = mujoco_model(small_cell())
    data = mujoco.MjData(model)
    good = np.ones((2, 2))
    for name, arguments in {"q": (bad, good), "v": (good, bad)}.items():
        with refused(InputError, name):
            joints.write(data, *arguments)
    with refused(InputError, "tau"):
        joints.command(data, bad)
    assert not data.qpos.any() and not data.qvel.any() and not data.ctrl.any()


def test_a_cell_that_mujoco_cannot_have_is_refused():
    arm = load_robot("a460")
    other = arm.with_parameters(1.1 * arm.inertial_parameters)
    bare = Robot(arm.model, arm.tip, name=arm.name)
    with refused(InputError, "plant='mujoco', robot 'a460'"):
        mujoco_model(holding(bare))
    changed = Robot(other.model, other.tip, document=arm.document)
    with refused(InputError, "plant='mujoco', robot 'a460'"):
        mujoco_model(holding(changed))
    model = arm.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -1.62])
    moon = Robot(model, arm.tip, name="moon", document=arm.document)
    with refused(InputError, "robot 'moon'", found=(0.0, 0.0, -1.62)):
        mujoco_model(holding(arm, moon))


def holding(*robots: Robot) -> Cell:
    """Two robots, or one twice, that hold still."""
    pair = (robots * 2)[:2]
    return Cell([Member(robot, Hold(np.zeros(robot.nv))) for robot in pair], Coupling.pair())


@pytest.mark.parametrize("timestep", [0.0, -1e-3, np.nan, "1 ms"])
def test_a_timestep_that_is_none_is_refused(timestep):
    with refused(InputError, "timestep"):
        mujoco_model(small_cell(), timestep)
    with refused(InputError, "cell"):
        mujoco_model([small_cell()])


def test_without_mujoco_the_message_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with refused(MissingDependencyError, "MuJoCo"):
        mujoco_model(small_cell())


# -- the controller in MuJoCo's loop ----------------------------------------------------------------------

PERIOD = 2e-3


class Loop:
    """Two UR5 in MuJoCo under a digital controller, two steps a period."""

    def __init__(self) -> None:
        self.experiment = ur5_payload()
        self.model, self.joints = mujoco_model(self.experiment.cell, PERIOD / 2)
        self.data = mujoco.MjData(self.model)
        self.joints.write(self.data, self.experiment.cell.q0, self.experiment.cell.v0)

    def controller(self, **options: object) -> DiscreteController:
        controller = self.experiment.controller(PERIOD, **options)
        controller.reset(self.data.time, *self.joints.read(self.data))
        return controller

    def run(self, controller: DiscreteController, samples: int) -> np.ndarray:
        """Joint positions at the samples, (samples, n, nv)."""
        seen = []
        for _ in range(samples):
            q, v = self.joints.read(self.data)
            seen.append(q)
            self.joints.command(self.data, controller.step(self.data.time, q, v))
            for _ in range(2):
                mujoco.mj_step(self.model, self.data)
        return np.array(seen)


def test_a_loop_in_mujoco_moves_as_sampled_simulation_does():
    loop = Loop()
    seen = loop.run(loop.controller(), 50)
    run = loop.experiment.simulate(0.1, dt=PERIOD / 2, control_period=PERIOD, log_dt=PERIOD)
    np.testing.assert_allclose(seen, run.q[:50], atol=1e-8)
    assert np.abs(run.q[:50] - run.q[0]).max() > 1e-2


@pytest.mark.parametrize("split", [1, 17])
def test_a_loop_in_mujoco_that_is_continued_is_equal_bit_for_bit(split, tmp_path):
    whole, parts = Loop(), Loop()
    expected = whole.run(whole.controller(), 30)
    first = parts.controller()
    before = parts.run(first, split)
    second = ur5_payload().controller(PERIOD)
    second.load(first.save(tmp_path / "controller.npz"))
    np.testing.assert_array_equal(np.concatenate((before, parts.run(second, 30 - split))), expected)


def test_robots_that_carry_their_own_weight_move_the_same():
    plain, relieved = Loop(), Loop()
    whole, rest = plain.controller(), relieved.controller(include_gravity=False)
    for _ in range(30):
        expected = plain.run(whole, 1)
        q, _ = relieved.joints.read(relieved.data)
        weight = [robot.gravity(row) for robot, row in zip(relieved.experiment.cell.robots, q, strict=True)]
        relieved.data.qfrc_applied[relieved.joints.dof] = np.concatenate(weight)
        np.testing.assert_allclose(relieved.run(rest, 1), expected, atol=1e-9)
    assert np.abs(expected - plain.experiment.cell.q0).max() > 1e-2


def test_the_script_drives_two_arms_together():
    script = ROOT / "scripts" / "mujoco_loop.py"
    assert script.read_text("utf-8").count("\n") < 30
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    first, last = map(float, re.findall(r"([\d.]+) mm", done.stdout))
    assert last < 0.05 * first
