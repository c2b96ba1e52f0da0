"""From a file of any kind that describes a robot to its `Document`: URDF, xacro that expands to it, MJCF."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ...errors import InputError
from .document import Document
from .mjcf import read_mjcf
from .mjcf_files import ROOT as MJCF_ROOT
from .packages import Packages
from .reader import read_text
from .report import Notes
from .xacro import SUFFIX as XACRO_SUFFIX
from .xacro import expand
from .xml import parse_xml, read_bytes


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
        return read_text(file, expand(file, xacro_args, packages).encode(), notes)
    if xacro_args is not None:
        raise InputError(f"expected none for a file that is no xacro file: {file}", subject="xacro_args")
    data = read_bytes(file)
    if file.suffix.lower() != ".urdf" and parse_xml(str(file), data).tag == MJCF_ROOT:
        return read_mjcf(file, packages, notes)
    return read_text(file, data, notes)
