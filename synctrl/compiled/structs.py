"""The structures that Python and `driver.c` share; the text of those in C is made from these."""

from __future__ import annotations

import ctypes
from enum import IntFlag
from typing import Any

import numpy as np

from .quantities import LOGS, QUANTITIES, owned_by


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


class Doubles(ctypes.c_void_p):
    """Address of numbers."""

    written = "double *"


class Ints(ctypes.c_void_p):
    """Address of whole numbers."""

    written = "int *"


class Chars(ctypes.c_void_p):
    """Address of bytes."""

    written = "char *"


class Longs(ctypes.c_void_p):
    """Address of scratch of generated functions."""

    written = "long long *"


class Arguments(ctypes.c_void_p):
    """Address of addresses of numbers that are read."""

    written = "const double **"


class Results(ctypes.c_void_p):
    """Address of addresses of numbers that are written."""

    written = "double **"


class Cell(ctypes.Structure):
    """What does not change in a run: sizes, who is compared with whom, and whether joints rub.

    Attributes:
        n, p, arity: robots, pairs, and robots in one pair.
        kind: of each robot.
        edge, sign: (p, arity), robots that are compared, and entries of S.
        first, incident, incident_sign: where the pairs of a robot begin, (n + 1), and robot after robot its
            pairs, with entries of S.
        rubs, saturates: whether there is friction, and whether torque is cut off.
    """

    _fields_ = [
        *((name, ctypes.c_int) for name in ("n", "p", "arity", "rubs", "saturates")),
        *((name, Ints) for name in ("kind", "edge", "first", "incident")),
        *((name, Doubles) for name in ("sign", "incident_sign")),
    ]


class Quantities(ctypes.Structure):
    """Where the array of every quantity is at this moment."""

    _fields_ = [(name, Doubles) for name in QUANTITIES]


class Table(ctypes.Structure):
    """Arrays of a quantity one after another, `stride` numbers apart; 0 if there is but one."""

    _fields_ = [("values", Doubles), ("stride", ctypes.c_long)]


class Steps(ctypes.Structure):
    """Steps to be made, part of a block of steps, and what is desired and acts in them.

    Attributes:
        first, count: those to be made.
        length: of the block.
        holds: whether torque and adaptation are held between samples.
        t: instants of those to be made, (count + 1), s.
        marks: what happens at the start of each, see `Mark`.
        disturbed, loaded: which disturbance and which load acts in each.
        kept: the arrays that the tables point to.
    """

    def __init__(self, **fields: Any):
        super().__init__(**fields)
        self.kept: dict[str, np.ndarray] = {}

    _fields_ = [
        *((name, ctypes.c_int) for name in ("first", "count", "length", "holds")),
        ("t", Doubles),
        ("marks", Chars),
        ("disturbed", Ints),
        ("loaded", Ints),
        *((name, Table) for name in owned_by("instant", "disturbance", "load")),
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
STRUCTURES = (Cell, Quantities, Table, Steps, Log, StepError, Work, Report)

_WRITTEN: dict[Any, str] = {ctypes.c_int: "int ", ctypes.c_long: "long ", ctypes.c_double: "double "}


def declared(structure: type[ctypes.Structure]) -> str:
    """A structure as C declares it."""
    fields = "".join(f"    {_member(name, kind)};\n" for name, kind, *_ in structure._fields_)
    return f"typedef struct {{\n{fields}}} {structure.__name__};\n"


def _member(name: str, kind: Any) -> str:
    if issubclass(kind, ctypes.Array):
        return f"{_member(name, kind._type_)}[{kind._length_}]"
    if issubclass(kind, ctypes.Structure):
        return f"{kind.__name__} {name}"
    return (_WRITTEN.get(kind) or kind.written) + name
