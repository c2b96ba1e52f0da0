"""What a digital controller is given by the world, and what it gives back: checked before it goes on."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..coupling.cell import Cell
from ..errors import InputError, NonFiniteError, SingularJacobianError
from .controller import Signals


def measurement(q: ArrayLike, v: ArrayLike, shape: tuple[int, int]) -> np.ndarray:
    """q and v as one new array, (2, n, nv); whether they are finite is asked later.

    Raises:
        InputError: not numbers, or another shape.
    """
    motion = np.empty((2, *shape))
    for row, name, value in zip(motion, "qv", (q, v), strict=True):
        row[...] = _numbers(name, value, shape)
    return motion


def check_limits(limits: ArrayLike | None, shape: tuple[int, int]) -> np.ndarray:
    """Limits, (n, nv), N·m; infinite ones for None.

    Raises:
        InputError: another shape, not numbers, or below 0.
    """
    if limits is None:
        return np.full(shape, np.inf)
    array = _numbers("torque_limits", limits, shape).copy()
    if not (array >= 0).all():
        raise InputError(
            f"expected numbers of at least 0, found {array[~(array >= 0)][0]:g}", subject="torque_limits"
        )
    return array


def not_finite(cell: Cell, t: float, motion: np.ndarray) -> str | None:
    """What is wrong with a measurement, (2, n, nv), if a number of it is not finite."""
    if np.isfinite(motion).all():
        return None
    part, robot, joint = np.argwhere(~np.isfinite(motion))[0]
    return (
        f"{'qv'[part]}: expected finite numbers, found {motion[part, robot, joint]} for joint "
        f"{joint + 1} of {cell.names[robot]} at t = {t:g} s"
    )


def check_signals(cell: Cell, t: float, signals: Signals) -> None:
    """Refuse what no robot may be given.

    Args:
        cell: the cell.
        t: when, s.
        signals: what the law computed.

    Raises:
        SingularJacobianError: a Jacobian with a larger condition number than the cell's space allows.
        NonFiniteError: a torque, or a rate of an estimate or integral, that is not finite.
    """
    _check_jacobians(cell, t, signals)
    for what, rows in (("torque", signals.tau), ("rate of the estimates", signals.z_dot)):
        bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
        if bad.size:
            raise _undefined(cell, t, what, int(bad[0]))
    if not np.isfinite(signals.epsilon).all():
        pair = int(np.argmin(np.isfinite(signals.epsilon).all(axis=1)))
        raise _undefined(cell, t, "synchronization error", int(cell.coupling.edges[pair].min()))


def _numbers(name: str, value: ArrayLike, shape: tuple[int, int]) -> np.ndarray:
    try:
        if value is None or np.asarray(value).dtype.kind in "USc":
            raise TypeError
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"expected numbers, found {value!r}", subject=name) from error
    if array.shape != shape:
        raise InputError(f"expected shape {shape}, one row per robot, found {array.shape}", subject=name)
    return array


def _check_jacobians(cell: Cell, t: float, signals: Signals) -> None:
    """As a simulation stops there, by the Frobenius norm."""
    limit = getattr(cell.task, "limits", {}).get("condition")
    if limit is None:
        return
    condition = signals.task.condition[:, 0]
    good = condition < limit
    if not good.all():
        i = int(np.argmin(good))
        raise SingularJacobianError(
            f"the Jacobian of {cell.names[i]} is singular at t = {t:g} s: its condition number is "
            f"{condition[i]:.3g}, expected below {limit:g}; stop the robots and reset the controller",
            time=t,
            robot=i,
        )


def _undefined(cell: Cell, t: float, what: str, robot: int) -> NonFiniteError:
    return NonFiniteError(
        f"the law has no finite {what} for {cell.names[robot]} at t = {t:g} s: its Jacobian may be singular, "
        "or the loop unstable; stop the robots and reset the controller",
        time=t,
        robot=robot,
    )
