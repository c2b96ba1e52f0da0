"""What bounds a joint, as a URDF states it: what is no bound is taken as none, and said if the joint moves.

Exporters write an effort of 0 where they know none, and leave out what they were not told. None of this
changes the mechanism, so it never costs the robot.
"""

from __future__ import annotations

import math

from .document import Limit
from .report import Note
from .xml import Element

LIMITS = ("lower", "upper", "effort", "velocity")


def read_limit(joint: Element, kind: str) -> tuple[Limit, tuple[Note, ...]]:
    """The limits of a moving joint, and what there is to say about them if it moves.

    Args:
        joint: the `<joint>`.
        kind: its type. A continuous joint has no range, and may have no `<limit>` at all.

    Raises:
        RobotError: a bound that is no number.
    """
    limit = joint.first("limit")
    if limit is None:
        said = [] if kind == "continuous" else ["no <limit>: neither range nor torque nor speed is bounded"]
        return Limit(), _notes(joint, said)
    limit.know((), LIMITS)
    effort, velocity = limit.bound("effort"), limit.bound("velocity")
    said = [_unbounded(key, value) for key, value in (("effort", effort), ("velocity", velocity))]
    lower, upper, of_range = (None, None, "") if kind == "continuous" else _range(limit)
    notes = _notes(limit, [text for text in (of_range, *said) if text])
    return Limit(_bound(effort), _bound(velocity), lower, upper), notes


def _notes(element: Element, texts: list[str]) -> tuple[Note, ...]:
    return tuple(Note("assumed", element.place, text, element.line) for text in texts)


def _bound(value: float | None) -> float:
    return value if value is not None and value > 0 else math.inf


def _unbounded(key: str, value: float | None) -> str:
    """What is said of an effort or velocity that bounds nothing; empty of a good one."""
    if value is not None and 0 < value < math.inf:
        return ""
    return f"{key} {'missing' if value is None else format(value, 'g')} is taken as no limit"


def _range(limit: Element) -> tuple[float | None, float | None, str]:
    """Both ends of a range, None where it is open, and what is said about it."""
    lower, upper = limit.bound("lower"), limit.bound("upper")
    if lower is None and upper is None:
        return None, None, "no range is stated, and none is assumed"
    said = ""
    for key, value in (("lower", lower), ("upper", upper)):
        if value is None:
            said = f"no {key} is stated; it is 0, as in every URDF"
        elif math.isinf(value):
            said = f"{key} {value:g} is taken as no limit"
    return *(_open(0.0 if value is None else value) for value in (lower, upper)), said  # type: ignore[return-value]


def _open(value: float) -> float | None:
    return None if math.isinf(value) else value
