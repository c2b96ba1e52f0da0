"""The controller as a digital controller runs it: called once a period, in any loop.

The continuous law of `controller.py` is evaluated at every sample; until the next one the torque is held, and
the estimates and the integrals of the synchronization errors move on with the rates found there. A driver, a
simulator or a notebook calls the same object that sampled simulation calls.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..checks import boolean, choice, finite_array, finite_number, instance, limits, positive_number
from ..coupling.cell import Reference
from ..errors import InputError, ResultError
from . import measured
from .adaptation import after_sample
from .controller import Controller, Signals
from .network import Messages

#: how far from its place on the grid of samples a call may come, as a share of the period
LATE = 0.1
FAULTS = "error", "hold"


class DiscreteController:
    """A controller with memory that is asked for torque once a period.

    With x = (state of the adaptation, memory of the network), x' = f by (14) and (28), tau by (13) or (32):

        tau_k = tau(t_k, q_k, v_k, x_k),   x_{k+1} = x_k + period f(t_k, q_k, v_k, x_k).

    Rows are robots; joints that a robot does not have are zeros, on the way in and on the way out. A call
    that raises an error leaves the controller as it was before.

    Args:
        controller: the law.
        period: time between two calls of `step`, s.
        torque_limits: (n, nv), N·m, at which the torque of the joints is cut off, gravity included; by
            default it is not. What adaptations know of are the controller's, see `Controller`.
        include_gravity: False for robots that add the torque of gravity by themselves: it is then taken off,
            as the robots' descriptions have it.
        faults: what a measurement that is not finite, a period that was missed, or a time that is off the
            grid or runs backwards does. "error" refuses it. "hold" keeps the torque and learns nothing from
            it; before the first sample there is nothing to hold, and it is refused.

    Attributes:
        z: state of the adaptation for the next sample, (n, Z).
        torque_limits: as given, infinite where there are none.
        memory: of the network for the next sample, before its messages; `sync_integral` with `Ideal`.
        held: how many calls and periods were held until now.
        signals: what the last sample computed, or None before the first.

    Raises:
        InputError: a period that is not positive, limits of another shape, an unknown word, or an adaptation
            whose arrays do not fit.
    """

    def __init__(
        self,
        controller: Controller,
        period: float,
        *,
        torque_limits: ArrayLike | None = None,
        include_gravity: bool = True,
        faults: str = "error",
    ):
        instance("controller", controller, Controller, "a Controller")
        measured.check_adaptation(controller)
        self.controller, self.cell = controller, controller.cell
        self.period = positive_number("period", period)
        self.include_gravity = boolean("include_gravity", include_gravity)
        self.faults = choice("faults", faults, FAULTS)
        self._shape = self.cell.n, self.cell.nv
        self._messages = Messages(self.cell, controller.network)
        measured.check_network(controller.network, self._messages, self.period)
        self.torque_limits = limits("torque_limits", torque_limits, self._shape)
        self.held: int
        self.signals: Signals | None
        self._samples: int
        self._start()

    # -- use ----------------------------------------------------------------------------------------------

    def reset(self, t: float, q: ArrayLike, v: ArrayLike) -> None:
        """Forget everything, and expect the first sample at time t.

        Args:
            t: time, s, on the clock of the desired motions.
            q, v: joint positions and velocities, (n, nv), rad (or m) and rad/s (or m/s).

        Raises:
            InputError: another shape, or a number that is not finite.
        """
        start = finite_number("t", t)
        finite_array("q", q, self._shape), finite_array("v", v, self._shape)
        self._start(start)

    def step(
        self,
        t: float,
        q: ArrayLike,
        v: ArrayLike,
        desired: ArrayLike | None = None,
        wrenches: ArrayLike | None = None,
    ) -> np.ndarray:
        """Torque for the period that begins now, (n, nv), N·m; the caller's to keep.

        Args:
            t: time, s, within a tenth of a period of the grid that `reset` began.
            q, v: what is measured, (n, nv), rad (or m) and rad/s (or m/s).
            desired: xd, xd', xd'', (3, n, m), as `Cell.references` gives them; by default what it gives at t.
            wrenches: internal wrenches that an admittance needs, see `Controller.evaluate`.

        Raises:
            InputError: another shape, a desired motion beside `Paced`, or a time that is no number; and,
                unless faults are held, a measurement that is not finite, a time that is early or runs
                backwards, or a missed period.
            SingularJacobianError, OrientationError: as in a simulation, which ends here.
            NonFiniteError: the law has no finite torque here.
            SimulationError: a space of the user's ends the run, or a motion or weight of theirs fails.
        """
        time, motion = self._time(t), measured.measurement(q, v, self._shape)
        wanted = None if desired is None else measured.desired_motion(self.controller, desired)
        felt = {} if wrenches is None else {"wrenches": finite_array("wrenches", wrenches, (self.cell.n, 6))}
        missed = self._missed(time)
        fault = self._off_the_grid(time, missed) or measured.not_finite(self.cell, time, motion)
        if fault is not None:
            return self._hold(time, missed, fault)
        with np.errstate(all="ignore"):  # what is not finite is named
            reference = self._reference(time, wanted)
            memory = self._heard(reference, motion, self._samples + missed)
            signals = self.controller.unchecked(reference, motion, self.z, memory, **felt)
        measured.check_signals(self.cell, time, signals)
        self._advance(motion[0], memory, signals, missed)
        return self._tau.copy()

    def sample(self, t: float, motion: np.ndarray, **felt: np.ndarray) -> Signals:
        """What `step` does with a measurement that is in order, for a simulation that watches by itself.

        Args:
            t: time of the sample, s.
            motion: joint positions and velocities, (2, n, nv), of which the signals may keep views.
            felt: internal wrenches as `wrenches`, (n, 6), if any are measured.

        Returns:
            What the law computed, its torque neither cut off nor without gravity.
        """
        reference = self._reference(t)
        memory = self._heard(reference, motion, self._samples)
        signals = self.controller.unchecked(reference, motion, self.z, memory, **felt)
        self._advance(motion[0], memory, signals)
        return signals

    def heard(self, t: float, motion: np.ndarray) -> np.ndarray:
        """Memory of the network for the next sample, with the messages that are due; nothing is kept.

        Args:
            t: time of the sample, s.
            motion: joint positions and velocities, (2, n, nv).
        """
        if not self._due(self._samples):
            return self.memory
        return self._heard(self._reference(t), motion, self._samples)

    # -- memory -------------------------------------------------------------------------------------------

    @property
    def state(self) -> dict[str, np.ndarray]:
        """Everything that the next step depends on, as plain arrays.

        `z`, (n, Z), state of the adaptation, which is theta_hat for the paper's; `sync_integral`, (p, m),
        unit of c e times s, or `network_state`, memory of a network that keeps something else; `tau`,
        (n, nv), N·m, the torque that is held; `start`, s, `period`, s, and `samples`, the place on the grid;
        `held`. What is set has to be of the same cell and period.
        """
        numbers = {"start": self._t0, "period": self.period, "samples": self._samples, "held": self.held}
        arrays = {"z": self.z, self._memory_name: self.memory, "tau": self._tau}
        return {name: np.array(value, dtype=float) for name, value in {**arrays, **numbers}.items()}

    @state.setter
    def state(self, state: Mapping[str, ArrayLike]) -> None:
        kept = self.state
        if not isinstance(state, Mapping) or set(state) != set(kept):
            found = list(map(str, state)) if isinstance(state, Mapping) else type(state).__name__
            raise InputError.expected(f"arrays {', '.join(sorted(kept))}", found, "state", shown=f"{found}")
        new = {name: finite_array(f"state, {name}", state[name], kept[name].shape) for name in kept}
        if new["period"] != self.period:
            own = f"that of the controller, {self.period:g} s"
            raise InputError.expected(own, new["period"], "state, period")
        samples, held = (measured.whole_number(name, float(new[name])) for name in ("samples", "held"))
        self.z, self.memory, self._tau = (new[k].copy() for k in ("z", self._memory_name, "tau"))
        self._t0, self._samples, self.held = float(new["start"]), samples, held
        self.signals = None

    def save(self, path: str | Path) -> Path:
        """Write the state to an .npz file, which appears when it is whole.

        Raises:
            InputError: something else than a path.
            ResultError: the file cannot be written.
        """
        return measured.write_state(path, self.state)

    def load(self, path: str | Path) -> None:
        """Read what `save` wrote, of a controller for the same cell and period.

        Raises:
            InputError: something else than a path.
            ResultError: the file is missing, damaged, of another controller, or anything else.
        """
        found = measured.read_state(path, self.state)
        try:
            self.state = found
        except InputError as error:
            raise ResultError(f"'{path}' has no state of this controller: {error}", file=path) from error

    @property
    def sync_integral(self) -> np.ndarray:
        """Integrals of the synchronization errors, (p, m), unit of c e times s."""
        return self.controller.network.integral(self.memory)

    # -- internals ----------------------------------------------------------------------------------------

    @property
    def _memory_name(self) -> str:
        """What the memory of the network is called in `state`."""
        return "sync_integral" if self.sync_integral is self.memory else "network_state"

    def _start(self, t: float = 0.0) -> None:
        self._t0, self._samples, self.held = t, 0, 0
        self.z = self.controller.adaptation.start()
        self.memory = np.array(self.controller.network.start(), dtype=float)
        self._tau = np.zeros(self._shape)
        self.signals = None

    def _time(self, t: float) -> float:
        time = finite_number("t", t)
        if not abs(time / self.period - self._t0 / self.period) < measured.LONGEST:
            near = f"expected a time near the start at {self._t0:g} s"
            raise InputError(f"{near}, found {time:g} s", subject="t", found=time)
        return time

    def _missed(self, t: float) -> int:
        """How many samples went by without a call before time t; 0 where none may be missed."""
        reached = int(np.floor((t - self._t0) / self.period + LATE))
        return max(0, reached - self._samples) if self._may_hold else 0

    @property
    def _may_hold(self) -> bool:
        return self.faults == "hold" and self._samples > 0

    def _off_the_grid(self, t: float, missed: int) -> InputError | None:
        """What is wrong with the time of a call, if anything is."""
        due = self._t0 + (self._samples + missed) * self.period
        late = (t - due) / self.period
        if abs(late) <= LATE:
            return None
        how = f"{late:.3g} periods late" if late > 0 else "time runs backwards, or the call is early"
        sample = f"expected the sample at {due:g} s of a period of {self.period:g} s"
        return InputError(f"{sample}, found {t:g} s: {how}", subject="t", found=t)

    def _hold(self, t: float, missed: int, fault: InputError) -> np.ndarray:
        """The torque that is held; a sample that is due now, or overdue, is missed as well."""
        if not self._may_hold:
            raise fault
        sample = self._samples + missed
        due = t >= self._t0 + (sample - LATE) * self.period
        self._samples, self.held = sample + int(due), self.held + missed + 1
        return self._tau.copy()

    def _reference(self, t: float, desired: np.ndarray | None = None) -> Reference:
        reference = self.cell.references(np.array([t]))[0]
        return reference if desired is None else Reference(desired, reference.weights, reference.t)

    def _heard(self, reference: Reference, motion: np.ndarray, sample: int) -> np.ndarray:
        return self._messages.received(self._due(sample), reference, motion, self.memory)

    def _due(self, sample: int) -> list[float]:
        """Messages of the period that ends with a sample; with the first, those at it."""
        end = self._messages.end
        start = end(sample - 1, self.period, self._t0) if sample else self._t0
        return self._messages.between(start, end(sample, self.period, self._t0))

    def _advance(self, q: np.ndarray, memory: np.ndarray, signals: Signals, missed: int = 0) -> None:
        """Keep what is commanded, and what will be known at the next sample; or nothing, if a part fails."""
        tau = np.clip(signals.tau, -self.torque_limits, self.torque_limits)
        tau = tau if self.include_gravity else tau - measured.gravity_torque(self.cell, q)
        z = after_sample(self.controller.adaptation, self.z, signals.z_dot, self.period)
        self._tau, self.z, self.signals = tau, z, signals
        self.memory = memory + self.period * signals.memory_dot
        self._samples, self.held = self._samples + missed + 1, self.held + missed
