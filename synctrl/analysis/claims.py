"""What the paper claims of its experiments, checked against computed runs.

Every claim is a small function of runs. Its verdict follows from a criterion that the explanation states and
from figures that are computed here; nothing is decided beforehand. Words such as "much smaller" are the
paper's; `MUCH` and the other constants below say what we ask for.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from ..simulation.result import Result
from .metrics import metrics, row_names

#: "much smaller": by at least this factor
MUCH = 2.0
#: "reaches its target": the last error is at most this share of the way travelled
REACHED = 0.05
#: "converges": over the last tenth of the run the error is at most this share of its peak
CONVERGED = 0.02
#: "contributes little": changes the largest synchronization error by at most this share
LITTLE = 0.10
#: "the same direction": cosine of the angle between two responses over the run
ALONG = 0.9


class Quantity(NamedTuple):
    """A computed figure behind a verdict."""

    name: str
    value: float
    unit: str = ""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper and what became of it.

    Attributes:
        text: the claim, in our words.
        source: where the paper makes it.
        holds: the verdict.
        figures: the computed figures behind the verdict.
        explanation: the criterion, and what the figures say.
    """

    text: str
    source: str
    holds: bool
    figures: tuple[Quantity, ...]
    explanation: str

    def as_data(self) -> dict[str, Any]:
        """Plain data for a JSON file."""
        figures = [quantity._asdict() for quantity in self.figures]
        return {
            "text": self.text,
            "source": self.source,
            "holds": self.holds,
            "figures": figures,
            "explanation": self.explanation,
        }


# -- two A460 arms, section V-A ---------------------------------------------------------------------------


def arms_reach_their_targets(run: Result) -> Claim:
    """Every joint ends within `REACHED` of the way it travels."""
    way = np.abs(run.x_desired[-1] - run.x_desired[0])
    share = np.abs(run.tracking_error[-1]) / way
    worst = _worst(share)
    return Claim(
        f"Both arms reach their targets with small residual offsets ({_kind(run)} control).",
        f"section V-A, {'Figs. 2 and 3' if _kind(run) == 'synchronized' else 'Figs. 5 and 6'}",
        bool(share.max() <= REACHED),
        (
            Quantity("largest final error", np.abs(run.tracking_error[-1]).max(), run.unit("tracking_error")),
            Quantity("largest share of the way that is left", share.max()),
        ),
        f"Asked: on every joint at most {REACHED:.0%} of the desired way left after {run.t[-1]:g} s. Largest share: "
        f"{run.names[worst[0]]}, {run.info['axes'][worst[1]]}.",
    )


def sync_error_is_much_smaller(synchronized: Result, independent: Result, source: str) -> Claim:
    """Peak and RMS of every synchronization error fall by at least `MUCH` through synchronization."""
    ours, theirs = metrics(synchronized).sync_error, metrics(independent).sync_error
    peak, rms = theirs.peak / ours.peak, theirs.rms / ours.rms
    figures = [
        Quantity(f"{name} of {_error_name(synchronized, *at)}, independent / synchronized", value)
        for name, ratios in (("peak", peak), ("RMS", rms))
        for at, value in _extremes(ratios)
    ]
    return Claim(
        "The synchronization errors are much smaller with synchronization than without, all of them.",
        source,
        bool(min(peak.min(), rms.min()) >= MUCH),
        tuple(figures),
        f"Asked: peak and RMS of each synchronization error smaller by a factor of at least {MUCH:g}. Shown are "
        "the smallest and the largest factor.",
    )


def offsets_are_due_to_friction(run: Result, frictionless: Result) -> Claim:
    """The offset that friction leaves is gone in a plant without friction."""
    with_friction, without = _late(run.tracking_error), _late(frictionless.tracking_error)
    return Claim(
        "The residual offsets of the joints are due to friction.",
        "section V-A",
        bool(without.max() * MUCH <= with_friction.max()),
        (
            Quantity("largest late error with friction", with_friction.max(), run.unit("tracking_error")),
            Quantity("largest late error without friction", without.max(), run.unit("tracking_error")),
            Quantity("length of the run without friction", frictionless.t[-1], "s"),
        ),
        "Friction is in the plant and not in the regressor Y. Asked: the same cell without friction has, over the "
        f"last tenth of its run, a tracking error smaller by a factor of at least {MUCH:g}.",
    )


