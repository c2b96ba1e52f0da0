"""Many runs of one experiment: factors and their values, here or on a cluster, resumed where they stopped."""

from .distributions import Choice, Grid, LogUniform, Normal, Uniform
from .factors import (
    Factor,
    adaptation,
    control_period,
    disturbance_scale,
    disturbance_start,
    gain,
    gain_scale,
    initial_estimates,
    initial_positions,
    initial_velocities,
    law,
    model_error,
    network,
    true_parameters,
    weights,
)
from .journal import load, trajectories
from .sweep import Sweep

__all__ = [
    "Choice",
    "Factor",
    "Grid",
    "LogUniform",
    "Normal",
    "Sweep",
    "Uniform",
    "adaptation",
    "control_period",
    "disturbance_scale",
    "disturbance_start",
    "gain",
    "gain_scale",
    "initial_estimates",
    "initial_positions",
    "initial_velocities",
    "law",
    "load",
    "model_error",
    "network",
    "trajectories",
    "true_parameters",
    "weights",
]
