"""From errors to reference motion in task space: what a law makes of what a network brings.

The paper's law over an ideal network has a way of its own while weights are constant: everything is a pair, a
quantity and its derivative, and every line then serves both at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple, Protocol, cast

import numpy as np

from ..coupling.cell import Cell, Reference
from ..coupling.coupling import Coupling
from ..errors import InputError, SynctrlError
from ..tasks.spaces import Measurement
from . import law
from .laws import Asked, BoundLaw, Errors
from .laws.sun_mills import REFERENCE_ACCELERATIONS as REFERENCE_ACCELERATIONS
from .network import BoundNetwork
from .structure import ABSENT, structured


class Command(Protocol):
    """What the law wants in task space."""

    @property
    def epsilon(self) -> np.ndarray:
        """epsilon, (p, m)."""

    @property
    def epsilon_dot(self) -> np.ndarray:
        """epsilon', (p, m)."""

    @property
    def shares(self) -> np.ndarray:
        """E, sigma, sigma', (3, n, m)."""

    @property
    def e_star(self) -> np.ndarray:
        """e*, (n, m)."""

    @property
    def u(self) -> np.ndarray:
        """u, u', (2, n, m)."""

    @property
    def xref(self) -> tuple[np.ndarray, np.ndarray]:
        """xref' and xref'', each (n, m)."""

    @property
    def force(self) -> np.ndarray:
        """The synchronizing force, (n, m)."""

    @property
    def memory_dot(self) -> np.ndarray:
        """Rate of the network's memory, of its shape."""


class Lines(NamedTuple):
    """A `Command`, as the lines of the law make it."""

    epsilon: np.ndarray
    epsilon_dot: np.ndarray
    shares: np.ndarray
    e_star: np.ndarray
    u: np.ndarray
    xref: tuple[np.ndarray, np.ndarray]
    force: np.ndarray
    memory_dot: np.ndarray


Commander = Callable[[Measurement, Reference, np.ndarray], Command]
"""Measurement, what is desired, and the memory of the network -> `Command`."""


class ConstantWeights:
    """`SunMills` over `Ideal`, for weights that do not change.

    Args:
        cell: the cell, with constant weights.
        Lambda, beta, K_eps: gains, (m,).
    """

    def __init__(self, cell: Cell, Lambda: np.ndarray, beta: np.ndarray, K_eps: np.ndarray):
        rows = (2, cell.n, cell.m)
        weights = cell.coupling.weights(np.zeros(1), cell.m)
        c, c_inv = weights.c[0], weights.c_inv[0]
        self._c, self._c_inv, self._c_single = (
            structured(c, rows), structured(c_inv, rows), structured(c, rows[1:]),
        )  # fmt: skip
        self._Lambda, self._beta = (np.broadcast_to(gain, rows).copy() for gain in (Lambda, beta))
        self._K_eps, self._coupling = np.broadcast_to(K_eps, rows[1:]).copy(), cell.coupling

    def __call__(self, task: Measurement, reference: Reference, integral: np.ndarray) -> Lines:
        return self.of(task.error, task.rates, integral)

    def of(self, error: np.ndarray, rates: np.ndarray, integral: np.ndarray) -> Lines:
        """The law for e and e', xd' and xd'', (2, n, m), and the integrals of epsilon, (p, m)."""
        c, Lambda, beta = self._c, self._Lambda, self._beta
        w = law.weighted_error(c, error)
        compared, shares = couple(self._coupling, w, integral)
        sigma = shares[1:]
        e_star = law.coupled_error(w, shares[:2], beta)
        u = law.command(c, ABSENT, rates, error, sigma, e_star, beta, Lambda)
        xref = law.reference_velocity(self._c_inv, u)
        force = law.synchronizing_force(self._c_single, sigma[0], self._K_eps)
        return Lines(compared[0], compared[1], shares, e_star[0], u, (xref[0], xref[1]), force, compared[0])


