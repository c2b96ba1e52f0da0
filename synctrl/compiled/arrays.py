"""A closed loop's arrays as the driver wants them, beside a loaded library."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from functools import cached_property
from math import prod
from typing import Any

import numpy as np

from ..assembly.plant import CarryingPlant
from ..control.adaptation.gradient import BoundGradient
from ..coupling.cell import Reference
from ..simulation.closed_loop import ClosedLoop
from ..simulation.guard import limits_of
from ..simulation.plant import Plant
from . import structs
from .address import Vectors
from .carrying import carrying_constants, held_constants
from .header import largest
from .hearing import exchange_of
from .kind import Classified
from .lanes import Lanes, aligned, compared, room, state_parts
from .plugged import learner
from .quantities import DESIRED, SLIDE, checked, owned_by, shape

#: dimensions of arrays one after another that do not stand in lanes
PLAIN = 3


class CompiledLoop:
    """A closed loop as a loaded library with its arrays.

    Args:
        loop: controller and plant of a cell of known parts.
        classified: what kinds of robots there are, and which one each robot of the cell is.
        library: made for these kinds.
        scattered: whether the library's lanes are robots; else they are runs.

    Attributes:
        lanes: how arrays stand in lanes.
        sizes: lengths of rows, see `SIZES`, and the numbers of robots, pairs and objects, n, p and o, and
            r and h, of what network and plant remember.
        cell, quantities, work: what the driver is given; see `structs.py`.
        parameters: true inertial parameters with every load, (loads, n, 10 bodies).
        carried: the same, lumped, as generated code reads them, (loads, n, bodies).

    Raises:
        CompilationError: an array of another shape than generated code reads.
    """

    def __init__(
        self, loop: ClosedLoop, classified: Classified, library: ctypes.CDLL, scattered: bool = False
    ):
        self.loop, self.library = loop, library
        self._weighing = classified.kinds[0].weighing
        self._lumpings = [classified.kinds[k].lumping for k in classified.kind_of]
        width = int(library.lanes())
        self.lanes = Lanes(width, scattered and width > 1)
        cell, objects = loop.cell, int(isinstance(loop.plant, CarryingPlant))
        self.sizes = {**largest(classified.kinds), "n": cell.n, "p": cell.coupling.pairs, "o": objects}
        self.sizes |= {"r": loop.controller.network.start().size, "h": loop.plant.hidden0.size}
        self._keep: list[np.ndarray] = []
        self._own: set[str] = set()
        self._scratch: list[np.ndarray] = []
        self.cell = self._cell(classified)
        self.quantities = structs.Quantities()
        self.constants = {
            name: checked(name, array, self.sizes) for name, array in _constants(loop, classified).items()
        }
        # copies: what `put` writes is neither the loop's nor what `reset` goes back to
        self._arrays = {name: aligned(self._packed(name, array)) for name, array in self.constants.items()}
        self._arrays |= {name: room(*shape(name, self._rows), width) for name in owned_by("work")}
        for name, array in self._arrays.items():
            setattr(self.quantities, name, self.address(array))
        self.work = self._work()
        self.parameters = _carried(loop.plant)
        self.carried = self.lumped(self.parameters)

    def lumped(self, pi: np.ndarray) -> np.ndarray:
        """True inertial parameters, (..., n, 10 bodies), as generated code reads them, (..., n, bodies)."""
        found = np.zeros((*pi.shape[:-1], self.sizes["bodies"]))
        for i, lumping in enumerate(self._lumpings):
            size, count = lumping.matrix.shape
            found[..., i, :size] = pi[..., i, :count] @ lumping.matrix.T
        return found

    def packed_state(self, y: np.ndarray) -> np.ndarray:
        """A flat state in lanes, flat."""
        parts, begin = [], 0
        for name, rows, length in state_parts(self.sizes, y.size):
            part = y[begin : begin + rows * length].reshape(rows, length)
            parts.append(self._packed(name, part).ravel())
            begin += rows * length
        return aligned(np.concatenate(parts))

    def unpacked_state(self, packed: np.ndarray, y: np.ndarray) -> None:
        """The opposite: write the state of the run, or of the first of the runs, to y."""
        found, begin = [], 0
        for name, rows, length in state_parts(self._rows, packed.size // self.lanes.width):
            size = rows * length * self.lanes.width
            part = packed[begin : begin + size].reshape(rows, length, self.lanes.width)
            found.append(self.lanes.unpacked(name, part, self.sizes).ravel())
            begin += size
        y[...] = np.concatenate(found)

    def state_dot(self, reference: Reference, y: np.ndarray, disturbance: np.ndarray) -> np.ndarray:
        """y' at one instant, for comparison with `ClosedLoop.evaluate`."""
        y, first, found = self.packed_state(y), np.zeros(1, dtype=np.intc), np.zeros(self.loop.size)
        y_dot = room(y.size)
        desired = dict(zip((*DESIRED, *SLIDE), reference.desired, strict=False))
        weights = self._weighing.numbers(reference.weights)
        t = np.full(2, float(reference.t))
        addresses = {"disturbed": first, "loaded": first, "t": t}
        steps = structs.Steps(**{name: array.ctypes.data for name, array in addresses.items()})
        self.tell(steps, {**desired, "weights": weights, "disturbance": disturbance, "pi": self.carried})
        self.call("state_dot", steps, y, y_dot)
        self.unpacked_state(y_dot, found)
        return found

    def hold(self, hidden: np.ndarray) -> None:
        """Let those hands hold the object that do so in this state of the plant's own."""
        for name, array in held_constants(self.loop, hidden).items():
            self._arrays[name][...] = self._packed(name, array)

    def reset(self) -> None:
        """Give all runs the constants of the loop again, after `put`, and nothing that was computed."""
        for name in self._own:
            self._arrays[name][...] = self._packed(name, self.constants[name])
        self._own.clear()
        for part in (*self._scratch, *map(self._arrays.__getitem__, owned_by("work"))):
            part[...] = 0

    def put(self, name: str, array: np.ndarray) -> None:
        """Give every run a constant of its own, (rows, columns, lanes)."""
        self._arrays[name][...] = array
        self._own.add(name)

    def tell_apart(self, steps: structs.Steps, name: str, array: np.ndarray) -> None:
        """Say what acts in the steps of every run, (windows, rows, columns, lanes); see `tell`."""
        kept = aligned(array)
        size = prod(shape(name, self._rows))
        setattr(steps, name, structs.Arrays(kept.ctypes.data, size if len(kept) > 1 else 0, None))
        steps.kept[name] = kept

    def tell(self, steps: structs.Steps, arrays: Mapping[str, np.ndarray]) -> None:
        """Say what is desired and acts in steps, instead of what was said before.

        Args:
            steps: they keep the arrays.
            arrays: of quantities that change from step to step, by name; one, or several one after another,
                as they are or `ready`.

        Raises:
            CompilationError: an array of another shape than generated code reads.
        """
        for name, found in self.ready(arrays).items():
            size, spread = prod(shape(name, self._rows)), None
            if found.ndim == PLAIN:
                spread = steps.kept.setdefault(f"spread {name}", room(size, self.lanes.width)).ctypes.data
            stride = size if len(found) > 1 else 0
            setattr(steps, name, structs.Arrays(found.ctypes.data, stride, spread))
            steps.kept[name] = found

    def ready(self, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Arrays as `tell` hands them on: in lanes, (k, rows, columns, lanes), or plain, (k, rows, columns).

        Plain ones are the same for all runs, and are spread over their lanes one after another.

        Raises:
            CompilationError: an array of another shape than generated code reads.
        """
        return {name: self._ready(name, array) for name, array in arrays.items()}

    def call(self, function: str, steps: structs.Steps, y: np.ndarray, *others: Any) -> None:
        """Call a function of the driver with its structures, a state, and further arrays or structures."""
        given = [ctypes.byref(part) for part in (self.cell, self.quantities, self.work, steps)]
        rest = [
            part.ctypes.data_as(ctypes.c_void_p) if isinstance(part, np.ndarray) else ctypes.byref(part)
            for part in (y, *others)
        ]
        called = getattr(self.library, function)
        called.restype = None
        called(*given, *rest)

    def address(self, array: np.ndarray) -> int:
        """Address of an array that lives as long as the loop."""
        self._keep.append(array)
        return array.ctypes.data

    # -- internals ----------------------------------------------------------------------------------------

    @cached_property
    def _rows(self) -> dict[str, int]:
        """Sizes, with numbers of rows as the code has them."""
        return self.lanes.sizes(self.sizes)

    def _ready(self, name: str, array: np.ndarray) -> np.ndarray:
        """See `ready`."""
        if array.ndim > PLAIN:
            return array
        found = checked(name, array, self.sizes)
        found = found if found.ndim == PLAIN else found[None]
        shared = self.lanes.width > 1 and not self.lanes.scattered
        return found if shared and len(found) > 1 else self._packed(name, found)

    def _packed(self, name: str, array: np.ndarray) -> np.ndarray:
        return self.lanes.packed(name, array, self.sizes)

    def _cell(self, classified: Classified) -> structs.Cell:
        cell, plant, coupling = self.loop.cell, self.loop.plant, self.loop.cell.coupling
        kinds = [*np.array(classified.kind_of)[self.lanes.members(cell.n)[:, 0]], len(classified.kinds)]
        tables = {"kind": np.array(kinds), **compared(coupling, self.lanes, cell.m)._asdict()}
        found = {
            name: self.address(
                aligned(table) if "sign" in name else np.ascontiguousarray(table, dtype=np.intc)
            )
            for name, table in tables.items()
        }
        return structs.Cell(
            **{name: self._rows[name] for name in ("n", "p", "o", "r", "h")},
            robots=cell.n,
            pairs=coupling.pairs,
            arity=coupling.edges.shape[1],
            scattered=int(self.lanes.scattered),
            rubs=int(plant.rubs),
            saturates=int(plant.saturate),
            exchange=exchange_of(self.loop.controller.network, self.address),
            **found,
        )

    def _work(self) -> structs.Work:
        parts = state_parts(self._rows, 0)[:-1]
        size = sum(rows * length for _, rows, length in parts) + self._rows["h"]
        lengths = {"stage": size, "held": size, "side": self._rows["n"]}
        found = {name: self.address(self._vectors(length)) for name, length in lengths.items()}
        rates = (Vectors * 4)(*(self.address(self._vectors(size)) for _ in range(4)))
        return structs.Work(k=rates, **found)

    def _vectors(self, length: int) -> np.ndarray:
        """Room for so many numbers of all lanes."""
        self._scratch.append(room(length + 1, self.lanes.width))
        return self._scratch[-1]


def _constants(loop: ClosedLoop, classified: Classified) -> dict[str, np.ndarray]:
    """Arrays of the quantities that do not change in a run, by name; zeros for those that nothing reads."""
    controller, plant, cell = loop.controller, loop.plant, loop.cell
    found = {
        name: np.atleast_2d(getattr(controller, name)) for name in ("Lambda", "beta", "K_eps", "leak", "K_r")
    }
    found |= {name: getattr(plant, name) for name in ("viscous", "coulomb", "smoothing")}
    learns, zeros = learner(controller), np.zeros_like(cell.theta)
    redundancy = getattr(cell.space, "redundancy", None)
    W_inv, posture, gain = redundancy.spread(cell.robots) if redundancy else np.zeros((3, cell.n, cell.nv))
    return {
        **found,
        "Gamma": learns.Gamma if isinstance(learns, BoundGradient) else zeros,
        "base": _placements(classified.bases),
        "true_base": _placements(classified.true_bases),
        "W_inv": W_inv,
        "posture": posture,
        "gain": gain,
        "limits": plant.torque_limits,
        "bounds": np.array([[*limits_of(cell.task).values()]]),
        **carrying_constants(loop),
    }


def _placements(bases: Sequence[Any]) -> np.ndarray:
    """Rotation by rows, and translation, (n, 12)."""
    return np.array([np.append(base.rotation.ravel(), base.translation) for base in bases])


def _carried(plant: Plant) -> np.ndarray:
    """True inertial parameters with every load of the schedule, (windows, n, 10 bodies)."""
    windows = plant.schedule.robots
    bodies = max(robot.body_count for robot in windows[0])
    pi = np.zeros((len(windows), len(windows[0]), 10 * bodies))
    for rows, robots in zip(pi, windows, strict=True):
        for row, robot in zip(rows, robots, strict=True):
            row[: 10 * robot.body_count] = robot.inertial_parameters
    return pi
