"""Does an adaptation of a user's own give what it should? Asked once, before anything runs."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np

from ..checks import finite_array, instance
from ..errors import InputError
from .controller import Controller


def check_adaptation(controller: Controller) -> None:
    """Refuse an adaptation whose arrays do not fit; a rate that fails is left to the run, which says so.

    Args:
        controller: whose adaptation it is.

    Raises:
        InputError: a start that is no array of finite numbers, (n, Z), or something of another shape.
    """
    adaptation, cell = controller.adaptation, controller.cell
    where = f"adaptation {type(adaptation).__qualname__}"
    z: Any = adaptation.start()
    instance(f"{where}, start", z, np.ndarray, "an array")
    finite_array(f"{where}, start", z, (cell.n, None))
    _check_shape(f"{where}, estimate", adaptation.estimate(z), cell.theta.shape)
    _check_shape(f"{where}, settle", adaptation.settle(z), z.shape)
    rate = z
    with suppress(Exception):
        rate = _first_rate(controller, z)
    _check_shape(f"{where}, rate", rate, z.shape)


def _first_rate(controller: Controller, z: np.ndarray) -> Any:
    """z' where the cell starts."""
    cell = controller.cell
    reference, motion = cell.references(np.zeros(1))[0], np.stack((cell.q0, cell.v0))
    with np.errstate(all="ignore"):
        return controller.unchecked(reference, motion, z, controller.network.start()).z_dot


def _check_shape(where: str, found: Any, expected: tuple[int, ...]) -> None:
    if np.shape(found) != expected:
        raise InputError(f"expected an array of shape {expected}, found {np.shape(found)}", subject=where)
