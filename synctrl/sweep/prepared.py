"""Many runs of one experiment and its variations, with everything they share made once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..checks import choice
from ..simulation.engines import Engine, Run, find_engine
from ..simulation.result import Result
from ..simulation.simulate import Experiment


class Prepared:
    """An experiment that was looked at once, and whose variations run without it being done again.

    Their results are those of `Experiment.simulate`, bit for bit. For the compiled engine the library is
    loaded once, and what is desired is tabulated once; only what changed is written for a run.

    Args:
        experiment: the experiment.
        duration: s; by default the experiment's.
        dt: step, s.
        engine: "pinocchio" or "compiled".
        log_dt: interval of the logs, a multiple of dt, s; by default dt.

    Raises:
        InputError: see `Experiment.simulate`.
        UnreachableError, CouplingError: the experiment cannot run.
        MissingDependencyError, CompilationError: the compiled engine cannot be had, and why.
    """

    def __init__(
        self,
        experiment: Experiment,
        duration: float | None = None,
        dt: float = 1e-3,
        engine: str = "compiled",
        log_dt: float | None = None,
    ):
        self.engine = choice("engine", engine, ("pinocchio", "compiled"))
        self.duration, self.dt = experiment.duration if duration is None else duration, dt
        self.log_dt = log_dt
        run = self._plan(experiment, None)
        run.check()
        self._known = list(_paths(experiment))
        self._engine = _ready(run) if engine == "compiled" else find_engine(engine)

    def simulate(self, experiment: Experiment, control_period: float | None = None) -> Result:
        """Run a variation of the experiment.

        Whether its paths can be reached, and its plant fits, is looked at again only if it has other paths,
        arms or kinds of plant.

        Raises:
            see `Experiment.simulate`
        """
        run = self._plan(experiment, control_period)
        paths = list(_paths(experiment))
        if not _same(paths, self._known):
            run.check()
        return self._engine.run(run, None)

    def _plan(self, experiment: Experiment, control_period: float | None) -> Run:
        return experiment.plan(self.duration, self.dt, control_period, log_dt=self.log_dt)


def _ready(run: Run) -> Engine:
    """The compiled engine, which has loaded what a run needs and will keep what it tabulates."""
    from ..compiled.engine import Tables
    from ..compiled.run import Compiled

    engine = Compiled({}, Tables())
    engine.load(run)
    return engine


def _paths(experiment: Experiment) -> Iterator[Any]:
    """What decides whether desired motions can be reached, weights inverted, and the plant asked."""
    cell = experiment.cell
    yield from (cell.coupling, cell.space, experiment.plant_type)
    for member in cell.members:
        model = member.robot.model
        yield member.trajectory
        placements = [*model.jointPlacements, model.frames[member.robot.tip_id].placement]
        yield [placement.homogeneous.tolist() for placement in placements]


def _same(a: list[Any], b: list[Any]) -> bool:
    """Equal lists and identical objects."""
    pairs = zip(a, b, strict=True) if len(a) == len(b) else [(False, True)]
    return all(x is y or (isinstance(x, list) and x == y) for x, y in pairs)
