"""An independent judge: robots as MuJoCo reads and computes them.

MuJoCo gets the robot's URDF and reads it with its own parser; no number of Pinocchio's model goes in but the
vector of gravity and the rotors' inertia, which a URDF does not have. Contacts, joint limits and the URDF's
damping are off: friction is that of the cell's members, as for every plant. A judge that reads other bodies
than those of the model would blame the law, so its mass matrix is compared with the model's beforehand.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..errors import InputError, MissingDependencyError
from ..robots.per_thread import PerThread
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
        self._robot = robot
        self.model = model = _model(mujoco, robot)
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
            "plant='mujoco' needs MuJoCo; install it with: pip install 'synctrl[mujoco]'"
        ) from error
    if int(mujoco.__version__.partition(".")[0]) < OLDEST:
        raise MissingDependencyError(
            f"plant='mujoco' needs MuJoCo {OLDEST}.0 or newer, found {mujoco.__version__}, which reads "
            "inertias in turned axes wrongly; install one with: pip install --upgrade 'synctrl[mujoco]'",
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


def _model(mujoco: Any, robot: Robot) -> Any:
    text = describe_arm(robot)
    try:
        return mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise InputError(f"MuJoCo refuses the URDF of robot '{robot.name}': {error}") from error


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
