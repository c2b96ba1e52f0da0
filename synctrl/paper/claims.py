"""What the paper claims of its experiments, checked against computed runs.

Every claim is a small function of runs. Its verdict follows from a criterion that the explanation states and
from figures that are computed here; nothing is decided beforehand. Words such as "much smaller" are the
paper's; `MUCH` and the other constants below say what we ask for.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ..analysis.metrics import metrics, row_names
from ..errors import InputError
from ..renamed import names_elsewhere
from ..simulation.result import Result
from .trend import FALLEN, WINDOWS, trend

#: "much smaller": by at least this factor
MUCH = 2.0
#: "reaches its target": the last error is at most this share of the way travelled
REACHED = 0.05
#: "contributes little": changes peak and RMS of the synchronization error by at most this share
LITTLE = 0.10
#: "the same direction": cosine of the angle between two responses over the run
ALONG = 0.9
#: the source of what the paper does not say begins with this
OURS = "ours"
#: of a finding about the paper's own law or cells
OURS_OF_THE_PAPER = f"{OURS}, not the paper's"


@dataclass(frozen=True)
class Finding:
    """A computed figure behind a verdict."""

    name: str
    value: float
    unit: str = ""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, or of ours, and what became of it.

    Attributes:
        text: the claim, in our words.
        source: where the paper makes it; of what is not the paper's it begins with `OURS`.
        holds: the verdict.
        figures: the computed figures behind the verdict.
        explanation: the criterion, and what the figures say.
        by_construction: why it, or a part of it, could not have failed; empty if it could.
    """

    text: str
    source: str
    holds: bool
    figures: tuple[Finding, ...]
    explanation: str
    by_construction: str = ""

    @property
    def ours(self) -> bool:
        """Whether it is a finding of ours and not a claim of the paper."""
        return self.source.startswith(OURS)


def tally(found: Iterable[Claim]) -> str:
    """How many claims hold, the paper's counted apart from ours, and how many could not have failed."""
    found = tuple(found)
    papers, ours = ([claim for claim in found if claim.ours == mine] for mine in (False, True))
    built = sum(bool(claim.by_construction) for claim in papers)
    apart = f", of which {built} could hardly have failed" if built else ""
    return f"{_held(papers)} of the paper's claims hold{apart}; {_held(ours)} of ours."


def _held(found: Collection[Claim]) -> str:
    return f"{sum(claim.holds for claim in found)} of {len(found)}"


def sync_error_is_much_smaller(synchronized: Result, independent: Result, source: str) -> Claim:
    """Peak and RMS of every synchronization error fall by at least `MUCH` through synchronization."""
    peak, rms = factors_of_sync_errors(synchronized, independent)
    figures = [
        Finding(f"{name} of {error_name(synchronized, *at)}, independent / synchronized", value)
        for name, ratios in (("peak", peak), ("RMS", rms))
        for at, value in extremes(ratios)
    ]
    return Claim(
        "The synchronization errors are much smaller with synchronization than without, all of them.",
        source,
        bool(min(peak.min(), rms.min()) >= MUCH),
        tuple(figures),
        f"Asked: peak and RMS of each synchronization error smaller by a factor of at least {MUCH:g}. Shown "
        "are the smallest and the largest factor.",
    )


def factors_of_sync_errors(synchronized: Result, independent: Result) -> tuple[np.ndarray, np.ndarray]:
    """Factors by which peak and RMS of each synchronization error are smaller, each (pairs, m)."""
    ours, theirs = metrics(synchronized).sync_error, metrics(independent).sync_error
    return theirs.peak / ours.peak, theirs.rms / ours.rms


