"""Short runs of every kind that exports have to bring across, each made once."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from cells import SMALL_GAINS, small_cell
from sliders import GANTRY, SCARA, load, pair

from synctrl import Disturbance, Network, Result, simulate
from synctrl.errors import SimulationError
from synctrl.experiments import a460_full_pair, bead_on_path, carry_planar, mixed_four, planar_four
from synctrl.simulation.result import LAYOUT

SHORT = {"duration": 0.02, "dt": 1e-3}


def stopped() -> Result:
    """A run that was pushed so hard that it ended before its time."""
    try:
        simulate(small_cell(), SMALL_GAINS, 0.1, dt=5e-3, disturbances=[Disturbance(0, 1e9, 0.02, 0.05)])
    except SimulationError as error:
        assert error.result.status != "completed" and 1 < len(error.result.t) < 21
        return error.result
    raise AssertionError("expected a run that stops")


def sliding() -> Result:
    """Joints that slide beside joints that turn, a different number in each robot."""
    with tempfile.TemporaryDirectory() as folder:
        gantry, scara = load(Path(folder), "gantry", GANTRY), load(Path(folder), "scara", SCARA[:3])
        return pair((gantry, scara)).simulate(**SHORT)


def loaded() -> Result:
    with tempfile.TemporaryDirectory() as folder:
        return Result.load(made("mixed").save(Path(folder) / "run.npz"))


def in_single_precision() -> Result:
    """The arrays of a log in files, of which the folder is gone."""
    with tempfile.TemporaryDirectory() as folder:
        run = planar_four().simulate(**SHORT, log_to=Path(folder) / "log", log_dtype="float32")
        arrays = {name: np.array(array) for name, array in run._arrays().items()}
        return Result._of(run.info, arrays)


def without_instants() -> Result:
    """A result of which nothing was logged."""
    run = made("network")
    arrays = {name: array[:0] for name, array in run._arrays().items()}
    return Result._of(run.info, arrays)


RUNS: dict[str, Callable[[], Result]] = {
    "mixed": lambda: mixed_four().simulate(**SHORT),
    "held": lambda: a460_full_pair().simulate(**SHORT),
    "carried": lambda: carry_planar().simulate(duration=0.1, dt=2e-3),
    "bead": lambda: bead_on_path().simulate(**SHORT),
    "network": lambda: planar_four(network=Network(delay=0.05, period=0.01)).simulate(**SHORT),
    "sliding": sliding,
    "stopped": stopped,
    "loaded": loaded,
    "single": in_single_precision,
    "empty": without_instants,
}


@cache
def made(name: str) -> Result:
    """One of the runs."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return RUNS[name]()


def arrays(run: Result) -> dict[str, np.ndarray]:
    """Arrays over time and outputs by name, without the times."""
    found = {**run._arrays(), **run.outputs}
    return {name: array for name, array in found.items() if name != "t" and not name.startswith("outputs/")}


def axes_of(run: Result, name: str) -> tuple[str, ...]:
    """Axes after time."""
    return tuple(LAYOUT[name][0] if name in LAYOUT else run.info["outputs"][name]["axes"])[1:]


def has(run: Result, name: str) -> np.ndarray:
    """Which numbers of an instant are those of joints and parameters that a robot has, in its shape."""
    shape, axes = arrays(run)[name].shape[1:], axes_of(run, name)
    found = np.ones(shape, dtype=bool)
    if axes[:1] == ("robot",) and axes[1:] in (("joint",), ("parameter",)):
        for i, robot in enumerate(run.info["robots"]):
            found[i, len(robot[f"{axes[1]}s"]) :] = False
    return found
