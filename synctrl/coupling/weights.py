"""Weights c_i(t) of a coupling: constant ones, and functions of time with their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, positive_number
from ..errors import CouplingError, InputError
from ..renamed import names_elsewhere
from ..tasks.chebyshev import NotSmoothError, SmoothFunction, fit_smooth

#: A condition number above this counts as "no inverse".
SINGULAR = 1e12
#: weights and their derivatives, for messages
DERIVATIVES = ("c", "c'", "c''")

#: t -> c, c', c'', each (n,), (n, m) or (n, m, m)
WeightFunction = Callable[[float], tuple[ArrayLike, ArrayLike, ArrayLike]]


class Weights(NamedTuple):
    """c, its first and second time derivatives and its inverse, each (T, n, m, m)."""

    c: np.ndarray
    c_dot: np.ndarray
    c_ddot: np.ndarray
    c_inv: np.ndarray

    @property
    def move(self) -> bool:
        """Whether c' and c'' have to be asked for."""
        return True


class StillWeights(Weights):
    """Weights of which c' and c'' are zero for good: nothing has to be multiplied by them."""

    move = False


class WeightSource(Protocol):
    """Where the weights of n robots come from.

    One whose `diagonal` is True says that nothing but zeros stands beside the diagonals, at any time; without
    it that is not known.
    """

    robots: int

    def at(self, times: np.ndarray, m: int) -> Weights:
        """Weights at some times, (T,), for a task of dimension m."""

    def scaled(self, factor: float) -> WeightSource:
        """These weights times a constant."""

    def size(self, t: float) -> float:
        """Geometric mean of the singular values of all c_i(t)."""


class ConstantWeights:
    """Weights that do not change.

    Args:
        c: a number per robot, (n,); diagonals, (n, m); or matrices, (n, m, m).

    Raises:
        InputError: not finite, or another shape.
    """

    def __init__(self, c: ArrayLike):
        self.c = finite_array("c", c)
        if self.c.ndim not in (1, 2, 3):
            raise InputError.expected("shape (n,), (n, m) or (n, m, m)", self.c.shape, "c")
        self.robots = len(self.c)
        self._known: dict[int, Weights] = {}

    def at(self, times: np.ndarray, m: int) -> Weights:
        """Views of one set of arrays, which is made once for each m."""
        if m not in self._known:
            c = as_matrices(self.c, m)
            zero = np.zeros_like(c)
            self._known[m] = Weights(c, zero, zero, inverse(c[None], np.asarray(times)[:1])[0])
        return Weights(*(np.broadcast_to(part, (len(times), *part.shape)) for part in self._known[m]))

    def scaled(self, factor: float) -> ConstantWeights:
        return ConstantWeights(factor * self.c)

    def size(self, t: float) -> float:
        return geometric_mean(self.c)


class FunctionWeights:
    """Weights given by a function of one time that returns c, c' and c''.

    Args:
        robots: number of robots.
        function: t -> three arrays of shape (n,), (n, m) or (n, m, m).
    """

    def __init__(self, robots: int, function: WeightFunction):
        self.robots, self.function = robots, function

    def at(self, times: np.ndarray, m: int) -> Weights:
        parts = [[as_matrices(part, m) for part in self._call(t)] for t in times]
        c, c_dot, c_ddot = (np.array(part) for part in zip(*parts, strict=True))
        return Weights(c, c_dot, c_ddot, inverse(c, times))

    def scaled(self, factor: float) -> FunctionWeights:
        return FunctionWeights(self.robots, lambda t: tuple(factor * part for part in self._call(t)))  # type: ignore[arg-type,return-value]

    def size(self, t: float) -> float:
        return geometric_mean(self._call(t)[0])

    def _call(self, t: float) -> Sequence[np.ndarray]:
        value = self.function(float(t))
        if not isinstance(value, (tuple, list)) or len(value) != 3:
            raise CouplingError(
                f"expected a function of t returning c, c' and c'', found {value!r}; "
                "SmoothWeights.from_function takes one that returns c alone",
                subject="c",
                found=value,
            )
        try:
            parts = [finite_array(name, part) for name, part in zip(DERIVATIVES, value, strict=True)]
            if any(part.ndim == 0 or len(part) != self.robots for part in parts):
                found = [part.shape for part in parts]
                shapes = f"shapes {', '.join(map(str, found))}"
                raise InputError.expected(f"one weight for each of {self.robots} robots", found, shown=shapes)
        except InputError as error:
            failure = CouplingError(f"weights at t = {t:g} s: {error}")
            raise failure.about("c", found=error.found, time=float(t)) from error
        return parts


