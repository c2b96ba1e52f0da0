"""Where the bodies of a mechanism are, over many configurations."""

from __future__ import annotations

import numpy as np
import pinocchio as pin


def joint_poses(model: pin.Model, q: np.ndarray) -> np.ndarray:
    """Poses of all joint frames in the world.

    Args:
        model: the mechanism.
        q: configurations as Pinocchio stores them, (T, nq).

    Returns:
        (T, njoints, 7): x, y, z in m, then the unit quaternion x, y, z, w; joint 0 is the world.
    """
    data = model.createData()
    poses = np.empty((len(q), model.njoints, 7))
    for frame, configuration in enumerate(q):
        pin.forwardKinematics(model, data, configuration)
        for joint in range(model.njoints):
            poses[frame, joint] = pin.SE3ToXYZQUAT(data.oMi[joint])
    return poses
