"""The structures that Python and the driver share, and the text in C that stands before the driver.

It has vectors, sizes, lists of quantities, the structures, and a table of generated functions. A list is a macro
that is applied to every quantity in it, with its name, its rows and its columns, so that the driver says once
what is done with each. The driver's files stand one behind another, see `DRIVER`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping
from enum import IntFlag
from pathlib import Path
from typing import Any

import numpy as np

from ..simulation.guard import checks
from .address import CALLBACK, Address, Callbacks, Chars, Doubles, Ints, Vectors
from .emit import declared_function
from .hearing import Exchange, Hearing
from .kind import Kind
from .quantities import FUNCTIONS, LOGS, QUANTITIES, owned_by


#: where the text in C is
FOLDER = Path(__file__).parent


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
        n, p, o, r, h: rows of robots, pairs, objects that are carried, and numbers that the network and the plant
            remember; where lanes are robots, a row is one of several robots, or pairs.
        robots, pairs: how many there are.
        arity: robots in one pair.
        scattered: whether lanes are robots, so that who is compared may be in other lanes.
        kind: of each row of robots, and then of each object.
        edge, sign: (p, arity, lanes), where the rows of w begin of robots that are compared, as numbers from its
            beginning, and entries of S.
        first, incident, incident_sign: where the pairs of a row of robots begin, (n + 1), and row after row its
            pairs, (terms, lanes), where their rows of epsilon begin, with entries of S.
        rubs, saturates: whether there is friction, and whether torque is cut off.
        exchange: how the robots hear of each other.
    """

    _fields_ = [
        *((name, ctypes.c_int) for name in ("n", "p", "o", "r", "h", "robots", "pairs", "arity")),
        *((name, ctypes.c_int) for name in ("scattered", "rubs", "saturates")),
        *((name, Ints) for name in ("kind", "edge", "first", "incident")),
        *((name, Vectors) for name in ("sign", "incident_sign")),
        ("exchange", Exchange),
    ]


class Quantities(ctypes.Structure):
    """Where the array of every quantity is at this moment."""

    _fields_ = [(name, Vectors) for name in QUANTITIES]


class Arrays(ctypes.Structure):
    """Arrays of a quantity one after another, `stride` apart; 0 if there is but one.

    Where all lanes share them they are plain numbers, and `spread` has room for one of them in all lanes.
    """

    _fields_ = [("values", Vectors), ("stride", ctypes.c_long), ("spread", Vectors)]


class Errors(ctypes.Structure):
    """Measures of errors of all runs: see `ErrorMetrics`.

    Attributes:
        band: settling bands, (m).
        peak, ise, final: (rows, m).
        outside: number of the last instant outside the band, (rows, m), -1 if there is none.
        square: the error's square at the instant before, (rows, m).
    """

    _fields_ = [(name, Vectors) for name in ("band", "peak", "ise", "final", "outside", "square")]


class Tally(ctypes.Structure):
    """What is measured of runs instead of logging them.

    Attributes:
        tracking, sync: of the errors.
        torque, cut: largest torque that was asked for, and at how many instants it was more than the limit,
            (n, nv).
        t, rows: the last instant, s, and how many there were.
    """

    _fields_ = [
        *((name, Errors) for name in ("tracking", "sync")),
        *((name, Vectors) for name in ("torque", "cut")),
        ("t", ctypes.c_double),
        ("rows", ctypes.c_long),
    ]


class Tallies(Address):
    """The address of a `Tally`."""

    written = "Tally *"


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
        tally: measures to be taken instead of a log, or 0.
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
        ("tally", Tallies),
        *((name, Arrays) for name in owned_by("instant", "disturbance", "load")),
    ]


class Log(ctypes.Structure):
    """Where rows are logged; 0 for what is not."""

    _fields_ = [(name, Doubles) for name in LOGS]


class StepError(ctypes.Structure):
    """The worst step in every lane.

    Attributes:
        h, h_before: the last step, and the one before if it could be looked at, else 0.
        largest, speed, time, at: its error in velocity, the largest velocity, its end, and which joint of the
            lane's robots, one after another; -1 if there is none.
        v, a: (2, n nv), at the two instants before.
    """

    _fields_ = [
        *((name, ctypes.c_double) for name in ("h", "h_before")),
        *((name, Vectors) for name in ("largest", "speed", "time", "at", "v", "a")),
    ]


class Work(ctypes.Structure):
    """Scratch of the Runge-Kutta method, of sampling and of the guard.

    Attributes:
        held: rates at the last sample.
        side: what `side` was at the last checked instant, (n), 0 at first.
    """

    _fields_ = [
        ("k", Vectors * 4),
        *((name, Vectors) for name in ("stage", "held", "side")),
        ("step_error", StepError),
    ]


class Report(ctypes.Structure):
    """How far the steps came.

    Attributes:
        rows: how many were logged.
        step: which one it is.
        ended: how many runs have ended.
        status, at, robot, value: what was found in every lane that is a run, or in the only run: 0 for nothing,
            in which step, at which robot, and the number that was too large.
    """

    _fields_ = [
        ("rows", ctypes.c_long),
        *((name, ctypes.c_int) for name in ("step", "ended")),
        *((name, Ints) for name in ("status", "at", "robot")),
        ("value", Doubles),
    ]


#: in an order in which each knows those that it has inside
STRUCTURES = (Exchange, Cell, Quantities, Arrays, Errors, Tally, Steps, Log, StepError, Work, Report)
#: files of the driver, in an order in which each knows what it calls
DRIVER = ("network.c", "loop.c", "record.c", "guard.c", "driver.c")

_WRITTEN: dict[Any, str] = {ctypes.c_int: "int ", ctypes.c_long: "long ", ctypes.c_double: "double "}


def vectors(width: int) -> str:
    """The C text about numbers of so many lanes."""
    return f"#define LANES {width}\n" + (FOLDER / "vectors.h").read_text(encoding="utf-8")


def prelude(kinds: list[Kind], width: int) -> str:
    """What stands before a generated function: vectors, sizes, and where the quantities are."""
    return "".join([vectors(width), *_constants(kinds), declared(Quantities)])


def driver(kinds: list[Kind], width: int) -> str:
    """The C text for a cell of robots of these kinds, with as many lanes."""
    parts = [(FOLDER / name).read_text(encoding="utf-8") for name in DRIVER]
    return "".join([header(kinds, width), *parts])


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
