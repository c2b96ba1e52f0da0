"""Continuous exchange: robots tell each other W, w and w' all the time, and hear them late by a constant.

What was said is kept at instants of a grid, and Hermite's polynomial of degree five is laid through W and its
first two derivatives. What is believed of w is the derivative of what is believed of W, exactly, and so
on: nothing jumps, and the proof for constant delays holds as it stands. Before the beginning W = t w with the
w of then.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...coupling.cell import Cell
from ...errors import InputError
from .w_form import ASK, WForm, check_number

#: the theorem that covers it
DELAYS = "constant delays"
#: longest step of the grid, s
GRID = 2e-3
#: shortest one, s; W'' of W that is rounded to 1e-16 |W| is off by some 1e-14 |W|/step^2
FINEST = 1e-6
#: how many steps of it may be kept
LONGEST = 4096
#: how far an instant may be from the grid, as a share of its step
NEAR = 1e-6


class BoundDelayed(WForm):
    """Constant delays between the robots of a cell.

    Its memory has, beside W: `begun`, whether it has a beginning; `since`, when that was; `first`, w there;
    and `kept`, W with its first two derivatives at instants of the grid, in places that are used over and
    over again.

    Args:
        cell: the cell.
        leak: rate at which integrals are forgotten, (m,), 1/s.
        delay: of every link, (l,), s.

    Attributes:
        delay: as given.

    Raises:
        InputError: a delay that is too short, or too many times the shortest one.
    """

    continuous = True
    theorem = DELAYS
    #: how many links one after another what is recalled may have come over
    hops = 1

    def __init__(self, cell: Cell, leak: np.ndarray, delay: np.ndarray):
        late = delay[delay > 0]
        self.delay, self._step = delay, float(min(GRID, late.min()))
        if self._step < FINEST:
            raise InputError.expected(f"delays of 0 or at least {FINEST:g} s", self._step, "delay")
        room, oldest = LONGEST * self._step / self.hops, self.hops * late.max()
        if late.max() > room:
            raise InputError.expected(
                f"delays up to {room:g} s, {LONGEST // self.hops} steps of {self._step:g} s, which are no "
                "longer than the shortest delay",
                float(late.max()),
                "delay",
            )
        places = int(np.ceil(oldest / self._step)) + 3
        n, m = cell.n, cell.m
        super().__init__(cell, leak, begun=(1,), since=(1,), first=(n, m), kept=(places, n, 3, m))
        self.suspicion = f"robots hear each other up to {late.max():g} s late; {ASK}"
        self._places = places
        self._coefficients = hermite() * self._step ** (np.arange(6) % 3)  # of derivatives by time
        late_sums = np.unique(np.add.outer(np.append(0.0, late), late))
        self._kinks = late_sums if len(late_sums) <= 64 else np.unique(late)

    def heard(self, t: float, own: np.ndarray, memory: np.ndarray) -> np.ndarray:
        return self.recalled(t, self.delay, self.links.sender, own, memory)

    def recalled(
        self, t: float, age: np.ndarray, who: np.ndarray, own: np.ndarray, memory: np.ndarray
    ) -> np.ndarray:
        """W, w and w' as they were, (3, k, m).

        Args:
            t, own, memory: as of `heard`.
            age: how long ago, (k,), s.
            who: of which robot, (k,).
        """
        now, then, at_once = self.parts(memory), t - age, age == 0
        before = np.floor(then / self._step - NEAR)
        u = then / self._step - before
        place = before.astype(int) if np.isfinite(t) else np.zeros(len(then), dtype=int)
        rows = np.concatenate([now.kept[(place + i) % self._places, who] for i in (0, 1)], axis=1)
        W, W_dot, W_ddot = self._interpolated(u, rows)
        found = np.array((W, W_dot + self.leak * W, W_ddot + self.leak * W_dot))
        w, early = now.first[who], t < now.since[0] + age
        W = (then - now.since[0])[:, None] * w
        found[:, early] = np.array((W, w + self.leak * W, self.leak * w))[:, early]
        found[:, at_once] = own[:, who[at_once]]
        return found

    def messages(self, start: float, end: float) -> np.ndarray:
        """The grid, and instants at which a derivative of what is heard may jump, start <= t < end, s."""
        check_number(start, end, self._step, "delay")
        grid = self._step * np.arange(np.floor(start / self._step), np.ceil(end / self._step) + 1)
        found = np.unique(np.concatenate((grid, self._kinks)))
        return found[(found >= start) & (found < end)]

    def meet(self, t: float, w: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """The memory with what is said at instant t, if that is on the grid."""
        k = round(t / self._step)
        if abs(t / self._step - k) > NEAR:
            return memory
        after = memory.copy()
        now = self.parts(after)
        if not now.begun[0]:
            now.begun[0], now.since[0], now.first[...] = 1.0, t, w[0]
        W_dot = w[0] - self.leak * now.W
        now.kept[k % self._places] = np.stack((now.W, W_dot, w[1] - self.leak * W_dot), axis=1)
        return after

    def _interpolated(self, u: np.ndarray, rows: np.ndarray) -> Any:
        """W and its first two derivatives, (3, l, m), at a share u of a step, (l,), from both its ends."""
        polynomial = np.einsum("pk,lkm->lpm", self._coefficients, rows)
        powers, p = u[:, None] ** np.arange(6), np.arange(6)
        first, second = np.zeros_like(powers), np.zeros_like(powers)
        first[:, 1:] = p[1:] * powers[:, :-1] / self._step
        second[:, 2:] = p[2:] * p[1:-1] * powers[:, :-2] / self._step**2
        return np.einsum("dlp,lpm->dlm", np.array((powers, first, second)), polynomial)


def hermite() -> np.ndarray:
    """Coefficients of Hermite's polynomial of degree five, (6, 6): columns W, W', W'' at 0, and at 1."""
    p = np.arange(6)
    ends = [
        [u**p, p * u ** np.maximum(p - 1, 0), p * (p - 1) * u ** np.maximum(p - 2, 0)] for u in (0.0, 1.0)
    ]
    return np.linalg.inv(np.concatenate(ends))
