"""What a measure of a user's own is told of one instant of a run."""

from __future__ import annotations

from typing import Any, NamedTuple


class Instant(NamedTuple):
    """One instant of a run, by the names that a `Result` has for them.

    The entries are numbers, or symbols where the measure is compiled: what is written with arithmetic and
    with numpy's functions, and asks nothing of the numbers, works for both.

    Attributes:
        x, x_desired, tracking_error, coupled_error: of the task, (n, m).
        sync_error: of the pairs, (p, m).
        q, v: positions and velocities of the joints, (n, nv).
        tau: torque that the controller asks for, (n, nv).
    """

    x: Any
    x_desired: Any
    tracking_error: Any
    sync_error: Any
    coupled_error: Any
    q: Any
    v: Any
    tau: Any
