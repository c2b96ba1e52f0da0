"""An independent judge: robots as MuJoCo reads and computes them.

MuJoCo gets the robot's URDF and reads it with its own parser; no number of Pinocchio's model goes in but the
vector of gravity and the rotors' inertia, which a URDF does not have. Contacts, joint limits and the URDF's
damping are off: friction is that of the cell's members, as for every plant.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..errors import InputError, MissingDependencyError
from ..robots.per_thread import PerThread
from ..robots.robot import Robot
from ..robots.urdf_document import Document
from ..robots.urdf_writer import dynamics_xml

#: nothing is balanced, bounded or left out when MuJoCo compiles the description
COMPILER = '<mujoco><compiler balanceinertia="false" boundmass="0" boundinertia="0"/></mujoco>'


class MujocoArm:
    """One robot's forward dynamics by MuJoCo.

    Args:
        robot: a robot that has a URDF.

    Raises:
        MissingDependencyError: MuJoCo is not installed.
        InputError: the robot has no URDF, or MuJoCo refuses it.
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

    def acceleration(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """v', (nv,), under joint torques tau, (nv,); a row (1, nv) of each will do."""
        data, order = self._data.own, self._order
        data.qpos[order], data.qvel[order], data.qfrc_applied[order] = q.ravel(), v.ravel(), tau.ravel()
        self._mujoco.mj_forward(self.model, data)
        return data.qacc[order]

    def __reduce__(self) -> tuple:
        """Copies and other processes make the scratch memory anew."""
        return type(self), (self._robot,)


def require_mujoco() -> Any:
    """MuJoCo.

    Raises:
        MissingDependencyError: it is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise MissingDependencyError(
            "plant='mujoco' needs MuJoCo; install it with: pip install 'synctrl[mujoco]'"
        ) from error
    return mujoco


def _model(mujoco: Any, robot: Robot) -> Any:
    if robot.document is None:
        raise InputError(
            f"plant='mujoco' reads a robot's URDF, and robot '{robot.name}' has none that describes it; use "
            "load_robot, or plant='pinocchio'"
        )
    text = dynamics_xml(_named(robot.document, "world", "root link"))
    start = text.index(">", text.index("<robot")) + 1
    try:
        return mujoco.MjModel.from_xml_string(text[:start] + COMPILER + text[start:])
    except ValueError as error:
        raise InputError(f"MuJoCo refuses the URDF of robot '{robot.name}': {error}") from error


def _named(document: Document, old: str, new: str) -> Document:
    """The document with a link renamed: MuJoCo takes one called "world" for its own, wherever it stands."""

    def name(link: str) -> str:
        return new if link == old else link

    links = tuple(replace(link, name=name(link.name)) for link in document.links)
    joints = tuple(replace(j, parent=name(j.parent), child=name(j.child)) for j in document.joints)
    return replace(document, links=links, joints=joints)
