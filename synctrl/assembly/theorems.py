"""What is proved of a controller whose arms hold one object, and which conditions a cell does not meet.

1. Rigid grasps whose geometry the arms know: V is that of arms that move alone, for forces inside have no
   power through reference motions that are one rigid motion.
2. Fixtures that give: the same, with the energy of their springs, if K >= (Lambda - l) D; the object, which
   does not move as the hands do, leaves a power of the order of the deflection.
3. An admittance, under errors of the geometry too: if D_a > (Lambda + beta d) M_a, d the largest eigenvalue
   of S^T S, and integrals leak at Lambda, or K_eps >= beta D_a.

The proofs are on the page about assembly in `docs`.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from ..control.controller import Controller
from ..control.laws.sun_mills import BoundSunMills
from ..errors import InputError
from ..tasks.pose import PoseSpace
from .body import moved_parameters, place_of
from .energies import Energies
from .tare import disagreement

#: how far arms may believe the object apart and still agree, m and rad
AGREED = 1e-6
#: by how much shares may miss the object, of its largest parameter
SHARED = 1e-4
THEOREMS = (
    "none: see what is outside",
    "theorem 1: rigid grasps whose geometry is known",
    "theorem 2: fixtures that give, and geometry that is known, up to the order of the deflection",
    "theorem 3: an admittance, to the first order in rotations and deflections",
)


class ClosedChain:
    """What theorems say of a controller on a plant whose arms hold one object.

    Args:
        plant: a `HoldingPlant`, arms and object.
        controller: their controller.

    Attributes:
        warnings: conditions that do not hold and do harm, in words.
        outside: all that do not hold.
        theorem: which theorem covers runs, in words.

    Raises:
        InputError: fixtures softer than (Lambda - l) D, or shares that do not add up to the object.
    """

    def __init__(self, plant: Any, controller: Controller):
        self.plant, self.controller = plant, controller
        self.warnings: tuple[str, ...] = ()
        self.outside = tuple(self._unasked())
        if not self.outside:
            self._refuse_soft_fixtures()
            self.warnings = (*self._admittance(), *self._integral())
            self.outside = (*self.warnings, *self._unknown())
        number = 3 if controller.admittance is not None else 1 if plant.rigid else 2
        self.theorem = THEOREMS[0 if self.outside else number]

    @cached_property
    def energies(self) -> Energies | None:
        """What the chain has in V and V'; None where that is not known, or nothing."""
        known = not (self.plant.rigid or self._unasked())
        return Energies(self.plant, self.controller) if known else None

    @property
    def gain(self) -> np.ndarray:
        """Largest eigenvalue of A = Lambda + beta S^T S, of each coordinate, (m,), 1/s."""
        S = self.controller.cell.coupling.matrix
        largest = float(np.linalg.eigvalsh(S.T @ S)[-1])
        return self.controller.Lambda + self.controller.beta * largest

    # -- internals ----------------------------------------------------------------------------------------

    def _unasked(self) -> list[str]:
        """What the theorems are not about at all."""
        words = []
        if not isinstance(self.plant.cell.space, PoseSpace):
            words.append("a task that is not the pose of the object that is held")
        if len(self.plant.events):
            words.append("hands that take hold or let go in the middle of a run")
        return words

    def _apart(self) -> np.ndarray:
        """By how much arms that hold the object believe it apart, (6,), m and rad."""
        hands = self.plant._hands
        return np.abs(disagreement(self.controller.cell, int(hands[0]))[hands]).max(axis=0)

    def _integral(self) -> list[str]:
        """An integral that asks for a deformation, unless an admittance gives way."""
        controller = self.controller
        apart = self._apart()
        acts = ((controller.leak < controller.Lambda) & (controller.beta > 0)).any()
        if not acts or apart.max() <= AGREED:
            return []
        found = f"{apart[:3].max():.2g} m and {apart[3:].max():.2g} rad"
        return [
            f"expected arms that agree on where the object is, found {found} between them: integrals of "
            "epsilon let the force inside grow; take a tare of the grasps, or a leak of Lambda"
        ]

    def _admittance(self) -> list[str]:
        giving, controller = self.controller.admittance, self.controller
        if giving is None:
            return []
        M_a, D_a, K_eps, beta = giving.mass, giving.damping, controller.K_eps, controller.beta
        words = []
        if (D_a <= self.gain * M_a).any():
            k = int(np.argmin(D_a - self.gain * M_a))
            words.append(
                f"expected D_a above (Lambda + beta d) M_a of an admittance, {self.gain[k] * M_a[k]:.4g}, "
                f"found {D_a[k]:.4g}"
            )
        if ((controller.leak < controller.Lambda) & (K_eps < beta * D_a)).any():
            words.append("expected integrals that leak at Lambda with an admittance, or K_eps >= beta D_a")
        if ((M_a == 0) & (K_eps > 0)).any():
            words.append("expected K_eps = 0 with an admittance that has no mass")
        return words

    def _unknown(self) -> list[str]:
        """What no theorem knows, and what does no harm by itself."""
        controller = self.controller
        words = []
        if not isinstance(controller.law, BoundSunMills):
            words.append(f"the law {controller.law_settings['name']} in a closed chain: no proof is known")
        if controller.admittance is None and self._apart().max() > AGREED:
            words.append("arms that do not agree on where the object is, and do not give way")
        if not self._shares_add_up():
            words.append("an object that is no load in any arm's model")
        return words

    def _refuse_soft_fixtures(self) -> None:
        if self.plant.rigid:
            return
        plant, rate = self.plant, self.controller.Lambda - self.controller.leak
        short = rate * (self.controller.beta > 0) * plant.D - plant.K
        if (short > 0).any():
            k, axis = np.unravel_index(int(short.argmax()), short.shape)
            raise InputError(
                f"expected fixtures with K of at least (Lambda - l) D, {rate[axis] * plant.D[k, axis]:.4g}, "
                f"found {plant.K[k, axis]:.4g}",
                subject="grasp, compliance",
                found=float(plant.K[k, axis]),
            )

    def _shares_add_up(self) -> bool:
        """Whether arms' models have the object as their load; False if they have none of it."""
        whole, parts = self.plant.body.parameters, shares(self.plant)
        off = parts.sum(axis=0) - whole
        if not parts.any() or np.abs(off).max() <= SHARED * np.abs(whole).max():
            return bool(parts.any())
        raise InputError(
            f"expected shares of the object that add up to its parameters {whole.tolist()}, found "
            f"{parts.sum(axis=0).tolist()}",
            subject="shares",
            found=parts.sum(axis=0),
        )


def shares(plant: Any) -> np.ndarray:
    """What the robots' models have of the object beside the robots themselves, in its axes, (n, 10)."""
    p, R = place_of(plant.hidden0[:7])
    found = np.zeros((plant.cell.n, 10))
    pairs = zip(plant.cell.robots, plant.schedule.free, plant.cell.q0, strict=True)
    for row, (loaded, bare, q) in zip(found, pairs, strict=True):
        frame, tip = bare.model.frames[bare.tip_id], bare.tip_pose(q[: bare.nv])
        body, k = tip * frame.placement.inverse(), frame.parentJoint - 1
        more = (loaded.inertial_parameters - bare.inertial_parameters).reshape(-1, 10)[k]
        if more.any():
            row[:] = moved_parameters(more, R.T @ (body.translation - p), R.T @ body.rotation)
    return found
