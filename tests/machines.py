"""Robots nobody chose: random trees of revolute and prismatic joints, and arms of uniform rods."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from hypothesis import strategies as st

from synctrl import Robot

JOINTS: tuple[Callable[[np.random.Generator], pin.JointModel], ...] = (
    lambda rng: pin.JointModelRX(),
    lambda rng: pin.JointModelRY(),
    lambda rng: pin.JointModelRZ(),
    lambda rng: pin.JointModelRevoluteUnaligned(direction(rng)),
    lambda rng: pin.JointModelPX(),
    lambda rng: pin.JointModelPrismaticUnaligned(direction(rng)),
    lambda rng: pin.JointModelRUBZ(),
)


def direction(rng: np.random.Generator) -> np.ndarray:
    """A unit vector."""
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def placement(rng: np.random.Generator, reach: float = 0.4) -> pin.SE3:
    """A random pose, at most about `reach` away."""
    return pin.SE3(pin.Quaternion(*direction4(rng)).matrix(), reach * rng.uniform(-1, 1, 3))


def direction4(rng: np.random.Generator) -> np.ndarray:
    """A unit quaternion."""
    vector = rng.normal(size=4)
    return vector / np.linalg.norm(vector)


def inertia(rng: np.random.Generator) -> pin.Inertia:
    """A body that could exist: the moments of a box in a random orientation."""
    mass, sides = rng.uniform(0.5, 5), rng.uniform(0.05, 0.4, 3)
    turn = pin.Quaternion(*direction4(rng)).matrix()
    moments = mass / 12 * ((sides**2).sum() - sides**2)
    return pin.Inertia(mass, rng.uniform(-0.2, 0.2, 3), turn @ np.diag(moments) @ turn.T)


def random_robot(seed: int, joints: int = 4, chain: bool = False) -> Robot:
    """A tree, or a chain, of moving bodies with its tip on the last one.

    Joints are numbered branch after branch, as a URDF parser does and as Pinocchio's algorithms rely on.
    """
    rng = np.random.default_rng(seed)
    branch = [0]
    model = pin.Model()
    model.name = f"random {seed}"
    for k in range(joints):
        if not chain:
            branch = branch[: rng.integers(1, len(branch) + 1)]
        kind = JOINTS[rng.integers(len(JOINTS))](rng)
        joint = model.addJoint(branch[-1], kind, placement(rng), f"joint{k + 1}")
        model.appendBodyToJoint(joint, inertia(rng), placement(rng, 0.1))
        branch.append(joint)
    model.addFrame(pin.Frame("tip", model.njoints - 1, 0, placement(rng), pin.FrameType.OP_FRAME))
    model.gravity.linear = 9.81 * direction(rng)
    return Robot(model, "tip")


def rod_arm(masses: tuple[float, float], lengths: tuple[float, float]) -> Robot:
    """The arm of Table III with other rods: two joints about z, gravity along it."""
    model = pin.Model()
    model.name = "rods"
    for k, (mass, length) in enumerate(zip(masses, lengths, strict=True)):
        along = np.array([lengths[0] if k else 0.0, 0.0, 0.0])
        joint = model.addJoint(k, pin.JointModelRZ(), pin.SE3(np.eye(3), along), f"joint{k + 1}")
        moments = np.diag([1e-4, mass * length**2 / 12, mass * length**2 / 12])
        model.appendBodyToJoint(
            joint, pin.Inertia(mass, np.array([length / 2, 0, 0]), moments), pin.SE3.Identity()
        )
    end = pin.SE3(np.eye(3), np.array([lengths[1], 0.0, 0.0]))
    model.addFrame(pin.Frame("tip", 2, 0, end, pin.FrameType.OP_FRAME))
    return Robot(model, "tip")


def rate(function: Callable[[float], np.ndarray], h: float = 1e-3) -> np.ndarray:
    """d/ds function(s) at s = 0, by central differences of fourth order."""
    near = function(h) - function(-h)
    far = function(2 * h) - function(-2 * h)
    return (8 * near - far) / (12 * h)


#: seeds of random robots, states and motions
seeds = st.integers(0, 2**32 - 1)
