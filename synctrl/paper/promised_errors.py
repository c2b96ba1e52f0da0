"""Blocks of the page on Theorem B and the tube: how large errors may be, beside how large they were."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..analysis.modal import Bounded, ModalBounds, modal_bounds
from ..analysis.tube import Tube, tube
from ..show.modal_figures import modal_figure
from ..show.style import display
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .report import Block, Table, Text, as_picture, number

#: every how many instants of a run are looked at
EVERY = 4


def promised_errors(run: Result, experiment: Experiment, stem: Path) -> list[Block]:
    """What Theorem B and the tube bound in a run; the figure is written to `<stem>.svg`.

    Args:
        run: of the paper's law.
        experiment: what made it.
        stem: of the figure.
    """
    thinned = run.decimated(EVERY)
    bounds = modal_bounds(thinned, experiment)
    before = tube(experiment.cell, experiment.gains, duration=float(run.t[-1]))
    return [
        as_picture(modal_figure(bounds), stem, caption(bounds)),
        modal_table(bounds),
        tube_table(bounds, before, thinned),
        Text(tube_words(before)),
    ]


def caption(bounds: ModalBounds) -> str:
    """What the figure shows, and what beta does, in words made from the gains."""
    limits = [each for each in (bounds.reason, bounds.unbounded, bounds.unresolved) if each is not None]
    beyond = f" Limits: {'; '.join(limits)}." if limits else ""
    return (
        f"{bounds.title}: weighted errors w = c e of the run, mode by mode, inside their bounds. "
        f"{_sentence(bounds.sentence)}{beyond}"
    )


def modal_table(bounds: ModalBounds) -> Table:
    """Gains from r with and without beta, and bounds of each mode and axis beside what they bound."""
    unit, factor = display(bounds.unit)
    three = ("run", "with its r", "a priori")
    head = ("mode, λ of SᵀS, axis", "with β", "β = 0", *three, *three)
    groups = (("gain from r, s", 2), (f"|w| in L₂, {unit}·√s", 3), (f"largest |w|, {unit}", 3))
    rows = []
    for j, value in enumerate(bounds.filter.eigenvalues):
        for a, axis in enumerate(bounds.axes):
            gains = bounds.filter.gain[j, a], bounds.filter.gain[0, a]
            cells = (cell for part in (bounds.l2, bounds.peak) for cell in _bounded(part, (j, a), factor))
            rows.append((f"{j + 1}, {value:.3g}, {axis}", *map(number, gains), *cells))
    return Table(head, tuple(rows), _MODES, groups)


def tube_table(bounds: ModalBounds, before: Tube, run: Result) -> Table:
    """The largest error of each robot and part beside the tube, and of each robot beside Theorem B."""
    largest = before.sizes(run.tracking_error).max(axis=0)
    unit, factor = display(run.unit("tracking_error"))
    parts = [display(part.unit) for part in before.parts]
    named = [f"{part.name}, {shown.unit}" for part, shown in zip(before.parts, parts, strict=True)]
    columns = (f"{name}: {what}" for name in named for what in ("run", "tube"))
    head = ("robot", *columns, "run", "with its r", "a priori")
    groups = (("beside the tube", 2 * len(parts)), (f"all axes, Theorem B, {unit}", 3))
    rows = []
    for i, name in enumerate(before.names):
        pairs = zip(largest[i], before.largest[i], parts, strict=True)
        cells = [number(shown.factor * size) for *sizes, shown in pairs for size in sizes]
        rows.append((name, *cells, *_bounded(bounds.errors, (i,), factor)))
    return Table(head, tuple(rows), _ERRORS, groups)


def tube_words(before: Tube) -> str:
    """What the tube says of singular configurations, and what has to be true for it."""
    excluded = {True: "excludes", False: "does not exclude", None: "cannot tell about"}
    sampled = " κ is sampled, and no bound." if before.sampled else ""
    return (
        f"Before any run, V(0) = {number(before.V0)} N·m, and torque of D ≤ {number(before.D)} √(N·m) "
        f"outside the model, give a tube that {excluded[before.excludes_singularities]} singular "
        f"configurations: {before.reason}.{sampled} Taken for granted: "
        f"{'; '.join(before.assumed) or 'nothing'}."
    )


def _bounded(part: Bounded, at: tuple[int, ...], factor: float) -> Iterator[str]:
    """A size, its bound with the r of the run, and the one before it."""
    for values in (part.actual, part.bound, part.a_priori):
        yield "–" if values is None else number(factor * float(values[at]))


def _sentence(text: str) -> str:
    greek = text.replace("beta", "β").replace("Lambda", "Λ")
    return f"{greek[0].upper() if greek[0].isascii() else greek[0]}{greek[1:]}."


_MODES = (
    "Theorem B: a mode w_j of SᵀS with eigenvalue λ is its coupled velocity error r_j, filtered. Bounds with "
    "the r of the run, and a priori with Theorem A's bound of X in its place; the largest |w| from w(0) on."
)
_ERRORS = "Largest errors of each robot, inside the tube that is known before any run, and by Theorem B."