def offsets_are_due_to_gravity(frictionless: Result) -> Claim:
    """Gravity alone would leave an offset: an error that does not converge without friction."""
    left = _left(frictionless.tracking_error)
    return Claim(
        "The residual offsets of the joints are due to gravity.",
        "section V-A",
        bool(left > CONVERGED),
        (
            Quantity("late error / peak, gravity without friction", left),
            Quantity(
                "largest late error, gravity without friction",
                _late(frictionless.tracking_error).max(),
                frictionless.unit("tracking_error"),
            ),
        ),
        "Gravity is in the regressor Y, so the adaptation takes it up. The claim would hold if, with gravity and "
        f"without friction, more than {CONVERGED:.0%} of the peak error were left over the last tenth of the run.",
    )


# -- convergence, theorems 1 and 2 ------------------------------------------------------------------------


def errors_converge(run: Result, source: str) -> Claim:
    """Tracking and synchronization errors fall to `CONVERGED` of their peaks."""
    tracking, sync = _left(run.tracking_error), _left(run.sync_error)
    return Claim(
        f"Tracking and synchronization errors converge to zero ({run.info['title']}).",
        source,
        bool(max(tracking, sync) <= CONVERGED),
        (
            Quantity("late tracking error / peak", tracking),
            Quantity("late synchronization error / peak", sync),
            Quantity("length of the run", run.t[-1], "s"),
        ),
        f"Asked: over the last tenth of the run at most {CONVERGED:.0%} of each peak left. A run of finite length can "
        "show decay, not the limit; the limit is the theorem's.",
    )


# -- four planar arms, section V-B ------------------------------------------------------------------------


def others_move_along(undisturbed: Result, disturbed: Result) -> Claim:
    """The disturbance of robot 1 moves robots 2 to 4 the same way when they are synchronized."""
    response = disturbed.tracking_error - undisturbed.tracking_error  # (T, n, m)
    first, others = response[:, 0].ravel(), response[:, 1:].swapaxes(0, 1).reshape(response.shape[1] - 1, -1)
    lengths = np.linalg.norm(others, axis=1) * np.linalg.norm(first)
    cosines = others @ first / np.where(lengths > 0, lengths, np.inf)  # 0 for a robot that does not respond
    sizes = np.abs(response).max(axis=(0, 2))
    figures = [Quantity(f"response of {n}", s, "m") for n, s in zip(disturbed.names, sizes, strict=True)]
    return Claim(
        "Disturbed and synchronized, robots 2 to 4 respond to the torque on robot 1 and so avoid large "
        "synchronization errors.",
        "section V-B, Figs. 13 and 14",
        bool(cosines.min() >= ALONG and sizes[1:].min() * MUCH >= sizes[0]),
        (*figures, Quantity("smallest cosine between a response and that of robot 1", float(cosines.min()))),
        "Response: tracking error with minus without the disturbance, its peak. Asked: each response has at least "
        f"1/{MUCH:g} of the size of robot 1's and runs along it, cosine at least {ALONG:g}.",
    )


def others_are_untouched(undisturbed: Result, disturbed: Result) -> Claim:
    """Independent robots 2 to 4 are bit for bit the same with and without the disturbance."""
    arrays = ("x", "q", "v", "tau", "tracking_error", "theta_hat")
    changed = sum(_changed(undisturbed, disturbed, name, [1, 2, 3]) for name in arrays)
    moved = np.abs(disturbed.tracking_error[:, 0] - undisturbed.tracking_error[:, 0]).max()
    return Claim(
        "Disturbed and independent, robots 2 to 4 move exactly as without the disturbance.",
        "section V-B, Figs. 11 and 15",
        bool(changed == 0 and moved > 0),
        (Quantity("logged values of robots 2 to 4 that differ", changed), Quantity("response of robot 1", moved, "m")),
        "Asked: positions, velocities, torques, errors and estimates of robots 2 to 4 bit for bit the same.",
    )


