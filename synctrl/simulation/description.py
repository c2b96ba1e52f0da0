"""What a result says of the run that made it: names, units, gains and options, as plain data."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from ..coupling.cell import Cell
from ..robots.mechanism import joint_limits
from ..robots.written import write_robot
from .closed_loop import ClosedLoop
from .result import LAYOUT, array_unit


def sizes(loop: ClosedLoop) -> dict[str, int]:
    """Lengths of all dimensions but time."""
    cell = loop.cell
    return {
        "robot": cell.n,
        "pair": cell.coupling.pairs,
        "axis": cell.m,
        "joint": cell.nv,
        "parameter": cell.theta.shape[1],
    }


def describe_run(loop: ClosedLoop) -> dict[str, Any]:
    """Names, units, gains and options, as plain data."""
    cell, controller = loop.cell, loop.controller
    about = {
        "title": cell.name,
        "robots": _describe_robots(cell),
        "axes": list(cell.labels),
        "task_unit": cell.unit,
        "axis_units": list(cell.units),
        "weighted_unit": cell.weighted_unit,
        "weighted_units": list(cell.weighted_units),
        "coupling": cell.coupling.name,
        "pairs": cell.coupling.edges.tolist(),
        "signs": cell.coupling.signs.tolist(),
        "sizes": sizes(loop),
        "gains": controller.gains.as_dict(),
        "adaptation": controller.adaptation_settings,
        "law": controller.law_settings,
        "network": controller.network_settings,
        "reference_acceleration": controller.reference_acceleration,
        "k_r_space": controller.k_r_space,
        "versions": versions(),
    }
    if controller.admittance_settings is not None:
        about["admittance"] = controller.admittance_settings
    about |= loop.devices.settings
    return {**about, "units": {name: array_unit(about, name) for name in LAYOUT}}


def _describe_robots(cell: Cell) -> list[dict[str, Any]]:
    return [
        {
            "name": name,
            "model": robot.name,
            "joints": list(robot.joint_names),
            "joint_units": list(robot.joint_units),
            "parameters": list(parameters.names),
            "theta": [float(value) for value in parameters.theta],
            "torque_limits": [float(x) if np.isfinite(x) else None for x in joint_limits(robot).torque],
            **write_robot(robot),
        }
        for name, robot, parameters in zip(cell.names, cell.robots, cell.parameters, strict=True)
    ]


def versions() -> dict[str, str]:
    """Versions of the packages that determine the numbers."""
    return {package: _version(package) for package in ("synctrl", "pin", "numpy", "scipy")}


@cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed as a package"
