"""The parts of the page, each a function and its arguments, so that processes can share them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.comparison import Comparison
from ..analysis.consistency import Consistency
from ..analysis.convergence import Identification, identify
from ..analysis.metrics import as_data, metrics, settling_bands
from ..experiments.a460_pair import DURATION
from ..show.animation import payload_pair_scene, planar_scene
from ..simulation.result import Result
from .bodies import bodies_of, bodies_section
from .carry_task import CARRY
from .claims import Claim
from .edge_task import EDGE
from .fairness import FAIR, compare_laws, compare_parts, fair_section
from .judge import judge_section
from .margin_section import map_picture, margin_table, talking_cells
from .network_section import NETWORK
from .paper_sections import a460_section, planar_section
from .path_task import PATH
from .plant_sections import friction_section, full_a460_section
from .promises_section import promised_bounds
from .report import Links, Section, Table
from .reproduction import PLANNED, judged
from .saved_runs import SavedRuns
from .tasks import runs_of, task_section
from .value_grid import judge_grid

ANIMATED = (
    "a460_pair_synchronized",
    "a460_pair_independent",
    "planar_four_synchronized",
    "planar_four_independent",
    "planar_four_synchronized_disturbed",
    "planar_four_independent_disturbed",
)
#: the tasks of the paper's introduction, and robots that talk
TASKS = (CARRY, EDGE, PATH, NETWORK)
#: the run whose estimated bodies are drawn
BODIES = "a460_pair_synchronized"
SCENES = {"a460_pair": payload_pair_scene, "planar_four": planar_scene}

Jobs = dict[str, tuple[Any, ...]]
"""What is to be done, by name: a function and its arguments."""


def without_runs(out: Path, limit: float) -> Jobs:
    """What needs no run, for processes that have none to make."""
    return {
        **{f"fair {name}": (compared, name, limit, out / "figures") for name in FAIR},
        "grid": (judge_grid, min(DURATION, limit)),
        "map": (map_picture, out),
        "margins": (margins,),
    }


def of_runs(every: SavedRuns, out: Path) -> Jobs:
    """What is drawn and found of the runs; what takes longest is first."""
    runs, figures = every.named(*PLANNED), out / "figures"
    return {
        **{f"task {k}": (of_task, k, every, out) for k in range(len(TASKS))},
        "promises": (promised_bounds, runs, figures),
        **{cell: (of_cell, cell, runs, out) for cell in SCENES},
        "full": (full_a460_section, runs.under("a460_pair_"), figures),
        "learned": (identified, runs),
        "bodies": (of_bodies, runs, figures),
        "judge": (of_judged, every, figures),
        "friction": (friction_section, runs.under("a460_pair_"), figures),
    }


def compared(name: str, limit: float, figures: Path) -> tuple[Comparison, Comparison, Section]:
    """Laws, and parts of a law, compared on a cell of `FAIR`, and the section on both."""
    laws, parts = compare_laws(name, limit), compare_parts(name, limit)
    return laws, parts, fair_section(laws, parts, figures / f"fair_{name}")


def margins() -> Table:
    """How much delay the cells take."""
    return margin_table(talking_cells())


def of_task(k: int, every: SavedRuns, out: Path) -> tuple[list[Claim], Section]:
    """What is found of a task, and its section."""
    runs = runs_of(TASKS[k], every)
    found = TASKS[k].claims(runs)
    return found, task_section(TASKS[k], runs, found, out)


def of_cell(cell: str, runs: SavedRuns, out: Path) -> Section:
    """The section of a cell of the paper, with its animations."""
    section: Any = {"a460_pair": a460_section, "planar_four": planar_section}[cell]
    made = PLANNED[f"{cell}_synchronized"].make()
    return section(runs.under(f"{cell}_"), made, out / "figures", animations(runs, out, cell))


def of_bodies(runs: SavedRuns, figures: Path) -> tuple[dict[str, Consistency], Section]:
    """Whether estimates are those of bodies, and the section on it."""
    bodies = bodies_of(runs)
    return bodies, bodies_section(bodies, BODIES, figures / "bodies")


def of_judged(every: SavedRuns, figures: Path) -> Section:
    """The section on runs by two libraries."""
    return judge_section(judged(every), figures)


def identified(runs: Mapping[str, Result]) -> dict[str, tuple[Identification, ...]]:
    """What the synchronized runs say about parameters, by the title of the run; every 5 ms are enough."""
    names = [name for name in runs if name.endswith("_synchronized")]
    return {
        str(runs[name].info["title"]): identify(runs[name].decimated(5), PLANNED[name].make())
        for name in names
    }


def animations(runs: Mapping[str, Result], out: Path, cell: str) -> Links:
    """Write those of a cell; runs that are compared share the error at which a mark is fully red."""
    links = []
    for name in ANIMATED:
        if not name.startswith(cell):
            continue
        limit = max(float(np.linalg.norm(run.sync_error, axis=2).max()) for run in peers(runs, name))
        scene = SCENES[cell](runs[name], PLANNED[name].make(), limit)
        path = scene.write(out / "animations" / f"{name}.html")
        links.append((path.relative_to(out).as_posix(), f"Animation: {runs[name].info['title']}"))
    return Links(tuple(links))


def measured(every: Mapping[str, Result]) -> dict[str, Any]:
    """The metrics of every run as plain data."""
    return {n: as_data(run, metrics(run, settling_bands(*peers(every, n)))) for n, run in every.items()}


def peers(runs: Mapping[str, Result], name: str) -> list[Result]:
    """The synchronized and the independent run that are compared with each other, of which this is one."""
    twins = {name.replace("independent", "synchronized"), name.replace("synchronized", "independent")}
    return [runs[twin] for twin in sorted(twins)]
