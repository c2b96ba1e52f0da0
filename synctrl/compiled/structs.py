"""The structures that Python and the driver share."""

from __future__ import annotations

import ctypes
from enum import IntFlag
from typing import Any

import numpy as np

from .address import Address, Anything, Callbacks, Chars, Doubles, Ints, Vectors
from .hearing import Exchange
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


class Cell(ctypes.Structure):
    """What does not change in a run: sizes, who is compared with whom, and whether joints rub.

    Attributes:
        n, p, o, r, h: rows of robots, pairs, objects that are carried, and numbers that the network and the
            plant remember; where lanes are robots, a row is one of several robots, or pairs.
        robots, pairs: how many there are.
        arity: robots in one pair.
        scattered: whether lanes are robots, so that who is compared may be in other lanes.
        kind: of each row of robots, and then of each object.
        edge, sign: (p, arity, lanes), where the rows of w begin of robots that are compared, as numbers from
            its beginning, and entries of S.
        first, incident, incident_sign: where the pairs of a row of robots begin, (n + 1), and row after row
            its pairs, (terms, lanes), where their rows of epsilon begin, with entries of S.
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
        own, count: the function of a user's own measures, or 0, and how many these are.
        now, before, largest, integral: its numbers, those of the instant before, and what is made of them.
        t, rows: the last instant, s, and how many there were.
    """

    _fields_ = [
        *((name, Errors) for name in ("tracking", "sync")),
        *((name, Vectors) for name in ("torque", "cut")),
        ("own", Anything),
        ("count", ctypes.c_long),
        *((name, Vectors) for name in ("now", "before", "largest", "integral")),
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
        ends: in which row is what is desired at the ends of all steps of the block, see `DesiredStretch`.
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
        ("ends", Ints),
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
        status, at, robot, value: what was found in every lane that is a run, or in the only run: 0 for
            nothing, in which step, at which robot, and the number that was too large.
    """

    _fields_ = [
        ("rows", ctypes.c_long),
        *((name, ctypes.c_int) for name in ("step", "ended")),
        *((name, Ints) for name in ("status", "at", "robot")),
        ("value", Doubles),
    ]


#: in an order in which each knows those that it has inside
STRUCTURES = (Exchange, Cell, Quantities, Arrays, Errors, Tally, Steps, Log, StepError, Work, Report)
