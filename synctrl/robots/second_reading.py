"""What other libraries read in a robot's file, beside what this package reads: yourdfpy and MuJoCo.

Each gets the elements of the file itself, but for shapes, and not what this package has made of them. From
yourdfpy come the tree, placements, masses and limits, and dynamics are computed here from these alone; MuJoCo
computes its own. Joints that this package holds stand there where it holds them.
"""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from ..errors import SynctrlError
from .mechanism import joint_limits
from .robot import Robot
from .urdf.document import Joint
from .urdf.xacro import SUFFIX, expand_xacro
from .urdf.xml import Element, parse_xml, read_bytes

#: in how many configurations readings are compared, and by how much they may differ: m, rad, or relative
CONFIGURATIONS, SAME = 4, 1e-6
#: gravity of both, m/s^2, as Pinocchio has it
GRAVITY = 9.81
#: what MuJoCo is told: no fixed link is merged with another, and nothing is balanced, bounded or left out
COMPILER = {"fusestatic": "false", "balanceinertia": "false", "boundmass": "0", "boundinertia": "0"}

#: elements that other libraries get of a file; shapes, and what simulators are told, could name other files
MECHANICAL = (
    *("link", "inertial", "origin", "mass", "inertia"),
    *("joint", "parent", "child", "axis", "limit", "dynamics"),
)

Locks = Mapping[str, float]
"""Positions of the joints that are held, by name, rad or m."""


class Difference(NamedTuple):
    """By how much a quantity differs between two readings, and its unit; relative ones have the unit "1"."""

    what: str
    size: float
    unit: str

    @property
    def agrees(self) -> bool:
        """Whether it differs by rounding alone."""
        return self.size <= SAME


@dataclass(frozen=True)
class Reading:
    """What another library makes of a file.

    Attributes:
        library: its name and version.
        refusal: why it does not take the file; empty if it does.
        differences: from what this package reads.
    """

    library: str
    refusal: str = ""
    differences: tuple[Difference, ...] = ()

    @property
    def agrees(self) -> bool:
        """Whether it takes the file, and reads the same."""
        return not self.refusal and all(each.agrees for each in self.differences)


def second_readings(robot: Robot, xacro_args: Mapping[str, object] | None = None) -> tuple[Reading, ...]:
    """What yourdfpy and, where it is installed, MuJoCo read in the file of a robot.

    Args:
        robot: as it was loaded from its file, and not placed elsewhere.
        xacro_args: those that the file was expanded with.

    Returns:
        No readings of a robot that has no file of URDF or xacro.
    """
    text = _text(robot, xacro_args)
    if text is None:
        return ()
    return tuple(_reading(name, read, robot, text) for name, read in READERS.items())


def _text(robot: Robot, xacro_args: Mapping[str, object] | None) -> bytes | None:
    """The URDF of a robot as XML, without its shapes; joints that follow others stand where they are held."""
    file = None if robot.document is None else robot.document.file
    if file is None:
        return None
    content = expand_xacro(file, xacro_args).encode() if file.suffix == SUFFIX else read_bytes(Path(file))
    root = parse_xml(str(file), content)
    return ElementTree.tostring(_mechanical(root)) if root.tag == "robot" else None


def _mechanical(element: Element) -> ElementTree.Element:
    """An element with those of its children that belong to the mechanism, and their attributes."""
    made = ElementTree.Element(element.tag, {k: v for k, v in element.attributes.items() if ":" not in k})
    made.extend(_mechanical(child) for child in element.children if child.tag in MECHANICAL)
    return made


def _reading(name: str, read: Callable, robot: Robot, text: bytes) -> Reading:
    """One reading; whatever another library raises is why it does not take the file."""
    try:
        called = f"{name} {version(name.lower())}"
    except ImportError:
        return Reading(name, "it is not installed")
    level = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return Reading(called, "", tuple(_differences(robot, read(text))))
    except SynctrlError:
        raise
    except Exception as error:
        return Reading(called, " ".join(f"{type(error).__name__}: {error}".split())[:300])
    finally:
        logging.disable(level)


