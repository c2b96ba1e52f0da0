"""The digital controller: what sampled simulation runs, what it refuses, and what it remembers."""

from __future__ import annotations

import pickle
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cells import SMALL_GAINS, random_experiment, small_cell
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from seams.leaky_adaptation import BoundLeaky, Leaky
from seams.posted_network import Posted

from synctrl import (
    CartesianSpace,
    Cell,
    Controller,
    Coupling,
    Cubic,
    DiscreteController,
    Experiment,
    Gains,
    Member,
    Payload,
    Result,
    load_robot,
)
from synctrl.control.adaptation import Natural
from synctrl.errors import (
    InputError,
    NonFiniteError,
    OrientationError,
    ResultError,
    SingularJacobianError,
    SynctrlError,
)
from synctrl.experiments import (
    a460_full_pair,
    a460_pair,
    mixed_four,
    mobile_robot,
    panda_four,
    planar_four,
    rigid_object,
    ur5_payload,
)
from synctrl.simulation.plant import Plant
from synctrl.simulation.result import LAYOUT
from synctrl.tasks import rotations

PERIOD = 4e-3


def learning(experiment: Experiment, adaptation: object) -> Experiment:
    """An experiment with another adaptation."""
    return replace(experiment, gains=replace(experiment.gains, Gamma=None), adaptation=adaptation)


def weak() -> Experiment:
    """Two arms, of which the second is asked for more than its motors can give."""
    arm = load_robot("planar2r").placed((0.0, 0.0, 0.0), (1.2, 0.0, 0.0))
    paths = [Cubic([0.3, 1.0], [0.3 + way, 1.0 + way], 0.5) for way in (0.0, 60.0)]
    cell = Cell([Member(arm, path, theta_hat0=arm.inertial_parameters) for path in paths], Coupling.pair())
    return Experiment(cell, Gains(10.0, 5.0, 4.0, 2.0, 0.5), 0.1, saturate=True)


class Bounded(Leaky):
    """Estimates that move by no more than a little, once in a period."""

    def bind(self, cell: Cell) -> BoundLeaky:
        return BoundBounded(self.Gamma, self.nu, cell.theta_hat0)


class BoundBounded(BoundLeaky):
    def settle(self, z):
        return self.theta_hat0 + 1e-5 * np.tanh((z - self.theta_hat0) / 1e-5)


#: every ready cell, and whatever else a run may have
CELLS: dict[str, Callable[[], Experiment]] = {
    "four planar arms": planar_four,
    "four planar arms, disturbed": lambda: planar_four(disturbance="torque"),
    "four planar arms, damped in task space": lambda: planar_four(k_r_space="task"),
    "two A460": a460_pair,
    "two A460, (13) as printed": lambda: a460_pair(friction=False, reference_acceleration="paper"),
    "two A460, natural adaptation": lambda: learning(a460_pair(), Natural(0.1)),
    "two A460, an adaptation of one's own": lambda: learning(a460_pair(), Leaky(0.3, 0.1)),
    "two A460, bounded estimates": lambda: learning(a460_pair(), Bounded(0.3, 0.1)),
    "two A460 that post messages": lambda: replace(a460_pair(), network=Posted(6e-3)),
    "two arms, saturated": weak,
    "two A460 with a payload": lambda: replace(a460_pair(), payloads=[Payload(0, 3.0, start=0.013)]),
    "two six-joint A460": a460_full_pair,
    "two UR5": ur5_payload,
    "four Pandas": panda_four,
    "mixed cell": mixed_four,
    "a rigid object": rigid_object,
    "a vehicle": mobile_robot,
    "moving weights": lambda: random_experiment(3),
}
#: what the compiled engine refuses by name
INTERPRETED = {
    "two A460 that post messages": ("network", "BoundPosted"),
    "two six-joint A460": ("plant", "HeldJointsPlant"),
    "moving weights": ("robot", "random"),
}


