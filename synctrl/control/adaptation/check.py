"""What an adaptation of one's own gives, looked at once before anything runs."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np

from ...checks import finite_array, instance
from ...coupling.cell import Cell
from ...errors import InputError
from ...robots.regressors import regressors
from .protocol import BoundAdaptation, Seen


def check_adaptation(adaptation: BoundAdaptation, cell: Cell) -> None:
    """Refuse an adaptation whose arrays do not fit; a rate that fails is left to the run, which says so.

    Raises:
        InputError: a start that is no array of finite numbers, (n, Z), or something of another shape.
    """
    where = f"adaptation {type(adaptation).__qualname__}"
    z: Any = adaptation.start()
    instance(f"{where}, start", z, np.ndarray, "an array")
    finite_array(f"{where}, start", z, (cell.n, None))
    found = {"estimate": np.shape(adaptation.estimate(z)), "settle": np.shape(adaptation.settle(z))}
    with suppress(Exception):
        found["rate"] = np.shape(adaptation.rate(z, _no_errors(cell)))
    for name, shape in found.items():
        expected = cell.theta.shape if name == "estimate" else z.shape
        if shape != expected:
            raise InputError(f"{where}, {name}: expected an array of shape {expected}, found {shape}")


def _no_errors(cell: Cell) -> Seen:
    """A cell that moves on as it starts, without errors."""
    q, v, nothing = cell.q0, cell.v0, np.zeros((cell.n, cell.nv))
    Y = regressors(cell.parameters, [robot.nv for robot in cell.robots])(q, v, v, nothing)
    return Seen(q, v, v, nothing, nothing, np.zeros(cell.theta.shape), Y)
