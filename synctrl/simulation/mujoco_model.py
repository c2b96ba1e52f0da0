"""A whole cell as one MuJoCo model, for loops of one's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, positive_number
from ..coupling.cell import Cell
from ..errors import InputError
from ..robots.robot import Robot
from .mujoco_plant import MujocoArm, describe_arm, require_mujoco

#: thickness of what is drawn, m, and as a share of its length; shorter ones are left out, m
RADIUS, SLENDER, SHORTEST = 0.04, 0.15, 1e-3


@dataclass(frozen=True, eq=False)
class JointMap:
    """Where the joints of a cell are in a MuJoCo model: rows of robots there, one long vector here.

    Attributes:
        cell: the cell.
        mask: which entries of (n, nv) are joints, (n, nv).
        qpos, dof, motor: their places in `data.qpos`, in `data.qvel` and in `data.ctrl`, one per joint, robot
            after robot.
    """

    cell: Cell
    mask: np.ndarray
    qpos: np.ndarray
    dof: np.ndarray
    motor: np.ndarray

    def read(self, data: Any) -> tuple[np.ndarray, np.ndarray]:
        """Joint positions and velocities in MuJoCo's data as (n, nv), rad and rad/s."""
        q, v = np.zeros((2, *self.mask.shape))
        q[self.mask], v[self.mask] = data.qpos[self.qpos], data.qvel[self.dof]
        return q, v

    def write(self, data: Any, q: ArrayLike, v: ArrayLike) -> None:
        """Put the cell into a state, (n, nv), rad and rad/s.

        Raises:
            InputError: another shape, or numbers that are not finite.
        """
        at, speed = finite_array("q", q, self.mask.shape), finite_array("v", v, self.mask.shape)
        data.qpos[self.qpos], data.qvel[self.dof] = at[self.mask], speed[self.mask]

    def command(self, data: Any, tau: ArrayLike) -> None:
        """Hand joint torques, (n, nv), N·m, to the motors, which hold them until the next call.

        Raises:
            InputError: another shape, or numbers that are not finite.
        """
        data.ctrl[self.motor] = finite_array("tau", tau, self.mask.shape)[self.mask]


def mujoco_model(cell: Cell, timestep: float = 1e-3) -> tuple[Any, JointMap]:
    """The robots of a cell as one `mujoco.MjModel`, each where it stands, and the map to rows of robots.

    MuJoCo reads the robots' URDF with its own parser. There is a motor of gear 1 per joint, so that
    `data.ctrl` is torque. As in `simulate`, joints have no stops, motors no limits, and bodies no contacts:
    they are drawn as capsules from joint to joint. The friction of the members is `dof_damping` where it is
    viscous and `dof_frictionloss` where it is Coulomb's, which MuJoCo smooths in its own way and `simulate`
    as a tanh. Names of robot k, counted from 0, begin with "k/". Payloads are not in it.

    Args:
        cell: the cell; its robots need URDFs.
        timestep: MuJoCo's, s; the method is RK4.

    Raises:
        MissingDependencyError: MuJoCo is not installed, or too old.
        InputError: a robot without a URDF, one that MuJoCo refuses or reads as another one, or robots in
            different gravity.
    """
    mujoco = require_mujoco()
    instance("cell", cell, Cell, "a Cell")
    spec = mujoco.MjSpec()
    spec.option.timestep = positive_number("timestep", timestep)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.gravity = _common_gravity(cell)
    for i, robot in enumerate(cell.robots):
        spec.attach(_arm(mujoco, robot), prefix=f"{i}/", frame=spec.worldbody.add_frame())
    joints = [f"{i}/{name}" for i, robot in enumerate(cell.robots) for name in robot.joint_names]
    for name in joints:
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
    model = spec.compile()
    joint_map = _joint_map(cell, model, joints)
    _set_friction(cell, model, joint_map)
    return model, joint_map


def _common_gravity(cell: Cell) -> np.ndarray:
    vectors = [robot.gravity_vector for robot in cell.robots]
    for name, vector in zip(cell.names, vectors, strict=True):
        if not np.array_equal(vector, vectors[0]):
            raise InputError(
                f"MuJoCo has one gravity for all robots, expected that of {cell.names[0]}, "
                f"{vectors[0].tolist()} m/s^2, for {name} as well, found {vector.tolist()}",
                subject="cell",
            )
    return vectors[0]


def _arm(mujoco: Any, robot: Robot) -> Any:
    """A robot as MuJoCo's editable description, with capsules to look at."""
    MujocoArm(robot)  # compares what MuJoCo reads with the model
    arm = mujoco.MjSpec.from_string(describe_arm(robot))
    for body in arm.bodies:
        ends = [child.pos for child in body.bodies] or [body.ipos]
        for end in ends:
            _draw(mujoco, body, end)
    return arm


def _draw(mujoco: Any, body: Any, end: np.ndarray) -> None:
    """A capsule from a body's origin to a place on it, (3,), m; it weighs nothing and touches nothing."""
    length = float(np.linalg.norm(end))
    if not length > SHORTEST:
        return
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0, 0, 0, *end],
        size=[min(RADIUS, SLENDER * length), 0, 0],
        contype=0,
        conaffinity=0,
        mass=0,
    )


def _joint_map(cell: Cell, model: Any, joints: list[str]) -> JointMap:
    count = np.array([robot.nv for robot in cell.robots])
    mask = np.arange(cell.nv) < count[:, None]
    qpos = np.array([model.joint(name).qposadr[0] for name in joints])
    dof = np.array([model.joint(name).dofadr[0] for name in joints])
    motor = np.array([model.actuator(name).id for name in joints])
    return JointMap(cell, mask, qpos, dof, motor)


def _set_friction(cell: Cell, model: Any, joints: JointMap) -> None:
    """Friction and rotors of the cell, and nothing of what the documents say of stops and limits."""
    model.jnt_limited[:] = model.jnt_actfrclimited[:] = 0
    viscous, coulomb, rotors = np.zeros((3, *joints.mask.shape))
    for i, member in enumerate(cell.members):
        nv = member.robot.nv
        viscous[i, :nv], coulomb[i, :nv] = member.friction.viscous, member.friction.coulomb
        rotors[i, :nv] = member.robot.armature
    for target, rows in (
        (model.dof_damping, viscous),
        (model.dof_frictionloss, coulomb),
        (model.dof_armature, rotors),
    ):
        target[joints.dof] = rows[joints.mask]
