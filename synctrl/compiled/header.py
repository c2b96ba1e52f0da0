"""The text in C that stands before the driver, and before a generated function.

It has vectors, sizes, lists of quantities, the structures, and a table of generated functions. A list is a
macro that is applied to every quantity in it, with its name, its rows and its columns, so that the driver
says once what is done with each. The driver's files stand one behind another, see `DRIVER`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..simulation.guard import checks
from .address import CALLBACK
from .emit import declared_function
from .hearing import Hearing
from .kind import Kind
from .quantities import FUNCTIONS, LOGS, QUANTITIES, owned_by
from .structs import STRUCTURES, Mark, Quantities

#: where the text in C is
FOLDER = Path(__file__).parent
#: files of the driver, in an order in which each knows what it calls
DRIVER = ("elementwise.h", "network.c", "loop.c", "record.c", "guard.c", "driver.c")
#: what is done with many numbers one after another, in as many lanes as the machine has
ELEMENTWISE = ("elementwise.h", "elementwise.c")

_WRITTEN: dict[Any, str] = {ctypes.c_int: "int ", ctypes.c_long: "long ", ctypes.c_double: "double "}


def vectors(width: int) -> str:
    """The C text about numbers of so many lanes."""
    return "".join([f"#define LANES {width}\n", *texts("vectors.h", "elementary.h")])


def texts(*names: str) -> list[str]:
    """Files in C."""
    return [(FOLDER / name).read_text(encoding="utf-8") for name in names]


def elementwise(width: int) -> str:
    """The C text of what is done with many numbers one after another, so many at a time."""
    return "".join([vectors(width), *texts(*ELEMENTWISE)])


def prelude(kinds: list[Kind], width: int) -> str:
    """What stands before a generated function: vectors, sizes, and where the quantities are."""
    return "".join([vectors(width), *_constants(kinds), declared(Quantities)])


def driver(kinds: list[Kind], width: int) -> str:
    """The C text for a cell of robots of these kinds, with as many lanes."""
    return "".join([header(kinds, width), *texts(*DRIVER)])


def header(kinds: list[Kind], width: int = 1) -> str:
    """What stands before the driver."""
    lines = vectors(width), *_constants(kinds), *_lists(), *map(declared, STRUCTURES), *_table(kinds)
    return "".join(lines)


def largest(kinds: list[Kind]) -> dict[str, int]:
    """Sizes of rows that are long enough for all kinds."""
    return {name: max(kind.sizes[name] for kind in kinds) for name in kinds[0].sizes}


def functions_of(kind: Kind) -> list[str]:
    """Names of the functions that a kind has.

    A space that watches nothing has no `guard`, an adaptation whose state is theta_hat no `estimate`,
    and one that leaves its state as a step or a sample leaves it no `settle` or `leap`. Only a robot that
    holds something has a `hand`, and none is an `object`.
    """
    learning = kind.learning
    lacks = {
        "guard": not kind.watches,
        "estimate": learning is None,
        "settle": learning is None or learning.settle is None,
        "leap": learning is None or learning.leap is None,
        "hand": not kind.holds,
        "object": True,
    }
    return [name for name in FUNCTIONS if not lacks.get(name, False)]


def declared(structure: type[ctypes.Structure]) -> str:
    """A structure as C declares it."""
    fields = "".join(f"    {_member(name, kind)};\n" for name, kind, *_ in structure._fields_)
    return f"typedef struct {{\n{fields}}} {structure.__name__};\n"


# -- internals --------------------------------------------------------------------------------------------


def _member(name: str, kind: Any) -> str:
    if issubclass(kind, ctypes.Array):
        return f"{_member(name, kind._type_)}[{kind._length_}]"
    if issubclass(kind, ctypes.Structure):
        return f"{kind.__name__} {name}"
    return (_WRITTEN.get(kind) or kind.written) + name


def _constants(kinds: list[Kind]) -> Iterable[str]:
    """Sizes, how many kinds there are, marks, ways to hear, what the guard may find, what is called back."""
    yield _enumeration({**largest(kinds), "KINDS": len(kinds) + 1})
    for words in (Mark, Hearing):
        yield _enumeration({name: word.value for name, word in words.__members__.items()})
    found = enumerate(checks(kinds[0].watches), start=1)
    yield _enumeration({f"FOUND_{check.upper()}": k for k, check in found})
    yield CALLBACK


def _enumeration(constants: Mapping[str, int]) -> str:
    return f"enum {{ {', '.join(f'{name} = {value}' for name, value in constants.items())} }};\n"


def _lists() -> Iterable[str]:
    owners = dict.fromkeys(quantity.owner for quantity in QUANTITIES.values())
    yield from (_list(owner.upper(), owned_by(owner)) for owner in owners)
    logs = (f"X({log}, {_entry(name)})" for log, name in LOGS.items())
    yield f"#define LOGS(X) {' '.join(logs)}\n"
    yield f"#define FUNCTIONS(X) {' '.join(f'X({name})' for name in FUNCTIONS)}\n"


def _list(title: str, names: Iterable[str]) -> str:
    return f"#define {title}(X) {' '.join(f'X({_entry(name)})' for name in names)}\n"


def _entry(name: str) -> str:
    return f"{name}, {QUANTITIES[name].rows}, {QUANTITIES[name].columns}"


def _table(kinds: list[Kind]) -> Iterable[str]:
    """Declarations of the generated functions, and the array `kinds`; 0 for a function that a kind lacks.

    The last kind is that of objects that are carried, if robots hold some.
    """
    yield f"typedef {declared_function('Function')};\n"
    members = "".join(f"Function *{name}; " for name in FUNCTIONS)
    yield f"typedef struct {{ {members}int nv; }} Kind;\n"
    carried = ["object"] if any(kind.holds for kind in kinds) else []
    rows = []
    for k, (names, nv) in enumerate([*((functions_of(kind), kind.nv) for kind in kinds), (carried, 0)]):
        full = {name: f"kind{k}_{name}" for name in names}
        yield from (f"Function {name};\n" for name in full.values())
        members = "".join(f".{name} = {made}, " for name, made in full.items())
        rows.append(f"    {{ {members}.nv = {nv} }},\n")
    yield from ("static const Kind kinds[] = {\n", *rows, "};\n")
