"""Theorem C: how fast small errors vanish along a motion that repeats, those of parameters among them.

At zero error the closed loop is linear in first order, with a matrix of the period of the desired motion, see
`small_errors`. The eigenvalues of what it makes of errors in one period are their multipliers: the loop is
locally exponentially stable if all are below 1 in size, and -ln of the largest over the period is the rate.
A multiplier of 1 belongs to a combination of base parameters that the motion does not excite.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, non_negative_number, positive_number
from ..errors import InputError
from ..simulation.simulate import Experiment
from .directions import describe_slowest, describe_unexcited
from .in_words import InWords
from .interpolated import Interpolated
from .monodromy import FIRST, instants, monodromy
from .on_motion import DesiredMotion, check_period, check_reach
from .small_errors import Coordinates, error_matrices, make_coordinates

#: smallest multiplier that has all its digits
LEAST = float(np.finfo(float).tiny / np.finfo(float).eps)


@dataclass(frozen=True, eq=False, repr=False)
class ExponentialRate(InWords):
    """What one period makes of small errors, to first order.

    Attributes:
        period, start: of the motion, and where in it z begins, s.
        multipliers: eigenvalues of Phi, (k,), complex, the largest first; those that are 1 because nothing
            excites them come before the others.
        unexcited: combinations of base parameters that the motion does not excite, in words.
        slowest: which robot's error falls slowest of those that do, in words: a base parameter, or an error.
        error: estimate of the error of the entries of Phi.
        Phi: z one period later is Phi z, (k, k).
        right, left: columns of eigenvectors, (k, k), in the order of the multipliers.
        coordinates: what z is made of.
    """

    period: float
    start: float
    multipliers: np.ndarray
    unexcited: tuple[str, ...]
    slowest: str
    error: float
    Phi: np.ndarray
    right: np.ndarray
    left: np.ndarray
    coordinates: Coordinates

    @property
    def radius(self) -> float:
        """Size of the largest multiplier."""
        return float(np.abs(self.multipliers[0]))

    @property
    def rate(self) -> float:
        """-ln(radius) / period, 1/s: 0 where something is not excited."""
        return 0.0 if self.unexcited else self.excited_rate

    @property
    def excited_rate(self) -> float:
        """The same of all errors but those that nothing excites, 1/s."""
        return float(-np.log(np.abs(self.multipliers[len(self.unexcited)])) / self.period)

    @property
    def stable(self) -> bool:
        """Whether all errors, of parameters too, vanish exponentially if they are small.

        A multiplier that is nearer to 1 than its error does not tell.
        """
        return not self.unexcited and self.radius < 1 - self.error

    def as_dict(self) -> dict[str, Any]:
        """The figures a report shows, as plain data."""
        names = ("period", "start", "radius", "rate", "excited_rate", "stable", "slowest", "error")
        sizes = np.abs(self.multipliers).tolist()
        return {name: getattr(self, name) for name in names} | {
            "multipliers": sizes,
            "unexcited": list(self.unexcited),
        }

    def __str__(self) -> str:
        what = "errors of what the motion excites" if self.unexcited else "small errors"
        left = np.exp(-self.excited_rate * self.period)
        told = (
            f"{what} fall at {self.excited_rate:.4g} 1/s, after a period of {self.period:g} s "
            f"{left:.4g} of them is left; slowest: {self.slowest}"
        )
        if left >= 1 - self.error:
            told += f"\nthis cannot be told from no rate: what is left is known to {self.error:.1g}"
        frozen = f"\nnot excited, and so not learned: {'; '.join(self.unexcited)}"
        return told + frozen * bool(self.unexcited)


@dataclass(frozen=True, eq=False, repr=False)
class RatesOverGamma(InWords):
    """How the rate depends on how fast robots learn.

    Attributes:
        factors: of Gamma, (K,), ascending.
        rates: of all that the motion excites, (K,), 1/s.
        limit: min Lambda, 1/s, above which no Gamma brings the rate, because errors that no synchronization
            error sees fall as exp(-Lambda t); infinite if the coupling leaves none of these.
        unexcited: combinations of base parameters that no Gamma learns, in words.
    """

    factors: np.ndarray
    rates: np.ndarray
    limit: float
    unexcited: tuple[str, ...]

    @property
    def best(self) -> float:
        """The factor with the largest rate."""
        return float(self.factors[np.argmax(self.rates)])

    def __str__(self) -> str:
        lines = [
            f"Gamma times {k:.3g}: {rate:.3g} 1/s" for k, rate in zip(self.factors, self.rates, strict=True)
        ]
        lines.append(f"best: times {self.best:.3g}")
        if self.best in self.factors[[0, -1]]:
            lines[-1] += ", at an end of the factors; a better one may lie beyond"
        if np.isfinite(self.limit):
            lines.append(
                f"errors that no synchronization error sees fall at {self.limit:g} 1/s whatever Gamma"
            )
        if self.unexcited:
            lines.append(f"not excited, and so not learned: {'; '.join(self.unexcited)}")
        return "\n".join(lines)


def exponential_rate(experiment: Experiment, period: float, start: float = 0.0) -> ExponentialRate:
    """Multipliers and rate of small errors along a desired motion that repeats.

    A motion that rests has any period.

    Args:
        experiment: a cell with the paper's law and adaptation, alone: see `check_reach`.
        period: of the desired motion and the weights, s.
        start: from when on the motion repeats, s, at least 0.

    Raises:
        InputError: a time that is none, no period of the motion or one that leaves nothing of small errors,
            or an experiment that the theorem does not reach, by name.
        UnreachableError: no joint positions for what is desired.
        RobotError: the rank of a regressor is not clear.
    """
    whole = _Period(experiment, period, start)
    return whole.rate(1.0)


def rates_over_gamma(
    experiment: Experiment, period: float, factors: ArrayLike, start: float = 0.0
) -> RatesOverGamma:
    """The rate with Gamma times each of some factors.

    Args:
        factors: above 0, (K,).
        experiment, period, start: as in `exponential_rate`, which says what is raised, too.
    """
    given = np.sort(finite_array("factors", factors, (None,)))
    if not given.size or given[0] <= 0:
        raise InputError.expected("factors above 0", given.tolist(), "factors")
    whole = _Period(experiment, period, start)
    found = [whole.rate(factor) for factor in given.tolist()]
    rates = np.array([each.excited_rate for each in found])
    return RatesOverGamma(given, rates, _limit(whole.coordinates), found[0].unexcited)


def _limit(z: Coordinates) -> float:
    """The smallest Lambda where S has a null space."""
    n = z.controller.cell.n
    return float(z.controller.Lambda.min()) if z.B.shape[1] < n else float("inf")


class _Period:
    """One period of an experiment's desired motion; asked once, for every Gamma."""

    def __init__(self, experiment: Experiment, period: float, start: float):
        instance("experiment", experiment, Experiment, "an Experiment")
        self.period, self.start = positive_number("period", period), non_negative_number("start", start)
        loop = experiment.closed_loop()
        check_reach(experiment, loop)
        check_period(loop.cell, self.start, self.period)
        inside = [b for b in loop.cell.breaks if self.start < b < self.start + self.period]
        self.edges = [self.start, *inside, self.start + self.period]
        self._on = Interpolated(DesiredMotion(loop).at, self.edges)
        self.coordinates = make_coordinates(loop.controller, self._on(instants(self.edges, FIRST)))

    def rate(self, factor: float) -> ExponentialRate:
        """With Gamma times a factor."""
        z, kept = self.coordinates, self.coordinates.excited
        block, error = monodromy(
            lambda t: error_matrices(self._on(t), z, factor)[:, kept][..., kept], self.edges
        )
        values, left, right = _eigen(block, kept)
        Phi, count = np.eye(z.size), sum(z.unexcited)
        Phi[np.ix_(kept, kept)] = block
        self._check_left(float(np.abs(values[count])), error)
        slowest = describe_slowest(z, left[:, count], right[:, count])
        return ExponentialRate(
            self.period, self.start, values, describe_unexcited(z), slowest, error, Phi, right, left, z
        )

    def _check_left(self, largest: float, error: float) -> None:
        """Refuse a period after which nothing is left but rounding."""
        if largest <= (least := max(error, LEAST)):
            shown = f"{self.period:g} s, after which less than {least:.2g} of them is left"
            wanted = "a period in which small errors do not vanish"
            raise InputError.expected(wanted, self.period, "period", shown=shown)


def _eigen(block: np.ndarray, excited: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Multipliers, left and right eigenvectors as columns; what is not excited keeps to itself.

    Args:
        block: Phi of what is excited.
        excited: where in z that is, (k,).
    """
    from scipy.linalg import eig

    scale = max(float(np.abs(block).max()), LEAST)  # LAPACK does not tell numbers far below 1 apart
    values, left, right = eig(block / scale, left=True)
    order = np.argsort(-np.abs(values), kind="stable")
    rest = np.flatnonzero(~excited)
    size = len(excited)
    whole = np.zeros((2, size, size), complex)
    whole[:, rest, np.arange(len(rest))] = 1.0
    for vectors, found in zip(whole, (left, right), strict=True):
        vectors[np.ix_(excited, np.arange(len(rest), size))] = found[:, order]
    return np.concatenate([np.ones(len(rest)), scale * values[order]]), *whole
