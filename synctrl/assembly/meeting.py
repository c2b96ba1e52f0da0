"""Two beads of adhesive on one path, which two robots lay from its ends until they meet.

Adhesive weighs nothing: the robots move as those of any cell, and what is added here is what becomes of the
beads. Where their desired motion is slowed down, by a feed override, the phase stands for time.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..checks import instance, positive_number
from ..control.controller import Controller
from ..coupling.cell import Cell
from ..errors import InputError
from ..robots.friction import friction_torque
from ..simulation.plant import Output, Plant
from ..tasks.inverse_kinematics import reach
from ..tasks.measurement import poses_over_time
from ..tasks.path import AlongPath

#: axes of outputs
OVER_TIME, BY_BEAD, AT_BEADS = ("time",), ("time", "bead"), ("time", "bead", "coordinate")
#: points of the path in the report of a run
OUTLINE = 101


class MeetingPlant(Plant):
    """The true robots, and the beads that two of them lay on one path.

    Args:
        cell: two robots whose tips are nozzles, with desired positions `AlongPath` on the same path.
        duration: after which phase they have met, s.
        options: of `Plant`.

    Raises:
        InputError: another number of robots, other motions, or a duration that is not positive.
    """

    def __init__(self, cell: Cell, *, duration: float, **options: Any):
        super().__init__(cell, **options)
        if cell.n != 2:
            raise InputError.expected("a cell of two robots", cell.n, "cell")
        self.motions = [motion_along(member.trajectory) for member in cell.members]
        self.duration = positive_number("duration", duration)
        first, second = (motion.path for motion in self.motions)
        if first is not second:
            raise InputError("expected motions along the same path, found two paths", subject="trajectory")
        self.path = first

    def account(self, log: Mapping[str, np.ndarray]) -> tuple[dict[str, Any], dict[str, Output]]:
        """Beads, their errors and speeds, the gap between them, and where and when they met."""
        t, phase, feed = log["t"], log.get("phase", log["t"]), log.get("feed", np.ones_like(log["t"]))
        x, _, twists = poses_over_time(self.cell.robots, log["q"], log["v"])
        s_d, speed = (np.stack([motion.way(phase)[k][:, 0] for motion in self.motions], 1) for k in (0, 1))
        s, desired = self.path.project(x, s_d), self.path.at(s_d)
        forward = np.sign(self._ends() - s_d[:1]) if len(t) else speed
        moved = forward * np.vecdot(self.path.at(s).tangent, twists[..., :3])
        gap_error = np.diff(s - s_d, axis=1)[:, 0]
        outputs = {
            "bead_points": (x, "m", AT_BEADS),
            "bead_error": (np.vecmat(x - desired.position, desired.axes), "m", AT_BEADS),
            "bead_speed": (moved, "m/s", BY_BEAD),
            "speed_error": (moved - forward * speed * feed[:, None], "m/s", BY_BEAD),
            "gap_error": (gap_error, "m", OVER_TIME),
        }
        return {"path": self._about(), "meeting": self._meeting(t, phase, s, gap_error)}, outputs

    # -- internals ----------------------------------------------------------------------------------------

    def _ends(self) -> np.ndarray:
        return np.array([motion.way(self.duration).x[0] for motion in self.motions])

    def _about(self) -> dict[str, Any]:
        """The path as plain data."""
        points = self.path.at(np.linspace(0.0, self.path.length, OUTLINE)).position
        return {"points": points.tolist(), "length": self.path.length, "duration": self.duration}

    def _meeting(
        self, t: np.ndarray, phase: np.ndarray, s: np.ndarray, gap_error: np.ndarray
    ) -> dict[str, Any] | None:
        """When and where the beads met; None if they have not."""
        if not len(t) or phase[-1] < self.duration:
            return None
        middle, wanted = s.mean(axis=1), float(self._ends().mean())
        at = float(np.interp(self.duration, phase, middle))
        return {
            "time": float(np.interp(self.duration, phase, t)),
            "point": self.path.at(at).position.tolist(),
            "off": at - wanted,
            "gap_error": float(np.interp(self.duration, phase, gap_error)),
        }


def lag_of_friction(controller: Controller, t: float, feed: float = 1.0) -> float:
    """How far robots lag along their motions, once their velocity errors balance friction, m.

    Damping K_r s_q bears friction that nobody has learned, and e = J s_q / Lambda where that goes on for
    long; what is left when the adaptation has learned may be less. Of several robots it is the root of the
    sum of squares.

    Args:
        controller: of robots that go along paths.
        t: phase at which they are looked at, s; not one at which they stand.
        feed: share of their speed with which they go.
    """
    cell, lags = controller.cell, []
    for member, q0, K_r in zip(cell.members, cell.q0, controller.K_r, strict=True):
        x, x_dot, _ = member.trajectory(t)
        J = member.robot.jacobian(reach(member.robot, x, q0, cell.space))[: cell.m]  # type: ignore[arg-type]
        v, rubs = np.linalg.solve(J, feed * x_dot), member.friction
        torque = friction_torque(v, rubs.viscous, rubs.coulomb, rubs.smoothing)
        slip = J @ (torque / K_r) if controller.k_r_space == "joint" else np.linalg.solve(J.T, torque) / K_r
        lags.append(float(slip / controller.Lambda @ x_dot / np.linalg.norm(x_dot)))
    return float(np.linalg.norm(np.maximum(lags, 0.0)))


def motion_along(trajectory: Any) -> AlongPath:
    """The motion along a path that a trajectory of a position or of a pose is.

    Raises:
        InputError: it is none.
    """
    motion = getattr(trajectory, "position", trajectory)
    instance("trajectory", motion, AlongPath, "an AlongPath, or a PoseTrajectory of one")
    return motion
