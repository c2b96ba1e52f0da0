"""The controller of a cell: wires robots, task space, coupling and law together.

`Controller.signals` is the whole way from joint positions and velocities to torques, and the place from which
to read the package: every line of it is one part that can be exchanged, asked at one instant for all robots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from types import NoneType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, limits, offers
from ..coupling.cell import Cell, Reference
from ..coupling.desired import rows_of
from ..renamed import argument, names_elsewhere, tell
from ..robots.momentum import momentum_of_all
from ..robots.regressors import Regressors, make_regressors
from ..tasks.algebra import limited
from ..tasks.spaces import Measurement
from . import law, laws
from .adaptation import Adaptation, Seen, chosen, pace_of, shift_of
from .admittance import Admittance, BoundAdmittance
from .gains import Gains, spread, spread_rows
from .laws import Asked, Errors, Law, completed
from .network import Communication, Ideal, Received, check_leak, connected, connected_with_slips
from .parts import check_parts, settings_of


@dataclass(slots=True)
class Signals:
    """Everything one evaluation of the controller computed, under its name.

    Task-space rows are (n, m), rows per pair (p, m), joint-space rows (n, nv), parameters (n, P), the
    regressors Y are (n, nv, P), the state of the adaptation is (n, Z). The fields stand in the order in which
    they are computed; the properties below them are parts of the fields, under the names of the notation.

    Attributes:
        reference: what was desired, and the weights of the coupling.
        task: where the robots were in task space, their errors, and their Jacobians.
        received: what the network told every robot of the others.
        errors: all of this as the law sees it.
        asked: what the law asked for, in task space.
        v_ref, a_ref, s_q: the same for the joints, and the velocity error v_ref - v.
        Y: regressors.
        tau: torques, N·m.
        theta_hat: estimates of the parameters.
        z_dot: rate of the adaptation's state.
        seen: what the adaptation learns from.
    """

    reference: Reference
    task: Measurement
    received: Received
    errors: Errors
    asked: Asked
    v_ref: np.ndarray
    a_ref: np.ndarray
    s_q: np.ndarray
    Y: np.ndarray
    tau: np.ndarray
    theta_hat: np.ndarray
    z_dot: np.ndarray
    seen: Seen

    memory_dot = property(lambda self: self.received.memory_dot)
    epsilon = property(lambda self: self.received.epsilon)
    epsilon_dot = property(lambda self: self.received.epsilon_dot)
    e = property(lambda self: self.errors.e)
    e_dot = property(lambda self: self.errors.e_dot)
    E = property(lambda self: self.errors.E)
    sigma = property(lambda self: self.errors.sigma)
    sigma_dot = property(lambda self: self.errors.sigma_dot)
    force = property(lambda self: self.asked.force)
    e_star = property(lambda self: completed(self.asked, self.errors).e_star)
    u = property(lambda self: completed(self.asked, self.errors).u[0])
    u_dot = property(lambda self: completed(self.asked, self.errors).u[1])

    @property
    def theta_hat_dot(self) -> np.ndarray:
        """z', which is theta_hat' with the paper's adaptation; deprecated, see `z_dot`."""
        tell("Signals.theta_hat_dot", "Signals.z_dot")
        return self.z_dot

    @property
    def r(self) -> np.ndarray:
        """Coupled velocity error r = u - c x' = (e*)' + Lambda e*, eqs. (12) and (31), (n, m)."""
        return self.u - np.matvec(self.errors.c, self.errors.x_dot)


