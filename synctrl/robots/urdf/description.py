"""Reading a URDF so that nothing wrong gets through, whoever wrote it.

The file is read strictly into a `Document`, the document is checked, and Pinocchio is handed what was
checked, written anew: it never sees the file. Then its model is compared with the document.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

from ...checks import finite_number, instance
from ...errors import FrameNotFound, RobotError, near
from .checks import check_bodies, check_model, check_tree
from .document import Document, Joint, Shape
from .meshes import find_pictures
from .packages import Packages
from .reader import read_document
from .report import Notes, warn_of
from .writer import dynamics_xml

DEFAULT_COLOR = (0.9, 0.9, 0.9, 1.0)


@dataclass(frozen=True, eq=False)
class Description:
    """A robot that has been read and checked.

    Attributes:
        name: what it is called.
        model: Pinocchio's model; limits of torque, speed and range are in it.
        visual: shapes for display. Of a mesh it has the path, scale and colour, not the triangles.
        tip: name of the frame that is its tip unless another is asked for.
        document: what was read; joints that were locked are fixed in it.
        locked: names of the joints that were locked.
    """

    name: str
    model: pin.Model
    visual: pin.GeometryModel
    tip: str
    document: Document
    locked: tuple[str, ...] = ()

    @property
    def path(self) -> Path | None:
        """The file it was read from, or None."""
        return self.document.file

    @property
    def root(self) -> str:
        """Name of the link that is fixed to the world."""
        return self.document.root

    @property
    def links(self) -> tuple[str, ...]:
        """Names of all links."""
        return tuple(link.name for link in self.document.links)


def read_urdf(
    path: str | Path,
    package_dirs: Iterable[str | Path] = (),
    *,
    locked: Mapping[str, float] | None = None,
    tip: str | None = None,
) -> Description:
    """A robot from a URDF file.

    Args:
        path: the file.
        package_dirs: folders in which packages are looked for when a mesh is `package://name/...`, before
            those of example-robot-data.
        locked: positions, in rad or m, of joints that are to be held: they become fixed joints.
        tip: name of the tip frame; by default the last link that carries no other.

    Raises:
        RobotError: a missing file, or the first defect, with file, line, link or joint, what was found and
            what is expected.
        FrameNotFound: there is no such tip.

    Warns:
        RobotWarning: an axis not of unit length, a missing mesh, an element that nobody here reads.
    """
    document = read_document(existing_file(path))
    check_tree(document)
    return describe(lock_joints(document, locked or {}), package_dirs, tip=tip, locked=tuple(locked or ()))


def describe(
    document: Document,
    package_dirs: Iterable[str | Path] = (),
    *,
    tip: str | None = None,
    locked: tuple[str, ...] = (),
) -> Description:
    """Check a document and build its model. Arguments and errors as in `read_urdf`."""
    check_tree(document)
    check_bodies(document)
    model = build_model(document)
    check_model(document, model)
    tip = tip or document.last_link
    if not model.existFrame(tip):
        raise FrameNotFound(document.name, tip, [frame.name for frame in model.frames])
    notes = Notes(document.file)
    document = find_pictures(document, Packages(document.file, package_dirs), notes)
    warn_of(notes.report(document.source))
    visual = _build_visual(document, model)
    return Description(document.name, model, visual, tip, document, locked)


def lock_joints(document: Document, positions: Mapping[str, float]) -> Document:
    """The document with joints held at positions, in rad or m: they become fixed joints.

    Raises:
        RobotError: no such moving joint, or a position outside its limits.
        InputError: a position that is no finite number.
    """
    instance("locked", positions, Mapping, "positions by the names of joints")
    moving = {joint.name: joint for joint in document.moving_joints}
    for name, position in positions.items():
        if name not in moving:
            raise document.error(
                f"expected moving joints to lock, found '{name}'{near(name, moving)}; "
                f"they are: {', '.join(moving)}",
                found=name,
            )
        _check_position(document, moving[name], finite_number(f"position of joint '{name}'", position))
    joints = (j.fixed(float(positions[j.name])) if j.name in positions else j for j in document.joints)
    return replace(document, joints=tuple(joints))


def _check_position(document: Document, joint: Joint, position: float) -> None:
    limit = joint.limit
    if limit is None or limit.lower is None or limit.upper is None:
        return
    if not limit.lower <= position <= limit.upper:
        raise document.error(
            f"expected a position from {limit.lower:g} to {limit.upper:g}, found {position:g}", joint
        )


# -- files -------------------------------------------------------------------------------------------------


def urdf_folder() -> Path:
    """The folder of this package's own URDF files: inside the installed package, or beside its sources."""
    package = Path(__file__).resolve().parents[2]
    installed = package / "_urdf"
    return installed if installed.is_dir() else package.parent / "robots"