def small(**options: object) -> Experiment:
    return Experiment(small_cell(), SMALL_GAINS, 0.2, **options)


def started(faults: str = "error", experiment: Experiment | None = None, **options: object):
    """A controller that waits for its first sample, and a state to give it."""
    experiment = experiment or small()
    controller = experiment.controller(PERIOD, faults=faults, **options)
    q, v = experiment.cell.q0, experiment.cell.v0
    controller.reset(0.0, q, v)
    return controller, q, v


def assert_same_state(a: DiscreteController, b: DiscreteController) -> None:
    for name, array in a.state.items():
        np.testing.assert_array_equal(b.state[name], array, err_msg=name)


# -- sampled simulation is this object in a loop ----------------------------------------------------------


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", CELLS)
def test_a_loop_of_ones_own_gives_the_torques_of_sampled_simulation_bit_for_bit(name):
    experiment = CELLS[name]()
    run = experiment.simulate(0.04, control_period=PERIOD)
    controller = experiment.controller(PERIOD)
    controller.reset(0.0, run.q[0], run.v[0])
    assert len(run.t) == 41
    for k in range(0, len(run.t), 4):
        theta_hat = controller.controller.adaptation.estimate(controller.z)
        np.testing.assert_array_equal(theta_hat, run.theta_hat[k])
        np.testing.assert_array_equal(controller.sync_integral, run.sync_integral[k])
        tau = controller.step(run.t[k], run.q[k], run.v[k])
        assert controller.signals is not None
        np.testing.assert_array_equal(controller.signals.tau, run.tau[k])
        np.testing.assert_array_equal(controller.signals.epsilon, run.sync_error[k])
        np.testing.assert_array_equal(tau, run.outputs.get("applied_torque", run.tau)[k])
    assert ("applied_torque" in run.outputs) == experiment.saturate
    if experiment.saturate:
        assert (run.outputs["applied_torque"] != run.tau).any()


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("period", [None, PERIOD], ids=["continuous", "sampled"])
@pytest.mark.parametrize("name", sorted(CELLS))
def test_the_compiled_engine_agrees_or_refuses_the_part_by_name(name, period):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment, options = CELLS[name](), {"duration": 0.04, "control_period": period}
    if name in INTERPRETED:
        with pytest.raises(SynctrlError) as caught:
            experiment.simulate(engine="compiled", **options)
        part, word = INTERPRETED[name]
        assert part in caught.value.subject and word in f"{caught.value.subject} {caught.value.found}"
        return
    runs = [experiment.simulate(engine=engine, **options) for engine in ("pinocchio", "compiled")]
    for array in LAYOUT:
        expected, found = (getattr(run, array) for run in runs)
        assert np.abs(found - expected).max() <= 1e-9 * (np.abs(expected).max() + 1e-12), array


def test_what_an_adaptation_makes_of_its_state_is_made_once_a_period():
    experiment = CELLS["two A460, bounded estimates"]()
    run = experiment.simulate(0.04, control_period=PERIOD)
    moved = np.abs(run.theta_hat - run.theta_hat[0]).max(axis=(1, 2))
    assert 0.9e-5 < moved[::4].max() < 1.001e-5 < moved.max()


def on_the_way(run: Result, state: np.ndarray, every: int) -> None:
    """A state is on a straight line from each sample to the next."""
    share = np.arange(every)[:, None, None] / every
    for k in range(0, len(run.t) - every, every):
        line = state[k] + share * (state[k + every] - state[k])
        np.testing.assert_allclose(state[k : k + every], line, atol=1e-14 * np.abs(state).max())


def test_between_samples_estimates_and_integrals_are_on_their_way():
    run = planar_four().simulate(0.04, control_period=PERIOD)
    on_the_way(run, run.theta_hat, 4)
    on_the_way(run, run.sync_integral, 4)
    assert (run.theta_hat[1] != run.theta_hat[0]).any() and (run.sync_integral[1] != 0).any()


