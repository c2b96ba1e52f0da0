"""Weights that measure errors of robots on one path in the axes of the path.

    c_i = a_i w diag(F_i^T, F_i^T),   (F^T)' = -F^T [om],   (F^T)'' = -(F^T)' [om] - F^T [om'],
    om = s' w(s),                     om' = s'' w(s) + s'^2 w_s(s),

so the first coordinate of c_i e_i is a_i w times the error along the path. With a = (1, -1) the first row of
epsilon is the error of the gap s_2 - s_1. With a_i = v/v_i it vanishes where both robots are late by the same
time, which keeps the point where they meet. Only that row is to be synchronized: give beta and K_eps that are
zero in the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import NoneType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from ..checks import count, finite_array, finite_number, instance, positive_number
from ..errors import CouplingError, InputError
from ..tasks.path import AlongPath
from ..tasks.rotations import skew
from ..tasks.trajectories import Motion
from .weights import Weights

#: instants at which ways are looked at before a run
INSTANTS = 400


@dataclass(frozen=True)
class Gate:
    """w = reach / (s_2 - s_1 - gap + reach): errors count where robots are about to meet, and less before.

    Args:
        gap: that is left where they meet, m.
        reach: distance beyond it at which errors count half, m, above 0.

    Raises:
        InputError: no finite numbers, or a reach that is not above 0.
    """

    gap: float
    reach: float = 0.05

    def __post_init__(self) -> None:
        finite_number("gap", self.gap), positive_number("reach", self.reach)

    def at(self, ways: Sequence[Motion], times: np.ndarray) -> np.ndarray:
        """w, w' and w'' of the first two ways, (3, T).

        Raises:
            CouplingError: robots that have passed each other by so much that w has no bound.
        """
        first, second = ways[:2]
        d, d_dot, d_ddot = ((b - a)[:, 0] for a, b in zip(first, second, strict=True))
        d = d - self.gap + self.reach
        if not (d > 0).all():
            k = int(np.argmax(~(d > 0)))
            raise CouplingError(
                f"weights would pass zero at t = {times[k]:g} s, where the gap is "
                f"{self.reach - d[k]:g} m below the one to be left"
            ).about("gate", time=float(times[k]))
        w = self.reach / d
        return np.stack((w, -w * d_dot / d, w * (2 * (d_dot / d) ** 2 - d_ddot / d)))


class PathWeights:
    """Weights of robots that go along paths, in the axes of these, see the head of this module.

    Args:
        motions: how each robot is to go along its path.
        a: a number per robot, (n,), none of them 0.
        gate: how much errors count; by default always the same.

    Raises:
        InputError: no motions along paths, or not a number other than 0 for each.
    """

    def __init__(self, motions: Sequence[AlongPath], a: ArrayLike, gate: Gate | None = None):
        _check_motions(motions)
        instance("gate", gate, (Gate, NoneType), "a Gate")
        self.motions, self.gate, self.robots = tuple(motions), gate, len(motions)
        self.a = finite_array("a", a, (self.robots,))
        if not self.a.all():
            raise InputError.expected("weights other than 0", self.a, "a")

    @classmethod
    def of_gap(cls, motions: Sequence[AlongPath], gate: Gate | None = None) -> Self:
        """a = (1, -1): what is compared is the gap between two robots."""
        return cls(motions, (1.0, -1.0), gate)

    @classmethod
    def of_phase(cls, motions: Sequence[AlongPath], duration: float) -> Self:
        """a_i = v/v_i, with mean speeds v_i of a duration, s: what is compared is lag in time.

        Raises:
            InputError: a robot that stands still or turns back on its way.
        """
        _check_motions(motions)
        times = np.linspace(0.0, positive_number("duration", duration), INSTANTS)
        speeds = []
        for i, motion in enumerate(motions):
            s, speed, _ = motion.way(times)
            if s[-1] == s[0] or (speed * np.sign(s[-1] - s[0]) < 0).any():
                raise InputError(
                    "expected speeds that do not pass zero, found a robot that stands still or turns back",
                    subject=f"motions, robot {i + 1}",
                )
            speeds.append(abs(float(s[-1, 0] - s[0, 0])))
        return cls(motions, np.mean(speeds) / np.array(speeds))

    def at(self, times: np.ndarray, m: int) -> Weights:
        """Weights at some times, (T,), s, for tasks of dimension 3 or 6.

        Raises:
            CouplingError: another dimension, or weights that pass zero.
        """
        if m not in (3, 6):
            raise CouplingError.expected("positions or poses, of dimension 3 or 6", m, "c")
        ways = [motion.way(times) for motion in self.motions]
        always = np.outer((1.0, 0.0, 0.0), np.ones(len(times)))
        gate = always if self.gate is None else self.gate.at(ways, times)
        pairs = zip(self.motions, ways, strict=True)
        turned = np.stack([_turned(motion, way) for motion, way in pairs], axis=2)
        w, w_dot, w_ddot = gate[..., None, None, None] * self.a[:, None, None]
        F, F_dot, F_ddot = turned
        c = w * F, w_dot * F + w * F_dot, w_ddot * F + 2 * w_dot * F_dot + w * F_ddot
        return Weights(*(_blocks(part, m // 3) for part in (*c, F.mT / w)))

    def scaled(self, factor: float) -> PathWeights:
        """These weights times a constant other than 0."""
        return PathWeights(self.motions, factor * self.a, self.gate)

    def size(self, t: float) -> float:
        """Geometric mean of the singular values of all c_i(t)."""
        return float(np.exp(np.linalg.slogdet(self.at(np.array([t]), 3).c[0])[1].mean() / 3))


def _check_motions(motions: Sequence[AlongPath]) -> None:
    instance("motions", motions, Sequence, "a sequence of AlongPath objects")
    count("number of motions", len(motions))
    for motion in motions:
        instance("motions", motion, AlongPath, "AlongPath objects")


def _turned(motion: AlongPath, way: Motion) -> np.ndarray:
    """F^T, (F^T)' and (F^T)'', (3, T, 3, 3)."""
    s, speed, growth = way
    place = motion.path.at(s[:, 0])
    om, om_dot = skew(speed * place.turn), skew(growth * place.turn + speed**2 * place.turn_s)
    F = place.axes.mT
    F_dot = -F @ om
    return np.stack((F, F_dot, -F_dot @ om - F @ om_dot))


def _blocks(part: np.ndarray, times: int) -> np.ndarray:
    """diag(A, .., A) of matrices A, (..., 3, 3)."""
    whole = np.zeros((*part.shape[:-2], 3 * times, 3 * times))
    for k in range(times):
        whole[..., 3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = part
    return whole