def _differences(robot: Robot, other: Any) -> list[Difference]:
    """What another reading has otherwise, the largest in some configurations."""
    missing = [name for name in robot.joint_names if name not in other.joints]
    if missing:
        return [Difference(f"joint {missing[0]} does not move", float("inf"), "1")]
    held = _held(robot, other)
    found: dict[tuple[str, str], list[float]] = {}
    for q in np.random.default_rng(0).uniform(-1.0, 1.0, (CONFIGURATIONS, robot.nv)):
        place, M, g = other.at({**held, **dict(zip(robot.joint_names, q, strict=True))}, robot)
        ours = robot.mass_matrix(q) - np.diag(robot.armature)
        size, weight = np.sqrt(np.diag(ours)), robot.gravity(q)
        if place is not None:
            found.setdefault(("place of the tip", "m"), []).append(_off(place, robot.tip_position(q)))
        found.setdefault(("mass matrix", "1"), []).append(_off(M, ours, np.outer(size, size)))
        found.setdefault(("torque of gravity", "1"), []).append(_off(g, weight, max(abs(weight).max(), 1e-9)))
    return [
        *(Difference(what, max(sizes), unit) for (what, unit), sizes in found.items()),
        *other.limits(robot),
    ]


def _off(found: np.ndarray, expected: np.ndarray, scale: Any = 1.0) -> float:
    return float((np.abs(found - expected) / scale).max())


def _held(robot: Robot, other: Any) -> dict[str, float]:
    """Where this package holds joints that move in the other reading."""
    assert robot.document is not None
    fixed: Sequence[Joint] = [joint for joint in robot.document.joints if not joint.moves]
    return {
        joint.name: other.position(joint.name, joint.origin.se3)
        for joint in fixed
        if joint.name in other.joints
    }


def _moved(origin: pin.SE3, place: pin.SE3, axis: np.ndarray, slides: bool) -> float:
    """By how much a joint has moved whose child is at a place, rad or m."""
    motion = origin.actInv(place)
    return float(axis @ (motion.translation if slides else pin.log3(motion.rotation)))


