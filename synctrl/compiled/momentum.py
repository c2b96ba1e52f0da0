"""The torque of what is adapted, and the regressors of momentum, with symbols; see `robots/momentum.py`."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from ..robots.lumped import Body, lumped_bodies, lumping
from ..robots.mechanism import Mechanism
from ..robots.parameters import friction_diagonals
from ..robots.symbolic import Symbols
from .algebra import array_of, column_of

#: relative size below which a sum of numbers that cancel is zero
ROUNDING = 1e-15


class Model(Protocol):
    """What a `Kind` of robots says of the torque of what is adapted."""

    @property
    def fixed(self) -> Mechanism: ...
    @property
    def matrix(self) -> np.ndarray | None: ...
    @property
    def gravity(self) -> tuple[float, ...]: ...
    @property
    def smoothing(self) -> float | None: ...
    @property
    def rotors(self) -> bool: ...
    @property
    def nv(self) -> int: ...
    @property
    def rigid_parameters(self) -> int: ...
    @property
    def sizes(self) -> dict[str, int]: ...


def model_torque(
    kind: Model, recursion: Symbols, theta: Any, v: Any, v_ref: Any, a_ref: Any, gravity: Any
) -> Any:
    """Y theta, (nv, 1).

    Args:
        kind: of the robot.
        recursion: at its joint positions.
        theta: what is adapted, (P, 1).
        v, v_ref, a_ref: (nv, 1).
        gravity: in the frame of the first joint's placement, (3, 1).
    """
    bodies = _bodies(kind, theta[: kind.rigid_parameters])
    torque = recursion.torque(bodies, v, v_ref, a_ref, gravity)
    if kind.smoothing is not None:
        rubbing = array_of(theta[kind.rigid_parameters :], -1, kind.nv)
        v, v_ref, a_ref = (array_of(part, -1) for part in (v, v_ref, a_ref))
        diagonals = friction_diagonals(v, v_ref, a_ref, kind.smoothing, kind.rotors)
        torque += column_of(sum(rubbing * np.stack(diagonals)))
    return torque


def momentum_function(kind: Model, base_rotation: np.ndarray) -> Any:
    """CasADi function, q, v -> Y_p, Y_h, (nv, P) each.

    p = M v is the torque that v takes as an acceleration, and p' = tau - (C v + g + friction - M' v).

    Args:
        kind: of the robot.
        base_rotation: of the placement of its first joint.
    """
    import casadi as ca

    q, v = ca.SX.sym("q", kind.nv), ca.SX.sym("v", kind.nv)
    theta = ca.SX.sym("theta", kind.sizes["P"])
    still, recursion = ca.SX.zeros(kind.nv), Symbols(kind.fixed, q, ca.sin(q), ca.cos(q))
    gravity = ca.SX(ca.DM(base_rotation.T @ np.array(kind.gravity)))
    p = model_torque(kind, recursion, theta, still, still, v, ca.SX.zeros(3))
    changing = model_torque(kind, recursion, theta, v, v, still, gravity) - ca.jtimes(p, q, v)
    found = [ca.densify(ca.jacobian(part, theta)) for part in (p, changing)]
    return ca.Function("momentum", [q, v], ca.cse(found))


def _bodies(kind: Model, rigid: Any) -> list[Body]:
    """Bodies, lumped, of the adapted parameters of the rigid bodies; a map of these is lumped in numbers."""
    import casadi as ca

    if kind.matrix is None:
        return lumped_bodies(kind.fixed, rigid)
    lumps = lumping(kind.fixed)
    together = lumps.matrix @ kind.matrix
    rounding = np.abs(together) <= ROUNDING * (np.abs(lumps.matrix) @ np.abs(kind.matrix))
    numbers = ca.sparsify(ca.DM(np.where(rounding, 0.0, together)))
    return lumps.bodies(ca.densify(ca.mtimes(ca.SX(numbers), rigid)))
