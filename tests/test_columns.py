"""Columns of a sweep's factors are, bit for bit, the arrays that the engine has of changed experiments."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from hypothesis import given, settings
from hypothesis import strategies as st

from synctrl import Disturbance, Experiment
from synctrl.control.adaptation import Natural
from synctrl.errors import InputError, SynctrlError
from synctrl.experiments import mixed_four, planar_four
from synctrl.robots.friction import Friction
from synctrl.robots.parameters import FrictionParameters
from synctrl.sweep import (
    Factor,
    Grid,
    Sweep,
    Uniform,
    disturbance_scale,
    gain,
    gain_scale,
    initial_estimates,
    initial_positions,
    initial_velocities,
    model_error,
    true_parameters,
)
from synctrl.sweep.columns import Columns, held

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

VALUES = Uniform(0, 1)  # what a factor draws does not matter here
FACTORS = (
    *(
        make(name, VALUES)
        for make in (gain, gain_scale)
        for name in ("Lambda", "beta", "K_eps", "K_r", "Gamma")
    ),
    *(make(VALUES, robot) for make in (initial_estimates, model_error) for robot in (None, 1)),
    *(make(VALUES, *at) for make in (initial_positions, initial_velocities) for at in ((), (0,), (1, 1))),
    *(true_parameters(VALUES, *at) for at in ((), (0,), (None, 1), (1, 0))),
    disturbance_scale(VALUES),
    disturbance_scale(VALUES, 1),
)


def small() -> Experiment:
    """Two arms that know something of themselves, and two pushes."""
    cell = small_cell()
    members = [
        replace(member, theta_hat0=np.linspace(-1, 1, 20) + k) for k, member in enumerate(cell.members)
    ]
    pushes = [Disturbance(0, (1.0, 2.0), 0.002, 0.006), Disturbance(1, 0.3, 0.004, 0.008)]
    return Experiment(type(cell)(members, cell.coupling, cell.space), SMALL_GAINS, 0.01, pushes)


def rubbing() -> Experiment:
    """The same with friction that is adapted too."""
    start = small()
    friction, theta_hat0 = Friction((0.1, 0.2), 0.3), np.linspace(-1, 1, 24)
    members = [
        replace(m, friction=friction, parameters=FrictionParameters(m.robot), theta_hat0=theta_hat0)
        for m in start.cell.members
    ]
    return replace(start, cell=type(start.cell)(members, start.cell.coupling, start.cell.space))


EXPERIMENTS = {
    "small": small(),
    "rubbing": rubbing(),
    "mixed": replace(mixed_four(), disturbances=[Disturbance(k, 0.3, 0.1, 0.2 + k) for k in (1, 3)]),
    "four arms": planar_four(disturbance=[Disturbance(2, (1.0, -2.0), 0.1, 0.2)] * 2),
}


def arrays_of(experiment: Experiment) -> dict[str, np.ndarray]:
    """What the engine is given of an experiment that differs from run to run."""
    from synctrl.compiled.arrays import _carried, _constants
    from synctrl.compiled.kind import classify

    run = experiment.plan(0.01, 1e-3)
    classified = classify(run.loop)
    state = run.loop.state(run.loop.initial_state())
    found = _constants(run.loop, classified)
    bodies = max(kind.sizes["bodies"] for kind in classified.kinds)
    found |= {"pi": _carried(run.loop.plant, bodies), "disturbance": run.schedule.torques}
    return {**found, "q": state.q, "v": state.v, "z": state.z, "memory": state.memory}


def assert_same_bits(start: Experiment, chosen: list[tuple[Factor, list[float]]], count: int) -> np.ndarray:
    """Compare columns with the arrays of changed experiments; returns which runs are left out."""
    columns, base = Columns(start.plan(0.01, 1e-3), count), arrays_of(start)
    for factor, values in chosen:
        factor.columns(columns, np.array(values))
    found = columns.arrays()
    for row, run in enumerate(np.flatnonzero(~columns.left)):
        changed = start
        for factor, values in chosen:
            changed = factor.change(changed, values[run])
        for quantity, expected in arrays_of(changed).items():
            mine = found[quantity][row] if quantity in found else base[quantity]
            assert mine.tobytes() == np.ascontiguousarray(expected, dtype=float).tobytes(), quantity
    return columns.left


numbers = st.floats(-3, 3) | st.floats(0.5, 2) | st.sampled_from([0.0, -0.0, 1.0, 1e-3, 1e200, 1e308])
column = st.lists(numbers, min_size=3, max_size=3)


@settings(deadline=None, max_examples=50)
@given(
    name=st.sampled_from([*EXPERIMENTS]),
    chosen=st.lists(st.tuples(st.sampled_from(FACTORS), column), max_size=4),
)
def test_columns_are_the_arrays_of_the_changed_experiments(name, chosen):
    with np.errstate(over="ignore"), contextlib.suppress(SynctrlError):
        assert_same_bits(EXPERIMENTS[name], chosen, 3)


@pytest.mark.parametrize("factor", FACTORS, ids=lambda factor: factor.name)
@pytest.mark.parametrize("name", EXPERIMENTS)
def test_ordinary_values_are_never_left(factor, name):
    start = EXPERIMENTS[name]
    values = [math.sqrt(2), 0.9, math.pi / 3, 2.0]
    assert not assert_same_bits(start, [(factor, values), (factor, values[::-1])], 4).any()


@pytest.mark.parametrize(
    ("factor", "values"),
    [
        (gain("Lambda", VALUES), [1.0, 0.0, -1.0, 1.0]),
        (gain_scale("K_r", VALUES), [1.0, 0.0, -1.0, 1.0]),
        (gain("beta", VALUES), [0.0, -1e-300, -1.0, 1.0]),
        (true_parameters(VALUES), [1.0, 0.0, -1.0, 2.0]),
    ],
)
def test_values_that_an_experiment_refuses_are_left_alone(factor, values):
    columns = Columns(small().plan(0.01, 1e-3), 4)
    factor.columns(columns, np.array(values))
    columns.arrays()
    assert columns.left.tolist() == [False, True, True, False]
    for value, left in zip(values, columns.left, strict=True):
        if left:
            with pytest.raises(SynctrlError):
                factor.change(small(), value)


def test_numbers_that_run_over_are_left_alone():
    columns = Columns(small().plan(0.01, 1e-3), 2)
    with np.errstate(over="ignore"):
        for _ in range(2):
            gain_scale("K_eps", VALUES).columns(columns, np.array([1.0, 1e200]))
    assert len(columns.arrays()["K_eps"]) == 1
    assert columns.left.tolist() == [False, True]


def test_columns_speak_for_no_part_that_may_be_made_of_what_changes():
    cell = Sweep(small(), [model_error(Grid([0.5]))]).experiment(0).cell
    natural = replace(small(), cell=cell, adaptation=Natural(0.1), gains=SMALL_GAINS.replace(Gamma=None))
    assert "Lambda" in held(natural.closed_loop())
    for name in ("Gamma", "z", "pi", "q"):
        assert name not in held(natural.closed_loop())
        with pytest.raises(InputError):
            Columns(natural.plan(0.01, 1e-3), 2)[name]


def test_what_a_user_writes_has_no_columns_unless_they_are_given():
    assert Factor("own", VALUES, lambda experiment, value: experiment).columns is None
