"""Laws and adaptations side by side on both cells of the paper: a page of tables, figures and verdicts.

python scripts/compare_laws.py [--out out] [--duration SECONDS]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from synctrl import Experiment, load_robot
from synctrl.analysis import compare
from synctrl.control.adaptation import Adaptation, Ball, Box, Gradient, Leakage, Natural
from synctrl.control.laws import ChungSlotine, ComputedTorque, Law, MasterSlave, PDGravity, SlotineLi
from synctrl.coupling.cell import Cell
from synctrl.errors import SynctrlError
from synctrl.experiments import a460_pair, planar_four
from synctrl.paper.adaptation_trials import try_adaptations
from synctrl.paper.law_sections import adaptation_section, comparison_section
from synctrl.paper.report import Section, Text, write_page

#: of runs of the four arms, s: then they stand at their goals
PLANAR = 3.0
GAMMA, SHARE = 0.3, 0.1

INTRODUCTION = (
    "A law that is given more gain tracks better, whatever it is. So every law has up to three rows beside "
    "the paper's: errors common to all robots die out at the same rate, the quiet run takes the same peak "
    "torque, or it has the same RMS tracking error. One gain of the law, named in the table, is solved for; "
    "where no value does it the row says so. With the same gains each law runs once more disturbed."
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the page and its figures")
    parser.add_argument("--duration", type=float, help="of every run, s; by default 3 s and 4 s")
    options = parser.parse_args()
    try:
        print(f"see {laws_page(options.out, options.duration)}")
    except SynctrlError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


def laws_page(out: Path, duration: float | None = None) -> Path:
    """Make all runs, and write the page to `out/laws.html`."""
    sections = [Section("What is compared", (Text(INTRODUCTION),))]
    sections.append(laws_section(out, "planar_four", planar_four(disturbance="torque"), duration or PLANAR))
    sections.append(laws_section(out, "a460_pair", a460_pair(), duration))
    sections.append(learning_section(a460_pair(), duration))
    return write_page(out / "laws.html", "Laws and adaptations, side by side", sections)


def laws_section(out: Path, name: str, experiment: Experiment, duration: float | None) -> Section:
    """The laws on one cell."""
    found = compare(experiment, rivals(experiment), duration=duration, engine="compiled")
    print(found, flush=True)
    notes = {
        "planar_four": "Disturbed: the paper's push of 1 N·m on robot 1.",
        "a460_pair": "Disturbed: friction in the plant that the controller does not know.",
    }
    return comparison_section(found, out / "figures" / f"laws_{name}", notes[name])


def rivals(experiment: Experiment) -> list[Law]:
    """The laws to compare with; free gains begin at a share of the damping."""
    damping = float(np.max(experiment.gains.K_r))
    stiffness = damping * float(np.max(experiment.gains.Lambda))
    return [SlotineLi(), ChungSlotine(0.3 * damping), MasterSlave(), ComputedTorque(), PDGravity(stiffness)]


def learning_section(experiment: Experiment, duration: float | None) -> Section:
    """The adaptations on one cell."""
    trials = try_adaptations(experiment, learners(experiment.cell), duration=duration, engine="compiled")
    for trial in trials:
        print(trial, flush=True)
    return adaptation_section(str(experiment.title), trials, ("rad", experiment.cell.weighted_unit, "N·m"))


def learners(cell: Cell) -> dict[str, Adaptation]:
    """The adaptations to compare."""
    theta, theta_hat0 = cell.theta, cell.theta_hat0
    far = float(np.sqrt(((theta - theta_hat0) ** 2).sum(axis=1).max() / GAMMA))
    width = 0.5 * np.abs(theta) + 0.05
    return {
        "none": Gradient(0.0),
        f"Gradient({GAMMA})": Gradient(GAMMA),
        f"Gradient.pullback(robot, {SHARE})": Gradient.pullback(load_robot("a460"), SHARE),
        f"Leakage({GAMMA}, 0.5)": Leakage(GAMMA, 0.5),
        f"Box({GAMMA}, 50 % + 0.05 around theta)": Box(GAMMA, theta - width, theta + width),
        f"Ball({GAMMA}, 1.2 times the distance of theta)": Ball(GAMMA, 1.2 * far),
        f"Natural({SHARE})": Natural(SHARE),
    }


if __name__ == "__main__":
    sys.exit(main())
