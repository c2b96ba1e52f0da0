"""Ready cells with all that may be said of them, for tests that take every one there is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Cubic,
    Disturbance,
    Experiment,
    Gains,
    Member,
    Network,
    Payload,
    Redundancy,
    Robot,
    load_robot,
)
from synctrl.assembly.grasp import Fixture, Pin
from synctrl.control.adaptation import (
    Ball,
    Box,
    Composite,
    EModification,
    Gradient,
    Guarded,
    Hedged,
    Leakage,
    Natural,
    Override,
    Sigma,
    Switching,
)
from synctrl.control.admittance import Admittance
from synctrl.control.laws import (
    ChungSlotine,
    ComputedTorque,
    MasterSlave,
    PDGravity,
    ShapeKeeping,
    SlotineLi,
    SunMills,
)
from synctrl.control.network import Ideal
from synctrl.experiments import (
    a460_full_pair,
    a460_pair,
    bead_on_edge,
    bead_on_path,
    carry_planar,
    carry_ur5,
    mixed_four,
    mobile_robot,
    panda_four,
    planar_four,
    rigid_object,
    ur5_payload,
)
from synctrl.robots.payload import carrying, holding
from synctrl.simulation.devices import (
    Bias,
    DeadTime,
    DifferencedVelocity,
    Lag,
    Noise,
    Quantisation,
    RateLimit,
    Ripple,
    TorqueQuantisation,
)
from synctrl.simulation.held_joints import Pid

Variant = tuple[Callable[..., Any], dict[str, Any]]

#: every ready cell with what is special about it
CELLS: list[Variant] = [
    (a460_pair, {}),
    (a460_pair, {"synchronized": False, "friction": False, "gravity": False}),
    (a460_pair, {"adapt_friction": True, "reference_acceleration": "paper", "k_r_space": "task"}),
    (a460_full_pair, {}),
    (a460_full_pair, {"wrist": Pid(5.0, (1.0, 2.0, 3.0), 0.5), "adapt_friction": True}),
    (planar_four, {}),
    (planar_four, {"disturbance": "torque", "phi": 0.12, "radii": "table", "synchronized": False}),
    (planar_four, {"disturbance": [Disturbance(1, 0.5, 0.1, 0.3), Disturbance(3, (1.0, -1.0), 0.2, 0.3)]}),
    (rigid_object, {}),
    (rigid_object, {"disturbed": False, "gains": Gains(5.0, (3.0, 4.0), [[0.5, 0.4], [0.3, 0.2]], 1.0, 2.0)}),
    (mobile_robot, {}),
    (mobile_robot, {"disturbed": False}),
    (panda_four, {}),
    (mixed_four, {"synchronized": False}),
    (ur5_payload, {}),
    (carry_ur5, {"push": True, "friction": True}),
    (carry_ur5, {"grasp": "rigid", "geometric_error": True, "tare": True}),
    (carry_ur5, {"grasp": Fixture((2e4, 500.0), (100.0, 2.0)), "admittance": True}),
    (carry_ur5, {"leak": True, "admittance": Admittance((80.0, 2.0), (1500.0, 50.0))}),
    (carry_planar, {"push": True, "friction": True, "geometric_error": True, "leak": 2.0}),
    (carry_planar, {"law": ShapeKeeping(), "tare": True, "grasp": Pin(2e4, 50.0)}),
    (carry_planar, {"admittance": True}),
    (bead_on_edge, {}),
    (bead_on_edge, {"friction": True, "push": False}),
    (bead_on_path, {}),
    (bead_on_path, {"mode": "phase", "meeting": 0.5, "gap": 0.03, "push": False}),
    (bead_on_path, {"mode": "gap", "override": Override(scale=0.05), "friction": False}),
    (bead_on_path, {"mode": "independent"}),
]
_P = 30
#: one cell with every part that has a name
PARTS: list[dict[str, Any]] = [
    {"law": SunMills("paper", "task", diffusion=(0.1, 0.2, 0.3)), "network": Network()},
    {"law": SlotineLi()},
    {"law": ComputedTorque()},
    {"law": PDGravity(50.0)},
    {"law": ChungSlotine(2.0)},
    {"law": MasterSlave(1)},
    {"adaptation": Gradient(0.2)},
    {"adaptation": Gradient(np.diag(np.linspace(0.1, 0.4, _P))[None])},
    {"adaptation": Natural(0.5)},
    {"adaptation": Composite(0.2, 3.0, 20.0, memory=0.3, fade=0.2)},
    {"adaptation": Leakage(0.2, Sigma(0.1))},
    {"adaptation": Leakage(0.2, Switching(0.1, 3.0))},
    {"adaptation": Leakage(0.2, EModification(0.1))},
    {"adaptation": Box(0.2, -np.full(_P, 20.0), np.full(_P, 20.0))},
    {"adaptation": Ball(0.2, 40.0)},
    {"adaptation": Guarded(Gradient(0.2), 5.0)},
    {"adaptation": Hedged(Gradient(0.2), 0.5, speed=2.0)},
    {"network": Ideal()},
    {"network": Network(delay=0.01)},
    {"network": Network(delay=[[0.0, 0.01], [0.02, 0.0]], offset=(0.0, 0.001))},
    {"network": Network(period=0.01, jitter=0.002, loss=0.1, burst=(0.1, 0.5), seed=3)},
    {"network": Network(period=0.01, event=0.01, heartbeat=0.1, receiver="extrapolate", horizon=0.05)},
    {"sensors": [Quantisation(1e-4), Noise(1e-5, 1e-3, 2), Bias((0.0, 1e-3, 0.0)), DifferencedVelocity(9.0)]},
    {"actuators": [TorqueQuantisation(0.01), RateLimit(5e3), DeadTime(0.002), Lag(0.004), Ripple(0.02, 6.0)]},
]  # fmt: skip


# -- cells of one's own, with what ready ones do not have --------------------------------------------------

ARM = load_robot("planar2r")
GAINS = Gains(3.0, 2.0, 0.5, 1.0, 0.5)
STATES = np.array([[0.4, 0.9], [1.1, -0.7], [0.2, 1.3], [0.9, 0.8]])


def own_cell(
    coupling: Coupling, robots: list[Robot] | None = None, space: Any = None, **options: Any
) -> Experiment:
    """Robots that go somewhere in joint space, or stay where they are in another space."""
    n = coupling.robots
    robots = [ARM.placed((i, 0.0, 0.0)) for i in range(n)] if robots is None else robots
    own = {key: options.pop(key) for key in ("parameters", "friction", "v0") if key in options}
    members = []
    for robot, q in zip(robots, STATES, strict=False):
        q0 = np.resize(q, robot.nv)
        x = q0 if space is None else robot.tip_position(q0)[space.rows]
        members.append(Member(robot, Cubic(x, x + 0.1, 0.5), q0, **own))
    cell = Cell(members, coupling, space, clocks=options.pop("clocks", 0.0))
    return Experiment(cell, GAINS, 0.5, **options)


def matrices(n: int) -> np.ndarray:
    """Weights that are full matrices."""
    return np.eye(2) + 0.1 * np.arange(n * 4).reshape(n, 2, 2)


def ur5(**options: Any) -> list[Robot]:
    return [load_robot("ur5", **options).placed((i, 0.0, 0.0), (0.0, 0.0, 0.1 * i)) for i in range(2)]


def arms(change: Callable[[Robot], Robot]) -> list[Robot]:
    return [change(ARM), change(ARM.placed((1.0, 0.2, 0.0), (0.0, 0.0, 0.3), "second"))]


LOAD = Payload(0, 0.2, (0.1, 0.0, 0.0), (1e-3, 2e-3, 2e-3))


def pair(*parts: Any, **options: Any) -> Experiment:
    return own_cell(Coupling.pair(), *parts, **options)


#: each makes an experiment
OWN: dict[str, Callable[[], Experiment]] = {
    "sum": lambda: own_cell(Coupling.sum(3)),
    "chain": lambda: own_cell(Coupling.chain(3, c=[(1.0, 2.0), (2.0, 1.0), (0.5, 0.7)])),
    "star": lambda: own_cell(Coupling.star(4, leader=2)),
    "complete": lambda: own_cell(Coupling.complete(3, c=matrices(3))),
    "signed ring": lambda: own_cell(Coupling.signed_ring(4, unit="m")),
    "weighted": lambda: own_cell(Coupling.chain(3).weighted((0.3, 1 / 3))),
    "normalized": lambda: own_cell(Coupling.pair((5.0, -5.0), "m").normalized()),
    "graph": lambda: own_cell(Coupling.from_graph([(0, 1, 0.5), (1, 2, 2.0), (0, 2, 1.0)])),
    "all in one": lambda: own_cell(Coupling(3, [(0, 1, 2)], [(1.0, 2.0, -0.5)], np.ones(3), "own")),
    "clocks": lambda: pair(clocks=(0.0, 1e-3), saturate=True, k_r_space="joint"),
    "payloads": lambda: pair(payloads=[Payload(1, 0.3, start=1e-3, stop=3e-3)], title="t"),
    "space": lambda: pair(space=CartesianSpace("y", redundancy=Redundancy((1.0, 2.0), 0.5))),
    "base": lambda: pair(parameters="base", v0=(0.1, -0.1)),
    "friction": lambda: pair(
        [r.with_armature(0.01) for r in arms(lambda r: r)], friction="urdf", parameters="base"
    ),
    "locked": lambda: pair(ur5(locked={"wrist_3_joint": 0.3})),
    "inertials": lambda: pair(
        ur5(
            inertials={
                "forearm_link": {"mass": 3.0, "com": (0.0, 0.0, 0.2), "inertia": np.diag([0.1, 0.1, 0.02])}
            }
        ),
    ),
    "tip": lambda: pair(arms(lambda r: r.with_tip("link2"))),
    "bodies": lambda: pair(arms(lambda r: r.with_parameters(1.1 * r.inertial_parameters))),
    "no weight": lambda: pair(arms(lambda r: r.weightless().with_armature((0.1, 0.2)))),
    "tool": lambda: pair(arms(lambda r: carrying(holding(r, (0.1, 0.0, 0.0), np.eye(3), "t"), LOAD))),
    "moved twice": lambda: pair(arms(lambda r: r.placed((0.0, 0.1, 0.0)).placed(rpy=(0, 0, 1)))),
}
