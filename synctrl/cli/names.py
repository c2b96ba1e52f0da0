"""Names that may stand on the command line, for completion."""

from __future__ import annotations


def robot_names(incomplete: str) -> list[str]:
    """Names of the catalogue."""
    from ..robots.catalog import catalog_names

    return [name for name in catalog_names() if name.startswith(incomplete)]


def engine_names(incomplete: str) -> list[str]:
    """Names of engines."""
    return [name for name in ("auto", "compiled", "pinocchio") if name.startswith(incomplete)]


def law_names(incomplete: str) -> list[str]:
    """Names of laws; of several, separated by commas, the last one is completed."""
    from .laws import LAWS

    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in LAWS if name.startswith(last)]


def ready_cells(incomplete: str) -> list[str]:
    """Names of the ready cells that are experiments."""
    from .. import experiments

    return [name for name in experiments.__all__ if name.startswith(incomplete) and name not in NO_CELLS]


#: of the room of ready cells, what gives no experiment
NO_CELLS = ("quadratic_analysis",)