class _Yourdfpy:
    """The file as yourdfpy reads it, with dynamics from its masses and placements."""

    def __init__(self, text: bytes):
        import yourdfpy

        self.urdf = yourdfpy.URDF.load(io.BytesIO(text), load_meshes=False, build_scene_graph=True)
        self.joints = {name: j for name, j in self.urdf.joint_map.items() if j.type != "fixed"}
        self._above = {joint.child: joint for joint in self.urdf.joint_map.values()}

    def position(self, name: str, place: pin.SE3) -> float:
        joint = self.joints[name]
        origin = pin.SE3(np.eye(4) if joint.origin is None else joint.origin)
        return _moved(origin, place, joint.axis, joint.type == "prismatic")

    def at(self, q: Locks, robot: Robot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Place of the tip, (3,), mass matrix and torque of gravity with joints at q, by name."""
        self.urdf.update_cfg({name: x for name, x in q.items() if name in self.urdf.actuated_joint_names})
        M, g = np.zeros((robot.nv, robot.nv)), np.zeros(robot.nv)
        for link in self.urdf.link_map.values():
            if link.inertial is not None and link.inertial.mass:
                frame = self._frame(link.name)
                body = frame if link.inertial.origin is None else frame @ link.inertial.origin
                v, w = self._jacobian(link.name, body[:3, 3], robot.joint_names)
                inertia = np.zeros((3, 3)) if link.inertial.inertia is None else link.inertial.inertia
                M += link.inertial.mass * v.T @ v + w.T @ body[:3, :3] @ inertia @ body[:3, :3].T @ w
                g += link.inertial.mass * GRAVITY * v[2]
        return self._frame(robot.tip)[:3, 3], M, g

    def _frame(self, link: str) -> np.ndarray:
        return np.asarray(self.urdf.get_transform(link, self.urdf.base_link))

    def _jacobian(self, link: str, point: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """How a point of a link moves and turns with each joint, (3, nv) each."""
        v, w = np.zeros((2, 3, len(names)))
        while (joint := self._above.get(link)) is not None:
            if joint.name in names:
                frame, k = self._frame(joint.child), names.index(joint.name)
                axis = frame[:3, :3] @ joint.axis
                slides = joint.type == "prismatic"
                v[:, k] = axis if slides else np.cross(axis, point - frame[:3, 3])
                w[:, k] = 0 if slides else axis
            link = joint.parent
        return v, w

    def limits(self, robot: Robot) -> list[Difference]:
        """Of ranges, speeds and torques that this package takes as limits; it says where it takes none."""
        ours, found = joint_limits(robot), []
        for what, attribute, values in (
            *(("range", "lower", ours.lower), ("range", "upper", ours.upper)),
            *(("limit of speed", "velocity", ours.velocity), ("limit of torque", "effort", ours.torque)),
        ):
            theirs = [getattr(self.joints[name].limit, attribute, None) for name in robot.joint_names]
            pairs = [(a, b) for a, b in zip(values, theirs, strict=True) if np.isfinite(a)]
            sizes = [abs(a - b) if b is not None else float("inf") for a, b in pairs]
            found.append((what, max(sizes, default=0.0)))
        worst = {what: max(size for name, size in found if name == what) for what, _ in found}
        return [Difference(what, size, "") for what, size in worst.items()]


class _Mujoco:
    """The file as MuJoCo reads and compiles it."""

    def __init__(self, text: bytes):
        import mujoco

        root = ElementTree.fromstring(text)
        ElementTree.SubElement(ElementTree.SubElement(root, "mujoco"), "compiler", COMPILER)
        self.mujoco = mujoco
        self.model = model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
        model.opt.gravity = (0.0, 0.0, -GRAVITY)
        model.dof_armature[:] = 0
        self.data = mujoco.MjData(model)
        self.joints = {model.joint(k).name: k for k in range(model.njnt)}

    def position(self, name: str, place: pin.SE3) -> float:
        k, model = self.joints[name], self.model
        body = model.jnt_bodyid[k]
        x, y, z, w = model.body_quat[body][[1, 2, 3, 0]]
        origin = pin.SE3(pin.Quaternion(w, x, y, z).matrix(), model.body_pos[body].copy())
        slides = model.jnt_type[k] == self.mujoco.mjtJoint.mjJNT_SLIDE
        return _moved(origin, place, model.jnt_axis[k], bool(slides))

    def at(self, q: Locks, robot: Robot) -> tuple[np.ndarray | None, np.ndarray, np.ndarray]:
        """Place of the tip, (3,), None if MuJoCo has no such body, mass matrix and torque of gravity."""
        model, data = self.model, self.data
        for name, x in q.items():
            data.qpos[model.jnt_qposadr[self.joints[name]]] = x
        self.mujoco.mj_forward(model, data)
        order = [model.jnt_dofadr[self.joints[name]] for name in robot.joint_names]
        rows = np.zeros((len(order), model.nv))
        for row, k in zip(rows, order, strict=True):
            self.mujoco.mj_mulM(model, data, row, np.eye(model.nv)[k])
        tip = self.mujoco.mj_name2id(model, self.mujoco.mjtObj.mjOBJ_BODY, robot.tip)
        return (data.xpos[tip].copy() if tip > 0 else None), rows[:, order], data.qfrc_bias[order].copy()

    def limits(self, robot: Robot) -> list[Difference]:
        """Of ranges that this package takes as such."""
        ours, sizes = joint_limits(robot), [0.0]
        for name, lower, upper in zip(robot.joint_names, ours.lower, ours.upper, strict=True):
            if np.isfinite([lower, upper]).all():
                sizes.append(float(np.abs(self.model.jnt_range[self.joints[name]] - (lower, upper)).max()))
        return [Difference("range", max(sizes), "")]


READERS: Mapping[str, Callable[[bytes], Any]] = {"yourdfpy": _Yourdfpy, "MuJoCo": _Mujoco}
