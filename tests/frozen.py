"""The runs of version 0.1, kept to hold later versions against.

`frozen_0_1.npz` has a few instants of every array of every run below, computed by commit 1e460aa. It is not a
judge of what is right, the other tests are: it tells that a number changed which nobody meant to change.

To write the file anew from a checkout of that commit: `PYTHONPATH=CHECKOUT python tests/frozen.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from synctrl import Disturbance, Experiment, Result
from synctrl.experiments import (
    a460_full_pair,
    a460_pair,
    mixed_four,
    mobile_robot,
    panda_four,
    planar_four,
    rigid_object,
    ur5_payload,
)
from synctrl.simulation.result import LAYOUT

FILE = Path(__file__).with_name("frozen_0_1.npz")
#: instants kept of a run
INSTANTS = 7


class Run(NamedTuple):
    """A ready cell, how it is run, and whether the compiled engine of version 0.1 had it."""

    make: Callable[[], Experiment]
    options: dict[str, Any]
    compiled: bool = True


def _pushed() -> Experiment:
    return planar_four(disturbance=Disturbance(2, 0.4, 0.10003, 0.20007))


RUNS = {
    "four planar arms": Run(planar_four, {"duration": 1.0}),
    "four planar arms, independent": Run(lambda: planar_four(synchronized=False), {"duration": 1.0}),
    "four planar arms, disturbed": Run(lambda: planar_four(disturbance="torque"), {"duration": 1.0}),
    "four planar arms, pushed between steps": Run(_pushed, {"duration": 0.4}),
    "four planar arms, damped in task space": Run(lambda: planar_four(k_r_space="task"), {"duration": 0.5}),
    "four planar arms, sampled": Run(planar_four, {"duration": 0.5, "control_period": 4e-3}),
    "four planar arms, RK45": Run(planar_four, {"duration": 0.3, "integrator": "RK45"}, compiled=False),
    "two A460": Run(a460_pair, {"duration": 2.5}),
    "two A460, independent": Run(lambda: a460_pair(synchronized=False), {"duration": 1.0}),
    "two A460, no friction, (13) as printed": Run(
        lambda: a460_pair(friction=False, reference_acceleration="paper"), {"duration": 1.0}
    ),
    "two A460, sampled": Run(a460_pair, {"duration": 1.0, "control_period": 2e-3}),
    "two six-joint A460": Run(a460_full_pair, {"duration": 0.3}, compiled=False),
    "two UR5": Run(ur5_payload, {"duration": 0.3}),
    "four Pandas": Run(panda_four, {"duration": 0.3}),
    "mixed cell": Run(mixed_four, {"duration": 0.3}),
    "a rigid object": Run(rigid_object, {"duration": 0.5}),
    "a vehicle": Run(mobile_robot, {"duration": 0.5}),
}


def digest(result: Result) -> dict[str, np.ndarray]:
    """A few instants of every array."""
    rows = np.linspace(0, len(result.t) - 1, INSTANTS).astype(int)
    return {name: getattr(result, name)[rows] for name in LAYOUT}


def main() -> None:
    """Run everything by the reference engine and write the file."""
    content = {}
    for name, run in RUNS.items():
        print(name, flush=True)
        for array, values in digest(run.make().simulate(**run.options)).items():
            content[f"{name}/{array}"] = values
    np.savez_compressed(FILE, **content)


if __name__ == "__main__":
    main()
