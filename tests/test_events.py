"""What happens on the way through time: the method keeps its order, and events have their x- and x+."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from seams.catching_plant import Catching
from seams.posted_network import BoundPosted, Posted

from synctrl import Cell, Coupling, Cubic, Disturbance, Experiment, Gains, Member, Payload, Result, load_robot
from synctrl.assembly.body import CarriedObject
from synctrl.assembly.grasp import Fixture, Grasp
from synctrl.assembly.handling import HandlingPlant
from synctrl.simulation.advance import due
from synctrl.simulation.closed_loop import ClosedLoop
from synctrl.simulation.plant import Plant
from synctrl.simulation.result import LAYOUT

ARM = load_robot("planar2r")
GAINS = Gains(Lambda=4.0, beta=3.0, K_r=0.2, K_eps=0.2, Gamma=0.02)
END, PERIOD = 0.24, 8e-3


def pair(motion: float = 0.5, **parts) -> Experiment:
    """Two arms on cubics that end after so long."""
    paths = ([0.3, 1.0], [0.9, 0.5]), ([1.3, 1.0], [0.8, 0.7])
    members = [
        Member(ARM, Cubic(*path, motion), theta_hat0=0.5 * ARM.inertial_parameters, v0=[0.5, -0.4])
        for path in paths
    ]
    return replace(Experiment(Cell(members, Coupling.pair()), GAINS, END), **parts)


def pushed(start: float, stop: float) -> Experiment:
    return pair(disturbances=[Disturbance(0, (0.3, -0.2), start, stop)])


def loaded(start: float, stop: float, **parts) -> Experiment:
    return pair(payloads=[Payload(1, 0.4, (0.05, 0.0, 0.0), start=start, stop=stop)], **parts)


def catching(start: float, stop: float, **parts) -> Experiment:
    return loaded(start, stop, plant_type=Catching, **parts)


def handling(start: float, stop: float) -> Experiment:
    """Two arms that take hold of a plate where it lies, of which one lets go again."""
    soft = Fixture((40.0, 0.5), (0.5, 0.01))
    grasps = [Grasp(0, compliance=soft, since=0.05), Grasp(1, compliance=soft, since=start, until=stop)]
    plate = CarriedObject(0.4, (0.01, 0.02, 0.0), (2e-3, 3e-3, 4e-3))
    at = (0.35, 0.5, 0.0), np.eye(3)
    return pair(plant_type=partial(HandlingPlant, body=plate, grasps=grasps, at=at))


class Kicked(Plant):
    """A plant in which somebody kicks the robots, while nothing else changes."""

    events = (0.08, 0.1607)

    def meet(self, t, q, v, hidden):
        return q, v + 0.2, hidden


def everything() -> Experiment:
    push = [Disturbance(0, (0.3, -0.2), 0.08, 0.1507)]
    return replace(catching(0.08, 0.1613, network=Posted(0.0203)), disturbances=push)


SAMPLED, THIN, BOTH = {"control_period": PERIOD}, {"log_dt": 0.048}, ("pinocchio", "compiled")
#: each kind of event: what has it, how it is run, and the engines that know it
KINDS: dict[str, tuple[Callable[[], Experiment], dict, tuple[str, ...]]] = {
    "edges of disturbances on the grid": (lambda: pushed(0.08, 0.16), {}, BOTH),
    "edges of disturbances off the grid": (lambda: pushed(0.0803, 0.1607), {}, BOTH),
    "edges of loads on the grid": (lambda: loaded(0.08, 0.16), {}, BOTH),
    "edges of loads off the grid": (lambda: loaded(0.0803, 0.1607), {}, BOTH),
    "a break on the grid": (lambda: pair(0.2), {}, BOTH),
    "a break off the grid": (lambda: pair(0.2003), {}, BOTH),
    "samples": (pair, SAMPLED, BOTH),
    "samples and edges": (lambda: pushed(0.0803, 0.16), SAMPLED, BOTH),
    "instants of the log": (pair, THIN, BOTH),
    "catch and release on the grid": (lambda: catching(0.08, 0.16), {}, BOTH[:1]),
    "catch and release off the grid": (lambda: catching(0.0803, 0.1607), {}, BOTH[:1]),
    "catch and release between samples": (lambda: catching(0.0803, 0.1607), SAMPLED, BOTH[:1]),
    "grasp and letting go off the grid": (lambda: handling(0.0803, 0.1607), {}, BOTH[:1]),
    "kicks": (lambda: pair(plant_type=Kicked), {}, BOTH[:1]),
    "kicks between samples": (lambda: pair(plant_type=Kicked), SAMPLED, BOTH[:1]),
    "messages on the grid": (lambda: pair(network=Posted(0.024)), {}, BOTH[:1]),
    "messages off the grid": (lambda: pair(network=Posted(0.0203)), {}, BOTH[:1]),
    "messages to samples": (lambda: pair(network=Posted(0.0203)), SAMPLED, BOTH[:1]),
    "everything": (everything, {}, BOTH[:1]),
    "everything, sampled": (everything, SAMPLED, BOTH[:1]),
}
RUNS = [(kind, engine) for kind, (_, _, engines) in KINDS.items() for engine in engines]


def distance(run: Result, fine: Result) -> float:
    """Largest difference at the instants that both have."""
    every = (len(fine.t) - 1) // (len(run.t) - 1)
    names = ("q", "v", "theta_hat", "sync_integral")
    return max(np.abs(getattr(run, k) - getattr(fine, k)[::every]).max() for k in names)


@pytest.mark.parametrize(("kind", "engine"), RUNS, ids=[f"{kind}-{engine}" for kind, engine in RUNS])
def test_half_the_step_has_a_sixteenth_of_the_error_through(kind, engine):
    make, options, _ = KINDS[kind]
    if engine == "compiled":
        pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    fine = make().simulate(dt=2.5e-4, engine=engine, **options)
    errors = [distance(make().simulate(dt=dt, engine=engine, **options), fine) for dt in (4e-3, 2e-3, 1e-3)]
    assert errors[-1] > 1e-13  # not lost in rounding
    ratios = np.divide(errors[:-1], errors[1:])
    assert ((ratios > 13) & (ratios < 20)).all(), (errors, ratios)


# -- x- and x+ --------------------------------------------------------------------------------------------


def before(experiment: Experiment, t: float, **options) -> Result:
    """The run that ends where an event would fall, and so with x-."""
    return experiment.simulate(t, dt=1e-3, **options)


def row(run: Result, t: float) -> int:
    (k,) = np.flatnonzero(np.abs(run.t - t) < 1e-9)
    return int(k)


@pytest.mark.parametrize("options", [{}, SAMPLED, {"integrator": "DOP853"}], ids=["rk4", "sampled", "DOP853"])
def test_the_row_of_an_event_is_the_state_after_it_and_a_run_that_ends_there_has_the_one_before(options):
    experiment = catching(0.08, 0.16)
    run, until = experiment.simulate(dt=1e-3, **options), before(experiment, 0.08, **options)
    k, plant = row(run, 0.08), experiment.closed_loop().plant
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(run, name)[:k], getattr(until, name)[:-1])
    np.testing.assert_array_equal(run.q[k], until.q[-1])
    _, v, _ = plant.meet(0.08, until.q[-1], until.v[-1], np.zeros(0))
    np.testing.assert_array_equal(run.v[k], v)
    assert np.abs(v - until.v[-1]).max() > 0.01


def test_the_torque_of_the_row_is_that_of_the_state_after_the_event():
    experiment = catching(0.08, 0.16)
    run, until = experiment.simulate(dt=1e-3), before(experiment, 0.08)
    k, controller = row(run, 0.08), experiment.closed_loop().controller
    reference, motion = experiment.cell.references(run.t[[k]])[0], np.stack((run.q[k], run.v[k]))
    signals = controller.evaluate(reference, motion, run.theta_hat[k], run.sync_integral[k])
    np.testing.assert_array_equal(run.tau[k], signals.tau)
    assert np.abs(run.tau[k] - until.tau[-1]).max() > 0.01


def test_between_two_rows_an_event_happens_at_its_instant():
    run = catching(0.0805, 0.16).simulate(dt=1e-3)
    finer = catching(0.0805, 0.16).simulate(dt=5e-4)
    k = row(finer, 0.0805)
    jumps = np.abs(np.diff(finer.v[:, 1], axis=0)).max(axis=1)
    assert int(jumps.argmax()) == k - 1
    np.testing.assert_allclose(run.v, finer.v[::2], atol=1e-8)


def weighted(e: np.ndarray) -> np.ndarray:
    """c e of a pair, whose weights are 1 and -1."""
    return e * [[1.0], [-1.0]]


class Overheard(BoundPosted):
    """It writes down what was sent when."""

    def meet(self, t, w, memory):
        self.log.append((t, w.copy()))
        return super().meet(t, w, memory)


class Overhearing(Posted):
    def __init__(self, T):
        super().__init__(T)
        self.log = []

    def bind(self, cell):
        bound = Overheard(self.T, cell.coupling, cell.m)
        bound.log = self.log
        return bound


def test_at_one_instant_robots_catch_before_they_send():
    network = Overhearing(0.02)
    experiment = catching(0.08, 0.16, network=network)
    run = experiment.simulate(dt=1e-3)
    sent = {round(t, 9): w for t, w in network.log}
    assert sorted(sent) == pytest.approx(0.02 * np.arange(12))
    for t, (w, w_dot) in sent.items():
        k = row(run, t)
        np.testing.assert_array_equal(w, weighted(run.tracking_error[k]))
        desired = experiment.cell.references(run.t[[k]])[0].desired
        np.testing.assert_array_equal(w_dot, weighted(desired[1] - run.v[k]))


def test_what_was_heard_is_in_the_row_of_its_message_and_holds_until_the_next():
    run = pair(network=Posted(0.02)).simulate(dt=1e-3)
    heard = run.outputs["network_state"].reshape(len(run.t), -1, 2)[:, :2]
    for first, last in pairwise(range(0, len(run.t), 20)):
        np.testing.assert_array_equal(
            heard[first:last], np.broadcast_to(weighted(run.tracking_error[first]), (20, 2, 2))
        )
    np.testing.assert_array_equal(heard[-1], heard[-2])  # the message at the end belongs to what comes then


def test_with_sampled_control_a_message_arrives_at_the_first_sample_that_is_not_before_it():
    network = Overhearing(0.012)
    run = pair(network=network).simulate(dt=1e-3, **SAMPLED)
    heard = run.outputs["network_state"].reshape(len(run.t), -1, 2)[:, :2]
    changed = run.t[1:][(np.diff(heard, axis=0) != 0).any(axis=(1, 2))]
    due = np.unique(np.ceil(0.012 * np.arange(1, 21) / PERIOD - 1e-9) * PERIOD)
    np.testing.assert_allclose(changed, due)
    for t in due:
        np.testing.assert_array_equal(heard[row(run, t)], weighted(run.tracking_error[row(run, t)]))


@pytest.mark.parametrize("options", [{}, SAMPLED, {"integrator": "DOP853"}], ids=["rk4", "sampled", "DOP853"])
def test_until_the_end_of_a_run_the_plant_is_asked_with_the_loads_that_are_carried_then(options):
    asked = []

    class Telling(Plant):
        def move(self, q, v, tau, hidden):
            asked.append(self.robots)
            return super().move(q, v, tau, hidden)

    experiment = loaded(0.08, 0.16, plant_type=Telling)
    experiment.simulate(0.12, dt=1e-3, **options)
    expected = experiment.closed_loop().at(0.1).plant.robots[1].inertial_parameters
    np.testing.assert_array_equal(asked[-1][1].inertial_parameters, expected)


def test_from_the_edge_of_a_disturbance_on_its_torque_is_in_the_row():
    run = pushed(0.08, 0.16).simulate(dt=1e-3)
    acts = (run.t > 0.08 - 1e-9) & (run.t < 0.16 - 1e-9)
    np.testing.assert_array_equal((run.disturbance != 0).any(axis=(1, 2)), acts)


# -- the whole --------------------------------------------------------------------------------------------


def rate(t: float, y: np.ndarray, loop: ClosedLoop, push: np.ndarray) -> np.ndarray:
    return loop.evaluate(loop.cell.references(np.array([t]))[0], y, push)[0]


def by_definition(experiment: Experiment, end: float) -> np.ndarray:
    """The state at the end, from event to event by a method of high order."""
    loop, y = experiment.closed_loop(), experiment.closed_loop().initial_state()
    messages, cell = loop.messages.between(0.0, end), loop.cell
    pushes = [edge for d in experiment.disturbances for edge in (d.start, d.stop)]
    for a, b in pairwise(sorted({0.0, *loop.events, *loop.plant.schedule.edges, *messages, *pushes, end})):
        now, state, middle = loop.at(0.5 * (a + b)), loop.state(y), 0.5 * (a + b)
        push = np.zeros((cell.n, cell.nv))
        for d in experiment.disturbances:
            push[d.robot] += d.torque * (d.start < middle < d.stop)
        if a in loop.events:
            now.meet(a, state)
        if a in messages:
            reference = cell.references(np.array([a]))[0]
            state.memory[...] = loop.messages.received([a], reference, state.motion, state.memory)
        y = solve_ivp(rate, (a, b), y, "DOP853", args=(now, push), rtol=1e-12, atol=1e-13).y[:, -1]
    return y


@pytest.mark.parametrize(
    "options", [{}, {"integrator": "DOP853", "rtol": 1e-12, "atol": 1e-13}], ids=["rk4", "DOP853"]
)
def test_a_run_is_what_its_parts_between_events_are_one_after_the_other(options):
    experiment = everything()
    run, loop = experiment.simulate(dt=2.5e-4, **options), experiment.closed_loop()
    q, v, theta_hat, memory = loop.split(by_definition(experiment, END))
    expected = {
        "q": q,
        "v": v,
        "theta_hat": theta_hat,
        "sync_integral": loop.controller.network.integral(memory),
    }
    for name, part in expected.items():
        np.testing.assert_allclose(getattr(run, name)[-1], part, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("options", [{}, SAMPLED, {"integrator": "RK45"}], ids=["rk4", "sampled", "RK45"])
def test_bits_are_always_the_same_and_do_not_depend_on_what_is_logged(options):
    run, again = (everything().simulate(dt=1e-3, **options) for _ in range(2))
    assert run == again
    thin = everything().simulate(dt=1e-3, log_dt=0.016, **options)
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(thin, name), getattr(run, name)[::16], err_msg=name)


def test_an_event_that_changes_nothing_leaves_the_bits_of_a_run_alone():
    class Idle(Plant):
        events = (0.0, 0.08, 0.12)

    expected, found = pair().simulate(dt=1e-3), pair(plant_type=Idle).simulate(dt=1e-3)
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_an_agenda_has_every_instant_once_and_in_order():
    agenda = deque([0.0, 0.2, 0.2, 0.3])
    assert [due(agenda, t) for t in (0.1, 0.15, 0.2, 1.0, 2.0)] == [[0.0], [], [0.2, 0.2], [0.3], []]
