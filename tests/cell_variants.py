"""Ready cells with all that may be said of them, for tests that take every one there is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from synctrl import Disturbance, Gains, Network
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
