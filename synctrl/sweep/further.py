"""Measures that are not read off a run but found for its cell and gains, where a search asks for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType, NoneType
from typing import NamedTuple

from ..analysis.delay_margin import delay_margin
from ..checks import instance
from ..control.laws import SunMills, chosen
from ..errors import InputError, SynctrlError
from .factors import Setup
from .measures import Measure


class Further(NamedTuple):
    """A further column of a table: what it is, and how it is found."""

    measure: Measure
    find: Callable[[Setup], float]


def _delay_margin(setup: Setup) -> float:
    experiment = setup.experiment
    instance("law", experiment.law, (NoneType, SunMills), "SunMills, whose delay margin is known")
    if experiment.admittance is not None:
        raise InputError("the delay margin is that of a cell without an admittance", subject="admittance")
    margin = delay_margin(
        experiment.cell,
        experiment.gains,
        k_r_space=chosen(experiment.law, experiment.reference_acceleration, experiment.k_r_space).k_r_space,
        sensors=experiment.sensors,
        actuators=experiment.actuators,
        control_period=setup.control_period,
    )
    return min(float(margin.delay), setup.duration)


#: further measures, by their names
FURTHER: Mapping[str, Further] = MappingProxyType(
    {
        "delay_margin": Further(
            Measure(
                "smallest constant delay between the robots at which the cell, frozen where it starts, loses "
                "stability; at most the duration of a run, which stands for all longer ones and for none",
                "s",
            ),
            _delay_margin,
        )
    }
)


def further_values(names: Sequence[str], setup: Setup) -> list[float | None]:
    """Further measures of a run, in this order; None where there is none for such values.

    Args:
        names: of the measures.
        setup: the run.
    """
    return [_found(FURTHER[name], setup) for name in names]


def _found(further: Further, setup: Setup) -> float | None:
    try:
        return further.find(setup)
    except SynctrlError:
        return None