def existing_file(path: str | Path) -> Path:
    """`path` as a `Path`, if a file is there.

    Raises:
        RobotError: no file, with the URDF files that are near.
    """
    instance("path", path, (str, Path), "a path")
    file = Path(path)
    shown, expected = ascii(str(file)), "expected the path of a URDF file"
    if not str(file).isprintable():
        raise RobotError(f"{expected}, found one that cannot be printed", file=shown)
    try:
        if file.is_file():
            return file
        kind = "a folder" if file.is_dir() else "no such file"
        beside = sorted(f.name for f in file.parent.glob("*.urdf"))
    except (OSError, ValueError) as error:
        raise RobotError(f"{expected}, found: {error}", file=shown) from error
    hint = near(file.name, beside) or (
        f"; in its folder there are: {', '.join(beside[:5])}" if beside else ""
    )
    raise RobotError(f"expected a URDF file, found {kind}{hint}", file=file)


# -- Pinocchio ---------------------------------------------------------------------------------------------


def build_model(document: Document) -> pin.Model:
    """Pinocchio's model of a checked document.

    Raises:
        RobotError: Pinocchio refuses it all the same, with the parser's reason.
    """
    return model_from_xml(document.source, dynamics_xml(document))


def model_from_xml(source: str, xml: str) -> pin.Model:
    """Pinocchio's model of a URDF text; `source` is what messages call it."""
    with _standard_error() as written:
        try:
            model, failure = pin.buildModelFromXML(xml), None
        except Exception as error:
            model, failure = None, error
    if failure is not None:
        reason = " ".join(written[0].split()) or str(failure)
        message = f"expected a URDF that Pinocchio accepts, found: {reason}"
        raise RobotError(message, file=source, found=reason) from failure
    return model


@contextmanager
def _standard_error() -> Iterator[list[str]]:
    """What is written to the standard error meanwhile, also by C++: one string, there when the block is left.

    The reason why a parser refuses a document is said nowhere else.
    """
    written: list[str] = [""]
    sys.stderr.flush()
    try:
        saved = os.dup(2)
    except OSError:  # there is no standard error
        yield written
        return
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), 2)
        try:
            yield written
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            file.seek(0)
            written[0] = file.read().decode(errors="replace")


# -- shapes ------------------------------------------------------------------------------------------------


def _build_visual(document: Document, model: pin.Model) -> pin.GeometryModel:
    """All shapes for display, each at its place in the frame of its link."""
    visual = pin.GeometryModel()
    for link in document.links:
        frame_id = model.getFrameId(link.name, pin.BODY)
        frame = model.frames[frame_id]
        for k, geometry in enumerate(link.visuals):
            if geometry.shape.hidden:
                continue
            colored, color = geometry.color is not None, np.array(geometry.color or DEFAULT_COLOR)
            placement = frame.placement * geometry.origin.se3
            place = (f"{link.name}_{k}", frame.parentJoint, frame_id, placement)
            visual.addGeometryObject(pin.GeometryObject(*place, *_solid(geometry.shape), colored, color))
    return visual


def _solid(shape: Shape) -> tuple[coal.CollisionGeometry, str, np.ndarray]:
    """Coal's geometry, and path and scale of a mesh."""
    if shape.kind == "mesh":
        return coal.BVHModelOBBRSS(), str(shape.file), np.array(shape.size)
    kinds = {"box": coal.Box, "cylinder": coal.Cylinder, "capsule": coal.Capsule, "sphere": coal.Sphere}
    return kinds[shape.kind](*shape.size), "", np.ones(3)
