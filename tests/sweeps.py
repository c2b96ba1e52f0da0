"""Small sweeps that run in a blink, also in processes of their own."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

from cells import SMALL_GAINS, small_cell

from synctrl import Disturbance, Experiment
from synctrl.errors import ResultError
from synctrl.sweep import Factor, Grid, LogUniform, Sweep, Uniform, gain, model_error
from synctrl.sweep.journal import Journal

__all__ = ["DT", "Grid", "Journal", "base", "begun", "die", "die_once", "quiet", "slow_sweep", "small_sweep"]

DT = 2e-3


def base(**changes) -> Experiment:
    """Two arms for a hundredth of a second, with a push."""
    push = Disturbance(0, (1.0, 2.0), 0.002, 0.006)
    return replace(Experiment(small_cell(), SMALL_GAINS, 0.01, [push]), **changes)


def small_sweep(samples=5, seed=3, start=None, **options) -> Sweep:
    factors = [gain("beta", LogUniform(1, 100)), model_error(Uniform(-1, 1))]
    options = {"engine": "pinocchio", "dt": DT, **options}
    return Sweep(start or base(), factors, samples=samples, seed=seed, **options)


def begun(sweep, folder) -> Journal:
    """The folder of a sweep that has begun."""
    journal = Journal(folder)
    journal.begin(sweep.about(sweep.study.job(journal.known())), sweep._draws)
    return journal


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


def interrupted_once(flag) -> Sweep:
    """Four runs, the third of which is interrupted the first time."""
    factor = Factor("number", Grid(range(4)), partial(interrupt, flag=str(flag)))
    return Sweep(base(), [factor], dt=DT, engine="pinocchio")


def interrupt(experiment, value, flag):
    """Send this process what Ctrl-C sends it, the first time a run comes to value 2."""
    if value == 2 and not Path(flag).exists():
        Path(flag).touch()
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job ignores it otherwise
        signal.raise_signal(signal.SIGINT)
    return experiment


def take(folder, processes, rounds):
    """What each of some processes is told that take a fresh folder at the same moment, round by round."""
    context = multiprocessing.get_context("spawn")
    barrier, answers = context.Barrier(processes), context.Queue()
    crew = [
        context.Process(target=_take, args=(str(folder), rounds, barrier, answers)) for _ in range(processes)
    ]
    for process in crew:
        process.start()
    try:
        told = [answers.get(timeout=600) for _ in range(rounds * processes)]
    finally:
        for process in crew:
            process.join(60)
            process.kill()
    return [[answer for k, answer in told if k == number] for number in range(rounds)]


def _take(folder, rounds, barrier, answers):
    sweep = small_sweep(bands={"tracking_error": 1e-3, "sync_error": 1e-3})
    about = sweep.about(sweep.study.job())
    for number in range(rounds):
        barrier.wait()
        journal = None
        try:
            journal = Journal(Path(folder) / str(number))
            journal.begin(about, sweep._draws)
            answer = "mine"
        except ResultError as error:
            answer = str(error).split(":")[0]
        barrier.wait()  # nobody lets go before all have tried
        answers.put((number, answer))
        if journal is not None:
            journal.close()
        barrier.wait()
