"""Graphs of robots: who is compared with whom. Robots are counted from 0."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..checks import finite_array, instance
from ..errors import CouplingError, CouplingWarning, InputError, warn

Edge = tuple[int, int]
#: beyond it numbers are no longer those of robots, and may not fit an integer
LARGEST = 2**31
#: entries of S up to which it is written out
WRITTEN_OUT = 100_000


def cycle(n: int) -> list[Edge]:
    """Every robot with the next one, and the last with the first."""
    return [(k, (k + 1) % n) for k in range(n)]


def read_graph(graph: Any) -> tuple[int, np.ndarray, np.ndarray]:
    """Number of robots, edges (p, 2) and edge weights (p,) of a graph.

    Args:
        graph: an undirected networkx graph whose nodes are 0 to n - 1, with `weight` attributes or without;
            or pairs (i, j) or triples (i, j, weight).

    Raises:
        CouplingError: no edges, a directed graph, or other nodes.
        InputError: something else.
    """
    if hasattr(graph, "nodes") and hasattr(graph, "is_directed"):
        rows, n = _networkx_rows(graph)
    else:
        instance("graph", graph, Iterable, "pairs of robots or a networkx graph")
        rows, n = [_row(edge) for edge in graph], None
    if not rows:
        raise CouplingError("expected at least one pair of robots, found none", subject="graph")
    table = finite_array("graph", rows, (len(rows), 3))
    edges = indices("graph", table[:, :2])
    return int(edges.max()) + 1 if n is None else n, edges, table[:, 2]


def indices(name: str, value: np.ndarray) -> np.ndarray:
    """Numbers of robots as integers.

    Raises:
        InputError: numbers that are not whole.
    """
    wrong = (value != np.round(value)) | (np.abs(value) > LARGEST)
    if wrong.any():
        raise InputError.expected("whole numbers of robots", value[wrong][0], name)
    return value.astype(int)


def check_rows(name: str, n: int, edges: np.ndarray, signs: np.ndarray) -> None:
    """Refuse rows that cannot synchronize n robots, and warn of those that do something surprising.

    Raises, warns: see `Coupling`.
    """
    if not len(edges) or (edges.shape[1] != 2 and edges.shape != (1, n)):
        raise CouplingError.expected(f"shape (p, 2) with p > 0, or (1, {n})", edges.shape, "edges")
    _find("robots 0 to {last}", np.any((edges < 0) | (edges >= n), axis=1), edges, n)
    ordered = np.sort(edges, axis=1)
    _find("different robots", (ordered[:, 1:] == ordered[:, :-1]).any(axis=1), edges, n)
    _find("signs other than 0, one for each robot", (signs == 0).any(axis=1), edges, n)
    if edges.shape[1] == 2:
        w = carried_motion(n, edges, signs)
        _check_motion(name, w, fits_all(edges, signs, w))
        _warn_of_repetition(name, n, ordered)


def _find(expected: str, wrong: np.ndarray, edges: np.ndarray, n: int) -> None:
    """Name the first wrong row."""
    if wrong.any():
        k = int(np.argmax(wrong))
        expected = expected.format(last=n - 1)
        raise CouplingError(f"expected {expected}", subject=f"edge {k}, of robots {edges[k].tolist()}")


def _check_motion(name: str, w: np.ndarray, left_free: bool) -> None:
    """Refuse a graph in several pieces, and warn of one that leaves no synchronized motion free."""
    if np.isnan(w).any():
        raise CouplingError(
            "the graph is not connected: no chain of edges leads from robot 0 to robot "
            f"{np.argmax(np.isnan(w))}; add an edge, or simulate the groups as separate cells"
        ).about("edges", robot=int(np.argmax(np.isnan(w))))
    if not left_free:
        warn(
            f"{name}: all synchronization errors vanish only where all tracking errors do, so there is no "
            "synchronized motion and every robot is held in place, as on the paper's ring of an odd number "
            "of robots; take differences instead, for example Coupling.signed_ring",
            CouplingWarning,
        )


def _warn_of_repetition(name: str, n: int, ordered: np.ndarray) -> None:
    _, first, counts = np.unique(ordered @ [n, 1], return_index=True, return_counts=True)
    if counts.max() > 1:
        i, j = ordered[first[np.argmax(counts)]]
        way_out = "Coupling.pair is the coupling of two" if n == 2 else "name the edge once"
        warn(
            f"{name}: robots {i} and {j} are compared {counts.max()} times, which multiplies the effect of "
            f"beta and K_eps on them by {counts.max()}; {way_out}, or use edge weights",
            CouplingWarning,
        )


def carried_motion(n: int, edges: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """The w, (n,), with w_0 = 1 that is carried along the edges, (p, 2), so that S w = 0 on each one used.

    It is not-a-number for robots that no chain of edges connects with robot 0.
    """
    neighbours: list[list[tuple[int, float]]] = [[] for _ in range(n)]
    ratios = np.stack([-signs[:, 0] / signs[:, 1], -signs[:, 1] / signs[:, 0]], axis=1)
    for (i, j), (forth, back) in zip(edges.tolist(), ratios.tolist(), strict=True):
        neighbours[i].append((j, forth))
        neighbours[j].append((i, back))
    w: list[float | None] = [1.0] + [None] * (n - 1)
    todo = [(0, 1.0)]
    while todo:
        i, here = todo.pop()
        for j, ratio in neighbours[i]:
            if w[j] is None:
                w[j] = ratio * here
                todo.append((j, ratio * here))
    return np.array([np.nan if value is None else value for value in w])


def fits_all(edges: np.ndarray, signs: np.ndarray, w: np.ndarray) -> bool:
    """Whether S w = 0 also on the edges that close a loop."""
    shares = signs * w[edges]
    return bool((np.abs(shares.sum(axis=1)) <= 1e-9 * np.abs(shares).max(axis=1)).all())


def _networkx_rows(graph: Any) -> tuple[list[tuple[Any, Any, Any]], int]:
    if graph.is_directed():
        raise CouplingError(
            "expected an undirected graph, because a synchronization error acts on both its robots; "
            "found a directed one, which to_undirected() converts",
            subject="graph",
        )
    n = graph.number_of_nodes()
    if set(graph.nodes) != set(range(n)):
        found = ", ".join(map(repr, list(graph.nodes)[:5]))
        raise CouplingError(
            f"expected the nodes 0 to {n - 1}, found {found}{', ...' if n > 5 else ''}; "
            "networkx.convert_node_labels_to_integers renames them",
            subject="graph",
            found=found,
        )
    return [(i, j, weight) for i, j, weight in graph.edges(data="weight", default=1.0)], n


def _row(edge: Any) -> tuple[Any, Any, Any]:
    parts = tuple(edge) if isinstance(edge, Iterable) and not isinstance(edge, str) else ()
    if len(parts) not in (2, 3):
        raise InputError.expected("pairs (i, j) or triples (i, j, weight)", edge, "graph")
    return (*parts, 1.0)[:3]


def largest_share(coupling: Any) -> float:
    """The largest eigenvalue of S^T S of a coupling; of a large S to four digits, without writing it out."""
    edges, signs = coupling.edges, coupling.signs
    if coupling.robots * coupling.pairs <= WRITTEN_OUT:
        return float(np.linalg.norm(coupling.matrix, 2) ** 2)
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import eigsh

    rows = np.repeat(np.arange(len(edges)), edges.shape[1])
    S = csr_array((signs.ravel(), (rows, edges.ravel())), (len(edges), coupling.robots))
    start = np.random.default_rng(0).standard_normal(coupling.robots)  # the same answer every time
    return float(eigsh(S.T @ S, 1, which="LA", v0=start, tol=1e-4, return_eigenvectors=False)[0])


def sparse_product(S: Any, x: np.ndarray) -> np.ndarray:
    """S x for one row of x, (..., k), per column of S."""
    rows = np.moveaxis(x, -2, 0)
    product = S @ rows.reshape(len(rows), -1)
    return np.moveaxis(product.reshape(-1, *rows.shape[1:]), 0, -2)
