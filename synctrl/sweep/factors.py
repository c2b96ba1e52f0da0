"""Factors of a sweep: what is varied, where its values come from, and how a value changes the experiment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from types import NoneType
from typing import Any, NamedTuple

from ..checks import choice, count, instance, positive_number
from ..control.gains import Gains
from ..errors import InputError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from . import column_changes, variations
from .columns import ColumnChange, apart
from .distributions import Choice, Grid, Value, Values, is_part

Change = Callable[[Experiment, Any], Experiment]
GAINS = tuple(field.name for field in fields(Gains))


class Setup(NamedTuple):
    """An experiment and how it is run: duration and dt in s; control_period in s, or None."""

    experiment: Experiment
    duration: float
    dt: float
    engine: str
    control_period: float | None

    def __repr__(self) -> str:
        name = self.experiment.title or self.experiment.cell.name
        period = "" if self.control_period is None else f", control period {self.control_period:g} s"
        return f"{name}, {self.duration:g} s in steps of {self.dt:g} s, engine '{self.engine}'{period}"

    def simulate(self) -> Result:
        """Run it; see `Experiment.simulate`."""
        return self.experiment.simulate(
            self.duration, self.dt, engine=self.engine, control_period=self.control_period
        )


@dataclass(frozen=True, repr=False)
class Factor:
    """Something that differs from run to run.

    Args:
        name: its column in the table.
        values: a distribution or a `Grid`.
        change: a function of an experiment and a value that returns the changed experiment. It must be pure:
            leave the experiment it is given as it is, and depend on nothing else.
        columns: the same for many runs at once, as a change of columns of quantities, see `columns.py`; None
            if there is none, so that every run is made by itself.

    Raises:
        InputError: a name that is no word, values that are neither, or no function.
    """

    name: str
    values: Values
    change: Change
    columns: ColumnChange | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InputError.expected("a name", self.name, "factor")
        needed = ("describe",) if isinstance(self.values, Grid) else ("draw", "describe")
        if not all(callable(getattr(self.values, method, None)) for method in needed):
            raise InputError.expected(
                "a distribution, which has draw and describe, or a Grid", self.values, f"factor '{self.name}'"
            )
        if not callable(self.change):
            raise InputError.expected("a function", self.change, f"factor '{self.name}'")
        if self.columns is not None and not callable(self.columns):
            raise InputError.expected("a function or None", self.columns, f"factor '{self.name}', columns")

    def apply(self, setup: Setup, value: Value) -> Setup:
        """The setup with this factor at a value.

        Raises:
            InputError: the function returned something else than an experiment.
        """
        changed = self.change(setup.experiment, value)
        instance(f"factor '{self.name}': what its function returns", changed, Experiment, "an Experiment")
        return setup._replace(experiment=changed)

    def describe(self) -> dict[str, Any]:
        """Name, values and function, as plain data."""
        function = self.change.func if isinstance(self.change, partial) else self.change
        arguments = self.change.keywords if isinstance(self.change, partial) else {}
        plain = {
            key: value if isinstance(value, (int, float, str, NoneType)) else type(value).__qualname__
            for key, value in arguments.items()
        }
        name = getattr(function, "__qualname__", type(function).__qualname__)
        return {"name": self.name, "values": self.values.describe(), "change": name, "with": plain}

    def __repr__(self) -> str:
        return f"Factor({self.name!r}, {self.values!r})"


class _PeriodFactor(Factor):
    """The period of sampled control, which belongs to the run and not to the experiment."""

    def apply(self, setup: Setup, value: Value) -> Setup:
        return setup._replace(control_period=positive_number(self.name, value))


def gain(name: str, values: Values) -> Factor:
    """One number for all entries of the gain Lambda, beta, K_r, K_eps or Gamma, in its unit."""
    choice("gain", name, GAINS)
    columns = apart if name == "leak" else partial(column_changes.of_gain, gain=name)
    return Factor(name, values, partial(variations.with_gain, gain=name), columns)


def gain_scale(name: str, values: Values) -> Factor:
    """Factor by which all entries of a gain are multiplied."""
    choice("gain", name, GAINS)
    columns = apart if name == "leak" else partial(column_changes.of_scaled_gain, gain=name)
    return Factor(f"{name}_scale", values, partial(variations.with_scaled_gain, gain=name), columns)


def adaptation(values: Grid | Choice) -> Factor:
    """How the controller learns: listed adaptations, each of which takes the place of the gain Gamma."""
    return _part("adaptation", values)


def law(values: Grid | Choice) -> Factor:
    """Listed laws."""
    return _part("law", values)


def network(values: Grid | Choice) -> Factor:
    """Listed networks between the robots."""
    return _part("network", values)


def true_parameters(values: Values, robot: int | None = None, body: int | None = None) -> Factor:
    """Factor by which true masses and inertias are multiplied; the initial estimates stay what they are.

    Args:
        values: factors above 0.
        robot, body: which ones, counted from 0; by default all.
    """
    changes = variations.with_scaled_bodies, column_changes.of_scaled_bodies
    return indexed("true_parameters", values, *changes, robot=robot, body=body)


def initial_estimates(values: Values, robot: int | None = None) -> Factor:
    """Factor by which the initial estimates theta_hat(0) are multiplied."""
    changes = variations.with_scaled_estimates, column_changes.of_scaled_estimates
    return indexed("initial_estimates", values, *changes, robot=robot)


def model_error(values: Values, robot: int | None = None) -> Factor:
    """Relative error of the initial estimates: theta_hat(0) = (1 + value) theta; -1 is to know nothing."""
    changes = variations.with_model_error, column_changes.of_model_error
    return indexed("model_error", values, *changes, robot=robot)


def initial_positions(values: Values, robot: int | None = None, joint: int | None = None) -> Factor:
    """Angle (or length) that is added to initial joint positions, rad (or m)."""
    return _moved("initial_positions", values, "q0", robot, joint)


def initial_velocities(values: Values, robot: int | None = None, joint: int | None = None) -> Factor:
    """Velocity that is added to initial joint velocities, rad/s (or m/s)."""
    return _moved("initial_velocities", values, "v0", robot, joint)


def disturbance_scale(values: Values, disturbance: int = 0) -> Factor:
    """Factor by which the torque of one of the experiment's disturbances is multiplied."""
    change = partial(variations.with_scaled_disturbance, disturbance=disturbance)
    columns = partial(column_changes.of_scaled_disturbance, disturbance=disturbance)
    return Factor(_name("disturbance_scale", disturbance=disturbance or None), values, change, columns)


