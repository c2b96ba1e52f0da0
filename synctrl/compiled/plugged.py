"""Laws and adaptations of a user's own in generated code: traced for it, and asked where it is compared.

Their `command`, `estimate`, `rate` and `settle` are run on symbols instead of numbers. So any of them that is
made of plain array arithmetic runs in the compiled engine. What cannot be traced, asks for the time, or lets
a robot use what others know, is refused by name.

Generated code is compared with the reference engine on a small closed loop, the specimen, which has one robot
of each kind. A part of a user's own was bound to the whole cell, and perhaps to numbers of each of its
robots; so it is not bound anew, but asked for those robots that stand in the specimen, the others at rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..control.adaptation import Seen
from ..control.adaptation.gradient import BoundGradient
from ..control.controller import Controller
from ..control.gains import Gains
from ..control.laws import Asked, Errors, completed, no_errors
from ..control.laws.protocol import ROWS, WEIGHTS
from ..control.laws.sun_mills import BoundSunMills
from ..coupling.cell import Cell
from ..errors import InputError
from ..robots.momentum import momentum_of_all
from .algebra import array_of, column_of, symbols

#: what a rate is a function of, beside z, the gradient and the regressor
MOTION = ("q", "v", "v_ref", "a_ref", "s_q", "tau", "applied")


class Learning(NamedTuple):
    """How one robot learns.

    Attributes:
        estimate: CasADi function, z -> theta_hat.
        rate: CasADi function, z, q, v, v_ref, a_ref, s_q, tau, what is applied of it, Y^T s_q, Y row by
            row -> z'.
        settle: CasADi function, z -> z after a step; None if it stays what it is.
        leap: CasADi function, z, z', h -> z after a sample of h s; None if that is z + h z', settled.
    """

    estimate: Any
    rate: Any
    settle: Any
    leap: Any


def learner(controller: Controller) -> Any:
    """The adaptation of a controller; where its robots give way to forces, the one inside the admittance."""
    giving = controller.admittance
    return controller.adaptation if giving is None else giving.adaptation


def trace_law(controller: Controller) -> list[Any]:
    """What every robot of a cell does, as a CasADi function; None for `SunMills`, which has code of its own.

    The function is one of `ROWS` and the weights, (4 m m), row by row -> xref', xref'', force and e*.

    Raises:
        InputError: a law that does not take symbols, or mixes robots.
    """
    law, n, m = controller.law, controller.cell.n, controller.cell.m
    if type(law) is BoundSunMills:
        return [None] * n
    with _traceable("law", law, "robot by robot, without the time"):
        rows = {name: symbols(name, n, m) for name in ROWS}
        weights = {name: symbols(name, n, m, m) for name in WEIGHTS}
        errors = Errors.from_rows(**rows, **weights)
        asked = completed(law.command(errors), errors)[:4]
        inputs = [*rows.values(), np.stack([*weights.values()], axis=1)]
        return [_function("command", i, inputs, asked) for i in range(n)]


def trace_learning(controller: Controller, momentum: Sequence[Callable[[], Any]]) -> list[Learning | None]:
    """How every robot of a cell learns; None for (14), which has code of its own.

    Args:
        controller: of the cell.
        momentum: per robot, makes the CasADi function q, v -> Y_p, Y_h.

    Raises:
        InputError: an adaptation that does not take symbols, or mixes robots.
    """
    cell, adaptation = controller.cell, learner(controller)
    if type(adaptation) is BoundGradient:
        return [None] * cell.n
    with _traceable("adaptation", adaptation, "robot by robot"):
        joints = [robot.nv for robot in cell.robots]
        counts = [len(parameters.theta) for parameters in cell.parameters]
        z = symbols("z", *adaptation.start().shape)
        gradient = _padded("gradient", counts, cell.theta.shape[1])
        Y = _padded_matrices("regressor", joints, counts, (cell.n, cell.nv, cell.theta.shape[1]))
        motion = {name: _padded(name, joints, cell.nv) for name in MOTION}
        estimates, settled = adaptation.estimate(z), adaptation.settle(z)
        known = partial(_momentum, momentum, motion["q"], motion["v"], cell.theta.shape[1])
        seen = Seen(**motion, gradient=gradient, regressor=Y, momentum=known)
        rates = adaptation.rate(z, seen)
        z_dot, h = symbols("z_dot", *z.shape), np.tile(symbols("h", 1), (cell.n, 1))
        leapt = adaptation.leap(z, z_dot, h[:1, 0]) if hasattr(adaptation, "leap") else None
        return [
            Learning(
                _function("estimate", i, [z], [estimates[:, :P]]),
                _function("rate", i, [z, *_inputs(seen, nv, P)], [rates]),
                None if settled is z else _function("settle", i, [z], [settled]),
                None if leapt is None else _function("leap", i, [z, z_dot, h], [leapt]),
            )
            for i, (nv, P) in enumerate(zip(joints, counts, strict=True))
        ]


class ChosenLaw:
    """A law for some of the robots that it was bound to.

    Args:
        controller: of the larger cell, whose law is asked robot by robot.
        robots: which of its robots stands in each row; one may stand in several.
    """

    def __init__(self, controller: Controller, robots: Sequence[int]):
        self._law, self._n, self._robots = controller.law, controller.cell.n, robots
        self.reference_acceleration, self.k_r_space = controller.reference_acceleration, controller.k_r_space

    def bind(self, cell: Cell, gains: Gains) -> ChosenLaw:
        """Itself: it knows its robots and its gains."""
        return self

    def as_dict(self) -> dict[str, Any]:
        return {"name": type(self._law).__name__}

    def command(self, errors: Errors) -> Asked:
        rows = []
        for row, robot in enumerate(self._robots):
            alone = self._alone(errors, row, robot)
            asked = completed(self._law.command(alone), alone)
            rows.append([*(part[robot] for part in asked[:4]), asked.u[:, robot]])
        velocity, acceleration, force, e_star, u = (np.stack(part) for part in zip(*rows, strict=True))
        return Asked(velocity, acceleration, force, e_star, u.swapaxes(0, 1))

    def _alone(self, errors: Errors, row: int, robot: int) -> Errors:
        """What one robot sees, in the larger cell."""
        none = no_errors(self._n, errors.x_dot.shape[1])
        found = {name: getattr(none, name).copy() for name in (*ROWS, *WEIGHTS)}
        for name, rows in found.items():
            rows[robot] = getattr(errors, name)[row]
        return Errors.from_rows(**found)


class ChosenAdaptation:
    """An adaptation for some of the robots that it was bound to.

    Args:
        controller: of the larger cell, whose adaptation is asked robot by robot.
        robots: which of its robots stands in each row; one may stand in several.
    """

    def __init__(self, controller: Controller, robots: Sequence[int]):
        self._adaptation, self._cell, self._robots = learner(controller), controller.cell, robots
        self._z0 = self._adaptation.start()

    def bind(self, cell: Cell) -> ChosenAdaptation:
        """Itself: it knows its robots."""
        self._P = cell.theta.shape[1]
        return self

    def as_dict(self) -> dict[str, Any]:
        return {"name": type(self._adaptation).__name__}

    def start(self) -> np.ndarray:
        return self._z0[list(self._robots)]

    def estimate(self, z: np.ndarray) -> np.ndarray:
        return self._each(z, lambda full, _: self._adaptation.estimate(full))[:, : self._P]

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        return self._each(z, lambda full, row: self._adaptation.rate(full, self._alone(seen, row)))

    def settle(self, z: np.ndarray) -> np.ndarray:
        return z

    def _each(self, z: np.ndarray, ask: Callable[[np.ndarray, int], np.ndarray]) -> np.ndarray:
        """What is asked of the larger cell with one robot's state after the other put in its place."""
        rows = []
        for row, robot in enumerate(self._robots):
            full = self._z0.copy()
            full[robot] = z[row]
            rows.append(ask(full, row)[robot])
        return np.array(rows)

    def _alone(self, seen: Seen, row: int) -> Seen:
        """What one robot sees, in the larger cell."""
        found = {name: np.zeros_like(self._cell.v0) for name in MOTION}
        found["gradient"] = np.zeros_like(self._cell.theta)
        found["regressor"] = np.zeros((*self._cell.v0.shape, self._cell.theta.shape[1]))
        for name, rows in found.items():
            value = getattr(seen, name)[row]
            place: Any = (self._robots[row], *map(slice, value.shape))
            rows[place] = value
        cell = self._cell
        momentum = partial(momentum_of_all, cell.robots, cell.parameters, found["q"], found["v"])
        return Seen(**found, momentum=momentum)