class Controller:
    """Adaptive synchronized control of a cell, eqs. (7)-(14) and (28)-(32).

    Its state is that of its adaptation, z, (n, Z), which is theta_hat itself for the paper's, and the memory
    of its network, which by default are the integrals of the synchronization errors, (p, m).

    Args:
        cell: the robots and their task.
        gains: the gains.
        adaptation: how it learns; by default `Gradient(gains.Gamma)`, eq. (14).
        law: from errors to reference motion and force; by default `SunMills`.
        network: what the robots know of each other; by default `Ideal`.
        torque_limits: (n, nv), N·m, at which the robots cut torque off, as far as an adaptation is to know of
            it; infinite by default. `tau` is what is asked for, whatever the limits.
        admittance: how the robots give way to the forces inside what they hold together; by default they do
            not.
        reference_acceleration, k_r_space: shorthand for the options of `SunMills`. Where the damping acts,
            "joint" or "task", may be said beside any law.

    Attributes:
        unbound: adaptation and law as they were before they knew the cell.

    Raises:
        InputError: gains or limits of the wrong size, an unknown option or one that the law contradicts,
            Gamma and an adaptation, or neither, or parts that give something of another shape than they
            should.
    """

    def __init__(
        self,
        cell: Cell,
        gains: Gains,
        *,
        adaptation: Adaptation | None = None,
        law: Law | None = None,
        network: Communication | None = None,
        torque_limits: ArrayLike | None = None,
        admittance: Admittance | None = None,
        reference_acceleration: str | None = None,
        k_r_space: str | None = None,
    ):
        instance("cell", cell, Cell, "a Cell")
        instance("gains", gains, Gains, "Gains")
        m = cell.m
        self.cell, self.gains = cell, gains
        options = laws.chosen(law, reference_acceleration, k_r_space)
        self.reference_acceleration, self.k_r_space = options.reference_acceleration, options.k_r_space
        self.Lambda = spread("Lambda", gains.Lambda, (m,))
        self.beta = spread("beta", gains.beta, (m,))
        self.K_eps = spread("K_eps", gains.K_eps, (m,))
        joints = [robot.nv if self.k_r_space == "joint" else m for robot in cell.robots]
        self.K_r = spread_rows("K_r", gains.K_r, joints)
        learning = chosen(gains.Gamma, adaptation)
        self.adaptation, self.adaptation_settings = learning.bind(cell), settings_of(learning)
        self.law, self.law_settings = options.law.bind(cell, gains), settings_of(options.law)
        self.unbound = learning, options.law
        self.leak = spread("leak", gains.leak, (m,))
        connection = Ideal(self.leak) if network is None else network
        offers("network", connection, ("bind", "as_dict"), "a network, for example Ideal()")
        connect = connected_with_slips if getattr(self.law, "needs_slips", False) else connected
        self.network, self.network_settings = connect(connection, cell, gains), settings_of(connection)
        self._shift = shift_of(self.adaptation, self.network)
        self._pace = pace_of(self.adaptation, self.network)
        self._give_way(admittance)
        self.torque_limits = limits("torque_limits", torque_limits, (cell.n, cell.nv))
        self._cuts = bool(np.isfinite(self.torque_limits).any())
        check_parts(self.law, self.network, cell.n, cell.coupling.pairs, m)
        check_leak(self.network, self.leak)

    def _give_way(self, admittance: Admittance | None) -> None:
        """Take an admittance, if there is one, for the adaptation that it goes along with."""
        instance("admittance", admittance, (Admittance, NoneType), "an Admittance")
        self.admittance: BoundAdmittance | None = None
        self.admittance_settings: dict[str, Any] | None = None
        if admittance is not None:
            self.admittance = admittance.bind(self.cell, self.adaptation, self.network)
            self.adaptation, self.admittance_settings = self.admittance, admittance.as_dict()

    @property
    def Gamma(self) -> np.ndarray:  # noqa: N802
        """Gamma of the paper's adaptation, (n, P); deprecated, see `adaptation`."""
        tell("Controller.Gamma", "Controller.adaptation.Gamma")
        return self.adaptation.Gamma  # type: ignore[attr-defined]

    @cached_property
    def _compute_regressors(self) -> Regressors:
        """q, v, v_ref and a_ref, (n, nv), -> the regressors, (n, nv, P)."""
        return make_regressors(self.cell.parameters, [robot.nv for robot in self.cell.robots])

    def evaluate(
        self,
        reference: Reference,
        motion: ArrayLike,
        z: ArrayLike | None = None,
        integral: ArrayLike | None = None,
        *,
        theta_hat: ArrayLike | None = None,
        wrenches: ArrayLike | None = None,
    ) -> Signals:
        """The law at one instant.

        Args:
            reference: desired motion, (3, n, m), and weights, (n, m, m) each.
            motion: joint positions and velocities, (2, n, nv).
            z: state of the adaptation, (n, Z).
            integral: integrals of the synchronization errors, (p, m); with another network than `Ideal`
                its memory.
            theta_hat: deprecated name of z.
            wrenches: internal wrenches that are measured, about the object's origin in world axes, (n, 6),
                N and N·m, for an admittance.

        Raises:
            InputError: another size, numbers that are not finite, or none where an admittance needs some.
        """
        cell = self.cell
        instance("reference", reference, Reference, "a Reference, for example of Cell.references")
        reference.check(cell.n, cell.m, rows_of(cell.space))
        state: Any = argument("Controller.evaluate", "theta_hat", theta_hat, "z", z)
        memory: Any = integral
        return self.signals(
            reference,
            finite_array("motion", motion, (2, cell.n, cell.nv)),
            finite_array("z", state, self.adaptation.start().shape),
            finite_array("integral", memory, np.shape(self.network.start())),
            None if wrenches is None else finite_array("wrenches", wrenches, (cell.n, 6)),
        )

    @property
    def unchecked(self) -> Callable[..., Signals]:
        """What a simulation calls: `signals`, which is `evaluate` without its checks.

        A user's subclass may have an `evaluate` of its own; then that is called instead.
        """
        return self.signals if type(self).evaluate is Controller.evaluate else self.evaluate

    def signals(
        self,
        reference: Reference,
        motion: np.ndarray,
        z: np.ndarray,
        integral: np.ndarray,
        wrenches: np.ndarray | None = None,
    ) -> Signals:
        """`evaluate` without its checks, for many evaluations: numbers that are not finite go through.

        `space` is the task space bound to the robots, `cell.task`; `task` is what it measures at this
        instant. z is what the adaptation remembers, and `integral` what the network does.
        """
        (q, v), cell = motion, self.cell
        reference = reference if self._pace is None else self._pace(z, motion, reference)
        space, weights = cell.task, reference.weights
        desired = reference.desired if self._shift is None else self._shift(z, reference)
        task, felt = space.measure(motion, desired), None
        if self.admittance is not None:
            task, felt = self.admittance.moved(task, z, reference, wrenches)
        w = law.compute_weighted_errors(weights, task.error)
        received = self.network.exchange(reference.t, w, integral)
        told = received.shares, weights, received.slips
        errors = Errors(reference.t, task.error, task.motion[1], task.rates, w, *told)
        asked = self.law.command(errors)
        v_ref, a_ref, s_q, feedback = law.compute_joint_command(
            asked, task, v, space, self.K_r, self.k_r_space
        )
        Y = self._compute_regressors(q, v, v_ref, a_ref)
        theta_hat = self.adaptation.estimate(z)
        tau = np.matvec(Y, theta_hat) + feedback  # (13), (32)
        applied = limited(tau, -self.torque_limits, self.torque_limits) if self._cuts else tau
        momentum = partial(momentum_of_all, cell.robots, cell.parameters, q, v)
        seen = Seen(q, v, v_ref, a_ref, s_q, np.vecmat(s_q, Y), Y, tau, applied, momentum, felt)
        z_dot = self.adaptation.rate(z, seen)
        return Signals(
            reference, task, received, errors, asked, v_ref, a_ref, s_q, Y, tau, theta_hat, z_dot, seen
        )


__getattr__ = names_elsewhere(__name__, ".laws.sun_mills", "REFERENCE_ACCELERATIONS")
