"""Sampled control, gone through again with the torque that acted between samples.

A replay has what the law would ask for in the true state at every instant. A digital controller asks for it
at samples only, of a motion that is measured; torque, and the rates of estimates and of integrals, are held
until the next sample. So every interval of the log becomes a piece of its own here, with two ends at
which the plant is asked how it moves under the torque that acted.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..simulation.closed_loop import ClosedLoop
from .jumps import SmoothPart
from .lyapunov import reference_gap
from .moment import Moment
from .replay import Replay, state_at


class Held(NamedTuple):
    """A run under sampled control.

    Attributes:
        run: its instants, two rows for each interval of the log; `tau` is what the law would ask for,
            `v_dot` how the plant moves, `cut_off` what saturation takes from the torque that is held, and
            `gap` has what the rate of v_ref has beyond a_ref.
        torques: torques d that come of samples and devices, by source, as of `unmodelled`.
    """

    run: Replay
    torques: dict[str, np.ndarray]


def held(run: Replay) -> Held:
    """A run under sampled control with the torque that acted."""
    result, starts = run.result, run.logged[:-1]
    ends = np.stack((starts, starts + 1), axis=1).ravel()
    x = Moment(*(field[ends] for field in run.rows))
    asked = np.repeat(result.tau[:-1], 2, axis=0)
    passed = run.loop.plant.applied(asked)
    acted = _acted(run, passed)
    pieces = tuple(SmoothPart(k, k + 1, slice(2 * k, 2 * k + 2)) for k in range(len(starts)))
    logged = np.append(2 * np.arange(len(starts)), 2 * len(starts) - 1)
    x = x._replace(cut_off=asked - passed, v_dot=_motion(run, acted, x.disturbance))
    known = replace(run, rows=x, logged=logged, pieces=pieces)
    x = x._replace(gap=_gap(known))
    torques = {"sampling": x.tau - asked + np.matvec(x.M, x.gap), "actuators": passed - acted}
    return Held(replace(known, rows=x), torques)


def _acted(run: Replay, passed: np.ndarray) -> np.ndarray:
    """Torque of the motors at both ends of every interval: what lags goes on, all else is held."""
    motors = run.result.outputs.get("actuator_torque")
    drive = run.loop.devices.start(run.result.info["control_period"]).drive
    if motors is None or drive is None:
        return passed
    after = np.where(drive.rate > 0, motors[1:], motors[:-1])
    return np.stack((motors[:-1], after), axis=1).reshape(passed.shape)


def _motion(run: Replay, acted: np.ndarray, disturbance: np.ndarray) -> np.ndarray:
    """Accelerations of the plant at both ends of every interval."""
    result, found, rate = run.result, np.empty_like(acted), run.loop.state()
    for row, (tau, push) in enumerate(zip(acted, disturbance, strict=True)):
        start = row // 2
        loop: ClosedLoop = run.loop.at(float(result.t[start]))
        loop.respond(loop.state(state_at(result, start + row % 2)), tau, push, rate)
        found[row] = rate.v
    return found


def _gap(run: Replay) -> np.ndarray:
    """What v_ref' has beyond a_ref, the same at both ends of an interval: from how far v_ref came."""
    x, h = run.rows, np.diff(run.result.t)[:, None, None]
    known = x.a_ref + reference_gap(run)
    found = (x.v_ref[1::2] - x.v_ref[::2]) / h - 0.5 * (known[1::2] + known[::2])
    return np.repeat(found, 2, axis=0)
