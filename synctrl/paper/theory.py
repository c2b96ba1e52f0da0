"""What the theory says about the runs of the paper: a certificate for each, and fair comparisons."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from ..analysis.certify import Certificate, certify
from ..experiments.a460_pair import a460_pair
from ..experiments.planar_four import planar_four
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .baselines import Comparison, compare
from .reproduction import PLANNED
from .theory_sections import draw_certificate

#: all runs but a longer one, and those with six joints, for which the step of the page is too long
CERTIFIED = (
    "a460_pair_frictionless",
    "a460_pair_friction_adapted",
    "planar_four_synchronized",
    "planar_four_independent",
    "planar_four_synchronized_disturbed",
    "planar_four_independent_disturbed",
    "a460_pair_synchronized",
    "a460_pair_independent",
    "planar_four_without_k_eps",
    "planar_four_without_adaptation",
    "planar_four_stiff",
)
#: cell and the time over which its controllers are compared, s: the peaks of all torques lie within
COMPARED: Mapping[str, tuple[Callable[[], Experiment], float]] = {
    "A460 pair": (a460_pair, 0.8),
    "four planar arms": (planar_four, 0.25),
}


def examine(
    folder: Path, figures: Path, workers: int = 2, names: Iterable[str] = CERTIFIED
) -> tuple[dict[str, Certificate], list[Comparison]]:
    """Certify saved runs and draw their certificates, and compare the controllers of both cells.

    Args:
        folder: where `run_all` has saved the runs.
        figures: where the figures of the certificates go.
        workers: number of processes.
        names: runs to certify.

    Raises:
        ResultError: a run is missing or damaged, or a figure cannot be written.
    """
    names = tuple(names)
    for name in names:
        Result.load(folder / f"{name}.npz")
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        compared = [pool.submit(_compare, name) for name in COMPARED]
        certified = {name: pool.submit(_certify, name, folder, figures) for name in names}
        return {name: f.result() for name, f in certified.items()}, [f.result() for f in compared]


def _certify(name: str, folder: Path, figures: Path) -> Certificate:
    certificate = certify(Result.load(folder / f"{name}.npz"), PLANNED[name].make())
    draw_certificate(name, certificate, figures)
    return certificate


def _compare(name: str) -> Comparison:
    make, duration = COMPARED[name]
    return compare(make(), duration=duration)
