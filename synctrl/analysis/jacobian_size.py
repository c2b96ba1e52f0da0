"""How large J K_r^-1/2 may be wherever the robots are, for |r| = |c J s_q| <= |c J K_r^-1/2| |K_r^1/2 s_q|.

By lengths of links this holds for all joint positions, whether J has an inverse there or not:

    |J K_r^-1/2|^2 <= sum_k a_k^2 / K_r,k       with the bounds a_k of `column_bounds`

Orientation errors have J = Jr^-1(e_o) J_w, and |Jr^-1(e_o)| = (a/2) / sin(a/2) at an angle a. Of a space of a
user's own nothing is known: there J is sampled, which is no bound.
"""

from __future__ import annotations

from itertools import groupby

import numpy as np

from ..coupling.cell import Cell
from ..robots.link_lengths import column_bounds
from ..tasks.inverse_kinematics import position_range
from ..tasks.pose import PoseSpace
from ..tasks.sliding import SlidingSpace
from ..tasks.spaces import CartesianSpace, JointSpace

#: joint positions at which the Jacobian of an unknown space is looked at
SAMPLES = 512


def parts_of(cell: Cell) -> list[slice]:
    """Coordinates that are measured together: each joint alone; else those of one unit side by side."""
    if type(cell.space) is JointSpace:
        return [slice(k, k + 1) for k in range(cell.m)]
    found, start = [], 0
    for _, same in groupby(cell.units):
        found.append(slice(start, start := start + len(list(same))))
    return found


def sizes_of(e: np.ndarray, parts: list[slice]) -> np.ndarray:
    """Lengths of errors part by part, (..., parts), of (..., m)."""
    return np.stack([np.linalg.norm(e[..., part], axis=-1) for part in parts], axis=-1)


def jacobian_sizes(cell: Cell, K_r: np.ndarray, times: np.ndarray, angle: float) -> tuple[np.ndarray, bool]:
    """Bounds of |J K_r^-1/2| for each robot and part of the coordinates, (n, parts), and if they are sampled.

    Args:
        cell: the robots.
        K_r: damping of the joints, (n, nv), 0 for joints that a robot does not have.
        times: instants of the run, (T,), s.
        angle: bound of orientation errors, below 2 pi, rad.
    """
    compliance = np.divide(1.0, K_r, out=np.zeros_like(K_r), where=K_r > 0)
    kind = type(cell.space)
    if kind is JointSpace:
        return np.sqrt(compliance), False
    if kind not in (CartesianSpace, PoseSpace, SlidingSpace):
        return _sampled(cell, compliance, times), True
    sizes = np.empty((cell.n, len(parts_of(cell))))
    for i, robot in enumerate(cell.robots):
        columns, soft = column_bounds(robot, tool_length(cell, i, times)), compliance[i, : robot.nv]
        turned = np.sinc(angle / (2 * np.pi))  # sin(a/2) / (a/2)
        both = np.sqrt(columns.linear**2 @ soft), np.sqrt(columns.angular**2 @ soft) / turned
        sizes[i] = both[: sizes.shape[1]]
    return sizes, False


def tool_length(cell: Cell, i: int, times: np.ndarray) -> float:
    """How far the point of a robot that counts is from its tip at most, m."""
    if not isinstance(cell.space, SlidingSpace):
        return 0.0
    rows = cell.space.further(cell.members[i].trajectory, times + cell.clocks[i])
    return float(np.linalg.norm(rows[0], axis=-1).max())


def kappas(c: np.ndarray, sizes: np.ndarray, parts: list[slice]) -> np.ndarray:
    """Bounds of |c_i J_i K_r^-1/2| part by part, (n, parts): sup over time of sum_B |c_AB| |J_B K_r^-1/2|.

    Args:
        c: weights, (T, n, m, m).
        sizes: of `jacobian_sizes`, (n, parts).
        parts: of the coordinates.
    """
    return np.asarray((block_norms(c, parts) * sizes[:, None, :]).sum(-1).max(0))


def block_norms(c: np.ndarray, parts: list[slice]) -> np.ndarray:
    """Spectral norms of the blocks of matrices, (..., parts, parts)."""
    rows = [[np.linalg.norm(c[..., A, B], 2, axis=(-2, -1)) for B in parts] for A in parts]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _sampled(cell: Cell, compliance: np.ndarray, times: np.ndarray) -> np.ndarray:
    """The largest sizes at joint positions drawn within the limits."""
    rng, parts = np.random.default_rng(0), parts_of(cell)
    lower, upper = np.zeros((2, cell.n, cell.nv))
    for i, robot in enumerate(cell.robots):
        low, high = position_range(robot)
        lower[i, : robot.nv], upper[i, : robot.nv] = np.maximum(low, -np.pi), np.minimum(high, np.pi)
    found = np.zeros((cell.n, len(parts)))
    for desired in cell.reference_table(rng.choice(times, SAMPLES)).desired:
        motion = np.stack((rng.uniform(lower, upper), np.zeros_like(lower)))
        J = cell.task.measure(motion, desired).J
        scaled = np.sqrt(compliance)[:, None] * (np.eye(cell.m) if J is None else J)
        sizes = [np.linalg.norm(scaled[:, part], 2, axis=(-2, -1)) for part in parts]
        found = np.maximum(found, np.stack(sizes, axis=-1))
    return found
