"""What the theory says about the runs of the paper: certificates and fair comparisons, and their sections."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from ..analysis.certify import Certificate, certify
from ..experiments.a460_pair import a460_pair
from ..experiments.planar_four import planar_four
from ..show.lyapunov_plots import growth_mark, lyapunov_figure
from ..show.plots import save
from ..show.style import display
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .baselines import Comparison, compare
from .report import Block, Picture, Section, SideBySide, Table, Text, number
from .reproduction import PLANNED
from .trials import Trial

#: all runs but a longer one, and those with six joints, for which the step of the page is too long
CERTIFIED = tuple(name for name in PLANNED if not name.endswith(("friction_unknown", "full", "full_alone")))
#: cell and the time over which its controllers are compared, s: the peaks of all torques lie within
COMPARED: Mapping[str, tuple[Callable[[], Experiment], float]] = {
    "A460 pair": (a460_pair, 0.8),
    "four planar arms": (planar_four, 0.25),
}
PROOF = """\
V  = Σ_i ½ s_iᵀ M s_i + ½ d_iᵀ Γ⁻¹ d_i + ½ E_iᵀ K_ε Λ β E_i + Σ_k ½ ε_kᵀ K_ε ε_k
V' = - Σ_i s_iᵀ K_r s_i - Σ_k ε_kᵀ K_ε Λ ε_k - Σ_i σ_iᵀ K_ε β σ_i
     + power of friction, disturbances and whatever else the theorem does not know
with d = θ - θ̂, E = Sᵀ ∫ε, σ = Sᵀ ε"""


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


def certificate_section(certificates: Mapping[str, Certificate], folder: Path) -> Section:
    """V, V' and the verdict of every run.

    Args:
        certificates: by name of the run; the name is also that of its figure's file.
        folder: where `draw_certificate` has drawn each.
    """
    unknown = "Dashed: powers the theorem does not know."
    pictures = tuple(
        Picture(_stem(name, folder).with_suffix(".svg"), f"{_words(name)}: {c.verdict}. {unknown}")
        for name, c in certificates.items()
    )
    texts = [Text(f"{_words(name)}\n{c}", "formula") for name, c in certificates.items()]
    proof = (Text(_INTRODUCTION), Text(PROOF, "formula"), _verdicts(certificates), SideBySide(pictures))
    return Section("The proof, watched", (*proof, *texts))


def draw_certificate(name: str, certificate: Certificate, folder: Path) -> Path:
    """Draw V and V' along a run, and where V first grows; returns the path of the SVG file."""
    figure = lyapunov_figure(certificate.lyapunov)
    if certificate.growth is not None:
        growth_mark(figure, certificate.growth)
    _, svg = save(figure, _stem(name, folder))
    return svg


def baseline_section(comparisons: Sequence[Comparison]) -> Section:
    """Synchronized control beside independent controllers with as much gain, and part by part."""
    blocks: list[Block] = [Text(_FAIRNESS)]
    for c in comparisons:
        what = f"{c.title}, the first {c.duration:g} s"
        parts = f"{what}: β, K_ε and the adaptation, each alone and together."
        blocks += [_trials(c, c.trials, f"{what}."), _trials(c, c.ablation, parts)]
        blocks += map(Text, c.findings())
    return Section("Fair comparisons", tuple(blocks))


_INTRODUCTION = (
    "The function of the convergence proof, computed along every run, and its derivative by the chain rule "
    "with the accelerations of the plant. A run is certified if every assumption of the theorem holds along "
    "it, V' ≤ 0 to rounding at every logged instant, and V changes by no more and no less than the integral "
    "of V'. Friction and disturbances are outside the theorem; their power has a name, and the balance "
    "closes with it as well. Friction among the adapted parameters is inside. The arms with six joints are "
    "left out: with the step of these runs friction of a joint at rest is at the limit of what the method "
    "follows, and their balance does not close. With half the step it does; their certificate then names the "
    "friction, and the forces of wrists that the model takes for locked."
)
_FAIRNESS = (
    "The paper compares with β = K_ε = 0 and all else unchanged, which takes gain away. Beside that stand an "
    "independent controller with Λ + β for Λ, and one whose gains are multiplied by a common factor until "
    "its peak torque is that of the synchronized one. The sentences under the tables are made from their "
    "numbers."
)


def _stem(name: str, folder: Path) -> Path:
    return folder / f"lyapunov_{name}"


def _words(name: str) -> str:
    """The name of a run in words."""
    return name.replace("_", " ")


def _verdicts(certificates: Mapping[str, Certificate]) -> Table:
    numbers = "largest V'", "rounding of V'", "balance off by", "explained by the step"
    head = ("run", "verdict", *numbers, "bodies")
    rows = []
    for name, c in certificates.items():
        found = c.lyapunov
        values = found.V_dot.max(), found.rounding.max(), found.largest_drift, found.drift_bound
        rows.append((_words(name), c.verdict, *(number(float(v), 2) for v in values), _bodies(c)))
    return Table(head, tuple(rows))


def _bodies(c: Certificate) -> str:
    """Whether the estimated bodies can exist, in words."""
    return "not estimated" if c.consistency is None else str(c.consistency)


def _trials(c: Comparison, trials: Sequence[Trial], caption: str) -> Table:
    (e_unit, e), (s_unit, s) = (display(unit) for unit in c.units)
    head = ("controller", f"peak e, {e_unit}", f"RMS e, {e_unit}", f"peak ε, {s_unit}", f"RMS ε, {s_unit}")
    rows = tuple(
        (
            t.name,
            *(number(e * v) for v in (t.tracking_peak, t.tracking_rms)),
            *(number(s * v) for v in (t.sync_peak, t.sync_rms)),
            number(t.peak_torque, 4),
        )
        for t in trials
    )
    return Table((*head, "peak torque, N·m"), rows, caption)
