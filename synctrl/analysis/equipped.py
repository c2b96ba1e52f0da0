"""The frozen cell with sensors and actuators in its loop, as far as these are linear.

Velocities are measured with a lag, v_m' = (v - v_m)/T_v, and torques act after a dead time, exp(-s theta) by
its Pade approximation of second order, and a lag T_u. A controller that samples once a period T adds T/2 to
the dead time, because torque is held; differences of positions over T with a filter exp(-omega T) = a lag by
T_v = T/2 + a T/(1 - a). That is right for motions that are slow against T. What a count of an encoder does is
not linear and does not move the margin, nor does a bias or noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..checks import non_negative_number, positive_number
from ..errors import InputError
from .frozen import Frozen


@dataclass(frozen=True)
class Equipment:
    """Lags in the loop of every joint, s.

    Attributes:
        velocity_lag: T_v, with which velocities are measured.
        dead_time: theta, after which torque acts.
        torque_lag: T_u, with which torque follows.

    Raises:
        InputError: a number below 0.
    """

    velocity_lag: float = 0.0
    dead_time: float = 0.0
    torque_lag: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            non_negative_number(name, value)


class Filter(NamedTuple):
    """x' = A x + B u, C x + D u, of one signal: (k, k), (k, 1), (1, k) and (1, 1)."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray


def equipment(
    sensors: Sequence[Any] = (), actuators: Sequence[Any] = (), control_period: float | None = None
) -> Equipment:
    """The lags of sensors and actuators, of those joints that lag most.

    Args:
        sensors: of which the ones with an `omega` take velocities from differences.
        actuators: of which a `time_constant` is a lag and a `time` a dead time, s.
        control_period: T, s; None for continuous control.

    Raises:
        InputError: a period that is not positive, or none where velocities come from differences.
    """
    T = 0.0 if control_period is None else positive_number("control_period", control_period)
    filters = [sensor.omega for sensor in sensors if hasattr(sensor, "omega")]
    if filters and not T:
        raise InputError.expected("a control period for differences of positions", None, "control_period")
    kept = [0.0 if omega is None else float(np.exp(-omega * T)) for omega in filters]
    velocity_lag = sum(0.5 * T + a * T / (1 - a) for a in kept)
    dead_time = sum(float(part.time) for part in actuators if hasattr(part, "time"))
    torque_lag = sum(
        float(np.max(part.time_constant)) for part in actuators if hasattr(part, "time_constant")
    )
    return Equipment(velocity_lag, dead_time + 0.5 * T, torque_lag)


def lag(time_constant: float) -> Filter:
    """1/(1 + T s)."""
    rate = 1 / time_constant
    return Filter(*(np.array([[value]]) for value in (-rate, rate, 1.0, 0.0)))


def dead_time(time: float) -> Filter:
    """exp(-s theta) = 1 - 12 z/(z^2 + 6 z + 12) + O(z^5) with z = s theta."""
    A, B = np.array([[-6.0, -12.0], [1.0, 0.0]]) / time, np.array([[1.0], [0.0]]) / time
    return Filter(A, B, np.array([[-12.0, 0.0]]), np.eye(1))


def equipped(frozen: Frozen, parts: Equipment) -> Frozen:
    """The frozen cell with lags in its loop, whose states come behind its own; no theorem is about it."""
    X, J = len(frozen.own), sum(frozen.joints)
    speeds = slice(X - J, X)  # the rows of y'', and the columns of y'
    loop = _Loop(frozen.own.copy(), frozen.heard.copy())
    loop.own[speeds], loop.heard[speeds] = 0.0, 0.0
    measured, nothing = np.eye(X)[speeds], np.zeros((J, frozen.heard.shape[1]))
    if parts.velocity_lag:
        measured, _ = loop.through(lag(parts.velocity_lag), measured, nothing)
    heard, asked = frozen.heard[speeds], frozen.own[speeds]
    asked = _wide(asked[:, : X - J], loop) + asked[:, speeds] @ measured
    sent = _wide(frozen.sent[:, : X - J], loop) + frozen.sent[:, speeds] @ measured
    if parts.dead_time:
        asked, heard = loop.through(dead_time(parts.dead_time), asked, heard)
    if parts.torque_lag:
        asked, heard = loop.through(lag(parts.torque_lag), asked, heard)
    loop.own[speeds], loop.heard[speeds] = _wide(asked, loop), heard
    return replace(frozen, own=loop.own, heard=loop.heard, sent=_wide(sent, loop), proved=False)


class _Loop:
    """Matrices of a cell that get larger with what is put into its loop."""

    def __init__(self, own: np.ndarray, heard: np.ndarray):
        self.own, self.heard = own, heard

    def through(self, part: Filter, source: np.ndarray, heard: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What comes out of a filter, of every joint, as rows on the state and on what is heard."""
        X, J = len(self.own), len(source)
        A, B, C, D = (np.kron(matrix, np.eye(J)) for matrix in part)
        self.own = np.block([[self.own, np.zeros((X, len(A)))], [B @ source, A]])
        self.heard = np.vstack((self.heard, B @ heard))
        return np.hstack((D @ source, C)), D @ heard


def _wide(rows: np.ndarray, loop: _Loop) -> np.ndarray:
    """Rows on the first of the states, as rows on all of them."""
    return np.hstack((rows, np.zeros((len(rows), len(loop.own) - rows.shape[1]))))
