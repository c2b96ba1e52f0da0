"""What every ready cell hands on to its experiment: parts that take the place of the paper's."""

from __future__ import annotations

from typing import TypedDict

from ..checks import instance
from ..control.adaptation import Adaptation
from ..control.gains import Gains
from ..control.laws import Law
from ..control.network import Network


class Parts(TypedDict, total=False):
    """Parts of the controller, as `Experiment` takes them."""

    adaptation: Adaptation | None
    law: Law | None
    network: Network | None


def chosen_gains(gains: Gains | None, default: Gains, parts: Parts) -> Gains:
    """The gains given, or else the cell's, without Gamma where another adaptation takes its place.

    Raises:
        InputError: something that is no gains.
    """
    if gains is None:
        return default if parts.get("adaptation") is None else default.replace(Gamma=None)
    instance("gains", gains, Gains, "Gains")
    return gains
