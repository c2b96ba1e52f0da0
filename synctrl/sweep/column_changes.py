"""How a column of values changes columns of quantities: `variations.py` for many runs at once."""

from __future__ import annotations

import numpy as np

from ..control.gains import SIGNS
from ..robots.model import as_stored, check_inertia
from .columns import Columns
from .variations import robots_of, same_parameters, slice_of


def of_gain(columns: Columns, values: np.ndarray, gain: str) -> None:
    """See `with_gain`."""
    columns[gain][...] = values[:, None, None]
    columns.leave((values < 0) | (SIGNS[gain] & (values == 0)))


def of_scaled_gain(columns: Columns, values: np.ndarray, gain: str) -> None:
    """See `with_scaled_gain`."""
    entries = columns[gain]
    needed = (entries > 0) & SIGNS[gain]
    entries *= values[:, None, None]
    columns.leave((values < 0) | (needed & (entries == 0)).any(axis=(1, 2)))


def of_scaled_bodies(
    columns: Columns, values: np.ndarray, robot: int | None = None, body: int | None = None
) -> None:
    """See `with_scaled_bodies`.

    Raises:
        InputError: parameters whose true values cannot be found out, or that cannot describe such robots.
        RobotError: inertial parameters that no body can have.
    """
    columns.leave(~(values > 0))
    pi = columns["pi"]
    for i in robots_of(columns.run.loop.cell, robot):
        count = columns.run.loop.cell.robots[i].body_count
        rows = pi[:, i, : 10 * count].reshape(columns.count, count, 10)
        rows[:, slice_of("body", body, count)] *= values[:, None, None]
        found = np.where(columns.left[:, None, None], 1.0, rows)
        pi[:, i, : 10 * count] = as_stored(found.reshape(-1, 10)).reshape(columns.count, -1)
        _check_bodies(columns, i, values)
        columns.moved(i)


def _check_bodies(columns: Columns, i: int, values: np.ndarray) -> None:
    """Refuse what a robot cannot have, by the smallest and largest values: what lies between them can be."""
    fine = np.flatnonzero(~columns.left)
    if not fine.size:
        return
    robot, parameters = columns.run.loop.cell.robots[i], columns.run.loop.cell.parameters[i]
    rows = columns["pi"][fine, i, : 10 * robot.body_count].reshape(len(fine), -1, 10)
    for joint, masses in zip(robot.joint_names, rows[:, :, 0].T, strict=True):
        for k in (masses.argmin(), masses.argmax()):
            check_inertia(robot.name, joint, rows[k, robot.joint_names.index(joint)])
    for k in (values[fine].argmin(), values[fine].argmax()):
        same_parameters(parameters, robot.with_parameters(rows[k].ravel()))


def of_scaled_estimates(columns: Columns, values: np.ndarray, robot: int | None = None) -> None:
    """See `with_scaled_estimates`."""
    for i, size in _adapted(columns, robot):
        columns["z"][:, i, :size] *= values[:, None]


def of_model_error(columns: Columns, values: np.ndarray, robot: int | None = None) -> None:
    """See `with_model_error`."""
    theta = columns["theta"]
    for i, size in _adapted(columns, robot):
        columns["z"][:, i, :size] = (1 + values)[:, None] * theta[:, i, :size]


def of_moved_start(
    columns: Columns,
    values: np.ndarray,
    quantity: str,
    robot: int | None = None,
    joint: int | None = None,
) -> None:
    """See `with_moved_start`."""
    cell, start = columns.run.loop.cell, columns[{"q0": "q", "v0": "v"}[quantity]]
    for i in robots_of(cell, robot):
        nv = cell.robots[i].nv
        start[:, i, :nv][:, slice_of("joint", joint, nv)] += values[:, None]


def of_scaled_disturbance(columns: Columns, values: np.ndarray, disturbance: int) -> None:
    """See `with_scaled_disturbance`."""
    count = len(columns.run.experiment.disturbances)
    for k in range(count)[slice_of("disturbance", disturbance, count)]:
        columns.torque(k)[...] *= values[:, None]


def _adapted(columns: Columns, robot: int | None) -> list[tuple[int, int]]:
    """Robots, and how many parameters are adapted of each."""
    cell = columns.run.loop.cell
    return [(i, len(cell.parameters[i].theta)) for i in robots_of(cell, robot)]
