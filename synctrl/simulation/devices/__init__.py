"""Sensors and actuators: what stands between the robots and their controller under sampled control."""

from .actuators import Actuator, DeadTime, Lag, RateLimit, Ripple, TorqueQuantisation
from .fitted import Devices, LiveDevices
from .sensors import Bias, DifferencedVelocity, Noise, Quantisation, Sensor

__all__ = [
    "Actuator",
    "Bias",
    "DeadTime",
    "Devices",
    "DifferencedVelocity",
    "Lag",
    "LiveDevices",
    "Noise",
    "Quantisation",
    "RateLimit",
    "Ripple",
    "Sensor",
    "TorqueQuantisation",
]
