"""Couplings in cell files: which robots are compared, and with which weights."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..assembly.meeting import motion_along
from ..coupling.along_path import Gate, PathWeights
from ..coupling.coupling import Coupling
from ..coupling.synchronization import SynchronizationFunction
from ..coupling.weights import ConstantWeights
from ..errors import CouplingWarning, InputError
from ..experiments.mobile_robot import WheelSynchronization
from .kinds import kind, one_of, table_or
from .values import ANY_NUMBERS, MATRIX, NUMBER, NUMBERS, ROBOT, TEXT, VECTOR, choice, list_of


class Told(NamedTuple):
    """What a coupling may have to know of its cell: its robots' desired motions, and how long it runs, s."""

    motions: Sequence[Any]
    duration: float

    @property
    def n(self) -> int:
        """Number of robots."""
        return len(self.motions)


Maker = Callable[[Told], Coupling]
Weighing = Callable[[Told], Any]
#: of functions: the pairs that they are divided into
GRAPHS: dict[str, Callable[..., Coupling]] = {
    "ring": Coupling.ring,
    "signed-ring": Coupling.signed_ring,
    "chain": Coupling.chain,
    "star": Coupling.star,
    "complete": Coupling.complete,
}


def path_weights(a: ArrayLike, gate: Gate | None = None) -> Weighing:
    """Weights in the axes of the paths along which the robots go.

    Args:
        a: a number per robot, none of them 0: (1, -1) compares the gap between two.
        gate: how much errors count; by default always the same.
    """
    return lambda told: PathWeights([motion_along(motion) for motion in told.motions], a, gate)


def pair(c: Any = (1.0, -1.0), unit: str = "") -> Maker:
    """Two robots, epsilon = c_1 e_1 + c_2 e_2, eq. (7).

    Args:
        c: weights: a number per robot, (n,); diagonals, (n, m); or matrices, (n, m, m).
        unit: of the weights.
    """
    return lambda told: Coupling.pair(_weights(c, told), unit)


def sum_of_all(c: Any = None, unit: str = "") -> Maker:
    """One error for all robots, epsilon = sum_i c_i e_i.

    Args:
        c: weights, see "pair"; by default 1.
        unit: of the weights.
    """
    return lambda told: Coupling.sum(told.n, _weights(c, told), unit)


def ring(c: Any = None, unit: str = "") -> Maker:
    """The paper's ring, epsilon_k = c_k e_k + c_{k+1} e_{k+1}, eq. (28).

    Args:
        c: weights, see "pair"; by default 1 and -1 in turn.
        unit: of the weights.
    """
    return lambda told: Coupling.ring(told.n, _weights(c, told), unit)


def signed_ring(c: Any = None, unit: str = "") -> Maker:
    """The ring of differences, epsilon_k = c_k e_k - c_{k+1} e_{k+1}.

    Args:
        c: weights, see "pair"; by default 1.
        unit: of the weights.
    """
    return lambda told: Coupling.signed_ring(told.n, _weights(c, told), unit)


def chain(c: Any = None, unit: str = "") -> Maker:
    """Differences of neighbours, in a row.

    Args:
        c: weights, see "pair"; by default 1.
        unit: of the weights.
    """
    return lambda told: Coupling.chain(told.n, _weights(c, told), unit)


def star(leader: int = 0, c: Any = None, unit: str = "") -> Maker:
    """Differences of one robot and each other one.

    Args:
        leader: the one, by name or counted from 0.
        c: weights, see "pair"; by default 1.
        unit: of the weights.
    """
    return lambda told: Coupling.star(told.n, leader, _weights(c, told), unit)


def complete(c: Any = None, unit: str = "") -> Maker:
    """Differences of all robots.

    Args:
        c: weights, see "pair"; by default 1.
        unit: of the weights.
    """
    return lambda told: Coupling.complete(told.n, _weights(c, told), unit)


def rows(
    edges: Any, signs: ArrayLike | None = None, c: Any = None, name: str = "graph", unit: str = ""
) -> Maker:
    """Rows of robots that are compared, epsilon_k = sum_i S[k, i] c_i e_i.

    Args:
        edges: the robots of each row, by name or counted from 0.
        signs: the entries of S for them; by default 1 and -1.
        c: weights, see "pair"; by default 1.
        name: for legends.
        unit: of the weights.
    """

    def made(told: Told) -> Coupling:
        S = np.tile([1.0, -1.0], (len(edges), 1)) if signs is None else signs
        return Coupling(told.n, edges, S, np.ones(told.n) if c is None else _weights(c, told), name, unit)

    return made


