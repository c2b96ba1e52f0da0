"""Tare: all arms agree on where the object is at the moment at which they grasp it.

Every arm believes to know where the object is in its hand. Where beliefs differ, epsilon = 0 asks for a
deformation of what cannot deform. At closure the object is in all hands at once, so there one arm's belief,
T_o = T_hand,1 D_1, can be everybody's:

    D_i := T_hand,i^-1 T_o = D_i (T_tip,i^-1 T_tip,1)

for the tips are the object's frame as each arm believes it. Constant errors of grasps then vanish from
epsilon as long as the geometry is kept; wrong orientations of bases come back as the object turns.

At pins no arm knows by itself how the object is turned. There the common belief is the pose in which the
places that all of them believe fit best to where their pins are, and each takes its own place from that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, index, instance
from ..coupling.cell import Cell, Member
from ..robots.payload import holding
from ..tasks.rotations import log


def tared(cell: Cell, by: int = 0) -> Cell:
    """A cell whose arms all believe the object where one of them does at t = 0.

    Args:
        cell: arms whose tips are the frame of one object, as each believes to hold it.
        by: whose belief the others take over, counted from 0.

    Raises:
        InputError: no cell, or no such arm.
    """
    instance("cell", cell, Cell, "a Cell")
    first = index("by", by, cell.n)
    p, R = believed_poses(cell)
    members = [
        member if i == first else _holding_it_at(member, R[i].T @ (p[first] - p[i]), R[i].T @ R[first], q)
        for i, (member, q) in enumerate(zip(cell.members, cell.q0, strict=True))
    ]
    return Cell(members, cell.coupling, cell.space, name=cell.name)


def believed_poses(cell: Cell) -> tuple[np.ndarray, np.ndarray]:
    """Where each robot's tip is at t = 0: positions, (n, 3), m, and orientations, (n, 3, 3)."""
    tips = [robot.tip_pose(q[: robot.nv]) for robot, q in zip(cell.robots, cell.q0, strict=True)]
    return np.array([tip.translation for tip in tips]), np.array([tip.rotation for tip in tips])


def tared_places(believed: ArrayLike, found: ArrayLike) -> np.ndarray:
    """Places on an object after a tare: where pins are in the pose that all beliefs together fit best.

    With T_o of least sum |T_o rho_i - p_i|^2 they are T_o^-1 p_i, as far apart from each other as the pins
    are. Constant errors of the rho_i vanish but for one displacement and one turn that all of them share.

    Args:
        believed: rho_i, where each arm believes its pin on the object, (k, d), m.
        found: p_i, where the pins are at closure, (k, d), m, in any axes.

    Returns:
        Places in the object's axes, (k, d), m.

    Raises:
        InputError: numbers that are not finite, or another number of pins than of places.
    """
    rho = finite_array("believed", believed, (None, None))
    p = finite_array("found", found, rho.shape)
    middle = rho.mean(axis=0)
    U, _, V = np.linalg.svd((rho - middle).T @ (p - p.mean(axis=0)))
    sign = np.ones(len(V))
    sign[-1] = np.linalg.det(U @ V)  # a turn, not a mirror
    return middle + (p - p.mean(axis=0)) @ (U * sign @ V).T


def disagreement(cell: Cell, than: int = 0) -> np.ndarray:
    """By how much each arm believes the object elsewhere than one of them at t = 0, (n, 6).

    In world axes, m and, as a rotation vector, rad.
    """
    p, R = believed_poses(cell)
    return np.concatenate((p - p[than], log(R @ R[than].T)), axis=1)


def _holding_it_at(member: Member, xyz: np.ndarray, rotation: np.ndarray, q: np.ndarray) -> Member:
    robot = holding(member.robot, xyz, rotation, f"{member.robot.tip} tared")
    return replace(member, robot=robot, q0=q[: robot.nv])
