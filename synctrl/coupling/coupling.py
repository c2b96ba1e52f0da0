"""Coupling: which robots are compared, with which weights."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from functools import partial
from itertools import combinations
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, finite_number, instance
from ..errors import CouplingError, InputError
from . import graphs
from .desired import check_weights
from .weights import ConstantWeights, WeightFunction, Weights, WeightSource, as_source

#: entries of S up to which a product with S written out is the quickest way
SMALL = 256

RowProduct = Callable[[np.ndarray], np.ndarray]
#: what the arguments `c` below may be
WeightsLike = ArrayLike | WeightFunction | WeightSource


class Coupling:
    """Synchronization errors epsilon_k = sum_i S[k, i] c_i e_i, eqs. (7) and (28).

    Every row of S has a few entries, one per robot that is compared, usually two; S is kept as the list of
    these, so that work grows with their number, and is written out for a few robots only.

    Args:
        robots: number of robots, n.
        edges: the robots compared in each row, counted from 0, (p, 2); or all robots in one row, (1, n).
        signs: the entries of S for them, of the same shape as `edges`.
        c: weights: a number per robot, (n,); diagonals, (n, m); matrices, (n, m, m); or a function of time
            returning c, c' and c'' in one of these forms; or `SmoothWeights.from_function` of c alone.
        name: for legends.
        unit: unit of the weights, "" if they have none.

    Attributes:
        degree: a, the largest entry of the diagonal of S^T S.
        task: the `SynchronizationFunction` that it comes from, and for how long, s; or None.

    Raises:
        CouplingError: a robot compared with itself or outside the cell, an entry that is zero, or a graph
            that is not connected. A weight without an inverse is refused before a run starts.

    Warns:
        CouplingWarning: two rows that compare the same pair, or a graph on which all synchronization errors
            vanish only if all tracking errors do.
    """

    task: tuple[Any, float] | None = None

    def __init__(
        self,
        robots: int,
        edges: ArrayLike,
        signs: ArrayLike,
        c: WeightsLike,
        name: str = "coupling",
        unit: str = "",
    ):
        self.robots = _count(robots)
        self.name, self.unit = name, unit
        self.signs = finite_array("signs", signs, (None, None))
        self.edges = graphs.indices("edges", finite_array("edges", edges, self.signs.shape))
        self.edges.flags.writeable = False
        self._in_pairs = self.signs.shape[1] == 2
        graphs.check_rows(name, self.robots, self.edges, self.signs)
        self._source = as_source(self.robots, c)
        self._set_sums()

    # -- ready couplings ----------------------------------------------------------------------------------

    @classmethod
    def pair(cls, c: WeightsLike = (1.0, -1.0), unit: str = "") -> Self:
        """Two robots, epsilon = c_1 e_1 + c_2 e_2, eq. (7)."""
        return cls(2, [(0, 1)], [(1, 1)], c, "pair", unit)

    @classmethod
    def sum(cls, n: int, c: WeightsLike | None = None, unit: str = "") -> Self:
        """One error for all robots, epsilon = sum_i c_i e_i: eq. (6) undivided, and the pair for n = 2.

        It asks for nothing but (6), for any n; in exchange every robot has to know the error of every other.
        """
        n = _count(n)
        return cls(n, [range(n)], np.ones((1, n)), np.ones(n) if c is None else c, "sum", unit)

    @classmethod
    def ring(cls, n: int, c: WeightsLike | None = None, unit: str = "") -> Self:
        """The paper's ring, epsilon_k = c_k e_k + c_{k+1} e_{k+1}, eq. (28); by default c alternates in sign.

        Warns:
            CouplingWarning: n is odd, or n = 2. All epsilon vanish where c_1 e_1 = -c_2 e_2 = c_3 e_3 = ...;
                on an odd ring that ends in c_1 e_1 = -c_1 e_1 = 0, and nothing is left to be synchronized:
                use `signed_ring`. A ring of two has the pair's row twice, so twice its beta and K_eps.
        """
        n = _count(n)
        default = [(-1.0) ** i for i in range(n)]
        return cls(n, graphs.cycle(n), np.ones((n, 2)), default if c is None else c, "ring", unit)

    @classmethod
    def signed_ring(cls, n: int, c: WeightsLike | None = None, unit: str = "") -> Self:
        """The ring of differences, epsilon_k = c_k e_k - c_{k+1} e_{k+1}, for any n; by default c = 1."""
        return cls._differences(n, graphs.cycle(_count(n)), c, "signed ring", unit)

    @classmethod
    def chain(cls, n: int, c: WeightsLike | None = None, unit: str = "") -> Self:
        """Differences of neighbours, c_k e_k - c_{k+1} e_{k+1} for k = 1 to n - 1; by default c = 1."""
        return cls._differences(n, [(k, k + 1) for k in range(_count(n) - 1)], c, "chain", unit)

    @classmethod
    def star(cls, n: int, leader: int = 0, c: WeightsLike | None = None, unit: str = "") -> Self:
        """Differences of one robot and each other one; by default c = 1. The leader feels all of them."""
        instance("leader", leader, (int, np.integer), "the number of a robot")
        if not 0 <= leader < _count(n):
            raise CouplingError.expected(f"a robot from 0 to {n - 1}", leader, "leader")
        return cls._differences(n, [(leader, k) for k in range(n) if k != leader], c, "star", unit)

    @classmethod
    def complete(cls, n: int, c: WeightsLike | None = None, unit: str = "") -> Self:
        """Differences of all robots, n (n - 1) / 2 of them; by default c = 1."""
        return cls._differences(n, [*combinations(range(_count(n)), 2)], c, "all to all", unit)

    @classmethod
    def from_graph(
        cls, graph: Any, n: int | None = None, c: WeightsLike | None = None, unit: str = ""
    ) -> Self:
        """Differences along the edges of a graph, epsilon_k = a_k (c_i e_i - c_j e_j) for edge k from i to j.

        Args:
            graph: pairs (i, j) or triples (i, j, a), robots counted from 0; or an undirected networkx graph
                with nodes 0 to n - 1, whose `weight` attributes, if there are any, are the a of `weighted`.
            n: number of robots; by default as many as the graph names.
            c: weights, by default 1.
            unit: unit of the weights.

        Raises:
            CouplingError: see `Coupling`; also a directed graph, or one without edges.
        """
        found, edges, edge_weights = graphs.read_graph(graph)
        coupling = cls._differences(found if n is None else n, edges, c, "graph", unit)
        return coupling if (edge_weights == 1).all() else coupling.weighted(edge_weights)

    @classmethod
    def _differences(cls, n: int, edges: ArrayLike, c: WeightsLike | None, name: str, unit: str) -> Self:
        signs = np.tile([1.0, -1.0], (len(edges), 1))  # type: ignore[arg-type]
        return cls(n, edges, signs, np.ones(_count(n)) if c is None else c, name, unit)

    # -- variations ---------------------------------------------------------------------------------------

    def weighted(self, edge_weights: ArrayLike) -> Self:
        """This coupling with row k of S multiplied by a_k.

        epsilon_k grows by a_k, and what it does to its robots, through beta and K_eps, by a_k squared.

        Args:
            edge_weights: a, (p,), above 0.

        Raises:
            InputError: another size, or a weight that is not above 0.
        """
        a = finite_array("edge_weights", edge_weights, (self.pairs,))
        if a.min() <= 0:
            k = int(np.argmin(a))
            raise InputError(
                f"expected numbers above 0, found {a[k]:g} at index {k}; leave that pair out",
                subject="edge_weights",
                found=a[k],
            )
        return self._again(self.signs * a[:, None], self._source, self.unit)

    def normalized(self, t: float = 0.0) -> Self:
        """This coupling with weights that do not depend on how the synchronization function was scaled.

        f = 0 and 5 f = 0 are the same task, but epsilon differs by 5 and the effective K_eps by 25. Here all
        c are divided by one constant, the geometric mean of the singular values of all c_i at one instant.
        K_eps is then in N·m/rad, or N/m, as if c had no unit. A constant leaves c' and c'' as exact as c.

        Args:
            t: the instant, s.
        """
        size = self._source.size(finite_number("t", t))
        if not 0 < size < np.inf:
            singular = f"a weight has no inverse at t = {t:g} s, so there is no scale to divide by"
            raise CouplingError(singular).about("c", time=t)
        return self._again(self.signs, self._source.scaled(1 / size), "")

    def _again(self, signs: np.ndarray, source: WeightSource, unit: str) -> Self:
        """A copy with other entries and weights; what there is to warn of was said of the first one."""
        again = copy(self)
        again.signs, again._source, again.unit, again.task = finite_array("signs", signs), source, unit, None
        again._set_sums()
        return again

    # -- use ----------------------------------------------------------------------------------------------

    @property
    def pairs(self) -> int:
        """Number of synchronization errors, p."""
        return len(self.edges)

    @property
    def is_constant(self) -> bool:
        """Whether the weights are the same at all times."""
        return isinstance(self._source, ConstantWeights)

    @property
    def is_diagonal(self) -> bool:
        """Whether the source of the weights says that they are diagonals at all times, see `WeightSource`."""
        return bool(getattr(self._source, "diagonal", False))

    @property
    def incidence(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """S^T as lists: where the rows of each robot begin, (n + 1,); then each row, and its entry of S."""
        rows = self._entries().T.tocsr()
        return rows.indptr, rows.indices, rows.data

    @property
    def matrix(self) -> np.ndarray:
        """S, (p, n), written out. For display and tests; the law does not need it."""
        S = np.zeros((self.pairs, self.robots))
        np.add.at(S, (np.arange(self.pairs)[:, None], self.edges), self.signs)
        return S

    @property
    def synchronized_motion(self) -> np.ndarray | None:
        """The w = (c_i e_i), (n,), that all pairs leave free, S w = 0, with w_0 = 1; None if there is none.

        Raises:
            CouplingError: the coupling is not made of pairs.
        """
        if not self._in_pairs:
            raise CouplingError(f"{self!r} compares all at once and leaves many motions free").about("edges")
        w = graphs.carried_motion(self.robots, self.edges, self.signs)
        return w if graphs.fits_all(self.edges, self.signs, w) else None

    def weights(self, times: np.ndarray, m: int) -> Weights:
        """Weights at some times, (T,), for a task of dimension m: four arrays (T, n, m, m).

        Raises:
            CouplingError: a weight has no inverse, or a function did not return three finite arrays of n.
        """
        return self._source.at(times, m)

    def check_weights(self, times: np.ndarray, m: int) -> None:
        """Follow the weights through the instants of a run, (T,), before it starts.

        Raises:
            CouplingError: a weight loses its inverse, or c' or c'' is no derivative; with robot and time.
            SimulationError: the weights fail; with the time.
        """
        check_weights(self._source, np.asarray(times, dtype=float), m)

    @property
    def products(self) -> tuple[RowProduct, RowProduct]:
        """`compare` and `distribute` as functions for who needs them often."""
        return self._S, self._S_T

    def compare(self, w: np.ndarray) -> np.ndarray:
        """S w, (..., p, k), for one row of w, (..., n, k), per robot."""
        return self._S(w)

    def distribute(self, z: np.ndarray) -> np.ndarray:
        """S^T z, (..., n, k), for one row of z, (..., p, k), per pair."""
        return self._S_T(z)

    # -- internals ----------------------------------------------------------------------------------------

    def _set_sums(self) -> None:
        """Products with S: written out for a few robots, else as the list of its entries."""
        self.degree = float(np.bincount(self.edges.ravel(), self.signs.ravel() ** 2).max(initial=0.0))
        if self.robots * self.pairs <= SMALL:
            S = self.matrix
            self._S, self._S_T = partial(np.matmul, S), partial(np.matmul, S.T)
        else:
            S = self._entries()
            self._S, self._S_T = (partial(graphs.sparse_product, each) for each in (S, S.T.tocsr()))

    def _entries(self) -> Any:
        """S as the list of its entries."""
        from scipy.sparse import csr_array

        rows = np.repeat(np.arange(self.pairs), self.edges.shape[1])
        return csr_array((self.signs.ravel(), (rows, self.edges.ravel())), (self.pairs, self.robots))

    def __repr__(self) -> str:
        rows = f"{self.pairs} pairs" if self._in_pairs else "all in one"
        return f"Coupling('{self.name}', {self.robots} robots, {rows})"


def _count(n: int) -> int:
    instance("robots", n, (int, np.integer), "a number of robots")
    if isinstance(n, bool) or n < 2:
        raise CouplingError(f"a coupling compares at least 2 robots, found {n}", subject="robots", found=n)
    return int(n)
