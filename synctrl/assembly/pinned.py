"""An object in a plane that hands hold at pins: only forces pass, and what deforms it are forces, too.

With h = [h_1 .. h_n] of the forces at pins r_i, the internal ones are N h, where N is that of
`synctrl.tasks.rigid_motions`: the split of Erhart and Hirche for point masses, as pins pass no moment.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from ..simulation.plant import Output
from ..tasks.rigid_motions import deformation
from .grasp import Grasp, Pin
from .plant import CarryingPlant


class PinnedPlant(CarryingPlant):
    """Robots that hold an object at pins and move in a horizontal plane, x and y.

    Of its outputs `internal_force` has two components, along x and y, N. The pins carry the weight along z,
    which they give way to like a spring. All else is as in `CarryingPlant`.

    Raises:
        InputError: as `CarryingPlant`; or grasps that are no pins.
    """

    def account(self, log: Mapping[str, np.ndarray]) -> tuple[dict[str, Any], dict[str, Output]]:
        report, found = super().account(log)
        inner, _, axes = found["internal_force"]
        return report, {**found, "internal_force": (inner[..., :2], "N", axes)}

    # -- internals ----------------------------------------------------------------------------------------

    def _checked(self, grasps: Sequence[Grasp]) -> tuple[Grasp, ...]:
        for grasp in super()._checked(grasps):
            if not isinstance(grasp.compliance, Pin):
                found = type(grasp.compliance).__name__
                raise InputError.expected("pins, compliance=Pin(...)", found, "grasps")
        return tuple(grasps)

    def _inside(self, wrenches: np.ndarray, levers: np.ndarray) -> np.ndarray:
        """N h along x and y, and nothing else."""
        inner, r = np.zeros_like(wrenches), levers[..., :2]
        flat = wrenches[..., :2].reshape(*r.shape[:-2], -1)
        inner[..., :2] = np.matvec(deformation(r), flat).reshape(r.shape)
        return inner