def disturbance_start(values: Values, disturbance: int = 0) -> Factor:
    """Instant at which one of the experiment's disturbances starts; it lasts as long as before, s."""
    change = partial(variations.with_disturbance_from, disturbance=disturbance)
    return Factor(_name("disturbance_start", disturbance=disturbance or None), values, change, apart)


def weights(values: Values, robot: int | None = None) -> Factor:
    """Factor by which the coupling's weights c_i are multiplied."""
    return indexed("weights", values, variations.with_scaled_weights, apart, robot=robot)


def control_period(values: Values) -> Factor:
    """Period of sampled control, multiples of the step, s."""
    return _PeriodFactor("control_period", values, _keep, apart)


def _part(name: str, values: Grid | Choice) -> Factor:
    """A factor whose values are parts of the controller; the table has their labels.

    Raises:
        InputError: no list of parts.
    """
    instance(name, values, (Grid, Choice), f"a Grid or a Choice of kinds of {name}")
    for value in values.meant.values():
        if not is_part(value):
            raise InputError.expected("parts with bind and as_dict", value, name)
    return Factor(name, values, partial(variations.with_part, part=name, meant=values.meant), apart)


def _moved(name: str, values: Values, quantity: str, robot: int | None, joint: int | None) -> Factor:
    """A factor that moves the start of joints."""
    change = partial(variations.with_moved_start, quantity=quantity)
    columns = partial(column_changes.of_moved_start, quantity=quantity)
    return indexed(name, values, change, columns, robot=robot, joint=joint)


def _keep(experiment: Experiment, value: Value) -> Experiment:
    return experiment


def indexed(
    name: str, values: Values, change: Change, columns: ColumnChange | None = None, **indices: int | None
) -> Factor:
    """A factor that concerns what has these indices, counted from 0; None stands for all of it."""
    if columns is not None and columns is not apart:
        columns = partial(columns, **indices)
    return Factor(_name(name, **indices), values, partial(change, **indices), columns)


def _name(name: str, **indices: int | None) -> str:
    """`name`, with the indices that are given: `true_parameters_robot0_body1`."""
    for what, index in indices.items():
        if index is not None:
            name += f"_{what}{count(what, index, least=0)}"
    return name
