"""One robot's share of the closed loop, traced with symbols into a few functions.

`measure` finds out where the robot is, `control` is the law, `plant` is its true dynamics, and `guard` says
what is watched. Between the first two the driver lets the coupling exchange what neighbours need. Spaces,
inverse maps and the law are not written again here: those of tasks/ and of control/law.py run on symbols.
Which quantities each function reads and writes, and how long they are, is said in `quantities.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..control import law
from ..control.admittance import Giving
from ..control.laws import Asked, Errors
from ..control.laws.protocol import ROWS
from ..control.laws.sun_mills import BoundSunMills
from ..coupling.weights import Weights
from ..robots.articulated import accelerations
from ..robots.lumped import compact
from ..robots.mechanism import Mechanism
from ..robots.symbolic import Symbols
from ..tasks.algebra import limited
from ..tasks.measurement import Poses, Positions
from ..tasks.redundancy import Inversion, velocity_lost
from ..tasks.spaces import Measurement
from .algebra import SYMBOLS, array_of, balancing, column_of, function_of
from .carrying import felt_at_origin, fixture_on
from .kind import Kind
from .momentum import model_torque
from .plugged import Learning
from .quantities import DESIRED, FUNCTIONS, HEARD, QUANTITIES, SLIDE, columns

#: joints up to which the mass matrix and a factor of it take fewer operations than articulated bodies
SHORT = 8


class TracedTip:
    """The tip of a robot whose joint positions are symbols, see `Kinematics`.

    Args:
        recursion: at these positions.
        base: rotation and translation of the first joint's placement.
    """

    def __init__(self, recursion: Symbols, base: tuple[Any, Any]):
        self._recursion, self._base = recursion, base

    def poses(self, q: np.ndarray, v: np.ndarray) -> Poses:
        x, R, J, J_dot = map(array_of, self._recursion.tip(column_of(v), *self._base))
        return np.stack((x[:, 0], J[:3] @ v)), R, J, J_dot

    def positions(self, q: np.ndarray, v: np.ndarray) -> Positions:
        moved, _, J, J_dot = self.poses(q, v)
        return moved, J[:3], J_dot[:3]


class Trace:
    """CasADi functions of one kind of robot.

    Args:
        kind: the kind.
        name: prefix of the generated names.
    """

    def __init__(self, kind: Kind, name: str):
        import casadi as ca

        self.ca, self.kind, self.name = ca, kind, name
        self.given = {key: self.ca.SX.sym(key, columns(key, kind.sizes)) for key in QUANTITIES}
        self.q, self.v = self.given["q"], self.given["v"]
        still = Symbols(
            compact(self._tooled(kind.fixed, "tool")), self.q, self.given["sine"], self.given["cosine"]
        )
        posture = self._row("W_inv"), self._row("posture"), self._row("gain")
        self.space: Any = kind.bound(TracedTip(still, self._base()), posture, SYMBOLS)

    def functions(self) -> Iterator[Any]:
        """All that the kind has; those that take long to compile first."""
        yield self.control()
        yield self.plant()
        yield self.measure()
        if self.kind.holds:
            yield self.hand()
        if self.kind.watches:
            yield self.guard()
        if self.kind.learning is not None:
            yield from self.beside(self.kind.learning)

    # -- where the robot is -------------------------------------------------------------------------------

    def measure(self) -> Any:
        """Where the robot is, and how it errs."""
        told = (*DESIRED, *SLIDE) if self.kind.slides else DESIRED
        motion, desired = (np.stack([*map(self._row, names)]) for names in (("q", "v"), told))
        task, felt = self._given_way(self.space.measure(motion, desired), desired)
        w, w_dot = law.compute_weighted_errors(self._weights(), task.error)
        way = {} if task.inversion is None else task.inversion._asdict()
        return self._function(
            "measure",
            x=task.x, e=task.e, e_dot=task.e_dot, x_dot=task.x_dot, xd_dot=task.xd_dot, xd_ddot=task.xd_ddot,
            w=w, w_dot=w_dot, J=task.J, J_dot=task.J_dot, felt=felt, **way,
        )  # fmt: skip

    def _given_way(self, task: Measurement, desired: np.ndarray) -> tuple[Measurement, np.ndarray | None]:
        """What was measured after it gave way to forces, and what is felt; nothing of that without them."""
        at = self.kind.gives_at
        if at is None:
            return task, None
        parts = map(self._row, ("wrench", "share", "lift", "body"))
        wrench = felt_at_origin(*parts) if self.kind.holds else np.zeros(6)
        return self._giving().moved(task, self._row("z")[at:].reshape(2, 6), desired[:3], wrench)

    def _giving(self) -> Giving:
        return Giving(*self._row("giving").reshape(3, 6))

    def guard(self) -> Any:
        """What is watched."""
        e = self._row("e")
        task = Measurement(np.stack((e, e)), np.stack((e, e)), np.stack((e, e)), *self._jacobians())
        return self._function("guard", watched=self.space.watched(task), side=self.space.sides(task))

    def _jacobians(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        m, nv = (self.kind.m, self.kind.nv) if self.kind.tip else (0, 0)
        shapes = {"J": (m, nv), "J_inv": (nv, m), "J_dot": (m, nv)}
        J, J_inv, J_dot = (array_of(self.given[name], *shape) for name, shape in shapes.items())
        return J, J_inv, J_dot

    def _task(self) -> Measurement:
        """What was measured, of one instant."""
        error, rates = (np.stack([*map(self._row, pair)]) for pair in (("e", "e_dot"), ("xd_dot", "xd_ddot")))
        J, J_inv, J_dot = self._jacobians()
        m = self.kind.m if self.kind.solves else 0
        ways = map(self._row, ("zeta", "zeta_dot", "damping", "damping_rate"))
        inversion = Inversion(J_inv, array_of(self.given["G"], m, m), *ways)
        x_dot = self._row("x_dot")
        motion = np.stack((np.zeros_like(x_dot), x_dot))  # the law does not ask for x
        return Measurement(motion, error, rates, J, J_inv, J_dot, inversion)

    # -- the law ------------------------------------------------------------------------------------------

    def control(self) -> Any:
        """The law: torque, z' of the adaptation, e*, s_q."""
        task = self._task()
        errors = self._errors(task)
        asked = self._asked(errors)
        v_ref, a_ref, s_q, feedback = law.compute_joint_command(
            asked, task, self._row("v"), self.space, self._row("K_r"), self.kind.k_r_space
        )
        model_torque, gradient, Y = self._adaptive(v_ref, a_ref, s_q)
        tau = model_torque + feedback
        z_dot = self._with_giving(self._learned(gradient, Y, (v_ref, a_ref, s_q, tau)))
        lost = velocity_lost(self._jacobians()[0], v_ref, asked.xref_dot) if self.kind.damped else None
        return self._function(
            "control",
            tau=tau, z_dot=z_dot, e_star=asked.e_star, s_q=s_q, velocity_lost=lost,
        )  # fmt: skip

    def _errors(self, task: Measurement) -> Errors:
        """What a law is told of one robot."""
        w, heard = (np.stack([*map(self._row, names)]) for names in (("w", "w_dot"), HEARD))
        return Errors(None, task.error, task.x_dot, task.rates, w, heard, self._weights())

    def _asked(self, errors: Errors) -> Asked:
        """What the law asks of one robot."""
        kind = self.kind
        if kind.law is None:
            Lambda, beta, K_eps, leak = map(self._row, ("Lambda", "beta", "K_eps", "leak"))
            return BoundSunMills(Lambda, beta, K_eps, kind.reference_acceleration, leak).command(errors)
        rows = (column_of(getattr(errors, name)) for name in ROWS)
        parts = kind.law(*rows, column_of(np.stack(self._weights())))
        return Asked(*(array_of(part, -1) for part in parts))

    def beside(self, learning: Learning) -> Iterator[Any]:
        """What an adaptation has beside its rate: z -> theta_hat, and z -> z after a step."""
        (z, beside), since = self._parted("z"), self.given["since"]
        yield self._function("estimate", theta_hat=array_of(learning.estimate(z)))
        if learning.settle is not None:
            settled = self.ca.vertcat(learning.settle(z), beside)
            yield self._function("settle", settled=array_of(settled))
        if learning.leap is not None:
            (z, z_dot), (y, y_dot) = zip(*map(self._parted, ("z_sampled", "z_dot_sampled")), strict=True)
            leapt = self.ca.vertcat(learning.leap(z, z_dot, since), y + since * y_dot)
            yield self._function("leap", leapt=array_of(leapt))

    def _parted(self, name: str) -> tuple[Any, Any]:
        """What an adaptation knows of a state or its rate, and what an admittance has behind it."""
        whole, learned = self.given[name], self.kind.learned
        return whole[:learned], whole[learned:]

    def _adaptive(self, v_ref: np.ndarray, a_ref: np.ndarray, s_q: np.ndarray) -> tuple:
        """Y theta_hat, Y^T s_q and Y row by row; with (14) the state z of the adaptation is theta_hat."""
        learning, z = self.kind.learning, self._parted("z")[0]
        motion = tuple(map(column_of, (v_ref, a_ref, s_q)))
        if learning is None:
            return (*(array_of(part, -1) for part in self._model(z, *motion)), None)
        theta_hat = self.given["theta_hat"]
        torque, gradient = self._model(theta_hat, *motion)
        parts = self.ca.substitute([torque, gradient], [theta_hat], [learning.estimate(z)])
        return tuple(array_of(part, -1) for part in (*parts, self.ca.jacobian(torque, theta_hat)))

    def _learned(self, gradient: np.ndarray, Y: np.ndarray, motion: tuple[np.ndarray, ...]) -> np.ndarray:
        """z' of the adaptation, given v_ref, a_ref, s_q and tau."""
        learning, tau, limits = self.kind.learning, motion[-1], self._row("limits")
        if learning is None:
            return self._row("Gamma") * gradient
        rows = (*motion, limited(tau, -limits, limits), gradient, Y)
        z = self._parted("z")[0]
        return array_of(learning.rate(z, self.q, self.v, *map(column_of, rows)), -1)

    def _with_giving(self, z_dot: np.ndarray) -> np.ndarray:
        """A rate with those of y and y' behind it, where an admittance has them."""
        at = self.kind.gives_at
        if at is None:
            return z_dot
        between, y_dot = np.zeros(at - len(z_dot)), self._row("z")[-6:]
        return np.concatenate((z_dot, between, *self._giving().rates(y_dot, self._row("felt"))))

    def _model(self, theta_hat: Any, v_ref: Any, a_ref: Any, s_q: Any) -> tuple[Any, Any]:
        """Y theta_hat, and Y^T s_q as the derivative of s_q^T Y theta_hat with respect to theta_hat."""
        recursion, gravity = self._recursion(), self._gravity(self._base())
        torque = model_torque(self.kind, recursion, theta_hat, self.v, v_ref, a_ref, gravity)
        return torque, self.ca.jtimes(torque, theta_hat, s_q, True)

    # -- the plant ----------------------------------------------------------------------------------------

    def plant(self) -> Any:
        """v' = M^-1 (tau - C v - g), through a factor of M, or joint after joint where there are many."""
        lumping, gravity = self.kind.lumping, self._gravity(self._true_base())
        bodies = lumping.bodies(self.given["pi"])
        recursion = Symbols(lumping.fixed, self.q, self.given["sine"], self.given["cosine"])
        moving = self.given["moving"]
        if self.kind.nv > SHORT:
            v_dot = accelerations(recursion, bodies, recursion.biased(bodies, self.v, gravity), moving)
        else:
            bias = recursion.bias(bodies, self.v, gravity)
            v_dot = balancing(recursion.mass_matrix(bodies), bias - moving)
        return self._function("plant", v_dot=array_of(v_dot))

    def hand(self) -> Any:
        """What the fixture between the hand and the object does to the joints, and to the object."""
        fixed = compact(self._tooled(self.kind.true, "true_tool"))
        recursion = Symbols(fixed, self.q, self.given["sine"], self.given["cosine"])
        tip = TracedTip(recursion, self._true_base())
        pull, wrench = fixture_on(tip, *map(self._row, ("q", "v", "body", "grasp")))
        return self._function("hand", pull=pull, wrench=wrench)

    # -- symbols and arrays -------------------------------------------------------------------------------

    def _function(self, name: str, **computed: Any) -> Any:
        """A function of the table, in which nothing is computed twice; what is None has no entries."""
        return function_of(f"{self.name}_{name}", FUNCTIONS[name], self.given, computed)

    def _recursion(self) -> Symbols:
        """At joint positions of which sine and cosine are known."""
        return Symbols(compact(self.kind.fixed), self.q, self.given["sine"], self.given["cosine"])

    def _tooled(self, fixed: Mechanism, name: str) -> Mechanism:
        """A mechanism with its tip where the quantity says, if it has been left open."""
        if not self.kind.holds:
            return fixed
        rotation, translation = self._placement(None, self.given[name])
        return replace(fixed, tip_rotation=rotation, tip_translation=translation)

    def _base(self) -> tuple[Any, Any]:
        """Rotation and translation of the first joint's placement."""
        return self._placement(self.kind.base_rotation, self.given["base"])

    def _true_base(self) -> tuple[Any, Any]:
        """The same of what really stands there."""
        return self._placement(self.kind.true_rotation, self.given["true_base"])

    def _placement(self, shared: np.ndarray | None, base: Any) -> tuple[Any, Any]:
        rotation = self.ca.reshape(base[:9], 3, 3).T if shared is None else self.ca.SX(shared)
        return rotation, base[9:]

    def _gravity(self, base: tuple[Any, Any]) -> Any:
        """Gravity in the frame of a first joint's placement."""
        return self.ca.mtimes(base[0].T, self.ca.SX(self.ca.DM(self.kind.gravity)))

    def _weights(self) -> Weights:
        return self.kind.weighing.weights(self._row("weights"), self.kind.m)

    def _row(self, name: str) -> np.ndarray:
        """A quantity as an array of single symbols."""
        return array_of(self.given[name], -1)
