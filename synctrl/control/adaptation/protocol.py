"""Adaptation: what a controller believes of its robots' parameters, and how it learns.

The proof needs of it nothing but a storage V_th >= 0 with

    V_th' = -s_q^T Y tilde + named powers,   tilde = theta - theta_hat,

so that V' is what it is with (14), plus the named powers. An adaptation of one's own is a class with a `bind`
that returns an object with the methods of `BoundAdaptation`; nothing else has to be touched.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ...coupling.cell import Cell
from ...errors import InputError

Momentum = tuple[np.ndarray, np.ndarray]
"""Y_p and Y_h, (n, nv, P) each, of p = M v = Y_p theta and p' = tau - Y_h theta, see `momentum_of_all`."""


def _unknown() -> Momentum:
    raise InputError("expected the regressors of momentum, found none", subject="momentum")


@dataclass(slots=True)
class Seen:
    """What an adaptation sees at one instant, one row per robot.

    Attributes:
        q, v: joint positions and velocities, (n, nv).
        v_ref, a_ref: reference velocity and acceleration, (n, nv).
        s_q: v_ref - v, (n, nv).
        gradient: Y^T s_q, (n, P).
        regressor: Y, (n, nv, P).
        tau: torque that the controller asks for, (n, nv), N·m.
        applied: what the limits that it knows leave of it, (n, nv), N·m.
        momentum: gives the regressors of momentum; a function, because they take time and few ask for them.
        wrench: internal wrenches in the axes of the desired poses, (n, 6), N and N·m, if they are measured.
    """

    q: np.ndarray
    v: np.ndarray
    v_ref: np.ndarray
    a_ref: np.ndarray
    s_q: np.ndarray
    gradient: np.ndarray
    regressor: Any
    tau: np.ndarray
    applied: np.ndarray
    momentum: Callable[[], Momentum] = _unknown
    wrench: np.ndarray | None = None


class BoundAdaptation(Protocol):
    """An adaptation for the robots of one cell. Its state z has one row per robot, (n, Z).

    `estimate` and `rate` use plain array arithmetic where they are to be traced for generated code.
    """

    def start(self) -> np.ndarray:
        """z at t = 0, (n, Z), which stands for the cell's theta_hat0.

        Raises:
            InputError: a first estimate that this adaptation cannot start from.
        """

    def estimate(self, z: np.ndarray) -> np.ndarray:
        """theta_hat, (n, P)."""

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        """z', (n, Z)."""

    def settle(self, z: np.ndarray) -> np.ndarray:
        """z after a step, for example projected; usually z itself."""

    def storage(self, z: np.ndarray, theta: np.ndarray) -> float:
        """V_th for the true theta, (n, P)."""

    def storage_rate(self, z: np.ndarray, z_dot: np.ndarray, theta: np.ndarray) -> float:
        """d V_th/dt for a given z', by the chain rule."""

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        """What V_th' has beside -s_q^T Y tilde, by name, N·m/s; always the same names."""


def after_sample(adaptation: Any, z: np.ndarray, z_dot: np.ndarray, h: float) -> np.ndarray:
    """z after a sample of h s, through which a digital controller holds z'.

    By default it is z + h z', settled. An adaptation whose z lives on a curved space may have a `leap`,
    with the same arguments, that goes along it instead.
    """
    leap = getattr(adaptation, "leap", None)
    return adaptation.settle(z + h * z_dot) if leap is None else leap(z, z_dot, h)


def shift_of(adaptation: Any, network: Any) -> Any:
    """The method by which an adaptation moves the desired motion; None if it has none.

    It takes z and the `Reference`, and gives xd, xd' and xd'', (3, n, m), that controller and coupling see in
    place of the reference's; the log keeps those. With it there is `given_up`, from z and `Seen` to what is
    missing of v_ref' in a_ref, (n, nv).

    Args:
        adaptation, network: for the robots of one cell.

    Raises:
        InputError: a network whose messages would tell of the motion that was not moved.
    """
    return _of_desired("shift", adaptation, network)


def pace_of(adaptation: Any, network: Any) -> Any:
    """The method by which an adaptation sets the pace of the desired motion; None if it has none.

    It takes z, joint positions and velocities, (2, n, nv), and the `Reference`, and gives the `Reference`
    that stands in the place of that, in the log too. Its rates are derivatives: nothing is given up.

    Args, raises: as of `shift_of`.
    """
    return _of_desired("pace", adaptation, network)


def _of_desired(name: str, adaptation: Any, network: Any) -> Any:
    found = getattr(adaptation, name, None)
    if found is not None and hasattr(network, "messages"):
        raise InputError(
            f"{type(adaptation).__name__} moves the desired motion, of which messages do not know; expected "
            f"a network without messages, for example Ideal(), found {type(network).__name__}",
            subject="network",
        )
    return found


def check_still(who: str, adaptation: Any, bound: Any) -> None:
    """Refuse an adaptation in the care of another one if it moves the desired motion.

    Args:
        who: name of the other one.
        adaptation, bound: the adaptation, and the same for a cell.

    Raises:
        InputError: it does.
    """
    if hasattr(bound, "shift") or hasattr(bound, "pace"):
        found = type(adaptation).__name__
        expected = f"{who} expects an adaptation that leaves the desired motion alone"
        raise InputError(f"{expected}, found {found}", subject="adaptation", found=found)


def check_three_rows(who: str, space: Any) -> None:
    """Refuse a space that has to know more of a desired motion than its three rows, which alone are moved.

    Args:
        who: what moves them.
        space: the space of a cell.

    Raises:
        InputError: it has `further` rows.
    """
    if hasattr(space, "further"):
        found = type(space).__name__
        expected = f"{who} expects a space in which a desired motion has three rows"
        raise InputError(f"{expected}, found {found}", subject="space", found=found)


class Adaptation(Protocol):
    """A way to learn, before it knows the cell."""

    def bind(self, cell: Cell) -> BoundAdaptation:
        """This adaptation for a cell.

        Raises:
            InputError: gains or parameters that do not fit, named.
        """

    def as_dict(self) -> dict[str, Any]:
        """Name and settings as plain data."""
