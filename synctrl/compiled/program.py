"""A cell as a compiled program: kinds of robots, generated code, and arrays as the C driver wants them."""

from __future__ import annotations

import ctypes
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from ..assembly.plant import CarryingPlant
from ..control.adaptation.gradient import BoundGradient
from ..coupling.cell import Reference
from ..errors import CompilationError
from ..simulation.closed_loop import ClosedLoop, State
from ..simulation.guard import limits_of
from ..simulation.plant import Plant
from . import structs
from .address import Doubles
from .build import cached_library, content_key, require_casadi
from .carrying import carrying_constants, held_constants, object_function
from .hearing import exchange_of
from .kind import Classified, Kind, classify, standing
from .known import check_known, check_untouched
from .plugged import learner
from .quantities import DESIRED, SLIDE, checked, owned_by, shape
from .specimen import Specimen
from .structs import header, largest
from .trace import Trace

#: relative difference between generated code and the reference engine above which the code is refused
AGREEMENT = 1e-9


def generate(kinds: list[Kind]) -> Iterator[str]:
    """C sources one after another: one per function of each kind of robot and of objects, and the driver."""
    for k, kind in enumerate(kinds):
        for function in Trace(kind, f"kind{k}").functions():
            yield _written(function)
    if any(kind.holds for kind in kinds):
        yield _written(object_function(f"kind{len(kinds)}_object"))
    parts = (Path(__file__).parent / name for name in ("network.c", "driver.c"))
    yield header(kinds) + "".join(part.read_text(encoding="utf-8") for part in parts)


def _written(function: Any) -> str:
    """A function in C, without its tests for arguments and results left out: the driver leaves none out."""
    import casadi as ca

    generator = ca.CodeGenerator(f"{function.name()}.c")
    generator.add(function)
    source = generator.dump()
    source = re.sub(r"arg\[\d+\]\? (arg\[\d+\]\[\d+\]) : 0;", r"\1;", source)
    return re.sub(r"if \(res\[\d+\]!=0\) res", "res", source)


class CompiledLoop:
    """A closed loop as a loaded library with its arrays.

    Args:
        loop: controller and plant of a cell of known parts.
        classified: what kinds of robots there are, and which one each robot of the cell is.
        library: made for these kinds.

    Attributes:
        sizes: lengths of rows, see `SIZES`, and the numbers of robots, pairs and objects, n, p and o, and
            r and h, of what network and plant remember.
        weighing: structure of the weights.
        cell, quantities, work: what the driver is given; see `structs.py`.
        carried: true inertial parameters, lumped, with every load, (loads, n, bodies).
        scratch: sizes of the scratch arrays arg, res, iw and w that the generated functions ask for.

    Raises:
        CompilationError: an array of another shape than generated code reads.
    """

    def __init__(self, loop: ClosedLoop, classified: Classified, library: ctypes.CDLL):
        self.loop, self.library = loop, library
        self.weighing = classified.kinds[0].weighing
        cell, objects = loop.cell, int(isinstance(loop.plant, CarryingPlant))
        self.sizes = {**largest(classified.kinds), "n": cell.n, "p": cell.coupling.pairs, "o": objects}
        self.sizes |= {"r": loop.controller.network.start().size, "h": loop.plant.hidden0.size}
        self._keep: list[np.ndarray] = []
        self.cell = self._cell([*classified.kind_of, len(classified.kinds)])
        self.quantities = structs.Quantities()
        arrays = {name: np.zeros(shape(name, self.sizes)) for name in owned_by("work")}
        self._arrays = {
            name: checked(name, array, self.sizes)
            for name, array in {**arrays, **_constants(loop, classified)}.items()
        }
        for name, array in self._arrays.items():
            setattr(self.quantities, name, self.address(array))
        sizes = (ctypes.c_longlong * 4)()
        library.work_sizes(sizes)
        self.scratch = tuple(sizes)
        self.work = self._work()
        self.carried = _carried(loop.plant, classified, self.sizes["bodies"])

    def state_dot(self, reference: Reference, y: np.ndarray, disturbance: np.ndarray) -> np.ndarray:
        """y' at one instant, for comparison with `ClosedLoop.evaluate`."""
        y, y_dot, first = np.ascontiguousarray(y), np.zeros(self.loop.size), np.zeros(1, dtype=np.intc)
        desired = dict(zip((*DESIRED, *SLIDE), reference.desired, strict=False))
        weights = self.weighing.numbers(reference.weights)
        t = np.full(2, float(reference.t))
        addresses = {"disturbed": first, "loaded": first, "t": t}
        steps = structs.Steps(**{name: array.ctypes.data for name, array in addresses.items()})
        self.tell(steps, {**desired, "weights": weights, "disturbance": disturbance, "pi": self.carried})
        self.call("state_dot", steps, y, y_dot)
        return y_dot

    def hold(self, hidden: np.ndarray) -> None:
        """Let those hands hold the object that do so in this state of the plant's own."""
        for name, array in held_constants(self.loop, hidden).items():
            self._arrays[name][...] = array

    def tell(self, steps: structs.Steps, arrays: Mapping[str, np.ndarray]) -> None:
        """Say what is desired and acts in steps, instead of what was said before.

        Args:
            steps: they keep the arrays.
            arrays: of quantities that change from step to step, by name; one, or several one after another.

        Raises:
            CompilationError: an array of another shape than generated code reads.
        """
        for name, array in arrays.items():
            kept = checked(name, array, self.sizes)
            size = prod(shape(name, self.sizes))
            setattr(steps, name, structs.Arrays(kept.ctypes.data, size if kept.size > size else 0))
            steps.kept[name] = kept

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

    def _cell(self, kind_of: list[int]) -> structs.Cell:
        cell, plant = self.loop.cell, self.loop.plant
        coupling = cell.coupling
        first, incident, incident_sign = coupling.incidence
        lists = {"kind": kind_of, "edge": coupling.edges, "first": first, "incident": incident}
        found = {name: self.address(np.array(part, dtype=np.intc)) for name, part in lists.items()}
        signs = {"sign": coupling.signs, "incident_sign": incident_sign}
        found |= {name: self.address(np.array(part, dtype=float)) for name, part in signs.items()}
        return structs.Cell(
            n=cell.n,
            p=coupling.pairs,
            **{name: self.sizes[name] for name in ("o", "r", "h")},
            arity=coupling.edges.shape[1],
            rubs=int(plant.rubs),
            saturates=int(plant.saturate),
            exchange=exchange_of(self.loop.controller.network, self.address),
            **found,
        )

    def _work(self) -> structs.Work:
        arg, res, iw, w = self.scratch
        size, n = self.loop.size, self.sizes["n"]
        lengths = {"arg": arg, "res": res, "iw": iw, "w": w, "stage": size, "held": size, "side": n}
        found = {name: self.address(np.zeros(length + 1)) for name, length in lengths.items()}
        rates = (Doubles * 4)(*(self.address(np.zeros(size)) for _ in range(4)))
        return structs.Work(k=rates, **found)


