"""Robots by name: this package's own, and those of example-robot-data and of robot_descriptions.

Importing a module of robot_descriptions downloads the repository that holds the robot, into that package's
own cache. It says where the files are; they are read as any others.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType, NoneType
from typing import Any

from ..checks import instance
from ..errors import MissingDependencyError, RobotError, near
from .origin import Origin
from .robot import Robot
from .urdf.description import Description, read_urdf, urdf_folder
from .urdf.document import Inertial
from .urdf.packages import data_folder, named_folders


@dataclass(frozen=True)
class Entry:
    """A robot of the catalogue.

    Attributes:
        file: its URDF, below the folder of this package's own robots or of those of example-robot-data.
        tip: its tip frame.
        locked: joints that are no part of the arm (fingers), held at zero.
        own: whether it is this package's own.
    """

    file: str
    tip: str
    locked: tuple[str, ...] = ()
    own: bool = False


_UR = "ur_description/urdf"
CATALOG: dict[str, Entry] = {
    "planar2r": Entry("planar2r/planar2r.urdf", "tip", own=True),
    "wheel": Entry("wheel/wheel.urdf", "wheel", own=True),
    "a460": Entry("a460/a460.urdf", "wrist", own=True),
    "a460_full": Entry("a460/a460_full.urdf", "wrist", own=True),
    "ur3": Entry(f"{_UR}/ur3_robot.urdf", "tool0"),
    "ur3_limited": Entry(f"{_UR}/ur3_joint_limited_robot.urdf", "tool0"),
    "ur3_gripper": Entry(f"{_UR}/ur3_gripper.urdf", "tool0"),
    "ur5": Entry(f"{_UR}/ur5_robot.urdf", "tool0"),
    "ur5_limited": Entry(f"{_UR}/ur5_joint_limited_robot.urdf", "tool0"),
    "ur5_gripper": Entry(f"{_UR}/ur5_gripper.urdf", "tool0"),
    "ur10": Entry(f"{_UR}/ur10_robot.urdf", "tool0"),
    "ur10_limited": Entry(f"{_UR}/ur10_joint_limited_robot.urdf", "tool0"),
    "panda": Entry(
        "panda_description/urdf/panda.urdf",
        "panda_hand_tcp",
        ("panda_finger_joint1", "panda_finger_joint2"),
    ),
    "xarm7": Entry("xarm_description/urdf/xarm7.urdf", "link_eef"),
    "kinova": Entry("kinova_description/robots/kinova.urdf", "j2s6s200_end_effector"),
    "z1": Entry("z1_description/urdf/z1.urdf", "gripperStator", ("jointGripper",)),
    "so100": Entry("so_arm_description/urdf/so100.urdf", "gripper", ("gripper",)),
    "so101": Entry("so_arm_description/urdf/so101.urdf", "gripper_frame_link", ("gripper",)),
    "talos_arm": Entry(
        "talos_data/robots/talos_left_arm.urdf", "gripper_left_base_link", ("gripper_left_joint",)
    ),
    "asr_twodof": Entry("asr_twodof_description/urdf/TwoDofs.urdf", "Tip"),
}


def catalog_names() -> tuple[str, ...]:
    """Names that `load_description` knows."""
    return tuple(CATALOG)


def load_robot(source: str | Path, tip: str | None = None, **options: Any) -> Robot:
    """A robot from the catalogue, or from a file.

    Args:
        source: a catalogue name such as "a460"; the path of a URDF file, a xacro file, or MJCF; or a name of
            the package robot_descriptions, such as "robot_descriptions:iiwa14_description".
        tip: frame to control in Cartesian space; by default the catalogue's, or the end of the longest arm.
            In a file with several branches the joints that do not move it are held.
        options: `locked`, `package_dirs`, `inertials`, `strict` and `xacro_args`, see `load_description`.

    Raises:
        RobotError: no such file or name, or a description that is refused, with the reason.
        FrameNotFound: no such frame.

    Warns:
        RobotWarning: once, if something was left out, assumed or held, or is suspicious; see `Robot.report`.
    """
    found = load_description(source, tip=tip, **options)
    return Robot(
        found.model,
        found.tip,
        visual=found.visual,
        name=found.name,
        document=found.document,
        report=found.report,
        origin=_origin(source, tip=tip, **options),
    )


def _origin(source: str | Path, **options: Any) -> Origin:
    """Where a robot comes from: a name as it is, or a path that stays true when the folder changes."""
    if isinstance(source, Path) or (is_path(source) and not source.startswith(PREFIX)):
        return Origin.loaded(Path(source).absolute(), **options)
    return Origin.loaded(source, **options)


def load_description(
    source: str | Path,
    *,
    tip: str | None = None,
    locked: Mapping[str, float] | None = None,
    package_dirs: Iterable[str | Path] = (),
    inertials: Mapping[str, Inertial | Mapping[str, Any]] | None = None,
    strict: bool = False,
    xacro_args: Mapping[str, object] | None = None,
) -> Description:
    """A robot from the catalogue, from a file, or from the package robot_descriptions.

    Args:
        source: a name of the catalogue; the path of a file: a `Path`, or a text with a separator or the
            ending ".urdf", ".xml" or ".xacro"; or "robot_descriptions:" and a name of that package, which
            downloads what it has not got yet.
        tip: name of the tip frame. For a file, joints that do not move it are held.
        locked: positions, in rad or m, of joints that are to be held: they become fixed joints.
        package_dirs: folders in which packages are looked for.
        inertials: of links, in the place of what the file says, each an `Inertial` or a mapping of "mass",
            "com" and "inertia".
        strict: whether everything that would be a warning is an error.
        xacro_args: values of the arguments of a xacro file, by name: texts, numbers, truth values.

    Raises, warns: as `read_urdf`, and:
        RobotError: an unknown name, with the near ones.
        MissingDependencyError: a package that has the robot, or reads its kind of file, is not installed.
    """
    instance("robot", source, (str, Path), "a name or a path")
    _check_kinds(tip, locked, xacro_args)
    options: dict[str, Any] = {"package_dirs": package_dirs, "inertials": inertials, "strict": strict}
    options["xacro_args"] = xacro_args
    if isinstance(source, str) and source.startswith(PREFIX):
        source, folders, own_args = downloaded(source.removeprefix(PREFIX))
        options["package_dirs"] = (*named_folders(package_dirs), *folders)
        options["xacro_args"] = xacro_args if own_args is None else {**own_args, **(xacro_args or {})}
    if isinstance(source, Path) or is_path(source):
        return read_urdf(source, tip=tip, locked=locked, **options)
    found = _load(source, locked or {}, options)
    return found if tip is None else found.with_tip(tip)


def _check_kinds(tip: object, locked: object, xacro_args: object) -> None:
    instance("tip", tip, (str, NoneType), "a name")
    instance("locked", locked, (Mapping, NoneType), "positions by the names of joints")
    instance("xacro_args", xacro_args, (Mapping, NoneType), "values by the names of arguments")


def is_path(text: str) -> bool:
    """Whether a text that says where a robot comes from is a path, and no name."""
    return "/" in text or "\\" in text or text.lower().endswith((".urdf", ".xml", ".xacro"))


def _load(name: str, locked: Mapping[str, float], options: dict[str, Any]) -> Description:
    """A robot of the catalogue; its tip holds nothing."""
    if name not in CATALOG:
        raise RobotError(
            f"expected a name of the catalogue or a path, found {name!a}"
            f"{near(name, CATALOG)}; the catalogue has: {', '.join(CATALOG)}",
            subject="robot",
            found=name,
        )
    entry = CATALOG[name]
    file, held = _folder(name, entry) / entry.file, {**dict.fromkeys(entry.locked, 0.0), **locked}
    return replace(read_urdf(file, tip=entry.tip, locked=held, **options), name=name)


def _folder(name: str, entry: Entry) -> Path:
    if entry.own:
        return urdf_folder()
    data = data_folder()
    if data is None:
        raise MissingDependencyError(
            "it comes from the package example-robot-data, which is not installed; "
            "install it with: pip install example-robot-data",
            subject=f"robot '{name}'",
        )
    return data / "example-robot-data" / "robots"


# -- robots of the package robot_descriptions --------------------------------------------------------------


PACKAGE = "robot_descriptions"
PREFIX = f"{PACKAGE}:"
_NAME = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)
_FILES = ("URDF_PATH", "XACRO_PATH", "MJCF_PATH")
_FOLDERS = ("PACKAGE_PATH", "REPOSITORY_PATH")


def downloaded(name: str) -> tuple[Path, tuple[str | Path, ...], Mapping[str, object] | None]:
    """Where a robot of robot_descriptions is; it is downloaded if it is not there yet.

    Args:
        name: of the module, for example "iiwa14_description".

    Returns:
        The file (a URDF, xacro or MJCF), the folders of its packages, and the module's own values of a xacro
        file's arguments; None for another file.

    Raises:
        RobotError: no such name, with the near ones, or a download that fails, with the reason.
        MissingDependencyError: robot_descriptions is not installed.
    """
    module = _module(name)
    said = vars(module)
    attribute = next((a for a in _FILES if said.get(a)), None)
    if attribute is None:
        expected = "expected a URDF, a xacro file or MJCF"
        words = f"{expected}, found none of {', '.join(_FILES)}"
        raise RobotError(words, subject=f"robot {name!a}", found=0)
    args = said.get("XACRO_ARGS", {}) if attribute == "XACRO_PATH" else None
    folders = [said[folder] for folder in _FOLDERS if said.get(folder)]
    return Path(said[attribute]), (*folders, *said.get("XACRO_PACKAGE_PATHS", {}).values()), args


def _module(name: str) -> ModuleType:
    found = find_spec(PACKAGE)
    if found is None:
        raise MissingDependencyError(
            f"it comes from the package {PACKAGE}, which is not installed; install it with: "
            "pip install 'synctrl[robot_descriptions]'",
            subject=f"robot {name!a}",
            found=PACKAGE,
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
            found=type(error).__name__,
        ) from error
