"""Gains, laws, adaptations, networks, sensors and actuators in cell files."""

from __future__ import annotations

from typing import Any

from ..control.adaptation import (
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
    Paced,
    Sigma,
    Switching,
)
from ..control.admittance import Admittance
from ..control.gains import Gains
from ..control.laws import (
    ChungSlotine,
    ComputedTorque,
    MasterSlave,
    PDGravity,
    ShapeKeeping,
    SlotineLi,
    SunMills,
)
from ..control.network import Ideal, Network
from ..simulation.devices import (
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
from .kinds import kind, one_of
from .values import ANY_NUMBERS, INTEGER, NUMBER, NUMBERS, ROBOT, TEXT, TRUTH, VECTOR, choice, numbers

#: of all joints of all robots: one number, one for each joint, or a row for each robot
JOINTS = numbers(0, 1, 2)
#: of all pairs of robots
PAIRS = numbers(0, 2)

GAINS = kind(
    "", Gains,
    Lambda=NUMBERS, beta=NUMBERS, K_r=JOINTS, K_eps=NUMBERS, Gamma=ANY_NUMBERS, leak=NUMBERS,
)  # fmt: skip
ADMITTANCE = kind("", Admittance, mass=VECTOR, damping=VECTOR)
OVERRIDE = kind("", Override, floor=NUMBER, scale=NUMBER, rate=NUMBER)

LAWS = (
    kind(
        "sun-mills", SunMills,
        reference_acceleration=choice("exact", "paper"), k_r_space=choice("joint", "task"),
        injection=TRUTH, diffusion=NUMBERS,
    ),
    kind("slotine-li", SlotineLi),
    kind("computed-torque", ComputedTorque),
    kind("pd-gravity", PDGravity, K_p=JOINTS),
    kind("chung-slotine", ChungSlotine, K_2=NUMBERS),
    kind("master-slave", MasterSlave, master=ROBOT),
    kind("shape-keeping", ShapeKeeping),
)  # fmt: skip
LAW = one_of(*LAWS)

RATES = (
    kind("sigma", Sigma, sigma=NUMBER),
    kind("switching", Switching, sigma=NUMBER, radius=NUMBER),
    kind("e-modification", EModification, sigma=NUMBER),
)


def _learning(inner: Any) -> tuple[Any, ...]:
    """Adaptations that go along with another one."""
    return (
        kind("paced", Paced, adaptation=inner, override=OVERRIDE.model),
        kind("hedged", Hedged, adaptation=inner, pull=NUMBER, speed=NUMBER),
        kind("guarded", Guarded, adaptation=inner, rate=NUMBER),
    )


ALONE = (
    kind("gradient", Gradient, Gamma=ANY_NUMBERS),
    kind("natural", Natural, gamma=NUMBER, gamma_friction=NUMBER),
    kind(
        "composite", Composite,
        Gamma=ANY_NUMBERS, prediction=NUMBER, bandwidth=NUMBER, memory=NUMBER, fade=NUMBER,
        forgetting=NUMBER, growth=NUMBER,
    ),
    kind("leakage", Leakage, Gamma=ANY_NUMBERS, rate=one_of(*RATES)),
    kind("box", Box, Gamma=ANY_NUMBERS, lower=ANY_NUMBERS, upper=ANY_NUMBERS),
    kind("ball", Ball, Gamma=ANY_NUMBERS, radius=NUMBERS),
)  # fmt: skip
AROUND = _learning(one_of(*ALONE))
ADAPTATION = one_of(*ALONE, *AROUND)

NETWORKS = (
    kind("ideal", Ideal, leak=NUMBERS),
    kind(
        "network", Network,
        period=NUMBER, delay=PAIRS, jitter=PAIRS, loss=PAIRS, burst=VECTOR, offset=NUMBERS, event=NUMBERS,
        heartbeat=NUMBER, receiver=TEXT, omega=NUMBER, seed=INTEGER, horizon=NUMBER,
    ),
)  # fmt: skip
NETWORK = one_of(*NETWORKS)

SENSORS = (
    kind("quantisation", Quantisation, step=JOINTS),
    kind("noise", Noise, q=JOINTS, v=JOINTS, seed=INTEGER),
    kind("bias", Bias, q=JOINTS, v=JOINTS),
    kind("differenced-velocity", DifferencedVelocity, omega=NUMBER),
)
ACTUATORS = (
    kind("torque-quantisation", TorqueQuantisation, step=JOINTS),
    kind("rate-limit", RateLimit, rate=JOINTS),
    kind("dead-time", DeadTime, time=NUMBER),
    kind("lag", Lag, time_constant=JOINTS),
    kind("ripple", Ripple, share=JOINTS, order=NUMBER, phase=NUMBER),
)
SENSOR, ACTUATOR = one_of(*SENSORS), one_of(*ACTUATORS)
KINDS = (
    GAINS, ADMITTANCE, OVERRIDE, *LAWS, *RATES, *ALONE, *AROUND, *NETWORKS, *SENSORS, *ACTUATORS,
)  # fmt: skip
