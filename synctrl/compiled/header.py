"""What stands before `driver.c`: sizes, lists of quantities, structures, and a table of generated functions.

A list is a macro that is applied to every quantity in it, with its name, its rows and its columns, so that
the driver says once what is done with each.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..simulation.guard import checks
from .kind import Kind
from .quantities import FUNCTIONS, LOGS, QUANTITIES, owned_by
from .structs import STRUCTURES, Mark, declared


def header(kinds: list[Kind]) -> str:
    """The C text for a cell of robots of these kinds."""
    return "".join([*_constants(kinds), *_lists(), *map(declared, STRUCTURES), *_table(kinds)])


def largest(kinds: list[Kind]) -> dict[str, int]:
    """Sizes of rows that are long enough for all kinds."""
    return {name: max(kind.sizes[name] for kind in kinds) for name in kinds[0].sizes}


def functions_of(kind: Kind) -> list[str]:
    """Names of the functions that a kind has.

    A space that watches nothing has no `guard`, an adaptation whose state is theta_hat no `estimate`,
    and one that leaves its state as a step leaves it no `settle`.
    """
    learning = kind.learning
    lacks = {
        "guard": not kind.watches,
        "estimate": learning is None,
        "settle": learning is None or learning.settle is None,
    }
    return [name for name in FUNCTIONS if not lacks.get(name, False)]


# -- internals --------------------------------------------------------------------------------------------


def _constants(kinds: list[Kind]) -> Iterable[str]:
    """Sizes, how many kinds there are, marks, and what the guard may find."""
    yield _enumeration({**largest(kinds), "KINDS": len(kinds)})
    yield _enumeration({name: mark.value for name, mark in Mark.__members__.items()})
    found = enumerate(checks(kinds[0].watches), start=1)
    yield _enumeration({f"FOUND_{check.upper()}": k for k, check in found})


def _enumeration(constants: Mapping[str, int]) -> str:
    return f"enum {{ {', '.join(f'{name} = {value}' for name, value in constants.items())} }};\n"


def _lists() -> Iterable[str]:
    owners = dict.fromkeys(quantity.owner for quantity in QUANTITIES.values())
    yield from (_list(owner.upper(), owned_by(owner)) for owner in owners)
    for name, signature in FUNCTIONS.items():
        yield _list(f"{name}_INPUTS", signature.inputs)
        yield _list(f"{name}_OUTPUTS", signature.outputs)
    logs = (f"X({log}, {_entry(name)})" for log, name in LOGS.items())
    yield f"#define LOGS(X) {' '.join(logs)}\n"
    yield f"#define FUNCTIONS(X) {' '.join(f'X({name})' for name in FUNCTIONS)}\n"


def _list(title: str, names: Iterable[str]) -> str:
    return f"#define {title}(X) {' '.join(f'X({_entry(name)})' for name in names)}\n"


def _entry(name: str) -> str:
    return f"{name}, {QUANTITIES[name].rows}, {QUANTITIES[name].columns}"


def _table(kinds: list[Kind]) -> Iterable[str]:
    """Declarations of the generated functions, and the array `kinds`; 0 for a function that a kind lacks."""
    yield "typedef int Function(const double **, double **, long long *, double *, int);\n"
    yield "typedef int Sizes(long long *, long long *, long long *, long long *);\n"
    members = "".join(f"Function *{name}; Sizes *{name}_work; " for name in FUNCTIONS)
    yield f"typedef struct {{ {members}int nv; }} Kind;\n"
    rows = []
    for k, kind in enumerate(kinds):
        names = {name: f"kind{k}_{name}" for name in functions_of(kind)}
        yield from (f"Function {name}; Sizes {name}_work;\n" for name in names.values())
        members = "".join(f".{name} = {full}, .{name}_work = {full}_work, " for name, full in names.items())
        rows.append(f"    {{ {members}.nv = {kind.nv} }},\n")
    yield from ("static const Kind kinds[] = {\n", *rows, "};\n")
