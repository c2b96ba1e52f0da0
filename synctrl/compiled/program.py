"""A cell as a compiled program: kinds of robots, generated code, and arrays as the C driver wants them."""

from __future__ import annotations

import ctypes
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..control.adaptation.gradient import BoundGradient
from ..control.controller import Controller
from ..coupling.cell import Reference
from ..errors import CompilationError
from ..robots.mechanism import mechanism
from ..simulation.closed_loop import ClosedLoop
from ..simulation.plant import Plant
from ..tasks.pose import MAX_ANGLE
from .build import cached_library, content_key, require_casadi
from .kind import Classified, Kind, classify
from .known import check_known, check_untouched
from .specimen import Specimen
from .structs import CellStruct, ReferenceStruct, WorkStruct
from .trace import Trace

#: relative difference between generated code and the reference engine above which the code is refused
AGREEMENT = 1e-9


def generate(kinds: list[Kind]) -> Iterator[str]:
    """C sources one after another: one per function of each kind of robot, and the driver."""
    import casadi as ca

    for k, kind in enumerate(kinds):
        trace = Trace(kind, f"kind{k}")
        makers = [trace.control, trace.plant, trace.measure]  # those that take long to compile first
        for make in makers if kind.learning is None else [*makers, trace.estimate]:
            function = make()
            generator = ca.CodeGenerator(f"{function.name()}.c")
            generator.add(function)
            yield _unchecked(generator.dump())
    yield _table(kinds) + (Path(__file__).parent / "driver.c").read_text(encoding="utf-8")


def _unchecked(source: str) -> str:
    """Generated code without its tests for arguments and results left out: the driver leaves none out."""
    source = re.sub(r"arg\[\d+\]\? (arg\[\d+\]\[\d+\]) : 0;", r"\1;", source)
    return re.sub(r"if \(res\[\d+\]!=0\) res", "res", source)


def _table(kinds: list[Kind]) -> str:
    """Declarations of the generated functions, and the array `kinds`."""
    lines = [
        "typedef int (*Function)(const double **, double **, long long *, double *, int);",
        "typedef int (*Sizes)(long long *, long long *, long long *, long long *);",
        "typedef struct { Function measure, control, plant, estimate; Sizes sizes[4];",
        "                 int nv, cartesian, pose; } Kind;",
    ]
    rows = []
    for k, kind in enumerate(kinds):
        functions = ["measure", "control", "plant", *([] if kind.learning is None else ["estimate"])]
        names = [f"kind{k}_{function}" for function in functions]
        for name in names:
            lines.append(f"int {name}(const double **, double **, long long *, double *, int);")
            lines.append(f"int {name}_work(long long *, long long *, long long *, long long *);")
        works = ", ".join(f"{name}_work" for name in names)
        none = ", 0" if kind.learning is None else ""  # an adaptation whose state is theta_hat itself
        flags = f"{kind.nv}, {int(kind.space != 'joint')}, {int(kind.space == 'pose')}"
        rows.append(f"    {{{', '.join(names)}{none}, {{{works}{none}}}, {flags}}},")
    return "\n".join(
        [*lines, "static const Kind kinds[] = {", *rows, "};", f"enum {{ KINDS = {len(kinds)} }};\n"]
    )


