"""Every experiment of the paper: runs, figures, metrics, claims, animations, and the page that shows them.

python scripts/reproduce.py [--out out] [--workers 2] [--quick]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from itertools import chain
from pathlib import Path

import numpy as np

from synctrl.analysis import Comparison
from synctrl.analysis.consistency import Consistency
from synctrl.analysis.convergence import Identification, identify
from synctrl.analysis.metrics import as_data, metrics, settling_bands, write_metrics
from synctrl.errors import SynctrlError
from synctrl.experiments.a460_pair import DURATION
from synctrl.paper.bodies import bodies_are_left, bodies_of, bodies_section
from synctrl.paper.carry_task import CARRY
from synctrl.paper.claims import Claim, tally
from synctrl.paper.claims_of_cells import a460_claims, own_findings, planar_four_claims
from synctrl.paper.edge_task import EDGE
from synctrl.paper.fairness import another_law_does_better, fair_section, what_parts_do
from synctrl.paper.judge import judge_section
from synctrl.paper.margin_section import margin_section
from synctrl.paper.network_section import NETWORK
from synctrl.paper.paper_sections import (
    a460_section,
    honesty_section,
    introduction,
    planar_section,
    trial_section,
)
from synctrl.paper.path_task import PATH
from synctrl.paper.plant_sections import (
    friction_section,
    full_a460_section,
    identification_section,
    step_section,
)
from synctrl.paper.promises_section import promises_section
from synctrl.paper.report import Links, Section, write_page
from synctrl.paper.reproduction import PLANNED, PlannedRun, judge_runs, judged, run_all
from synctrl.paper.tasks import planned_runs, runs_of, task_section
from synctrl.paper.theory import certificate_section, examine
from synctrl.paper.value_grid import grid_section, judge_grid
from synctrl.show.animation import payload_pair_scene, planar_scene
from synctrl.show.style import display
from synctrl.simulation.result import Result

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
TRIAL = 1.0  # s
#: the run whose estimated bodies are drawn
BODIES = "a460_pair_synchronized"
SCENES = {"a460_pair": payload_pair_scene, "planar_four": planar_scene}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for everything that is written")
    parser.add_argument("--workers", type=count, default=2, help="number of processes")
    parser.add_argument("--quick", action="store_true", help="no more than a second of every run, as a trial")
    options = parser.parse_args()
    planned = {
        **{name: run.possible() for name, run in PLANNED.items()},
        **planned_runs(TASKS),
        **judge_runs(),
    }
    if options.quick:
        planned = {name: run.shortened(TRIAL) for name, run in planned.items()}
    limit = 0.1 * TRIAL if options.quick else float("inf")
    try:
        page = reproduce(options.out, options.workers, planned, limit)
    except SynctrlError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"\ninterrupted; runs that were complete are in {options.out / 'runs'}", file=sys.stderr)
        return 130
    print(f"\nOpen {page}")
    return 0


def count(text: str) -> int:
    """A number of processes."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a number of at least 1, found {text!r}")
    return int(text)


def reproduce(out: Path, workers: int, planned: Mapping[str, PlannedRun], limit: float) -> Path:
    """Run everything and write it into a folder; returns the path of the page.

    Controllers are compared over at most `limit` seconds.
    """
    every = run_all(out / "runs", workers, planned)
    runs = {name: every[name] for name in PLANNED}
    print("\nchecking the proof along every run, comparing controllers, drawing ...", flush=True)
    with ThreadPoolExecutor(1) as background:
        examined = background.submit(examine, out / "runs", out / "figures", workers, limit=limit)
        sections, bodies, learned = drawn(runs, out), bodies_of(runs), identified(runs)
        tried = min(DURATION, limit)
        grid = judge_grid(tried)
        certificates, compared = examined.result()
    claims, own = papers_claims(runs), our_findings(runs, bodies[BODIES], compared["planar_four"][0])
    found, tasks = of_tasks(every, out)
    checked = [*claims, *own, *found]
    sections = [
        introduction(checked),
        *sections,
        *tasks,
        margin_section(out),
        honesty_section(own, what_parts_do(compared["planar_four"][1])),
        grid_section(grid, tried),
        bodies_section(bodies, BODIES, out / "figures" / "bodies"),
        identification_section(learned),
        *(fair_section(*pair, out / "figures" / f"fair_{name}") for name, pair in compared.items()),
        promises_section(certificates, runs, out / "figures"),
        certificate_section(certificates, out / "figures"),
        judge_section(judged(every), out / "figures"),
        step_section(runs),
    ]
    write_metrics(
        out / "metrics.json",
        {n: as_data(run, metrics(run, settling_bands(*peers(every, n)))) for n, run in every.items()},
        [{**asdict(claim), "ours": claim.ours} for claim in checked],
        certificates={name: certificate.as_dict() for name, certificate in certificates.items()},
        comparisons={name: [each.as_dict() for each in pair] for name, pair in compared.items()},
        consistency={name: each.as_dict() for name, each in bodies.items()},
        identification={title: [robot.as_dict() for robot in robots] for title, robots in learned.items()},
    )
    print_table(runs)
    print(f"\n{tally(checked)} The page says which do not, and why.")
    return write(out / "index.html", sections, max(run.t[-1] for run in runs.values()))


