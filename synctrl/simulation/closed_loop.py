"""Controller and plant as one differential equation, over one flat state vector with named parts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..checks import finite_array, instance, shaped
from ..control.controller import Controller, Signals
from ..control.measured import check_adaptation
from ..control.network import Messages
from ..coupling.cell import Cell, Reference
from ..errors import GainWarning, InputError, NonFiniteError, warn
from .clock import before
from .devices import Devices
from .plant import MOVING, Plant


class State:
    """Parts of a flat vector y as views of it.

    Attributes:
        flat: y.
        motion: q and v together, (2, n, nv).
        q, v: joint positions and velocities, (n, nv).
        z: state of the adaptation, (n, Z).
        memory: of the network; with `Ideal` the integrals of the synchronization errors, (p, m).
        hidden: state of the plant's own.
    """

    __slots__ = ("flat", "hidden", "memory", "motion", "q", "v", "z")

    def __init__(self, layout: Layout, flat: np.ndarray):
        a, b, c = layout.ends
        self.flat = flat
        self.motion = flat[:a].reshape(layout.motion)
        self.q, self.v = self.motion
        self.z = flat[a:b].reshape(layout.z)
        self.memory = flat[b:c].reshape(layout.memory)
        self.hidden = flat[c:]

    def ahead(self, y: State, h: float, rate: np.ndarray) -> State:
        """This state, made to y + h rate."""
        np.multiply(rate, h, self.flat)
        np.add(self.flat, y.flat, self.flat)
        return self


class Layout:
    """Where the parts are in y.

    Args:
        cell: the cell.
        z, memory: shapes of the state of the adaptation and of the memory of the network.
        hidden: size of the plant's own state.
    """

    def __init__(self, cell: Cell, z: tuple[int, ...], memory: tuple[int, ...], hidden: int):
        self.motion, self.z, self.memory = (2, cell.n, cell.nv), z, memory
        self.ends = tuple(np.cumsum([np.prod(s) for s in (self.motion, self.z, self.memory)]).tolist())
        self.size = self.ends[-1] + hidden


class ClosedLoop:
    """y' = f(t, y) with y = (q, v, z, memory of the network, state of the plant's own), see `State`.

    `derive` is f: `look` asks the controller what it computes in a state, and `respond` asks the plant how it
    moves under the torque. Sampled control calls these two at instants of its own. `evaluate` is `derive`
    for a flat y. At instants between the steps `meet` lets an event of the plant move the state, and
    `settle` lets the adaptation, for example, project its estimates.

    Args:
        controller: the controller of a cell.
        plant: the true cell.
        devices: sensors and actuators, which act under sampled control alone; by default there are none.

    Attributes:
        events: instants at which the plant moves its state, s.
        messages: those of the network.
        chain: what is proved where the robots hold one object together, see `Plant.chain`.

    Raises:
        InputError: events that are no instants, parts of one's own that start from no finite numbers or
            give arrays that do not fit, an admittance on a plant that measures no wrenches, or robots that
            cannot hold what they do.
    """

    def __init__(self, controller: Controller, plant: Plant, devices: Devices | None = None):
        self.controller, self.plant = controller, plant
        self.devices = Devices(controller.cell) if devices is None else devices
        self.cell, self._law = controller.cell, controller.unchecked
        if not _is_ours(type(controller.adaptation)):
            check_adaptation(controller)
        self._z0, network = controller.adaptation.start(), controller.network
        self._memory0 = finite_array(f"network {type(network).__qualname__}, start", network.start())
        where = f"plant {type(plant).__qualname__}, hidden0"
        instance(where, plant.hidden0, np.ndarray, "an array")
        finite_array(where, plant.hidden0, (None,))
        self._layout = Layout(self.cell, self._z0.shape, self._memory0.shape, plant.hidden0.size)
        self.size = self._layout.size
        self.events = finite_array(f"events of the plant {type(plant).__qualname__}", plant.events, (None,))
        self.messages = Messages(self.cell, controller.network)
        if controller.admittance is not None:
            felt = plant.felt(self.cell.q0, self.cell.v0, plant.hidden0)
            shaped(f"plant {type(plant).__qualname__}, felt", felt, (self.cell.n, 6))
        self.chain = plant.chain(controller)
        self._last = self
        seams = controller.adaptation, controller.law, controller.network
        parts = (controller, *seams, plant, self.cell.space, *self.cell.parameters)
        self._foreign = [type(part) for part in parts if not _is_ours(type(part))]

    def initial_state(self) -> np.ndarray:
        """y at t = 0."""
        parts = self.cell.q0, self.cell.v0, self._z0, self._memory0, self.plant.hidden0
        return np.concatenate([part.ravel() for part in parts])

    def check_plant(self) -> None:
        """Refuse a plant whose rates do not fit its state; one that fails ends the run later.

        The package's own are not asked: they fit, and what moves them takes memory that not every run needs.

        Raises:
            InputError: of another shape, or not as many.
        """
        if not _moves_otherwise(self.plant):
            return
        q, hidden = self.cell.q0, self.plant.hidden0
        try:
            rates = self.plant.move(q, self.cell.v0, np.zeros(q.shape), hidden)
        except Exception:  # the run will say so, and hand over what it has
            return
        self._check_given({"acceleration": q.shape, "rate of its own state": hidden.shape}, rates)

    def _check_given(self, shapes: Mapping[str, tuple[int, ...]], found: Any, when: str = "") -> None:
        """Refuse what the plant gives unless it is a tuple of arrays of these shapes."""
        subject = f"plant {type(self.plant).__qualname__}"
        if not isinstance(found, (tuple, list)) or len(found) != len(shapes):
            seen = len(found) if isinstance(found, (tuple, list)) else type(found).__qualname__
            expected = f"expected {len(shapes)}, ({', '.join(shapes)}){when}"
            raise InputError(f"{expected}, found {seen}", subject=subject, found=seen)
        for (what, shape), part in zip(shapes.items(), map(np.shape, found), strict=True):
            if part != shape:
                text = f"expected {shape} numbers as its {what}{when}, found {part}"
                raise InputError(text, subject=subject, found=part)

    def state(self, y: np.ndarray | None = None) -> State:
        """The parts of y, or of a new y that holds nothing yet."""
        return State(self._layout, np.empty(self.size) if y is None else y)

    def at(self, t: float) -> ClosedLoop:
        """The loop with the plant as it is at time t; at an edge from the right."""
        plant, last = self.plant.at(t), self._last
        if plant is self.plant:
            return self
        if plant is not last.plant:
            self._last = last = ClosedLoop(self.controller, plant, self.devices)
        return last

    def split(self, y: np.ndarray) -> list[np.ndarray]:
        """Views of q, v, z and the memory of the network in y."""
        state = self.state(y)
        return [state.q, state.v, state.z, state.memory]

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

    def derive(self, reference: Reference, state: State, disturbance: np.ndarray, rate: State) -> Signals:
        """`evaluate` for states whose views are at hand: y' is written into `rate`."""
        signals = self.look(reference, state)
        self.respond(state, signals.tau, disturbance, rate)
        self.watch(state, signals, rate.v)
        rate.z[...], rate.memory[...] = signals.z_dot, signals.memory_dot
        return signals

    def final(self, t: float, state: State) -> Signals:
        """`derive` at the end of a run, s, with its last loads, for what the controller computes."""
        reference, nothing = self.cell.references(np.array([t]))[0], np.zeros((self.cell.n, self.cell.nv))
        return self.at(before(t)).derive(reference, state, nothing, self.state())

    def look(self, reference: Reference, state: State) -> Signals:
        """What the controller computes in a state, of which it may keep views."""
        return self._law(reference, state.motion, state.z, state.memory, **self.felt(state))

    def felt(self, state: State) -> dict[str, np.ndarray]:
        """Internal wrenches that the plant measures for an admittance, as `wrenches`; nothing without one."""
        if self.controller.admittance is None:
            return {}
        return {"wrenches": self.plant.felt(state.q, state.v, state.hidden)}

    def respond(self, state: State, tau: np.ndarray, disturbance: np.ndarray, rate: State) -> None:
        """Write how the plant moves into `rate`, and leave the rates of the controller's state as they are.

        Args:
            state: where it is.
            tau: torque that the controller asks for, (n, nv), N·m.
            disturbance: torque from outside, (n, nv), N·m.
            rate: where the rates go.
        """
        tau = self.plant.applied(tau) + disturbance
        v_dot, hidden_dot = self.plant.move(state.q, state.v, tau, state.hidden)
        rate.q[...], rate.v[...] = state.v, v_dot
        if rate.hidden.size:
            rate.hidden[...] = hidden_dot

    def settle(self, state: State) -> bool:
        """Let the adaptation make of its own state what it does after a step, for example project it.

        Returns:
            Whether that moved the state.
        """
        z = self.controller.adaptation.settle(state.z)
        moved = z is not state.z and not np.array_equal(z, state.z)
        if moved:
            state.z[...] = z
        return moved

    def warn(self) -> None:
        """Say which conditions of the theorem for a closed chain do not hold, and do harm."""
        for text in () if self.chain is None else self.chain.warnings:
            warn(text, GainWarning)

    def meet(self, t: float, state: State) -> None:
        """Make the state before the plant's event at time t the one after it.

        Raises:
            InputError: the plant gives something of another shape, or not as many.
            NonFiniteError: it makes a finite state infinite.
        """
        parts = {"positions": state.q, "velocities": state.v, "state of its own": state.hidden}
        sound, when = np.isfinite(state.flat).all(), f" after the event at {t:g} s"
        found = self.plant.meet(t, state.q, state.v, state.hidden)
        self._check_given({name: part.shape for name, part in parts.items()}, found, when)
        arrays = [np.array(part, float) for part in found]  # copies: they may be views of the state
        for (name, part), after in zip(parts.items(), arrays, strict=True):
            if sound and not np.isfinite(after).all():
                kind = type(self.plant).__qualname__
                text = f"{kind} gives {after.tolist()} as its {name}{when}; expected finite numbers"
                raise NonFiniteError(text, time=t, cause="part")
            part[...] = after

    def watch(self, state: State, signals: Signals, v_dot: np.ndarray) -> None:
        """Name parts that users wrote when a finite state becomes numbers that mean nothing.

        Raises:
            NonFiniteError: a torque, a rate of estimates or of the network's memory, or an acceleration that
                is not finite; without the time, which is not known here.
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
                raise self._lost(f"{self.cell.names[i]} {rows[i].tolist()} as its {what}", rows[i], i)
        if not np.isfinite(signals.memory_dot).all():
            found = signals.memory_dot
            raise self._lost(f"{found.tolist()!s:.200} as the rate of its memory", found, None)

    def _lost(self, what: str, found: np.ndarray, robot: int | None) -> NonFiniteError:
        names = " or ".join(dict.fromkeys(kind.__qualname__ for kind in self._foreign))
        text = f"{names} gives {what}, from a state that is finite; expected finite numbers"
        return NonFiniteError(text, robot=robot, cause="part").about(names, found=found)


def _moves_otherwise(plant: Plant) -> bool:
    """Whether somebody else says how a plant moves, by its class or by itself."""
    kinds = (vars(kind) for kind in type(plant).__mro__ if not _is_ours(kind) and kind is not object)
    own = set(vars(plant)) - {"_dynamics"}  # which is kept there once it is made
    return bool(MOVING.intersection(own) or any(MOVING.intersection(names) for names in kinds))


def _is_ours(kind: type) -> bool:
    return kind.__module__.partition(".")[0] == __name__.partition(".")[0]
