"""What a fixed step costs: a run estimates its own error from derivatives that it computes anyway."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, floor, log10
from sys import float_info
from typing import Any, NamedTuple

import numpy as np

from ..errors import StepWarning, warn
from .closed_loop import ClosedLoop
from .rates import damping_rate

#: share of the largest velocity above which the error of a step is not trusted
LIMIT = 2e-3
#: relative difference of two steps that count as equal
EQUAL = 1e-6
#: steps that are looked at together
BLOCK = 256
#: rows whose rates are looked at before a step is advised
LOOKS = 8
#: share of a step to which the estimate alone may shorten it
SHORTEST = 0.25


class Worst(NamedTuple):
    """The step with the largest error.

    Attributes:
        estimate: its error in velocity, as a share of the largest velocity of the run.
        robot, joint: where, counted from 0.
        time: at its end, s.
    """

    estimate: float
    robot: int
    joint: int
    time: float


class StepError:
    """Largest error of a step in the velocities, as a share of the largest velocity of the run.

    A step of the classical Runge-Kutta method ends with k_4, the derivative where it expects to arrive; the
    next step begins with k_1, the derivative where it did. Where the step is short enough both are the same,
    and else (h/6) |k_4 - k_1| is about the error. It does not see that friction set in within a step, for
    both are then behind it. So what two steps have gained is also held against Simpson's rule over both,
    |v_2 - v_0 - (h/3) (k_1,0 + 4 k_1,1 + k_1,2)|. The larger one counts.

    Args:
        robots, joints: shape of the velocities.
    """

    def __init__(self, robots: int, joints: int):
        size = robots * joints
        self._joints = joints
        self._v, self._a = np.zeros((2, BLOCK + 2, size))
        self._gaps = np.zeros((BLOCK + 2, size))
        self._t, self._h = np.zeros((2, BLOCK + 2))
        self._count = 2  # the first two rows are those before
        self.largest, self.speed, self.at, self.time = 0.0, 0.0, -1, 0.0

    def add(self, t: float, v: np.ndarray, h: float = 0.0, gap: Any = 0.0, slope: Any = np.nan) -> None:
        """Look at one instant.

        Args:
            t: the instant, s.
            v: velocities, (n, nv), rad/s.
            h: length of the step that ends here, s; 0 where it cannot be looked at, because the right-hand
                side jumps here.
            gap: k_4 of this step minus k_1 of the next, (n, nv), rad/s^2.
            slope: accelerations, (n, nv), rad/s^2, where they go on smoothly to the next instant.
        """
        i = self._count
        self._t[i], self._h[i] = t, h
        self._v[i], self._gaps[i], self._a[i] = np.ravel(v), np.ravel(gap), np.ravel(slope)
        self._count += 1
        if self._count == BLOCK + 2:
            self._sum_up()

    def note(self, largest: float, speed: float, at: int, time: float) -> None:
        """Take over what somebody else has found.

        Args:
            largest: error of the worst step, rad/s.
            speed: largest velocity, rad/s.
            at: index of the joint in a row of all robots' joints.
            time: end of that step, s.
        """
        self.speed = max(self.speed, speed)
        if largest > self.largest:
            self.largest, self.at, self.time = largest, at, time

    def worst(self) -> Worst | None:
        """The worst step until now; None if no step was looked at or nothing has moved."""
        self._sum_up()
        if self.at < 0 or not self.speed > 0:
            return None
        estimate = min(self.largest / self.speed, float_info.max)  # nothing infinite: files hold numbers
        return Worst(estimate, *divmod(self.at, self._joints), self.time)

    def _sum_up(self) -> None:
        """Keep the worst of the instants seen one by one, and the last two of them for those that follow."""
        if self._count > 2:
            errors = self._errors(*(kept[: self._count] for kept in (self._v, self._a, self._gaps, self._h)))
            k, at = np.unravel_index(errors.argmax(), errors.shape)
            speeds = np.abs(self._v[2 : self._count])
            speed = speeds.max(where=np.isfinite(speeds), initial=0.0)
            self.note(float(errors[k, at]), float(speed), int(at), float(self._t[k + 2]))
        for kept in (self._v, self._a, self._h):
            kept[:2] = kept[self._count - 2 : self._count].copy()
        self._count = 2

    def _errors(self, v: np.ndarray, a: np.ndarray, gaps: np.ndarray, h: np.ndarray) -> np.ndarray:
        """Errors of every instant; what is not finite does not count.

        The larger one of (h/6) |k_4 - k_1|, and of what two steps that are equal and smooth have gained
        against Simpson's rule.
        """
        step = h[2:, None]
        equal = (h[2:] > 0) & (np.abs(h[2:] - h[1:-1]) <= EQUAL * h[2:])
        rule = (step / 3) * (a[:-2] + 4 * a[1:-1] + a[2:])
        found = np.abs(gaps[2:]) * (step / 6), np.abs(v[2:] - v[:-2] - rule) * equal[:, None]
        return np.fmax(*(np.where(np.isfinite(errors), errors, 0.0) for errors in found))


def step_report(
    step_error: StepError, loop: ClosedLoop, rows: Mapping[str, np.ndarray], info: Mapping[str, Any]
) -> dict[str, Any] | None:
    """What a result says of its step.

    Args:
        step_error: what the run has found.
        loop: the closed loop.
        rows: logged arrays of a `Result` by name.
        info: how it was run: "dt", "integrator", "control_period".

    Returns:
        `estimate`: error in velocity of the worst step, as a share of the largest velocity, or None if no
        step could be looked at; `limit`: above it the step is too long; `robot` and `joint`, counted from 0,
        and `time`, s: where; `advised_step`, s: one that does, or None if this one does. None for a method
        that chooses its steps by itself.
    """
    if info["integrator"] != "rk4":
        return None
    worst = step_error.worst()
    if worst is None:
        where = dict.fromkeys(("estimate", "robot", "joint", "time", "advised_step"))
        return {**where, "limit": LIMIT}
    step = _advised(worst.estimate, loop, rows, info) if worst.estimate > LIMIT else None
    return {**worst._asdict(), "limit": LIMIT, "advised_step": step}


def warn_of_step(report: Mapping[str, Any] | None, names: Sequence[str], dt: float) -> None:
    """Warn whoever called the package if a step was too long.

    Args:
        report: as `step_report` gives it.
        names: of the robots.
        dt: the step, s.
    """
    if report is None or report["advised_step"] is None:
        return
    warn(
        f"dt = {dt:g} s is too long: at t = {report['time']:g} s a step errs by {report['estimate']:.2g} of "
        f"the largest velocity, at joint {report['joint'] + 1} of {names[report['robot']]}; expected at most "
        f"{LIMIT:g}, as with dt = {report['advised_step']:g} s",
        StepWarning,
    )


def _advised(
    estimate: float, loop: ClosedLoop, rows: Mapping[str, np.ndarray], info: Mapping[str, Any]
) -> float:
    """A step with an estimate below the limit, s, in two digits.

    The estimate falls with the fourth power of the step, once that resolves what damps the robots; before,
    and when a run has blown up, its size means nothing.
    """
    h, period = info["dt"], info["control_period"]
    step = h * max(0.9 * (LIMIT / estimate) ** 0.25, SHORTEST)
    looks = np.unique(np.linspace(0, len(rows["t"]) - 1, LOOKS).astype(int))
    moments = [(float(rows["t"][k]), np.stack((rows["q"][k], rows["v"][k]))) for k in looks]
    rate = max(damping_rate(loop, *moment, period is not None) for moment in moments)
    if h * rate > 1:
        step = min(step, 0.5 / rate)
    digit = 10.0 ** (floor(log10(step)) - 1)
    step = float(f"{floor(step / digit) * digit:.2g}")
    return step if period is None else period / ceil(period / step)