def function(A: ArrayLike, b: ArrayLike = 0.0, unit: str = "", graph: str | None = None) -> Maker:
    """The task f = sum_i A_i x_i + b = 0, which the desired motion has to satisfy; weights are c_i = -A_i.

    Args:
        A: numbers, (n,), diagonals, (n, m), or matrices, (n, m, m).
        b: a number, or (m,).
        unit: of A.
        graph: the pairs that it is divided into; by default there is one error for all.
    """

    def made(told: Told) -> Coupling:
        task = SynchronizationFunction.from_matrices(A, told.motions[0].dimension, b, unit=unit)
        return task.coupling(told.motions, told.duration, None if graph is None else GRAPHS[graph])

    return made


def wheels(duration: float) -> Maker:
    """The wheels of the mobile robot of the paper's example 2, f = R_2(t) x_1 - R_1(t) x_2.

    Args:
        duration: for which the weights are prepared, s.
    """
    return lambda told: WheelSynchronization().coupling(told.motions, duration)


GATE = kind("", Gate, gap=NUMBER, reach=NUMBER)
PATH_WEIGHTS = kind("path", None, path_weights, a=VECTOR, gate=GATE.model)
WEIGHTS = table_or(PATH_WEIGHTS, ANY_NUMBERS)
_C: dict[str, Any] = {"c": WEIGHTS, "unit": TEXT}
ROWS = kind("rows", None, rows, edges=list_of(list_of(ROBOT)), signs=MATRIX, name=TEXT, **_C)
#: those that are found again when a coupling is written, with what makes them of n and c
PATTERNS: dict[str, Any] = {
    "pair": (pair, lambda n, c: Coupling.pair(c)),
    "sum": (sum_of_all, Coupling.sum),
    "ring": (ring, Coupling.ring),
    "signed-ring": (signed_ring, Coupling.signed_ring),
    "chain": (chain, Coupling.chain),
    "complete": (complete, Coupling.complete),
}
COUPLINGS = (
    *(kind(name, None, make, **_C) for name, (make, _) in PATTERNS.items()),
    kind("star", None, star, leader=ROBOT, **_C),
    ROWS,
    kind("function", None, function, A=ANY_NUMBERS, b=NUMBERS, unit=TEXT, graph=choice(*GRAPHS)),
    kind("wheels", None, wheels, duration=NUMBER),
)
COUPLING = one_of(*COUPLINGS)
KINDS = (GATE, PATH_WEIGHTS, *COUPLINGS)


def coupling_keys(coupling: Coupling, motions: Sequence[Any]) -> dict[str, Any]:
    """The table of a coupling.

    Raises:
        InputError: weights that are a function without a name.
    """
    task = coupling.task
    if task is not None and type(task[0]) is WheelSynchronization:
        return {"kind": "wheels", "duration": task[1]}
    unit = {"unit": coupling.unit} if coupling.unit else {}
    weights = {"c": _weights_keys(coupling._source, motions), **unit}
    for name, given in _patterns(coupling.robots):
        if (name, given.signs.tolist(), given.edges.tolist()) == _rows_of(coupling):
            return {"kind": name, **weights}
    name, signs, edges = _rows_of(coupling)
    for leader in range(coupling.robots) if coupling.name == "star" else ():
        if edges == Coupling.star(coupling.robots, leader).edges.tolist():
            return {"kind": "star", "leader": leader, **weights}
    return {"kind": "rows", "edges": edges, "signs": signs, "name": coupling.name, **weights}


def _rows_of(coupling: Coupling) -> tuple[str, list, list]:
    return (
        coupling.name.replace("all to all", "complete").replace(" ", "-"),
        coupling.signs.tolist(),
        (coupling.edges.tolist()),
    )


def _patterns(n: int) -> Iterator[tuple[str, Coupling]]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CouplingWarning)
        for name, (_, make) in PATTERNS.items():
            if name != "pair" or n == 2:
                yield name, make(n, np.ones(n))


def _weights(c: Any, told: Told) -> Any:
    return c(told) if callable(c) else c


def _weights_keys(source: Any, motions: Sequence[Any]) -> Any:
    if type(source) is ConstantWeights:
        return source.c.tolist()
    along = [getattr(motion, "position", motion) for motion in motions]
    if type(source) is PathWeights and all(a is b for a, b in zip(source.motions, along, strict=True)):
        gate = None if source.gate is None else {"gap": source.gate.gap, "reach": source.gate.reach}
        return {"kind": "path", "a": source.a.tolist(), **({} if gate is None else {"gate": gate})}
    raise InputError(
        "expected weights that do not change, or that have a name in cell files, found a function of time",
        subject="coupling, c",
        found=source,
    )
