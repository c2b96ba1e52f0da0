"""From X to bounds of the errors, part by part: |e_i(t)| <= |c_i^-1 w_i of r = 0| + |c_i^-1| h_i X."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..control.controller import Controller
from ..coupling.cell import Reference
from ..errors import InputError
from ..tasks.pose import MAX_ANGLE, PoseSpace
from .jacobian_size import block_norms, jacobian_sizes, kappas, parts_of, sizes_of
from .modal_filter import ModalFilter

#: how often a bound of the orientation error is put into its own bound; each time it holds
ROUNDS = 20


class Known(NamedTuple):
    """What bounds of errors are made of.

    Attributes:
        controller: one with the paper's law.
        instants: at which they are wanted, (T,), s.
        told: what the robots are told then.
        w: w(0), (n, m).
        energy: terms of V(0) by name.
        D: bound of the torque outside the model, sqrt(N·m).
    """

    controller: Controller
    instants: np.ndarray
    told: Reference
    w: np.ndarray
    energy: Mapping[str, float]
    D: float

    @property
    def X(self) -> float:  # noqa: N802
        """D/2 + (D^2/4 + V(0))^1/2, sqrt(N·m)."""
        return self.D / 2 + float(np.sqrt(self.D**2 / 4 + sum(self.energy.values())))

    @property
    def parts(self) -> list[slice]:
        """Coordinates that are measured together."""
        return parts_of(self.controller.cell)


class Radii(NamedTuple):
    """kappa, (n, parts), and bounds of the errors, (T, n, parts).

    Attributes:
        kappa, radius: these.
        sampled: whether kappa is sampled, and no bound.
        turned: whether orientation errors stay below `MAX_ANGLE`; None where there are none.
    """

    kappa: np.ndarray
    radius: np.ndarray
    sampled: bool
    turned: bool | None


def radius_of(known: Known, kappa: np.ndarray) -> np.ndarray:
    """Bounds of the errors, (T, n, parts), for a kappa, (n, parts)."""
    modes, c_inv, parts = ModalFilter.of(known.controller), known.told.c_inv, known.parts
    w = modes.vectors @ modes.free(known.instants, modes.to_modes(known.w), np.zeros_like(known.w))
    free = sizes_of(np.matvec(c_inv, w), parts)
    seen = np.empty_like(kappa)
    for k, part in enumerate(parts):
        axes = range(part.start, part.stop)
        seen[:, k] = np.max([modes.spread(axis) @ kappa[:, k] ** 2 for axis in axes], axis=0)
    return np.asarray(free + (block_norms(c_inv, parts) * (known.X * np.sqrt(seen))[:, None]).sum(-1))


def radii(known: Known) -> Radii:
    """Bounds of the errors, with kappa by lengths of links.

    While orientation errors are below an angle, kappa is what it is up to there; if the tube then is below
    this angle they are never above, and the argument holds again with the smaller angle.

    Raises:
        InputError: kappa has no bound, because of a slide without limits.
    """
    cell, poses = known.controller.cell, isinstance(known.controller.cell.space, PoseSpace)
    angle, turned = (MAX_ANGLE, False) if poses else (0.0, None)
    for _ in range(ROUNDS):
        sizes, sampled = jacobian_sizes(cell, known.controller.K_r, known.instants, angle)
        if not np.isfinite(sizes).all():
            name = cell.names[int(np.argmax(np.isinf(sizes).any(-1)))]
            raise InputError.expected("limits of slides behind joints that turn", "none", name, shown="none")
        kappa = kappas(known.told.c, sizes, known.parts)
        radius = radius_of(known, kappa)
        largest = float(radius[..., -1].max())
        if turned is None or largest >= angle:
            break
        angle, turned = largest, True
    return Radii(kappa, radius, sampled, turned)


def radii_with(known: Known, kappa: np.ndarray) -> Radii:
    """The same with a kappa that is given, (n, parts)."""
    radius, poses = radius_of(known, kappa), isinstance(known.controller.cell.space, PoseSpace)
    return Radii(kappa, radius, False, bool(radius[..., -1].max() < MAX_ANGLE) if poses else None)
