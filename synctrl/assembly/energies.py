"""Energies and powers of a closed chain with fixtures that give, beside those of arms that move alone.

V' gains sum_i (J_i s_i)^T lambda_i, see `theorems.py`. With s_o, the velocity error of the object itself, it
is divided into

    fixtures = sum_i (J_i s_i - s_o)^T G_i h_i,    object = what is left: it does not move as the hands do.

To the first order J_i s_i - s_o = -d_i' - (A d)_i + (Lambda - l) beta E_i + y_i' + (A yt)_i, where
A = Lambda + beta L, L = c^-1 S^T S c with weights of 1 or -1, d_i is the deflection of fixture i, and yt_i
what arm i gives way by, less what it is wrong by about the object. So V has the energies

    W = 1/2 d^T K d + d^T D (1/2 A d - (Lambda - l) beta E) + 1/2 (Lambda - l) beta E^T L^+ (K + l D) E
    U = 1/2 y'^T M_a y' + y'^T M_a A yt + 1/2 yt^T D_a A yt

and loses beside what fixtures damp -y'^T (D_a - M_a A) y'. K and D act at the grasps, to which d and E are
carried. The rates of W and U are theirs by the chain rule, so all names together are V' whatever orders were
left out.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..control.controller import Controller, Signals
from ..robots.forest import forests
from ..tasks.rotations import exp, left_jacobian_inverse, log
from .body import place_of
from .grasp import grasp_matrix
from .tare import believed_poses


class Terms(NamedTuple):
    """A closed chain's part in V and V' at one instant: energies, N·m, their rates and powers, N·m/s."""

    energies: dict[str, float]
    rates: dict[str, float]
    powers: dict[str, float]


class Energies:
    """`Terms` of the states of a cell.

    Args:
        plant: arms, fixtures and object.
        controller: the controller of the arms, in pose space.
    """

    def __init__(self, plant: Any, controller: Controller):
        self._plant, self._controller = plant, controller
        cell, (p, R) = controller.cell, place_of(plant.hidden0[:7])
        c, S = cell.references(np.zeros(1))[0].c, cell.coupling.matrix
        self._c, self._L, self._L_plus = c, S.T @ S, np.linalg.pinv(S.T @ S)
        places, turns = believed_poses(cell)
        self._believed = (places - p) @ R, R.T @ turns  # the object in its own axes, as each arm believes it
        self._bodies = [forests(robots) for robots in (cell.robots, plant.schedule.free)]

    def terms(self, y: Any, v_dot: np.ndarray, signals: Signals) -> Terms:
        """The closed chain's part in V and V'.

        Args:
            y: state of the closed loop.
            v_dot: accelerations of the joints, (n, nv), rad/s^2.
            signals: what the controller computed.
        """
        W, W_dot = self._springs(y, signals)
        U, U_dot, lost = self._admittance(y, signals)
        fixtures, total = self._powers(y, v_dot, signals)
        giving = {} if self._controller.admittance is None else {"admittance": (U, U_dot, lost)}
        powers = {"fixtures": fixtures + W_dot + U_dot - lost, "object": total - fixtures}
        return Terms(
            {"fixtures": W, **{name: part[0] for name, part in giving.items()}},
            {"fixtures": W_dot, **{name: part[1] for name, part in giving.items()}},
            {**powers, **{name: part[2] for name, part in giving.items()}},
        )

    # -- internals ----------------------------------------------------------------------------------------

    def _powers(self, y: Any, v_dot: np.ndarray, signals: Signals) -> tuple[float, float]:
        """Power of the fixtures, and of all that the arms' model does not have."""
        plant, controller = self._plant, self._controller
        wrenches, back, J = plant._wrenches(y.q, y.v, y.hidden)
        (p, R), nu = place_of(y.hidden[:7]), y.hidden[7:13]
        load = np.matvec(grasp_matrix(plant._levers(y.hidden)), wrenches).sum(axis=0)
        e, _, left = _errors(signals.reference.desired[:, 0], p, R, nu)
        coordinates = controller.Lambda * e
        coordinates[:3] += signals.reference.xd_dot[0, :3]
        coordinates[3:] = np.linalg.solve(left.T, coordinates[3:] + left @ signals.reference.xd_dot[0, 3:])
        pulled = np.zeros_like(y.q)
        pulled[plant._hands] += np.vecmat(back, J)
        into = -float(np.sum(signals.s_q * pulled))
        shares = self._shares(y.q, y.v, v_dot)
        return into - float((coordinates - nu) @ load), into - float(np.sum(signals.s_q * shares))

    def _shares(self, q: np.ndarray, v: np.ndarray, v_dot: np.ndarray) -> np.ndarray:
        """Torque that the shares of the object would need, (n, nv)."""
        torque = np.zeros((2, *q.shape))
        for row, bodies in zip(torque, self._bodies, strict=True):
            for rows, forest in bodies:
                k = forest.nv
                row[rows, :k] = forest.torque(*(x[rows, :k] for x in (q, v, v, v_dot)))
        return torque[0] - torque[1]

    def _springs(self, y: Any, signals: Signals) -> tuple[float, float]:
        """W and its rate."""
        plant, controller = self._plant, self._controller
        hands, leak = plant._hands, controller.leak
        K, D, rest = plant.K, plant.D, (controller.Lambda - leak) * controller.beta
        E = self._unweighted(np.stack((signals.E, signals.sigma - leak * signals.E)))
        d = self._deflections(y, signals)
        levers, w = plant._levers(y.hidden), y.hidden[10:13]

        def carried(x: np.ndarray) -> np.ndarray:
            """Rows of the arms and their rates, (2, n, 6), at the grasps, (2, k, 6)."""
            at = x[:, hands]
            moved = np.vecmat(at, grasp_matrix(levers))
            moved[1, :, :3] += np.cross(at[0, :, 3:], np.cross(w, levers))
            return moved

        d_g, b_g = carried(d), carried(0.5 * self._A(d) - rest * E)
        E_g, F_g = carried(E), carried(rest * self._among(self._L_plus, E))
        pairs = (0.5 * K * d_g, d_g), (D * d_g, b_g), (0.5 * (K + leak * D) * E_g, F_g)
        return (
            float(sum(np.sum(a[0] * b[0]) for a, b in pairs)),
            float(sum(np.sum(a[1] * b[0] + a[0] * b[1]) for a, b in pairs)),
        )

    def _admittance(self, y: Any, signals: Signals) -> tuple[float, float, float]:
        """U, its rate, and the power that is lost; zeros without an admittance."""
        giving = self._controller.admittance
        if giving is None:
            return 0.0, 0.0, 0.0
        gave, rate = giving.given_way(y.z), giving.given_way(signals.z_dot)
        M, D, y_dot, y_ddot = giving.mass, giving.damping, rate[0], rate[1]
        places, turns = self._believed
        tilde = gave[0] - np.concatenate((places, log(turns)), axis=1)
        A_tilde, A_dot = self._A(tilde), self._A(y_dot)
        U = 0.5 * M * y_dot * y_dot + M * y_dot * A_tilde + 0.5 * D * tilde * A_tilde
        U_dot = M * (y_dot * y_ddot + y_ddot * A_tilde + y_dot * A_dot) + D * tilde * A_dot
        lost = np.where(M > 0, y_dot * (M * A_dot - D * y_dot), 0.0)
        return float(np.sum(U)), float(np.sum(U_dot)), float(np.sum(lost))

    def _A(self, x: np.ndarray) -> np.ndarray:  # noqa: N802
        """(Lambda + beta L) x."""
        return self._controller.Lambda * x + self._controller.beta * self._among(self._L, x)

    def _among(self, L: np.ndarray, x: np.ndarray) -> np.ndarray:
        """c^-1 L c x, for L between robots and one row of x, (..., n, 6), per robot."""
        return self._unweighted(L @ np.matvec(self._c, x))

    def _unweighted(self, w: np.ndarray) -> np.ndarray:
        return np.linalg.solve(self._c, w[..., None])[..., 0]

    def _deflections(self, y: Any, signals: Signals) -> np.ndarray:
        """d and d', (2, n, 6): errors of the object, as each arm believes it, less those of the arm."""
        (p, R), nu, desired = place_of(y.hidden[:7]), y.hidden[7:13], signals.reference.desired
        arms = self._controller.cell.task.measure(y.motion, desired).error
        places, turns = self._believed
        found = np.zeros_like(arms)
        for i, (xyz, turn) in enumerate(zip(places, turns, strict=True)):
            lever = R @ xyz
            twist = np.concatenate((nu[:3] + np.cross(nu[3:], lever), nu[3:]))
            found[:, i] = _errors(desired[:, i], p + lever, R @ turn, twist)[:2]
        held = np.zeros(len(places))
        held[self._plant._hands] = 1.0
        return (found - arms) * held[:, None]


def _errors(
    desired: np.ndarray, p: np.ndarray, R: np.ndarray, nu: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """e and e' of a body at p, R with the twist nu, as `PoseSpace` has them, (6,) each, and Jl^-1(e_o)."""
    xd, xd_dot, _ = desired
    e = np.concatenate((xd[:3] - p, log(exp(xd[3:]) @ R.T)))
    left = left_jacobian_inverse(e[3:])
    turning = left @ xd_dot[3:] - left.T @ nu[3:]
    return e, np.concatenate((xd_dot[:3] - nu[:3], turning)), left
