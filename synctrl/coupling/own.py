"""A robot's own part of a cell: what it has to know to be controlled by itself.

The part is a cell of one robot, with its own motion, its own weights, its own parameters. Nothing is compared
inside it, so S has no rows; what the robot hears of others comes over a network that is its own as well.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from .cell import Cell
from .coupling import Coupling
from .weights import ConstantWeights, Weights, WeightSource


class OwnCoupling(Coupling):
    """The weights c_i of one robot of a coupling, and no row of S; `degree` is that of all robots.

    Args:
        coupling: of all robots.
        robot: which one, counted from 0.
    """

    def __init__(self, coupling: Coupling, robot: int):
        self.robots, self.name, self.unit = 1, coupling.name, coupling.unit
        self.edges, self.signs, self._in_pairs = np.zeros((0, 2), dtype=int), np.zeros((0, 2)), True
        self._source = own_weights(coupling._source, robot)
        self._set_sums()
        self.degree = coupling.degree


class OwnWeights:
    """The weights of one robot out of a source that only gives those of all at once.

    Args:
        source: of all robots.
        robot: which one, counted from 0.
    """

    robots = 1

    def __init__(self, source: WeightSource, robot: int):
        self._source, self._robot = source, robot

    def at(self, times: np.ndarray, m: int) -> Weights:
        own = slice(self._robot, self._robot + 1)
        return Weights(*(part[:, own] for part in self._source.at(times, m)))

    def scaled(self, factor: float) -> OwnWeights:
        return OwnWeights(self._source.scaled(factor), self._robot)

    def size(self, t: float) -> float:
        return self._source.size(t)


def own_weights(source: WeightSource, robot: int) -> WeightSource:
    """Where one robot's weights come from; constant ones leave those of the others behind."""
    if isinstance(source, ConstantWeights):
        return ConstantWeights(source.c[robot : robot + 1].copy())
    return OwnWeights(source, robot)


def own_cell(cell: Cell, robot: int) -> Cell:
    """A cell of one of the robots alone, with what it starts from and what is adapted of it.

    Args:
        cell: of all robots.
        robot: which one, counted from 0.
    """
    body, parameters = cell.robots[robot], cell.parameters[robot]
    member = replace(
        cell.members[robot],
        q0=cell.q0[robot, : body.nv].copy(),
        v0=cell.v0[robot, : body.nv].copy(),
        parameters=parameters,
        theta_hat0=cell.theta_hat0[robot, : len(parameters.theta)].copy(),
        name=cell.names[robot],
    )
    coupling, clock = OwnCoupling(cell.coupling, robot), cell.clocks[robot : robot + 1].copy()
    return Cell([member], coupling, _own_space(cell, robot), cell.name, clock)


def _own_space(cell: Cell, robot: int) -> Any:
    """The space of a cell, with the posture and the weights of one robot if it has such for each."""
    redundancy = getattr(cell.space, "redundancy", None)
    if redundancy is None:
        return cell.space
    space: Any = copy(cell.space)
    space.redundancy = redundancy.own(cell.robots, robot)
    return space
