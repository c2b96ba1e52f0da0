"""Section of the page: what certificates promise of runs of both cells, beside what the runs did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..analysis.certify import Certificate
from ..analysis.dissipation import SEEN, Dissipation
from ..simulation.result import Result
from .promised_errors import promised_errors
from .promised_rates import promised_rates
from .report import Block, Points, Section, Table, Text, number
from .reproduction import PLANNED

#: the runs of which it is told
PROMISED = (
    "a460_pair_synchronized",
    "a460_pair_independent",
    "a460_pair_frictionless",
    "planar_four_synchronized",
    "planar_four_synchronized_disturbed",
    "planar_four_independent_disturbed",
)
#: the cells whose synchronized runs are told in full
CELLS = "a460_pair", "planar_four"
TITLE = "What the run's certificate promises"


def promises_section(
    certificates: Mapping[str, Certificate], runs: Mapping[str, Result], folder: Path
) -> Section:
    """What certificates and the three theorems say of the runs, beside what they did.

    Args:
        certificates: by name of the run; those of `PROMISED` are told.
        runs: by name, `PLANNED`.
        folder: where figures go.
    """
    return told(certificates, promised_bounds(runs, folder))


def told(certificates: Mapping[str, Certificate], bounds: Sequence[Block]) -> Section:
    """The section of certificates, and of the `promised_bounds`."""
    return Section(TITLE, (*promised_means(certificates), *bounds))


def promised_bounds(runs: Mapping[str, Result], folder: Path) -> list[Block]:
    """What Theorems B and C say of both cells, for which no certificate is needed; arguments as above."""
    a460, planar = (
        {name.removeprefix(cell): run for name, run in runs.items() if name.startswith(cell)}
        for cell in ("a460_pair_", "planar_four_")
    )
    blocks: list[Block] = []
    for cell in CELLS:
        name = f"{cell}_synchronized"
        blocks += promised_errors(runs[name], PLANNED[name].make(), folder / f"modal_{cell}")
    return [*blocks, *promised_rates(a460, planar, folder / "rates_over_gamma")]


def promised_means(certificates: Mapping[str, Certificate]) -> list[Block]:
    """What the certificate of each run says, and what Theorem A bounds beside what it was."""
    those = {name: certificates[name] for name in PROMISED if name in certificates}
    points = Points(tuple(said(each) for each in those.values()))
    return [Text(_ABOUT), points, Text(_THEOREM_A), dissipation_table(those)]


def said(certificate: Certificate) -> str:
    """The verdict of a run and its meaning, and what acted outside the theorem."""
    acted = f" Outside the theorem: {'; '.join(certificate.outside)}." if certificate.outside else ""
    doubts = f" Doubts: {'; '.join(certificate.doubts)}." if certificate.doubts else ""
    return f"{certificate.title}: {certificate.verdict}, that is: {certificate.meaning}.{acted}{doubts}"


def dissipation_table(certificates: Mapping[str, Certificate]) -> Table:
    """Theorem A's bounds of every run, beside what was bounded."""
    found = [(c.title, c.dissipation) for c in certificates.values() if c.dissipation is not None]
    head = ("run", "V(0)", "D", "by", *("actual", "at most", "share") * 2, "actual", "at most")
    groups = (("", 3), ("X, √(N·m)", 3), ("Z² + V(T), N·m", 3), ("mean of sᵀ K_r s, W", 2))
    rows = tuple((title, *_cells(each)) for title, each in found)
    return Table(head, rows, _CAPTION, groups)


def _cells(found: Dissipation) -> tuple[str, ...]:
    acting = [name for name, D in found.sources.items() if SEEN * max(found.X, found.D) < D]
    told = number(found.V0), number(found.D if acting else 0.0), ", ".join(acting) or "nothing"
    pairs = (found.X, found.X_bound), (found.rest, found.rest_bound)
    compared = (cell for a, b in pairs for cell in (number(a), _finite(b), f"{a / b:.0%}" if a / b else "–"))
    return (*told, *compared, number(found.mean_square), _finite(found.mean_square_bound))


def _finite(bound: float) -> str:
    return number(bound) if np.isfinite(bound) else "–"


_ABOUT = (
    "A certificate has one of three verdicts: a run is covered by the theorem, bounded by Theorem A, or "
    "outside. What each says of the runs of both cells, and what it does not:"
)
_THEOREM_A = (
    "Theorem A: whatever torque d acts that the model does not know, friction, a push, saturation, with "
    "X² = ∫ Σ sᵀ K_r s, D² = ∫ Σ dᵀ K_r⁻¹ d, and Z² all else that V' loses, X ≤ D/2 + √(D²/4 + V(0)) and "
    "Z² + V(T) ≤ V(0) + D²/4. It bounds means over the run, not the largest error."
)
_CAPTION = (
    "Theorem A's bounds beside what was bounded. V(0) has the errors of base parameters, the combinations "
    "on which torque depends."
)
