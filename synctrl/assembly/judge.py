"""MuJoCo as judge of robots that hold an object: all of them and the object as one of its models.

MuJoCo reads the robots' descriptions with its own parser, see `simulation/mujoco.py`, and the object is a
body that floats freely. Grasps that do not give are its welds, which are springs of its own making and give a
little after all. Fixtures are those of `grasp.py` by another formula: the velocities of hand and object are
compared at one and the same point, and there force and moment act and react. The numbers from outside are
mass, centre of mass and inertia of the object, and where the hands are on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ..errors import InputError
from ..robots.model import PerThread
from ..robots.robot import Robot
from ..simulation.mujoco import require_mujoco, side_by_side
from ..tasks.rotations import quaternion
from .body import CarriedObject

#: spring and damper of a weld, 1/s^2 and 1/s, and how hard it is, of which MuJoCo allows no more
WELD, HARDNESS = (-1e4, -200.0), (0.9999, 0.9999, 1e-3, 0.5, 2.0)
#: how exactly MuJoCo finds the forces of welds
TOLERANCE, ITERATIONS = 1e-14, 100
#: by how much the largest principal moment is below the sum of the others, as a share of it
THIN = 1e-14
#: what the object is called in the model
OBJECT = "object"

Motion = tuple[np.ndarray, np.ndarray, np.ndarray]


class JudgedChain:
    """Robots and the object that some of them hold, in MuJoCo; how they hold it is up to subclasses.

    Every thread that uses it has scratch memory of its own.

    Args:
        robots: the robots, which need URDFs; their hands are their tips.
        hands: which of them hold the object, counted from 0.
        body: the object.
        places: places, (k, 3), m, and orientations, (k, 3, 3), of these hands in its axes.

    Raises:
        MissingDependencyError: MuJoCo is not installed, or too old.
        InputError: what MuJoCo refuses, see `mujoco_model`, or a tip that is no link of its URDF.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        hands: Sequence[int],
        body: CarriedObject,
        places: tuple[np.ndarray, np.ndarray],
    ):
        self._mujoco = mujoco = require_mujoco()
        joints = np.array([robot.nv for robot in robots])
        self._mask, self._count = np.arange(joints.max()) < joints[:, None], len(hands)
        spec = side_by_side(robots)
        _add_object(spec, body)
        for k, (hand, xyz, R) in enumerate(zip(hands, *places, strict=True)):
            _tip(spec, hand, robots[hand]).add_site(name=f"hand {k}")
            spec.body(OBJECT).add_site(name=f"place {k}", pos=xyz, quat=_quaternion(R))
            self._hold(spec, k)
        self.model = model = _compiled(spec)
        names = [f"{i}/{name}" for i, robot in enumerate(robots) for name in robot.joint_names]
        self._qpos = np.array([model.joint(name).qposadr[0] for name in names])
        self._dof = np.array([model.joint(name).dofadr[0] for name in names])
        free = model.joint(OBJECT)
        self._pose, self._twist = free.qposadr[0] + np.arange(7), free.dofadr[0] + np.arange(6)
        model.dof_armature[self._dof] = np.concatenate([robot.armature for robot in robots])
        model.dof_damping[:] = model.dof_frictionloss[:] = model.jnt_limited[:] = 0
        self._data = PerThread(partial(mujoco.MjData, model))

    def _hold(self, spec: Any, k: int) -> None:
        """Put into the description what ties hand k to its place."""

    def _written(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, pose: np.ndarray, nu: np.ndarray
    ) -> Any:
        """MuJoCo's data in a state, with torques, and with kinematics computed; see `RigidChain.motion`."""
        data, mask = self._data.own, self._mask
        data.qpos[self._qpos], data.qpos[self._pose] = q[mask], pose[[0, 1, 2, 6, 3, 4, 5]]
        self._mujoco.mj_kinematics(self.model, data)
        self._mujoco.mj_comPos(self.model, data)
        data.qvel[self._dof], data.qvel[self._twist] = v[mask], (*nu[:3], *(nu[3:] @ self._axes(data)))
        data.qfrc_applied[:] = 0
        data.qfrc_applied[self._dof] = tau[mask]
        return data

    def _accelerations(self, data: Any) -> tuple[np.ndarray, np.ndarray]:
        """v', (n, nv), and nu', (6,): MuJoCo keeps angular velocity in the object's axes."""
        self._mujoco.mj_forward(self.model, data)
        v_dot, rate = np.zeros(self._mask.shape), data.qacc[self._twist]
        v_dot[self._mask] = data.qacc[self._dof]
        return v_dot, np.concatenate((rate[:3], self._axes(data) @ rate[3:]))

    def _axes(self, data: Any) -> np.ndarray:
        """Orientation of the object, (3, 3)."""
        return data.body(OBJECT).xmat.reshape(3, 3)


