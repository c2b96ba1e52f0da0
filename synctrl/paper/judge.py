"""An independent judge: cells that run with plants by Pinocchio and by MuJoCo, and how far these agree.

MuJoCo reads the URDF on its own, so that an error in a robot's model or its dynamics would show here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks import instance
from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..errors import InputError
from ..renamed import names_elsewhere
from ..robots.catalog import load_robot
from ..robots.friction import Friction
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from ..tasks.trajectories import Cubic

#: what counts as agreement, relative to the largest error
AGREEMENT = 1e-4

GAINS = Gains(Lambda=5.0, beta=2.0, K_r=5.0, K_eps=5.0, Gamma=0.05)
MOTION_TIME, DURATION = 0.6, 0.4  # s
#: share of the true parameters that the controller starts with
KNOWN = 0.5


def joint_pair(name: str) -> Experiment:
    """Two robots of one kind, turned and tilted differently, that move all their joints together.

    Args:
        name: of the robot in the catalogue.
    """
    members = []
    for i in range(2):
        robot = load_robot(name).placed((0.3 * i, 1.0, -0.2), (0.3, -0.4 * i, 0.5 + i))
        start = np.linspace(-0.7, 0.9, robot.nv) + 0.2 * i
        path = Cubic(start, start + np.linspace(0.5, -0.4, robot.nv), MOTION_TIME)
        theta_hat0 = KNOWN * robot.inertial_parameters
        members.append(Member(robot, path, theta_hat0=theta_hat0, friction=Friction()))
    cell = Cell(members, Coupling.pair(), name=f"two {name}")
    return Experiment(cell, GAINS, DURATION, title=f"two {name} in joint space")


@dataclass(frozen=True, eq=False)
class Agreement:
    """How far the errors of two runs of one cell are apart.

    Attributes:
        title: of the first run.
        t: (T,), s.
        tracking, sync: largest difference of tracking and of synchronization errors over all robots or pairs
            and axes, relative to the largest error of the first run, (T,).
    """

    title: str
    t: np.ndarray
    tracking: np.ndarray
    sync: np.ndarray

    @property
    def agrees(self) -> bool:
        """Whether both errors are the same to `AGREEMENT` at every instant."""
        return bool(max(self.tracking.max(), self.sync.max()) <= AGREEMENT)


def compare_runs(ours: Result, theirs: Result) -> Agreement:
    """Compare two runs of one cell at equal instants.

    Raises:
        InputError: other instants, or another cell.
    """
    for run in (ours, theirs):
        instance("runs", run, Result, "a Result")
    if not len(ours.t):
        raise InputError(
            "expected at least one logged instant, found none", subject=f"run '{ours.info['title']}'"
        )
    if not np.array_equal(ours.t, theirs.t) or ours.x.shape != theirs.x.shape:
        raise InputError(
            f"expected the same instants of the same cell, found {ours!r} and {theirs!r}", subject="runs"
        )
    tracking = _relative(ours.tracking_error, theirs.tracking_error)
    return Agreement(str(ours.info["title"]), ours.t, tracking, _relative(ours.sync_error, theirs.sync_error))


def _relative(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    return np.abs(ours - theirs).max(axis=(1, 2)) / np.abs(ours).max()


__getattr__ = names_elsewhere(__name__, ".judge", Comparison="Agreement")
