"""Factors of a sweep that are settings of sensors and actuators; such runs need a control period."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

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
from ..simulation.simulate import Experiment
from .distributions import Value, Values
from .factors import Factor
from .variations import as_whole

#: in the order in which a device that an experiment does not have yet takes its place
ORDER: dict[str, tuple[Any, ...]] = {
    "sensors": (Bias, Noise, Quantisation, DifferencedVelocity),
    "actuators": (TorqueQuantisation, RateLimit, DeadTime, Lag, Ripple),
}
KINDS = {kind.__name__: (role, kind) for role, kinds in ORDER.items() for kind in kinds}


def with_device(experiment: Experiment, value: Any, device: str, setting: str) -> Experiment:
    """Another value of a setting of the first device of a kind, which is put in where there is none.

    Args:
        experiment: it stays as it is.
        value: of the setting.
        device: name of the kind.
        setting: which one.
    """
    role, kind = KINDS[device]
    parts, changed = list(getattr(experiment, role)), {setting: value}
    at = next((k for k, part in enumerate(parts) if type(part) is kind), None)
    if at is None:
        later = ORDER[role][ORDER[role].index(kind) + 1 :]
        place = next((k for k, part in enumerate(parts) if type(part) in later), len(parts))
        parts.insert(place, kind(**changed))
    else:
        parts[at] = replace(parts[at], **changed)
    fitted: dict[str, Any] = {role: parts}
    return replace(experiment, **fitted)


def with_seed(experiment: Experiment, value: Value) -> Experiment:
    """Another seed of the noise."""
    return with_device(experiment, as_whole(value), "Noise", "seed")


def encoder_resolution(values: Values) -> Factor:
    """Resolution of all encoders, rad (or m) per count, 0 for exact ones; see `Quantisation`."""
    return _setting("encoder_resolution", values, Quantisation, "step")


def encoder_bias(values: Values) -> Factor:
    """By how much all positions are read too large, rad (or m); see `Bias`."""
    return _setting("encoder_bias", values, Bias, "q")


def noise(values: Values) -> Factor:
    """Standard deviation of the noise of measured positions, rad (or m); see `Noise`."""
    return _setting("noise", values, Noise, "q")


def velocity_noise(values: Values) -> Factor:
    """Standard deviation of the noise of measured velocities, rad/s (or m/s); see `Noise`."""
    return _setting("velocity_noise", values, Noise, "v")


def noise_seed(values: Values) -> Factor:
    """Seed of the noise, whole numbers of at least 0: other noise of the same size; see `Noise`."""
    return Factor("noise_seed", values, with_seed)


def velocity_filter(values: Values) -> Factor:
    """Cutoff of the filter of velocities by difference, rad/s; see `DifferencedVelocity`."""
    return _setting("velocity_filter", values, DifferencedVelocity, "omega")


def torque_resolution(values: Values) -> Factor:
    """Steps of the torque, N·m (or N), 0 for none; see `TorqueQuantisation`."""
    return _setting("torque_resolution", values, TorqueQuantisation, "step")


def torque_rate(values: Values) -> Factor:
    """Limit of the rate of the torque, N·m/s (or N/s); see `RateLimit`."""
    return _setting("torque_rate", values, RateLimit, "rate")


def dead_time(values: Values) -> Factor:
    """How long after it was asked for a torque acts, s; see `DeadTime`."""
    return _setting("dead_time", values, DeadTime, "time")


def torque_lag(values: Values) -> Factor:
    """Time constant of the torque, s; see `Lag`."""
    return _setting("torque_lag", values, Lag, "time_constant")


def torque_ripple(values: Values) -> Factor:
    """Share of the torque that ripples with the angle of the joint; see `Ripple`."""
    return _setting("torque_ripple", values, Ripple, "share")


def _setting(name: str, values: Values, kind: type, setting: str) -> Factor:
    return Factor(name, values, partial(with_device, device=kind.__name__, setting=setting))
