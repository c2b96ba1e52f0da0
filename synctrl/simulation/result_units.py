"""Units of what a result holds, number by number: coordinates and joints may differ in theirs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..robots.model import TURNS, joined, unit_for
from .result_file import LAYOUT, unit_of


def array_units(info: Mapping[str, Any], array: str) -> tuple[tuple[str, ...], ...]:
    """Unit of every number of an array, or of an output, at one instant: rows and columns.

    Rows are robots or pairs, columns are coordinates or the robot's own joints; an array of other axes has
    one unit for all. Results of earlier versions say nothing of joints, which then count as turning.
    """
    axes, unit = layout(info, array)
    if axes[1:] == ("robot", "joint"):
        return tuple(tuple(unit_for(unit, joint) for joint in robot_units(robot)) for robot in info["robots"])
    if array in LAYOUT and axes[2:] == ("axis",):
        rows = len(info["robots"] if axes[1] == "robot" else info["pairs"])
        return (_of_coordinates(info, array),) * rows
    return ((unit,),)


def array_unit(info: Mapping[str, Any], array: str) -> str:
    """Units of an array, or of an output, in one text: `rad`, or `rad, m` where joints differ."""
    return joined(unit for row in array_units(info, array) for unit in row)


def layout(info: Mapping[str, Any], array: str) -> tuple[tuple[str, ...], str]:
    """Axes of an array or output, and its unit, where joints that it has turn."""
    if array in info.get("outputs", {}):
        about = info["outputs"][array]
        return tuple(about["axes"]), str(about["unit"])
    return LAYOUT[array][0], unit_of(array, info["task_unit"], info["weighted_unit"])


def robot_units(robot: Mapping[str, Any]) -> Sequence[str]:
    """Units of the joints of a robot of `info["robots"]`."""
    return robot.get("joint_units") or [TURNS] * len(robot["joints"])


def _of_coordinates(info: Mapping[str, Any], array: str) -> tuple[str, ...]:
    count = len(info["axes"])
    tasks = info.get("axis_units") or [info["task_unit"]] * count
    weighted = info.get("weighted_units") or [info["weighted_unit"]] * count
    return tuple(unit_of(array, *pair) for pair in zip(tasks, weighted, strict=True))
