"""MuJoCo: an independent judge of what robots do, and a whole cell as one of its models.

MuJoCo gets the robot's URDF and reads it with its own parser; no number of Pinocchio's model goes in but the
vector of gravity and the rotors' inertia, which a URDF does not have. Contacts, joint limits and the URDF's
damping are off: friction is that of the cell's members, as for every plant. A judge that reads other bodies
than those of the model would blame the law, so its mass matrix is compared with the model's beforehand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, positive_number
from ..coupling.cell import Cell
from ..errors import InputError, MissingDependencyError
from ..robots.forest import common_gravity
from ..robots.model import PerThread
from ..robots.robot import Robot
from ..robots.urdf.document import Document
from ..robots.urdf.writer import dynamics_xml

#: nothing is balanced, bounded or left out when MuJoCo compiles the description
COMPILER = '<mujoco><compiler balanceinertia="false" boundmass="0" boundinertia="0"/></mujoco>'

#: the first major version that reads inertias in turned axes rightly
OLDEST = 4
#: by how much mass matrices may differ, relative to their diagonal: MuJoCo finds principal axes to 1e-8
SAME_MASS = 1e-6
#: in how many configurations mass matrices are compared
CONFIGURATIONS = 4
#: thickness of what is drawn, m, and as a share of its length; shorter ones are left out, m
RADIUS, SLENDER, SHORTEST = 0.04, 0.15, 1e-3


class MujocoArm:
    """One robot's forward dynamics by MuJoCo.

    Args:
        robot: a robot that has a URDF.

    Raises:
        MissingDependencyError: MuJoCo is not installed, or an old version of it.
        InputError: the robot has no URDF, MuJoCo refuses it, or reads another mass matrix than the model's.
    """

    def __init__(self, robot: Robot):
        self._mujoco = mujoco = require_mujoco()
        self._robot, text = robot, describe_arm(robot)
        try:
            self.model = model = mujoco.MjModel.from_xml_string(text)
        except ValueError as error:
            subject = f"plant='mujoco', robot '{robot.name}'"
            raise InputError(f"MuJoCo refuses its URDF: {error}", subject=subject) from error
        model.opt.gravity = robot.gravity_vector
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        names = [model.joint(k).name for k in range(model.njnt)]
        self._order = np.array([names.index(name) for name in robot.joint_names])
        model.dof_damping[:] = 0
        model.dof_armature[self._order] = robot.armature
        self._data, self.nv = PerThread(partial(mujoco.MjData, model)), robot.nv
        self._check_mass(robot)

    def acceleration(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """v', (nv,), under joint torques tau, (nv,); a row (1, nv) of each will do."""
        data, order = self._data.own, self._order
        data.qpos[order], data.qvel[order], data.qfrc_applied[order] = q.ravel(), v.ravel(), tau.ravel()
        self._mujoco.mj_forward(self.model, data)
        return data.qacc[order]

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """M(q), (nv, nv), as MuJoCo computes it, kg·m^2."""
        data = self._data.own
        data.qpos[self._order] = q
        self._mujoco.mj_forward(self.model, data)
        rows = np.zeros((self.nv, self.nv))
        for row, unit in zip(rows, np.eye(self.nv), strict=True):
            self._mujoco.mj_mulM(self.model, data, row, unit)
        return rows[np.ix_(self._order, self._order)]

    def _check_mass(self, robot: Robot) -> None:
        """Refuse a robot whose mass matrix by MuJoCo is not its model's."""
        for q in np.random.default_rng(0).uniform(-1.5, 1.5, (CONFIGURATIONS, self.nv)):
            expected, found = robot.mass_matrix(q), self.mass_matrix(q)
            size = np.sqrt(np.diag(expected))
            off = (np.abs(found - expected) / np.outer(size, size)).max(axis=0)
            if off.max() > SAME_MASS:
                joint, version = robot.joint_names[off.argmax()], self._mujoco.__version__
                raise InputError(
                    "expected a URDF that describes the model, found another mass matrix in MuJoCo "
                    f"{version}, by {off.max():.2g} of its diagonal at joint '{joint}'",
                    subject=f"plant='mujoco', robot '{robot.name}'",
                    found=joint,
                )

    def __reduce__(self) -> tuple:
        """Copies and other processes make the scratch memory anew."""
        return type(self), (self._robot,)


