"""Laws and adaptations side by side on both cells of the paper: a page of tables, figures and verdicts.

python scripts/compare_laws.py [--out out] [--duration SECONDS] [--engine compiled]
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from synctrl import Experiment, Robot, load_robot
from synctrl.analysis import compare
from synctrl.analysis.comparison import undisturbed
from synctrl.analysis.free_gain import under
from synctrl.control.adaptation import (
    Adaptation,
    Ball,
    Box,
    EModification,
    Gradient,
    Leakage,
    Natural,
    Switching,
)
from synctrl.control.laws import (
    ChungSlotine,
    ComputedTorque,
    Law,
    MasterSlave,
    PDGravity,
    SlotineLi,
    SunMills,
)
from synctrl.coupling.cell import Cell
from synctrl.errors import InputError, SimulationError, SynctrlError
from synctrl.experiments import a460_pair, planar_four
from synctrl.paper.adaptation_trials import timed, try_adaptations
from synctrl.paper.law_sections import adaptation_section, comparison_section, cost_table
from synctrl.paper.report import Section, Text, write_page

#: of runs of the four arms, s: then they stand at their goals
PLANAR = 3.0
#: of leakage, 1/s or 1/rad, and of adaptations that know bodies, 1/(N·m)
RATE, SHARE = 0.5, 0.1
PUSHED = "Disturbed: the paper's push of 1 N·m on robot 1."
RUBBED = "Disturbed: friction in the plant that the controller does not know."

INTRODUCTION = (
    "A law that is given more gain tracks better, whatever it is. So every law has up to three rows beside "
    "the paper's: errors common to all robots die out at the same rate, the quiet run takes the same peak "
    "torque, or it has the same RMS tracking error. One gain of the law, named in the table, is solved for; "
    "where no value does it the row says so. With the same gains each law runs once more disturbed. "
    "Adaptations learn under the paper's law and gains; bounds and radii hold the true parameters."
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the page and its figures")
    parser.add_argument("--duration", type=float, help="of every run, s; by default 3 s and 4 s")
    parser.add_argument("--engine", default="compiled", help="that makes the runs")
    options = parser.parse_args()
    started = time.monotonic()
    try:
        page = laws_page(options.out, options.duration, options.engine)
    except SynctrlError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"see {page}, made in {time.monotonic() - started:.0f} s")
    return 0


def laws_page(out: Path, duration: float | None = None, engine: str = "compiled") -> Path:
    """Make all runs, and write the page to `out/laws.html`."""
    planar, a460 = (
        {"duration": duration or PLANAR, "engine": engine},
        {"duration": duration, "engine": engine},
    )
    robot = load_robot("a460")
    sections = [
        Section("What is compared", (Text(INTRODUCTION),)),
        laws_section(out, "planar_four", planar_four(disturbance="torque"), PUSHED, planar),
        laws_section(out, "a460_pair", a460_pair(), RUBBED, a460),
        learning_section("friction that the controller does not know", a460_pair(), 0.3, robot, a460),
        learning_section("no friction", a460_pair(friction=False), 0.3, robot, a460),
        learning_section("pushed", planar_four(disturbance="torque"), 0.1, None, planar),
        learning_section("not pushed", planar_four(), 0.1, None, planar),
    ]
    return write_page(out / "laws.html", "Laws and adaptations, side by side", sections)


def laws_section(out: Path, name: str, experiment: Experiment, note: str, options: dict[str, Any]) -> Section:
    """The laws on one cell."""
    found = compare(experiment, rivals(experiment), **options)
    print(found, flush=True)
    laws = [SunMills(), *rivals(experiment)]
    costs = {type(law).__name__: cost(under(experiment, law), options) for law in laws}
    print("s per step:", costs, flush=True)
    section = comparison_section(found, out / "figures" / f"laws_{name}", note)
    return Section(section.title, (*section.blocks, cost_table(costs)))


def cost(experiment: Experiment, options: dict[str, Any]) -> float | None:
    """Processor time of a step, s; None if the engine refuses the law, or the run has to stop."""
    try:
        return timed(undisturbed(experiment), options)[1]
    except (InputError, SimulationError):
        return None


def rivals(experiment: Experiment) -> list[Law]:
    """The laws to compare with; free gains begin at a share of the damping."""
    damping = float(np.max(experiment.gains.K_r))
    stiffness = damping * float(np.max(experiment.gains.Lambda))
    return [SlotineLi(), ChungSlotine(0.3 * damping), MasterSlave(), ComputedTorque(), PDGravity(stiffness)]


def learning_section(
    what: str, experiment: Experiment, Gamma: float, robot: Robot | None, options: dict[str, Any]
) -> Section:
    """The adaptations on one cell; those that need bodies if a robot says which."""
    learners = {**of_numbers(experiment.cell, Gamma), **({} if robot is None else of_bodies(robot))}
    trials = try_adaptations(experiment, learners, **options)
    for trial in trials:
        print(trial, flush=True)
    cell = experiment.cell
    return adaptation_section(f"{cell.name}, {what}", trials, (cell.unit, cell.weighted_unit, "N·m"))


def of_numbers(cell: Cell, Gamma: float) -> dict[str, Adaptation]:
    """Adaptations of any parameters, with bounds that hold the true ones."""
    theta, theta_hat0 = cell.theta, cell.theta_hat0
    far = float(np.sqrt(((theta - theta_hat0) ** 2).sum(axis=1).max() / Gamma))
    width = 0.5 * np.abs(theta) + np.maximum(0.05, 1.2 * np.abs(theta - theta_hat0))
    return {
        "none": Gradient(0.0),
        f"Gradient({Gamma})": Gradient(Gamma),
        f"Leakage({Gamma}, {RATE})": Leakage(Gamma, RATE),
        f"Leakage({Gamma}, Switching({RATE}, {1.2 * far:.3g}))": Leakage(Gamma, Switching(RATE, 1.2 * far)),
        f"Leakage({Gamma}, EModification({RATE}))": Leakage(Gamma, EModification(RATE)),
        f"Box({Gamma}, around theta)": Box(Gamma, theta - width, theta + width),
        f"Ball({Gamma}, {1.2 * far:.3g})": Ball(Gamma, 1.2 * far),
    }


def of_bodies(robot: Robot) -> dict[str, Adaptation]:
    """Adaptations that know bodies."""
    return {
        f"Gradient.pullback(robot, {SHARE})": Gradient.pullback(robot, SHARE),
        f"Natural({SHARE})": Natural(SHARE),
    }


if __name__ == "__main__":
    sys.exit(main())
