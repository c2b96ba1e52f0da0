"""Modules that have moved: the old names still import, and a warning says the new ones."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any
from warnings import warn

#: rooms that modules have left, the room they are in now, and their names
_MOVES = (
    (
        "tasks",
        "coupling",
        "cell coupling desired expansion graphs member_checks member_parameters motion_checks reachability "
        "synchronization weight_checks weights",
    ),
    ("analysis", "paper", "baselines claims claims_a460 claims_planar judge matching trials"),
    ("experiments", "paper", "batch reproduction theory"),
    (
        "show",
        "paper",
        "formulas judge_section paper_sections plant_sections report step_section theory_sections",
    ),
    ("simulation", "sweep", "prepared"),
)
_URDF = "checks", "document", "meshes", "reader", "writer", "xml"


def _pairs() -> Iterator[tuple[str, str]]:
    """Old and new names, within the package."""
    for old, new, names in _MOVES:
        yield from ((f"{old}.{name}", f"{new}.{name}") for name in names.split())
    yield from ((f"robots.urdf_{name}", f"robots.urdf.{name}") for name in _URDF)


#: old names and new ones
MOVED = {f"{__package__}.{old}": f"{__package__}.{new}" for old, new in _pairs()}
#: a room that is elsewhere as a whole
_ROOM, _NEW_ROOM = f"{__package__}.simulation.compiled", f"{__package__}.compiled"


def new_name(name: str) -> str | None:
    """Where a module of the package is now; None if it has not moved."""
    if name == _ROOM or name.startswith(f"{_ROOM}."):
        return _NEW_ROOM + name[len(_ROOM) :]
    return MOVED.get(name)


class _Moved(MetaPathFinder, Loader):
    """Finds modules under their old names."""

    def find_spec(self, name: str, path: Any, target: ModuleType | None = None) -> ModuleSpec | None:
        return None if new_name(name) is None else ModuleSpec(name, self)

    def exec_module(self, module: ModuleType) -> None:
        """Put the module that has moved in the place of this one."""
        old, new = module.__name__, str(new_name(module.__name__))
        warn(f"{old} has moved: import {new}", DeprecationWarning, stacklevel=2)
        sys.modules[old] = import_module(new)


def serve_old_names() -> None:
    """Let old names be imported; more than once does no harm."""
    if not any(isinstance(finder, _Moved) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Moved())