def require_mujoco() -> Any:
    """MuJoCo.

    Raises:
        MissingDependencyError: it is not installed, or too old.
    """
    try:
        import mujoco
    except ImportError as error:
        raise MissingDependencyError(
            "plant='mujoco' needs it: pip install 'synctrl[mujoco]'", subject="MuJoCo"
        ) from error
    if int(mujoco.__version__.partition(".")[0]) < OLDEST:
        raise MissingDependencyError(
            f"plant='mujoco' needs {OLDEST}.0 or newer, found {mujoco.__version__}, which reads inertias in "
            "turned axes wrongly; install one with: pip install --upgrade 'synctrl[mujoco]'",
            subject="MuJoCo",
            found=mujoco.__version__,
        )
    return mujoco


def describe_arm(robot: Robot) -> str:
    """The robot's URDF as MuJoCo gets it.

    Raises:
        InputError: the robot has none.
    """
    if robot.document is None:
        raise InputError(
            "MuJoCo reads a robot's URDF, and there is none that describes this one; use load_robot, or "
            "plant='pinocchio'",
            subject=f"plant='mujoco', robot '{robot.name}'",
        )
    text = dynamics_xml(_for_mujoco(robot.document))
    start = text.index(">", text.index("<robot")) + 1
    return text[:start] + COMPILER + text[start:]


def _for_mujoco(document: Document) -> Document:
    """The document for every version of MuJoCo.

    Inertias are in the axes of their links, for those that overlook other axes. And no link is called
    "world", which MuJoCo takes for its own, wherever it stands.
    """

    def name(link: str) -> str:
        return "root link" if link == "world" else link

    links = tuple(
        replace(link, name=name(link.name), inertial=link.inertial and link.inertial.in_link_axes)
        for link in document.links
    )
    joints = tuple(replace(j, parent=name(j.parent), child=name(j.child)) for j in document.joints)
    return replace(document, links=links, joints=joints)


# -- a whole cell ------------------------------------------------------------------------------------------


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
    spec = side_by_side(cell.robots)
    spec.option.timestep = positive_number("timestep", timestep)
    joints = [f"{i}/{name}" for i, robot in enumerate(cell.robots) for name in robot.joint_names]
    for name in joints:
        spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT).set_to_motor()
    model = spec.compile()
    joint_map = _joint_map(cell, model, joints)
    _set_friction(cell, model, joint_map)
    return model, joint_map


def side_by_side(robots: Sequence[Robot]) -> Any:
    """Robots in one editable description, each where it stands; names of robot k begin with "k/".

    Raises:
        MissingDependencyError, InputError: see `mujoco_model`.
    """
    mujoco = require_mujoco()
    spec = mujoco.MjSpec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.gravity = common_gravity(robots)
    for i, robot in enumerate(robots):
        spec.attach(_arm(mujoco, robot), prefix=f"{i}/", frame=spec.worldbody.add_frame())
    return spec


def _arm(mujoco: Any, robot: Robot) -> Any:
    """A robot as MuJoCo's editable description, with capsules to look at."""
    MujocoArm(robot)  # compares what MuJoCo reads with the model
    arm = mujoco.MjSpec.from_string(describe_arm(robot))
    for body in arm.bodies:
        for end in [child.pos for child in body.bodies] or [body.ipos]:
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
    mask = np.arange(cell.nv) < np.array([[robot.nv] for robot in cell.robots])
    qpos = np.array([model.joint(name).qposadr[0] for name in joints])
    dof = np.array([model.joint(name).dofadr[0] for name in joints])
    motor = np.array([model.actuator(name).id for name in joints])
    return JointMap(cell, mask, qpos, dof, motor)


def _set_friction(cell: Cell, model: Any, joints: JointMap) -> None:
    """Friction and rotors of the cell, and nothing of what the documents say of stops and limits."""
    model.jnt_limited[:] = model.jnt_actfrclimited[:] = 0
    members = [(member.robot.nv, member.friction) for member in cell.members]
    rows = {
        "dof_damping": [np.broadcast_to(friction.viscous, nv) for nv, friction in members],
        "dof_frictionloss": [np.broadcast_to(friction.coulomb, nv) for nv, friction in members],
        "dof_armature": [robot.armature for robot in cell.robots],
    }
    for name, row in rows.items():
        getattr(model, name)[joints.dof] = np.concatenate(row)
