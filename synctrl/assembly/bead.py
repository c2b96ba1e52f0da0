"""A bead of adhesive that one robot lays on the edge of a body which another one carries.

The body is a load of the robot that carries it, fixed to its last link, and adhesive weighs nothing. So the
robots move as those of any cell, and what is added here is what becomes of the bead.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..checks import count, instance
from ..coupling.cell import Cell
from ..errors import InputError
from ..simulation.plant import Output, Plant
from ..tasks.edge import AlongEdge
from ..tasks.measurement import poses_over_time
from ..tasks.rotations import exp
from ..tasks.sliding import Carrier
from .body import CarriedObject, pose_of

#: axes of outputs
OVER_TIME, ALONG, AT_BEADS = ("time",), ("time", "coordinate"), ("time", "bead", "coordinate")


class BeadPlant(Plant):
    """The true robots, and the bead that the nozzle of one lays on what another one carries.

    Args:
        cell: what the controller knows. The robot that carries has a `Carrier` with a frame `AlongEdge` as
            its desired motion, and its tip is the frame of the body; the tip of the other one is the nozzle,
            which points along its z.
        body: what is carried, for figures; its inertia is in the robots of the cell.
        carrier, nozzle: indices of the two robots, counted from 0.
        options: of `Plant`.

    Raises:
        InputError: not of these kinds, or robots that the cell does not have.
    """

    def __init__(
        self,
        cell: Cell,
        *,
        body: CarriedObject,
        carrier: int = 0,
        nozzle: int = 1,
        **options: Any,
    ):
        super().__init__(cell, **options)
        instance("body", body, CarriedObject, "a CarriedObject")
        pair = [count("carrier", carrier, 0), count("nozzle", nozzle, 0)]
        if max(pair) >= cell.n or carrier == nozzle:
            raise InputError.expected(f"two different robots from 0 to {cell.n - 1}", pair, "carrier, nozzle")
        motion: Any = cell.members[carrier].trajectory
        instance("carrier, trajectory", motion, Carrier, "a Carrier")
        instance("carrier, frame", motion.frame, AlongEdge, "a frame AlongEdge")
        self.body, self.motion, self.pair = body, motion, pair

    def account(self, log: Mapping[str, np.ndarray]) -> tuple[dict[str, Any], dict[str, Output]]:
        """The bead and its errors, and the pose of the body with what was desired of it, all over time."""
        t, seen = log["t"], poses_over_time(self.cell.robots, log["q"], log["v"])
        (p, R, nu), (at, turned, moving) = ([part[:, i] for part in seen] for i in self.pair)
        frame: AlongEdge = self.motion.frame
        target, tangent = frame.position(t), frame.tangent(t)
        arm = np.vecmat(at - p, R)  # in the body's axes, as all below
        past = np.vecmat(moving[:, :3] - nu[:, :3] - np.cross(nu[:, 3:], at - p), R)
        pointing = np.vecmat(turned[..., 2], R)
        wanted = frame.orientation(t).R[..., 2]
        apart = np.linalg.norm(np.cross(pointing, wanted), axis=1)
        laid = arm + frame.edge.stand_off * pointing
        place = "m, and a unit quaternion"
        outputs = {
            "object_pose": (pose_of(p, R), place, ALONG),
            "object_desired": (self._desired(t), place, ALONG),
            "bead_points": (laid[:, None], "m", AT_BEADS),
            "bead_error": (arm - target.x, "m", ALONG),
            "bead_speed": (np.vecdot(past, tangent), "m/s", OVER_TIME),
            "bead_speed_desired": (np.vecdot(target.x_dot, tangent), "m/s", OVER_TIME),
            "normal_angle": (np.arctan2(apart, np.vecdot(pointing, wanted)), "rad", OVER_TIME),
        }
        return self.report(log["plant_state"]), outputs

    def report(self, hidden: np.ndarray) -> dict[str, Any]:
        """What is carried, and the edge on it, as plain data."""
        edge, (carrier, nozzle) = self.motion.frame.edge, self.pair
        about = {
            "outline": edge.outline().tolist(),
            "length": edge.length,
            "tilt": edge.tilt,
            "stand_off": edge.stand_off,
            "carrier": carrier,
            "nozzle": nozzle,
        }
        return {"object": self.body.as_dict(), "edge": about}

    # -- internals ----------------------------------------------------------------------------------------

    def _desired(self, t: np.ndarray) -> np.ndarray:
        x = self.motion(t).x
        return pose_of(x[:, :3], exp(x[:, 3:]))
