"""Gains of the four planar arms, from synchronization without torque to torque without synchronization.

python scripts/tune_cell.py [--generations 12] [--workers 2] [--out out/tune_cell]

Every run lasts 1 s in steps of 2 ms. The front is written as a table and drawn, once for synchronization
error against torque and once with the delay that the robots' messages may have. What was interrupted goes on
where it was.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from synctrl.errors import SynctrlError
from synctrl.experiments import planar_four
from synctrl.show.front_figures import front_figure
from synctrl.show.plots import save
from synctrl.sweep import LogUniform
from synctrl.tune import tune

DURATION, DT = 1.0, 2e-3  # s
SEARCH = {
    "beta": LogUniform(5, 150),
    "K_eps": LogUniform(0.1, 10),
    "Lambda": LogUniform(2, 50),
    "K_r": LogUniform(0.1, 10),
}
GOALS = {
    "two": {"minimize": ("sync_rms", "peak_torque")},
    "three": {"minimize": ("sync_rms", "peak_torque"), "maximize": "delay_margin"},
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--generations", type=int, default=12, help="how often the population is renewed")
    parser.add_argument("--workers", type=int, default=2, help="number of processes")
    parser.add_argument("--out", type=Path, default=Path("out/tune_cell"), help="folder for everything")
    options = parser.parse_args()
    try:
        for name, goals in GOALS.items():
            tune_cell(options.out / name, options.generations, options.workers, goals)
    except SynctrlError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


def tune_cell(folder: Path, generations: int, workers: int, goals: dict) -> None:
    """Search, and say and draw what was found."""
    how = {"duration": DURATION, "dt": DT, "generations": generations, "workers": workers, "folder": folder}
    found = tune(planar_four(), SEARCH, **goals, limits={"step_error": 2e-3}, **how)
    picture, _ = save(front_figure(found), folder / "front")
    print(f"{found}\n  see {picture} and {folder / 'front.csv'}")


if __name__ == "__main__":
    sys.exit(main())
