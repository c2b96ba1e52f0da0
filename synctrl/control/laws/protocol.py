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
from ..gains import Gains


@dataclass(slots=True)
class Errors:
    """What a law sees at one instant, one row per robot.

    Attributes:
        t: the instant, s; not in generated code.
        e, e_dot: tracking errors and their rates, (n, m), task unit and task unit per s.
        x_dot: measured velocities, (n, m).
        xd_dot, xd_ddot: desired velocities and accelerations, (n, m).
        w, w_dot: weighted errors c e and their rates, (n, m).
        E, sigma, sigma_dot: what the network told, (n, m): S^T times the integrals of epsilon, epsilon
            itself and its rate.
        c, c_dot, c_ddot, c_inv: weights, (n, m, m).
    """

    t: Any
    e: np.ndarray
    e_dot: np.ndarray
    x_dot: np.ndarray
    xd_dot: np.ndarray
    xd_ddot: np.ndarray
    w: np.ndarray
    w_dot: np.ndarray
    E: np.ndarray
    sigma: np.ndarray
    sigma_dot: np.ndarray
    c: np.ndarray
    c_dot: np.ndarray
    c_ddot: np.ndarray
    c_inv: np.ndarray


class Asked(NamedTuple):
    """What a law asks for, one row per robot.

    Attributes:
        xref_dot, xref_ddot: reference velocity and acceleration, (n, m), task unit per s and s^2.
        force: in task space, (n, m), N, or N·m in joint space.
        e_star: coupled errors, (n, m), for the log; by default w.
        u: command and its rate, (2, n, m); by default c xref' and c xref'' + c' xref'.
    """

    xref_dot: np.ndarray
    xref_ddot: np.ndarray
    force: np.ndarray
    e_star: np.ndarray | None = None
    u: np.ndarray | None = None


@dataclass(slots=True)
class Along:
    """What a law's proof is asked about: signals at T instants.

    Attributes:
        epsilon, epsilon_dot: synchronization errors and their rates, (T, p, m).
        E, sigma, sigma_dot: what the network told, (T, n, m).
        e_star, r: coupled errors and coupled velocity errors, (T, n, m).
        c: weights, (T, n, m, m).
    """

    epsilon: np.ndarray
    epsilon_dot: np.ndarray
    E: np.ndarray
    sigma: np.ndarray
    sigma_dot: np.ndarray
    e_star: np.ndarray
    r: np.ndarray
    c: np.ndarray


class Proof(NamedTuple):
    """A law's part in V and V', by name, each (T, rows, m), to be summed over rows and axes.

    Attributes:
        energies: terms of V beside the kinetic energy and the storage of the adaptation, N·m, not below 0.
        rates: their time derivatives by the chain rule, N·m/s, under the same names.
        powers: the terms of V' that remain of them, N·m/s, not above 0.
    """

    energies: Mapping[str, np.ndarray]
    rates: Mapping[str, np.ndarray]
    powers: Mapping[str, np.ndarray]


class BoundLaw(Protocol):
    """A law for the robots of one cell. It may also have a method `proof`, from `Along` to `Proof`."""

    def command(self, errors: Errors) -> Asked:
        """What the law asks for.

        Where it is to be compiled, it is plain array arithmetic, robot by robot; `np.matvec` takes symbols,
        `np.vecmat` does not.
        """


class Law(Protocol):
    """A law, before it knows the cell."""

    def bind(self, cell: Cell, gains: Gains) -> BoundLaw:
        """This law for a cell.

        Raises:
            InputError: gains that do not fit, named.
        """

    def as_dict(self) -> dict[str, Any]:
        """Name and settings as plain data."""