def only_adjacent_sync_errors_grow(undisturbed: Result, disturbed: Result) -> Claim:
    """Independent: epsilon_2 and epsilon_3 stay bit for bit, epsilon_1 and epsilon_4 grow."""
    before, after = metrics(undisturbed).sync_error.peak, metrics(disturbed).sync_error.peak
    growth = after.max(axis=1) / before.max(axis=1)
    changed = _changed(undisturbed, disturbed, "sync_error", [1, 2])
    return Claim(
        "Disturbed and independent, ε_2 and ε_3 are unchanged, while ε_1 and ε_4 grow significantly.",
        "section V-B, Figs. 12 and 16",
        bool(changed == 0 and min(growth[0], growth[3]) >= MUCH),
        (
            Quantity("logged values of ε_2 and ε_3 that differ", changed),
            Quantity("peak of ε_1, disturbed / undisturbed", growth[0]),
            Quantity("peak of ε_4, disturbed / undisturbed", growth[3]),
        ),
        f"Asked: ε_2 and ε_3 bit for bit the same, the peaks of ε_1 and ε_4 larger by a factor of at least {MUCH:g}.",
    )


def disturbance_is_shared(synchronized: Result, independent: Result) -> Claim:
    """Under the disturbance, the largest synchronization error is much smaller with synchronization."""
    ours, theirs = (metrics(run).sync_error.peak.max() for run in (synchronized, independent))
    unit = synchronized.unit("sync_error")
    return Claim(
        "Disturbed, the largest synchronization error is much smaller with synchronization than without.",
        "section V-B, Figs. 14 and 16",
        bool(ours * MUCH <= theirs),
        (Quantity("largest, synchronized", ours, unit), Quantity("largest, independent", theirs, unit)),
        f"Asked: smaller by a factor of at least {MUCH:g}.",
    )


# -- what the paper does not say --------------------------------------------------------------------------


def gain_contributes_little(name: str, paper: Result, without: Result) -> Claim:
    """Our finding: a gain of the paper switched off changes the largest synchronization error little."""
    t, with_it = _common(paper, without)
    without_it = without.sync_error[: len(t)]
    change = abs(np.abs(without_it).max() / np.abs(with_it).max() - 1)
    return Claim(
        f"At the paper's gains, {name} contributes little to the synchronization of the four arms.",
        "ours, not the paper's",
        bool(change <= LITTLE),
        (
            Quantity("largest synchronization error, the paper's gains", np.abs(with_it).max(), paper.unit("sync_error")),
            Quantity(f"the same without {name}", np.abs(without_it).max(), paper.unit("sync_error")),
        ),
        f"Asked: a change of at most {LITTLE:.0%} of the largest synchronization error in the first {t[-1]:g} s.",
    )


def baseline_is_not_gain_matched(synchronized: Result, stiff: Result) -> Claim:
    """Our finding: an independent controller with a larger Lambda tracks better than the synchronized one."""
    t, _ = _common(synchronized, stiff)
    ours, theirs = (np.abs(run.tracking_error[: len(t)]).max() for run in (synchronized, stiff))
    errors = [np.abs(run.sync_error[: len(t)]).max() for run in (synchronized, stiff)]
    return Claim(
        f"β = K_ε = 0 is not a gain-matched comparison: an independent controller with Λ = "
        f"{_scalar(stiff.info['gains']['Lambda'])} tracks better than the synchronized one.",
        "ours, not the paper's",
        bool(theirs < ours),
        (
            Quantity("largest tracking error, synchronized", ours, "m"),
            Quantity("largest tracking error, independent and stiffer", theirs, "m"),
            Quantity("largest synchronization error, synchronized", errors[0], synchronized.unit("sync_error")),
            Quantity("largest synchronization error, independent and stiffer", errors[1], stiff.unit("sync_error")),
        ),
        f"Compared over the first {t[-1]:g} s.",
    )


# -- all of them ------------------------------------------------------------------------------------------