def write(path: Path, sections: list[Section], longest: float) -> Path:
    """The page, which says if no run was longer than a trial."""
    trial = [trial_section(longest)] if longest <= TRIAL else []
    return write_page(path, "Adaptive synchronized control, reproduced", [*trial, *sections])


def papers_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """What the paper claims of its experiments."""
    return [*a460_claims(select(runs, "a460_pair_")), *planar_four_claims(select(runs, "planar_four_"))]


def our_findings(runs: Mapping[str, Result], bodies: Consistency, laws: Comparison) -> list[Claim]:
    """What the paper leaves unsaid."""
    found = own_findings(select(runs, "planar_four_"))
    return [*found, bodies_are_left(BODIES, bodies), another_law_does_better(laws, "ChungSlotine")]


def drawn(runs: Mapping[str, Result], out: Path) -> list[Section]:
    """The sections of the experiments."""
    a460, planar = select(runs, "a460_pair_"), select(runs, "planar_four_")
    (pair, four), figures = (PLANNED[f"{cell}_synchronized"].make() for cell in SCENES), out / "figures"
    return [
        a460_section(a460, pair, figures, animations(runs, out, "a460_pair")),
        planar_section(planar, four, figures, animations(runs, out, "planar_four")),
        full_a460_section(a460, figures),
        friction_section(a460, figures),
    ]


def of_tasks(every: Mapping[str, Result], out: Path) -> tuple[list[Claim], list[Section]]:
    """What is found of the tasks, and their sections."""
    runs = {task: runs_of(task, every) for task in TASKS}
    found = {task: task.claims(runs[task]) for task in TASKS}
    return [*chain.from_iterable(found.values())], [
        task_section(task, runs[task], found[task], out) for task in TASKS
    ]


def select(runs: Mapping[str, Result], prefix: str) -> dict[str, Result]:
    """The runs of one cell, without its name."""
    return {name.removeprefix(prefix): run for name, run in runs.items() if name.startswith(prefix)}


def identified(runs: Mapping[str, Result]) -> dict[str, tuple[Identification, ...]]:
    """What the synchronized runs say about parameters, by the title of the run; every 5 ms are enough."""
    names = [name for name in runs if name.endswith("_synchronized")]
    return {
        str(runs[name].info["title"]): identify(runs[name].decimated(5), PLANNED[name].make())
        for name in names
    }


def peers(runs: Mapping[str, Result], name: str) -> list[Result]:
    """The synchronized and the independent run that are compared with each other, of which this is one."""
    twins = {name.replace("independent", "synchronized"), name.replace("synchronized", "independent")}
    return [runs[twin] for twin in sorted(twins)]


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


def print_table(runs: Mapping[str, Result]) -> None:
    """The largest errors and torques of all runs."""
    print(f"\n{'run':36} {'peak e':>14} {'RMS e':>14} {'peak ε':>16} {'RMS ε':>16} {'torque':>10}")
    for name, run in runs.items():
        row = metrics(run)
        cells = []
        for kind, width in (("tracking_error", 14), ("sync_error", 16)):
            unit, factor = display(run.unit(kind))
            for part in ("peak", "rms"):
                largest = factor * getattr(getattr(row, kind), part).max()
                cells.append(f"{f'{largest:.4g} {unit}':>{width}}")
        print(f"{name:36} {' '.join(cells)} {f'{row.peak_torque.max():.3g} N·m':>10}")


if __name__ == "__main__":
    sys.exit(main())
