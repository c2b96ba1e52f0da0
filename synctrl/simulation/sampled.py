"""Sampled control: torque and adaptation are held between samples, as a digital controller does.

This is another problem than the continuous law: its error falls with the first power of the period, and too
long a period makes the closed loop unstable.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .clock import Clock, multiple
from .closed_loop import ClosedLoop
from .disturbances import DisturbanceSchedule
from .integrators import Sample, final, steps
from .step_error import StepError


def steps_per_sample(period: float, dt: float) -> int:
    """How many steps a sample lasts.

    Raises:
        InputError: the period is not positive, or no multiple of dt.
    """
    return multiple("control_period", period, dt)


def sampled_rk4(
    loop: ClosedLoop, clock: Clock, schedule: DisturbanceSchedule, every: int, step_error: StepError
) -> Iterator[Sample]:
    """The plant by the classical Runge-Kutta method, under a controller that acts once in so many steps.

    Within a period torque, theta_hat' and the integrands of the synchronization errors keep their values, so
    the estimates and integrals advance as in x_{k+1} = x_k + period x'_k. The torque of an instant is the one
    that acts from it on; at the end of the run that of a new sample, if one is due.
    """
    y = loop.initial_state()
    step_error.add(0.0, loop.cell.v0)
    held, tau = np.zeros(loop.size), np.zeros((loop.cell.n, loop.cell.nv))
    for step in steps(loop, clock, schedule):
        disturbance = schedule.torques[step.window]
        if step.checked:
            y_dot, signals = loop.evaluate(step.stages[0], y, disturbance)
            if step.number % every == 0:
                held, tau = y_dot, signals.tau
            yield Sample(step.t, y, disturbance, replace(signals, tau=tau), step.logged)
        plant, h = loop.at(0.5 * (step.t + step.t_next)), step.t_next - step.t
        y, k4, k5 = _rk4_step(plant, y, h, held, tau, disturbance)
        step_error.add(step.t_next, loop.split(y)[1], h, loop.split(k4 - k5)[1])
    last = final(loop, clock, y, disturbance)
    yield last if clock.sampled_at_end(every) else last._replace(signals=replace(last.signals, tau=tau))


def _rk4_step(
    loop: ClosedLoop, y: np.ndarray, h: float, held: np.ndarray, tau: np.ndarray, disturbance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The state a step later, the last derivative on the way, and the one there before a new sample."""

    def coast(y: np.ndarray) -> np.ndarray:
        return loop.coast(y, held, tau, disturbance)

    k1 = coast(y)
    k2 = coast(y + 0.5 * h * k1)
    k3 = coast(y + 0.5 * h * k2)
    k4 = coast(y + h * k3)
    y = y + (h / 6) * (k1 + 2 * (k2 + k3) + k4)
    return y, k4, coast(y)
