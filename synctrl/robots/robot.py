"""Robot: a fixed-base mechanism and its rigid-body algorithms, the only owner of a Pinocchio model."""

from __future__ import annotations

from functools import cached_property, partial
from typing import Any, Self

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, per_joint
from ..errors import InputError
from ..renamed import names_elsewhere
from .friction import Friction
from .model import PerThread, check_inertia, check_joints, check_numbering, frame_id, joint_units
from .model import moved_shapes as _moved
from .origin import UNKNOWN, Origin
from .urdf.changes import with_bodies
from .urdf.document import Document, Pose
from .urdf.report import NOTHING, Report

_WORLD_AXES = pin.LOCAL_WORLD_ALIGNED
_regressor = pin.computeJointTorqueRegressor


class Robot:
    """A fixed-base robot with nv joints and one tip frame, placed in the world.

    Joint positions q, (nv,), are angles in rad (or m for a sliding joint, see `joint_units`), also for joints
    that turn without end, which Pinocchio stores as cosine and sine. Everything Cartesian is in world axes.

    The model is never changed after construction, and every thread that uses a Robot has scratch memory of
    its own: threads may share one. A robot and those that were placed from it have that memory in common.

    Args:
        model: rigid-body model, with a fixed base.
        tip: name of the frame whose motion is controlled in Cartesian space.
        visual: shapes for display, or None.
        name: what error messages and legends call it.
        document: the URDF that describes it, base and all; None if there is none.
        report: what was left out, assumed or held when its description was read, and what is suspicious.
        origin: how it was loaded and changed since; by default nobody knows.

    Raises:
        FrameNotFound: `tip` is not a frame of the model.
        RobotError: joints with several velocities, as a floating base has, or not numbered branch by branch.
    """

    def __init__(
        self,
        model: pin.Model,
        tip: str,
        *,
        visual: pin.GeometryModel | None = None,
        name: str | None = None,
        document: Document | None = None,
        report: Report = NOTHING,
        origin: Origin = UNKNOWN,
    ):
        instance("model", model, pin.Model, "a Pinocchio model, for example from load_robot")
        self.model, self.visual = model, visual
        self.name = name or model.name
        self.document, self.report, self.origin = document, report, origin
        self.kept: dict[str, Any] = {}  #: what was computed from it once, by name: a robot does not change
        self.alike: dict[str, Any] = {}  #: the same of what it has in common with those placed elsewhere
        check_joints(self.name, model)
        check_numbering(self.name, model)
        self.tip, self.tip_id = tip, frame_id(self.name, model, tip)
        self.nv: int = model.nv
        self.joint_names: tuple[str, ...] = tuple(model.names)[1:]
        self.joint_units: tuple[str, ...] = joint_units(model)
        self.body_count: int = model.njoints - 1
        self._data, self._weightless_data = PerThread(model.createData), PerThread(model.createData)
        self._neutral = pin.neutral(model)
        self._plain_q = model.nq == model.nv
        self._zero = np.zeros(model.nv)

    # -- making robots ------------------------------------------------------------------------------------

    def placed(self, xyz: ArrayLike = (0, 0, 0), rpy: ArrayLike = (0, 0, 0), name: str | None = None) -> Self:
        """This robot with its base moved: a new Robot.

        Args:
            xyz: displacement in the world, (3,), m.
            rpy: rotation about the fixed world axes x, y, z in that order, (3,), rad.
            name: name of the new robot.
        """
        shift, angles = finite_array("xyz", xyz, (3,)), finite_array("rpy", rpy, (3,))
        base = pin.SE3(pin.rpy.rpyToMatrix(*angles), np.array(shift))
        model = pin.Model(self.model)
        for joint in range(1, model.njoints):
            if model.parents[joint] == 0:
                model.jointPlacements[joint] = base * model.jointPlacements[joint]
        for frame in model.frames:
            if frame.parentJoint == 0 and frame.name != "universe":
                frame.placement = base * frame.placement
        document = None if self.document is None else self.document.placed(Pose(tuple(shift), tuple(angles)))
        visual = _moved(self.visual, base)
        origin = self.origin.then("placed", xyz=shift, rpy=angles, name=name)
        robot = self._with(model, visual=visual, name=name or self.name, document=document, origin=origin)
        robot.alike, robot._data, robot._weightless_data = self.alike, self._data, self._weightless_data
        return robot

    def with_tip(self, tip: str) -> Self:
        """This robot controlled at another frame."""
        return self._with(self.model, tip, origin=self.origin.then("with_tip", tip=tip))

    def with_parameters(self, pi: ArrayLike) -> Self:
        """This robot with other true inertial parameters.

        Args:
            pi: (10 bodies,) in Pinocchio's order, see `inertial_parameters`.

        Raises:
            RobotError: a body would have no positive mass or no positive definite inertia.
        """
        rows = finite_array("pi", pi, (10 * self.body_count,)).reshape(-1, 10)
        model = pin.Model(self.model)
        for joint, row in enumerate(rows, start=1):
            check_inertia(self.name, self.joint_names[joint - 1], row)
            model.inertias[joint] = pin.Inertia.FromDynamicParameters(np.array(row))
        rows_by_joint = dict(zip(self.joint_names, rows, strict=True))
        document = None if self.document is None else with_bodies(self.document, rows_by_joint)
        origin = self.origin.then("with_parameters", pi=rows.ravel())
        return self._with(model, document=document, origin=origin)

    def with_armature(self, armature: ArrayLike) -> Self:
        """This robot with rotors that turn with its joints: a diagonal added to M.

        Args:
            armature: rotor inertia times the square of the gear ratio, number or (nv,), kg·m^2.

        Raises:
            InputError: another size, not finite, or a value below 0.
        """
        values = per_joint("armature", armature, self.nv)
        if values.min() < 0:
            raise InputError.expected("at least 0 kg·m^2", values.min(), "armature")
        model = pin.Model(self.model)
        model.armature = values.copy()
        return self._with(model, origin=self.origin.then("with_armature", armature=values))

    def weightless(self) -> Self:
        """This robot where there is no gravity."""
        return self._with(self._weightless, origin=self.origin.then("weightless"))

    @cached_property
    def _weightless(self) -> pin.Model:
        """The model where there is no gravity."""
        model = pin.Model(self.model)
        model.gravity.setZero()
        return model

    # -- what it is ---------------------------------------------------------------------------------------

    @property
    def inertial_parameters(self) -> np.ndarray:
        """True inertial parameters, (10 bodies,).

        Per moving body m, m c_x, m c_y, m c_z, I_xx, I_xy, I_yy, I_xz, I_yz, I_zz, inertia about the joint
        origin, in kg, kg·m and kg·m^2.
        """
        return np.concatenate([body.toDynamicParameters() for body in list(self.model.inertias)[1:]])

    @property
    def inertial_parameter_names(self) -> tuple[str, ...]:
        """Names of `inertial_parameters`, for example `joint1.m`."""
        kinds = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
        return tuple(f"{joint}.{kind}" for joint in self.joint_names for kind in kinds)

    @property
    def joint_frames(self) -> tuple[str, ...]:
        """Names of the frames of the joints, (nv,): their own, unless a link has the same."""
        found = {frame.parentJoint: frame.name for frame in self.model.frames if frame.type == pin.JOINT}
        return tuple(found.get(k, name) for k, name in enumerate(self.joint_names, start=1))

    @property
    def armature(self) -> np.ndarray:
        """Inertia of rotors that the joints turn along, (nv,), kg·m^2."""
        return np.array(self.model.armature)

    @property
    def urdf_friction(self) -> Friction:
        """What its description states of friction; it acts where a `Member` asks for it."""
        return Friction(self.model.damping, self.model.friction)

    @property
    def gravity_vector(self) -> np.ndarray:
        """Acceleration of gravity in the world, (3,), m/s^2."""
        return self.model.gravity.linear.copy()

    def configuration(self, q: ArrayLike) -> np.ndarray:
        """Pinocchio's configuration vector, (nq,), of joint positions q, (nv,).

        Raises:
            InputError: another size, or numbers that are not finite; so do all methods that call it.
        """
        return self._stored(*self._vectors(q=q))

    # -- dynamics -----------------------------------------------------------------------------------------

    def mass_matrix(self, q: ArrayLike) -> np.ndarray:
        """M(q), (nv, nv), kg·m^2."""
        return pin.crba(self.model, self._data.own, self.configuration(q)).copy()

    def coriolis_matrix(self, q: ArrayLike, v: ArrayLike) -> np.ndarray:
        """C(q, v) from Christoffel symbols, (nv, nv): M' - 2C is skew-symmetric."""
        state = self.configuration(q), *self._vectors(v=v)
        return pin.computeCoriolisMatrix(self.model, self._data.own, *state).copy()

    def gravity(self, q: ArrayLike) -> np.ndarray:
        """g(q), (nv,), N·m."""
        return pin.computeGeneralizedGravity(self.model, self._data.own, self.configuration(q)).copy()

    def inverse_dynamics(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> np.ndarray:
        """Torque M a + C v + g, (nv,), N·m."""
        return pin.rnea(self.model, self._data.own, self.configuration(q), *self._vectors(v=v, a=a)).copy()

    def forward_dynamics(self, q: ArrayLike, v: ArrayLike, tau: ArrayLike) -> np.ndarray:
        """Acceleration under joint torques tau, (nv,), rad/s^2."""
        return pin.aba(self.model, self._data.own, self.configuration(q), *self._vectors(v=v, tau=tau)).copy()

    def regressor(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        """Slotine-Li regressor Y, (nv, 10 bodies).

        Y pi = M(q) a_ref + C(q, v) v_ref + g(q) for the inertial parameters pi. Pinocchio's regressor knows
        one velocity only; because C(q, .) is linear and symmetric in its two velocities,
        C(v) v_ref = C(a) a - C(b) b with a = (v + v_ref)/2 and b = (v - v_ref)/2.

        Args:
            q, v: joint positions and velocities, (nv,).
            v_ref, a_ref: reference velocity and acceleration, (nv,).
        """
        q = self._stored(q)
        mean = 0.5 * (v + v_ref)
        Y = _regressor(self.model, self._data.own, q, mean, a_ref)
        Y -= _regressor(self._weightless, self._weightless_data.own, q, v - mean, self._zero)
        return Y if self.nv > 1 else Y.reshape(1, -1)

    # -- kinematics ---------------------------------------------------------------------------------------

    def tip_pose(self, q: ArrayLike) -> pin.SE3:
        """Placement of the tip frame in the world at joint positions q, (nv,)."""
        pin.forwardKinematics(self.model, self._data.own, self.configuration(q))
        return pin.updateFramePlacement(self.model, self._data.own, self.tip_id).copy()

    def tip_position(self, q: ArrayLike) -> np.ndarray:
        """Position of the tip in the world, (3,), m."""
        return self.tip_pose(q).translation.copy()

    def jacobian(self, q: ArrayLike) -> np.ndarray:
        """Jacobian of the tip, (6, nv): linear velocity of the tip, then angular, in world axes."""
        place = self.configuration(q), self.tip_id, _WORLD_AXES
        return pin.computeFrameJacobian(self.model, self._data.own, *place).reshape(6, self.nv).copy()

    def jacobian_dot(self, q: ArrayLike, v: ArrayLike) -> np.ndarray:
        """Time derivative of `jacobian` along v, (6, nv)."""
        return self.tip_kinematics(*self._vectors(q=q, v=v))[2].copy()

    def tip_kinematics(self, q: np.ndarray, v: np.ndarray) -> tuple[pin.SE3, np.ndarray, np.ndarray]:
        """Pose of the tip, its Jacobian, (6, nv), and the Jacobian's derivative, (6, nv), from one pass.

        q and v are (nv,), and not checked. The pose is scratch memory, valid until this thread's next call
        of this robot or of one that was placed from it.
        """
        model, data, tip = self.model, self._data.own, self.tip_id
        pin.computeJointJacobiansTimeVariation(model, data, self._stored(q), v)
        pose = pin.updateFramePlacement(model, data, tip)
        J = pin.getFrameJacobian(model, data, tip, _WORLD_AXES)
        J_dot = pin.getFrameJacobianTimeVariation(model, data, tip, _WORLD_AXES)
        if self.nv == 1:  # Pinocchio hands out the matrices of a single joint as vectors
            return pose, J.reshape(6, 1), J_dot.reshape(6, 1)
        return pose, J, J_dot

    # -- internals ----------------------------------------------------------------------------------------

    def _vectors(self, **values: ArrayLike) -> list[np.ndarray]:
        """What the caller gave, each (nv,), under its name."""
        return [finite_array(name, value, (self.nv,)) for name, value in values.items()]

    def _stored(self, q: np.ndarray) -> np.ndarray:
        """Joint positions that are known to fit, as Pinocchio stores them."""
        return q if self._plain_q else pin.integrate(self.model, self._neutral, q)

    def _with(self, model: pin.Model, tip: str | None = None, **changes: Any) -> Self:
        """A robot with this model, and with what else it has but for the changes."""
        make, (_, own) = self.__reduce__()
        return make(model, own if tip is None else tip, **changes)

    def __reduce__(self) -> tuple:
        """Copies and other processes make the scratch memory anew."""
        own = partial(type(self), visual=self.visual, name=self.name, origin=self.origin)
        return partial(own, document=self.document, report=self.report), (self.model, self.tip)

    def __repr__(self) -> str:
        return f"Robot('{self.name}', {self.nv} joints, tip '{self.tip}')"


__getattr__ = names_elsewhere(__name__, ".catalog", "load_robot")
