"""Laws side by side, fairly: with as much gain, as much torque, or as small tracking errors as the first.

A law that is given more gain tracks better, whatever it is. So each law has up to three rows, and in each its
one free gain (Lambda, `ChungSlotine`'s K_2, `PDGravity`'s K_p) is what makes it equal to the law it is
compared with in one respect, of the quiet run:

    equal pole          the errors that all robots have in common die out at the same slowest rate
    equal peak torque   the largest torque of any joint is the same
    equal tracking      the RMS of e, over all robots and axes, is the same

With the same gains each runs once more with whatever disturbs the experiment.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np

from ..checks import instance
from ..control.laws import Law, SunMills
from ..coupling.cell import Cell
from ..errors import InputError, SimulationError, StepWarning
from ..robots.friction import Friction
from ..robots.parameters import FrictionParameters
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .free_gain import LARGEST_FACTOR, factor_for, free_gain, scaled, under, with_pole
from .metrics import metrics
from .trial_rows import Row, Sizes
from .verdict import table, verdict

#: what is made equal, and by which size of the quiet run
RULES = {"equal pole": None, "equal peak torque": "peak_torque", "equal tracking": "tracking_rms"}


@dataclass(frozen=True, eq=False)
class Comparison:
    """What `compare` found; `str` is a table with its verdict.

    Attributes:
        title: of the experiment.
        duration: of every run, s.
        units: of e, of epsilon and of torque.
        rows: the law of the experiment as it was given, then up to three rows for each of the others.
        disturbed: whether there were runs with disturbances.
    """

    title: str
    duration: float
    units: tuple[str, str, str]
    rows: tuple[Row, ...]
    disturbed: bool

    @property
    def situations(self) -> tuple[str, ...]:
        """Which runs there were: "quiet", and "disturbed" if something disturbs."""
        return ("quiet", "disturbed") if self.disturbed else ("quiet",)

    @property
    def verdict(self) -> tuple[str, ...]:
        """What the numbers say, a sentence each."""
        return tuple(verdict(self.rows, self.situations))

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        units = dict(zip(("tracking", "sync", "torque"), self.units, strict=True))
        rows = [asdict(row) for row in self.rows]
        found = {"title": self.title, "duration": self.duration, "units": units, "rows": rows}
        return {**found, "verdict": list(self.verdict)}

    def __str__(self) -> str:
        head = f"{self.title}, {self.duration:g} s"
        return "\n".join([head, *table(self.rows, self.situations, self.units), "", *self.verdict])


def compare(experiment: Experiment, laws: Sequence[Law] | Mapping[str, Law], **options: Any) -> Comparison:
    """Other laws beside that of an experiment, at equal gain, equal torque, and equal tracking.

    The quiet runs, in which the free gains are solved for, have no disturbances, payloads, or friction that
    the controller's model does not have.

    Args:
        experiment: the cell with its law and gains.
        laws: the others, by names of one's own if a mapping is given.
        options: for `Experiment.simulate`; the compiled engine is faster, and where it refuses a law the
            reference engine takes its place.

    Raises:
        InputError: no laws, two of one name, or a law that does not fit the cell.
        SimulationError: the quiet run of the experiment's own law had to stop.
    """
    instance("experiment", experiment, Experiment, "an Experiment")
    bench = _Bench(experiment, options)
    named = {name: under(bench.calm, law) for name, law in _named(laws).items()}
    own = _name(experiment.law or SunMills())
    run = bench.simulate(bench.calm)
    ours = bench.row(own, "as given", bench.calm)
    rows = [ours, *(row for name, other in named.items() for row in bench.rows(name, other, sizes_of(run)))]
    units = (run.unit("tracking_error"), run.unit("sync_error"), run.unit("tau"))
    title, stirred = experiment.title or experiment.cell.name, bench.calm is not experiment
    return Comparison(title, float(run.info["duration"]), units, tuple(rows), stirred)


def undisturbed(experiment: Experiment) -> Experiment:
    """An experiment without disturbances, payloads, and friction that its controller does not model."""
    cell = experiment.cell
    rubs = [
        (m.friction.viscous.any() or m.friction.coulomb.any()) and not isinstance(p, FrictionParameters)
        for m, p in zip(cell.members, cell.parameters, strict=True)
    ]
    if not (any(rubs) or experiment.disturbances or experiment.payloads):
        return experiment
    if any(rubs):
        smooth = [
            replace(m, friction=Friction()) if rub else m for m, rub in zip(cell.members, rubs, strict=True)
        ]
        cell = Cell(smooth, cell.coupling, cell.space, cell.name)
    return replace(experiment, cell=cell, disturbances=(), payloads=())


def sizes_of(result: Result) -> Sizes:
    """A run in five numbers."""
    found = metrics(result)
    e, epsilon = found.tracking_error, found.sync_error
    rms = [float(np.sqrt(np.square(error.rms).mean())) for error in (e, epsilon)]
    peaks = [float(array.max()) for array in (e.peak, epsilon.peak, found.peak_torque)]
    return Sizes(peaks[0], rms[0], peaks[1], rms[1], peaks[2])


class _Bench:
    """Makes the runs of one comparison."""

    def __init__(self, experiment: Experiment, options: dict[str, Any]):
        self.experiment, self.options = experiment, options
        self.calm = undisturbed(experiment)

    def simulate(self, experiment: Experiment) -> Result:
        """A run; gains for which the step is too long are part of a search, and no news."""
        with catch_warnings():
            simplefilter("ignore", StepWarning)
            try:
                return experiment.simulate(**self.options)
            except InputError as error:
                if error.subject != "law" or "engine" not in self.options:
                    raise
            return experiment.simulate(**{**self.options, "engine": "pinocchio"})

    def sizes(self, experiment: Experiment) -> Sizes | SimulationError:
        """What a run measures, or why it had to stop."""
        try:
            return sizes_of(self.simulate(experiment))
        except SimulationError as error:
            return error

    def rows(self, name: str, base: Experiment, ours: Sizes) -> Iterator[Row]:
        """Up to three rows of a law; `base` is the quiet experiment under it."""
        pole = with_pole(base, float(np.min(self.experiment.gains.Lambda)))
        for rule, size in RULES.items():
            found = pole if size is None else self.solved(pole or base, size, getattr(ours, size))
            yield self.missing(name, rule, pole or base) if found is None else self.row(name, rule, found)

    def solved(self, base: Experiment, size: str, target: float) -> Experiment | None:
        """The law with the free gain that makes one size of the quiet run what is asked, or None."""

        def excess(factor: float) -> float:
            found = self.sizes(scaled(base, factor))
            return float("inf") if isinstance(found, SimulationError) else getattr(found, size) / target - 1

        factor = factor_for(excess)
        return None if factor is None else scaled(base, factor)

    def row(self, name: str, rule: str, quiet: Experiment) -> Row:
        """A law with its gains, run quietly and, if there is anything to disturb it, disturbed."""
        runs = {"quiet": quiet}
        if self.calm is not self.experiment:
            changes = {key: getattr(quiet, key) for key in ("law", "gains", "reference_acceleration")}
            runs["disturbed"] = replace(self.experiment, **changes)
        found = {situation: self.sizes(run) for situation, run in runs.items()}
        stopped = {key: error for key, error in found.items() if isinstance(error, SimulationError)}
        whole = {key: sizes for key, sizes in found.items() if isinstance(sizes, Sizes)}
        gain, value = free_gain(quiet)
        remark = "; ".join(f"{key}, the run had to stop: {error}" for key, error in stopped.items())
        return Row(name, rule, gain, value.tolist(), whole.get("quiet"), whole.get("disturbed"), remark)

    def missing(self, name: str, rule: str, base: Experiment) -> Row:
        """A row that says that the free gain cannot be solved for."""
        gain, value = free_gain(base)
        remark = f"no {gain} from 1/{LARGEST_FACTOR:g} to {LARGEST_FACTOR:g} times {value.tolist()} gives it"
        return Row(name, rule, gain, None, None, None, remark)


def _named(laws: Sequence[Law] | Mapping[str, Law]) -> dict[str, Law]:
    """Laws by name, each once.

    Raises:
        InputError: no laws, something that is none, or two of one name.
    """
    given = list(laws.values()) if isinstance(laws, Mapping) else list(laws)
    for law in given:
        if not hasattr(law, "bind") or isinstance(law, type):
            raise InputError(
                f"expected, for example, [SlotineLi()], found {law!r}", subject="laws", found=law
            )
    names = list(laws) if isinstance(laws, Mapping) else [_name(law) for law in given]
    if not given or len(set(names)) != len(names):
        expected = "expected laws of different names, as a mapping if there are two of one kind"
        raise InputError(f"{expected}, found {names}", subject="laws", found=names)
    return dict(zip(names, given, strict=True))


def _name(law: Law) -> str:
    return str(law.as_dict()["name"])
