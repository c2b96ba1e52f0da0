"""Small cells for tests of the theory: planar arms made in code, any coupling, any weights."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from synctrl import (
    Cell,
    Coupling,
    Disturbance,
    Experiment,
    Friction,
    FunctionTrajectory,
    Gains,
    Member,
    Robot,
)
from synctrl.tasks.spaces import CartesianSpace, JointSpace

GAINS = Gains(Lambda=4.0, beta=3.0, K_r=2.0, K_eps=1.5, Gamma=0.02)
EDGES = {
    "pair": lambda n: [(0, 1)],
    "ring": lambda n: [(k, (k + 1) % n) for k in range(n)],
    "signed graph": lambda n: [(k, (k + 1) % n) for k in range(n if n > 2 else 1)],
    "all-to-all": lambda n: [(i, j) for i in range(n) for j in range(i)],
}


def planar_arm(joints: int = 2, gravity: float = 0.0, name: str = "arm") -> Robot:
    """A chain of rods of 0.3 m that turn about z; gravity, if any, acts along -y."""
    model = pin.Model()
    model.name = name
    model.gravity.linear = np.array([0.0, -gravity, 0.0])
    parent, placement = 0, pin.SE3.Identity()
    for k in range(joints):
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"joint{k + 1}")
        rod = pin.Inertia(1.0 + 0.2 * k, np.array([0.15, 0.02, 0.0]), np.diag([0.01, 0.04, 0.04]))
        model.appendBodyToJoint(parent, rod, pin.SE3.Identity())
        placement = pin.SE3(np.eye(3), np.array([0.3, 0.0, 0.0]))
    model.addFrame(pin.Frame("tip", parent, 0, placement, pin.FrameType.OP_FRAME))
    return Robot(model, "tip", name=name)


def signs(kind: str, edges: list) -> list[tuple[float, float]]:
    return [(1.0, -1.0) if kind in ("signed graph", "all-to-all") else (1.0, 1.0)] * len(edges)


def weights(kind: str, n: int, m: int, signed: bool = True):
    """Scalars, constant matrices, or matrices that change with time; no matrix is diagonal."""
    rng = np.random.default_rng(n + 10 * m)
    scalars = np.array([(-1.0) ** i if signed else 1.0 for i in range(n)])
    constant = scalars[:, None, None] * (np.eye(m) + rng.uniform(-0.3, 0.3, (n, m, m)))
    swing = rng.uniform(-0.3, 0.3, (n, m, m))

    def moving(t: float):
        a = 5.0
        return (
            constant + swing * np.sin(a * t),
            swing * a * np.cos(a * t),
            -swing * a * a * np.sin(a * t),
        )

    return {"scalar": scalars, "constant": constant, "moving": moving}[kind]


def coupling(kind: str, n: int, m: int, weight: str = "scalar") -> Coupling:
    edges = EDGES[kind](n)
    return Coupling(n, edges, signs(kind, edges), weights(weight, n, m, kind in ("pair", "ring")), kind)


def swing(q0: np.ndarray, phase: float) -> FunctionTrajectory:
    """A smooth desired motion about q0 that starts with a velocity."""
    size, rate = 0.1, 2.0
    return FunctionTrajectory(
        lambda t: q0 + size * np.sin(rate * t + phase),
        lambda t: size * rate * np.cos(rate * t + phase) * np.ones_like(q0),
        lambda t: -size * rate * rate * np.sin(rate * t + phase) * np.ones_like(q0),
    )


def experiment(
    link: Coupling,
    gains: Gains = GAINS,
    *,
    joints: int = 2,
    gravity: float = 3.0,
    cartesian: bool = False,
    friction: Friction | None = None,
    disturbances: tuple[Disturbance, ...] = (),
    known: float = 0.6,
    **options: str,
) -> Experiment:
    """Arms that start off their paths at rest, with an estimate of theta that is wrong."""
    arm, rng = planar_arm(joints, gravity), np.random.default_rng(link.robots)
    members = []
    for i in range(link.robots):
        q0 = np.array([0.4, 1.1, 0.7])[:joints] + rng.uniform(-0.05, 0.05, joints)
        centre = arm.tip_position(q0)[:2] * 0.9 if cartesian else q0 + 0.05
        path = swing(centre, 0.5 * i)
        if cartesian:
            path = FunctionTrajectory(
                lambda t, p=path, x=centre: x + 0.3 * (p(t).x - x),
                lambda t, p=path: 0.3 * p(t).x_dot,
                lambda t, p=path: 0.3 * p(t).x_ddot,
            )
        start = known * arm.inertial_parameters
        members.append(Member(arm, path, q0, theta_hat0=start, friction=friction or Friction()))
    space = CartesianSpace("xy") if cartesian else JointSpace()
    return Experiment(Cell(members, link, space), gains, 0.1, disturbances, **options)
