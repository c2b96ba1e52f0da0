"""What was measured of runs side by side: put together from what the library counted up in its lanes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np


class MeasuredErrors(NamedTuple):
    """Measures of one kind of error, (runs, rows, m) each; see `analysis.metrics.ErrorMetrics`."""

    peak: np.ndarray
    ise: np.ndarray
    settling_time: np.ndarray
    final: np.ndarray


class Measured(NamedTuple):
    """What was measured of runs; of one that ended early only how it ended means anything.

    Attributes:
        tracking_error, sync_error: of the errors; NaN, as torque and cut, in a run that ended early.
        peak_torque: largest torque that was asked for, (runs, n, nv), N·m or N.
        cut: at how many instants it was larger than the limit, (runs, n, nv).
        own: of every further measure the largest number, the integral over time and the last number,
            (runs, measures, 3); NaN in a run that ended early.
        step_error: error of the worst step and the largest velocity, in rad/s, and the end of that step, s,
            (runs, 3); see `StepError`. NaN in a run that ended early.
        joint: in a row of all robots' joints, at which it was, (runs,); -1 if no step was looked at, or the
            run ended early.
        status: 0 of a run that went to its end, else what the guard found, see `stepper.found_check`,
            (runs,).
        stop_time: when it ended, s, (runs,).
        robot, value: at which robot, and the number that was too large, (runs,).
        instants: how many instants were looked at in a run that went to its end.
    """

    tracking_error: MeasuredErrors
    sync_error: MeasuredErrors
    peak_torque: np.ndarray
    cut: np.ndarray
    own: np.ndarray
    step_error: np.ndarray
    joint: np.ndarray
    status: np.ndarray
    stop_time: np.ndarray
    robot: np.ndarray
    value: np.ndarray
    instants: int


class Seen(NamedTuple):
    """What was seen of runs that stood in lanes; lanes come last.

    Attributes:
        times: instants that were looked at, s.
        instants: how many they were.
        ended: status, robot, time and value.
        worst: error of the worst step, largest velocity, time and joint.
        tally: what was counted up, by name.
    """

    times: np.ndarray
    instants: int
    ended: np.ndarray
    worst: np.ndarray
    tally: dict[str, np.ndarray]


def joined(parts: Sequence[Seen], count: int) -> Measured:
    """Measures of all runs, without the lanes that were too many."""

    def one(arrays: Iterable[np.ndarray]) -> np.ndarray:
        return np.ascontiguousarray(np.moveaxis(np.concatenate([*arrays], axis=-1), -1, 0)[:count])

    status, robot, stop_time, value = one(part.ended for part in parts).T
    worst = one(part.worst for part in parts)
    times = max((part.times for part in parts), key=len)
    tally = {name: one(part.tally[name] for part in parts) for name in parts[0].tally}
    for array in (*tally.values(), worst[:, :3]):
        array[status != 0] = np.nan  # of a run that ended early nothing is known
    return Measured(
        tracking_error=_errors("tracking", tally, times),
        sync_error=_errors("sync", tally, times),
        peak_torque=tally["torque torque"],
        cut=tally["torque cut"],
        own=np.stack([tally[f"own {name}"] for name in ("largest", "integral", "before")], axis=-1),
        step_error=worst[:, :3],
        joint=np.where(status != 0, -1, worst[:, 3]).astype(int),
        status=status.astype(int),
        stop_time=stop_time,
        robot=robot.astype(int),
        value=value,
        instants=max(part.instants for part in parts),
    )


def _errors(kind: str, tally: Mapping[str, np.ndarray], t: np.ndarray) -> MeasuredErrors:
    peak, ise, final, outside = (tally[f"{kind} {name}"] for name in ("peak", "ise", "final", "outside"))
    settled = np.append(t, (np.inf, np.nan))[np.nan_to_num(outside, nan=len(t)).astype(int) + 1]
    return MeasuredErrors(peak, ise, settled, final)