class SmoothWeights:
    """Weights c_i(t) with certified derivatives, from 0 to the end of a run.

    Args:
        c: the weights, (n, m, m).
        factor: what they are multiplied by.
    """

    def __init__(self, c: SmoothFunction, factor: float = 1.0):
        self._c, self._factor = c, factor
        self.robots = c.shape[0]

    @property
    def diagonal(self) -> bool:
        """Whether all polynomials beside the diagonals are zero."""
        return self._c.is_diagonal

    @classmethod
    def from_function(cls, c: Callable[[float], ArrayLike], duration: float, m: int) -> SmoothWeights:
        """Weights from a function that returns c alone; their derivatives are found, and certified.

        Args:
            c: t -> a number per robot, (n,), diagonals, (n, m), or matrices, (n, m, m).
            duration: they can be used from 0 to this time, s.
            m: dimension of the task.

        Raises:
            InputError: the function returns something else.
            CouplingError: it is not smooth enough for a relative error of 1e-8.
        """
        try:
            smooth = fit_smooth(
                lambda t: as_matrices(finite_array(f"c at t = {t:g} s", c(t)), m),
                positive_number("duration", duration),
            )
        except NotSmoothError as error:
            where = f"the weight of the robot at index {error.row}"
            failure = CouplingError(f"{where} cannot be differentiated {error.order} times: {error}")
            raise failure.about("c", robot=error.row, time=error.time) from None
        return cls(smooth)

    def at(self, times: np.ndarray, m: int) -> Weights:
        made_for = self._c.shape[-1]
        if made_for != m:
            raise CouplingError(
                f"expected weights for {m} coordinates, found some for {made_for}",
                subject="c",
                found=made_for,
            )
        outside = self._c.first_outside(times)
        if outside is not None:
            raise CouplingError(
                f"the weights were prepared for times from 0 to {self._c.duration:g} s, asked for t = "
                f"{outside:g} s; make the coupling for a longer duration"
            ).about("c", time=outside)
        c, c_dot, c_ddot = self._factor * self._c.at(times)
        return Weights(c, c_dot, c_ddot, inverse(c, times))

    def scaled(self, factor: float) -> SmoothWeights:
        return SmoothWeights(self._c, factor * self._factor)

    def size(self, t: float) -> float:
        return ConstantWeights(self.at(np.array([t]), self._c.shape[-1]).c[0]).size(t)


def as_source(robots: int, c: ArrayLike | WeightFunction | WeightSource) -> WeightSource:
    """What the caller gave as weights, as a `WeightSource` for n robots.

    Raises:
        InputError: weights for another number of robots.
    """
    source: Any = c
    if not (hasattr(c, "at") and hasattr(c, "scaled")):
        source = FunctionWeights(robots, c) if callable(c) else ConstantWeights(c)
    if source.robots != robots:
        raise InputError.expected(f"one weight for each of {robots} robots", source.robots, "c")
    return source


def as_matrices(c: np.ndarray, m: int) -> np.ndarray:
    """Numbers, (n,), diagonals, (n, m), or matrices, (n, m, m), as matrices, (n, m, m).

    Raises:
        InputError: another shape.
    """
    n = c.shape[0] if c.ndim else 0
    if c.ndim == 1:
        return c[:, None, None] * np.eye(m)
    if c.shape == (n, m):
        return c[:, :, None] * np.eye(m)
    if c.shape == (n, m, m):
        return c.copy()
    raise InputError.expected(f"shape ({n},), ({n}, {m}) or ({n}, {m}, {m})", c.shape, "c")


def geometric_mean(c: np.ndarray) -> float:
    """Geometric mean of the singular values of all weights, (n,), (n, m) or (n, m, m)."""
    with np.errstate(divide="ignore"):
        if c.ndim < 3:
            return float(np.exp(np.log(np.abs(c)).mean()))
        return float(np.exp(np.linalg.slogdet(c)[1].mean() / c.shape[-1]))


def inverse(c: np.ndarray, times: np.ndarray) -> np.ndarray:
    """c^-1 of weights, (T, n, m, m), at some times, (T,).

    Raises:
        CouplingError: a weight without an inverse; the message names the robot and the time.
    """
    try:
        inverted = np.linalg.inv(c)
    except np.linalg.LinAlgError:
        raise _singular(c, times) from None
    with np.errstate(over="ignore", invalid="ignore"):
        condition = np.sqrt((c * c).sum((-2, -1)) * (inverted * inverted).sum((-2, -1)))
    if not (condition < SINGULAR).all():
        raise _singular(c, times)
    return inverted


def _singular(c: np.ndarray, times: np.ndarray) -> CouplingError:
    """The error for the worst of these weights, at least one of which has no inverse."""
    condition = np.nan_to_num(np.linalg.cond(c), nan=np.inf, posinf=np.inf)
    k, i = np.unravel_index(np.argmax(condition), condition.shape)
    return CouplingError(
        f"the weight c of the robot at index {i} has no inverse at t = {times[k]:g} s "
        f"(condition number {condition[k, i]:.2g}): {c[k, i].tolist()}"
    ).about("c", found=c[k, i], robot=int(i), time=float(times[k]))


__getattr__ = names_elsewhere(__name__, ".desired", "check_weights")
