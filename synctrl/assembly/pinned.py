"""An object in a plane that hands hold at pins: only forces pass, and what deforms it are forces, too.

With h = [h_1 .. h_n] of the forces at pins r_i, the internal ones are N h, where N is that of
`synctrl.tasks.rigid_motions`: the split of Erhart and Hirche for point masses, as pins pass no moment.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..simulation.plant import Output
from ..tasks.rigid_motions import deformation
from .body import place_of
from .grasp import Grasp, Pin
from .plant import CarryingPlant


class PinnedPlant(CarryingPlant):
    """Robots that hold an object at pins and move in a horizontal plane, x and y.

    Of its outputs `internal_force` has two components, along x and y, N. The pins carry the weight along z,
    which they give way to like a spring. All else is as in `CarryingPlant`.

    Raises:
        InputError: as `CarryingPlant`; or grasps that are no pins.
    """

    def outputs_along(
        self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray, t: np.ndarray
    ) -> dict[str, Output]:
        found = super().outputs_along(q, v, hidden, t)
        forces, _, axes = found["hand_wrench"]
        r = (self.arms @ place_of(hidden[:, :7])[1].mT)[..., :2]
        flat = forces[..., :2].reshape(len(t), -1)
        inner = np.matvec(deformation(r), flat).reshape(r.shape)
        return {**found, "internal_force": (inner, "N", axes)}

    # -- internals ----------------------------------------------------------------------------------------

    def _checked(self, grasps: Sequence[Grasp]) -> tuple[Grasp, ...]:
        for grasp in super()._checked(grasps):
            if not isinstance(grasp.compliance, Pin):
                found = type(grasp.compliance).__name__
                raise InputError.expected("pins, compliance=Pin(...)", found, "grasps")
        return tuple(grasps)
