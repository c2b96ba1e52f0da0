"""Study: one experiment, what is varied in it, and how it is run; whoever chooses the values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, TypedDict

import numpy as np

from ..analysis.metrics import Band, settling_bands
from ..checks import choice, count, instance, positive_number
from ..errors import InputError, SimulationError
from ..simulation.recorder import versions
from ..simulation.simulate import Experiment
from .description import checked_bands
from .factors import Factor, Setup
from .identity import describe_base
from .measures import MEASURES, definitions
from .prepared import Prepared
from .rows import columns
from .worker import Job


class StudyOptions(TypedDict, total=False):
    """How all runs of a sweep or a search are made: arguments of `Study`, which says what they mean."""

    seed: int
    duration: float | None
    dt: float
    engine: str
    control_period: float | None
    bands: Mapping[str, Band] | None


class Study:
    """What all runs of a sweep or a search share.

    Args:
        base: the experiment that is varied.
        factors: what differs from run to run; applied in this order.
        seed: whole number from 0.
        duration: s; by default the experiment's.
        dt: step, s.
        engine: "compiled" or "pinocchio", see `Experiment.simulate`.
        control_period: None for continuous control, or the period of sampled control, s.
        bands: settling bands by kind of error, in its unit; by default 5% of the largest error of the base
            experiment's run, which then has to run to its end.

    Raises:
        InputError: a value of the wrong kind, no factor, two factors of one name, or an adaptation and Gamma.
    """

    def __init__(
        self,
        base: Experiment,
        factors: Sequence[Factor],
        *,
        seed: int = 0,
        duration: float | None = None,
        dt: float = 1e-3,
        engine: str = "compiled",
        control_period: float | None = None,
        bands: Mapping[str, Band] | None = None,
    ):
        instance("base", base, Experiment, "an Experiment")
        duration = base.duration if duration is None else positive_number("duration", duration)
        choice("engine", engine, ("compiled", "pinocchio"))
        period = None if control_period is None else positive_number("control_period", control_period)
        self.base = Setup(base, duration, positive_number("dt", dt), engine, period)
        self.factors = _checked_factors(factors)
        self.seed = count("seed", seed, least=0)
        self._bands = None if bands is None else checked_bands(bands)

    def job(self, known: Mapping[str, Any] | None = None, keep_every: int | None = None) -> Job:
        """What workers are told; with the settling bands of a description that is there, if any."""
        if self._bands is None and known is not None:
            bands = checked_bands(known["settling_bands"])
        else:
            bands = self._found_bands
        return Job(self.base, self.factors, bands, keep_every)

    def about(self, job: Job, **more: Any) -> dict[str, Any]:
        """Everything that a row depends on, as plain data, and what its entries mean."""
        setup = self.base
        measured = definitions(setup.experiment.cell)
        return {
            "factors": [factor.describe() for factor in self.factors],
            "seed": self.seed,
            **more,
            "duration": setup.duration,
            "dt": setup.dt,
            "engine": setup.engine,
            "control_period": setup.control_period,
            "base": describe_base(setup),
            "settling_bands": {kind: np.asarray(band).tolist() for kind, band in job.bands.items()},
            "columns": job.columns,
            "measures": {name: measured[name]._asdict() for name in MEASURES},
            "versions": versions(),
        }

    def __repr__(self) -> str:
        factors = "".join(f"\n  {factor.name}: {factor.values!r}" for factor in self.factors)
        return f"Study of {self.base!r}, seed {self.seed}{factors}"

    @cached_property
    def _found_bands(self) -> dict[str, Band]:
        if self._bands is not None:
            return self._bands
        setup = self.base
        try:
            result = Prepared(*setup[:4]).simulate(setup.experiment, setup.control_period)
        except SimulationError as error:
            raise InputError(
                f"its own run stops, so there is no scale for settling times: {error}; give `bands`, "
                "or start from an experiment that runs to its end",
                subject="base",
            ) from error
        return settling_bands(result)


def _checked_factors(factors: Sequence[Factor]) -> tuple[Factor, ...]:
    for factor in factors:
        instance("factors", factor, Factor, "Factor objects")
    names = [factor.name for factor in factors]
    taken = [name for name in names if names.count(name) > 1 or name in columns(())]
    if taken:
        raise InputError(
            f"the name '{taken[0]}' is taken; give each column a name of its own", subject="factors"
        )
    if not names:
        raise InputError("expected at least one, found none", subject="factors")
    varied = {"Gamma", "Gamma_scale"} & {*names}
    if "adaptation" in names and varied:
        raise InputError(
            "an adaptation takes the place of the gain Gamma, so expected one of the two, found "
            f"'adaptation' and '{min(varied)}'",
            subject="factors",
        )
    return tuple(factors)