def test_what_is_desired_may_be_given_at_every_sample():
    for experiment in (planar_four(), ur5_payload(), small()):
        (one, q, v), (other, _, _) = started(experiment=experiment), started(experiment=experiment)
        for k in range(5):
            t = k * PERIOD
            desired = experiment.cell.references(np.array([t]))[0].desired
            np.testing.assert_array_equal(one.step(t, q, v, desired), other.step(t, q, v))
        moved = one.step(5 * PERIOD, q, v, desired + 1e-3)
        assert (moved != other.step(5 * PERIOD, q, v)).any()


# -- what goes to the motors ------------------------------------------------------------------------------


def test_torque_is_cut_off_at_the_limits_and_only_there():
    experiment = weak()
    (cut, q, v), (whole, _, _) = (
        started(experiment=experiment),
        started(experiment=replace(weak(), saturate=False)),
    )
    limits = experiment.closed_loop().plant.torque_limits
    asked = whole.step(0.0, q, v)
    assert (np.abs(asked) > limits).any() and (np.abs(asked) < limits).any()
    np.testing.assert_array_equal(cut.step(0.0, q, v), np.clip(asked, -limits, limits))
    np.testing.assert_array_equal(cut.signals.tau, asked)


@pytest.mark.parametrize("make", [weak, mixed_four, ur5_payload])
def test_a_robot_that_carries_its_own_weight_gets_the_rest(make):
    experiment = make()
    (whole, q, v), (rest, _, _) = (
        started(experiment=experiment, include_gravity=own) for own in (True, False)
    )
    gravity = np.zeros(q.shape)
    for row, robot, q_i in zip(gravity, experiment.cell.robots, q, strict=True):
        row[: robot.nv] = robot.gravity(q_i[: robot.nv])
    assert gravity.any()
    tau = whole.step(0.0, q, v)
    np.testing.assert_array_equal(rest.step(0.0, q, v), tau - gravity)


def test_joints_that_a_robot_does_not_have_get_no_torque():
    controller, q, v = started(experiment=mixed_four())
    tau = controller.step(0.0, q, v)
    absent = np.arange(q.shape[1]) >= np.array([[robot.nv] for robot in controller.cell.robots])
    assert absent.any() and not tau[absent].any()


def test_what_is_returned_and_what_is_given_belong_to_the_caller():
    (controller, q, v), (other, _, _) = started(), started()
    mine = q.copy()
    tau = controller.step(0.0, mine, v)
    np.testing.assert_array_equal(tau, other.step(0.0, q, v))
    tau[...], mine[...] = 7.0, 7.0
    controller.state["z"][...] = 7.0
    np.testing.assert_array_equal(controller.step(PERIOD, q, v), other.step(PERIOD, q, v))
    assert_same_state(controller, other)


# -- faults -----------------------------------------------------------------------------------------------


def spoiled(array: np.ndarray, value: float) -> np.ndarray:
    array = array.copy()
    array[1, 0] = value
    return array


