"""A cell as a compiled program: kinds of robots, generated code, and arrays as the C driver wants them."""

from __future__ import annotations

import ctypes
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...control.controller import Controller
from ...errors import CompilationError, InputError
from ...robots.friction_parameters import FrictionParameters
from ...robots.mechanism import Mechanism, mechanism
from ...robots.parameters import FullParameters, LinearParameters
from ...tasks.cell import Reference
from ...tasks.pose import MAX_ANGLE, PoseSpace
from ...tasks.spaces import CartesianSpace, JointSpace
from ..closed_loop import ClosedLoop
from ..plant import Plant
from .build import cached_library, content_key, require_casadi
from .kind import Kind
from .structs import CellStruct, ReferenceStruct, WorkStruct
from .trace import Trace

#: relative difference between generated code and the reference engine above which the code is refused
AGREEMENT = 1e-9


def classify(controller: Controller) -> tuple[list[Kind], list[int], list[Any]]:
    """The kinds of robots in a cell, which one each robot is, and the placement of its first joint.

    Raises:
        InputError: the cell uses something the compiled engine does not have.
    """
    cell = controller.cell
    found = [mechanism(robot) for robot in cell.robots]
    bases = [base for _, base in found]
    names = [repr(fixed.key()) for fixed, _ in found]
    rotations: dict[str, set[bytes]] = {}
    for name, base in zip(names, bases, strict=True):
        rotations.setdefault(name, set()).add((base.rotation + 0.0).tobytes())  # -0 counts as 0
    kinds: dict[str, Kind] = {}
    index = []
    for i, (name, (fixed, base)) in enumerate(zip(names, found, strict=True)):
        same = len(rotations[name]) == 1
        kind = _kind(controller, i, fixed, base.rotation if same else None)
        key = repr(kind.key())
        kinds.setdefault(key, kind)
        index.append(list(kinds).index(key))
    return list(kinds.values()), index, bases


def _kind(controller: Controller, i: int, fixed: Mechanism, rotation: np.ndarray | None) -> Kind:
    cell, parameters = controller.cell, controller.cell.parameters[i]
    rigid = parameters.base if isinstance(parameters, FrictionParameters) else parameters
    if not isinstance(rigid, (FullParameters, LinearParameters)):
        raise InputError(
            f"engine='compiled' knows full and linear parameters, found {type(rigid).__name__} for "
            f"{cell.names[i]}; use engine='pinocchio'"
        )
    gravity = cell.robots[i].gravity_vector
    space, rows = _space(controller)
    return Kind(
        fixed,
        space,
        rows,
        getattr(rigid, "matrix", None),
        rotation,
        (float(gravity[0]), float(gravity[1]), float(gravity[2])),
        controller.reference_acceleration,
        controller.k_r_space,
        getattr(parameters, "smoothing", None),
        getattr(parameters, "armature", False),
    )


def _space(controller: Controller) -> tuple[str, tuple[int, ...]]:
    space = controller.cell.space
    if getattr(space, "damping", None) is not None:
        raise InputError(
            "engine='compiled' does not damp singular configurations; use singularity='stop', or "
            "engine='pinocchio'"
        )
    if type(space) is JointSpace:
        return "joint", ()
    if type(space) is CartesianSpace:
        return "position", tuple(space.rows)
    if type(space) is PoseSpace:
        return "pose", ()
    raise InputError(f"engine='compiled' does not know the space {space!r}; use engine='pinocchio'")


def generate(kinds: list[Kind]) -> Iterator[str]:
    """C sources one after another: one per function of each kind of robot, and the driver."""
    import casadi as ca

    for k, kind in enumerate(kinds):
        trace = Trace(kind, f"kind{k}")
        for make in (trace.control, trace.plant, trace.measure):  # those that take long to compile first
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
        "typedef struct { Function measure, control, plant; Sizes sizes[3]; int nv, cartesian, pose; } Kind;",
    ]
    rows = []
    for k, kind in enumerate(kinds):
        names = [f"kind{k}_{function}" for function in ("measure", "control", "plant")]
        for name in names:
            lines.append(f"int {name}(const double **, double **, long long *, double *, int);")
            lines.append(f"int {name}_work(long long *, long long *, long long *, long long *);")
        works = ", ".join(f"{name}_work" for name in names)
        flags = f"{kind.nv}, {int(kind.space != 'joint')}, {int(kind.space == 'pose')}"
        rows.append(f"    {{{', '.join(names)}, {{{works}}}, {flags}}},")
    return "\n".join(
        [*lines, "static const Kind kinds[] = {", *rows, "};", f"enum {{ KINDS = {len(kinds)} }};\n"]
    )