class Program(CompiledLoop):
    """A closed loop as a library that was found in the cache or built, and was compared with Pinocchio.

    Args:
        loop: controller and plant of a cell.
        libraries: libraries that are loaded already, by what they were made for; this program's is added.

    Attributes:
        kinds: number of different robots, each with generated functions of its own.

    Raises:
        InputError: the cell uses something the compiled engine does not have, such as a user's subclass.
        MissingDependencyError: CasADi or a C compiler is missing.
        CompilationError: the code cannot be compiled, or computes something else than the reference engine.
    """

    def __init__(self, loop: ClosedLoop, libraries: dict[str, ctypes.CDLL] | None = None):
        check_known(loop)
        classified = classify(loop)
        self.kinds = len(classified.kinds)
        library = _library(loop, classified, {} if libraries is None else libraries)
        super().__init__(loop, classified, library)


def _library(loop: ClosedLoop, classified: Classified, libraries: dict[str, ctypes.CDLL]) -> ctypes.CDLL:
    keys = [kind.key() for kind in classified.kinds]
    name = json.dumps(keys)
    if name not in libraries:
        check_untouched(loop)
        key = content_key(keys, require_casadi())
        libraries[name] = cached_library(
            key, lambda: generate(classified.kinds), lambda library: _compare(library, loop, classified)
        )
    return libraries[name]


def _compare(library: ctypes.CDLL, loop: ClosedLoop, classified: Classified) -> None:
    """Compare a library with Pinocchio, on one robot of each kind.

    Raises:
        CompilationError: they differ.
    """
    if not (hasattr(library, "work_sizes") and hasattr(library, "state_dot")):
        raise CompilationError("the library was made from other code", subject="generated code")
    specimen = Specimen(loop, classified)
    small = specimen.loop
    bases = (standing(robots).bases for robots in (small.cell.robots, small.plant.robots))
    found = CompiledLoop(small, Classified(classified.kinds, specimen.index, *bases), library)
    for case in specimen.cases():
        rates = small.evaluate(*case)[0], found.state_dot(*case)
        _agree(*map(small.state, rates))


def _rates(rate: State) -> dict[str, np.ndarray]:
    """Parts of a rate by the names of what changes with it."""
    return {
        "q'": rate.q,
        "v'": rate.v,
        "z'": rate.z,
        "memory'": rate.memory,
        "the plant's state'": rate.hidden,
    }


def _agree(expected: State, found: State) -> None:
    parts = _rates(found)
    for name, a in _rates(expected).items():
        b = parts[name]
        difference = np.abs(b - a).max(initial=0.0) / (1 + np.abs(a).max(initial=0.0))
        if not difference < AGREEMENT:
            raise CompilationError(
                f"it differs from Pinocchio by {difference:.2g} relative in {name} at a random state; use "
                "engine='pinocchio', and please report the cell",
                subject="generated code",
                found=float(difference),
            )


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


def _carried(plant: Plant, classified: Classified, bodies: int) -> np.ndarray:
    """True inertial parameters, lumped, with every load of the schedule, (windows, n, bodies)."""
    lumps = [classified.kinds[k].lumping for k in classified.kind_of]
    windows = plant.schedule.robots
    pi = np.zeros((len(windows), len(windows[0]), bodies))
    for rows, robots in zip(pi, windows, strict=True):
        for row, robot, lumping in zip(rows, robots, lumps, strict=True):
            row[: lumping.size] = lumping.matrix @ robot.inertial_parameters
    return pi
