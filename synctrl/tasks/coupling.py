"""Coupling: which robots are compared, with which weights."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance
from ..errors import CouplingError, InputError

#: A condition number above this counts as "no inverse".
SINGULAR = 1e12


class Weights(NamedTuple):
    """c, its first and second time derivatives and its inverse, each (T, n, m, m)."""

    c: np.ndarray
    c_dot: np.ndarray
    c_ddot: np.ndarray
    c_inv: np.ndarray


#: t -> c, c', c'', each (n, m, m)
WeightFunction = Callable[[float], tuple[ArrayLike, ArrayLike, ArrayLike]]


class Coupling:
    """Synchronization errors epsilon_k = sum_i S[k, i] c_i e_i, eqs. (7) and (28).

    Every row of S has two entries, one per robot that is compared; S is kept as the list of these pairs, so
    that work grows with the number of pairs and not with its square.

    Args:
        robots: number of robots, n.
        edges: pairs of robots, counted from 0, (p, 2).
        signs: the two entries of S per pair, (p, 2).
        c: weights: a number per robot, (n,); diagonals, (n, m); matrices, (n, m, m); or a function of time
            returning c, c' and c'' as matrices.
        name: for legends.
        unit: unit of the weights, "" if they have none.

    Raises:
        CouplingError: a pair of a robot with itself or outside the cell, a repeated pair, a graph that is not
            connected, or a weight without an inverse.
    """

    def __init__(
        self,
        robots: int,
        edges: ArrayLike,
        signs: ArrayLike,
        c: ArrayLike | WeightFunction,
        name: str = "coupling",
        unit: str = "",
    ):
        self.robots = _count(robots)
        self.name, self.unit = name, unit
        self.signs = finite_array("signs", signs, (None, 2))
        self.edges = finite_array("edges", edges, self.signs.shape).astype(int)
        self.edges.flags.writeable = False
        self._check_graph()
        self.weight_function: WeightFunction | None = c if callable(c) else None
        self.constant = np.ones(self.robots) if callable(c) else finite_array("c", c)
        if self.constant.ndim == 0 or len(self.constant) != self.robots:
            raise InputError(
                f"c: expected one weight for each of {self.robots} robots, found shape {self.constant.shape}"
            )
        self._gather_by_robot()

    # -- ready couplings ----------------------------------------------------------------------------------

    @classmethod
    def pair(cls, c: ArrayLike | WeightFunction = (1.0, -1.0), unit: str = "") -> Self:
        """Two robots, epsilon = c_1 e_1 + c_2 e_2, eq. (7)."""
        return cls(2, [(0, 1)], [(1, 1)], c, "pair", unit)

    @classmethod
    def ring(cls, n: int, c: ArrayLike | WeightFunction | None = None, unit: str = "") -> Self:
        """The paper's ring, epsilon_k = c_k e_k + c_{k+1} e_{k+1}, eq. (28); by default c alternates in sign."""
        n = _count(n)
        default = [(-1.0) ** i for i in range(n)]
        return cls(n, _cycle(n), np.ones((n, 2)), default if c is None else c, "ring", unit)

    # -- use ----------------------------------------------------------------------------------------------

    @property
    def pairs(self) -> int:
        """Number of synchronization errors, p."""
        return len(self.edges)

    @property
    def matrix(self) -> np.ndarray:
        """S, (p, n), written out. For display and tests; the law does not need it."""
        S = np.zeros((self.pairs, self.robots))
        np.add.at(S, (np.arange(self.pairs)[:, None], self.edges), self.signs)
        return S

    def weights(self, times: np.ndarray, m: int) -> Weights:
        """Weights at some times, (T,), for a task of dimension m: four arrays (T, n, m, m).

        Raises:
            CouplingError: a weight has no inverse, or the weight function returned something else than three
                finite arrays of shape (n, m, m).
        """
        shape = (self.robots, m, m)
        if self.weight_function is None:
            c = _as_matrices(self.constant, m)
            constant = (c, np.zeros(shape), np.zeros(shape), _inverse(c[None], times)[0])
            return Weights(*(np.broadcast_to(part, (len(times), *shape)) for part in constant))
        parts = [_call(self.weight_function, t, shape) for t in times]
        c, c_dot, c_ddot = (np.array(part) for part in zip(*parts, strict=True))
        return Weights(c, c_dot, c_ddot, _inverse(c, times))

    def compare(self, w: np.ndarray) -> np.ndarray:
        """S w, (p, ...), for one row of w, (n, ...), per robot."""
        return self._sign_a * w.take(self._a, 0) + self._sign_b * w.take(self._b, 0)

    def distribute(self, z: np.ndarray) -> np.ndarray:
        """S^T z, (n, ...), for one row of z, (p, ...), per pair."""
        return np.add.reduceat(z.take(self._incident, 0) * self._incident_sign, self._first, axis=0)

    # -- internals ----------------------------------------------------------------------------------------

    def _gather_by_robot(self) -> None:
        """Lists the pairs of each robot one after another, so that a sum over them is one pass."""
        self._a, self._b = self.edges.T.copy()
        self._sign_a, self._sign_b = (column[:, None] for column in self.signs.T.copy())
        ends = self.edges.T.ravel()
        order = np.argsort(ends, kind="stable")
        self._incident = np.tile(np.arange(self.pairs), 2)[order]
        self._incident_sign = self.signs.T.ravel()[order][:, None]
        self._first = np.searchsorted(ends[order], np.arange(self.robots))

    def _check_graph(self) -> None:
        n = self.robots
        for k, (i, j) in enumerate(self.edges):
            if not (0 <= i < n and 0 <= j < n):
                raise CouplingError(
                    f"pair {k}: expected robots 0 to {n - 1}, found ({i}, {j})"
                )
            if i == j:
                raise CouplingError(f"pair {k}: robot {i} is compared with itself")
        if not self.signs.all():
            raise CouplingError("signs: expected entries other than 0, found a pair that leaves one robot out")
        apart = _unreached(n, self.edges)
        if apart:
            raise CouplingError(
                f"the graph is not connected: no chain of pairs leads from robot 0 to robot {apart[0]}; "
                "add a pair, or simulate the groups as separate cells"
            )

    def __repr__(self) -> str:
        return f"Coupling('{self.name}', {self.robots} robots, {self.pairs} pairs)"


