"""MJCF: compiled by MuJoCo, written as a `Document`, and compared with what MuJoCo computes.

Only a fixed base, hinges and slides are a robot here. Masses, rotors (armature), damping, friction, ranges
and limits of force come along; sites become frames. An equality of two joints makes one follow the other.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from ...errors import MissingDependencyError, RobotError
from .document import Document, Geometry, Inertial, Joint, Link, Mimic, Pose, Shape, link_name, upper_triangle
from .mjcf_files import Whole, read_whole
from .mjcf_model import check_dynamics, read_limits
from .packages import Packages
from .report import Notes
from .xml import one_line, quoted

_VISIBLE_GROUPS = (0, 1, 2)
"""Groups of shapes that MuJoCo's own viewers show unless told otherwise."""
_NO_SHIFT = 1e-12
_TYPES = {2: "prismatic", 3: "revolute"}
_SPRINGS = {2: "N/m", 3: "N·m/rad"}
_REFUSED_TYPES = {0: "a free joint", 1: "a ball joint"}


def read_mjcf(file: Path, packages: Packages, notes: Notes) -> Document:
    """An MJCF file as a document.

    Raises:
        RobotError: MuJoCo refuses it, or it is no tree of hinges and slides on a fixed base.
        MissingDependencyError: MuJoCo is not installed.
    """
    mujoco = _mujoco(file)
    whole = read_whole(file, packages, notes)
    try:
        model = mujoco.MjModel.from_xml_string(whole.text, whole.assets)
    except ValueError as error:
        found = _line(error)
        raise RobotError(
            f"expected MJCF that MuJoCo compiles, found: {found}", file=file, found=found
        ) from error
    writer = _Writer(mujoco, model, whole, file, notes)
    document = writer.document()
    check_dynamics(mujoco, model, writer.joint_names, document, writer.held)
    return document


def _mujoco(file: Path) -> Any:
    try:
        import mujoco
    except ImportError as error:
        words = f"{file}: reading MJCF needs MuJoCo: pip install 'synctrl[mujoco]'"
        raise MissingDependencyError(words, file=file, found="mujoco") from error
    return mujoco


def _line(error: Exception) -> str:
    """MuJoCo's reason; all of what it gets stands in one line."""
    return " ".join(str(error).split()).replace(", line 1", "")[:500]


