"""Base parameters: the fewest numbers that determine a robot's torque, found from its regressor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..checks import choice, finite_array
from ..errors import RobotError
from .parameters import FullParameters, LinearParameters, Parameters
from .robot import Robot

#: random states per parameter; far more equations than unknowns
STATES = 4
#: singular values below this share of the largest count as 0
ZERO = 1e-8
#: how many times larger than those that count as 0 the others must be
GAP = 1e4
#: entries of K below this are rounding
TINY = 1e-9
#: parameters by name
KINDS = ("full", "base")


@dataclass(frozen=True, eq=False)
class Grouping:
    """Which combinations of parameters a torque depends on: Y = Y[:, columns] K.

    Attributes:
        columns: independent columns of Y, (r,); a column is taken if those before it do not determine it.
        K: theta_base = K theta, (r, P); an identity in the independent columns.
        singular_values: of Y over random states, with its columns scaled to length 1, (P,); columns that are
            zero stay zero.
        condition: ratio of the largest to the smallest singular value of the independent columns, scaled.
    """

    columns: np.ndarray
    K: np.ndarray
    singular_values: np.ndarray
    condition: float

    @property
    def rank(self) -> int:
        """Number of base parameters."""
        return len(self.columns)

    def names(self, names: Sequence[str]) -> tuple[str, ...]:
        """What is grouped into every base parameter, such as `joint1.Izz + 0.09 joint2.m`."""
        return tuple(_combination(row, names) for row in self.K)


def grouping(parameters: Parameters, nv: int, name: str = "robot") -> Grouping:
    """The identifiable combinations of a robot's parameters, found numerically.

    The regressor is evaluated at random states; a column belongs to the basis when it is no combination of
    the columns before it (the diagonal of R in Y = Q R), so that bodies near the base come first.

    Args:
        parameters: what is adapted.
        nv: number of joints.
        name: of the robot, for messages.

    Raises:
        RobotError: there is no clear gap between singular values that are zero and those that are not.
    """
    return group_columns(_random_rows(parameters, nv), name)


def group_columns(Y: np.ndarray, name: str = "robot") -> Grouping:
    """The same for a matrix, (rows, P), such as a regressor stacked over many states.

    Raises:
        RobotError: there is no clear gap between singular values that are zero and those that are not.
    """
    lengths = np.linalg.norm(Y, axis=0)
    used = lengths > ZERO * lengths.max(initial=0.0)
    scaled = np.where(used, Y / np.where(used, lengths, 1.0), 0.0)
    values = np.linalg.svd(scaled, compute_uv=False)
    rank = _rank(values, name)
    diagonal = np.abs(np.diag(np.linalg.qr(scaled, mode="r")))
    columns = np.sort(np.argsort(diagonal, kind="stable")[::-1][:rank])
    basis = scaled[:, columns]
    share = np.linalg.lstsq(basis, scaled, rcond=None)[0]
    K = share * np.where(used, lengths, 0.0) / lengths[columns, None]
    K[np.abs(share) < TINY] = 0.0
    K[:, columns] = np.eye(rank)
    inside = np.linalg.svd(basis, compute_uv=False)
    return Grouping(columns, K, values, float(inside[0] / inside[-1]))


class BaseParameters(LinearParameters):
    """The fewest parameters with which the regressor still gives every torque: theta_base = K pi.

    Y_base consists of independent columns of Y, so that Y_base theta_base = Y pi, and to know theta_base is
    all that torque and motion can tell about pi.

    Args:
        robot: the robot.

    Attributes:
        grouping: how they are made up of the inertial parameters.

    Raises:
        RobotError: the rank of the regressor is not clear.
    """

    def __init__(self, robot: Robot):
        full = FullParameters(robot)
        self.grouping = found = grouping(full, robot.nv, robot.name)
        matrix = np.zeros((10 * robot.body_count, found.rank))
        matrix[found.columns, np.arange(found.rank)] = 1.0
        names = found.names(robot.inertial_parameter_names)
        super().__init__(robot, matrix, found.K @ robot.inertial_parameters, names)

    def grouped(self, pi: ArrayLike) -> np.ndarray:
        """The base parameters, (r,), of inertial ones, (10 bodies,), for instance of a first estimate."""
        return self.grouping.K @ finite_array("pi", pi, (self.grouping.K.shape[1],))


def _random_rows(parameters: Parameters, nv: int) -> np.ndarray:
    """Y at random states and references, one below the other."""
    rng = np.random.default_rng(0)
    states = STATES * -(-parameters.theta.size // nv)
    q = rng.uniform(-np.pi, np.pi, (states, nv))
    v, v_ref, a_ref = rng.normal(size=(3, states, nv))
    return np.concatenate([parameters.regressor(*row) for row in zip(q, v, v_ref, a_ref, strict=True)])


def _rank(values: np.ndarray, name: str) -> int:
    rank = int((values > ZERO * values[0]).sum())
    dropped = values[rank] if rank < len(values) else 0.0
    if values[0] == 0 or values[rank - 1] < GAP * dropped:
        raise RobotError(
            "expected singular values of the regressor with a clear gap above zero, "
            f"found {values[rank - 1]:.3g} above it and {dropped:.3g} below",
            subject=f"robot '{name}'",
            found=(values[rank - 1], dropped),
        )
    return rank


def _combination(row: np.ndarray, names: Sequence[str]) -> str:
    """A linear combination in words, such as `joint1.Izz + 0.09 joint2.m`."""
    text = ""
    for share, name in zip(row, names, strict=True):
        if share:
            size = "" if np.isclose(abs(share), 1.0, rtol=TINY) else f"{abs(share):.4g} "
            sign = " - " if share < 0 else " + "
            text += (sign if text else sign.strip(" +")) + size + name
    return text


def parameters_of(kind: str, robot: Robot) -> Parameters:
    """Parameters by name: "full", all inertial ones, or "base", the fewest that give the same torques.

    Raises:
        InputError: another name.
    """
    choice("parameters", kind, KINDS)
    return FullParameters(robot) if kind == "full" else BaseParameters(robot)
