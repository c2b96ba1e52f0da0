"""Advice about gains: what was found, as data, and as a reader wants it: what to change comes first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..control.gains import Gains
from ..coupling.cell import Cell
from .delay_margin import DelayMargin
from .expected_torque import ExpectedTorque
from .gain_case import URGENCIES, Change
from .in_words import InWords
from .linear_loop import Mode

#: columns of the table, letters
WIDE, NARROW = 24, 10
#: speed of a path that rests, m/s or rad/s: derivatives of functions that are fitted are not quite 0
STILL = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class Advice(InWords):
    """What gains will do in a cell, and what to change.

    Attributes:
        cell, gains: as given.
        dt, control_period: step, and period of sampled control or None, s.
        longest_step, longest_period: up to which small errors fall, with RK4 and with held torque, s.
        modes: of small errors where the cell starts, the slowest first; none of cells with very many joints.
        delay: how much delay between robots it takes, frozen where it starts; None where that takes too long.
        torque: the largest torque that is expected.
        learning: how many times as fast as the damping can follow the estimates move, (n,); 0 where nothing
            learns by `gains.Gamma`.
        inertia, damping: M_jj, the mean along the path, and K_r of every joint, (n, nv).
        spring: (Y Gamma Y^T)_jj, the largest along the path, with which learning pulls, (n, nv).
        changes: what to change, the most urgent first.
    """

    cell: Cell
    gains: Gains
    dt: float
    control_period: float | None
    longest_step: float
    longest_period: float
    modes: tuple[Mode, ...]
    delay: DelayMargin | None
    torque: ExpectedTorque
    learning: np.ndarray
    inertia: np.ndarray
    damping: np.ndarray
    spring: np.ndarray
    changes: tuple[Change, ...]

    @property
    def first(self) -> Change | None:
        """What to change first; None if nothing has to be."""
        return next(iter(self.changes), None)

    @property
    def changed(self) -> Gains:
        """The gains with all changes that are of gains."""
        return self.changes[-1].gains if self.changes else self.gains

    @property
    def diverges(self) -> bool:
        """Whether the run is expected to diverge."""
        return any(change.urgency == "diverges" for change in self.changes)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """A row for every joint, plain data: robot, joint, inertia, K_r and what follows from them.

        `rate` is K_r/M_jj, 1/s; `damping_ratio` is K_r/(2 sqrt(M_jj G_jj)), of the joint alone against what
        learning pulls with, None without; `share` is the peak of torque that is expected, over the limit.
        """
        return [self._row(i, joint) for i, robot in enumerate(self.cell.robots) for joint in range(robot.nv)]

    def _row(self, i: int, joint: int) -> dict[str, Any]:
        G = float(self.spring[i, joint])
        M, K = float(self.inertia[i, joint]), float(self.damping[i, joint])
        peak, limit = float(self.torque.peak[i, joint]), float(self.torque.limit[i, joint])
        return {
            "robot": self.cell.names[i],
            "joint": joint + 1,
            "inertia": M,
            "K_r": K,
            "rate": K / M,
            "damping_ratio": K / (2 * np.sqrt(M * G)) if G > 0 else None,
            "torque": peak,
            "limit": plain(limit),
            "share": peak / limit,
        }

    def to_dict(self) -> dict[str, Any]:
        """All of it as plain data, for JSON; what is infinite is None."""
        return {
            "gains": self.gains.as_dict(),
            "dt": self.dt,
            "control_period": self.control_period,
            "longest_step": plain(self.longest_step),
            "longest_period": plain(self.longest_period),
            "delay_margin": None if self.delay is None else plain(self.delay.delay),
            "resting": resting(self.cell),
            "learning": self.learning.tolist(),
            "joints": self.rows,
            "modes": [mode.as_dict() for mode in self.modes],
            "changes": [change.as_dict(self.cell.names) for change in self.changes],
            "changed_gains": self.changed.as_dict(),
        }

    def __str__(self) -> str:
        return "\n".join([*_changes(self), *_margins(self), *_modes(self), *_table(self)])


def plain(number: float) -> float | None:
    """A number for JSON, which knows none that is infinite."""
    return float(number) if np.isfinite(number) else None


def _changes(advice: Advice) -> list[str]:
    if not advice.changes:
        return ["nothing has to be changed"]
    lines, names = [], advice.cell.names
    for number, change in enumerate(advice.changes, start=1):
        lines.append(f"{number}. {change.told(names)}")
        lines.append(f"   {URGENCIES[change.urgency]}: {change.why}")
    return lines


def _margins(advice: Advice) -> list[str]:
    step = f"RK4: small errors fall up to a step of {advice.longest_step:.3g} s"
    held = f"sampled control: up to a period of {advice.longest_period:.3g} s"
    if advice.control_period is None:
        step += f"; it is {advice.dt:g} s"
    else:
        held += f"; it is {advice.control_period:g} s"
    late = f"delay between robots: {advice.delay or 'ask delay_margin, it takes long'}"
    names = ", ".join(resting(advice.cell))
    told = f'at rest where the path begins with a speed: {names}; v0 = "path" starts as fast as it'
    return [step, held, late, *([told] if names else [])]


def resting(cell: Cell) -> list[str]:
    """Who rests where its path begins with a speed, which costs torque at the start."""
    speeds = np.abs(cell.reference_table(np.zeros(1)).desired[0, 1]).max(axis=1)
    rows = zip(cell.names, cell.v0, speeds, strict=True)
    return [name for name, v0, speed in rows if speed > STILL and not v0.any()]


def _modes(advice: Advice) -> list[str]:
    if not advice.modes:
        return ["poles: not of so many joints, look at a smaller cell of the same robots"]
    moving = [mode for mode in advice.modes if mode.gain != "Gamma"]
    shown = {
        "slowest": min(moving, key=lambda mode: mode.rate),
        "fastest": max(moving, key=lambda mode: abs(mode.pole)),
        "least damped": min(advice.modes, key=lambda mode: mode.damping),
    }
    lines = [f"{name} mode: {_mode(mode, advice)}" for name, mode in shown.items()]
    rate = shown["slowest"].rate
    if rate > 0 and not advice.diverges:
        lines.append(f"errors of the start fall to 5 % in {3 / rate:.2g} s")
    return lines


def _mode(mode: Mode, advice: Advice) -> str:
    swing = f", swings with {mode.pole.imag:.3g} rad/s (damping ratio {mode.damping:.2f})"
    name = advice.cell.names[mode.robot]
    place = f"of {mode.gain}, {name}, joint {mode.joint + 1}"
    return f"{mode.rate:.3g} 1/s{swing if mode.pole.imag else ''}, {place}"


def _table(advice: Advice) -> list[str]:
    heads = ("M_jj", "K_r", "K_r/M_jj", "damping", "torque", "limit", "share")
    lines = ["joint".ljust(WIDE) + "".join(head.rjust(NARROW) for head in heads)]
    for row in advice.rows:
        numbers = (row[key] for key in ("inertia", "K_r", "rate", "damping_ratio", "torque", "limit"))
        cells = ["-" if number is None else f"{number:.3g}" for number in numbers]
        name = f"{row['robot']}, {row['joint']}"
        lines.append(
            name.ljust(WIDE) + "".join(cell.rjust(NARROW) for cell in (*cells, f"{row['share']:.0%}"))
        )
    names = zip(advice.cell.names, advice.learning, strict=True)
    lines += [f"Gamma of {name}: {share:.3g} times what the damping can follow" for name, share in names]
    return lines
