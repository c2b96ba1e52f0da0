"""Law: what a robot does about its errors and those of its neighbours, in task space.

The controller adds the model and the damping: whatever law asks for a reference velocity xref' with its
derivative xref'' and for a force f, the torque is

    tau = Y theta_hat + K_r term + J^T f.

With r = c (xref' - x') the proof needs of the law nothing but energies, of what it knows, with

    sum of their rates = sum_i r_i^T c_i^-T f_i + named powers,

because -r^T c^-T f is what the force does to the kinetic energy. A law of one's own is a class with a `bind`
that returns an object with a `command`; nothing else has to be touched. Without a `proof` its runs are
outside the theorem, and certificates say so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ...coupling.cell import Cell
from ...coupling.weights import Weights
from ..gains import Gains


@dataclass(slots=True)
class Errors:
    """What a law sees at one instant, one row per robot; quantities with their derivatives are pairs.

    Attributes:
        t: the instant, s; not in generated code.
        error: tracking errors e and their rates e', (2, n, m), task unit and task unit per s.
        x_dot: measured velocities, (n, m).
        rates: desired velocities xd' and accelerations xd'', (2, n, m).
        weighted: weighted errors w = c e and their rates w', (2, n, m).
        shares: what the network told, (3, n, m): E, sigma and sigma', which are S^T times the integrals of
            epsilon, epsilon itself and its rate.
        weights: c, c', c'' and c^-1, (n, m, m) each.
        slips: what the network told of the r of others, (2, n, m), to a law that `needs_slips`; see
            `Received`.

    The same, each (n, m), is called e, e_dot, xd_dot, xd_ddot, w, w_dot, E, sigma and sigma_dot; and the
    weights c, c_dot, c_ddot and c_inv.
    """

    t: Any
    error: np.ndarray
    x_dot: np.ndarray
    rates: np.ndarray
    weighted: np.ndarray
    shares: np.ndarray
    weights: Weights
    slips: Any = None

    e = property(lambda self: self.error[0])
    e_dot = property(lambda self: self.error[1])
    xd_dot = property(lambda self: self.rates[0])
    xd_ddot = property(lambda self: self.rates[1])
    w = property(lambda self: self.weighted[0])
    w_dot = property(lambda self: self.weighted[1])
    E = property(lambda self: self.shares[0])
    sigma = property(lambda self: self.shares[1])
    sigma_dot = property(lambda self: self.shares[2])
    c = property(lambda self: self.weights.c)
    c_dot = property(lambda self: self.weights.c_dot)
    c_ddot = property(lambda self: self.weights.c_ddot)
    c_inv = property(lambda self: self.weights.c_inv)

    @classmethod
    def from_rows(cls, t: Any = None, **rows: np.ndarray) -> Errors:
        """Errors of the rows e, e_dot, x_dot, ..., (n, m) each, and the weights, (n, m, m) each, by name."""

        def together(*names: str) -> np.ndarray:
            return np.array([rows[name] for name in names])

        return cls(
            t, together("e", "e_dot"), rows["x_dot"], together("xd_dot", "xd_ddot"), together("w", "w_dot"),
            together("E", "sigma", "sigma_dot"), Weights(*(rows[name] for name in WEIGHTS)),
        )  # fmt: skip


#: name of the power of diffusive coupling: not above 0 only where robots hear each other at once
DIFFUSION = "diffusion"
#: what is in `Errors`: rows, (n, m) each, and weights, (n, m, m) each
ROWS = ("e", "e_dot", "x_dot", "xd_dot", "xd_ddot", "w", "w_dot", "E", "sigma", "sigma_dot")
WEIGHTS = ("c", "c_dot", "c_ddot", "c_inv")


class Asked(NamedTuple):
    """What a law asks of the robots in task space; `law.compute_joint_command` makes torques of it.

    There is one row per robot.

    Attributes:
        xref_dot, xref_ddot: reference velocity and acceleration, (n, m), task unit per s and s^2.
        force: in task space, (n, m), N, or N·m in joint space.
        e_star: coupled errors, (n, m), for the log; by default w.
        u: command and its rate, (2, n, m); by default c xref' and c xref'' + c' xref'.
    """

    xref_dot: np.ndarray
    xref_ddot: np.ndarray
    force: np.ndarray
    e_star: Any = None
    u: Any = None


def no_errors(n: int, m: int) -> Errors:
    """Errors that are all zero, under weights of one."""
    none, one, zero = np.zeros((3, n, m)), np.broadcast_to(np.eye(m), (n, m, m)), np.zeros((n, m, m))
    weights = Weights(one, zero, zero, one)
    return Errors(0.0, none[:2], none[0], none[:2], none[:2], none, weights, none[:2])


def completed(asked: Asked, errors: Errors) -> Asked:
    """What a law asks for, with w for e*, and c xref' and its rate for u, where it does not say."""
    if asked.e_star is None:
        asked = asked._replace(e_star=errors.w)
    if asked.u is None:
        u = np.matvec(errors.c, asked.xref_dot)
        u_dot = np.matvec(errors.c, asked.xref_ddot) + np.matvec(errors.c_dot, asked.xref_dot)
        asked = asked._replace(u=np.stack((u, u_dot)))
    return asked


@dataclass(slots=True)
class Along:
    """What a law's proof is asked about: signals at T instants.

    Attributes:
        epsilon, epsilon_dot: synchronization errors and their rates, (T, p, m).
        E, sigma, sigma_dot: what the network told, (T, n, m).
        e_star, r: coupled errors and coupled velocity errors, (T, n, m).
        c: weights, (T, n, m, m).
        slips: what the network told of the r of others, (T, 2, n, m), if it did.
    """

    epsilon: np.ndarray
    epsilon_dot: np.ndarray
    E: np.ndarray
    sigma: np.ndarray
    sigma_dot: np.ndarray
    e_star: np.ndarray
    r: np.ndarray
    c: np.ndarray
    slips: Any = None


class Proof(NamedTuple):
    """A law's part in V and V', by name, each (T, rows, m), to be summed over rows and axes.

    Attributes:
        energies: terms of V beside the kinetic energy and the storage of the adaptation, N·m, not below 0.
        rates: their time derivatives by the chain rule, N·m/s, under the same names; sigma stands in them
            where E' is, and nowhere else.
        powers: the terms of V' that remain of them, N·m/s, not above 0; but for `DIFFUSION`.
    """

    energies: Mapping[str, np.ndarray]
    rates: Mapping[str, np.ndarray]
    powers: Mapping[str, np.ndarray]


class BoundLaw(Protocol):
    """A law for the robots of one cell.

    It may also have a method `proof`, from `Along` to `Proof`, and a `statement`, when it converges. One that
    has `needs_slips` wants to be told the r of others, which not every network does.
    """

    def command(self, errors: Errors) -> Asked:
        """What the law asks for.

        Where it is to be compiled, it is plain array arithmetic, robot by robot; `np.matvec` takes symbols,
        `np.vecmat` does not.
        """


class Law(Protocol):
    """A law, before it knows the cell.

    One that is `independent` has no place for the gains beta and K_eps; ready cells then leave theirs out.
    For comparisons it may name its `free_gain`, with `scaled(factor)`, itself with that gain multiplied. One
    whose `adaptive` is False is compared, and put into ready cells, without adaptation.
    """

    def bind(self, cell: Cell, gains: Gains) -> BoundLaw:
        """This law for a cell.

        Raises:
            InputError: gains that do not fit, named.
        """

    def as_dict(self) -> dict[str, Any]:
        """Name and settings as plain data."""
