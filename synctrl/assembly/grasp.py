"""Grasps: which hand holds an object where, and how the fixture between them gives.

A fixture is a spring and a damper between the hand and its place on the object, the same in all directions
(else there is no potential). With the hand at p_h, R_h and its place on the object at p_g, R_g,

    d = (p_h - p_g, log(R_h R_g^T)),   d' = (v_h + w_h x (p_g - p_h) - v_g, w_h - w_o)
    f = K_t d_t + D_t d_t',   n = K_r d_r + D_r d_r'

acts on the object at p_g, and (-f, -n - (p_g - p_h) x f) on the hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..checks import count, finite_array, instance, rotation_matrix
from ..errors import InputError
from ..tasks.rotations import log, skew
from .body import place_of


@dataclass(frozen=True, eq=False)
class Fixture:
    """A fixture that gives a little.

    Args:
        stiffness: against displacement, N/m, and against turning, N·m/rad.
        damping: the same, N·s/m and N·m·s/rad.

    Raises:
        InputError: not two numbers each, or not above 0.
    """

    stiffness: Any = (1e5, 1e3)
    damping: Any = (500.0, 3.0)

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping"):
            pair = finite_array(f"fixture, {name}", getattr(self, name), (2,))
            if pair.min() <= 0:
                raise InputError.expected("two numbers above 0", pair, f"fixture, {name}")
            object.__setattr__(self, name, pair)

    @property
    def K(self) -> np.ndarray:  # noqa: N802
        """Stiffness of the six directions, (6,)."""
        return np.repeat(self.stiffness, 3)

    @property
    def D(self) -> np.ndarray:  # noqa: N802
        """Damping of the six directions, (6,)."""
        return np.repeat(self.damping, 3)

    def as_dict(self) -> dict[str, Any]:
        """Its settings as plain data."""
        return {"stiffness": self.stiffness.tolist(), "damping": self.damping.tolist()}


@dataclass(frozen=True, eq=False)
class Grasp:
    """A hand that holds an object.

    Args:
        robot: index of the robot whose tip is the hand, counted from 0.
        xyz: where the hand holds it, in the object's axes, (3,), m.
        rotation: orientation of the hand in the object's axes, (3, 3); by default that of the object.
        compliance: the fixture between them.

    Raises:
        InputError: an index below 0, no place, or no rotation matrix.
    """

    robot: int
    xyz: Any = (0.0, 0.0, 0.0)
    rotation: Any = None
    compliance: Fixture = field(default_factory=Fixture)

    def __post_init__(self) -> None:
        count("grasp, robot", self.robot, 0)
        instance("grasp, compliance", self.compliance, Fixture, "a Fixture")
        object.__setattr__(self, "xyz", finite_array("grasp, xyz", self.xyz, (3,)))
        R = rotation_matrix("grasp, rotation", np.eye(3) if self.rotation is None else self.rotation)
        object.__setattr__(self, "rotation", R)

    @property
    def object_in_hand(self) -> tuple[np.ndarray, np.ndarray]:
        """Place, (3,), and orientation, (3, 3), of the object in the hand's axes."""
        return -self.rotation.T @ self.xyz, self.rotation.T


def places_on(
    state: np.ndarray, arms: np.ndarray, turned: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Position, (k, 3), orientation, (k, 3, 3), and twist, (k, 6), of places on an object, and their levers.

    Args:
        state: pose and twist of the object, (13,).
        arms, turned: where the places are in the object's axes, (k, 3) and (k, 3, 3).
    """
    (p, R), nu = place_of(state[:7]), state[7:]
    levers = arms @ R.T
    nu_g = np.tile(nu, (len(levers), 1))
    nu_g[:, :3] += levers @ skew(nu[3:]).T
    return p + levers, R @ turned, nu_g, levers


def fixture_wrenches(
    hands: Sequence[np.ndarray],
    places: Sequence[np.ndarray],
    K: np.ndarray,
    D: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """What fixtures do to the object and to the hands, both (..., k, 6), at p_g and at p_h.

    Args:
        hands: position, (..., k, 3), orientation, (..., k, 3, 3), and twist, (..., k, 6), of the hands.
        places: the same of their places on the object.
        K, D: stiffness and damping of the six directions, (k, 6).
    """
    (p_h, R_h, nu_h), (p_g, R_g, nu_g) = hands, places
    lever = p_g - p_h
    d = np.concatenate((-lever, log(R_h @ R_g.mT)), axis=-1)
    moved = nu_h - nu_g
    moved[..., :3] += np.matvec(skew(nu_h[..., 3:]), lever)
    wrench = K * d + D * moved
    back = -wrench
    back[..., 3:] -= np.matvec(skew(lever), wrench[..., :3])
    return wrench, back


def grasp_matrix(arms: np.ndarray) -> np.ndarray:
    """G_i, (..., k, 6, 6), which makes wrenches at r_i, (..., k, 3), wrenches about the object's origin."""
    G = np.tile(np.eye(6, dtype=np.result_type(arms, float)), (*arms.shape[:-1], 1, 1))
    G[..., 3:, :3] = skew(arms)
    return G
