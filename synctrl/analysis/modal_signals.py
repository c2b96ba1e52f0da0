"""The coupled velocity error of a run as it truly was, and what drove it.

r = w' + Lambda w + beta sigma + (Lambda - l) beta E is taken here of the sigma and E that were true. Robots
of a network that is not ideal, under sampled control, or with sensors, were told others: then r is not the
one of which the law made its torque, and c J s_q is not r. What is between the two is measured.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from .lyapunov import is_ideal
from .replay import Replay

#: share of the magnitude of u that r may be off by rounding
ROUNDING = 1e-9


class RunSignals(NamedTuple):
    """What a run had at R rows, see `Replay`, one row per robot.

    Attributes:
        w: weighted errors, (R, n, m).
        E: S^T times the true integrals of epsilon, (R, n, m).
        r: coupled velocity errors of true sigma and E, (R, n, m).
        driven: c J s_q, (R, n, m), which r is in the theorem.
        reason: why it is not, in words, or None.
    """

    w: np.ndarray
    E: np.ndarray
    r: np.ndarray
    driven: np.ndarray
    reason: str | None


def run_signals(run: Replay) -> RunSignals:
    """Weighted errors, integrals and coupled velocity errors along a run.

    Raises:
        InputError: an event moves positions, so that w jumps.
    """
    x, coupling, controller = run.rows, run.loop.cell.coupling, run.loop.controller
    w, w_dot = x.weighted.swapaxes(0, 1)
    _check_continuous(run, w, w_dot)
    sigma, sigma_dot = (coupling.distribute(coupling.compare(rows)) for rows in (w, w_dot))
    at_once = controller.Lambda * w + w_dot
    spring = (controller.Lambda - controller.leak) * controller.beta
    E = x.E if _told_all(run) else true_integral(run, sigma, sigma_dot)
    told = at_once + controller.beta * x.sigma + spring * x.E
    r = at_once + controller.beta * sigma + spring * E
    driven = np.matvec(x.c, np.matvec(x.J, x.s_q))
    return RunSignals(w, E, r, driven, _reason(run, told, r, driven))


def slip_matrices(run: Replay) -> np.ndarray:
    """c_i J_i K_r^-1/2, (R, n, m, nv), or c_i K_r^-1/2, (R, n, m, m), where K_r acts in task space."""
    x, controller = run.rows, run.loop.controller
    K_r = controller.K_r[:, None, :]  # zero for joints that a robot does not have, as is J
    weak = np.where(K_r > 0, 1 / np.sqrt(np.where(K_r > 0, K_r, 1.0)), 0.0)
    return (x.c @ x.J if controller.k_r_space == "joint" else x.c) * weak


def _told_all(run: Replay) -> bool:
    """Whether the law's E is the true one: all is heard at once, and integrated as it changes."""
    return is_ideal(run.loop.controller.network) and run.result.info.get("control_period") is None


def true_integral(run: Replay, sigma: np.ndarray, sigma_dot: np.ndarray) -> np.ndarray:
    """E of E' = sigma - l E, (R, n, m), from the integrals at the start.

    Between logged instants sigma is the cubic with its values and rates at both; Simpson's rule does
    the rest.
    """
    t, at, leak = run.result.t, run.logged, run.loop.controller.leak
    E = np.empty((len(t), *sigma.shape[1:]))
    E[0] = run.loop.cell.coupling.distribute(run.result.sync_integral[0])
    for k, h in enumerate(np.diff(t)):
        (a, b), (a_dot, b_dot) = (rate[[at[k], at[k] + 1]] for rate in (sigma, sigma_dot))
        middle = 0.5 * (a + b) + h / 8 * (a_dot - b_dot)
        half = np.exp(-0.5 * h * leak)
        E[k + 1] = half * (half * (E[k] + h / 6 * a) + h / 1.5 * middle) + h / 6 * b
    return E[np.searchsorted(at, np.arange(len(sigma)))]


def _check_continuous(run: Replay, w: np.ndarray, w_dot: np.ndarray) -> None:
    """Refuse a run in which an event of the plant moves w at once: then w is not r filtered."""
    for k in run.events:
        ends, h = run.logged[k] + np.arange(2), run.result.t[k + 1] - run.result.t[k]
        moved, passed = np.abs(w[ends[1]] - w[ends[0]]).max(), h * np.abs(w_dot[ends]).max()
        if moved > 2 * passed + ROUNDING * np.abs(w).max():
            time = float(run.result.t[k + 1])
            text = f"expected errors that do not jump, found an event that moves them at t = {time:g} s"
            raise InputError(text, subject="result", found=time)


def _reason(run: Replay, told: np.ndarray, r: np.ndarray, driven: np.ndarray) -> str | None:
    """Why r is not c J s_q along a run, in words; None if it is, to rounding."""
    x, controller = run.rows, run.loop.controller
    size = ROUNDING * float(np.abs(x.u).max() + np.abs(x.u - x.r).max() + np.abs(told).max())
    seen = np.matvec(x.c[run.logged], run.result.tracking_error) - x.weighted[run.logged, 0]
    found = {
        "what robots were told of sigma or its integral was not so": np.abs(told - r).max() > size,
        f"the law {controller.law_settings['name']} has another r than (e*)' + Lambda e*":
            np.abs(told - x.r).max() > size,
        "the joints do not follow the reference in task space, because its inverse is damped":
            np.abs(x.r - driven).max() > size,
        "the desired motion gives way, and errors are those from where it went": np.abs(seen).max() > size,
    }  # fmt: skip
    return "; ".join(words for words, holds in found.items() if holds) or None
