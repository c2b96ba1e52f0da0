"""Which theorem covers robots that hear each other late, or not always, and how far they are inside it.

With L = S^T S, D its diagonal, A the rest, and a the largest entry of D:

1. Constant delays, K_eps = 0. E' = sigma, and sigma' is its rate, so V' = -sum s_q^T K_r s_q as without
   delays, and r, e* go to zero. w = s (s + beta (D + A e^-sd))^-1 e* is stable, because rows are dominant.
2. Constant delays, K_eps > 0. From r to sigma it is s L_d ((s + Lambda)(s + beta L_d))^-1 with
   L_d = D + A e^-sd, whose Hermitian part is at least -a/(4 Lambda) at every frequency. So delays do no
   harm where K_r - a/(4 Lambda) J^T c^T K_eps c J is positive definite: its smallest eigenvalue is the
   margin. With `SunMills(injection=True)` the second term is made up for, and the margin is that of K_r.
3. A filter of W at the receiver, K_eps = 0. As 1., whatever is lost, late or out of order.

All ask for the largest eigenvalue of D^-1/2 |A| D^-1/2 to be at most 1, as it is in couplings of pairs. The
page about networks in `docs` has the proofs.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..control.controller import Controller
from ..control.laws.sun_mills import BoundDiffusion, BoundInjection, BoundSunMills
from ..control.network import BoundPosted, WForm
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .replay import Replay, replay

#: by how much rounding may take the share of what is heard beyond 1
ROUNDING = 1e-9


@dataclass(frozen=True)
class DelayCondition:
    """Which theorem covers a run with a network, and where its condition is tightest.

    Attributes:
        theorem: which one, in words; None if none does.
        reason: why none does, in words; else None.
        margin: smallest eigenvalue of K_r - a/(4 Lambda) J^T c^T K_eps c J, N·m·s/rad, or N·s/m for K_r in
            task space, where J is left out.
        robot: index of the robot with the smallest margin, counted from 0.
        time: instant of it, s.
        needed: whether K_eps > 0 makes it count.
    """

    theorem: str | None
    reason: str | None
    margin: float
    robot: int
    time: float
    needed: bool

    @property
    def holds(self) -> bool:
        """Whether the margin is above 0 everywhere."""
        return self.margin > 0

    def as_dict(self) -> dict[str, Any]:
        """The same as plain data."""
        return asdict(self) | {"holds": self.holds}

    def __str__(self) -> str:
        margin = f"margin {self.margin:.4g} of robot {self.robot + 1} at t = {self.time:g} s"
        found = self.theorem or f"outside, {self.reason}"
        return f"{found} ({margin}{'' if self.needed else ', not needed'})"


def delay_condition(result: Result | Replay, experiment: Experiment | None = None) -> DelayCondition | None:
    """Which theorem for networks covers a run; None of a network that is ideal, or not of the W form.

    Args:
        result: the run; or its replay, where one has been made already.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: no experiment, or another than the one that made the result.
    """
    run = replay(result, experiment)
    controller, network = run.loop.controller, run.loop.controller.network
    if not isinstance(network, WForm) or (network.theorem is None and network.outside() is None):
        return None
    found = _margins(run)
    row, robot = np.unravel_index(np.argmin(found), found.shape)
    margin, needed = float(found[row, robot]), bool(controller.K_eps.any())
    reason = _reason(run, network, margin if needed else None)
    theorem = network.theorem if reason is None else None
    return DelayCondition(theorem, reason, margin, int(robot), float(run.result.t[row]), needed)


def _margins(run: Replay) -> np.ndarray:
    """The margin of every robot at every logged instant, (T, n)."""
    x, controller = run.rows, run.loop.controller
    c, J = x.c[run.logged], x.J[run.logged]
    T = c @ J if controller.k_r_space == "joint" else c
    missing = (reach(controller) - getattr(controller.law, "injection", 0.0))[:, None]
    slack = controller.K_r[..., None] * np.eye(controller.K_r.shape[-1]) - T.mT @ (missing * T)
    found = np.empty(slack.shape[:2])
    for i, robot in enumerate(run.loop.cell.robots):
        k = robot.nv if controller.k_r_space == "joint" else controller.cell.m
        found[:, i] = np.linalg.eigvalsh(slack[:, i, :k, :k])[..., 0]
    return found


def reach(controller: Controller) -> np.ndarray:
    """a/(4 Lambda) K_eps, (m,): how much of the damping delays may take, in the coordinates of r."""
    return controller.cell.coupling.degree / (4 * controller.Lambda) * controller.K_eps


def _reason(run: Replay, network: WForm, margin: float | None) -> str | None:
    """Why no theorem covers a run, in words; None if one does.

    Args:
        run: the run.
        network: what its robots know of each other.
        margin: the smallest one, or None if it does not count.
    """
    controller = run.loop.controller
    if (words := network.outside()) is not None:
        return words
    if isinstance(controller.law, BoundDiffusion):
        return "the storage of its diffusive coupling is not in V"
    if not isinstance(controller.law, (BoundSunMills, BoundInjection)):
        return f"its theorem is of SunMills, not of {controller.law_settings['name']}"
    if run.loop.chain is not None:
        return "its theorem is of robots that nothing connects"
    if run.result.info.get("control_period") is not None:
        return "its theorem is of continuous control"
    if controller.reference_acceleration != "exact" and not controller.cell.coupling.is_constant:
        return "its theorem asks for the exact reference acceleration"
    if (share := network.links.share) > 1 + ROUNDING:
        return f"robots hear {share:.3g} times as much of others as of themselves, and the proof allows 1"
    if margin is not None and isinstance(network, BoundPosted):
        return "its theorem asks for K_eps = 0"
    if margin is not None and margin <= 0:
        return f"the margin K_r - a/(4 Lambda) J^T c^T K_eps c J falls to {margin:.4g}"
    return None