def a460_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """Claims on the A460 pair, from its runs `synchronized`, `independent` and `frictionless`."""
    synchronized, independent, frictionless = _need(runs, "synchronized", "independent", "frictionless")
    return [
        arms_reach_their_targets(synchronized),
        arms_reach_their_targets(independent),
        sync_error_is_much_smaller(synchronized, independent, "section V-A, Figs. 4 and 7"),
        offsets_are_due_to_friction(synchronized, frictionless),
        offsets_are_due_to_gravity(frictionless),
        errors_converge(frictionless, "theorem 1"),
    ]


def planar_four_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """Claims on the four arms, from their runs `synchronized`, `independent` and the two `..._disturbed`."""
    names = ("synchronized", "independent", "synchronized_disturbed", "independent_disturbed")
    synchronized, independent, synchronized_disturbed, independent_disturbed = _need(runs, *names)
    return [
        errors_converge(synchronized, "theorem 2 and section V-B, Figs. 9 and 10"),
        errors_converge(independent, "section V-B, Figs. 11 and 12"),
        sync_error_is_much_smaller(synchronized, independent, "section V-B, Figs. 10 and 12"),
        others_move_along(synchronized, synchronized_disturbed),
        disturbance_is_shared(synchronized_disturbed, independent_disturbed),
        others_are_untouched(independent, independent_disturbed),
        only_adjacent_sync_errors_grow(independent, independent_disturbed),
    ]


def own_findings(runs: Mapping[str, Result]) -> list[Claim]:
    """What the paper leaves unsaid, from runs `synchronized`, `without_k_eps`, `without_adaptation`, `stiff`."""
    names = ("synchronized", "without_k_eps", "without_adaptation", "stiff")
    synchronized, without_k_eps, without_adaptation, stiff = _need(runs, *names)
    return [
        gain_contributes_little("K_ε", synchronized, without_k_eps),
        gain_contributes_little("the adaptation", synchronized, without_adaptation),
        baseline_is_not_gain_matched(synchronized, stiff),
    ]


def _need(runs: Mapping[str, Result], *names: str) -> list[Result]:
    missing = [name for name in names if name not in runs]
    if missing:
        raise InputError(f"claims: expected runs {', '.join(names)}; missing: {', '.join(missing)}")
    return [runs[name] for name in names]


def _kind(run: Result) -> str:
    return "synchronized" if np.any(run.info["gains"]["beta"]) else "independent"


def _late(e: np.ndarray) -> np.ndarray:
    """Largest |e| over the last tenth of the instants, per row and axis."""
    return np.abs(e[-max(1, len(e) // 10) :]).max(axis=0)


def _left(e: np.ndarray) -> float:
    """Largest late error as a share of the largest error."""
    return float(_late(e).max() / np.abs(e).max())


def _common(a: Result, b: Result) -> tuple[np.ndarray, np.ndarray]:
    """Instants that both runs have, and the first run's synchronization errors there."""
    t = a.t if len(a.t) < len(b.t) else b.t
    if not np.array_equal(a.t[: len(t)], b.t[: len(t)]):
        raise InputError("claims: expected two runs logged at the same instants")
    return t, a.sync_error[: len(t)]


def _changed(a: Result, b: Result, name: str, rows: Iterable[int]) -> int:
    """Number of logged values of these rows that are not the same bits."""
    one, other = (np.ascontiguousarray(getattr(run, name)[:, list(rows)]) for run in (a, b))
    return int(np.count_nonzero(one.view(np.int64) != other.view(np.int64)))


def _worst(values: np.ndarray) -> tuple[int, int]:
    row, column = np.unravel_index(np.argmax(values), values.shape)
    return int(row), int(column)


def _extremes(ratios: np.ndarray) -> list[tuple[tuple[int, int], float]]:
    """Place and value of the smallest and the largest entry."""
    return [(_worst(-ratios), float(ratios.min())), (_worst(ratios), float(ratios.max()))]


def _error_name(run: Result, pair: int, axis: int) -> str:
    return f"ε_{row_names(run, 'sync_error')[pair].split(':')[0]}, {run.info['axes'][axis]}"


def _scalar(gain: Any) -> str:
    return f"{np.mean(gain):g}"
