"""A tube of errors, before any run: what may enter V by Theorem A, and what of it the errors see.

    V(0) = sum_i (1/2 s_q^T M s_q + 1/2 t^T (K Gamma K^T)^+ t) + sum_k 1/2 eps_k^T K_eps eps_k
    X <= D/2 + (D^2/4 + V(0))^1/2,    |w_i - w_i of r = 0| <= X (max over axes of sum_k h_ik^2 kappa_k^2)^1/2

with h^2 of `ModalFilter.spread`, kappa_k = sup |c_k J_k K_r^-1/2| and e = c^-1 w. kappa is a bound by lengths
of links for all joint positions, so that nothing is assumed of J but that J^-1 exists; and that the tube
itself may show: errors stay in the tube as long as J^-1 exists, and in the tube it does. The page about the
tube in `docs` has the proofs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, numbers, positive_number
from ..control.controller import Controller
from ..control.gains import Gains
from ..coupling.cell import Cell
from ..errors import InputError
from ..simulation.schedules import Disturbance
from ..tasks.pose import MAX_ANGLE
from ..tasks.spaces import JointSpace
from .clearance import clearance
from .in_words import InWords
from .jacobian_size import sizes_of
from .torque_bound import Outside, largest_norm, outside
from .tube_radius import Known, Radii, radii, radii_with
from .tube_start import check_motions, read_instants, start

#: what has to be true where kappa is given
KAPPA_GIVEN = "kappa is as given"


class Part(NamedTuple):
    """Coordinates that are measured together: names, unit, the first one and the one behind the last."""

    name: str
    unit: str
    start: int
    stop: int


@dataclass(frozen=True, eq=False, repr=False)
class Tube(InWords):
    """Bounds of the errors of n robots, at T instants and part by part.

    A part is what is measured together: a joint alone; in other spaces coordinates of one unit, such as a
    position or an orientation.

    Attributes:
        cell, names: of the cell and its robots.
        parts: the parts.
        t: instants, (T,), s.
        radius: bounds of |e_i|, (T, n, parts), in these units.
        energy: terms of V(0) by name, N·m if weights have no unit.
        D: bound of the torque outside the model, (int sum d^T K_r^-1 d)^1/2, sqrt(N·m).
        X: bound of (int sum s_q^T K_r s_q)^1/2, sqrt(N·m).
        kappa: bounds of |c_i J_i K_r^-1/2|, (n, parts).
        plain: |c_i^-1| (|w(0)| + kappa X / (2 min Lambda)^1/2), (n,): the same without telling modes, parts
            and instants apart.
        sampled: whether kappa comes from sampled positions, and is no bound.
        excludes_singularities: whether all J keep their inverse inside the tube; None if there is no telling.
        excludes_half_turns: whether orientation errors stay below `MAX_ANGLE`; None where there are none.
        reason: how it is known where J is singular, in words.
        assumed: what has to be true beside what a cell says, in words.
    """

    cell: str
    names: tuple[str, ...]
    parts: tuple[Part, ...]
    t: np.ndarray
    radius: np.ndarray
    energy: Mapping[str, float]
    D: float
    X: float
    kappa: np.ndarray
    plain: np.ndarray
    sampled: bool
    excludes_singularities: bool | None
    excludes_half_turns: bool | None
    reason: str
    assumed: tuple[str, ...]

    @property
    def V0(self) -> float:  # noqa: N802
        """V(0), the sum of the energies."""
        return sum(self.energy.values())

    @property
    def largest(self) -> np.ndarray:
        """Largest radius over time, (n, parts)."""
        return np.asarray(self.radius.max(axis=0))

    @property
    def closes(self) -> bool:
        """Whether nothing is assumed of J^-1, and no number is sampled but instants."""
        open_turn = self.excludes_half_turns is False
        return bool(self.excludes_singularities) and not (self.sampled or open_turn)

    def sizes(self, e: ArrayLike) -> np.ndarray:
        """Lengths of errors part by part, (..., n, parts), of (..., n, m): what the radius is a bound of.

        Raises:
            InputError: no numbers, or another number of robots or coordinates.
        """
        errors, shape = numbers("e", e), (len(self.names), self.parts[-1].stop)
        if errors.shape[-2:] != shape:
            raise InputError.expected(f"shape (..., {shape[0]}, {shape[1]})", errors.shape, "e")
        return sizes_of(errors, [slice(part.start, part.stop) for part in self.parts])

    def as_dict(self) -> dict[str, Any]:
        """The same as plain data, of the radius only the largest over time."""
        said = asdict(self) | {"V0": self.V0, "closes": self.closes, "largest": self.largest}
        del said["t"], said["radius"]
        return {name: x.tolist() if isinstance(x, np.ndarray) else x for name, x in said.items()}

    def __str__(self) -> str:
        return "\n".join(in_words(self))


def tube(
    cell: Cell,
    gains: Gains,
    torque: ArrayLike = 0.0,
    duration: float = 5.0,
    *,
    disturbances: Sequence[Disturbance] = (),
    speed: ArrayLike | None = None,
    kappa: ArrayLike | None = None,
    times: ArrayLike | None = None,
) -> Tube:
    """Bounds of all errors of a cell under the paper's law, before any run.

    It is about `SunMills` with the exact reference acceleration and damping in joint space, (14), robots that
    hear each other at once and that nothing connects, and continuous control.

    Args:
        cell: the robots and where they start.
        gains: the gains.
        torque: bound of torque that is not in the model, on each joint and beside friction and disturbances,
            a number, (nv,) or (n, nv), N·m.
        duration: how long, s.
        disturbances: torques from outside that are known.
        speed: bound of joint speeds, where there is viscous friction that is not adapted, as `torque`, rad/s;
            not needed in joint space with constant diagonal weights.
        kappa: bounds of |c_i J_i K_r^-1/2| that are known otherwise, (n, parts), such as along a run.
        times: instants at which it is wanted, from 0 to the duration, (T,), s; by default 201.

    Raises:
        InputError: gains or numbers of another size or sign, viscous friction without a bound of speeds, an
            error that is never learned, a desired position or velocity that jumps, or slides without limits
            on an arm.
    """
    controller, end = Controller(cell, gains), positive_number("duration", duration)
    acting = outside(cell, torque, disturbances, speed)
    known = _known(controller, read_instants(times, end), acting, end)
    if kappa is None:
        return _tube(known, radii(known), speed is not None)
    given = _check_kappa(kappa, (cell.n, len(known.parts)))
    return _tube(known, radii_with(known, given), speed is not None, KAPPA_GIVEN)


def _check_kappa(kappa: ArrayLike, shape: tuple[int, int]) -> np.ndarray:
    given = finite_array("kappa", kappa, shape)
    if given.min() < 0:
        raise InputError.expected("bounds of at least 0", float(given.min()), "kappa")
    return given


def _known(controller: Controller, instants: np.ndarray, acting: Outside, end: float) -> Known:
    """What is known of a cell before a run that ends at a time, s."""
    cell = controller.cell
    check_motions(cell, end)
    energy, w = start(controller, cell.references(np.array([0.0]))[0])
    D = largest_norm(controller, acting, sum(energy.values()), w, end)
    return Known(controller, instants, cell.reference_table(instants), w, energy, D)


def _tube(known: Known, found: Radii, slow: bool, *given: str) -> Tube:
    """A tube of what was found, with what has to be true because of what was given."""
    cell = known.controller.cell
    clear = clearance(cell, known.told, found.radius)
    return Tube(
        cell=cell.name,
        names=cell.names,
        parts=tuple(_part(cell, part) for part in known.parts),
        t=known.instants,
        radius=found.radius,
        energy=known.energy,
        D=known.D,
        X=known.X,
        kappa=found.kappa,
        plain=_plain(known, found.kappa),
        sampled=found.sampled,
        excludes_singularities=clear.excluded,
        excludes_half_turns=found.turned,
        reason=clear.reason,
        assumed=(*_assumed(cell, slow, found.sampled), *given),
    )


def _part(cell: Cell, part: slice) -> Part:
    """Some coordinates of a cell with their names."""
    return Part(", ".join(cell.labels[part]), cell.units[part.start], part.start, part.stop)


def _plain(known: Known, kappa: np.ndarray) -> np.ndarray:
    """|c_i^-1| (|w(0)| + kappa X / (2 min Lambda)^1/2), (n,), with the largest c_i^-1 over time."""
    size = np.linalg.norm(known.told.c_inv, 2, axis=(-2, -1)).max(axis=0)
    seen = np.linalg.norm(kappa, axis=-1).max() * known.X / np.sqrt(2 * known.controller.Lambda.min())
    return np.asarray(size * (np.linalg.norm(known.w) + seen))


# -- in words ----------------------------------------------------------------------------------------------


def _assumed(cell: Cell, slow: bool, sampled: bool) -> tuple[str, ...]:
    """What has to be true beside what a cell says, in words."""
    slides = any("m" in robot.joint_units for robot in cell.robots) and not isinstance(cell.space, JointSpace)
    said = {
        "no other torque acts": True,
        "joints are no faster than stated": slow,
        "slides stay within their limits": slides,
        "kappa is no larger than where it was sampled": sampled,
        "weights and paths do nothing new between the instants looked at": True,
    }
    return tuple(words for words, true in said.items() if true)


def in_words(tube: Tube) -> list[str]:
    """What a tube says, in sentences, a line each."""
    given = KAPPA_GIVEN in tube.assumed
    by = "what is given" if given else "sampled positions" if tube.sampled else "lengths of links"
    lines = [
        f"{tube.cell}, {tube.t[-1]:g} s: V(0) = {tube.V0:.4g}, and torque outside the model of D <= "
        f"{tube.D:.4g}, give X <= {tube.X:.4g} sqrt(N·m); kappa from {by}."
    ]
    for name, row in zip(tube.names, tube.largest, strict=True):
        told = (f"|e({part.name})| <= {r:.4g} {part.unit}" for part, r in zip(tube.parts, row, strict=True))
        lines.append(f"{name}: {', '.join(told)}.")
    verdict = {True: "excludes", False: "does not exclude"}
    singular = tube.excludes_singularities
    known = "leaves open" if singular is None else verdict[singular]
    lines.append(f"The tube {known} singular configurations: {tube.reason}.")
    if tube.excludes_half_turns is not None:
        lines.append(f"It {verdict[tube.excludes_half_turns]} orientation errors of {MAX_ANGLE:g} rad.")
    until = ["J^-1 exists"] * (not singular)
    until += [f"orientation errors are below {MAX_ANGLE:g} rad"] * (tube.excludes_half_turns is False)
    while_so = " as long as " + " and ".join(until) if until else ""
    lines.append(f"Errors stay in it{while_so}, if {_listed(tube.assumed)}.")
    return lines


def _listed(words: Sequence[str]) -> str:
    """As in `a, b, and c`."""
    *others, last = words
    return ", ".join([*others, f"and {last}" if others else last])
