"""A robot as plain data that a file can hold, and the robot made from it again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..checks import LONGEST_LABEL, unprintable
from ..errors import RobotError, RobotWarning, warn
from .robot import Robot
from .urdf.description import examine, urdf_folder
from .urdf.packages import data_folder, named_folders
from .urdf.reader import read_text
from .urdf.report import Report
from .urdf.writer import to_xml
from .urdf.xml import quoted

#: characters; longer descriptions are not kept
LONGEST = 100_000


def write_robot(robot: Robot) -> dict[str, str]:
    """What it takes to make a robot again: its "urdf", placed and with its joints locked, and its "tip".

    "file" is where it was read from, beside which its meshes are, unless it comes with this package or with
    example-robot-data. A robot that no document describes, or too long a one, gives nothing.
    """
    if "written" not in robot.kept:
        robot.kept["written"] = _write(robot)
    return dict(robot.kept["written"])


def _write(robot: Robot) -> dict[str, str]:
    document = robot.document
    if document is None:
        return {}
    links = tuple(replace(link, collisions=()) for link in document.links)
    text = to_xml(replace(document, links=links))
    if len(text) > LONGEST or unprintable(text.replace("\n", " ")):
        return {}
    found = {"urdf": text, "tip": robot.tip}
    if "file" not in robot.alike:
        robot.alike["file"] = document.file is not None and not _stock(document.file)
    if document.file is not None and robot.alike["file"]:
        found["file"] = str(document.file.absolute())
    return {key: word for key, word in found.items() if key == "urdf" or _short(word)}


def _short(word: str) -> bool:
    return len(word) <= LONGEST_LABEL and not unprintable(word)


def _stock(file: Path) -> bool:
    """Whether a file comes with an installation."""
    return any(file.is_relative_to(folder) for folder in (urdf_folder(), data_folder()) if folder)


def _trusted(file: str | None, folders: Iterable[Path]) -> Path:
    """Where a description says that it was, if that is in a folder that the user named; else beside ours."""
    if file is not None:
        resolved = Path(file).resolve()
        if any(resolved.is_relative_to(folder.resolve()) for folder in folders):
            return resolved
    return urdf_folder() / "none.urdf"


def read_robot(
    about: Mapping[str, Any], name: str, joints: Iterable[str], package_dirs: Iterable[str | Path] = ()
) -> Robot:
    """The robot that `write_robot` wrote.

    Its text is read as strictly as any file. Meshes beside the file that it came from are looked for only if
    that lies in a folder that the user names: what was written does not choose what is read.

    Args:
        about: what was written.
        name: what to call the robot.
        joints: names of the joints that it has to have.
        package_dirs: folders in which its meshes and packages may be looked for.

    Raises:
        RobotError: nothing was written, or it makes no such robot.

    Warns:
        RobotWarning: pictures are missing; all else was said when the robot was loaded.
    """
    if "urdf" not in about:
        raise RobotError("its description was not kept", subject=f"robot '{name}'")
    folders = named_folders(package_dirs)
    called = f"the result's robot '{name}'"
    document = read_text(_trusted(about.get("file"), folders), about["urdf"].encode(), called=called)
    found = examine(document, folders)
    robot = Robot(
        found.model, about.get("tip", found.tip), visual=found.visual, name=name, document=found.document
    )
    _warn_of_pictures(found.report, f"the result's robot {quoted(name)}")
    if robot.joint_names != tuple(joints):
        raise RobotError(
            f"expected the joints {', '.join(joints)}, found {', '.join(robot.joint_names)}",
            subject=f"robot '{name}'",
            found=robot.joint_names,
        )
    return robot


def _warn_of_pictures(report: Report, source: str) -> None:
    if missing := report.of_kind("left out"):
        warn(Report(missing, source).summary(), RobotWarning)
