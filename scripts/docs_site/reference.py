"""The reference: every public name of the package, made of docstrings; a page for each room.

Public is what stands in `__all__` of the package or of a subpackage, and what an example of a page, notebook
or script of the documentation imports. A name has one entry, under the shortest path at which it is public.
"""

from __future__ import annotations

import ast
import inspect
import re
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from types import ModuleType
from typing import Any

import synctrl
from docs_site.docstrings import escaped

TITLES = {
    "": "The front",
    "sweep": "Sweeps",
    "tune": "Tuning",
    "show": "Figures and scenes",
    "experiments": "Ready cells",
    "paper": "The paper",
    "compiled": "The compiled engine",
    "errors": "Kinds of errors",
    "cells": "Cell files",
    "cli": "The command line",
    "export": "Exports",
}

#: of a value that a table shows, characters
LONGEST = 60


@dataclass(frozen=True)
class Public:
    """A public name: the module where it is found, and what it is."""

    module: str
    name: str
    thing: Any

    @property
    def path(self) -> str:
        """Where a user finds it."""
        return f"{self.module}.{self.name}"

    @property
    def origin(self) -> str:
        """Where it is defined."""
        named = getattr(self.thing, "__module__", None), getattr(self.thing, "__qualname__", None)
        return ".".join(named) if all(isinstance(part, str) for part in named) else self.path

    @property
    def room(self) -> str:
        """The subpackage in which it is defined, or found if it is plain data."""
        parts = (self.origin if self.origin.startswith("synctrl.") else self.path).split(".")
        return parts[1] if len(parts) > 2 else ""


def packages() -> Iterator[ModuleType]:
    """The package and all of its subpackages."""
    yield synctrl
    for found in walk_packages(synctrl.__path__, "synctrl."):
        if found.ispkg:
            yield import_module(found.name)


def public_names(sources: Iterable[str] = ()) -> list[Public]:
    """All that is public: names in `__all__`, then those that the sources of examples import."""
    found = [
        Public(package.__name__, name, getattr(package, name))
        for package in packages()
        for name in getattr(package, "__all__", ())
    ]
    errors = import_module("synctrl.errors")
    kinds = [
        name for name, kind in vars(errors).items() if _is_kind(kind) and kind.__module__ == "synctrl.errors"
    ]
    pairs = [*(("synctrl.errors", name) for name in kinds), *sorted(imported(sources))]
    known = {(each.module, each.name) for each in found}
    for module, name in dict.fromkeys(pair for pair in pairs if pair not in known):
        thing = current(module, name)
        if thing is not None and not inspect.ismodule(thing):
            found.append(Public(module, name, thing))
    return found


def current(module: str, name: str) -> Any:
    """What a module has under a name; None where that is an old name."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return getattr(import_module(module), name)
        except DeprecationWarning:
            return None


def imported(sources: Iterable[str]) -> set[tuple[str, str]]:
    """Names that Python sources import from the package, as (module, name)."""
    found = set()
    for source in sources:
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "synctrl":
                found |= {(str(node.module), alias.name) for alias in node.names}
    return found


def example_sources(root: Path) -> Iterator[str]:
    """Blocks of Python in the pages, notebooks as scripts, and the scripts of the gallery."""
    for page in [root / "README.md", *sorted((root / "docs").rglob("*.md"))]:
        yield from re.findall(r"(?ms)^```python\n(.*?)^```", page.read_text("utf-8"))
    for script in [
        *sorted((root / "notebooks").glob("*.py")),
        *sorted((root / "scripts/examples").glob("*.py")),
    ]:
        yield re.sub(r"(?m)^%.*", "", script.read_text("utf-8"))


def sources(names: Iterable[Public]) -> dict[str, str]:
    """Of the modules whose source the site shows beside entries, path in the repository and on the site."""
    made = [each.thing for each in names if inspect.isclass(each.thing) or inspect.isfunction(each.thing)]
    modules = [thing.__module__.split(".") for thing in made if thing.__module__.startswith("synctrl.")]
    return {f"{'/'.join(module)}.py": f"_modules/{'/'.join(module)}.html" for module in modules}


def entries(names: Iterable[Public]) -> dict[str, Public]:
    """By where it is defined, the name under which a thing has its entry: that with the shortest path."""
    found: dict[str, Public] = {}
    for each in sorted(names, key=lambda each: (each.module.count("."), each.path)):
        found.setdefault(each.origin, each)
    return found


def pages(names: list[Public]) -> dict[str, str]:
    """Text of each page of the reference by its path; the first lists all."""
    chosen, rooms = entries(names), {}
    for each in names:
        rooms.setdefault(each.room, {}).setdefault(each.module, []).append(each)
    order = [room for room in _rooms() if room in rooms]
    found = {f"reference/{room or 'front'}.rst": page(room, rooms[room], chosen) for room in order}
    return found


def page(room: str, modules: dict[str, list[Public]], chosen: dict[str, Public]) -> str:
    """The page of a room: what its names are for in a table, then every entry."""
    package = import_module(f"synctrl.{room}" if room else "synctrl")
    lines = [*heading(title_of(room), "="), escaped(first_line(package)), ""]
    for module, names in sorted(modules.items(), key=lambda item: (item[0].count("."), item[0])):
        lines += [*heading(f"From ``{module}``", "-"), *table(names, chosen)]
        for each in sorted(names, key=lambda each: each.name.lower()):
            if chosen[each.origin] == each:
                lines += entry(each)
    return "\n".join(lines)


def table(names: list[Public], chosen: dict[str, Public]) -> list[str]:
    """A table of names, each a link to its entry, with the first sentence about it."""
    lines = [".. list-table::", "   :class: names", "   :widths: 1 2", ""]
    for each in sorted(names, key=lambda each: each.name.lower()):
        lines += [
            f"   * - :py:obj:`{each.name} <{chosen[each.origin].path}>`",
            f"     - {escaped(first_line(each.thing))}",
        ]
    return [*lines, ""]


def entry(each: Public) -> list[str]:
    """Directives of one name."""
    if inspect.isclass(each.thing):
        return [f".. autoclass:: {each.path}", "   :members:", "   :inherited-members:", ""]
    if callable(each.thing):
        return [f".. autofunction:: {each.path}", ""]
    return [f".. autodata:: {each.path}", "   :no-value:", ""]


def title_of(room: str) -> str:
    """The title of a room's page."""
    return TITLES.get(room, room.capitalize())


def first_line(thing: Any) -> str:
    """The first sentence of a docstring that is a thing's own; of plain data its value."""
    if not (inspect.ismodule(thing) or callable(thing)):
        value = repr(thing).replace("`", "'")
        return f"`{value if len(value) <= LONGEST else value[: LONGEST - 3] + '...'}`"
    return " ".join((inspect.getdoc(thing) or "").partition("\n\n")[0].split())


def heading(words: str, line: str) -> list[str]:
    """A heading, underlined."""
    return [words, line * len(words), ""]


def _rooms() -> list[str]:
    """Rooms in the order in which a user meets them."""
    first = ["", "experiments", "robots", "tasks", "coupling", "control", "simulation", "show", "analysis"]
    there = sorted(
        path.stem for path in Path(synctrl.__file__).parent.iterdir() if not path.stem.startswith("_")
    )
    return [*first, *(room for room in there if room not in first)]


def _is_kind(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, (Exception, KeyboardInterrupt))