def errors_converge(run: Result, source: str) -> Claim:
    """Tracking and synchronization errors fall over the later half of the run, and keep falling."""
    kinds = {"tracking": run.tracking_error, "synchronization": run.sync_error}
    seen = {name: trend(run.t, e) for name, e in kinds.items()}
    figures = [
        figure
        for name, found in seen.items()
        for figure in (
            Finding(f"rate of the {name} error", found.rate, "1/s"),
            Finding(f"late {name} error / peak", left(kinds[name])),
        )
    ]
    return Claim(
        f"Tracking and synchronization errors converge to zero ({run.info['title']}).",
        source,
        all(found.falls for found in seen.values()),
        (*figures, Finding("length of the run", run.t[-1], "s")),
        f"Asked: over the later half of the run, in {WINDOWS} windows, the largest errors fall from each "
        f"window to the next, and the exponential fitted to them to at most {FALLEN:.0%}. That does not "
        "depend on how long the run is, as what is left at its end does, once the later half is past the "
        "first swings and a motion that ends. A run can show decay, not the limit; the limit is the "
        "theorem's.",
    )


# -- measures of runs --------------------------------------------------------------------------------------


def need(runs: Mapping[str, Result], *names: str) -> list[Result]:
    """Runs by name.

    Raises:
        InputError: one is missing.
    """
    missing = tuple(name for name in names if name not in runs)
    if missing:
        words = f"expected runs {', '.join(names)}; missing: {', '.join(missing)}"
        raise InputError(words, subject="claims", found=missing)
    return [runs[name] for name in names]


def kind(run: Result) -> str:
    """`synchronized` or `independent`, by the gains."""
    return "synchronized" if np.any(run.info["gains"]["beta"]) else "independent"


def findings(name: str, values: Iterable[float], unit: str, who: Iterable[str]) -> list[Finding]:
    """The same figure of several runs, each with the words for its run."""
    return [Finding(f"{name}, {each}", value, unit) for each, value in zip(who, values, strict=True)]


def late(e: np.ndarray) -> np.ndarray:
    """Largest |e| over the last tenth of the instants, per row and axis."""
    return np.abs(e[-max(1, len(e) // 10) :]).max(axis=0)


def left(e: np.ndarray) -> float:
    """Largest late error as a share of the largest error."""
    return float(late(e).max() / np.abs(e).max())


def common(a: Result, b: Result) -> tuple[np.ndarray, np.ndarray]:
    """Instants that both runs have, and the first run's synchronization errors there."""
    t = a.t if len(a.t) < len(b.t) else b.t
    if not np.array_equal(a.t[: len(t)], b.t[: len(t)]):
        raise InputError("expected two runs logged at the same instants", subject="claims")
    return t, a.sync_error[: len(t)]


def response(disturbed: Result, undisturbed: Result) -> np.ndarray:
    """Tracking errors with less those without a disturbance, at the instants of the latter, (T, n, m).

    Raises:
        InputError: the disturbed run does not have them all.
    """
    at = np.searchsorted(disturbed.t, undisturbed.t).clip(max=len(disturbed.t) - 1)
    if not np.array_equal(disturbed.t[at], undisturbed.t):
        raise InputError("expected a disturbed run logged at the instants of the other", subject="claims")
    return disturbed.tracking_error[at] - undisturbed.tracking_error


def changed(a: Result, b: Result, name: str, rows: Iterable[int]) -> int:
    """Number of logged values of these rows that are not the same bits."""
    one, other = (np.ascontiguousarray(getattr(run, name)[:, list(rows)]) for run in (a, b))
    return int(np.count_nonzero(one.view(np.int64) != other.view(np.int64)))


def worst(values: np.ndarray) -> tuple[int, int]:
    """Row and column of the largest entry."""
    row, column = np.unravel_index(np.argmax(values), values.shape)
    return int(row), int(column)


def extremes(ratios: np.ndarray) -> list[tuple[tuple[int, int], float]]:
    """Place and value of the smallest and the largest entry."""
    return [(worst(-ratios), float(ratios.min())), (worst(ratios), float(ratios.max()))]


def error_name(run: Result, pair: int, axis: int) -> str:
    """A synchronization error in words."""
    return f"ε_{row_names(run, 'sync_error')[pair].split(':')[0]}, {run.info['axes'][axis]}"


__getattr__ = names_elsewhere(__name__, ".claims", Quantity="Finding")
