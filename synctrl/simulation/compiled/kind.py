"""Kind: what equal robots share in generated code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...robots.mechanism import Mechanism


@dataclass(frozen=True, eq=False)
class Kind:
    """What equal robots share; everything else is an input of the generated functions.

    Attributes:
        fixed: the mechanism.
        space: "joint", "position" or "pose".
        rows: which of x, y, z a position has.
        matrix: map from theta to inertial parameters, (10 bodies, P), or None for all of them.
        base_rotation: rotation of the first joint's placement if all robots share it, else None.
        reference_acceleration, k_r_space: options of the controller.
        smoothing: velocity at which adapted Coulomb friction reaches tanh(1), or None without it.
        rotors: whether rotors are adapted too.
    """

    fixed: Mechanism
    space: str
    rows: tuple[int, ...]
    matrix: np.ndarray | None
    base_rotation: np.ndarray | None
    gravity: tuple[float, float, float]
    reference_acceleration: str
    k_r_space: str
    smoothing: float | None = None
    rotors: bool = False

    @property
    def nv(self) -> int:
        """Number of joints."""
        return len(self.fixed.joints)

    @property
    def m(self) -> int:
        """Dimension of the task."""
        return {"joint": self.nv, "position": len(self.rows), "pose": 6}[self.space]

    @property
    def parameters(self) -> int:
        """Number of adapted parameters."""
        rub = 0 if self.smoothing is None else (2 + self.rotors) * self.nv
        return self.rigid_parameters + rub

    @property
    def rigid_parameters(self) -> int:
        """Number of adapted parameters of the rigid bodies; they come first."""
        return 10 * self.nv if self.matrix is None else self.matrix.shape[1]

    @property
    def redundant(self) -> bool:
        """Whether there are more joints than task coordinates."""
        return self.nv > self.m

    def key(self) -> list[Any]:
        """Plain data that is equal for robots of one kind."""
        shared = None if self.base_rotation is None else self.base_rotation.tolist()
        matrix = None if self.matrix is None else self.matrix.tolist()
        options: list[Any] = [self.reference_acceleration, self.k_r_space, list(self.gravity)]
        options += [self.smoothing, self.rotors]
        return [self.fixed.key(), self.space, list(self.rows), matrix, shared, options]
