"""From a synchronization function f(x_1, ..., x_n, t) = 0, eq. (2), to its coupling."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..checks import count, finite_array, finite_number, instance, positive_number
from ..errors import CouplingError, InputError, SynchronizationError
from ..tasks.chebyshev import NotSmoothError, fit_smooth
from ..tasks.trajectories import Trajectory
from .coupling import Coupling
from .expansion import Expansion, expand, least_linear
from .member_checks import check_trajectory
from .weights import DERIVATIVES, ConstantWeights, FunctionWeights, SmoothWeights, WeightSource, as_matrices

#: a number of evenly spaced instants of a run
INSTANTS = 401
#: f may bend, or be off zero on the desired motion, by these shares of the size of its terms
LINEAR, SATISFIED = 1e-9, 1e-6

MatrixFunction = Callable[[float], ArrayLike]
GraphLike = Callable[..., Coupling]


class SynchronizationFunction:
    """A task: f(x_1, ..., x_n, t) = 0, linear in the task coordinates x_i of the robots (assumption 1).

    f(x, t) = sum_i A_i(t) x_i + b(t); the weights are c_i(t) = -df/dx_i = -A_i(t), eq. (5). They have to be
    invertible, so f returns as many numbers as each x_i has. Every c(t) costs n m + 1 calls of f: for many
    robots, `from_matrices` is faster.

    Args:
        function: f, called with n arrays (m,) and the time in s, returns (m,); for n = 2, f(x_1, x_2, t).
        robots: n.
        dimension: m.
        unit: unit of the weights, "" if they have none.

    Raises:
        InputError: numbers of robots or dimensions that are not positive, or something that is no function.
    """

    def __init__(self, function: Callable[..., ArrayLike], robots: int, dimension: int, unit: str = ""):
        instance("function", function, Callable, "f(x_1, ..., x_n, t)")  # type: ignore[arg-type]
        self.function, self.unit = function, unit
        self.robots, self.dimension = count("robots", robots, 2), count("dimension", dimension)
        self._matrices: MatrixFunction | None = None
        self._given: WeightSource | None = None

    @classmethod
    def from_matrices(
        cls,
        A: ArrayLike | MatrixFunction,
        dimension: int,
        b: ArrayLike | MatrixFunction = 0.0,
        *,
        A_dot: MatrixFunction | None = None,
        A_ddot: MatrixFunction | None = None,
        unit: str = "",
    ) -> Self:
        """The function f = sum_i A_i(t) x_i + b(t).

        Args:
            A: numbers, (n,), diagonals, (n, m), or matrices, (n, m, m), or a function of t returning them.
            dimension: m.
            b: number or (m,), or a function of t returning it.
            A_dot, A_ddot: the derivatives of A as functions of t; both, or none to have them computed.
            unit: unit of A.
        """
        if (A_dot is None) != (A_ddot is None):
            raise InputError("expected both or none, found one", subject="A_dot, A_ddot")
        A_of_t, b_of_t = _as_function(A), _as_function(b)
        robots = np.atleast_1d(finite_array("A", A_of_t(0.0))).shape[0]

        def matrices(t: float) -> np.ndarray:
            return as_matrices(finite_array("A", A_of_t(t)), dimension)

        def function(*arguments: Any) -> np.ndarray:
            *x, t = arguments
            return np.matvec(matrices(t), np.array(x)).sum(axis=0) + b_of_t(t)

        made = cls(function, robots, dimension, unit)
        made._matrices = matrices
        if not callable(A):
            made._given = ConstantWeights(-matrices(0.0))
        elif A_dot is not None and A_ddot is not None:
            parts = (A, A_dot, A_ddot)
            made._given = FunctionWeights(robots, lambda t: tuple(-np.asarray(part(t)) for part in parts))  # type: ignore[arg-type,return-value]
        return made

    # -- the function and its derivatives -----------------------------------------------------------------

    def __call__(self, x: ArrayLike, t: float) -> np.ndarray:
        """f, (k,), at positions x, (n, m), and time t.

        Raises:
            SynchronizationError: the function fails, or returns something else than finite numbers.
        """
        rows = finite_array("x", x, (self.robots, self.dimension))
        try:
            value = finite_array("f", self.function(*rows, float(t)))
        except Exception as error:
            raise SynchronizationError(
                f"f(x_1, ..., x_{self.robots}, t) cannot be evaluated at t = {t:g} s: {error}"
            ).about("function", time=float(t)) from error
        return np.atleast_1d(value).ravel()

    def c(self, t: float) -> np.ndarray:
        """Weights c_i(t) = -df/dx_i of a linear function, (n, k, m)."""
        if self._matrices is not None:
            return -np.asarray(self._matrices(t))
        n, m = self.robots, self.dimension
        base = self(np.zeros((n, m)), t)
        # For a linear function any step is exact; one as large as b keeps b from swallowing A x.
        step = 2.0 ** np.ceil(np.log2(max(1.0, np.abs(base).max())))
        probes = step * np.eye(n * m).reshape(-1, n, m)
        columns = np.array([self(probe, t) - base for probe in probes]) / step
        return -columns.T.reshape(len(base), n, m).swapaxes(0, 1)

    def expand(self, x: ArrayLike, t: float = 0.0) -> Expansion:
        """First- and second-order terms of (5) about positions x, (n, m); f need not be linear."""
        x = finite_array("x", x, (self.robots, self.dimension))
        t = finite_number("t", t)
        return expand(lambda positions: self(positions, t), x, t)

    def weights(self, duration: float) -> WeightSource:
        """c_i(t), c_i'(t) and c_i''(t) from 0 to `duration`, in s.

        Derivatives that were not given are accurate to 1e-8, see `chebyshev.tolerances`.

        Raises:
            SynchronizationError: they are not smooth enough to certify that.
        """
        if self._given is not None:
            return self._given
        try:
            smooth = fit_smooth(self.c, positive_number("duration", duration))
        except NotSmoothError as error:
            raise SynchronizationError(
                f"the weights cannot be differentiated: {DERIVATIVES[error.order]} of robot {error.row + 1}: "
                f"{error}, or its derivatives, see SynchronizationFunction.from_matrices"
            ).about(DERIVATIVES[error.order], robot=error.row, time=error.time) from None
        constant = smooth.constant()
        return SmoothWeights(smooth) if constant is None else ConstantWeights(constant)

    # -- use ----------------------------------------------------------------------------------------------

    def coupling(
        self, trajectories: Sequence[Trajectory], duration: float, graph: GraphLike | None = None
    ) -> Coupling:
        """The coupling of this task, after checking all that the theorems ask of it.

        By default there is one synchronization error, eq. (6) undivided: epsilon = sum_i c_i e_i, which is
        f(x_1, ..., x_n, t) itself. The paper divides (6) into the pairs of a ring, eq. (27), so that a robot
        only has to know its neighbours: `graph=Coupling.ring`. These ask for more than f = 0, namely
        c_1 e_1 = -c_2 e_2 = c_3 e_3 = ...; a graph whose errors vanish without f = 0 is refused.

        Args:
            trajectories: desired motions, one per robot.
            duration: time for which it will be used, s.
            graph: called with n, c=, unit=: `Coupling.ring`, or a function of yours.

        Raises:
            SynchronizationError: f is not linear; a weight is not square or loses its inverse; the desired
                motion does not satisfy f = 0, eq. (3); a derivative cannot be certified; or the graph does
                not imply f = 0. The message says which robot, when, and by how much.
        """
        times = np.linspace(0.0, positive_number("duration", duration), INSTANTS)
        xd = self._desired(trajectories, times)
        self._check_form(xd, times)
        source = self.weights(duration)
        try:
            coupling = self._couple(source, graph)
            coupling.check_weights(times, self.dimension)
        except SynchronizationError:
            raise
        except CouplingError as error:
            raise SynchronizationError(str(error)).about(**vars(error)) from error
        self._check_satisfied(xd, times, source)
        coupling.task = self, float(duration)
        return coupling

    def _couple(self, source: WeightSource, graph: GraphLike | None) -> Coupling:
        if graph is not None:
            instance("graph", graph, Callable, "a function such as Coupling.ring")  # type: ignore[arg-type]
            coupling = graph(self.robots, c=source, unit=self.unit)
        elif self.robots == 2:
            coupling = Coupling.pair(source, self.unit)
        else:
            coupling = Coupling.sum(self.robots, source, self.unit)
        _check_implied(coupling)
        return coupling

    # -- checks -------------------------------------------------------------------------------------------

    def _desired(self, trajectories: Sequence[Trajectory], times: np.ndarray) -> np.ndarray:
        """Desired positions, (T, n, m)."""
        instance("trajectories", trajectories, Sequence, "one for each robot")
        if len(trajectories) != self.robots:
            raise InputError.expected(
                f"one for each of {self.robots} robots", len(trajectories), "trajectories"
            )
        coordinates = tuple(f"coordinate {k}" for k in range(1, self.dimension + 1))
        for i, trajectory in enumerate(trajectories, start=1):
            check_trajectory(f"robot {i}", trajectory, coordinates)
        return np.stack([trajectory(times).x for trajectory in trajectories], axis=1)

    def _check_form(self, xd: np.ndarray, times: np.ndarray) -> None:
        """Assumption 1, and weights that are square."""
        k, m = len(self(xd[0], times[0])), self.dimension
        defects = []
        if k != m:
            defects.append(
                f"it returns {k} number{'s' * (k != 1)} for coordinates of dimension {m}, so that every c_i "
                f"is {k} by {m} and has no inverse (expected {m} numbers)"
            )
        bend, robots = self._bend(xd, times)
        defects += [bend] if bend else []
        if defects:
            failure = SynchronizationError(f"f cannot be controlled: {'; and '.join(defects)}")
            raise failure.about("function", found=k, robots=robots)

    def _bend(self, xd: np.ndarray, times: np.ndarray) -> tuple[str, tuple[int, ...]]:
        """What is not linear in f, if anything is, at random positions about the desired ones."""
        rng = np.random.default_rng(0)
        for k in np.linspace(0, len(times) - 1, 12).astype(int):
            t, spread = times[k], 1.0 + np.abs(xd[k]).max()
            x = xd[k] + spread * rng.standard_normal(xd[k].shape)
            base, c, value = self(0 * x, t), self.c(t), self(x, t)
            size = np.abs(base) + np.abs(value) + np.matvec(np.abs(c), np.abs(x)).sum(axis=0)
            if (np.abs(value - base + np.matvec(c, x).sum(axis=0)) > LINEAR * size).any():
                return self._explain(c, x, xd[k], t)
        return "", ()

    def _explain(self, c: np.ndarray, x: np.ndarray, xd: np.ndarray, t: float) -> tuple[str, tuple[int, ...]]:
        """How f is not linear, and in which robots' coordinates."""
        i, j, bend = least_linear(lambda positions: self(positions, t), c, x)
        robots = f"robot {i + 1}" if i == j else f"robots {j + 1} and {i + 1} together"
        text = (
            f"it is not linear (assumption 1) in the coordinates of {robots}: at t = {t:g} s f is off by "
            f"{bend:.3g} where x_{i + 1} = {x[i].tolist()}"
        )
        if x.size <= 12:
            try:
                terms = self.expand(xd, t).second_order_terms()
                text += f"; the second-order terms of (5) are there {', '.join(terms) or 'zero'}"
            except SynchronizationError as error:
                text += f"; {error}"
        return text, tuple(sorted({i, j}))

    def _check_satisfied(self, xd: np.ndarray, times: np.ndarray, source: WeightSource) -> None:
        """Equation (3): f = 0 on the desired motion."""
        f = np.array([self(x, t) for x, t in zip(xd, times, strict=True)])
        w = source.at(times, self.dimension)
        size = np.abs(np.matvec(w.c, xd)).sum(axis=1).max() + np.abs(f).max()
        if np.abs(f).max() > SATISFIED * size:
            k = int(np.argmax(np.abs(f).max(axis=1)))
            shifts = np.matvec(w.c_inv[k], f[k])
            i = int(np.argmin(np.linalg.norm(shifts, axis=1)))
            failure = SynchronizationError(
                f"the desired motion does not satisfy f = 0, eq. (3): at t = {times[k]:g} s f is "
                f"{f[k].tolist()}; for f = 0 robot {i + 1} alone would have to be moved by "
                f"{shifts[i].tolist()} from {xd[k, i].tolist()}"
            )
            data = {"time": float(times[k]), "found": f[k].tolist(), "shift": shifts[i].tolist()}
            raise failure.about("trajectories", robot=i, **data)


def _as_function(value: ArrayLike | MatrixFunction) -> MatrixFunction:
    if callable(value):
        return value
    constant = finite_array("matrices", value)
    return lambda t: constant


def _check_implied(coupling: Coupling) -> None:
    """All epsilon = 0 must imply sum_i c_i e_i = 0, eq. (6)."""
    if coupling.edges.shape == (1, coupling.robots) and coupling.robots != 2:
        ratios = 1 / coupling.signs[0]
        implied = (ratios == ratios[0]).all()
        motion = "any motion"
    else:
        w = coupling.synchronized_motion
        implied = w is None or abs(w.sum()) <= 1e-9 * np.abs(w).sum()
        motion = f"c_i e_i in the ratio {np.array2string(w, threshold=8)}" if w is not None else ""
    if not implied:
        raise SynchronizationError(
            f"the graph '{coupling.name}' does not imply f = 0: its errors vanish with {motion}, whose sum "
            "is not 0 as (6) demands; use Coupling.sum, or Coupling.ring for an even number of robots"
        ).about("graph", found=coupling.name)
