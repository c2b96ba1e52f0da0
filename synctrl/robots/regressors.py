"""The regressors of all robots of a cell, as one array, from as few calls as their parameters allow.

    Y theta = M a_ref + C(q, v) v_ref + g,   Y (n, nv, P).

Rows and columns of robots with fewer joints or parameters than the largest are zero.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from .forest import SMALL, Forest, Selection, alike, as_selection, shares
from .parameters import (
    FrictionParameters,
    FullParameters,
    LinearParameters,
    Parameters,
    with_friction_columns,
)

#: what is linear in the regressor of all inertial parameters, and so can share a forest
_RIGID = (FullParameters.regressor, LinearParameters.regressor)

Regressors = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""q, v, v_ref and a_ref of k robots, (k, nv) each, -> their regressors, (k, nv, P)."""


class Group(NamedTuple):
    """Robots whose regressors are evaluated together.

    Attributes:
        robots: which robots.
        nv, size: numbers of joints and of parameters of each.
        compute: gives their regressors.
    """

    robots: Selection
    nv: int
    size: int
    compute: Regressors


def make_regressors(parameters: Sequence[Parameters], joints: Sequence[int]) -> Regressors:
    """A function of q, v, v_ref and a_ref, (n, nv), that gives the regressors of all robots, (n, nv, P).

    Args:
        parameters: what is adapted, one entry per robot.
        joints: number of joints of every robot.
    """
    groups = list(_groups(parameters, joints))
    shape = len(joints), max(joints), max(len(p.theta) for p in parameters)
    return groups[0].compute if len(groups) == 1 else partial(_compute_together, groups, shape)


def _compute_together(
    groups: Sequence[Group], shape: tuple[int, int, int], *motion: np.ndarray
) -> np.ndarray:
    Y = np.zeros(shape)
    for robots, nv, size, compute in groups:
        Y[robots, :nv, :size] = compute(*[part[robots, :nv] for part in motion])
    return Y


def _groups(parameters: Sequence[Any], joints: Sequence[int]) -> Iterator[Group]:
    """Parameters of one kind share forests wherever their robots stand; others are asked one by one."""
    for kind, robots in alike(map(_kind, parameters)).items():
        if kind is None:
            yield from (_alone(i, parameters[i], joints[i]) for i in robots)
        else:
            rigid = [_rigid(parameters[i]) for i in robots]
            for share in shares([p.robot for p in rigid], SMALL):
                yield _in_forest([robots[k] for k in share], parameters)


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


def _in_forest(robots: Sequence[int], parameters: Sequence[Any]) -> Group:
    """The group of some parameters of one kind whose robots share a forest."""
    mine = [parameters[i] for i in robots]
    rigid = [_rigid(p) for p in mine]
    linear = isinstance(rigid[0], LinearParameters)
    forest = Forest([p.robot for p in rigid], np.stack([p.matrix for p in rigid]) if linear else None)
    compute: Regressors = forest.regressor
    if isinstance(mine[0], FrictionParameters):
        smoothing = np.array([[p.smoothing] for p in mine])
        compute = partial(_compute_with_friction, compute, smoothing, mine[0].armature)
    return Group(as_selection(robots), forest.nv, len(mine[0].theta), compute)


def _compute_with_friction(
    compute: Regressors, smoothing: np.ndarray, armature: bool, q: np.ndarray, *rates: np.ndarray
) -> np.ndarray:
    v, v_ref, a_ref = rates
    return with_friction_columns(compute(q, *rates), v, v_ref, a_ref, smoothing, armature)


def _alone(i: int, parameters: Parameters, nv: int) -> Group:
    """One robot with parameters of a kind of their own."""
    return Group(slice(i, i + 1), nv, len(parameters.theta), partial(_compute_alone, parameters))


def _compute_alone(parameters: Parameters, *motion: np.ndarray) -> np.ndarray:
    """The regressor of one robot as its parameters give it."""
    return np.asarray(parameters.regressor(*(part[0] for part in motion)))[None]
