"""Making robot descriptions: planar arms from numbers, payloads welded on, joints locked; and writing them.

Each function returns a new `Document`; `describe` makes a robot of it at once, `write_urdf` a file that
`read_urdf` reads back to the same dynamics. The documents are this package's own and not those of yourdfpy,
whose reader fills in what is missing without a word, and whose writer takes roll and yaw from a rotation one
by one, which loses their digits near a pitch of 90 deg. The tests have yourdfpy read what is written here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, positive_number, symmetric_matrix
from ..errors import FrameNotFound, InputError
from ..files import write_whole
from .catalog import load_description
from .urdf.changes import lock_joints
from .urdf.checks import check_bodies, check_tree, inertial_fault
from .urdf.description import Description
from .urdf.document import Document, Geometry, Inertial, Joint, Limit, Link, Pose, Shape, upper_triangle
from .urdf.meshes import SCHEMES
from .urdf.remarks import is_plain, triangle_fault
from .urdf.writer import to_xml

Source = Document | Description | str | Path
"""A document, a description, a name of the catalogue, or the path of a URDF file."""

_TURNS = Limit(effort=100.0, velocity=20.0, lower=-2 * np.pi, upper=2 * np.pi)
_STEEL = (0.32, 0.35, 0.40, 1.0)
_LINK_COLORS = ((0.20, 0.45, 0.75, 1.0), (0.93, 0.53, 0.18, 1.0))
_TOOL_COLOR = (0.25, 0.62, 0.42, 1.0)


def planar_arm(lengths: Sequence[float], masses: Sequence[float], name: str = "planar_arm") -> Document:
    """An arm of uniform rods in the xy-plane, with joint axes z.

    Moment of inertia of a rod about its centre of mass: m l^2 / 12 about y and z; about itself m r^2 / 2 with
    r = l / 60. Joints are `joint1`, `joint2`, ...; links `base`, `link1`, ..., and `tip` at the end.

    Args:
        lengths: of the links, (n,), m.
        masses: of the links, (n,), kg.
        name: of the robot.

    Raises:
        InputError: no links, not as many masses as lengths, or one that is not positive.
    """
    _check_name("name", name)
    l, m = finite_array("lengths", lengths, (None,)), finite_array("masses", masses, (None,))
    if not len(l) or len(l) != len(m):
        raise InputError.expected("as many of each, at least 1", (len(l), len(m)), "lengths, masses")
    rods = [
        _rod(k, positive_number(f"lengths[{k}]", l[k]), positive_number(f"masses[{k}]", m[k]))
        for k in range(len(l))
    ]
    names = ["base", *(rod.name for rod in rods), "tip"]
    reach = [0.0, *map(float, l)]
    joints = [_planar_joint(k, names[k], names[k + 1], reach[k]) for k in range(len(rods))]
    joints.append(Joint("tip_mount", "fixed", names[-2], "tip", Pose((reach[-1], 0.0, 0.0))))
    thick = 0.1 * max(reach)
    base = Link("base", visuals=(_drum(1.8 * thick, 1.6 * thick, -1.5 * thick),))
    tip = Link("tip", visuals=(Geometry(Shape("sphere", (0.6 * thick,)), color=_STEEL),))
    return Document(name, (base, *rods, tip), tuple(joints))


def weld(
    source: Source,
    frame: str,
    mass: float,
    *,
    com: ArrayLike = (0, 0, 0),
    size: ArrayLike = (0.1, 0.1, 0.1),
    inertia: ArrayLike | None = None,
    xyz: ArrayLike = (0, 0, 0),
    rpy: ArrayLike = (0, 0, 0),
    name: str = "payload",
) -> Document:
    """A robot with a payload or tool fixed to one of its links.

    Args:
        source: the robot.
        frame: name of the link that carries it.
        mass: kg.
        com: centre of mass in the payload's frame, (3,), m.
        size: of the box that is shown, centred at `com`, (3,), m.
        inertia: about the centre of mass in the payload's axes, (3, 3), kg·m^2; by default that of a uniform
            box of that size.
        xyz, rpy: placement of the payload's frame in that of the link, (3,), m, and (3,), rad.
        name: of the payload's link.

    Raises:
        FrameNotFound: the robot has no such link.
        InputError: a value that no body can have.
    """
    document = _document(source)
    _check_name("name", name)
    links = [link.name for link in document.links]
    if frame not in links:
        raise FrameNotFound(document.name, frame, links)
    if name in links or f"{name}_weld" in {joint.name for joint in document.joints}:
        expected = f"expected one that robot '{document.name}' does not have yet"
        raise InputError(f"{expected}, found '{name}'", subject="name", found=name)
    payload = _payload(name, positive_number("mass", mass), _triple("com", com), size, inertia)
    joint = Joint(f"{name}_weld", "fixed", frame, name, Pose(_triple("xyz", xyz), _triple("rpy", rpy)))
    return replace(document, links=(*document.links, payload), joints=(*document.joints, joint))


def lock(source: Source, positions: Mapping[str, float]) -> Document:
    """A robot with joints held at positions, in rad or m: they become fixed joints.

    Raises:
        RobotError: no such moving joint, or a position outside its limits.
        InputError: a position that is no finite number.
    """
    return lock_joints(_document(source), positions)


def write_urdf(document: Document, path: str | Path) -> Path:
    """Write a document as a URDF file, every number with all its digits.

    Raises:
        RobotError: the document would not be read back, or a mesh of it lies beside another file.
        InputError: there is no such folder.
    """
    file = Path(path)
    check_tree(document)
    check_bodies(document)
    _check_meshes(document, file)
    try:
        file.parent.stat()  # a folder of a mistyped name is not made
        write_whole(file, to_xml(document))
    except OSError as error:
        raise InputError.expected("a file that can be written", error.strerror, str(file)) from error
    return file


# -- parts -------------------------------------------------------------------------------------------------


def _rod(k: int, length: float, mass: float) -> Link:
    middle = Pose((length / 2, 0.0, 0.0))
    across, along = mass * length**2 / 12, mass * (length / 60) ** 2 / 2
    inertial = Inertial(mass, (along, 0.0, 0.0, across, 0.0, across), middle)
    thick = 0.1 * length
    beam = Geometry(Shape("box", (length, thick, 0.8 * thick)), middle, _LINK_COLORS[k % 2])
    return Link(f"link{k + 1}", inertial, (_drum(thick, 1.3 * thick), beam))


def _drum(radius: float, length: float, z: float = 0.0) -> Geometry:
    return Geometry(Shape("cylinder", (radius, length)), Pose((0.0, 0.0, z)), _STEEL)


def _planar_joint(k: int, parent: str, child: str, x: float) -> Joint:
    return Joint(f"joint{k + 1}", "revolute", parent, child, Pose((x, 0.0, 0.0)), (0.0, 0.0, 1.0), _TURNS)


def _payload(
    name: str, mass: float, com: tuple[float, ...], size: ArrayLike, inertia: ArrayLike | None
) -> Link:
    sides = tuple(positive_number(f"size[{k}]", side) for k, side in enumerate(_triple("size", size)))
    x, y, z = (side**2 for side in sides)
    box = np.diag([y + z, x + z, x + y]) * mass / 12
    I = symmetric_matrix("inertia", box if inertia is None else inertia, 3)
    inertial = Inertial(mass, upper_triangle(I), Pose(com))
    if fault := inertial_fault(inertial) or triangle_fault(inertial):
        raise InputError(fault, subject="inertia")
    return Link(name, inertial, (Geometry(Shape("box", sides), Pose(com), _TOOL_COLOR),))


# -- arguments ---------------------------------------------------------------------------------------------


def _document(source: Source) -> Document:
    if isinstance(source, Document):
        return source
    if isinstance(source, Description):
        return source.document
    return load_description(source).document


def _triple(name: str, value: ArrayLike) -> tuple[float, ...]:
    return tuple(map(float, finite_array(name, value, (3,))))


def _check_name(what: str, name: str) -> None:
    if not isinstance(name, str) or not is_plain(name):
        rule = "1 to 128 letters, digits, '_', '-' or '.', beginning with a letter, a digit or '_'"
        raise InputError.expected(rule, name, what)


def _check_meshes(document: Document, file: Path) -> None:
    """A mesh named by a plain path is found beside the description it comes from, and nowhere else."""
    if document.file is None or document.file.resolve().parent == file.resolve().parent:
        return
    for link in document.links:
        for geometry in (*link.visuals, *link.collisions):
            filename = geometry.shape.filename
            if filename is not None and not filename.startswith(("/", *SCHEMES)):
                folders = f"into its folder {document.file.parent}, found {file.resolve().parent}"
                raise document.error(
                    f"mesh '{filename}': expected to write {folders}", link, line=geometry.line
                )
