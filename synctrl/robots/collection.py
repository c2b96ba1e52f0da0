"""Robots of the package robot_descriptions, by the names of its modules.

Importing such a module downloads the repository that holds the robot, into that package's own cache. It says
where the files are; they are read as any others.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType

from ..errors import MissingDependencyError, RobotError, near

PACKAGE = "robot_descriptions"
PREFIX = f"{PACKAGE}:"
_NAME = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)
_FILES = ("URDF_PATH", "XACRO_PATH", "MJCF_PATH")
_FOLDERS = ("PACKAGE_PATH", "REPOSITORY_PATH")


@dataclass(frozen=True)
class Described:
    """What a module of robot_descriptions says.

    Attributes:
        file: the URDF, xacro file or MJCF.
        package_dirs: the folders of its packages.
        xacro_args: the module's own values of a xacro file's arguments; None for another file.
    """

    file: Path
    package_dirs: tuple[str | Path, ...]
    xacro_args: Mapping[str, object] | None

    def arguments(self, given: Mapping[str, object] | None) -> Mapping[str, object] | None:
        """The arguments of the file, those given by the user first."""
        return given if self.xacro_args is None else {**self.xacro_args, **(given or {})}


def described(name: str) -> Described:
    """Where a robot of robot_descriptions is; it is downloaded if it is not there yet.

    Args:
        name: of the module, for example "iiwa14_description".

    Raises:
        RobotError: no such name, with the near ones, or a download that fails, with the reason.
        MissingDependencyError: robot_descriptions is not installed.
    """
    module = _module(name)
    said = vars(module)
    attribute = next((a for a in _FILES if said.get(a)), None)
    if attribute is None:
        expected = "expected a URDF, a xacro file or MJCF"
        raise RobotError(f"{expected}, found none of {', '.join(_FILES)}", subject=f"robot {name!a}")
    args = said.get("XACRO_ARGS", {}) if attribute == "XACRO_PATH" else None
    folders = [said[folder] for folder in _FOLDERS if said.get(folder)]
    return Described(Path(said[attribute]), (*folders, *said.get("XACRO_PACKAGE_PATHS", {}).values()), args)


def _module(name: str) -> ModuleType:
    found = find_spec(PACKAGE)
    if found is None:
        raise MissingDependencyError(
            f"it comes from the package {PACKAGE}, which is not installed; install it with: "
            "pip install 'synctrl[robot_descriptions]'",
            subject=f"robot {name!a}",
        )
    names = [module.name for module in iter_modules(found.submodule_search_locations)]
    if not _NAME.fullmatch(name) or name not in names:
        raise RobotError(
            f"expected a name of {PACKAGE}, found {name!a}{near(name, names)}", subject="robot", found=name
        )
    try:
        return import_module(f"{PACKAGE}.{name}")
    except Exception as error:
        raise RobotError(
            f"expected a robot of {PACKAGE}, found: {type(error).__name__}: {error}",
            subject=f"robot {name!a}",
        ) from error
