"""The controller as a digital controller runs it: called once a period, in any loop.

The continuous law of `controller.py` is evaluated at every sample; until the next one the torque is held, and
the estimates and the integrals of the synchronization errors move on with the rates found there. A driver, a
simulator or a notebook calls the same object that sampled simulation calls.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import boolean, choice, finite_array, finite_number, instance, positive_number
from ..errors import InputError, NonFiniteError, ResultError
from ..tasks.cell import Reference
from .controller import Controller, Signals

#: how far from its place on the grid of samples a call may come, as a share of the period
LATE = 0.1
FAULTS = "error", "hold"


class DiscreteController:
    """A controller with memory that is asked for torque once a period.

    With x = (state of the adaptation, memory of the network), x' = f by (14) and (28), tau by (13) or (32):

        tau_k = tau(t_k, q_k, v_k, x_k),   x_{k+1} = x_k + period f(t_k, q_k, v_k, x_k).

    Rows are robots; joints that a robot does not have are zeros, on the way in and on the way out.

    Args:
        controller: the law.
        period: time between two calls of `step`, s.
        torque_limits: (n, nv), N·m, beyond which torque is cut off; by default it is not.
        include_gravity: False for robots that add the torque of gravity by themselves: it is then taken off,
            as the robots' descriptions have it.
        faults: what a measurement that is not finite, a period that was missed, or a time that runs
            backwards does. "error" refuses it. "hold" keeps the torque and learns nothing from it.

    Attributes:
        held: how many calls and periods were held until now.
        signals: what the last sample computed, or None before the first.

    Raises:
        InputError: a period that is not positive, limits of another shape, an unknown word.
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
        self.controller, self.cell = controller, controller.cell
        self.period = positive_number("period", period)
        self.include_gravity = boolean("include_gravity", include_gravity)
        self.faults = choice("faults", faults, FAULTS)
        self._shape = self.cell.n, self.cell.nv
        self._limits = _limits(torque_limits, self._shape)
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
        self._start(finite_number("t", t))
        finite_array("q", q, self._shape), finite_array("v", v, self._shape)

    def step(self, t: float, q: ArrayLike, v: ArrayLike, desired: ArrayLike | None = None) -> np.ndarray:
        """Torque for the period that begins now, (n, nv), N·m; the caller's to keep.

        Args:
            t: time, s, within a tenth of a period of the grid that `reset` began.
            q, v: what is measured, (n, nv), rad (or m) and rad/s (or m/s).
            desired: xd, xd', xd'', (3, n, m), as the cell's trajectories give them; by default theirs at t.

        Raises:
            InputError: another shape; and, unless faults are held, a number that is not finite, a time that
                runs backwards, or a missed period.
            NonFiniteError: the law has no finite torque here, as at a singular Jacobian.
        """
        time, motion = finite_number("t", t), _measured(q, v, self._shape)
        wanted = None if desired is None else finite_array("desired", desired, (3, self.cell.n, self.cell.m))
        may_hold = self.faults == "hold" and self._samples > 0
        if may_hold:
            self._skip_to(self._reached(time))
        fault = self._off_the_grid(time) or self._not_finite(time, motion)
        if fault is None:
            return self._sample(time, motion, wanted)
        if not may_hold:
            raise InputError(fault)
        self._skip_to(self._reached(time) + 1)
        return self._tau.copy()

    # -- memory -------------------------------------------------------------------------------------------

    @property
    def state(self) -> dict[str, np.ndarray]:
        """Everything that the next step depends on, as plain arrays.

        `z`, (n, Z), state of the adaptation, which is theta_hat for the paper's; `sync_integral`, (p, m),
        unit of c e times s, or `network_state`, memory of a network that keeps something else; `tau`,
        (n, nv), N·m, the torque that is held; `start`, s, and `samples`, the place on the grid; `held`.
        """
        return {
            "z": self.z.copy(),
            self._memory_name: self.memory.copy(),
            "tau": self._tau.copy(),
            "start": np.array(self._t0),
            "samples": np.array(float(self._samples)),
            "held": np.array(float(self.held)),
        }

    @state.setter
    def state(self, state: Mapping[str, ArrayLike]) -> None:
        kept = self.state
        if not isinstance(state, Mapping) or set(state) != set(kept):
            found = sorted(state) if isinstance(state, Mapping) else type(state).__name__
            raise InputError(f"state: expected arrays called {', '.join(sorted(kept))}, found {found}")
        new = {name: finite_array(f"state, {name}", state[name], kept[name].shape) for name in kept}
        self.z, self.memory = new["z"].copy(), new[self._memory_name].copy()
        self._tau, self._t0 = new["tau"].copy(), float(new["start"])
        self._samples, self.held = int(new["samples"]), int(new["held"])

    def save(self, path: str | Path) -> Path:
        """Write the state to an .npz file.

        Raises:
            ResultError: the file cannot be written.
        """
        instance("path", path, (str, Path), "a path")
        try:
            with Path(path).open("wb") as file:
                np.savez(file, **self.state)  # type: ignore[arg-type]
        except OSError as error:
            raise ResultError(f"cannot write the controller's state to '{path}': {error}") from error
        return Path(path)

    def load(self, path: str | Path) -> None:
        """Read what `save` wrote, of a controller for the same cell.

        Raises:
            ResultError: the file is missing, damaged, or of another cell.
        """
        instance("path", path, (str, Path), "a path")
        try:
            with np.load(Path(path), allow_pickle=False) as content:
                state: dict[str, Any] = {name: content[name] for name in content.files}
            self.state = state
        except Exception as error:  # whatever a damaged archive makes its readers raise
            raise ResultError(f"'{path}' has no state of this controller: {error}") from error

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
        self.signals: Signals | None = None

    def _reached(self, t: float) -> int:
        """Number of the last instant of the grid that time t has come to."""
        return int(np.floor((t - self._t0) / self.period + LATE))

    def _skip_to(self, sample: int) -> None:
        """Let the samples before this one go by: nothing was measured then."""
        missed = max(0, sample - self._samples)
        self._samples, self.held = self._samples + missed, self.held + missed

    def _off_the_grid(self, t: float) -> str | None:
        """What is wrong with the time of a call, if anything is."""
        due = self._t0 + self._samples * self.period
        late = (t - due) / self.period
        if abs(late) <= LATE:
            return None
        how = f"{late:.3g} periods late" if late > 0 else "time runs backwards, or the call is early"
        return f"t: expected the sample at {due:g} s of a period of {self.period:g} s, found {t:g} s: {how}"

    def _not_finite(self, t: float, motion: np.ndarray) -> str | None:
        """What is wrong with a measurement, if anything is."""
        if np.isfinite(motion).all():
            return None
        part, robot, joint = np.argwhere(~np.isfinite(motion))[0]
        return (
            f"{'qv'[part]}: expected finite numbers, found {motion[part, robot, joint]} for joint "
            f"{joint + 1} of {self.cell.names[robot]} at t = {t:g} s"
        )

    def _sample(self, t: float, motion: np.ndarray, desired: np.ndarray | None) -> np.ndarray:
        reference = self.cell.references(np.array([t]))[0]
        if desired is not None:
            reference = Reference(desired, reference.weights, reference.t)
        signals = self.controller.unchecked(reference, motion, self.z, self.memory)
        self._tau = self._commanded(t, motion[0], signals)
        self.z = self.controller.adaptation.settle(self.z + self.period * signals.z_dot)
        self.memory = self.memory + self.period * signals.memory_dot
        self._samples, self.signals = self._samples + 1, signals
        return self._tau.copy()

    def _commanded(self, t: float, q: np.ndarray, signals: Signals) -> np.ndarray:
        """What goes to the motors of the torque that the law asks for."""
        bad = np.flatnonzero(~np.isfinite(signals.tau).all(axis=1))
        if bad.size:
            name = self.cell.names[bad[0]]
            raise NonFiniteError(
                f"the law has no finite torque for {name} at t = {t:g} s: its Jacobian may be singular, or "
                "the loop unstable; stop the robots and reset the controller",
                time=t,
                robot=int(bad[0]),
            )
        tau = signals.tau if self.include_gravity else signals.tau - self._gravity(q)
        return np.clip(tau, -self._limits, self._limits)

    def _gravity(self, q: np.ndarray) -> np.ndarray:
        g = np.zeros(self._shape)
        for row, robot, q_i in zip(g, self.cell.robots, q, strict=True):
            row[: robot.nv] = robot.gravity(q_i[: robot.nv])
        return g


def _measured(q: ArrayLike, v: ArrayLike, shape: tuple[int, int]) -> np.ndarray:
    """q and v, (2, n, nv), of the right shape; whether they are finite is asked later."""
    motion = np.empty((2, *shape))
    for row, name, value in zip(motion, "qv", (q, v), strict=True):
        try:
            array = np.asarray(value, dtype=float)
        except (TypeError, ValueError) as error:
            raise InputError(f"{name}: expected numbers, found {value!r}") from error
        if array.shape != shape:
            raise InputError(f"{name}: expected shape {shape}, one row per robot, found {array.shape}")
        row[...] = array
    return motion


def _limits(limits: ArrayLike | None, shape: tuple[int, int]) -> np.ndarray:
    if limits is None:
        return np.full(shape, np.inf)
    array = np.asarray(limits, dtype=float)
    if array.shape != shape or not (array >= 0).all():
        raise InputError(f"torque_limits: expected numbers of at least 0 of shape {shape}, found {limits!r}")
    return array.copy()
