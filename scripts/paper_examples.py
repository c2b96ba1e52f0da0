"""Examples 1 to 3 of the paper: two arms with a rigid object, two wheels of a mobile robot, and a refusal.

    python scripts/paper_examples.py [--out FOLDER] [--duration SECONDS]

Prints the largest errors of every run and writes the mobile robot's animations.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from synctrl import Result
from synctrl.experiments import mobile_robot, quadratic_analysis, rigid_object
from synctrl.experiments.mobile_robot import TRACK, WHEEL_RADIUS
from synctrl.show.animation import vehicle_animation


def main() -> None:
    """Run the examples."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/examples"), help="folder for the animations")
    parser.add_argument("--duration", type=float, default=None, help="s; by default each example's own")
    arguments = parser.parse_args()
    for synchronized in (True, False):
        describe(rigid_object(synchronized).simulate(arguments.duration, dt=2e-3))
    for synchronized in (True, False):
        result = mobile_robot(synchronized).simulate(arguments.duration, dt=2e-3)
        describe(result)
        name = f"mobile_robot_{'synchronized' if synchronized else 'independent'}.html"
        print("  animation:", vehicle_animation(result, WHEEL_RADIUS, TRACK).write(arguments.out / name))
    print("\nx_1^T x_1 + x_2^T x_2 - A = 0,", quadratic_analysis())


def describe(result: Result) -> None:
    """Print the largest tracking and synchronization error of a run."""
    e, epsilon = abs(result.tracking_error).max(), abs(result.sync_error).max()
    print(
        f"{result.info['title']}: at most {e:.4g} {result.info['task_unit']} off the desired motion, "
        f"{epsilon:.4g} {result.info['weighted_unit']} out of step"
    )


if __name__ == "__main__":
    main()