class CompiledLoop:
    """A closed loop as a loaded library with its arrays.

    Args:
        loop: controller and plant of a cell of known parts.
        index: which kind each robot is.
        bases: placement of the first joint of each robot.
        library: made for these kinds.

    Attributes:
        scratch: sizes of the scratch arrays arg, res, iw and w that the generated functions ask for.
    """

    def __init__(self, loop: ClosedLoop, index: list[int], bases: list[Any], library: ctypes.CDLL):
        self.loop, self.library = loop, library
        self._keep: list[np.ndarray] = []
        self.cell = self._cell(index, bases)
        self.scratch = _work_sizes(library)
        self.work = self._work(library)

    def state_dot(self, reference: Reference, y: np.ndarray, disturbance: np.ndarray) -> np.ndarray:
        """y' at one instant, for comparison with `ClosedLoop.evaluate`."""
        y_dot = np.zeros(self.loop.size)
        desired = np.ascontiguousarray(reference.desired.swapaxes(0, 1))
        weights = np.ascontiguousarray(np.stack(reference.weights, axis=1))
        table = ReferenceStruct(desired.ctypes.data, weights.ctypes.data, 1, 1)
        pointers = (np.ascontiguousarray(part).ctypes for part in (y, disturbance))
        y_data, disturbance_data = (pointer.data_as(ctypes.c_void_p) for pointer in pointers)
        self.library.state_dot(
            ctypes.byref(self.cell), ctypes.byref(table), y_data, disturbance_data,
            y_dot.ctypes.data_as(ctypes.c_void_p), ctypes.byref(self.work),
        )  # fmt: skip
        return y_dot

    def address(self, array: np.ndarray) -> int:
        """Address of an array that lives as long as the loop."""
        self._keep.append(array)
        return array.ctypes.data

    # -- internals ----------------------------------------------------------------------------------------

    def _cell(self, index: list[int], bases: list[Any]) -> CellStruct:
        controller, cell, plant = self.loop.controller, self.loop.cell, self.loop.plant
        coupling = cell.coupling
        bodies = 10 * max(robot.body_count for robot in cell.robots)
        base = np.array([np.append(b.rotation.ravel(), b.translation) for b in bases])
        first, incident, incident_sign = coupling.incidence
        W_inv, posture, gain = _posture(controller)
        arrays = (
            np.array(index, dtype=np.intc), coupling.edges.astype(np.intc), coupling.signs.copy(),
            first.astype(np.intc), incident.astype(np.intc), incident_sign.copy(),
            controller.Lambda, controller.beta, controller.K_eps, controller.K_r, gamma_of(controller),
            W_inv, posture, gain, base, _carried(plant, bodies), plant.viscous, plant.coulomb,
            plant.smoothing[:, 0], plant.torque_limits,
        )  # fmt: skip
        learned = controller.adaptation.start().shape[1]
        sizes = (cell.n, cell.m, cell.nv, cell.theta.shape[1], learned, coupling.pairs, bodies)
        limit = float(getattr(cell.space, "max_condition", np.inf))
        addresses = [self.address(np.ascontiguousarray(array)) for array in arrays]
        columns = controller.K_r.shape[1], coupling.edges.shape[1]
        rubs = int(plant.viscous.any() or plant.coulomb.any())
        flags = rubs, int(plant.saturate)
        return CellStruct(*sizes, *addresses, *flags, *columns, limit, MAX_ANGLE)

    def _work(self, library: ctypes.CDLL) -> WorkStruct:
        cell, size = self.loop.cell, self.loop.size
        n, m, nv, p = cell.n, cell.m, cell.nv, cell.coupling.pairs
        arg, res, iw, w = _work_sizes(library)
        scratch = [max(w, m * m), iw, arg, res]
        lengths = [*scratch, n * 7 * m, n * 2 * nv, n * (3 * m * nv + m * m), p * 2 * m, n * 3 * m]
        lengths += [n * nv, n * nv, n * m, n * nv]
        buffers = [self.address(np.zeros(length + 1)) for length in lengths]
        k = (ctypes.c_void_p * 4)(*(self.address(np.zeros(size)) for _ in range(4)))
        rest = [self.address(np.zeros(length)) for length in (size, n, size, n * nv)]
        carried = None  # what is carried in a step is told before it
        return WorkStruct(*buffers, carried, k, *rest)


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
        classified = classify(loop.controller)
        self.kinds = len(classified.kinds)
        library = _library(loop, classified, {} if libraries is None else libraries)
        super().__init__(loop, classified.kind_of, classified.bases, library)


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
        raise CompilationError("the library was made from other code")
    specimen = Specimen(loop, classified)
    small = specimen.loop
    bases = [mechanism(robot)[1] for robot in small.cell.robots]
    found = CompiledLoop(small, specimen.index, bases, library)
    for case in specimen.cases():
        expected = small.evaluate(*case)[0]
        _agree(small.split(expected), small.split(found.state_dot(*case)))


def _agree(expected: list[np.ndarray], found: list[np.ndarray]) -> None:
    for name, a, b in zip(("q'", "v'", "theta_hat'", "epsilon"), expected, found, strict=True):
        difference = np.abs(b - a).max(initial=0.0) / (1 + np.abs(a).max(initial=0.0))
        if not difference < AGREEMENT:
            raise CompilationError(
                f"generated code differs from Pinocchio by {difference:.2g} relative in {name} at a random "
                "state; use engine='pinocchio', and please report the cell"
            )


def gamma_of(controller: Controller) -> np.ndarray:
    """Gamma of (14), (n, P); zeros, which nothing reads, for another adaptation."""
    adaptation = controller.adaptation
    if isinstance(adaptation, BoundGradient):
        return adaptation.Gamma
    return np.zeros(controller.cell.theta.shape)


def _carried(plant: Plant, bodies: int) -> np.ndarray:
    """True inertial parameters with every load of the schedule, (windows, n, bodies)."""
    windows = plant.schedule.robots
    pi = np.zeros((len(windows), len(windows[0]), bodies))
    for rows, robots in zip(pi, windows, strict=True):
        for row, robot in zip(rows, robots, strict=True):
            row[: 10 * robot.body_count] = robot.inertial_parameters
    return pi


def _posture(controller: Controller) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    cell = controller.cell
    redundancy = getattr(cell.space, "redundancy", None)
    if redundancy is not None:
        return redundancy.spread(cell.robots)
    zero = np.zeros((cell.n, cell.nv))
    return zero, zero, zero


def _work_sizes(library: ctypes.CDLL) -> tuple[int, int, int, int]:
    """Sizes of the scratch arrays, as the generated code asks for them."""
    sizes = (ctypes.c_longlong * 4)()
    library.work_sizes(sizes)
    return tuple(sizes)
