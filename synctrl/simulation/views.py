"""Figures of a result, by name in one table: what draws them is imported when it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import MappingProxyType
from typing import Any

from ..checks import choice

#: the figures that have a name, in the order in which they are shown: module and function
FIGURES = MappingProxyType(
    {
        "tracking_error": ("synctrl.show.plots", "tracking_errors"),
        "sync_error": ("synctrl.show.plots", "sync_errors"),
        "torque": ("synctrl.show.run_figures", "torques"),
        "path": ("synctrl.show.run_figures", "paths"),
        "estimates": ("synctrl.show.run_figures", "estimates"),
    }
)
#: what makes all of them
GALLERY = "synctrl.show.run_figures", "gallery"


def find_figure(name: str) -> Callable[..., Any]:
    """What draws the figure of a name.

    Raises:
        InputError: an unknown name.
    """
    return found(*FIGURES[choice("figure", name, tuple(FIGURES))])


def found(module: str, name: str) -> Any:
    """Something by the name of its module and its own."""
    return getattr(import_module(module), name)
