"""The structures that Python and `driver.c` share, and the text in C that stands before `driver.c`.

It has sizes, lists of quantities, the structures, and a table of generated functions. A list is a macro that
is applied to every quantity in it, with its name, its rows and its columns, so that the driver says once what
is done with each.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping
from enum import IntFlag
from typing import Any

import numpy as np

from ..simulation.guard import checks
from .address import CALLBACK, Arguments, Callbacks, Chars, Doubles, Ints, Longs, Results
from .hearing import Exchange, Hearing
from .kind import Kind
from .quantities import FUNCTIONS, LOGS, QUANTITIES, owned_by


class Mark(IntFlag):
    """What happens at the start of a step, beside edges of disturbances and loads.

    Attributes:
        CHECKED: the guard looks.
        LOGGED: a row is logged.
        SAMPLED: what the controller asks for here acts from here on; with continuous control, at every step.
        JOINED: nothing jumps here, all goes on smoothly from the step before.
    """

    CHECKED = 1
    LOGGED = 2
    SAMPLED = 4
    JOINED = 8


class Cell(ctypes.Structure):
    """What does not change in a run: sizes, who is compared with whom, and whether joints rub.

    Attributes:
        n, p, o, r, h, arity: robots, pairs, objects that are carried, numbers that the network and the plant
            remember, and robots in one pair.
        kind: of each robot, and then of each object.
        edge, sign: (p, arity), robots that are compared, and entries of S.
        first, incident, incident_sign: where the pairs of a robot begin, (n + 1), and robot after robot its
            pairs, with entries of S.
        rubs, saturates: whether there is friction, and whether torque is cut off.
        exchange: how the robots hear of each other.
    """

    _fields_ = [
        *((name, ctypes.c_int) for name in ("n", "p", "o", "r", "h", "arity", "rubs", "saturates")),
        *((name, Ints) for name in ("kind", "edge", "first", "incident")),
        *((name, Doubles) for name in ("sign", "incident_sign")),
        ("exchange", Exchange),
    ]


class Quantities(ctypes.Structure):
    """Where the array of every quantity is at this moment."""

    _fields_ = [(name, Doubles) for name in QUANTITIES]


class Arrays(ctypes.Structure):
    """Arrays of a quantity one after another, `stride` numbers apart; 0 if there is but one."""

    _fields_ = [("values", Doubles), ("stride", ctypes.c_long)]


class Steps(ctypes.Structure):
    """Steps to be made, part of a block of steps, and what is desired and acts in them.

    Attributes:
        first, count: those to be made.
        length: of the block.
        holds: whether torque and adaptation are held between samples.
        period: how long they are held, s.
        t: instants of those to be made, (count + 1), s.
        marks: what happens at the start of each, see `Mark`.
        disturbed, loaded: which disturbance and which load acts in each.
        sense, act: what sensors and actuators do, see `hooks.py`; 0 where there are none.
        kept: what has these addresses.
    """

    def __init__(self, **fields: Any):
        super().__init__(**fields)
        self.kept: dict[str, np.ndarray] = {}

    _fields_ = [
        *((name, ctypes.c_int) for name in ("first", "count", "length", "holds")),
        ("period", ctypes.c_double),
        ("t", Doubles),
        ("marks", Chars),
        ("disturbed", Ints),
        ("loaded", Ints),
        *((name, Callbacks) for name in ("sense", "act")),
        *((name, Arrays) for name in owned_by("instant", "disturbance", "load")),
    ]


class Log(ctypes.Structure):
    """Where rows are logged; 0 for what is not."""

    _fields_ = [(name, Doubles) for name in LOGS]


class StepError(ctypes.Structure):
    """The worst step of a run.

    Attributes:
        largest, speed, time, at: its error in velocity, the largest velocity, its end, and which joint.
        h, h_before: the last step, and the one before if it could be looked at, else 0.
        v, a: (2, n nv), at the two instants before.
    """

    _fields_ = [
        *((name, ctypes.c_double) for name in ("largest", "speed", "time", "h", "h_before")),
        ("v", Doubles),
        ("a", Doubles),
        ("at", ctypes.c_int),
    ]


class Work(ctypes.Structure):
    """Scratch of the generated functions, of the Runge-Kutta method, of sampling and of the guard.

    Attributes:
        held: rates at the last sample.
        side: what `side` was at the last checked instant, (n), 0 at first.
    """

    _fields_ = [
        ("arg", Arguments),
        ("res", Results),
        ("iw", Longs),
        ("w", Doubles),
        ("k", Doubles * 4),
        *((name, Doubles) for name in ("stage", "held", "side")),
        ("step_error", StepError),
    ]


class Report(ctypes.Structure):
    """How far the steps came: `rows` logged; what was found, in which step, at which robot."""

    _fields_ = [
        ("status", ctypes.c_int),
        ("step", ctypes.c_int),
        ("robot", ctypes.c_int),
        ("value", ctypes.c_double),
        ("rows", ctypes.c_long),
    ]


#: in an order in which each knows those that it has inside
STRUCTURES = (Exchange, Cell, Quantities, Arrays, Steps, Log, StepError, Work, Report)

_WRITTEN: dict[Any, str] = {ctypes.c_int: "int ", ctypes.c_long: "long ", ctypes.c_double: "double "}


def header(kinds: list[Kind]) -> str:
    """The C text for a cell of robots of these kinds."""
    return "".join([*_constants(kinds), *_lists(), *map(declared, STRUCTURES), *_table(kinds)])


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
    """Declarations of the generated functions, and the array `kinds`; 0 for a function that a kind lacks.

    The last kind is that of objects that are carried, if robots hold some.
    """
    yield "typedef int Function(const double **, double **, long long *, double *, int);\n"
    yield "typedef int Sizes(long long *, long long *, long long *, long long *);\n"
    members = "".join(f"Function *{name}; Sizes *{name}_work; " for name in FUNCTIONS)
    yield f"typedef struct {{ {members}int nv; }} Kind;\n"
    carried = ["object"] if any(kind.holds for kind in kinds) else []
    rows = []
    for k, (names, nv) in enumerate([*((functions_of(kind), kind.nv) for kind in kinds), (carried, 0)]):
        full = {name: f"kind{k}_{name}" for name in names}
        yield from (f"Function {name}; Sizes {name}_work;\n" for name in full.values())
        members = "".join(f".{name} = {made}, .{name}_work = {made}_work, " for name, made in full.items())
        rows.append(f"    {{ {members}.nv = {nv} }},\n")
    yield from ("static const Kind kinds[] = {\n", *rows, "};\n")
