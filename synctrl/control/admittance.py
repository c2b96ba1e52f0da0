"""Admittance: every arm gives way to the force inside what several of them hold.

Forces inside an object do not move it; nothing in its motion shows them, and no law that sees motions alone
takes them out. A wrist that measures its wrench can: with h_i the internal wrench of hand i about the
object's origin, as `h_i` sums to zero over the hands,

    M_a y_i'' + D_a y_i' = -h_i,    e_i + y_i, xd_i' + y_i', xd_i'' + y_i''   for   e_i, xd_i', xd_i''.

y is kept in the axes of the desired pose R_d, in which an error of the geometry of grasps is constant; in
world axes it is Y = R_d y with Y' = R_d y' + w_d x Y. With M_a = 0 y' = -h / D_a, and y counts in e alone.

Of arms that are told places alone, as at pins, h is a force and y a displacement, both in world axes: places
have no axes of their own. An error of the geometry then turns with the object, and y has to follow it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..checks import finite_array, instance
from ..coupling.cell import Cell, Reference
from ..errors import InputError
from ..tasks.measurement import Measurement
from ..tasks.pose import PoseSpace
from ..tasks.rotations import exp
from ..tasks.spaces import CartesianSpace
from .adaptation import BoundAdaptation, Seen
from .adaptation.beside import Beside
from .adaptation.protocol import check_still, check_three_rows


class Admittance:
    """Arms that give way to internal wrenches, as a mass and a damper would.

    V stays a Lyapunov function if D_a > (Lambda + beta d) M_a, d the largest eigenvalue of S^T S, with
    integrals that leak at Lambda; runs of which this does not hold warn and are outside the theorem. So are
    arms that are told places, which have no use for the second numbers.

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
            InputError: another space than those of poses and of places, or one in which errors count at
                points that slide; weights other than the identity or minus it; an adaptation that moves or
                slows down the desired motion too; or a network whose messages would tell of errors that do
                not give way.
        """
        _check_cell(cell)
        check_still("an admittance", adaptation, adaptation)
        if hasattr(network, "messages"):
            words = "an admittance expects a network without messages, for example Ideal(), found"
            name = type(network).__name__
            raise InputError(f"{words} {name}", subject="network", found=name)
        if isinstance(cell.space, PoseSpace):
            return BoundAdmittance(adaptation, np.repeat(self.mass, 3), np.repeat(self.damping, 3))
        mass, damping = (np.full(cell.m, pair[0]) for pair in (self.mass, self.damping))
        return BoundPlaceAdmittance(adaptation, mass, damping, cell.space.rows)  # type: ignore[attr-defined]

    def as_dict(self) -> dict[str, Any]:
        """Its settings as plain data."""
        return {"mass": self.mass.tolist(), "damping": self.damping.tolist()}


class Giving(NamedTuple):
    """How arms give way, robot by robot; plain array arithmetic, which runs on symbols too.

    Attributes:
        damping: D_a of the m directions, (m,).
        inverse_mass: 1 / M_a, (m,); 0 without a mass.
        inertial: whether there is a mass, 1 or 0, (m,).
    """

    damping: np.ndarray
    inverse_mass: np.ndarray
    inertial: np.ndarray

    def rates(self, y_dot: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """y' and y''; without a mass the first follows from the wrench, and the second is not known."""
        y_ddot = -(h + self.damping * y_dot) * self.inverse_mass
        return self.inertial * y_dot - (1 - self.inertial) * h / self.damping, y_ddot

    def moved(
        self, task: Measurement, y: np.ndarray, desired: np.ndarray, wrenches: np.ndarray
    ) -> tuple[Measurement, np.ndarray]:
        """What was measured after it gave way, and what is felt in the desired axes, (..., 6).

        Args:
            task: what was measured.
            y: y and y', (2, ..., 6).
            desired: desired poses, twists, and rates of these, (3, ..., 6).
            wrenches: internal wrenches in world axes, (..., 6).
        """
        axes = exp(desired[0][..., 3:])[..., None, :, :]
        h = np.matvec(axes.mT, wrenches.reshape(*wrenches.shape[:-1], 2, 3)).reshape(wrenches.shape)
        return self._added(task, _in_world(axes, desired, np.stack((y[0], *self.rates(y[1], h))))), h

    def _added(self, task: Measurement, Y: np.ndarray) -> Measurement:
        """What was measured, with Y, Y' and Y'', (3, ..., m), in its errors and rates."""
        error, rates = task.error + Y[:2], task.rates + self.inertial * Y[1:]
        return Measurement(task.motion, error, rates, task.J, task.J_inv, task.J_dot, task.inversion)


