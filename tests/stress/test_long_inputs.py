"""Long versions: derivatives of all sizes and rates, parameters of many pairs of robots, rows of gains."""

from __future__ import annotations

import itertools

import numpy as np
from machines import random_robot
from motions import random_sines

from synctrl import Cell, Coupling, Friction, FullParameters, Hold, Member, Robot, load_robot
from synctrl.coupling.reachability import check_motions
from synctrl.errors import InputError
from synctrl.robots.catalog import CATALOG

CASES = 20_000


def test_no_right_derivative_is_called_wrong(record_property) -> None:
    alarms = sum(random_sines(seed).misfit() is not None for seed in range(CASES))
    record_property("figure", f"{alarms} false alarms for {CASES} right derivatives")
    assert alarms == 0


def test_wrong_derivatives_are_found(record_property) -> None:
    factors = (1.05, 0.5, -1.0, 0.0, 2 * np.pi)
    missed = 0
    for seed in range(CASES):
        case = random_sines(seed, least=1e-4)
        chosen = np.where(np.arange(case.size) == seed % case.size, factors[seed % 5], 1.0)
        missed += case.spoilt(lambda t, derivative, f=chosen: f * derivative).misfit() is None
    record_property("figure", f"{CASES - missed} of {CASES} wrong derivatives found")
    assert missed <= CASES // 1000


def accepted(robot: Robot, other: Robot) -> bool:
    still = Hold(np.zeros(robot.nv))
    try:
        Cell(
            [Member(robot, still), Member(robot, still, parameters=FullParameters(other))],
            Coupling.pair(),
        )
    except InputError:
        return False
    return True


def test_parameters_are_taken_for_their_own_robot_alone(record_property) -> None:
    rng, own, foreign = np.random.default_rng(0), 0, 0
    for seed in range(1000):
        robot, other = random_robot(seed, 3), random_robot(seed + 10_000, 3)
        own += accepted(robot, robot.placed(name="again"))
        tilted = robot.placed(rpy=rng.uniform(0.2, 1.0, 3))
        foreign += accepted(robot, other) + (accepted(robot, tilted) and bool(feels(robot, tilted)))
    record_property("figure", f"{own} of 1000 own parameters taken, {foreign} of 2000 foreign ones")
    assert own == 1000
    assert foreign == 0


def feels(robot: Robot, other: Robot) -> bool:
    """Whether gravity tells the two apart, as it does not for joints that only slide across it."""
    states = np.random.default_rng(1).uniform(-2, 2, (20, robot.nv))
    return any(np.abs(robot.gravity(q) - other.gravity(q)).max() > 1e-6 for q in states)


def test_robots_of_the_catalogue_are_told_apart(record_property) -> None:
    robots = [load_robot(name) for name in CATALOG]
    # a robot with limits to its joints is the same robot
    kinds = [(robot.nv, robot.name.removesuffix("_limited")) for robot in robots]
    pairs = [
        (robots[i], robots[j])
        for i, j in itertools.permutations(range(len(robots)), 2)
        if kinds[i][0] == kinds[j][0] and kinds[i][1] != kinds[j][1]
    ]
    taken = [(a.name, b.name) for a, b in pairs if accepted(a, b)]
    record_property("figure", f"{len(pairs) - len(taken)} of {len(pairs)} pairs of ready robots told apart")
    assert not taken


def test_long_and_short_runs_of_ready_motions_raise_no_alarm(record_property) -> None:
    from synctrl.experiments import a460_pair, planar_four

    count = 0
    for experiment in (planar_four(), a460_pair(), a460_pair(adapt_friction=True)):
        for stop in (1e-3, 0.01, 0.1, 1.0, 10.0, 100.0, 1e4):
            check_motions(experiment.cell, np.linspace(0, stop, 11))
            count += experiment.cell.n
    record_property("figure", f"{count} ready motions without an alarm")


def test_friction_of_many_sizes_is_compared(record_property) -> None:
    rng, refused = np.random.default_rng(0), 0
    for _ in range(1000):
        viscous, coulomb = rng.uniform(0.1, 10, (2, 3))
        one, factor = Friction(viscous, coulomb), 1 + rng.choice([-1, 1]) * 10 ** rng.uniform(-12, 0)
        refused += not one.equals(Friction(factor * viscous, coulomb))
    record_property("figure", f"{refused} of 1000 frictions that differ told apart")
    assert refused == 1000
