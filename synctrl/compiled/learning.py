"""Adaptations as generated code: their `estimate`, `rate` and `settle`, run on symbols instead of numbers.

So any adaptation made of plain array arithmetic runs in the compiled engine, a user's own too. What cannot be
traced, or lets a robot learn from what others see, is refused by name.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..control.adaptation import Seen
from ..control.adaptation.gradient import BoundGradient
from ..control.controller import Controller
from ..errors import InputError
from .algebra import column_of, symbols

#: what a rate is a function of, beside z and the gradient
MOTION = ("q", "v", "v_ref", "a_ref", "s_q")


@dataclass(frozen=True, eq=False)
class Learning:
    """How one robot learns.

    Attributes:
        size: number of entries of its state, Z.
        estimate: CasADi function, z -> theta_hat.
        rate: CasADi function, z, q, v, v_ref, a_ref, s_q, Y^T s_q -> z'.
        settle: CasADi function, z -> z after a step; None if it stays what it is.
    """

    size: int
    estimate: Any
    rate: Any
    settle: Any

    def key(self) -> str:
        """The same text for robots that learn alike."""
        functions = (self.estimate, self.rate, self.settle)
        return " ".join(function.serialize() for function in functions if function is not None)


def trace_learning(controller: Controller) -> list[Learning | None]:
    """How every robot of a cell learns; None for (14), which has code of its own.

    Raises:
        InputError: an adaptation that does not take symbols, or mixes robots.
    """
    cell, adaptation = controller.cell, controller.adaptation
    if type(adaptation) is BoundGradient:
        return [None] * cell.n
    try:
        return _traced(controller)
    except Exception as error:  # whatever a user's code raises of symbols
        name = f"{type(adaptation).__module__}.{type(adaptation).__qualname__}"
        raise InputError(
            f"engine='compiled' cannot trace the adaptation {name}, which has to be plain array arithmetic, "
            f"robot by robot: {type(error).__name__}: {str(error)[:300]}; use engine='pinocchio'"
        ) from error


def _traced(controller: Controller) -> list[Learning | None]:
    import casadi as ca

    cell, adaptation = controller.cell, controller.adaptation
    joints = [robot.nv for robot in cell.robots]
    counts = [len(parameters.theta) for parameters in cell.parameters]
    size = adaptation.start().shape[1]
    z, gradient = _symbols("z", [size] * cell.n, size), _symbols("gradient", counts, cell.theta.shape[1])
    motion = [_symbols(name, joints, cell.nv) for name in MOTION]
    estimates, settled = adaptation.estimate(z), adaptation.settle(z)
    rates = adaptation.rate(
        z, Seen(**dict(zip(MOTION, motion, strict=True)), gradient=gradient, regressor=None)
    )
    found: list[Learning | None] = []
    for i, (nv, count) in enumerate(zip(joints, counts, strict=True)):
        inputs = [column_of(z[i])]
        seen = [*(column_of(part[i, :nv]) for part in motion), column_of(gradient[i, :count])]
        estimate = ca.Function("estimate", inputs, [column_of(estimates[i, :count])])
        rate = ca.Function("rate", [*inputs, *seen], [column_of(rates[i])])
        settle = None if settled is z else ca.Function("settle", inputs, [column_of(settled[i])])
        found.append(Learning(size, estimate, rate, settle))
    return found


def _symbols(name: str, lengths: list[int], longest: int) -> np.ndarray:
    """Rows of symbols, (n, longest), padded with zeros."""
    rows = np.zeros((len(lengths), longest), dtype=object)
    for row, length in zip(rows, lengths, strict=True):
        row[:length] = symbols(name, length)
    return rows
