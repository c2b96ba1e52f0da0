"""The regressors of all robots of a cell, from as few calls as their parameters allow."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from .blocks import BlockProduct, Blocks, Padded, Part
from .forest import SMALL, forests
from .parameters import FullParameters, LinearParameters, Parameters

#: what is linear in the regressor of all inertial parameters, and so can share a forest
_RIGID = (FullParameters.regressor, LinearParameters.regressor)


Y = Blocks | BlockProduct | Padded
"""Regressors of all robots, with the products that the law needs."""


class Group(NamedTuple):
    """Robots whose regressors are evaluated together.

    Attributes:
        rows: which robots.
        nv, size: numbers of joints and of parameters of each.
        regressor: q, v, v_ref, a_ref, (k, nv), -> Y of k robots.
    """

    rows: slice
    nv: int
    size: int
    regressor: Callable[..., Blocks | BlockProduct]


def regressors(parameters: Sequence[Parameters], joints: Sequence[int]) -> Callable[..., Y]:
    """A function of q, v, v_ref and a_ref, (n, nv), that gives the regressors of all robots.

    Rows and columns of robots with fewer joints or parameters than the largest are padded with zeros.

    Args:
        parameters: what is adapted, one entry per robot.
        joints: number of joints of every robot.
    """
    groups = list(_groups(parameters, joints))
    shape = len(joints), max(joints), max(len(p.theta) for p in parameters)
    return groups[0].regressor if len(groups) == 1 else partial(_together, groups, shape)


def _together(groups: Sequence[Group], shape: tuple[int, int, int], *motion: np.ndarray) -> Padded:
    parts = []
    for rows, nv, size, regressor in groups:
        parts.append(Part(rows, nv, size, regressor(*(array[rows, :nv] for array in motion))))
    return Padded(shape, parts)


def _groups(parameters: Sequence[Any], joints: Sequence[int]) -> Iterator[Group]:
    rigid = [type(p).regressor in _RIGID for p in parameters]
    for shared, group in groupby(range(len(joints)), rigid.__getitem__):
        rows = list(group)
        if shared:
            yield from _in_forests(rows[0], parameters[rows[0] : rows[-1] + 1])
        else:
            yield from (_alone(i, parameters[i], joints[i]) for i in rows)


def _in_forests(first: int, parameters: Sequence[Any]) -> Iterator[Group]:
    """Groups of parameters that are linear in the inertial ones, Y = Y_full B."""
    kinds = [(type(p).regressor, len(p.theta)) for p in parameters]
    for rows, forest in forests([p.robot for p in parameters], SMALL, kinds):
        regressor: Callable[..., Blocks | BlockProduct] = forest.regressor
        kind, size = kinds[rows.start]
        if kind is LinearParameters.regressor:
            regressor = _mapped(forest.regressor, Blocks.of(np.stack([p.matrix for p in parameters[rows]])))
        yield Group(slice(first + rows.start, first + rows.stop), forest.nv, size, regressor)


def _mapped(regressor: Callable[..., Blocks], B: Blocks) -> Callable[..., BlockProduct]:
    return lambda *motion: BlockProduct(regressor(*motion), B)


def _alone(i: int, parameters: Parameters, nv: int) -> Group:
    """One robot with parameters of a kind of their own."""

    def regressor(*motion: np.ndarray) -> Blocks:
        return Blocks(parameters.regressor(*(part[0] for part in motion)), 1)

    return Group(slice(i, i + 1), nv, len(parameters.theta), regressor)
