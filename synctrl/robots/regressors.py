"""The regressors of all robots of a cell, from as few calls as their parameters allow."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from .forest import SMALL, forests
from .parameters import FullParameters, LinearParameters, Parameters

#: what is linear in the regressor of all inertial parameters, and so can share a forest
_RIGID = (FullParameters.regressor, LinearParameters.regressor)


class Block(NamedTuple):
    """Robots whose regressors are evaluated together.

    Attributes:
        rows: which robots.
        nv, size: numbers of joints and of parameters of each.
        regressor: q, v, v_ref, a_ref, (k, nv), -> Y, (k, nv, size).
    """

    rows: slice
    nv: int
    size: int
    regressor: Callable[..., np.ndarray]


class Regressors:
    """Y of every robot.

    Args:
        parameters: what is adapted, one entry per robot.
        joints: number of joints of every robot.
    """

    def __init__(self, parameters: Sequence[Parameters], joints: Sequence[int]):
        self._blocks = list(_blocks(parameters, joints))
        self._shape = len(joints), max(joints), max(len(p.theta) for p in parameters)
        if len(self._blocks) == 1:
            self.at = self._blocks[0].regressor

    def at(self, *motion: np.ndarray) -> np.ndarray:
        """Y, (n, nv, P), of q, v, v_ref and a_ref, (n, nv); zero where a robot has fewer joints or parameters."""
        Y = np.zeros(self._shape)
        for rows, nv, size, regressor in self._blocks:
            Y[rows, :nv, :size] = regressor(*(part[rows, :nv] for part in motion))
        return Y


def _blocks(parameters: Sequence[Any], joints: Sequence[int]) -> Iterator[Block]:
    kinds = [type(p).regressor in _RIGID for p in parameters]
    for rigid, group in groupby(range(len(joints)), kinds.__getitem__):
        rows = list(group)
        if rigid:
            yield from _in_forests(rows[0], parameters[rows[0] : rows[-1] + 1])
        else:
            yield from (_alone(i, parameters[i], joints[i]) for i in rows)


def _in_forests(first: int, parameters: Sequence[Any]) -> Iterator[Block]:
    """Blocks of parameters that are linear in the inertial ones, Y = Y_full B."""
    sizes = [(type(p).regressor, len(p.theta)) for p in parameters]
    for rows, forest in forests([p.robot for p in parameters], SMALL, sizes):
        regressor, (kind, size) = forest.regressor, sizes[rows.start]
        if kind is LinearParameters.regressor:
            regressor = _mapped(regressor, np.stack([p.matrix for p in parameters[rows]]))
        yield Block(slice(first + rows.start, first + rows.stop), forest.nv, size, regressor)


def _mapped(regressor: Callable[..., np.ndarray], B: np.ndarray) -> Callable[..., np.ndarray]:
    return lambda *motion: regressor(*motion) @ B


def _alone(i: int, parameters: Parameters, nv: int) -> Block:
    """One robot with parameters of a kind of their own."""

    def regressor(*motion: np.ndarray) -> np.ndarray:
        return parameters.regressor(*(part[0] for part in motion))[None]

    return Block(slice(i, i + 1), nv, len(parameters.theta), regressor)