class Composed:
    """Any law over any network, for weights of any kind.

    Args:
        law, network: for the robots of one cell.
    """

    def __init__(self, law: BoundLaw, network: BoundNetwork):
        self.law, self.network = law, network

    def __call__(self, task: Measurement, reference: Reference, memory: np.ndarray) -> Lines:
        c, c_dot, c_ddot, c_inv = reference.weights
        (e, e_dot), (xd_dot, xd_ddot) = task.error, task.rates
        w, w_dot = sent = weighted(task, reference)
        heard = self.network.exchange(reference.t, sent, memory)
        E, sigma, sigma_dot = heard.shares
        errors = Errors(
            reference.t, e, e_dot, task.x_dot, xd_dot, xd_ddot, w, w_dot, E, sigma, sigma_dot,
            c, c_dot, c_ddot, c_inv,
        )  # fmt: skip
        asked = completed(self.law.command(errors), errors)
        xref = asked.xref_dot, asked.xref_ddot
        return Lines(
            heard.epsilon, heard.epsilon_dot, heard.shares, cast(np.ndarray, asked.e_star),
            cast(np.ndarray, asked.u), xref, asked.force, heard.memory_dot,
        )  # fmt: skip

    def check(self, n: int, p: int, m: int) -> None:
        """Look once at what law and network give, before anything runs.

        Raises:
            InputError: something of another shape than it should have, or one that fails where there are no
                errors.
        """
        with _named("network", self.network):
            memory = self.network.start()
            integral = self.network.integral(memory)
            heard = self.network.exchange(0.0, np.zeros((2, n, m)), memory)
        with _named("law", self.law):
            asked = self.law.command(no_errors(n, m))
        _check_shapes("network", self.network, {
            "epsilon": (heard.epsilon, (p, m)), "epsilon_dot": (heard.epsilon_dot, (p, m)),
            "shares": (heard.shares, (3, n, m)), "memory_dot": (heard.memory_dot, np.shape(memory)),
            "integral": (integral, (p, m)),
        })  # fmt: skip
        _check_shapes("law", self.law, {
            "xref_dot": (asked.xref_dot, (n, m)), "xref_ddot": (asked.xref_ddot, (n, m)),
            "force": (asked.force, (n, m)),
        })  # fmt: skip


def weighted(task: Measurement, reference: Reference) -> np.ndarray:
    """What robots know of themselves and send: weighted errors c e and their rates, (2, n, m)."""
    (c, c_dot, _, _), (e, e_dot) = reference.weights, task.error
    return np.stack((law.weighted_error(c, e), law.weighted_error_dot(c, c_dot, e, e_dot)))


def no_errors(n: int, m: int) -> Errors:
    """Errors that are all zero, under weights of one."""
    o, one, zero = np.zeros((n, m)), np.broadcast_to(np.eye(m), (n, m, m)), np.zeros((n, m, m))
    return Errors(0.0, o, o, o, o, o, o, o, o, o, o, one, zero, zero, one)


def completed(asked: Asked, errors: Errors) -> Asked:
    """What a law asks for, with w for e*, and c xref' and its rate for u, where it does not say."""
    if asked.e_star is None:
        asked = asked._replace(e_star=errors.w)
    if asked.u is None:
        u = law.times(errors.c, asked.xref_dot)
        u_dot = law.times(errors.c, asked.xref_ddot) + law.times(errors.c_dot, asked.xref_dot)
        asked = asked._replace(u=np.stack((u, u_dot)))
    return asked


@contextmanager
def _named(role: str, part: Any) -> Iterator[None]:
    """Name the part that fails in between."""
    try:
        yield
    except SynctrlError:
        raise
    except Exception as error:  # whatever a user's code raises
        raise InputError(
            f"{role} {type(part).__qualname__}: expected one that works where there are no errors, found "
            f"{type(error).__name__}: {error}"
        ) from error


def _check_shapes(role: str, part: Any, parts: Mapping[str, tuple[Any, tuple[int, ...]]]) -> None:
    for name, (value, shape) in parts.items():
        if np.shape(value) != shape:
            raise InputError(
                f"{role} {type(part).__qualname__}, {name}: expected an array of shape {shape}, found "
                f"{np.shape(value)}"
            )


def couple(coupling: Coupling, w: np.ndarray, integral: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """epsilon and epsilon', (2, p, m), of w and w'; then E, sigma and sigma', (3, n, m)."""
    compared = coupling.compare(w)
    return compared, coupling.distribute(np.concatenate((integral[None], compared)))
