"""Every experiment of the paper: runs, figures, metrics, claims, animations, and the page that shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import chain
from pathlib import Path
from typing import Any

from ..analysis.certify import Certificate
from ..analysis.comparison import Comparison
from ..analysis.consistency import Consistency
from ..analysis.metrics import metrics, write_metrics
from ..experiments.a460_pair import DURATION
from ..show.style import display
from ..simulation.result import Result
from .bodies import bodies_are_left
from .claims import Claim, tally
from .claims_of_cells import a460_claims, own_findings, planar_four_claims
from .fairness import FAIR, another_law_does_better, what_parts_do
from .margin_section import margins_told
from .page_parts import BODIES, SCENES, TASKS, measured, of_runs, without_runs
from .paper_sections import honesty_section, introduction, trial_section
from .plant_sections import identification_section, step_section
from .processes import processes
from .promises_section import told
from .report import Section, write_page
from .reproduction import PLANNED, PlannedRun, begun, finished, judge_runs
from .saved_runs import SavedRuns
from .tasks import planned_runs
from .theory import CERTIFIED, certificate_section, examined
from .value_grid import grid_section

#: how long runs of a trial last at most, s, and which share of it comparisons of controllers do
TRIAL, SHARE = 1.0, 0.1


def everything(quick: bool = False) -> dict[str, PlannedRun]:
    """All runs of the page; as a trial no more than a second of each."""
    planned = {
        **{name: run.possible() for name, run in PLANNED.items()},
        **planned_runs(TASKS),
        **judge_runs(),
    }
    return {name: run.shortened(TRIAL) for name, run in planned.items()} if quick else planned


def longest_comparison(quick: bool = False) -> float:
    """Over how long controllers are compared at most, s."""
    return SHARE * TRIAL if quick else float("inf")


def reproduce(out: Path, workers: int, planned: Mapping[str, PlannedRun], limit: float) -> Path:
    """Run everything and write it into a folder; returns the path of the page.

    Controllers are compared over at most `limit` seconds.
    """
    with processes(workers) as pool:
        making = begun(pool, out / "runs", planned)
        early = {name: pool.submit(*each) for name, each in without_runs(out, limit).items()}
        every = finished(pool, making, out / "runs")
        print("\nchecking the proof along every run, comparing controllers, drawing ...", flush=True)
        late = {name: pool.submit(*each) for name, each in of_runs(every, out).items()}
        proofs = {name: pool.submit(examined, name, every, out / "figures") for name in CERTIFIED}
        data = measured(every)
        done = {name: future.result() for name, future in (early | late).items()}
        certificates = {name: future.result() for name, future in proofs.items()}
    return page_of(out, every, min(DURATION, limit), done, certificates, data)


def page_of(
    out: Path,
    every: SavedRuns,
    tried: float,
    done: Mapping[str, Any],
    certificates: Mapping[str, Certificate],
    data: Mapping[str, Any],
) -> Path:
    """Write the page, and all of its numbers beside it.

    Args:
        out: the folder of the page.
        every: the runs.
        tried: time over which cases of the grid were run, s.
        done: what came of `without_runs` and of `of_runs`.
        certificates: by name of the run.
        data: the metrics of every run.
    """
    runs, (bodies, _) = every.named(*PLANNED), done["bodies"]
    claims, own = papers_claims(runs), our_findings(runs, bodies[BODIES], done["fair planar_four"][0])
    found, tasks = zip(*(done[f"task {k}"] for k in range(len(TASKS))), strict=True)
    checked = [*claims, *own, *chain.from_iterable(found)]
    cells = [done[name] for name in (*SCENES, "full", "friction")]
    margins = margins_told(done["margins"], done["map"])
    sections = [introduction(checked, every), *cells, *tasks, margins]
    sections += further(runs, own, tried, done, certificates, out / "figures")
    write_numbers(out / "metrics.json", data, checked, done, certificates)
    print_table(runs)
    print(f"\n{tally(checked)} The page says which do not, and why.")
    return write(out / "index.html", sections, max(run.t[-1] for run in runs.values()))


def further(
    runs: SavedRuns,
    own: Sequence[Claim],
    tried: float,
    done: Mapping[str, Any],
    certificates: Mapping[str, Certificate],
    figures: Path,
) -> list[Section]:
    """The sections behind those of the tasks; arguments as of `page_of`, and what the paper leaves unsaid."""
    return [
        honesty_section(own, what_parts_do(done["fair planar_four"][1])),
        grid_section(done["grid"], tried),
        done["bodies"][1],
        identification_section(done["learned"]),
        *(done[f"fair {name}"][2] for name in FAIR),
        told(certificates, done["promises"]),
        certificate_section(certificates, figures),
        done["judge"],
        step_section(runs),
    ]


def write_numbers(
    path: Path,
    data: Mapping[str, Any],
    checked: Sequence[Claim],
    done: Mapping[str, Any],
    certificates: Mapping[str, Certificate],
) -> Path:
    """Write all numbers of the page; arguments as of `page_of`, and the claims that were checked."""
    fair = {name: done[f"fair {name}"][:2] for name in FAIR}
    return write_metrics(
        path,
        data,
        [{**asdict(claim), "ours": claim.ours} for claim in checked],
        certificates={name: certificate.as_dict() for name, certificate in certificates.items()},
        comparisons={name: [each.as_dict() for each in pair] for name, pair in fair.items()},
        consistency={name: each.as_dict() for name, each in done["bodies"][0].items()},
        identification={
            title: [robot.as_dict() for robot in each] for title, each in done["learned"].items()
        },
    )


def write(path: Path, sections: list[Section], longest: float) -> Path:
    """The page, which says if no run was longer than a trial."""
    trial = [trial_section(longest)] if longest <= TRIAL else []
    return write_page(path, "Adaptive synchronized control, reproduced", [*trial, *sections])


def papers_claims(runs: SavedRuns) -> list[Claim]:
    """What the paper claims of its experiments."""
    return [*a460_claims(runs.under("a460_pair_")), *planar_four_claims(runs.under("planar_four_"))]


def our_findings(runs: SavedRuns, bodies: Consistency, laws: Comparison) -> list[Claim]:
    """What the paper leaves unsaid."""
    found = own_findings(runs.under("planar_four_"))
    return [*found, bodies_are_left(BODIES, bodies), another_law_does_better(laws, "ChungSlotine")]


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
