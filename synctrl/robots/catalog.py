"""Robots by name: this package's own, and the fixed-base arms of example-robot-data."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from ..errors import InputError, MissingDependencyError, RobotError, near
from .urdf.description import Description, read_urdf, urdf_folder
from .urdf.packages import data_folder


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


def load_description(name_or_path: str | Path, package_dirs: Iterable[str | Path] = ()) -> Description:
    """A robot from the catalogue, or from a URDF file.

    Args:
        name_or_path: a name of the catalogue, or the path of a URDF file: a `Path`, or a text with a
            separator or the ending ".urdf".
        package_dirs: as in `read_urdf`; for files only.

    Raises:
        RobotError: an unknown name, with the near ones, or a description that is refused.
        MissingDependencyError: example-robot-data is not installed.
    """
    if not isinstance(name_or_path, (str, Path)):
        raise InputError(f"expected a name or a path, found {type(name_or_path).__name__}", subject="robot")
    if isinstance(name_or_path, Path) or _looks_like_path(name_or_path):
        return read_urdf(name_or_path, package_dirs)
    if name_or_path not in CATALOG:
        raise RobotError(
            f"expected a name of the catalogue or a path, found {name_or_path!a}"
            f"{near(name_or_path, CATALOG)}; the catalogue has: {', '.join(CATALOG)}",
            subject="robot",
            found=name_or_path,
        )
    return _load(name_or_path, CATALOG[name_or_path])


def _looks_like_path(text: str) -> bool:
    return "/" in text or "\\" in text or text.lower().endswith((".urdf", ".xml", ".xacro"))


def _load(name: str, entry: Entry) -> Description:
    locked = dict.fromkeys(entry.locked, 0.0)
    description = read_urdf(_folder(name, entry) / entry.file, locked=locked, tip=entry.tip)
    return replace(description, name=name)


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