class WeldedChain(JudgedChain):
    """`JudgedChain` with grasps that do not give."""

    def __init__(self, *parts: Any):
        super().__init__(*parts)
        mujoco, option = self._mujoco, self.model.opt
        option.solver, option.jacobian = mujoco.mjtSolver.mjSOL_NEWTON, mujoco.mjtJacobian.mjJAC_DENSE
        option.tolerance, option.iterations = TOLERANCE, ITERATIONS
        option.disableflags |= mujoco.mjtDisableBit.mjDSBL_WARMSTART  # else a force depends on the one before

    def motion(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, pose: np.ndarray, nu: np.ndarray
    ) -> Motion:
        """See `RigidChain.motion`."""
        data = self._written(q, v, tau, pose, nu)
        v_dot, nu_dot = self._accelerations(data)
        rows = data.efc_J.reshape(data.nefc, -1)[:, self._twist] * data.efc_force[:, None]
        h = np.array([rows[data.efc_id == k].sum(axis=0) for k in range(self._count)])
        h[:, 3:] = h[:, 3:] @ self._axes(data).T
        return v_dot, nu_dot, h

    def _hold(self, spec: Any, k: int) -> None:
        mujoco = self._mujoco
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_WELD,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            name1=f"hand {k}",
            name2=f"place {k}",
            solref=WELD,
            solimp=HARDNESS,
        )


class SprungChain(JudgedChain):
    """`JudgedChain` with fixtures.

    Args:
        K, D: stiffness and damping of the six directions, (k, 6).
        parts: of `JudgedChain`.
    """

    def __init__(self, K: np.ndarray, D: np.ndarray, *parts: Any):
        super().__init__(*parts)
        self._K, self._D = K, D

    def motion(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, pose: np.ndarray, nu: np.ndarray
    ) -> Motion:
        """See `RigidChain.motion`."""
        data = self._written(q, v, tau, pose, nu)
        h = np.array([self._push(data, k) for k in range(self._count)])
        return *self._accelerations(data), h

    def _push(self, data: Any, k: int) -> np.ndarray:
        """Let fixture k act on what it ties; its wrench on the object about the object's origin, (6,)."""
        mujoco, model = self._mujoco, self.model
        hand, place = data.site(f"hand {k}"), data.site(f"place {k}")
        bodies = [int(model.site_bodyid[site.id]) for site in (hand, place)]
        jacobians = np.zeros((2, 6, model.nv))
        for J, body in zip(jacobians, bodies, strict=True):
            mujoco.mj_jac(model, data, J[:3], J[3:], place.xpos, body)
        turned, (q_h, q_g) = np.zeros(3), np.zeros((2, 4))
        mujoco.mju_mat2Quat(q_h, hand.xmat), mujoco.mju_mat2Quat(q_g, place.xmat)
        mujoco.mju_subQuat(turned, q_h, q_g)  # in the axes of the place
        apart = np.concatenate((hand.xpos - place.xpos, place.xmat.reshape(3, 3) @ turned))
        wrench = self._K[k] * apart + self._D[k] * ((jacobians[0] - jacobians[1]) @ data.qvel)
        data.qfrc_applied += (jacobians[1] - jacobians[0]).T @ wrench
        lever = place.xpos - data.body(OBJECT).xpos
        return np.concatenate((wrench[:3], wrench[3:] + np.cross(lever, wrench[:3])))


def _add_object(spec: Any, body: CarriedObject) -> None:
    """The object, by its principal axes; for thin plates MuJoCo leaves no room for rounding."""
    moments, axes = np.linalg.eigh(body.inertia)
    moments[2] = min(moments[2], (1 - THIN) * (moments[0] + moments[1]))
    axes[:, 0] *= np.linalg.det(axes)
    turned = {"ipos": body.com, "iquat": _quaternion(axes), "inertia": moments}
    added = spec.worldbody.add_body(name=OBJECT, mass=body.mass, explicitinertial=True, **turned)
    added.add_freejoint(name=OBJECT)


def _tip(spec: Any, i: int, robot: Robot) -> Any:
    """The body that is the tip of robot i."""
    found = spec.body(f"{i}/{robot.tip}")
    if found is None:
        raise InputError(
            f"MuJoCo knows links of URDFs, and the tip '{robot.tip}' is none",
            subject=f"plant='mujoco', robot '{robot.name}'",
            found=robot.tip,
        )
    return found


def _quaternion(R: np.ndarray) -> np.ndarray:
    """In MuJoCo's order, w x y z."""
    return np.roll(quaternion(R), 1)


def _compiled(spec: Any) -> Any:
    try:
        return spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo refuses it: {error}", subject="plant='mujoco', object") from error
