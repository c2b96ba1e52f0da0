"""Laws side by side, fairly: with as much gain, as much torque, or as small tracking errors as the first.

A law that is given more gain tracks better, whatever it is. So each law has up to three rows, and in each its
one free gain (Lambda, `ChungSlotine`'s K_2, `PDGravity`'s K_p) is what makes it equal to the law it is
compared with in one respect, of the quiet run:

    equal pole          the errors that all robots have in common die out at the same slowest rate
    equal peak torque   the largest torque of any joint is the same
    equal tracking      the RMS of e, over all robots and axes, is the same

With the same gains each runs once more with whatever disturbs the experiment. `side_by_side` puts experiments
as they are into such rows: what a part of a law contributes, or what other gains do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np

from ..checks import choice, instance
from ..control.laws import Law, SunMills
from ..coupling.cell import Cell
from ..errors import InputError, SimulationError, StepWarning
from ..robots.friction import Friction
from ..robots.parameters import FrictionParameters
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .free_gain import LARGEST_FACTOR, factor_for, free_gain, pole_of, scaled, under, with_pole
from .metrics import metrics
from .trial_rows import AS_GIVEN, Row, Sizes
from .verdict import about_gravity, sentences, summary, table

#: what is made equal, and by which size of the quiet run
RULES = {"equal pole": None, "equal peak torque": "peak_torque", "equal tracking": "tracking_rms"}
#: what a disturbed run has from the quiet one
OF_THE_CONTROLLER = ("law", "gains", "adaptation", "reference_acceleration", "k_r_space")


@dataclass(frozen=True, eq=False)
class Comparison:
    """What `compare` found; `str` is a table with its verdict.

    Attributes:
        title: of the experiment.
        duration: of every run, s.
        units: of e, of epsilon and of torque.
        rows: the first as it was given, then those that are compared with it.
        disturbed: whether there were runs with disturbances.
        gravity: the largest torque that gravity alone asks for in the first row's quiet run, as a share of
            its peak torque.
    """

    title: str
    duration: float
    units: tuple[str, str, str]
    rows: tuple[Row, ...]
    disturbed: bool
    gravity: float

    @property
    def situations(self) -> tuple[str, ...]:
        """Which runs there were: "quiet", and "disturbed" if something disturbs."""
        return ("quiet", "disturbed") if self.disturbed else ("quiet",)

    @property
    def summary(self) -> tuple[str, ...]:
        """Which rows are better in both errors, and where a rule says little."""
        return (summary(self.rows, self.situations), *about_gravity(self.rows, self.gravity))

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the numbers of each row say beside the first, a sentence each."""
        return tuple(sentences(self.rows, self.situations, self.units[2]))

    @property
    def verdict(self) -> tuple[str, ...]:
        """What the numbers say: the summary, then each row."""
        return (*self.summary, *self.sentences)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        units = dict(zip(("tracking", "sync", "torque"), self.units, strict=True))
        rows = [asdict(row) for row in self.rows]
        found = {"title": self.title, "duration": self.duration, "units": units, "rows": rows}
        return {**found, "gravity": self.gravity, "verdict": list(self.verdict)}

    def __str__(self) -> str:
        head = f"{self.title}, {self.duration:g} s"
        return "\n".join(
            [head, *self.summary, "", *table(self.rows, self.situations, self.units), "", *self.sentences]
        )


def compare(
    experiment: Experiment,
    laws: Sequence[Law] | Mapping[str, Law],
    rules: Sequence[str] = tuple(RULES),
    **options: Any,
) -> Comparison:
    """Other laws beside that of an experiment, at equal gain, equal torque, and equal tracking.

    The quiet runs, in which the free gains are solved for, have no disturbances, payloads, or friction that
    the controller's model does not have.

    Args:
        experiment: the cell with its law and gains.
        laws: the others, by names of one's own if a mapping is given.
        rules: what is made equal, some of `RULES`, a row each.
        options: for `Experiment.simulate`; the compiled engine is faster, and where it refuses a law the
            reference engine takes its place.

    Raises:
        InputError: no laws, two of one name, a law that does not fit the cell, or rules that are none.
        SimulationError: the quiet run of the experiment's own law had to stop.
    """
    instance("experiment", experiment, Experiment, "an Experiment")
    asked = [choice("rules", rule, tuple(RULES)) for rule in rules]
    bench = _Bench(experiment, options)
    named = {name: under(bench.calm, law) for name, law in _named(laws).items()}
    run = bench.simulate(bench.calm)
    ours = bench.row(_name(experiment.law or SunMills()), AS_GIVEN, bench.calm)
    others = (row for name, law in named.items() for row in bench.rows(name, law, sizes_of(run), asked))
    return _told(bench, run, [ours, *others])


def side_by_side(experiments: Mapping[str, Experiment], **options: Any) -> Comparison:
    """Experiments on one cell, each as it is given, beside the first.

    Args:
        experiments: by name; the first is what the others are compared with.
        options: for `Experiment.simulate`, as those of `compare`.

    Raises:
        InputError: no experiments, or something that is none.
        SimulationError: the quiet run of the first had to stop.
    """
    for name, experiment in experiments.items():
        instance(f"experiments, {name}", experiment, Experiment, "an Experiment")
    if not experiments:
        raise InputError("expected at least one experiment, found none", subject="experiments")
    benches = {name: _Bench(experiment, options) for name, experiment in experiments.items()}
    first = next(iter(benches.values()))
    run = first.simulate(first.calm)
    return _told(first, run, [bench.row(name, AS_GIVEN, bench.calm) for name, bench in benches.items()])


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


def gravity_torque(cell: Cell, result: Result) -> float:
    """Largest torque that gravity alone asks of a joint along a run, N·m, from up to fifty instants of it."""
    every = max(1, len(result.t) // 50)
    return max(
        float(np.abs(robot.gravity(q)).max())
        for i, robot in enumerate(cell.robots)
        for q in result.q[::every, i, : robot.nv]
    )


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

    def rows(self, name: str, base: Experiment, ours: Sizes, rules: Sequence[str]) -> Iterator[Row]:
        """A row of a law for each rule; `base` is the quiet experiment under it."""
        pole = with_pole(base, pole_of(self.calm))
        for rule in rules:
            size = RULES[rule]
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
            changes = {key: getattr(quiet, key) for key in OF_THE_CONTROLLER}
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


def _told(bench: _Bench, run: Result, rows: Sequence[Row]) -> Comparison:
    """Rows with what their first quiet run says of all."""
    made = bench.experiment
    units = (run.unit("tracking_error"), run.unit("sync_error"), run.unit("tau"))
    peak = sizes_of(run).peak_torque
    gravity = gravity_torque(made.cell, run) / peak if peak else 0.0
    title, stirred = made.title or made.cell.name, bench.calm is not made
    return Comparison(title, float(run.info["duration"]), units, tuple(rows), stirred, gravity)


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
