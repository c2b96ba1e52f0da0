"""Many runs of one experiment: factors and their values, here or on a cluster, resumed where they stopped."""

from .distributions import Choice, Grid, LogUniform, Normal, Uniform
from .factors import (
    Factor,
    control_period,
    disturbance_scale,
    disturbance_start,
    gain,
    gain_scale,
    initial_estimates,
    initial_positions,
    initial_velocities,
    model_error,
    true_parameters,
    weights,
)
from .sweep import Sweep
from .table import load, trajectories

__all__ = [
    "Choice",
    "Factor",
    "Grid",
    "LogUniform",
    "Normal",
    "Sweep",
    "Uniform",
    "control_period",
    "disturbance_scale",
    "disturbance_start",
    "gain",
    "gain_scale",
    "initial_estimates",
    "initial_positions",
    "initial_velocities",
    "load",
    "model_error",
    "trajectories",
    "true_parameters",
    "weights",
]