class Program:
    """A closed loop as a loaded library with its arrays.

    Args:
        loop: controller and plant of a cell.
        libraries: libraries that are loaded already, by what they were made for; this program's is added.

    Attributes:
        kinds: number of different robots, each with generated functions of its own.
        scratch: sizes of the scratch arrays arg, res, iw and w that the generated functions ask for.

    Raises:
        InputError: the cell uses something the compiled engine does not have.
        MissingDependencyError: CasADi or a C compiler is missing.
        CompilationError: the code cannot be compiled, or computes something else than the reference engine.
    """

    def __init__(self, loop: ClosedLoop, libraries: dict[str, ctypes.CDLL] | None = None):
        self.loop = loop
        kinds, index, bases = classify(loop.controller)
        self._keep: list[np.ndarray] = []
        self.cell = self._cell(index, bases)
        self.kinds = len(kinds)
        self.library = self._library(kinds, {} if libraries is None else libraries)
        self.scratch = _work_sizes(self.library)
        self.work = self._work(self.library)

    def state_dot(self, reference: Reference, y: np.ndarray, disturbance: np.ndarray) -> np.ndarray:
        """y' at one instant, for comparison with `ClosedLoop.evaluate`."""
        return self._state_dot(self.library, self.work, reference, y, disturbance)

    # -- internals ----------------------------------------------------------------------------------------

    def address(self, array: np.ndarray) -> int:
        """Address of an array that lives as long as the program."""
        self._keep.append(array)
        return array.ctypes.data

    def _library(self, kinds: list[Kind], libraries: dict[str, ctypes.CDLL]) -> ctypes.CDLL:
        keys = [kind.key() for kind in kinds]
        name = json.dumps(keys)
        if name not in libraries:
            key = content_key(keys, require_casadi())
            libraries[name] = cached_library(key, lambda: generate(kinds), self._check)
        return libraries[name]

    def _cell(self, index: list[int], bases: list[Any]) -> CellStruct:
        controller, cell, plant = self.loop.controller, self.loop.cell, self.loop.plant
        coupling = cell.coupling
        bodies = 10 * max(robot.body_count for robot in cell.robots)
        pi = np.zeros((cell.n, bodies))
        for i, robot in enumerate(cell.robots):
            pi[i, : 10 * robot.body_count] = robot.inertial_parameters
        base = np.array([np.append(b.rotation.ravel(), b.translation) for b in bases])
        first, incident, incident_sign = coupling.incidence
        W_inv, posture, gain = _posture(controller)
        arrays = (
            np.array(index, dtype=np.intc), coupling.edges.astype(np.intc), coupling.signs.copy(),
            first.astype(np.intc), incident.astype(np.intc), incident_sign.copy(),
            controller.Lambda, controller.beta, controller.K_eps, controller.K_r, controller.Gamma,
            W_inv, posture, gain, base, pi, plant.viscous, plant.coulomb, plant.smoothing[:, 0],
        )  # fmt: skip
        sizes = (cell.n, cell.m, cell.nv, cell.theta.shape[1], coupling.pairs, bodies)
        limit = float(getattr(cell.space, "max_condition", np.inf))
        addresses = [self.address(np.ascontiguousarray(array)) for array in arrays]
        columns = controller.K_r.shape[1], coupling.edges.shape[1]
        rubs = int(plant.viscous.any() or plant.coulomb.any())
        return CellStruct(*sizes, *addresses, rubs, *columns, limit, MAX_ANGLE)

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
        return WorkStruct(*buffers, k, *rest)

    def _check(self, library: ctypes.CDLL) -> None:
        """Compare a new library with Pinocchio at random states."""
        loop, work = self.loop, self._work(library)
        rng = np.random.default_rng(0)
        plant = Plant(loop.cell)
        for t in (0.0, 0.1, 0.4):
            reference = loop.cell.references(np.array([t]))[0]
            y = loop.initial_state() + 0.1 * rng.standard_normal(loop.size) * self._used()
            disturbance = rng.standard_normal(plant.viscous.shape) * self._joints()
            expected = loop.evaluate(reference, y, disturbance)[0]
            found = self._state_dot(library, work, reference, y, disturbance)
            difference = np.abs(found - expected).max() / (1 + np.abs(expected).max())
            if not difference < AGREEMENT:
                raise CompilationError(
                    f"generated code differs from Pinocchio by {difference:.2g} relative at a random state; "
                    "use engine='pinocchio', and please report the cell"
                )

    def _used(self) -> np.ndarray:
        """1 for entries of the state that are no padding, else 0."""
        cell = self.loop.cell
        joints = self._joints()
        parameters = np.zeros(cell.theta.shape)
        for i, kind in enumerate(cell.parameters):
            parameters[i, : len(kind.theta)] = 1
        integral = np.ones(cell.coupling.pairs * cell.m)
        return np.concatenate([joints.ravel(), joints.ravel(), parameters.ravel(), integral])

    def _joints(self) -> np.ndarray:
        cell = self.loop.cell
        return (np.arange(cell.nv) < np.array([robot.nv for robot in cell.robots])[:, None]).astype(float)

    def _state_dot(
        self,
        library: ctypes.CDLL,
        work: WorkStruct,
        reference: Reference,
        y: np.ndarray,
        disturbance: np.ndarray,
    ) -> np.ndarray:
        y_dot = np.zeros(self.loop.size)
        desired = np.ascontiguousarray(reference.desired.swapaxes(0, 1))
        weights = np.ascontiguousarray(np.stack(reference.weights, axis=1))
        table = ReferenceStruct(desired.ctypes.data, weights.ctypes.data, 1, 1)
        pointers = (np.ascontiguousarray(part).ctypes for part in (y, disturbance))
        y_data, disturbance_data = (pointer.data_as(ctypes.c_void_p) for pointer in pointers)
        library.state_dot(
            ctypes.byref(self.cell), ctypes.byref(table), y_data, disturbance_data,
            y_dot.ctypes.data_as(ctypes.c_void_p), ctypes.byref(work),
        )  # fmt: skip
        return y_dot


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
