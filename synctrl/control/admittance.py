"""Admittance: every arm gives way to the force inside what several of them hold.

Forces inside an object do not move it; nothing in its motion shows them, and no law that sees motions alone
takes them out. A wrist that measures its wrench can: with h_i the internal wrench of hand i about the
object's origin, as `h_i` sums to zero over the hands,

    M_a y_i'' + D_a y_i' = -h_i,    e_i + y_i, xd_i' + y_i', xd_i'' + y_i''   for   e_i, xd_i', xd_i''.

y is kept in the axes of the desired pose R_d, in which an error of the geometry of grasps is constant; in
world axes it is Y = R_d y with Y' = R_d y' + w_d x Y. With M_a = 0 y' = -h / D_a, and y counts in e alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..checks import finite_array, instance
from ..coupling.cell import Cell, Reference
from ..errors import InputError
from ..tasks.measurement import Measurement
from ..tasks.pose import PoseSpace
from ..tasks.rotations import exp
from .adaptation import BoundAdaptation, Seen, after_sample
from .adaptation.protocol import check_still, check_three_rows


class Admittance:
    """Arms that give way to internal wrenches, as a mass and a damper would.

    V stays a Lyapunov function if D_a > (Lambda + beta d) M_a, d the largest eigenvalue of S^T S, with
    integrals that leak at Lambda; runs of which this does not hold warn and are outside the theorem.

    Args:
        mass: M_a against displacement, kg, and against turning, kg·m^2, at least 0.
        damping: D_a, N·s/m and N·m·s/rad, above 0.

    Raises:
        InputError: not two numbers each, or numbers of another sign.
    """

    def __init__(self, mass: Any = (100.0, 3.0), damping: Any = (2000.0, 60.0)):
        self.mass = finite_array("admittance, mass", mass, (2,))
        self.damping = finite_array("admittance, damping", damping, (2,))
        if self.mass.min() < 0:
            raise InputError.expected("two numbers of at least 0", self.mass, "admittance, mass")
        if self.damping.min() <= 0:
            raise InputError.expected("two numbers above 0", self.damping, "admittance, damping")

    def bind(self, cell: Cell, adaptation: BoundAdaptation, network: Any) -> BoundAdmittance:
        """This admittance for a cell, whose adaptation takes its state along.

        Args:
            cell: the cell.
            adaptation, network: for its robots.

        Raises:
            InputError: another space than that of poses, or one in which errors count at points that slide;
                weights other than the identity or minus it; an adaptation that moves or slows down the
                desired motion too; or a network whose messages would tell of errors that do not give way.
        """
        _check_cell(cell)
        check_still("an admittance", adaptation, adaptation)
        if hasattr(network, "messages"):
            words = "an admittance expects a network without messages, for example Ideal(), found"
            name = type(network).__name__
            raise InputError(f"{words} {name}", subject="network", found=name)
        return BoundAdmittance(adaptation, np.repeat(self.mass, 3), np.repeat(self.damping, 3))

    def as_dict(self) -> dict[str, Any]:
        """Its settings as plain data."""
        return {"mass": self.mass.tolist(), "damping": self.damping.tolist()}


class BoundAdmittance:
    """`Admittance` with the adaptation of a cell: its z is the adaptation's, and behind it y and y', (n, 6).

    Attributes:
        mass, damping: M_a and D_a of the six directions, (6,).
    """

    def __init__(self, adaptation: Any, mass: np.ndarray, damping: np.ndarray):
        self.adaptation, self.mass, self.damping = adaptation, mass, damping
        self._first = adaptation.start()
        self._Z = self._first.shape[1]
        self._inertial = mass > 0
        self._inverse_mass = np.where(self._inertial, 1 / np.where(self._inertial, mass, 1.0), 0.0)

    # -- what gives way -----------------------------------------------------------------------------------

    def given_way(self, z: np.ndarray) -> np.ndarray:
        """y and y' of states z, (..., n, Z), in the desired axes: (2, ..., n, 6)."""
        return np.stack(np.split(z[..., self._Z :], 2, axis=-1))

    def moved(
        self, task: Measurement, z: np.ndarray, reference: Reference, wrenches: np.ndarray | None
    ) -> tuple[Measurement, np.ndarray]:
        """What was measured, with e + Y and xd' + Y' for e and xd', and their rates; and what is felt.

        Args:
            task: what was measured.
            z: the state.
            reference: what is desired.
            wrenches: internal wrenches in world axes, (n, 6), N and N·m.

        Returns:
            The same with errors that gave way, and the wrenches in the desired axes, (n, 6).

        Raises:
            InputError: nobody measured wrenches.
        """
        y, y_dot = self.given_way(z)
        h = np.vecmat(_felt(wrenches).reshape(-1, 2, 3), _axes(reference)[:, None]).reshape(-1, 6)
        Y = _in_world(reference, np.stack((y, *self._rates(y_dot, h))))
        error, rates = task.error + Y[:2], task.rates + np.where(self._inertial, Y[1:], 0.0)
        found = task.motion, error, rates, task.J, task.J_inv, task.J_dot, task.inversion
        return Measurement(*found), h

    def _rates(self, y_dot: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """y' and y''; without a mass the first follows from the wrench, and the second is not known."""
        y_ddot = -(h + self.damping * y_dot) * self._inverse_mass
        return np.where(self._inertial, y_dot, -h / self.damping), y_ddot

    # -- the adaptation, with y and y' behind its state ---------------------------------------------------

    def start(self) -> np.ndarray:
        return np.concatenate((self._first, np.zeros((len(self._first), 12))), axis=1)

    def estimate(self, z: np.ndarray) -> np.ndarray:
        return self.adaptation.estimate(z[:, : self._Z])

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        h = _felt(seen.wrench)
        learned = self.adaptation.rate(z[:, : self._Z], seen)
        return np.concatenate((learned, *self._rates(self.given_way(z)[1], h)), axis=1)

    def settle(self, z: np.ndarray) -> np.ndarray:
        learned = z[:, : self._Z]
        settled = self.adaptation.settle(learned)
        return z if settled is learned else np.concatenate((settled, z[:, self._Z :]), axis=1)

    def leap(self, z: np.ndarray, z_dot: np.ndarray, h: float) -> np.ndarray:
        """What is learned as the adaptation has it, and y along its rate."""
        learned = after_sample(self.adaptation, z[:, : self._Z], z_dot[:, : self._Z], h)
        return np.concatenate((learned, z[:, self._Z :] + h * z_dot[:, self._Z :]), axis=1)

    def outputs(self, z: np.ndarray) -> dict[str, tuple[np.ndarray, str, tuple[str, ...]]]:
        """What a result gets of states z, (T, n, Z): y, by how much each arm gave way."""
        return {"admittance": (self.given_way(z)[0], "m, rad", ("time", "robot", "axis"))}

    def storage(self, z: np.ndarray, theta: np.ndarray) -> float:
        return self.adaptation.storage(z[:, : self._Z], theta)

    def storage_rate(self, z: np.ndarray, z_dot: np.ndarray, theta: np.ndarray) -> float:
        return self.adaptation.storage_rate(z[:, : self._Z], z_dot[:, : self._Z], theta)

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        return self.adaptation.powers(z[:, : self._Z], theta, seen)


def _felt(wrench: np.ndarray | None) -> np.ndarray:
    if wrench is None:
        expected = "an admittance expects the internal wrenches of the hands, (n, 6)"
        raise InputError(f"{expected}, found none", subject="wrenches")
    return wrench


def _axes(reference: Reference) -> np.ndarray:
    """R_d, (n, 3, 3)."""
    return exp(reference.xd[:, 3:])


def _in_world(reference: Reference, y: np.ndarray) -> np.ndarray:
    """Y = R_d y, Y' and Y'' of y, y' and y'', (3, n, 6)."""
    w, w_dot = reference.xd_dot[:, None, 3:], reference.xd_ddot[:, None, 3:]
    parts = np.matvec(_axes(reference)[:, None], y.reshape(3, -1, 2, 3))
    Y, slid = parts[0], np.cross(w, parts[0])
    Y_dot = parts[1] + slid
    Y_ddot = parts[2] + np.cross(w_dot, Y) + np.cross(w, parts[1] + Y_dot)
    return np.stack((Y, Y_dot, Y_ddot)).reshape(3, -1, 6)


def _check_cell(cell: Cell) -> None:
    instance("space", cell.space, PoseSpace, "PoseSpace(), in which an admittance gives way")
    check_three_rows("an admittance", cell.space)
    weights = cell.references(np.zeros(1))[0].weights
    if weights.move or not np.array_equal(np.abs(weights.c), np.tile(np.eye(6), (cell.n, 1, 1))):
        raise InputError(
            "an admittance expects weights of one object's frame, the identity or minus it",
            subject="coupling",
        )
