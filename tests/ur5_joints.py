"""Two UR5 arms coupled joint by joint, with the gains of their ready cell: what a delay can bring down."""

from __future__ import annotations

from synctrl import Cell, Coupling, Hold, JointSpace, Member
from synctrl.experiments import ur5_payload
from synctrl.experiments.ur5_payload import GAINS as GAINS


def ur5_joints() -> Cell:
    """The arms of `ur5_payload` at its start, their joints desired to stay there, all parameters known."""
    arms = ur5_payload().cell
    members = [
        Member(robot, Hold(q), q, theta_hat0=robot.inertial_parameters, name=robot.name)
        for robot, q in zip(arms.robots, arms.q0, strict=True)
    ]
    return Cell(members, Coupling.pair(), JointSpace(), name="UR5 pair, joint by joint")
