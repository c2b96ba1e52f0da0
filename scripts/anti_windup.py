"""What becomes of estimates when torque is cut off, with and without bounds: prints a table.

    python scripts/anti_windup.py

docs/saturation.md tells what it shows. The cells are the paper's and two UR5, with less torque than needed.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from synctrl import Cell, Disturbance, Experiment, Result, Robot
from synctrl.control.adaptation import Gradient, Hedged, bounded
from synctrl.errors import SimulationError
from synctrl.experiments import a460_pair, planar_four, ur5_payload
from synctrl.experiments.a460_pair import GAINS
from synctrl.tasks.spaces import CartesianSpace, JointSpace


def with_limits(experiment: Experiment, limits: ArrayLike) -> Experiment:
    """An experiment whose robots have other torque limits, (n, nv), N·m, at which torque is cut off."""
    cell, members = experiment.cell, []
    for member, row in zip(cell.members, np.broadcast_to(limits, (cell.n, cell.nv)), strict=True):
        model = member.robot.model.copy()
        model.effortLimit[:] = row
        members.append(replace(member, robot=Robot(model, member.robot.tip, name=member.robot.name)))
    return replace(experiment, cell=Cell(members, cell.coupling, cell.space, cell.name), saturate=True)


def gravity(experiment: Experiment) -> np.ndarray:
    """Torque of gravity where the robots start, (n, nv), N·m."""
    cell = experiment.cell
    return np.abs([robot.gravity(q) for robot, q in zip(cell.robots, cell.q0, strict=True)])


def planar_below_need() -> Experiment:
    """Limits of 60 % of what the quiet run needs, and the paper's push."""
    need = np.abs(planar_four().simulate(0.2).tau).max(axis=0)
    return with_limits(planar_four(disturbance="torque"), 0.6 * need)


def pushed_above_limits() -> Experiment:
    """400 N·m on every joint of an A460 whose limits are 200 and 300, for a second."""
    return replace(a460_pair(), disturbances=[Disturbance(0, 400.0, 0.5, 1.5)], saturate=True)


def little_beside_gravity() -> Experiment:
    """UR5 of which gravity takes up to 70 % of the limits, the wrist's at least 3 N·m."""
    free = ur5_payload()
    way = free.simulate(2.0, dt=4e-3).q[::25]
    weight = [[robot.gravity(q) for robot, q in zip(free.cell.robots, now, strict=True)] for now in way]
    return with_limits(free, np.maximum(np.abs(weight).max(axis=0) / 0.7, 3.0))


def below_gravity() -> Experiment:
    """A460 that learn ten times as fast as the paper's, with 24 N·m for every 28 that gravity takes."""
    eager = a460_pair(gains=GAINS.replace(Gamma=3.0))
    return with_limits(eager, np.maximum(24 / 28 * gravity(eager), 12.0))


CELLS: dict[str, Callable[[], Experiment]] = {
    "planar four, 60 % of the need, pushed": planar_below_need,
    "A460, 400 N·m for 1 s": pushed_above_limits,
    "UR5, gravity takes 70 %": little_beside_gravity,
    "A460, 24 N·m where 28 are needed": below_gravity,
}


def plain(experiment: Experiment) -> Experiment:
    """The same with (14) as it is, without bounds."""
    gains = experiment.gains
    return replace(experiment, adaptation=Gradient(gains.Gamma), gains=gains.replace(Gamma=None))


def hedged(experiment: Experiment, speed: float | None = None) -> Experiment:
    """The same with a hedge around bounded estimates."""
    gains = experiment.gains
    adaptation = Hedged(bounded(experiment.cell, gains.Gamma), float(np.max(gains.Lambda)), speed)
    return replace(experiment, adaptation=adaptation, gains=gains.replace(Gamma=None))


def run(experiment: Experiment, duration: float | None = None, engine: str = "pinocchio") -> Result:
    """The run, or what there is of it if it had to stop."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return experiment.simulate(duration, engine=engine)
        except SimulationError as stop:
            return stop.result


def main() -> None:
    print("largest |theta_hat|, largest torque asked for, N·m, last cut, s, largest |e| at the end")
    for name, make in CELLS.items():
        experiment = make()
        ways = {"(14)": plain(experiment), "bounded": experiment}
        if isinstance(experiment.cell.space, (JointSpace, CartesianSpace)):
            ways["hedged"] = hedged(
                experiment, 20.0 if isinstance(experiment.cell.space, JointSpace) else None
            )
        for how, each in ways.items():
            result = run(each)
            cut = result.t[(result.outputs["applied_torque"] != result.tau).any(axis=(1, 2))]
            numbers = np.abs(result.theta_hat).max(), np.abs(result.tau).max(), cut[-1]
            print(f"{name}, {how}:", *(f"{x:.3g}" for x in numbers), end=" ")
            error = np.abs(result.x_desired[-1] - result.x[-1]).max()  # a hedge takes its share off e
            print(f"{error:.2g}, {result.status.partition(':')[0]} at {result.t[-1]:.3g} s")


if __name__ == "__main__":
    main()