def _count(n: int) -> int:
    instance("robots", n, (int, np.integer), "a number of robots")
    if isinstance(n, bool) or n < 2:
        raise CouplingError(f"robots: a coupling compares at least 2 robots, found {n}")
    return int(n)


def _cycle(n: int) -> list[tuple[int, int]]:
    return [(k, (k + 1) % n) for k in range(n)]


def _unreached(n: int, edges: Sequence | np.ndarray) -> list[int]:
    """Robots that no chain of pairs connects with robot 0."""
    neighbours: list[list[int]] = [[] for _ in range(n)]
    for i, j in edges:
        neighbours[i].append(j)
        neighbours[j].append(i)
    seen, todo = {0}, [0]
    while todo:
        new = set(neighbours[todo.pop()]) - seen
        seen |= new
        todo.extend(new)
    return sorted(set(range(n)) - seen)


def _as_matrices(c: np.ndarray, m: int) -> np.ndarray:
    n = len(c)
    if c.ndim == 1:
        return c[:, None, None] * np.eye(m)
    if c.shape == (n, m):
        return c[:, :, None] * np.eye(m)
    if c.shape == (n, m, m):
        return c.copy()
    raise InputError(f"c: expected shape ({n},), ({n}, {m}) or ({n}, {m}, {m}), found {c.shape}")


def _call(function: WeightFunction, t: float, shape: tuple[int, int, int]) -> list[np.ndarray]:
    value = function(float(t))
    if not isinstance(value, (tuple, list)) or len(value) != 3:
        raise CouplingError("c: expected a function returning the three arrays c, c' and c''")
    try:
        return [finite_array("c", part, shape) for part in value]
    except InputError as error:
        raise CouplingError(f"weights at t = {t:g} s: {error}") from error


def _inverse(c: np.ndarray, times: np.ndarray) -> np.ndarray:
    condition = np.nan_to_num(np.linalg.cond(c), nan=np.inf)
    if condition.max() >= SINGULAR:
        k, i = np.unravel_index(np.argmax(condition), condition.shape)
        raise CouplingError(
            f"the weight c of the robot at index {i} has no inverse at t = {times[k]:g} s "
            f"(condition number {condition[k, i]:.2g}): {c[k, i].tolist()}"
        )
    return np.linalg.inv(c)
