"""What a model must be for Pinocchio's algorithms to be right."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ..errors import RobotError
from .pseudo_inertia import NO_MOMENT, principal_moments


def check_joints(robot: str, model: pin.Model) -> None:
    """Refuse joints with several velocities, such as that of a floating base.

    Raises:
        RobotError: naming the joint.
    """
    for joint, name in zip(model.joints[1:], model.names[1:], strict=False):
        if joint.nv != 1:
            raise RobotError(
                f"joint '{name}' has {joint.nv} degrees of freedom; "
                "expected joints with one (fixed-base arms of revolute and prismatic joints)",
                subject=f"robot '{robot}'",
                found=name,
            )


def check_numbering(robot: str, model: pin.Model) -> None:
    """Refuse joints not numbered branch after branch: Pinocchio's C(q, v) would be silently wrong."""
    for joint in range(1, model.njoints):
        carried = list(model.subtrees[joint])
        if carried != list(range(joint, joint + len(carried))):
            raise RobotError(
                "expected joints numbered branch after branch, found joint "
                f"'{model.names[joint]}' to carry the joints {carried}",
                subject=f"robot '{robot}'",
                found=model.names[joint],
            )


def check_inertia(robot: str, joint: str, row: np.ndarray) -> None:
    """Refuse ten inertial parameters that no body can have."""
    body = f"robot '{robot}', body of '{joint}'"
    if row[0] <= 0:
        raise RobotError(f"expected a mass above 0 kg, found {row[0]:g}", subject=body, found=row[0])
    lowest, _, highest = principal_moments(row)
    if lowest < -NO_MOMENT or highest <= 0:
        raise RobotError(
            f"expected a positive definite inertia about the centre of mass, found a smallest eigenvalue of "
            f"{lowest:g} kg·m^2",
            subject=body,
            found=lowest,
        )
