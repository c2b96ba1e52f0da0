"""Gains of the controller, with the paper's symbols; some have a row per robot, of different lengths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, finite_number
from ..coupling.cell import Cell
from ..errors import InputError
from ..tasks.algebra import padded
from .suggest import suggested


@dataclass(frozen=True, eq=False)
class Gains:
    """Diagonal gains, each a number or a vector of diagonal entries.

    K_r and Gamma may differ between robots: give one row per robot, as long as the robot has joints or
    parameters. Lambda, beta and K_eps are the same for all robots of a cell, as the proof requires.

    Args:
        Lambda: convergence rate on the sliding surface, (m,), 1/s, above 0.
        beta: weight of the integrated synchronization error, (m,), 1/s, 0 for independent control.
        K_r: damping, (nv,), (n, nv) or a list of n rows of different lengths, N·m·s/rad, above 0; (m,) or
            (n, m) if it acts in task space.
        K_eps: stiffness of the coupling, (m,), N·m/rad when c has no unit, 0 for independent control.
        leak: rate at which integrals of synchronization errors are forgotten, (m,), 1/s, from 0, as the paper
            has it, to Lambda, which takes them out of the proof: (int epsilon)' = epsilon - leak int epsilon.
        Gamma: rate of the gradient adaptation (14), (P,), (n, P) or a list of n rows of different lengths; 0
            switches the adaptation off. None where a controller is given an adaptation of another kind.

    Raises:
        InputError: not numbers, not finite, or of the wrong sign.
    """

    Lambda: Any
    beta: Any
    K_r: Any
    K_eps: Any
    Gamma: Any = None
    leak: Any = 0.0

    def __post_init__(self) -> None:
        for name, positive in SIGNS.items():
            if name == "Gamma" and self.Gamma is None:
                continue
            gain = read_gain(name, getattr(self, name))
            low = gain.min() if gain.size else 0.0
            if low < 0 or (positive and low == 0):
                bound = "above 0" if positive else "of at least 0"
                raise InputError.expected(f"entries {bound}", low, name)
            object.__setattr__(self, name, gain)

    @classmethod
    def suggest(
        cls,
        cell: Cell,
        bandwidth: float,
        *,
        period: float | None = None,
        payload: float | None = None,
        dt: float = 1e-3,
        duration: float = 5.0,
    ) -> Self:
        """Gains for a cell, for damping that acts in joint space, from its robots' inertia along their paths.

        Lambda = min(omega, top/4) and beta = min(Lambda/lambda_2, top/(4 lambda_n)), with the smallest
        nonzero and the largest eigenvalue of S^T S and the largest rate, top = 0.97/dt or 1.2/period. K_r is
        the larger of 8 omega M_jj and (0.3 |g_j| + |g_load,j|)/(0.1 rad Lambda), cut at light joints so that
        all modes of M^-1 K_r stay below top - Lambda - beta lambda_n. K_eps is a quarter of the largest with
        K_r - d_max/(4 Lambda) J^T c^T K_eps c J > 0, d_max = max (S^T S)_ii. Gamma = gamma tr(D_k P D_k P),
        see `Gradient.pullback`, as large as Y Gamma Y^T <= (K_r^-1/(2 omega) + K_r^-1 M K_r^-1/6)^-1 allows.

        Args:
            cell: the robots and their task; its robots' parameters are taken for what is known of them.
            bandwidth: omega, how fast errors should go away, rad/s.
            period: of sampled control, s; None for continuous control.
            payload: mass that the tips may carry without being told of, kg; by default 2 kg, or a fifth of
                the arm's mass if that is less.
            dt: step of RK4 with which continuous control is simulated, s.
            duration: what of the desired motions is looked at, s.

        Raises:
            InputError: a number that is not positive, or parameters or a space of a user's own that do not
                say what is needed.
            UnreachableError: a path that a robot cannot reach.

        Warns:
            GainWarning: a mode that stays slower than the bandwidth, damping that was cut below what bears
                the payload, or a start so far off the path that the first torque is beyond the limits.
        """
        return cls(**suggested(cell, bandwidth, period, payload, dt, duration))

    def independent(self) -> Self:
        """The same controller without synchronization, beta = K_eps = 0.

        For diagonal weights that do not change it is Slotine and Li's law, in which c has no part; in others
        Lambda acts as c^-1 (Lambda c + c').
        """
        return replace(self, beta=np.zeros_like(self.beta), K_eps=np.zeros_like(self.K_eps))

    def replace(self, **changes: ArrayLike | None) -> Self:
        """These gains with some of them changed.

        Raises:
            InputError: no gain of that name, or a value that such a gain cannot have.
        """
        unknown = set(changes) - set(SIGNS)
        if unknown:
            known, found = ", ".join(SIGNS), ", ".join(sorted(unknown))
            raise InputError.expected(f"some of {known}", found, "gains", shown=found)
        return replace(self, **changes)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and lists under the gains' names; a leak only if there is one."""
        named = (field.name for field in fields(self) if field.name != "leak" or self.leak.any())
        values = {name: getattr(self, name) for name in named}
        return {name: None if value is None else value.tolist() for name, value in values.items()}

    def __repr__(self) -> str:
        """All gains; of long ones the first and the last entries."""
        named = ", ".join(f"{field.name}={_shown(getattr(self, field.name))}" for field in fields(self))
        return f"{type(self).__name__}({named})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Gains) and self.as_dict() == other.as_dict()

    __hash__ = None  # type: ignore[assignment]


#: which gains must be above zero; the others may be zero
SIGNS = {"Lambda": True, "beta": False, "K_r": True, "K_eps": False, "Gamma": False, "leak": False}
#: which gains may differ between robots
_PER_ROBOT = ("K_r", "Gamma")


def read_gain(name: str, gain: Any) -> np.ndarray | RaggedGain:
    """A gain as finite numbers, or as rows where robots have different numbers of entries.

    Raises:
        InputError: not numbers, or not finite.
    """
    if name in _PER_ROBOT and are_ragged(gain):
        return RaggedGain(name, gain)
    return finite_array(name, gain)


def spread(name: str, gain: np.ndarray, shape: tuple[int, ...], otherwise: str = "") -> np.ndarray:
    """A gain as an array of the given shape.

    Raises:
        InputError: the gain has other dimensions; `otherwise` says what else it could have been.
    """
    fits = zip(gain.shape[::-1], shape[::-1], strict=False)
    if gain.ndim > len(shape) or any(found != expected for found, expected in fits):
        shapes = " or ".join(str(shape[k:]) for k in range(len(shape), -1, -1))
        raise InputError.expected(f"a shape of {shapes}{otherwise}", gain.shape, name)
    return np.broadcast_to(gain, shape).copy()


def spread_rows(name: str, gain: np.ndarray | RaggedGain, lengths: Sequence[int]) -> np.ndarray:
    """A gain as an array with a row per robot, (n, longest), padded with zeros if rows are given.

    Args:
        name: of the gain.
        gain: anything that fits (n, longest), or rows of the robots' own lengths.
        lengths: how many entries each robot has use for, (n,).

    Raises:
        InputError: the gain has other dimensions.
    """
    shape, own = (len(lengths), max(lengths)), tuple(lengths)
    if isinstance(gain, RaggedGain):
        if gain.lengths != own:
            expected, found = f"expected a row for each robot, of {_listed(own)} entries", gain.lengths
            raise InputError(f"{expected}, found rows of {_listed(found)}", subject=name, found=found)
        return padded(gain.rows)
    rows = "" if len(set(own)) == 1 else f", or a row for each robot, of {_listed(own)} entries"
    return spread(name, gain, shape, rows)


def _listed(lengths: Sequence[int]) -> str:
    shown = [str(length) for length in lengths[:12]]
    return ", ".join(shown) + (", ..." if len(lengths) > 12 else "")


class RaggedGain:
    """Vectors of different lengths that can be scaled like one array.

    Args:
        name: for messages.
        rows: one vector per robot.

    Raises:
        InputError: a row that is no vector of finite numbers.
    """

    #: a number of numpy's leaves a product with rows to the rows
    __array_ufunc__ = None

    def __init__(self, name: str, rows: Sequence[ArrayLike]):
        self.name = name
        self.rows = tuple(finite_array(f"{name}: row {i}", row, (None,)) for i, row in enumerate(rows, 1))

    @property
    def lengths(self) -> tuple[int, ...]:
        """Number of entries of each row."""
        return tuple(row.size for row in self.rows)

    @property
    def size(self) -> int:
        """Number of all entries."""
        return sum(self.lengths)

    def min(self) -> float:
        """The smallest entry."""
        return min(float(row.min()) for row in self.rows if row.size)

    def any(self) -> bool:
        """Whether an entry is not zero."""
        return any(bool(row.any()) for row in self.rows)

    def tolist(self) -> list[list[float]]:
        """Plain lists, a list per row."""
        return [row.tolist() for row in self.rows]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, i: int) -> np.ndarray:
        return self.rows[i]

    def __mul__(self, factor: Any) -> RaggedGain:
        factor = finite_number("factor", factor)
        return RaggedGain(self.name, [factor * row for row in self.rows])

    __rmul__ = __mul__

    def __repr__(self) -> str:
        return f"[{', '.join(map(_shown, self.rows))}]"


def _shown(gain: np.ndarray | RaggedGain | None) -> str:
    """A gain in one line of four digits, as numpy shortens arrays."""
    if not isinstance(gain, np.ndarray):
        return repr(gain)
    text = np.array2string(gain, precision=4, threshold=12, edgeitems=3, separator=", ")
    return " ".join(text.split())


def are_ragged(value: Any) -> bool:
    """Whether a value consists of vectors of different lengths."""
    if isinstance(value, RaggedGain):
        return True
    if not isinstance(value, (list, tuple)):
        return False
    if not all(isinstance(row, (list, tuple, np.ndarray)) and np.ndim(row[:1]) == 1 for row in value):
        return False
    return len({len(row) for row in value}) > 1
