"""Runs on one another: what each value of beta makes of the same start, in one figure.

Results are saved and loaded on the way: a file holds all there is to draw.
"""

import numpy as np
from example import arguments

from synctrl import Result
from synctrl.experiments import ur5_payload
from synctrl.experiments.ur5_payload import GAINS
from synctrl.show.curves import Curves, overlay
from synctrl.show.plots import save

out, short = arguments(__doc__)
runs = {}
for beta in (0.0, 2.0, 6.0, 20.0):
    run = ur5_payload(gains=GAINS.replace(beta=beta)).simulate(0.02 if short else 1.5, dt=2e-3)
    runs[f"β = {beta:g}/s"] = Result.load(run.save(out / "overlay_of_runs.npz"))


def apart(run):
    """The errors of the two hands beside each other, in position and orientation."""
    e, turn = run.sync_error[:, 0, :3], run.sync_error[:, 0, 3:]
    distance = 1e3 * np.linalg.norm(e, axis=1, keepdims=True)
    angle = np.rad2deg(np.linalg.norm(turn, axis=1, keepdims=True))
    return [Curves("position", "mm", distance, ["distance"]), Curves("orientation", "deg", angle, ["angle"])]


save(overlay(apart, runs), out / "overlay_of_runs")
