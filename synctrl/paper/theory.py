"""What the theory says about the runs of the paper: certificates, and their section."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..analysis.certify import Certificate, certify
from ..show.lyapunov_plots import growth_mark, lyapunov_figure
from ..show.plots import save_svg
from ..simulation.result import Result
from .report import Picture, Section, SideBySide, Table, Text, number
from .reproduction import PLANNED

#: all runs but longer ones, and those with six joints, for which the step of the page is too long
CERTIFIED = tuple(
    name
    for name in PLANNED
    if not name.endswith(("friction_unknown", "full", "full_alone")) and "_left_" not in name
)
PROOF = """\
V  = Σ_i ½ s_iᵀ M s_i + ½ d_iᵀ Γ⁻¹ d_i + ½ E_iᵀ K_ε Λ β E_i + Σ_k ½ ε_kᵀ K_ε ε_k
V' = - Σ_i s_iᵀ K_r s_i - Σ_k ε_kᵀ K_ε Λ ε_k - Σ_i σ_iᵀ K_ε β σ_i
     + power of friction, disturbances and whatever else the theorem does not know
with d = θ - θ̂, E = Sᵀ ∫ε, σ = Sᵀ ε"""


def examined(name: str, runs: Mapping[str, Result], figures: Path) -> Certificate:
    """Certify a planned run, and draw its certificate.

    Args:
        name: of the run.
        runs: the runs by name.
        figures: where the figure goes.

    Raises:
        ResultError: the run is missing or damaged, or the figure cannot be written.
    """
    certificate = certify(runs[name], PLANNED[name].make())
    draw_certificate(name, certificate, figures)
    return certificate


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
    return save_svg(figure, _stem(name, folder))


_INTRODUCTION = (
    "The function of the convergence proof, computed along every run, and its derivative by the chain rule "
    "with the accelerations of the plant. A run is covered by the theorem if nothing outside it acted, "
    "V' ≤ 0 to rounding at every logged instant, and V changes by no more and no less than the integral of "
    "V'. Where all terms of V' have a name, V' ≤ 0 is algebra; that the balance closes is what is found. "
    "That J⁻¹ and its like stay bounded between instants, and that motions are smooth, is not checked. "
    "Friction and disturbances are outside the theorem; their power has a name, the balance closes with it "
    "as well, and Theorem A bounds what they do. Friction among the adapted parameters is inside. The arms "
    "with six joints are left out: with the step of these runs friction of a joint at rest is at the limit "
    "of what the method follows, and their balance does not close. With half the step it does; their "
    "certificate then names the friction, and the forces of wrists that the model takes for locked."
)


def _stem(name: str, folder: Path) -> Path:
    return folder / f"lyapunov_{name}"


def _words(name: str) -> str:
    """The name of a run in words."""
    return name.replace("_", " ")


def _verdicts(certificates: Mapping[str, Certificate]) -> Table:
    numbers = "largest V', W", "rounding of V', W", "balance off by, N·m", "explained by the step, N·m"
    head = ("run", "verdict", *numbers, "of bodies that can exist")
    rows = []
    for name, c in certificates.items():
        found = c.lyapunov
        values = found.V_dot.max(), found.rounding.max(), found.largest_drift, found.drift_bound
        rows.append((_words(name), c.verdict, *(number(float(v), 2) for v in values), _bodies(c)))
    return Table(head, tuple(rows))


def _bodies(c: Certificate) -> str:
    """How long the estimates were those of bodies that can exist, in words."""
    if c.consistency is None:
        return "not estimated"
    return "yes" if c.consistency.until is None else f"until {c.consistency.until:.3g} s"
