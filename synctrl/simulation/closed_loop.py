"""Controller and plant as one differential equation over one flat state vector."""

from __future__ import annotations

import numpy as np

from ..control.controller import Controller, Signals
from ..coupling.cell import Reference
from ..errors import InputError, NonFiniteError
from .plant import Plant
from .state import Layout, State


class ClosedLoop:
    """y' = f(t, y) with y = (q, v, z, memory of the network, state of the plant's own), see `State`.

    Args:
        controller: the controller of a cell.
        plant: the true cell.
    """

    def __init__(self, controller: Controller, plant: Plant):
        self.controller, self.plant = controller, plant
        self.cell, self._law = controller.cell, controller.unchecked
        self._z0, self._memory0 = controller.adaptation.start(), np.asarray(controller.network.start())
        self._layout = Layout(self.cell, self._z0.shape, self._memory0.shape, plant.hidden0.size)
        self.size = self._layout.size
        seams = controller.adaptation, controller.law, controller.network
        parts = (controller, *seams, plant, self.cell.space, *self.cell.parameters)
        self._foreign = [type(part) for part in parts if not _is_ours(type(part))]

    def initial_state(self) -> np.ndarray:
        """y at t = 0."""
        cell = self.cell
        parts = (cell.q0, cell.v0, self._z0, self._memory0, self.plant.hidden0)
        return np.concatenate([part.ravel() for part in parts])

    def check_plant(self) -> None:
        """Refuse a plant whose rates do not fit its state; one that fails ends the run later.

        Raises:
            InputError: of another shape.
        """
        q, hidden = self.cell.q0, self.plant.hidden0
        try:
            rates = self.plant.move(q, self.cell.v0, np.zeros(q.shape), hidden)
        except Exception:  # the run will say so, and hand over what it has
            return
        shapes = {"acceleration": q.shape, "rate of its own state": hidden.shape}
        for (what, expected), rate in zip(shapes.items(), rates, strict=True):
            if np.shape(rate) != expected:
                raise InputError(
                    f"plant, {type(self.plant).__qualname__}: expected {expected} numbers as its {what}, "
                    f"found {np.shape(rate)}"
                )

    def state(self, y: np.ndarray | None = None) -> State:
        """The parts of y, or of a new y that holds nothing yet."""
        return State(self._layout, np.empty(self.size) if y is None else y)

    def at(self, t: float) -> ClosedLoop:
        """The loop with the plant as it is at time t; at an edge from the right."""
        plant = self.plant.at(t)
        return self if plant is self.plant else ClosedLoop(self.controller, plant)

    def split(self, y: np.ndarray) -> list[np.ndarray]:
        """Views of q, v, z and the memory of the network in y."""
        state = self.state(y)
        return [state.q, state.v, state.z, state.memory]

    def hidden(self, y: np.ndarray) -> np.ndarray:
        """View of the state of the plant's own in y."""
        return self.state(y).hidden

    def evaluate(
        self, reference: Reference, y: np.ndarray, disturbance: np.ndarray
    ) -> tuple[np.ndarray, Signals]:
        """y' and everything the controller computed on the way.

        Args:
            reference: what is desired at this instant.
            y: state.
            disturbance: torque from outside, (n, nv), N·m.
        """
        rate = self.state()
        signals = self.derive(reference, self.state(y), disturbance, rate)
        return rate.flat, signals

    def derive(
        self, reference: Reference, state: State, disturbance: np.ndarray | None, rate: State
    ) -> Signals:
        """`evaluate` for states whose views are at hand: y' is written into `rate`."""
        signals = self.look(reference, state)
        self.respond(state, signals.tau, disturbance, rate)
        self.watch(state, signals, rate.v)
        rate.z[...], rate.memory[...] = signals.z_dot, signals.memory_dot
        return signals

    def look(self, reference: Reference, state: State) -> Signals:
        """What the controller computes in a state, of which it may keep views."""
        return self._law(reference, state.motion, state.z, state.memory)

    def respond(self, state: State, tau: np.ndarray, disturbance: np.ndarray | None, rate: State) -> None:
        """Write how the plant moves into `rate`, and leave the rates of the controller's state as they are.

        Args:
            state: where it is.
            tau: torque that the controller asks for, (n, nv), N·m.
            disturbance: torque from outside, (n, nv), N·m, or None.
            rate: where the rates go.
        """
        tau = self.plant.applied(tau)
        if disturbance is not None:
            tau = tau + disturbance
        v_dot, hidden_dot = self.plant.move(state.q, state.v, tau, state.hidden)
        rate.q[...], rate.v[...] = state.v, v_dot
        if hidden_dot.size:
            rate.hidden[...] = hidden_dot

    def settled(self, state: State) -> State:
        """The state after a step, with what the adaptation makes of its own, for example projected."""
        z = self.controller.adaptation.settle(state.z)
        if z is not state.z:
            state.z[...] = z
        return state

    def watch(self, state: State, signals: Signals, v_dot: np.ndarray) -> None:
        """Name parts that users wrote when a finite state becomes numbers that mean nothing.

        Raises:
            NonFiniteError: a torque, a rate of an estimate or an acceleration that is not finite; without
                the time, which is not known here.
        """
        if not self._foreign or not np.isfinite(state.flat).all():
            return
        found = {
            "torque": signals.tau,
            "rate of the estimates": signals.z_dot,
            "acceleration": v_dot,
        }
        for what, rows in found.items():
            if not np.isfinite(rows).all():
                i = int(np.argmin(np.isfinite(rows).all(axis=1)))
                names = " or ".join(dict.fromkeys(kind.__qualname__ for kind in self._foreign))
                raise NonFiniteError(
                    f"{names} gives {self.cell.names[i]} {rows[i].tolist()} as its {what}, from a state that "
                    "is finite; expected finite numbers",
                    robot=i,
                    cause="part",
                )


def _is_ours(kind: type) -> bool:
    return kind.__module__.partition(".")[0] == __name__.partition(".")[0]
