"""Laws as generated code: their `command`, run on symbols instead of numbers.

So any law made of plain array arithmetic runs in the compiled engine, a user's own too. What cannot be
traced, asks for the time, or lets a robot use what others know, is refused by name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..control.controller import Controller
from ..control.gains import Gains
from ..control.laws import Asked, BoundLaw, Errors, completed
from ..control.laws.protocol import ROWS, WEIGHTS
from ..control.laws.sun_mills import BoundSunMills
from ..coupling.cell import Cell
from ..errors import InputError
from .algebra import column_of, symbols


@dataclass(frozen=True, eq=False)
class TracedLaw:
    """What one robot does.

    Attributes:
        command: CasADi function, those of `ROWS` and the weights, (4 m m), row by row -> xref', xref'',
            force and e*.
    """

    command: Any

    def key(self) -> str:
        """The same text for robots that do alike."""
        return str(self.command.serialize())


def trace_law(controller: Controller) -> list[TracedLaw | None]:
    """What every robot of a cell does; None for `SunMills`, which has code of its own.

    Raises:
        InputError: a law that does not take symbols, or mixes robots.
    """
    law = controller.law
    if type(law) is BoundSunMills:
        return [None] * controller.cell.n
    try:
        return _traced(law, controller.cell.n, controller.cell.m)
    except Exception as error:  # whatever a user's code raises of symbols
        name = f"{type(law).__module__}.{type(law).__qualname__}"
        raise InputError(
            f"engine='compiled' cannot trace the law {name}, which has to be plain array arithmetic, robot "
            f"by robot, without the time: {type(error).__name__}: {str(error)[:300]}; use engine='pinocchio'"
        ) from error


def _traced(law: BoundLaw, n: int, m: int) -> list[TracedLaw | None]:
    import casadi as ca

    rows = {name: symbols(name, n, m) for name in ROWS}
    weights = {name: symbols(name, n, m, m) for name in WEIGHTS}
    errors = Errors.from_rows(**rows, **weights)
    asked = completed(law.command(errors), errors)
    found: list[TracedLaw | None] = []
    for i in range(n):
        inputs = [column_of(rows[name][i]) for name in ROWS]
        inputs.append(column_of(np.stack([weights[name][i] for name in WEIGHTS])))
        outputs = [column_of(part[i]) for part in (asked.xref_dot, asked.xref_ddot, asked.force)]
        outputs.append(column_of(asked.e_star[i]))
        found.append(TracedLaw(ca.Function("command", inputs, outputs)))
    return found


class ChosenLaw:
    """A law for some of the robots that it was bound to, as the specimen has them.

    Args:
        controller: of the larger cell, whose law is asked robot by robot, the others without errors.
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
        found = {}
        for name in (*ROWS, *WEIGHTS):
            value = getattr(errors, name)[row]
            rows = np.zeros((self._n, *value.shape))
            if name in ("c", "c_inv"):
                rows[...] = np.eye(len(value))
            rows[robot] = value
            found[name] = rows
        return Errors.from_rows(**found)