class _Writer:
    """Writes one compiled model, body after body."""

    def __init__(self, mujoco: Any, model: Any, whole: Whole, file: Path, notes: Notes):
        self.mujoco, self.model, self.whole = mujoco, model, whole
        self.file, self.notes = file, notes
        kinds = mujoco.mjtObj
        self.bodies = [*map(link_name, self._names(kinds.mjOBJ_BODY, model.nbody, "body"))]
        self.joint_names = self._names(kinds.mjOBJ_JOINT, model.njnt, "joint")
        self.held: dict[str, float] = {}
        self.taken = {*self.bodies, *self.joint_names}
        self.limits = read_limits(mujoco, model, self.joint_names, notes)

    def document(self) -> Document:
        self._refuse()
        links, joints = [Link(self.bodies[0])], list[Joint]()
        for body in range(1, self.model.nbody):
            chain = self._chain(body)
            joints += chain
            links += [Link(joint.child) for joint in chain[:-1]]
            links.append(Link(self.bodies[body], self._inertial(body), self._visuals(body)))
        for link, joint in self._sites():
            links.append(link)
            joints.append(joint)
        joints = [self._coupled(joint) for joint in joints]
        return Document(self.whole.name, tuple(links), tuple(joints), self.file)

    def _names(self, kind: Any, count: int, word: str) -> list[str]:
        """Names of all of a kind, each one line; what has none gets one."""
        names = [one_line(self.mujoco.mj_id2name(self.model, kind, k) or "") for k in range(count)]
        taken = set(names)
        return [name or unique(f"{word}{k}", taken) for k, name in enumerate(names)]

    def _error(self, expected: str, found: str, subject: str | None = None, more: str = "") -> RobotError:
        return RobotError(
            f"expected {expected}, found {found}{more}", subject=subject, found=found, file=self.file
        )

    # -- what is no such robot ----------------------------------------------------------------------------

    def _refuse(self) -> None:
        model = self.model
        for name, kind in zip(self.joint_names, map(int, model.jnt_type), strict=True):
            if found := _REFUSED_TYPES.get(kind):
                raise self._error("hinges and slides on a fixed base", found, f"joint {quoted(name)}")
        for body in np.flatnonzero(model.body_jntnum > 1):
            found, more = str(model.body_jntnum[body]), ", and nothing between them that has a mass"
            raise self._error("one joint of a body", found, f"body {quoted(self.bodies[body])}", more)
        if model.nflex:
            raise self._error("rigid bodies", "a flexible one")
        if model.ntendon:
            self.notes.add("left out", "tendon", "tendons, with their springs, dampers and limits")
        for joint in np.flatnonzero(model.jnt_stiffness):
            where = f"joint {quoted(self.joint_names[joint])}"
            spring = f"a spring of {model.jnt_stiffness[joint]:g} {_SPRINGS[int(model.jnt_type[joint])]}"
            self.notes.add("left out", where, f"{spring}, which is no part of the arm's dynamics here")
        for body in np.flatnonzero(model.body_gravcomp):
            where = f"body {quoted(self.bodies[body])}"
            self.notes.add("left out", where, "gravcomp: the body has its whole weight here")
        off = model.opt.disableflags & int(self.mujoco.mjtDisableBit.mjDSBL_GRAVITY)
        gravity = np.zeros(3) if off else model.opt.gravity
        if not np.allclose(gravity, (0, 0, -9.81)):
            found = " ".join(f"{g:g}" for g in gravity)
            self.notes.add("assumed", "option", f"gravity of 0 0 -9.81 m/s^2 in place of {found}")

    # -- bodies -------------------------------------------------------------------------------------------

    def _chain(self, body: int) -> list[Joint]:
        """The joints from a body's parent to the body: the one it moves in, or a fixed one.

        A link's frame lies on the axis of its joint. Where the axis does not pass through the origin of the
        body, the body is fixed to a link that turns.
        """
        model, name = self.model, self.bodies[body]
        parent = self.bodies[model.body_parentid[body]]
        place = _place(model.body_pos[body], model.body_quat[body])
        if not model.body_jntnum[body]:
            return [self._fixed(parent, name, place)]
        joint = model.body_jntadr[body]
        anchor = pin.SE3(np.eye(3), model.jnt_pos[joint].copy())
        if abs(anchor.translation).max() < _NO_SHIFT:
            return [self._joint(joint, parent, name, place)]
        axle = unique(f"{name}_axis", self.taken)
        return [self._joint(joint, parent, axle, place * anchor), self._fixed(axle, name, anchor.inverse())]

    def _fixed(self, parent: str, child: str, place: pin.SE3) -> Joint:
        return Joint(unique(f"{child}_fixed", self.taken), "fixed", parent, child, Pose.of(place))

    def _joint(self, joint: int, parent: str, child: str, place: pin.SE3) -> Joint:
        """A hinge or slide. MuJoCo draws it at its reference position, which need not be 0."""
        model, dof = self.model, self.model.jnt_dofadr[joint]
        axis = model.jnt_axis[joint] / np.linalg.norm(model.jnt_axis[joint])
        moving = Joint(
            name=self.joint_names[joint],
            type=_TYPES[int(model.jnt_type[joint])],
            parent=parent,
            child=child,
            origin=Pose.of(place),
            axis=tuple(map(float, axis)),
            limit=self.limits[joint],
            damping=float(model.dof_damping[dof]),
            friction=float(model.dof_frictionloss[dof]),
            armature=float(model.dof_armature[dof]),
        )
        if moving.type == "revolute" and not model.jnt_limited[joint]:
            moving = replace(moving, type="continuous")
        return replace(moving, origin=moving.fixed(-float(model.qpos0[model.jnt_qposadr[joint]])).origin)

    def _inertial(self, body: int) -> Inertial | None:
        model = self.model
        if not model.body_mass[body] and not model.body_inertia[body].any():
            return None
        place = _place(model.body_ipos[body], model.body_iquat[body])
        R = place.rotation
        inertia = upper_triangle(R @ np.diag(model.body_inertia[body]) @ R.T)
        return Inertial(float(model.body_mass[body]), inertia, Pose(tuple(map(float, place.translation))))

    def _sites(self) -> list[tuple[Link, Joint]]:
        model, names = self.model, self._names(self.mujoco.mjtObj.mjOBJ_SITE, self.model.nsite, "site")
        sites = []
        for site, body in enumerate(model.site_bodyid):
            name = unique(link_name(names[site]), self.taken)
            place = _place(model.site_pos[site], model.site_quat[site])
            sites.append((Link(name), self._fixed(self.bodies[body], name, place)))
        return sites

    # -- couplings ----------------------------------------------------------------------------------------

    def _coupled(self, joint: Joint) -> Joint:
        """A joint with what the model's equalities say about it."""
        model, kinds = self.model, self.mujoco.mjtEq
        for k, kind in enumerate(model.eq_type):
            if not model.eq_active0[k]:
                continue
            if kind != int(kinds.mjEQ_JOINT):
                found = kinds(kind).name.removeprefix("mjEQ_").lower()
                raise self._error("a tree", f"an equality of kind '{found}'", more=", which closes a loop")
            if self.joint_names[model.eq_obj1id[k]] == joint.name:
                joint = self._follower(joint, k)
        return joint

    def _follower(self, joint: Joint, k: int) -> Joint:
        model, (constant, slope, *higher) = self.model, self.model.eq_data[k][:5]
        follower, leader = model.eq_obj1id[k], model.eq_obj2id[k]
        rest = float(model.qpos0[model.jnt_qposadr[follower]] + constant)
        if leader < 0:
            self.notes.add("locked", joint.title, f"an equality holds it at {rest:g} {joint.unit}")
            self.held[joint.name] = rest
            return joint.fixed(rest)
        if any(higher):
            raise self._error("joints that follow each other in proportion", "a curve", joint.title)
        offset = rest - float(slope) * float(model.qpos0[model.jnt_qposadr[leader]])
        return replace(joint, mimic=Mimic(self.joint_names[leader], float(slope), offset))

    # -- shapes -------------------------------------------------------------------------------------------

    def _visuals(self, body: int) -> tuple[Geometry, ...]:
        model, first = self.model, self.model.body_geomadr[body]
        geoms = range(first, first + model.body_geomnum[body])
        shown = (self._geometry(g) for g in geoms if model.geom_group[g] in _VISIBLE_GROUPS)
        return tuple(geometry for geometry in shown if geometry is not None)

    def _geometry(self, geom: int) -> Geometry | None:
        model = self.model
        place = _place(model.geom_pos[geom], model.geom_quat[geom])
        shape = self._shape(geom)
        if shape is None:
            kind = self.mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
            where = f"body {quoted(self.bodies[model.geom_bodyid[geom]])}"
            self.notes.add("left out", where, f"a shape of kind '{kind}'; it will not be shown")
            return None
        if shape.kind == "mesh":  # MuJoCo puts a mesh's frame into its centre of mass
            mesh = model.geom_dataid[geom]
            place = place * _place(model.mesh_pos[mesh], model.mesh_quat[mesh]).inverse()
        material = model.geom_matid[geom]
        color = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
        return Geometry(shape, Pose.of(place), tuple(float(c) for c in np.clip(color, 0, 1)))

    def _shape(self, geom: int) -> Shape | None:
        kinds, model = self.mujoco.mjtGeom, self.model
        kind, (x, y, z) = int(model.geom_type[geom]), map(float, model.geom_size[geom])
        if kind == int(kinds.mjGEOM_MESH):
            mesh = model.geom_dataid[geom]
            name = self.mujoco.mj_id2name(model, self.mujoco.mjtObj.mjOBJ_MESH, mesh)
            file = self.whole.meshes.get(name)
            return Shape("mesh", tuple(map(float, model.mesh_scale[mesh])), file) if file else None
        shapes = {
            int(kinds.mjGEOM_BOX): Shape("box", (2 * x, 2 * y, 2 * z)),
            int(kinds.mjGEOM_SPHERE): Shape("sphere", (x,)),
            int(kinds.mjGEOM_CYLINDER): Shape("cylinder", (x, 2 * y)),
            int(kinds.mjGEOM_CAPSULE): Shape("capsule", (x, 2 * y)),
        }
        return shapes.get(kind)


def unique(name: str, taken: set[str]) -> str:
    """`name`, or one like it that is not taken yet; it is taken then."""
    names = (name, *(f"{name}_{k}" for k in range(2, len(taken) + 3)))
    found = next(candidate for candidate in names if candidate not in taken)
    taken.add(found)
    return found


def _place(position: np.ndarray, quaternion: np.ndarray) -> pin.SE3:
    """A placement; MuJoCo writes the real part of a quaternion first."""
    w, x, y, z = quaternion
    return pin.SE3(pin.Quaternion(float(w), float(x), float(y), float(z)).matrix(), np.array(position))
