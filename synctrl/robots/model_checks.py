"""What a model must be for Pinocchio's algorithms to be right."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ..errors import RobotError


def check_joints(robot: str, model: pin.Model) -> None:
    """Refuse joints with several velocities, such as that of a floating base.

    Raises:
        RobotError: naming the joint.
    """
    for joint, name in zip(model.joints[1:], model.names[1:], strict=False):
        if joint.nv != 1:
            raise RobotError(
                f"robot '{robot}': joint '{name}' has {joint.nv} degrees of freedom; "
                "expected joints with one (fixed-base arms of revolute and prismatic joints)"
            )


def check_numbering(robot: str, model: pin.Model) -> None:
    """Refuse joints not numbered branch after branch: Pinocchio's C(q, v) would be silently wrong."""
    for joint in range(1, model.njoints):
        carried = list(model.subtrees[joint])
        if carried != list(range(joint, joint + len(carried))):
            raise RobotError(
                f"robot '{robot}': expected joints numbered branch after branch, found joint "
                f"'{model.names[joint]}' to carry the joints {carried}"
            )


def check_inertia(robot: str, joint: str, row: np.ndarray) -> None:
    """Refuse ten inertial parameters that no body can have."""
    m, h = row[0], row[1:4]
    ixx, ixy, iyy, ixz, iyz, izz = row[4:]
    about_joint = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    if m <= 0:
        raise RobotError(f"robot '{robot}', body of '{joint}': expected a mass above 0 kg, found {m:g}")
    S = np.array([[0, -h[2], h[1]], [h[2], 0, -h[0]], [-h[1], h[0], 0]])
    lowest = np.linalg.eigvalsh(about_joint + S @ S / m)[0]
    if lowest <= 0:
        raise RobotError(
            f"robot '{robot}', body of '{joint}': expected a positive definite inertia about the centre of "
            f"mass, found a smallest eigenvalue of {lowest:g} kg·m^2"
        )
