"""Feed override: the desired motion waits for robots that lag behind it.

Desired motion and weights are functions of a phase phi instead of time, which goes on at the feed f:

    phi' = f,   f' = rate (f_cmd - f),   f_cmd = floor + (1 - floor) / (1 + (lag / scale)^2),
    xd' = xd_phi f,   xd'' = xd_phiphi f^2 + xd_phi f',   and the same for c' and c'',

where lag^2 is the sum of the squares of how far each robot is behind along its path. phi and f are a state of
the controller. Since f' is known, e' and u' are exact, and the proof never asks that xd be independent of the
state: with e -> 0 the feed goes to 1. The state rides in that of the adaptation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...checks import finite_number, instance, offers, positive_number
from ...coupling.cell import Cell, Reference
from ...coupling.weights import Weights
from ...errors import InputError
from .beside import Beside
from .protocol import Adaptation, Seen, check_still, check_three_rows


@dataclass(frozen=True)
class Override:
    """How much a desired motion slows down for robots that lag.

    Args:
        floor: the slowest that it goes on, as a share of its speed, above 0 and up to 1.
        scale: lag at which it has slowed down half way to that, m, above 0.
        rate: how fast it does so, 1/s, above 0.

    Raises:
        InputError: a number that is out of these bounds.
    """

    floor: float = 0.2
    scale: float = 0.01
    rate: float = 20.0

    def __post_init__(self) -> None:
        if not 0 < finite_number("override, floor", self.floor) <= 1:
            raise InputError.expected("a share above 0 and up to 1", self.floor, "override, floor")
        positive_number("override, scale", self.scale), positive_number("override, rate", self.rate)

    def feed(self, lags: np.ndarray) -> float:
        """f_cmd for the lags of all robots, (n,), m."""
        behind = np.maximum(lags, 0.0) / self.scale
        return float(self.floor + (1 - self.floor) / (1 + behind @ behind))


class Paced:
    """An adaptation beside which the desired motion waits for robots that lag behind it.

    Args:
        adaptation: what learns.
        override: how much the motion slows down.

    Raises:
        InputError: no adaptation, or no override.
    """

    def __init__(self, adaptation: Adaptation, override: Override):
        offers("adaptation", adaptation, ("bind", "as_dict"), "an adaptation, for example Gradient(0.3)")
        instance("override", override, Override, "an Override")
        self.adaptation, self.override = adaptation, override

    def bind(self, cell: Cell) -> BoundPaced:
        """This adaptation for a cell.

        Raises:
            InputError: desired motions that have no `lag`, as those along paths do, an adaptation that
                moves the desired motion itself, or a space that asks for further rows of it.
        """
        inner: Any = self.adaptation.bind(cell)
        check_still("Paced", self.adaptation, inner)
        check_three_rows("Paced", cell.space)
        motions = []
        for name, member in zip(cell.names, cell.members, strict=True):
            motion: Any = member.trajectory
            motions.append(getattr(motion, "position", motion))
            offers(f"{name}, trajectory", motions[-1], ("lag",), "a motion that knows its lag: AlongPath")
        return BoundPaced(cell, inner, motions, self.override)

    def as_dict(self) -> dict[str, Any]:
        override = {"floor": self.override.floor, "scale": self.override.scale, "rate": self.override.rate}
        return {"name": "Paced", **override, "adaptation": self.adaptation.as_dict()}


class BoundPaced(Beside):
    """`Paced` for the robots of a cell: its z is the adaptation's, and behind it phi and f in every row."""

    def __init__(self, cell: Cell, adaptation: Any, motions: list[Any], override: Override):
        super().__init__(adaptation, [0.0, 1.0])
        self._cell, self._motions, self._override = cell, motions, override

    # -- phase and feed -----------------------------------------------------------------------------------

    def pace(self, z: np.ndarray, motion: np.ndarray, reference: Reference) -> Reference:
        """What is desired at the phase that the state z has come to, where robots move as they do.

        Args:
            z: the state, (n, Z).
            motion: joint positions and velocities, (2, n, nv).
            reference: what would be desired without override; of it only the time is kept.
        """
        phase, feed = self.own(z)[0].tolist()
        there = self._cell.references(np.array([phase]))[0]
        return slowed(there, reference.t, feed, self._growth(motion[0], phase, feed))

    def outputs(self, z: np.ndarray) -> dict[str, tuple[np.ndarray, str, tuple[str, ...]]]:
        """What a result gets of states z, (T, n, Z): phase and feed."""
        phase, feed = np.ascontiguousarray(self.own(z)[:, 0].T)
        return {"phase": (phase, "s", ("time",)), "feed": (feed, "", ("time",))}

    def _growth(self, q: np.ndarray, phase: float, feed: float) -> float:
        """f'."""
        robots = zip(self._cell.robots, q, strict=True)
        tips = [robot.tip_pose(row[: robot.nv]).translation for robot, row in robots]
        lags = [motion.lag(phase, tip) for motion, tip in zip(self._motions, tips, strict=True)]
        return self._override.rate * (self._override.feed(np.array(lags)) - feed)

    # -- the adaptation, with phase and feed behind its state ---------------------------------------------

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        phase, feed = self.own(z)[0].tolist()
        own = np.tile([feed, self._growth(seen.q, phase, feed)], (len(z), 1))
        return np.concatenate((self.adaptation.rate(self.learned(z), seen), own), axis=1)

    def leap(self, z: np.ndarray, z_dot: np.ndarray, h: float) -> np.ndarray:
        """What is learned as the adaptation has it; the phase along a parabola, the feed along its rate."""
        moved = super().leap(z, z_dot, h)
        self.own(moved)[:, 0] += 0.5 * h * h * self.own(z_dot)[:, 1]
        return moved


def slowed(there: Reference, t: float, feed: float, growth: float) -> Reference:
    """What is desired over time where phi' = f and phi'' = f', of what is desired over the phase phi.

    Args:
        there: desired motion and weights with their derivatives by phi.
        t: the instant, s.
        feed, growth: f and f', 1/s.
    """
    x, by_phase, twice = there.desired
    c, c_dot, c_ddot, c_inv = there.weights
    desired = np.stack((x, feed * by_phase, feed**2 * twice + growth * by_phase))
    if there.weights.move:
        weights = Weights(c, feed * c_dot, feed**2 * c_ddot + growth * c_dot, c_inv)
        return Reference(desired, weights, t)
    return Reference(desired, there.weights, t)
