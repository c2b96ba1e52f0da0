"""The desired motion of a cell, and what its closed loop is made of there, where all errors are zero."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..control.adaptation.gradient import BoundGradient, MetricGradient
from ..control.laws.sun_mills import BoundSunMills
from ..control.network.ideal import BoundIdeal
from ..coupling.cell import Cell, Reference
from ..errors import InputError, UnreachableError
from ..robots.regressors import make_regressors
from ..simulation.closed_loop import ClosedLoop
from ..simulation.simulate import Experiment
from ..tasks.measurement import Measurement

#: times in a period at which a motion is held against itself one period later
LOOKS = 64
#: how far two motions or torques may differ that count as the same, of their size
SAME = 1e-7
#: steps of Newton's method to a pose; it has arrived where its last step was no longer than this
NEWTON, ARRIVED = 50, 1e-9
#: time between poses on the way from t = 0 to where a period begins, s
STRIDE = 0.02
#: parts that the theorem knows, by the argument of `Experiment` that chooses them
KNOWN = {
    "law": ((BoundSunMills,), "the law SunMills, without injection or diffusion"),
    "adaptation": ((BoundGradient, MetricGradient), "the adaptation Gradient, eq. (14)"),
    "network": ((BoundIdeal,), "the network Ideal"),
}
#: arguments of `Experiment` that bring in what is outside the theorem
ABSENT = ("disturbances", "payloads", "saturate", "admittance", "sensors", "actuators")


@dataclass(frozen=True, eq=False)
class OnMotion:
    """What the linear system of small errors is made of, at T instants of the desired motion.

    Attributes:
        t: the instants, (T,), s.
        M: mass matrices, (T, n, nv, nv).
        D: C + F_v and the damping of the controller, (T, n, nv, nv).
        J_c: weight times Jacobian, (T, n, m, nv).
        Y: regressors of all that is adapted, (T, n, nv, P).
    """

    t: np.ndarray
    M: np.ndarray
    D: np.ndarray
    J_c: np.ndarray
    Y: np.ndarray


def check_reach(experiment: Experiment, loop: ClosedLoop) -> None:
    """Refuse by name what the linear system does not describe.

    Raises:
        InputError: another law, adaptation or network, something from outside, a plant with a state of its
            own, arms with spare joints, or the printed x' of (13) under weights that move.
    """
    for subject in ABSENT:
        if getattr(experiment, subject):
            raise InputError.expected("none, for errors that are left alone", "some", subject, shown="some")
    for subject, (kinds, expected) in KNOWN.items():
        part = getattr(loop.controller, subject)
        if type(part) not in kinds:
            raise InputError.expected(expected, type(part).__name__.removeprefix("Bound"), subject)
    plant, cell = loop.plant, loop.cell
    if plant.hidden0.size or loop.chain is not None:
        raise InputError.expected(
            "a plant without a state of its own", type(plant).__qualname__, "plant_type"
        )
    for name, robot in zip(cell.names, cell.robots, strict=True):
        if robot.nv != cell.m:
            words = f"{cell.m} joints, as many as task coordinates, for errors say nothing of spare ones"
            raise InputError.expected(words, robot.nv, name)
    if loop.controller.reference_acceleration == "paper" and not cell.coupling.is_constant:
        raise InputError.expected(
            "'exact' under weights that move", "paper", subject="reference_acceleration"
        )


def check_period(cell: Cell, start: float, period: float) -> None:
    """Refuse a period with which desired motions or weights do not repeat.

    Raises:
        InputError: which part differs most one period later, of which robot, when, and by how much.
    """
    times = start + period * (np.arange(LOOKS) + 0.5) / LOOKS
    now, later = (cell.reference_table(t) for t in (times, times + period))
    parts = {"xd": 0, "xd'": 1, "xd''": 2}
    pairs = {name: (now.desired[:, k], later.desired[:, k]) for name, k in parts.items()}
    pairs |= {"c": (now.c, later.c), "c'": (now.c_dot, later.c_dot)}
    for name, (a, b) in pairs.items():
        gap = np.abs(a - b).reshape(LOOKS, cell.n, -1).max(axis=2)
        if gap.max() > SAME * (1 + np.abs(a).max()):
            k, i = np.unravel_index(int(gap.argmax()), gap.shape)
            text = (
                f"expected a period of the desired motion, found {period:g} s, after which {name} of "
                f"{cell.names[i]} at t = {times[k]:g} s is another by {gap[k, i]:.3g}"
            )
            raise InputError(text, subject="period", found=period)


class DesiredMotion:
    """The desired motion of a closed loop.

    Args:
        loop: the closed loop.
    """

    def __init__(self, loop: ClosedLoop):
        self.loop, self.cell, self.controller = loop, loop.cell, loop.controller
        joints = [robot.nv for robot in self.cell.robots]
        self._regressors = make_regressors(self.cell.parameters, joints)
        self._memory = np.asarray(self.controller.network.start())

    def at(self, times: np.ndarray) -> OnMotion:
        """What the linear system is made of at ascending times, (T,).

        Raises:
            UnreachableError: no joint positions for what is desired.
            InputError: the plant moves otherwise than its parameters say.
        """
        q, rows = self.arrived(times[0]), []
        for reference in self.cell.references(times):
            q = self.joints(reference, q)
            rows.append(self._row(reference, q))
        return OnMotion(times, *map(np.array, zip(*rows, strict=True)))

    def arrived(self, t: float) -> np.ndarray:
        """Joint positions on the desired motion at t, (n, nv), found on the way from where the cell starts.

        Raises:
            UnreachableError: there are none.
        """
        q = self.cell.q0
        for reference in self.cell.references(np.append(np.arange(0.0, t, STRIDE), t)):
            q = self.joints(reference, q)
        return q

    def joints(self, reference: Reference, q: np.ndarray, e: Any = 0.0) -> np.ndarray:
        """Joint positions at which the errors are e, (n, m), from q nearby, (n, nv), by Newton's method.

        Raises:
            UnreachableError: there are none nearby.
            InputError: inverse kinematics are damped there.
        """
        still = np.zeros_like(q)
        for _ in range(NEWTON):
            task = self.cell.task.measure(np.array((q, still)), reference.desired)
            step = task.error[0] - e
            step = step if task.J_inv is None else np.matvec(task.J_inv, step)
            q = q + step
            if np.abs(step).max() <= ARRIVED:
                self._check_exact(reference.t, task)
                return q
        self._check_exact(reference.t, task)
        text = f"no joint positions found for what is desired at t = {reference.t:g} s"
        raise UnreachableError(text, subject="cell")

    def _row(self, reference: Reference, q: np.ndarray) -> tuple[np.ndarray, ...]:
        """M, D, J_c and Y at one instant."""
        theta, controller, memory = self.cell.theta, self.controller, self._memory
        v = controller.signals(reference, np.array((q, np.zeros_like(q))), theta, memory).v_ref
        s = controller.signals(reference, np.array((q, v)), theta, memory)
        J = np.broadcast_to(np.eye(self.cell.m), reference.c.shape) if s.task.J is None else s.task.J
        units = np.eye(self.cell.nv)
        model = np.matvec(s.Y, theta)

        def gained(dv: np.ndarray | float, da: np.ndarray | float) -> np.ndarray:
            return np.matvec(self._regressors(q, v, v + dv, s.a_ref + da), theta) - model

        M = np.stack([gained(0.0, unit) for unit in units], axis=-1)
        D = np.stack([gained(unit, 0.0) for unit in units], axis=-1) + self._damping(J)
        self._check_plant(reference.t, q, v, s.a_ref)
        return M, D, reference.c @ J, s.Y

    def _check_exact(self, t: float, task: Measurement) -> None:
        """Refuse damped inverse kinematics at work, with which J s_q is not c^-1 r."""
        damping = np.ravel(task.inverse_damping)
        if damping.any():
            i = int(damping.argmax())
            text = f"expected J^-1 without damping, found lambda = {damping[i]:.3g} at t = {t:g} s"
            raise InputError(text, subject=f"{self.cell.names[i]}, singularity", found=float(damping[i]))

    def _damping(self, J: np.ndarray) -> np.ndarray:
        """K_r, or J^T K_r J where it acts in task space, (n, nv, nv)."""
        K_r = self.controller.K_r[..., None] * np.eye(self.cell.m)
        return K_r if self.controller.k_r_space == "joint" else J.mT @ K_r @ J

    def _check_plant(self, t: float, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> None:
        """Refuse a plant that is no M v' + C v + g + F_v v of what is adapted, near the desired motion."""
        v, a, plant = v + 1.0, a + 1.0, self.loop.plant
        tau = np.matvec(self._regressors(q, v, v, a), self.cell.theta)
        gap = np.abs(plant.move(q, v, tau, plant.hidden0)[0] - a)
        if gap.max() > SAME * (1 + np.abs(a).max()):
            i = int(gap.max(axis=1).argmax())
            text = (
                f"expected a plant that moves as what is adapted says, found another acceleration, by "
                f"{gap.max():.3g} rad/s^2 or m/s^2, at t = {t:g} s: friction has to be among the parameters, "
                "as with FrictionParameters, or left out, as with friction=Friction(); and so do rotors"
            )
            raise InputError(text, subject=f"{self.cell.names[i]}, parameters", found=float(gap.max()))
