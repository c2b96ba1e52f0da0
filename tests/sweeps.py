"""Small sweeps that run in a blink, also in processes of their own."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import replace
from pathlib import Path

from cells import SMALL_GAINS, small_cell

from synctrl import Disturbance, Experiment
from synctrl.sweep import Factor, Grid, LogUniform, Sweep, Uniform, gain, model_error
from synctrl.sweep.journal import Journal

__all__ = ["DT", "Grid", "Journal", "base", "die", "die_once", "quiet", "slow_sweep", "small_sweep"]

DT = 2e-3


def base(**changes) -> Experiment:
    """Two arms for a hundredth of a second, with a push."""
    push = Disturbance(0, (1.0, 2.0), 0.002, 0.006)
    return replace(Experiment(small_cell(), SMALL_GAINS, 0.01, [push]), **changes)


def small_sweep(samples=5, seed=3, start=None, **options) -> Sweep:
    factors = [gain("beta", LogUniform(1, 100)), model_error(Uniform(-1, 1))]
    options = {"engine": "pinocchio", "dt": DT, **options}
    return Sweep(start or base(), factors, samples=samples, seed=seed, **options)


def slow_sweep(pause: float) -> Sweep:
    """Eight runs that each take a little while."""
    factors = [gain("beta", LogUniform(1, 100)), Factor("pause", Grid([0]), Pause(pause))]
    return Sweep(base(), factors, samples=8, dt=DT, engine="pinocchio")


class Pause:
    """A function that takes its time and changes nothing."""

    def __init__(self, pause: float):
        self.pause = pause

    def __call__(self, experiment, value):
        time.sleep(self.pause)
        return experiment


def quiet(sweep, folder, *arguments, **options) -> bytes:
    """The sweep's table, made without a progress bar."""
    return sweep.run(folder, *arguments, progress=False, **options).read_bytes()


def die_once(experiment, value, flag):
    """Kill this process the first time a run comes to value 2."""
    if value == 2 and not Path(flag).exists():
        Path(flag).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return experiment


def die(experiment, value):
    """Kill this process in every run that comes to value 2."""
    if value == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return experiment