class GivingPlaces(Giving):
    """How arms that are told places give way: as they are pushed, along the axes of the world."""

    __slots__ = ()

    def moved(
        self, task: Measurement, y: np.ndarray, desired: np.ndarray, wrenches: np.ndarray
    ) -> tuple[Measurement, np.ndarray]:
        """What was measured after it gave way, and the forces as they are; all rows are (..., m)."""
        return self._added(task, np.stack((y[0], *self.rates(y[1], wrenches)))), wrenches


class BoundAdmittance(Beside):
    """`Admittance` with the adaptation of a cell: its z is the adaptation's, and behind it y and y', (n, m).

    Attributes:
        mass, damping: M_a and D_a of the m directions, (m,).
        giving: the same for the equations.
    """

    kind: type[Giving] = Giving
    unit = "m, rad"

    def __init__(self, adaptation: Any, mass: np.ndarray, damping: np.ndarray):
        super().__init__(adaptation, np.zeros(2 * len(mass)))
        self.mass, self.damping = mass, damping
        inertial = (mass > 0).astype(float)
        self.giving = self.kind(damping, inertial / np.where(mass > 0, mass, 1.0), inertial)

    # -- what gives way -----------------------------------------------------------------------------------

    def given_way(self, z: np.ndarray) -> np.ndarray:
        """y and y' of states z, (..., n, Z), in the desired axes: (2, ..., n, m)."""
        return np.stack(np.split(self.own(z), 2, axis=-1))

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
            The same with errors that gave way, and the wrenches in the desired axes, (n, m).

        Raises:
            InputError: nobody measured wrenches.
        """
        return self.giving.moved(task, self.given_way(z), reference.desired, _felt(wrenches))

    # -- the adaptation, with y and y' behind its state ---------------------------------------------------

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        h = _felt(seen.wrench)
        learned = self.adaptation.rate(self.learned(z), seen)
        return np.concatenate((learned, *self.giving.rates(self.given_way(z)[1], h)), axis=1)

    def outputs(self, z: np.ndarray) -> dict[str, tuple[np.ndarray, str, tuple[str, ...]]]:
        """What a result gets of states z, (T, n, Z): y, by how much each arm gave way."""
        return {"admittance": (self.given_way(z)[0], self.unit, ("time", "robot", "axis"))}


class BoundPlaceAdmittance(BoundAdmittance):
    """The same of arms that are told places: of wrenches they feel the forces along their coordinates.

    Args:
        adaptation: of the cell.
        mass, damping: M_a and D_a, (m,).
        rows: which of x, y and z the m coordinates are.
    """

    kind = GivingPlaces
    unit = "m"

    def __init__(self, adaptation: Any, mass: np.ndarray, damping: np.ndarray, rows: list[int]):
        super().__init__(adaptation, mass, damping)
        self._rows = rows

    def moved(
        self, task: Measurement, z: np.ndarray, reference: Reference, wrenches: np.ndarray | None
    ) -> tuple[Measurement, np.ndarray]:
        """As of poses, with the forces along the coordinates, (n, m), for what is felt."""
        return super().moved(task, z, reference, _felt(wrenches)[:, self._rows])


def _felt(wrench: np.ndarray | None) -> np.ndarray:
    if wrench is None:
        expected = "an admittance expects the internal wrenches of the hands, (n, 6)"
        raise InputError(f"{expected}, found none", subject="wrenches")
    return wrench


def _in_world(axes: np.ndarray, desired: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Y = R_d y, Y' and Y'' of y, y' and y'', (3, ..., 6)."""
    w, w_dot = desired[1:, ..., None, 3:]
    parts = np.matvec(axes, y.reshape(*y.shape[:-1], 2, 3))
    Y, slid = parts[0], np.cross(w, parts[0])
    Y_dot = parts[1] + slid
    Y_ddot = parts[2] + np.cross(w_dot, Y) + np.cross(w, parts[1] + Y_dot)
    return np.stack((Y, Y_dot, Y_ddot)).reshape(y.shape)


def _check_cell(cell: Cell) -> None:
    spaces = "PoseSpace() or CartesianSpace(), in which an admittance gives way"
    instance("space", cell.space, (PoseSpace, CartesianSpace), spaces)
    check_three_rows("an admittance", cell.space)
    weights = cell.references(np.zeros(1))[0].weights
    if weights.move or not np.array_equal(np.abs(weights.c), np.tile(np.eye(cell.m), (cell.n, 1, 1))):
        raise InputError(
            "an admittance expects weights of one object's frame, the identity or minus it",
            subject="coupling",
        )
