"""The two CRS A460 arms with all six joints, as they stood in the paper's laboratory.

The plant has six joints, of which PID controllers hold the last three; the adaptive controller commands the
first three and knows a lumped mass in place of the wrist. Everything else is as in `a460_pair`. The PID gains
are ours: about 60 rad/s and well damped for each joint alone.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from ..robots.catalog import load_robot
from ..simulation.held_joints import HeldJointsPlant, Pid
from ..simulation.simulate import Experiment
from .a460_pair import BASES, a460_pair

WRIST = Pid(P=(7.0, 20.0, 2.0), I=(70.0, 200.0, 20.0), D=(0.25, 0.6, 0.06))


def a460_full_pair(wrist: Pid = WRIST, **options: Any) -> Experiment:
    """The cell of section V-A with six joints in the plant and three in the controller.

    Args:
        wrist: the controllers of joints 4 to 6.
        options: of `a460_pair`, its `adaptation`, `law` and `network` too.
    """
    known = a460_pair(**options)
    robot = load_robot("a460_full")
    robots = [robot.placed(*base, name=f"A460 {i + 1}") for i, base in enumerate(BASES)]
    plant = partial(HeldJointsPlant, robots=robots, pid=wrist)
    return replace(known, plant_type=plant, title=f"{known.title}, six joints")
