"""Names and arguments of version 0.1 that are others today: they work, and warn with the new one."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

from .errors import warn

T = TypeVar("T")


def names_elsewhere(module: str, new_home: str, *names: str) -> Callable[[str], Any]:
    """The `__getattr__` of a module, some of whose names are in another module now.

    Args:
        module: its `__name__`.
        new_home: the other module, seen from this one, `.law` or `..coupling.cell`.
        names: what has moved.
    """

    def find(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        home = import_module(new_home, module.rpartition(".")[0])
        tell(f"{module}.{name}", f"{home.__name__}.{name}")
        return getattr(home, name)

    return find


def argument(function: str, old: str, given: T | None, new: str, value: T | None) -> T | None:
    """What was given for an argument that had another name.

    Args:
        function: whose argument it is.
        old, given: its old name, and what was given under it.
        new, value: its name of today, and what was given under that.

    Raises:
        TypeError: given under both names.
    """
    if given is None:
        return value
    if value is not None:
        raise TypeError(f"{function}() got one argument under two names, '{old}' and '{new}'")
    tell(f"{function}({old}=...)", f"{function}({new}=...)")
    return given


def tell(old: str, new: str) -> None:
    """Warn whoever called the package that something has another name now."""
    warn(f"{old} is deprecated: use {new}", DeprecationWarning)