# -- internals --------------------------------------------------------------------------------------------


@contextmanager
def _traceable(role: str, part: Any, how: str) -> Iterator[None]:
    """Say of a part what it is and how it has to be, whatever its code raises of symbols."""
    try:
        yield
    except Exception as error:
        name = f"{type(part).__module__}.{type(part).__qualname__}"
        raise InputError(
            f"engine='compiled' cannot trace {name}, which has to be plain array arithmetic, {how}: "
            f"{type(error).__name__}: {str(error)[:300]}; use engine='pinocchio'",
            subject=role,
            found=name,
        ) from error


def _function(name: str, robot: int, inputs: Sequence[np.ndarray], outputs: Sequence[np.ndarray]) -> Any:
    """A CasADi function of the rows of one robot; it cannot be made if what it gives depends on others."""
    import casadi as ca

    given, found = ([column_of(part[robot]) for part in parts] for parts in (inputs, outputs))
    return ca.Function(name, given, found)


def _momentum(
    makers: Sequence[Callable[[], Any]], q: np.ndarray, v: np.ndarray, P: int
) -> tuple[np.ndarray, np.ndarray]:
    """Y_p and Y_h of rows of symbols, (n, nv, P) each, padded with zeros."""
    found = np.zeros((2, *q.shape, P), dtype=object)
    for i, make in enumerate(makers):
        function = make()
        nv, columns = function.size_out(0)
        regressors = function(*(column_of(part[i, :nv]) for part in (q, v)))
        found[:, i, :nv, :columns] = [array_of(part) for part in regressors]
    return found[0], found[1]


def _inputs(seen: Seen, nv: int, P: int) -> list[np.ndarray]:
    """What a rate is a function of beside z, for robots with nv joints and P parameters."""
    return [*(getattr(seen, x)[:, :nv] for x in MOTION), seen.gradient[:, :P], seen.regressor[:, :nv, :P]]


def _padded_matrices(
    name: str, rows: Sequence[int], columns: Sequence[int], shape: tuple[int, int, int]
) -> np.ndarray:
    """Matrices of symbols, (n, longest, longest), padded with zeros."""
    matrices = np.zeros(shape, dtype=object)
    for matrix, nv, P in zip(matrices, rows, columns, strict=True):
        matrix[:nv, :P] = symbols(name, nv, P)
    return matrices


def _padded(name: str, lengths: Sequence[int], longest: int) -> np.ndarray:
    """Rows of symbols, (n, longest), padded with zeros."""
    rows = np.zeros((len(lengths), longest), dtype=object)
    for row, length in zip(rows, lengths, strict=True):
        row[:length] = symbols(name, length)
    return rows
