"""What all ready cells share: parts that take the place of the paper's, gains, and what they are called."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypedDict

from ..checks import boolean, instance
from ..control.adaptation import Adaptation
from ..control.gains import Gains
from ..control.laws import Law
from ..control.network import Network
from ..coupling.cell import Cell
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment


class Parts(TypedDict, total=False):
    """Parts of the controller, as `Experiment` takes them."""

    adaptation: Adaptation | None
    law: Law | None
    network: Network | None


class ControllerParts(Parts, total=False):
    """Parts and options of the controller."""

    reference_acceleration: str | None
    k_r_space: str | None


def ready_experiment(
    cell: Cell,
    duration: float,
    default: Gains,
    gains: Gains | None,
    synchronized: bool,
    parts: ControllerParts,
    *remarks: str,
    disturbances: Sequence[Disturbance] = (),
) -> Experiment:
    """A ready cell with its controller.

    Args:
        cell: robots, task and coupling.
        duration: of the experiment, s.
        default: gains of the cell; without Gamma where another adaptation takes its place, and without beta
            and K_eps where the law has no place for them.
        gains: what is used instead of them, or None.
        synchronized: False sets beta = K_eps = 0, independent adaptive control.
        parts: parts and options of the controller, see `ControllerParts`.
        remarks: what else is special about the experiment, for its title.
        disturbances: torques from outside.

    Raises:
        InputError: a value of the wrong type.
    """
    boolean("synchronized", synchronized)
    if gains is None:
        gains = default if parts.get("adaptation") is None else default.replace(Gamma=None)
        gains = gains.independent() if getattr(parts.get("law"), "independent", False) else gains
    instance("gains", gains, Gains, "Gains")
    kind = "synchronized" if synchronized else "independent"
    title = ", ".join([cell.name, kind, *remarks, *["disturbed"] * bool(disturbances)])
    gains = gains if synchronized else gains.independent()
    return Experiment(cell, gains, duration, disturbances, title=title, **parts)
