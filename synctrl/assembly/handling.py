"""Hands that take hold of an object, and let go of it, in the middle of a run: events of the plant.

Until the first hand closes the world holds the object, which stands still. A fixture takes its rest pose
when its hand closes, wherever the hand is then, so it begins without displacement; what hand and place differ
by in velocity its damper takes out. No impulse acts when a hand closes or opens: positions, velocities and
with them momentum go on as they were; what is lost is the energy of the spring of a hand that opens. An
object that nobody holds any more falls.

Beside pose and twist of the object, (13,), the state has whether any hand has closed yet, (1,), and for every
grasp whether its hand is closed and the rest pose of its fixture in the object's axes, (k, 8).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from itertools import compress, pairwise
from typing import Any, Self

import numpy as np

from ..coupling.cell import Cell
from ..errors import InputError
from ..simulation.plant import Output
from .body import place_of, pose_of
from .grasp import Grasp
from .plant import CarryingPlant, check_grasps

#: where parts of the state are: pose and twist of the object, whether a hand has closed, and the grips
BODY, LOOSE, GRIPS = slice(0, 13), 13, slice(14, None)


class HandlingPlant(CarryingPlant):
    """A plant that carries an object, of which hands take hold and let go at instants of their own.

    Between two such instants it is the `CarryingPlant` of the hands that are closed then. A robot may have
    several grasps, one after another. `longest_step` takes hands that close later where they are at t = 0.

    Args:
        cell: what the controller knows, its robots with their shares of the object, held or not.
        parts: of `CarryingPlant`.

    Raises:
        InputError: as `CarryingPlant`, but for grasps that come later or end; a robot that would have the
            object in its hand twice at a time.
    """

    def __init__(self, cell: Cell, **parts: Any):
        super().__init__(cell, **parts)
        closed = np.array([grasp.since == 0 for grasp in self.grasps])
        body = self.hidden0.copy()
        held = self._holding(closed, self.arms, self.turned)
        body[7:] = held._moving_along(body[:3]) if closed.any() else 0.0
        grips = np.column_stack((closed, pose_of(self.arms, self.turned)))
        self.hidden0 = np.concatenate((body, [closed.any()], grips.ravel()))
        edges = {edge for grasp in self.grasps for edge in (grasp.since, grasp.until) if edge}
        self.events = sorted(edges)

    def move(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        v_dot, rate = super(HandlingPlant, self._held_now(hidden)).move(q, v, tau, hidden[BODY])
        return v_dot, np.concatenate((hidden[LOOSE] * rate, np.zeros(hidden.size - rate.size)))

    def felt(self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray) -> np.ndarray:
        """As of `CarryingPlant`, with nothing from open hands."""
        held = self._held_now(hidden)
        none = np.zeros((len(q), 6))
        return super(HandlingPlant, held).felt(q, v, hidden[BODY]) if held.grasps else none

    def meet(
        self, t: float, q: np.ndarray, v: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Hands that are due at time t open, and hands that are due close where they are."""
        after, (p, R) = hidden.copy(), place_of(hidden[:7])
        hands, turned = self._held(q, v)[:2]
        taken = pose_of((hands - p) @ R, R.T @ turned)
        for grasp, grip, place in zip(self.grasps, after[GRIPS].reshape(-1, 8), taken, strict=True):
            if t == grasp.since:
                grip[0], grip[1:], after[LOOSE] = 1.0, place, 1.0
            elif t == grasp.until:
                grip[0] = 0.0
        return q, v, after

    def outputs_along(
        self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray, t: np.ndarray
    ) -> dict[str, Output]:
        """Those of `CarryingPlant`, with nothing from open hands, and which hands are closed, 1 or 0."""
        closed = hidden[:, GRIPS].reshape(len(t), -1, 8)[..., 0]
        found = super().outputs_along(q, v, hidden, t)
        return {**found, "hand_closed": (closed, "", ("time", "grasp"))}

    def report(self, hidden: np.ndarray) -> dict[str, Any]:
        """The same as of `CarryingPlant`, with the windows of the grasps and where the hands closed last."""
        found, places = super().report(hidden), hidden[-1, GRIPS].reshape(-1, 8)[:, 1:4]
        for entry, grasp, place in zip(found["grasps"], self.grasps, places, strict=True):
            entry |= {"arm": place.tolist(), "since": grasp.since, "until": grasp.until}
        return found

    # -- internals ----------------------------------------------------------------------------------------

    def _checked(self, grasps: Sequence[Grasp]) -> tuple[Grasp, ...]:
        check_grasps(grasps, self.cell)
        in_order = sorted(grasps, key=lambda grasp: (grasp.robot, grasp.since))
        for one, other in pairwise(in_order):
            if one.robot == other.robot and (one.until is None or one.until > other.since):
                name = self.cell.names[one.robot]
                text = f"expected a hand that opens before it closes again, at {other.since:g} s"
                raise InputError(text, subject=f"grasps, robot '{name}'", found=other.since)
        return tuple(grasps)

    def _held_now(self, hidden: np.ndarray) -> Self:
        """The plant of the hands that are closed in this state."""
        self.prepare()  # once, and not by every copy
        grips = hidden[GRIPS].reshape(-1, 8)
        return self._holding(grips[:, 0] > 0, *place_of(grips[:, 1:]))

    def _holding(self, closed: np.ndarray, arms: np.ndarray, turned: np.ndarray) -> Self:
        """The plant of these hands, (k,), which hold at arms, (k, 3), and turned, (k, 3, 3)."""
        held = copy(self)
        held.grasps, held._hands = tuple(compress(self.grasps, closed)), self._hands[closed]
        held.K, held.D = self.K[closed], self.D[closed]
        held.arms, held.turned = arms[closed], turned[closed]
        return held

    def _forces_along(
        self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        found = np.zeros((2, len(hidden), len(self.grasps), 6))
        changes = np.flatnonzero((np.diff(hidden[:, GRIPS], axis=0) != 0).any(axis=1)) + 1
        for rows in np.split(np.arange(len(hidden)), changes):
            held, closed = self._held_now(hidden[rows[0]]), hidden[rows[0], GRIPS][::8] > 0
            if closed.any():
                forces = super(HandlingPlant, held)._forces_along(q[rows], v[rows], hidden[rows, BODY])
                found[:, rows[:, None], np.flatnonzero(closed)] = forces
        return found[0], found[1]
