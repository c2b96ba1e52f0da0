"""What a tube begins with, known of a cell before a run: V(0) and w(0); and what a tube is not about."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..control.controller import Controller
from ..coupling.cell import Cell, Reference
from ..errors import InputError
from .base_storage import BaseStorage, base_storages
from .jumps import desired_jumps

#: instants at which a tube is computed where nobody says which
INSTANTS = 201
#: share of the errors of parameters up to which what is never learned counts as rounding
FROZEN = 1e-9


def start(controller: Controller, reference: Reference) -> tuple[dict[str, float], np.ndarray]:
    """Terms of V(0) by name, with base parameters, N·m if weights have no unit, and w(0), (n, m).

    Args:
        controller: one with the paper's law and adaptation.
        reference: what is desired at t = 0.

    Raises:
        InputError: an error of parameters that is never learned.
        RobotError: the rank of a regressor is not clear.
    """
    cell, adaptation = controller.cell, controller.adaptation
    motion = np.stack((cell.q0, cell.v0))
    signals = controller.signals(reference, motion, adaptation.start(), controller.network.start())
    tilde, kinetic, parameter = cell.theta - signals.theta_hat, 0.0, 0.0
    for i, base in enumerate(base_storages(cell, adaptation.Gamma)):  # type: ignore[attr-defined]
        _check_learned(cell.names[i], base, tilde[i])
        robot, nv = cell.robots[i], cell.robots[i].nv
        s_q = signals.s_q[i, :nv]
        kinetic += float(0.5 * s_q @ robot.mass_matrix(cell.q0[i, :nv]) @ s_q)
        parameter += float(base.energy(tilde[i]))
    springs = float(0.5 * np.sum(controller.K_eps * signals.epsilon**2))
    energy = {"kinetic": kinetic, "parameter": parameter, "synchronization": springs}
    return energy, signals.errors.weighted[0]


def _check_learned(name: str, base: BaseStorage, tilde: np.ndarray) -> None:
    """Refuse an error of parameters that stays whatever happens: its torque has no bound before a run."""
    stays, errors = base.frozen(tilde), base.errors(tilde)
    if np.abs(stays).max(initial=0.0) > FROZEN * np.abs(errors).max(initial=0.0):
        found = float(np.abs(stays).max())
        wanted = "rates with which every base parameter that is not known can be learned"
        shown = f"one of {name} that stays off by {found:.3g}"
        raise InputError.expected(wanted, found, "Gamma", shown=shown)


def check_motions(cell: Cell, end: float) -> None:
    """Refuse a desired motion that jumps, or whose velocity does, until the end, s: V jumps with it.

    Raises:
        InputError: with robot and time.
    """
    for i, what, size, time in desired_jumps(cell, end):
        wanted = f"a desired {what} without jumps, at each of which V jumps too"
        shown = f"one of {size:.3g} at t = {time:g} s"
        raise InputError.expected(wanted, size, f"{cell.names[i]}, trajectory", shown=shown)


def read_instants(times: ArrayLike | None, end: float) -> np.ndarray:
    """Instants of a tube, (T,), s, by default `INSTANTS` of them from 0 to the end.

    Raises:
        InputError: none, not in order, or some that are outside.
    """
    if times is None:
        return np.linspace(0.0, end, INSTANTS)
    found = finite_array("times", times, (None,))
    if not found.size or found[0] < 0 or found[-1] > end * (1 + 1e-9) or (np.diff(found) < 0).any():
        shown = f"{found[0]:g} to {found[-1]:g} s" if found.size else "none"
        raise InputError.expected(f"ascending instants from 0 to {end:g} s", found, "times", shown=shown)
    return found
