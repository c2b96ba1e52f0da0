"""Reading a robot's file so that nothing wrong gets through, whoever wrote it.

The file (a URDF, xacro that expands to one, or MJCF) is read strictly into a `Document`, the document is
checked, and Pinocchio is handed what was checked, written anew: it never sees the file. Then its model is
compared with the document.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pinocchio as pin

from ...checks import boolean, instance
from ...errors import InputError, RobotError, RobotWarning, near, warn
from ..model import frame_id
from .branches import check_tip, default_tip
from .build import build_model, check_model
from .changes import settle_locks, with_inertials
from .checks import check_bodies, check_some_mass, check_tree
from .document import Document, Inertial
from .meshes import build_visual, find_pictures
from .mjcf import read_mjcf
from .mjcf_files import ROOT as MJCF_ROOT
from .packages import Packages
from .reader import read_text
from .remarks import remark_names, stated_friction, suspect
from .report import NOTHING, Notes, Report
from .xacro import SUFFIX as XACRO_SUFFIX
from .xacro import expand
from .xml import parse_xml, quoted, read_bytes


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
        report: what was left out, assumed or locked, and what is suspicious.
    """

    name: str
    model: pin.Model
    visual: pin.GeometryModel
    tip: str
    document: Document
    locked: tuple[str, ...] = ()
    report: Report = NOTHING

    def with_tip(self, tip: str) -> Description:
        """The same with another tip frame.

        Raises:
            FrameNotFound: there is none of that name.
        """
        frame_id(self.name, self.model, tip)
        return replace(self, tip=tip)

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
    xacro_args: Mapping[str, object] | None = None,
    **options: Any,
) -> Description:
    """A robot from a URDF file, a xacro file or MJCF, see `read_source`.

    Args:
        path: the file.
        package_dirs: folders in which packages are looked for when a mesh is `package://name/...`, before
            those of example-robot-data.
        xacro_args: values of a xacro file's arguments.
        options: `tip`, `locked`, `inertials` and `strict` as in `describe`.

    Raises:
        RobotError: a missing file, or the first defect, with file, line, link or joint, what was found and
            what is expected.
        FrameNotFound: there is no such tip.

    Warns:
        RobotWarning: once, if there is anything to say: what was left out, assumed or locked, and what is
            suspicious; all of it is in the report.
    """
    file = existing_file(path)
    notes = Notes(file, strict=boolean("strict", options.pop("strict", False)))
    document = read_source(file, Packages(file, package_dirs), notes, xacro_args)
    return describe(document, package_dirs, notes=notes, **options)


def describe(document: Document, package_dirs: Iterable[str | Path] = (), **options: Any) -> Description:
    """`examine` a document, and warn once of what there is to say.

    Raises, warns: as `read_urdf`.
    """
    found = examine(document, package_dirs, **options)
    if found.report.notes:
        warn(found.report.summary(), RobotWarning)
    return found


def examine(
    document: Document,
    package_dirs: Iterable[str | Path] = (),
    *,
    tip: str | None = None,
    locked: Mapping[str, float] | None = None,
    inertials: Mapping[str, Inertial | Mapping[str, Any]] | None = None,
    notes: Notes | None = None,
) -> Description:
    """Check a document and build its model; what there is to say is in the report.

    Args:
        document: the robot.
        package_dirs: as in `read_urdf`.
        tip: name of the tip frame, and joints that do not move it are held; by default the end of the longest
            branch.
        locked: positions, in rad or m, of joints that are to be held: they become fixed joints.
        inertials: of links, in the place of what the document says, see `with_inertials`.
        notes: what was remarked so far; a strict one makes every remark an error.

    Raises: as `read_urdf`.
    """
    notes = notes or Notes(document.file)
    instance("tip", tip, (str, type(None)), "a name")
    document = with_inertials(document, {} if inertials is None else inertials)
    document, held = _settled(document, {} if locked is None else locked, tip, notes)
    model = build_model(document)
    check_model(document, model)
    document = find_pictures(document, Packages(document.file, package_dirs), notes)
    visual = build_visual(document, model)
    if tip is None:
        tip = default_tip(document, held, notes)
    frame_id(document.name, model, tip)
    report = replace(notes.report(document.source), known=tuple(stated_friction(document)))
    name = document.name if document.name.isprintable() else quoted(document.name)
    return Description(name, model, visual, tip, document, tuple(held), report)


def _settled(
    document: Document, locked: Mapping[str, float], tip: str | None, notes: Notes
) -> tuple[Document, dict[str, float]]:
    """The document with its joints held, checked, and the positions of these joints."""
    check_some_mass(document)
    check_tree(document)
    check_tip(document, tip, notes)
    document, held = settle_locks(document, locked, tip, notes)
    check_tree(document)
    check_bodies(document, notes)
    remark_names(document, notes)
    suspect(document, notes)
    return document, held


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
        kind = "a folder" if file.is_dir() else "no regular file" if file.exists() else "no such file"
        beside = sorted(f.name for f in file.parent.glob("*.urdf"))
    except (OSError, ValueError) as error:
        raise RobotError(f"{expected}, found: {error}", file=shown, found=str(error)) from error
    hint = near(file.name, beside) or (
        f"; in its folder there are: {', '.join(beside[:5])}" if beside else ""
    )
    raise RobotError(f"expected a URDF file, found {kind}{hint}", file=file, found=kind)


def read_source(
    file: Path, packages: Packages, notes: Notes, xacro_args: Mapping[str, object] | None = None
) -> Document:
    """A file as a document: xacro if it is called so, else what its root element says.

    Raises:
        RobotError: with file, line, link or joint, what was found and what is expected.
        InputError: `xacro_args` for another kind of file.
        MissingDependencyError: xacro or MuJoCo is needed, and not installed.
    """
    if file.suffix.lower() == XACRO_SUFFIX:
        return read_text(file, expand(file, xacro_args, packages, notes).encode(), notes)
    if xacro_args is not None:
        words = f"expected none for a file that is no xacro file: {file}"
        raise InputError(words, subject="xacro_args", found=tuple(xacro_args))
    data = read_bytes(file)
    if file.suffix.lower() != ".urdf" and parse_xml(str(file), data).tag == MJCF_ROOT:
        return read_mjcf(file, packages, notes)
    return read_text(file, data, notes)
