"""Packages of the extra `data`, imported when something is exported."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ..errors import MissingDependencyError


def needed(what: str, *modules: str, extra: str = "data") -> Any:
    """Modules that something needs; the module itself if it is one.

    Args:
        what: needs them, for example "a netCDF file".
        modules: their names.
        extra: of this package, to which they belong.

    Raises:
        MissingDependencyError: one of them is not installed.
    """
    try:
        found = [import_module(module) for module in modules]
    except ImportError as error:
        package = modules[0].partition(".")[0] if error.name is None else error.name.partition(".")[0]
        words = f"{what} needs {package}: pip install 'synctrl[{extra}]'"
        raise MissingDependencyError(words, found=package) from error
    return found[0] if len(found) == 1 else found