#: time in periods, number in q, number in v
FAULTS = {
    "nan in q": (1.0, np.nan, 0.0),
    "inf in v": (1.0, 1.0, np.inf),
    "early": (0.7, 1.0, 0.0),
    "twice": (0.0, 1.0, 0.0),
    "backwards": (-3.0, 1.0, 0.0),
    "late": (1.4, 1.0, 0.0),
    "one missed": (2.0, 1.0, 0.0),
    "five missed": (6.0, 1.0, 0.0),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_refused_and_leaves_the_controller_as_it_was(name):
    when, position, speed = FAULTS[name]
    (controller, q, v), (other, _, _) = started(), started()
    for each in (controller, other):
        each.step(0.0, q, v)
    expected = {"subject": "t", "found": when * PERIOD}
    if "in" in name.split():
        expected = {"subject": name[-1], "robot": 1}
    with refused(InputError, **expected):
        controller.step(when * PERIOD, spoiled(q, position), spoiled(v, speed))
    assert_same_state(controller, other)
    np.testing.assert_array_equal(controller.step(PERIOD, q, v), other.step(PERIOD, q, v))


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_held_where_the_user_chose_so(name):
    when, position, speed = FAULTS[name]
    controller, q, v = started("hold")
    tau = controller.step(0.0, q, v)
    known = controller.state
    again = controller.step(when * PERIOD, spoiled(q, position), spoiled(v, speed))
    if "missed" in name:  # the call itself is a good sample
        assert controller.held == round(when) - 1 and (again != tau).any()
        return
    np.testing.assert_array_equal(again, tau)
    assert controller.held == 1
    for learnt in ("z", "sync_integral"):
        np.testing.assert_array_equal(controller.state[learnt], known[learnt])
    after = 2 if when >= 1 else 1
    assert (controller.step(after * PERIOD, q, v) != tau).any() and controller.held == 1


def test_periods_that_were_missed_teach_nothing():
    (gap, q, v), (other, _, _) = started("hold"), started("hold")
    gap.step(0.0, q, v), other.step(0.0, q, v)
    gap.step(4 * PERIOD, q, v)
    for k in (1, 2, 3):
        other.step(k * PERIOD, np.full(q.shape, np.nan), v)
    other.step(4 * PERIOD, q, v)
    assert gap.held == other.held == 3
    assert_same_state(gap, other)


@given(st.lists(st.tuples(st.floats(-5, 30), st.sampled_from([0.0, np.nan, np.inf])), max_size=12))
def test_where_faults_are_held_every_call_has_a_torque_and_the_next_sample_is_taken(calls):
    controller, q, v = started("hold")
    controller.step(0.0, q, v)
    good = 1
    for periods, number in calls:
        known = controller.state
        assert np.isfinite(controller.step(periods * PERIOD, q, v + number)).all()
        taken = (controller.state["z"] != known["z"]).any()
        good += taken
        assert taken or controller.held > known["held"]
        assert controller.state["samples"] >= known["samples"]
        assert controller.state["samples"] <= good + controller.held
    known = controller.state
    controller.step(float(known["samples"]) * PERIOD, q, v)
    assert (controller.state["z"] != known["z"]).any() and controller.held == known["held"]


def test_a_message_is_heard_at_its_sample_and_one_of_a_missed_period_is_lost():
    controller, q, v = started("hold", small(network=Posted(2.5 * PERIOD)))
    q = q + 0.1

    def heard() -> np.ndarray:
        return controller.heard(0.0, np.stack((q, v)))[: len(q)]

    assert heard().any()  # those of the first instant are there at once
    for k, due in enumerate([True, False, False, True, False, True]):  # at 0, 2.5 and 5 periods
        assert ((heard() != controller.memory[: len(q)]).any()) == due
        q = q + 0.01
        controller.step(k * PERIOD, q, v)
    then = controller.memory[: len(q)].copy()
    controller.step(9 * PERIOD, q + 1.0, v)  # after the period of the message at 7.5
    np.testing.assert_array_equal(controller.memory[: len(q)], then)


def test_before_the_first_sample_there_is_nothing_to_hold():
    controller, q, v = started("hold")
    for t, position in ((0.0, np.nan), (2 * PERIOD, 1.0)):
        with pytest.raises(InputError):
            controller.step(t, spoiled(q, position), v)
    controller.step(0.0, q, v)


@given(st.floats(-0.099, 0.099), st.floats(0, 100))
def test_a_call_may_come_a_tenth_of_a_period_off_the_grid(off, start):
    controller, q, v = started()
    controller.reset(start, q, v)
    for k in range(3):
        controller.step(start + (k + off) * PERIOD, q, v)
    assert controller.held == 0 and controller.state["samples"] == 3


@pytest.mark.parametrize("faults", ["error", "hold"])
@pytest.mark.parametrize("t", [np.nan, np.inf, -np.inf, 1e300, -1e300, "0", None, [0.0], True, 1j])
def test_a_time_that_is_none_is_refused_always(faults, t):
    controller, q, v = started(faults)
    controller.step(0.0, q, v)
    known = controller.state
    with refused(InputError, "t"):
        controller.step(t, q, v)
    assert all((controller.state[name] == array).all() for name, array in known.items())


@pytest.mark.parametrize("faults", ["error", "hold"])
@pytest.mark.parametrize(
    "bad", [None, "two", [1.0, 2.0], np.zeros((2, 3)), np.zeros((2, 2), complex), [[1], [2, 3]]]
)
def test_arrays_of_another_shape_or_kind_are_refused_always(faults, bad):
    controller, q, v = started(faults)
    controller.step(0.0, q, v)
    for name, arguments in {"q": (bad, v), "v": (q, bad)}.items():
        with refused(InputError, name):
            controller.step(PERIOD, *arguments)
    if bad is not None:
        with refused(InputError, "desired"):
            controller.step(PERIOD, q, v, bad)
    with refused(InputError, "q"):
        controller.reset(0.0, bad, v)
    controller.step(PERIOD, q, v)


@pytest.mark.parametrize(
    "options",
    [
        {"period": 0.0},
        {"period": np.nan},
        {"faults": "ignore"},
        {"include_gravity": 1},
        {"torque_limits": 3.0},
        {"torque_limits": "a"},
        {"torque_limits": np.full((2, 2), -1.0)},
        {"torque_limits": np.full((2, 2), np.nan)},
    ],
)
def test_options_that_mean_nothing_are_refused_by_name(options):
    controller = small().closed_loop().controller
    with refused(InputError, next(iter(options))):
        DiscreteController(controller, **{"period": PERIOD, **options})
    with refused(InputError, "controller"):
        DiscreteController(small(), PERIOD)


def test_a_singular_jacobian_is_an_error_as_in_a_simulation():
    strict = Cell(small_cell().members, Coupling.pair(), CartesianSpace("xy", max_condition=50))
    controller, q, v = started(experiment=Experiment(strict, SMALL_GAINS, 0.1))
    controller.step(0.0, q, v)
    known = controller.state
    for angle in (1e-3, 0.0):  # nearly stretched out, and quite
        stretched = q.copy()
        stretched[1, 1] = angle
        with refused(SingularJacobianError, "condition", robot=1, time=PERIOD) as caught:
            controller.step(PERIOD, stretched, v)
        assert not caught.value.found < 50
    assert all((controller.state[name] == array).all() for name, array in known.items())


def test_an_orientation_error_near_half_a_turn_is_an_error_as_in_a_simulation():
    experiment = ur5_payload()
    controller, q, v = started(experiment=experiment)
    controller.step(0.0, q, v)
    known = controller.state
    turned = experiment.cell.reference_table(np.array([PERIOD])).desired[0].copy()
    R = rotations.exp(turned[0, 1, 3:])
    turned[0, 1, 3:] = rotations.log(R @ rotations.exp(np.array([0.0, 0.0, 3.1])))
    with refused(OrientationError, "orientation", robot=1, time=PERIOD):
        controller.step(PERIOD, q, v, turned)
    assert all((controller.state[name] == array).all() for name, array in known.items())


def test_a_torque_that_is_not_finite_is_an_error_and_changes_nothing():
    controller, q, v = started()
    controller.step(0.0, q, v)
    known = controller.state
    with refused(NonFiniteError, time=PERIOD):
        controller.step(PERIOD, q, np.full(v.shape, 1e300))
    assert all((controller.state[name] == array).all() for name, array in known.items())


def test_a_part_that_fails_when_the_torque_is_known_changes_nothing(monkeypatch):
    controller, q, v = started("hold", learning(small(), Leaky(0.1, 0.1)))
    controller.step(0.0, q, v)
    known = controller.state
    monkeypatch.setattr(controller.controller.adaptation, "settle", lambda z: z[:, 10_000])
    with pytest.raises(IndexError):
        controller.step(3 * PERIOD, q + 0.1, v)
    assert all((controller.state[name] == array).all() for name, array in known.items())


# -- memory -----------------------------------------------------------------------------------------------


def drive(
    controller: DiscreteController, plant: Plant, state: np.ndarray, samples: range
) -> list[np.ndarray]:
    """Torques and states of a plant in a loop of one's own, from one sample on to another."""
    seen = []
    for k in samples:
        tau = controller.step(k * PERIOD, *state)
        for _ in range(4):
            v = state[1] + PERIOD / 4 * plant.acceleration(*state, tau)
            state = np.stack((state[0] + PERIOD / 4 * v, v))
        seen += [tau, *state]
    return seen


CONTINUED = {
    "gradient": small,
    "natural": lambda: learning(a460_pair(), Natural(0.1)),
    "poses": ur5_payload,
    "messages": lambda: small(network=Posted(2.5 * PERIOD)),
}


@pytest.mark.parametrize("name", CONTINUED)
@given(split=st.integers(0, 12))
def test_a_run_that_is_stopped_saved_loaded_and_continued_is_equal_bit_for_bit(name, split, tmp_path_factory):
    experiment = CONTINUED[name]()
    plant, start = experiment.closed_loop().plant, np.stack((experiment.cell.q0, experiment.cell.v0))
    whole = drive(started(experiment=experiment)[0], plant, start, range(12))
    first, _, _ = started(experiment=experiment)
    before = drive(first, plant, start, range(split))
    path = first.save(tmp_path_factory.mktemp("state") / "controller.npz")
    second = CONTINUED[name]().controller(PERIOD)
    second.load(path)
    assert_same_state(first, second)
    at = np.stack(before[-2:]) if before else start
    for expected, found in zip(whole, [*before, *drive(second, plant, at, range(split, 12))], strict=True):
        np.testing.assert_array_equal(found, expected)


def test_what_is_held_continues_too(tmp_path):
    controller, q, v = started("hold")
    tau = controller.step(0.0, q, v)
    controller.step(PERIOD, q * np.nan, v)
    other, _, _ = started("hold")
    other.load(controller.save(tmp_path / "state.npz"))
    assert other.held == 1 and other.signals is None
    np.testing.assert_array_equal(other.step(2 * PERIOD, q, v * np.nan), tau)


def test_a_reset_forgets_everything():
    controller, q, v = started()
    fresh, _, _ = started()
    for k in range(3):
        controller.step(k * PERIOD, q, v)
    controller.reset(0.0, q, v)
    assert_same_state(controller, fresh)
    assert controller.signals is None


def other_state(change: Callable[[dict], object]) -> dict:
    state = started()[0].state
    change(state)
    return state


WRONG = {
    "no mapping": lambda: [1, 2],
    "an array less": lambda: other_state(lambda s: s.pop("z")),
    "an array more": lambda: other_state(lambda s: s.update(more=np.zeros(2))),
    "names of another kind": lambda: other_state(lambda s: s.update({3: s.pop("z")})),
    "another size": lambda: other_state(lambda s: s.update(z=np.zeros((2, 3)))),
    "not finite": lambda: other_state(lambda s: s.update(tau=np.full((2, 2), np.nan))),
    "another period": lambda: other_state(lambda s: s.update(period=1e-3)),
    "half a sample": lambda: other_state(lambda s: s.update(samples=0.5)),
    "fewer than no samples": lambda: other_state(lambda s: s.update(samples=-1.0)),
    "more than can be counted": lambda: other_state(lambda s: s.update(held=1e300)),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_state_of_something_else_is_refused_whole(name):
    (controller, q, v), (other, _, _) = started(), started()
    controller.step(0.0, q, v), other.step(0.0, q, v)
    with refused(InputError) as caught:
        controller.state = WRONG[name]()
    assert caught.value.subject.split(",")[0] == "state"
    assert_same_state(controller, other)


class Bomb:
    """Would leave a trace if it was unpickled."""

    def __reduce__(self) -> tuple:
        return Path.touch, (Path("exploded"),)


def files(folder: Path) -> dict[str, Path]:
    """Files that hold no state of the small cell's controller."""
    state, made = started()[0].state, {}
    contents: dict[str, dict] = {
        "another cell": started(experiment=planar_four())[0].state,
        "an array less": {name: array for name, array in state.items() if name != "z"},
        "whole numbers": {**state, "z": state["z"].astype(int)},
        "columns first": {**state, "z": np.asfortranarray(state["z"])},
        "turned round": {**state, "z": state["z"].T},
        "objects": {**state, "z": np.array([[Bomb()]], dtype=object)},
        "not finite": {**state, "z": state["z"] * np.nan},
        "another period": {**state, "period": 2 * state["period"]},
        "large": {**state, "more": np.zeros(10**6)},
    }
    for name, content in contents.items():
        made[name] = folder / f"{name}.npz"
        np.savez(made[name], **content)
    made["squeezed"] = folder / "squeezed.npz"
    np.savez_compressed(made["squeezed"], **{**state, "z": np.zeros((10**4, 10))})
    for name, data in (("empty", b""), ("text", b"z = 1"), ("pickle", pickle.dumps(Bomb()))):
        made[name] = folder / name
        made[name].write_bytes(data)
    return {**made, "nothing": folder / "nothing.npz", "a folder": folder}


def test_a_file_that_holds_anything_else_is_refused_and_changes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (controller, q, v), (other, _, _) = started(), started()
    controller.step(0.0, q, v), other.step(0.0, q, v)
    for name, path in files(tmp_path).items():
        with pytest.raises(ResultError) as caught:
            controller.load(path)
        assert str(path) in str(caught.value), name
        assert_same_state(controller, other)
    assert not Path("exploded").exists()
    with refused(InputError, "path"):
        controller.load(3)


@given(data=st.data())
def test_a_damaged_file_is_refused_or_is_the_state(data, tmp_path_factory):
    controller, q, v = started()
    controller.step(0.0, q, v)
    path = controller.save(tmp_path_factory.mktemp("state") / "state.npz")
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(
        content[: data.draw(st.integers(0, len(content)))] if data.draw(st.booleans()) else content
    )
    other, _, _ = started()
    try:
        other.load(path)
    except ResultError:
        assert_same_state(other, started()[0])
    else:
        assert_same_state(other, controller)


def test_a_state_that_cannot_be_written_is_an_error_and_leaves_nothing(tmp_path):
    controller, _, _ = started()
    for path in (tmp_path, tmp_path / "no\0name"):
        with refused(ResultError, file=str(path)):
            controller.save(path)
    assert not list(tmp_path.iterdir())


def test_a_step_keeps_nothing():
    controller, q, v = started()

    def run(first: int, last: int) -> int:
        for k in range(first, last):
            controller.step(k * PERIOD, q, v)
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        before = run(0, 3000)  # until Python has as many tuples in stock as it ever keeps
        after = run(3000, 4000)
    finally:
        tracemalloc.stop()
    assert after - before < 2000  # two bytes per step: less than any array


def test_every_error_of_the_controller_is_one_of_the_toolkit():
    controller, q, v = started()
    for arguments in ((0.0, q, "v"), (0.0, q * np.inf, v), (1.0, q, v)):
        with pytest.raises(SynctrlError):
            controller.step(*arguments)


def test_a_controller_of_ones_own_kind_is_driven_as_well():
    class Tame(Controller):
        def evaluate(self, reference, motion, z, integral):
            signals = super().evaluate(reference, motion, z, integral)
            return replace(signals, tau=np.zeros_like(signals.tau))

    controller = DiscreteController(Tame(small_cell(), Gains(4.0, 4.0, 1.0, 2.0, 0.2)), PERIOD)
    assert not controller.step(0.0, small_cell().q0, small_cell().v0).any()
