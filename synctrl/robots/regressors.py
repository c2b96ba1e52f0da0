"""The regressors of all robots of a cell, from as few calls as their parameters allow."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from .blocks import Beside, BlockProduct, Blocks, Padded, Part, Rows
from .forest import SMALL, Forest, alike, as_rows, shares
from .friction_parameters import FrictionParameters
from .parameters import FullParameters, LinearParameters, Parameters

#: what is linear in the regressor of all inertial parameters, and so can share a forest
_RIGID = (FullParameters.regressor, LinearParameters.regressor)

RegressorBlocks = Blocks | BlockProduct | Beside | Padded
"""Regressors of all robots, with the products that the law needs."""
Regressor = Callable[..., Any]
"""q, v, v_ref and a_ref of some robots, (k, nv), -> their regressors."""


class Group(NamedTuple):
    """Robots whose regressors are evaluated together.

    Attributes:
        rows: which robots.
        nv, size: numbers of joints and of parameters of each.
        regressor: of these robots.
    """

    rows: Rows
    nv: int
    size: int
    regressor: Regressor


def regressors(parameters: Sequence[Parameters], joints: Sequence[int]) -> Callable[..., RegressorBlocks]:
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
    """Parameters of one kind share forests wherever their robots stand; others are asked one by one."""
    for kind, rows in alike(map(_kind, parameters)).items():
        if kind is None:
            yield from (_alone(i, parameters[i], joints[i]) for i in rows)
        else:
            rigid = [_rigid(parameters[i]) for i in rows]
            for share in shares([p.robot for p in rigid], SMALL):
                yield _in_forest([rows[k] for k in share], parameters)


def _kind(parameters: Any) -> Hashable:
    """What parameters in one group have in common; None for a kind with a regressor of its own."""
    own, size = type(parameters).regressor, len(parameters.theta)
    if own is FrictionParameters.regressor:
        base = _kind(parameters.base)
        return None if base is None else (base, parameters.armature, size)
    return (own, size) if own in _RIGID else None


def _rigid(parameters: Any) -> Any:
    """Parameters of the rigid bodies alone."""
    return parameters.base if isinstance(parameters, FrictionParameters) else parameters


def _in_forest(rows: Sequence[int], parameters: Sequence[Any]) -> Group:
    """The group of some parameters of one kind whose robots share a forest."""
    mine = [parameters[i] for i in rows]
    rigid = [_rigid(p) for p in mine]
    forest = Forest([p.robot for p in rigid])
    regressor: Regressor = forest.regressor
    if isinstance(rigid[0], LinearParameters):
        regressor = partial(_mapped, regressor, Blocks.of(np.stack([p.matrix for p in rigid])))
    if isinstance(mine[0], FrictionParameters):
        smoothing = np.array([[p.smoothing] for p in mine])
        regressor = partial(_rubbing, regressor, smoothing, mine[0].armature)
    return Group(as_rows(rows), forest.nv, len(mine[0].theta), regressor)


def _mapped(regressor: Regressor, B: Blocks, *motion: np.ndarray) -> BlockProduct:
    """Y B, see `LinearParameters`."""
    return BlockProduct(regressor(*motion), B)


def _rubbing(regressor: Regressor, smoothing: np.ndarray, armature: bool, *motion: np.ndarray) -> Beside:
    """[Y_b, diag(v_ref), diag(tanh(v / smoothing)), diag(a_ref)], see `FrictionParameters`."""
    _, v, v_ref, a_ref = motion
    diagonals = (v_ref, np.tanh(v / smoothing), *((a_ref,) if armature else ()))
    return Beside(regressor(*motion), np.stack(diagonals, axis=1))


def _alone(i: int, parameters: Parameters, nv: int) -> Group:
    """One robot with parameters of a kind of their own."""
    return Group(slice(i, i + 1), nv, len(parameters.theta), partial(_asked, parameters))


def _asked(parameters: Parameters, *motion: np.ndarray) -> Blocks:
    """The regressor of one robot as its parameters give it."""
    return Blocks(np.asarray(parameters.regressor(*(part[0] for part in motion))), 1)
