"""Modules, names and arguments of version 0.1 that are others today: they work, and warn with the new one."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, TypeVar

from .errors import warn

T = TypeVar("T")

#: the room that modules have left, the one they are in now, and their names
_MOVES = {
    "tasks coupling": "cell coupling desired expansion graphs member_checks reachability "
    "synchronization weights",
    "analysis paper": "claims judge",
    "experiments paper": "reproduction theory",
    "show paper": "paper_sections plant_sections report",
}
_URDF = "checks", "document", "meshes", "reader", "writer", "xml"
#: modules of today, and those that are a part of them now
_PARTS = {
    "analysis.comparison": "analysis.baselines analysis.matching analysis.trials",
    "analysis.convergence": "analysis.identification",
    "tasks.measurement": "tasks.tips",
    "coupling.desired": "tasks.weight_checks",
    "coupling.member_checks": "tasks.member_parameters",
    "coupling.reachability": "tasks.motion_checks",
    "experiments.a460_pair": "experiments.a460_full",
    "experiments.panda_four": "experiments.circles",
    "paper.claims_of_cells": "analysis.claims_a460 analysis.claims_planar",
    "paper.judge": "experiments.judged show.judge_plots show.judge_section",
    "paper.plant_sections": "show.step_section",
    "paper.report": "show.formulas",
    "paper.reproduction": "experiments.batch",
    "paper.theory": "show.theory_sections",
    "robots.mechanism": "robots.limits",
    "robots.model": "robots.kinematics robots.model_checks",
    "robots.parameters": "robots.friction_parameters",
    "show.animation": "show.real_cells show.vehicle",
    "show.html": "show.view",
    "show.nodes": "show.rotations",
    "show.style": "show.colors",
    "simulation.closed_loop": "simulation.state",
    "simulation.controls": "simulation.sampled",
    "simulation.limits": "simulation.damping",
    "simulation.mujoco": "simulation.mujoco_plant",
    "simulation.schedules": "simulation.disturbances simulation.payloads",
    "sweep.description": "sweep.identity",
    "sweep.journal": "sweep.table",
    "sweep.sweep": "sweep.study",
    "sweep.worker": "simulation.prepared",
}


def _pairs() -> Iterator[tuple[str, str]]:
    """Old and new names, within the package."""
    for rooms, names in _MOVES.items():
        old, new = rooms.split()
        yield from ((f"{old}.{name}", f"{new}.{name}") for name in names.split())
    yield from ((f"robots.urdf_{name}", f"robots.urdf.{name}") for name in _URDF)
    yield from ((old, new) for new, names in _PARTS.items() for old in names.split())


#: old names and new ones
MOVED = {f"{__package__}.{old}": f"{__package__}.{new}" for old, new in _pairs()}
#: a room that is elsewhere as a whole
_ROOM, _NEW_ROOM = f"{__package__}.simulation.compiled", f"{__package__}.compiled"


def names_elsewhere(module: str, new_home: str, *names: str, **renamed: str) -> Callable[[str], Any]:
    """The `__getattr__` of a module, some of whose names are in another module now, or are other names.

    Args:
        module: its `__name__`.
        new_home: the other module, seen from this one, `.law` or `..coupling.cell`; or this one itself.
        names: what has moved.
        renamed: what has another name there, and which.
    """
    today = {**dict(zip(names, names, strict=True)), **renamed}

    def find(name: str) -> Any:
        if name not in today:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        home = import_module(new_home, module.rpartition(".")[0])
        tell(f"{module}.{name}", f"{home.__name__}.{today[name]}")
        return getattr(home, today[name])

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


# -- modules -----------------------------------------------------------------------------------------------


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
        tell(old, new)
        sys.modules[old] = import_module(new)


def serve_old_names() -> None:
    """Let old names be imported; more than once does no harm."""
    if not any(isinstance(finder, _Moved) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Moved())
