"""Runs that cannot go on end with an error that names time, robot and cause, and keeps what there was."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused
from seams.lagging_network import Lagging

from synctrl import (
    CartesianSpace,
    Cell,
    Circle,
    Coupling,
    Cubic,
    Disturbance,
    Experiment,
    ExponentialApproach,
    Gains,
    Hold,
    Member,
    Result,
    load_robot,
    simulate,
)
from synctrl.coupling.reachability import inverse_kinematics
from synctrl.errors import (
    InputError,
    NonFiniteError,
    OrientationError,
    SimulationError,
    SingularJacobianError,
    UnreachableError,
)
from synctrl.experiments import a460_pair, planar_four, ur5_payload
from synctrl.simulation.integrators import ADAPTIVE

ARM = load_robot("planar2r")
#: torque that stretches the second robot's elbow
STRETCH = Disturbance(1, (0.0, -8.0), 0.1, 0.4)


def stretched() -> Experiment:
    """Robot 2 is pushed close to its outstretched pose."""
    cell = small_cell()
    strict = Cell(cell.members, cell.coupling, CartesianSpace("xy", max_condition=5))
    return Experiment(strict, SMALL_GAINS, 1.0, [STRETCH])


def stop(experiment: Experiment, integrator: str = "rk4", dt: float = 5e-3, **options) -> SimulationError:
    with pytest.raises(SimulationError) as caught:
        experiment.simulate(dt=dt, integrator=integrator, **options)
    return caught.value


def assert_tells_all(error: SimulationError, robot: int, experiment: Experiment, dt: float = 5e-3):
    """Time, robot and cause in the message, and everything until then in the result."""
    name = experiment.cell.names[robot]
    assert error.robot == robot and name in str(error)
    assert f"t = {error.time:g} s" in str(error)
    result = error.result
    assert isinstance(result, Result) and result.status == f"stopped: {error}"
    assert len(result.t) >= 1 and result.t[-1] <= error.time < result.t[-1] + 1.01 * dt
    for name in ("q", "v", "theta_hat", "tracking_error", "sync_integral"):
        assert np.isfinite(getattr(result, name)).all()


@pytest.mark.parametrize("integrator", ["rk4", "DOP853", "LSODA"])
def test_an_arm_pushed_towards_its_outstretched_pose_is_named(integrator):
    experiment = stretched()
    error = stop(experiment, integrator)
    assert isinstance(error, SingularJacobianError)
    assert_tells_all(error, 1, experiment)
    assert 0.1 < error.time < 0.4
    assert error.subject == "condition" and 5 <= error.found < 6


@pytest.mark.parametrize("integrator", ["rk4", "DOP853", "LSODA"])
def test_an_arm_whose_momentum_carries_it_through_is_named(integrator, monkeypatch):
    monkeypatch.setattr("synctrl.simulation.integrators.MAX_TRIES", 500)
    path = [Hold(ARM.tip_position(q)[:2]) for q in ([0.0, 1.0], [0.0, 0.8])]
    members = [Member(ARM, path[0], [0.0, 1.0]), Member(ARM, path[1], [0.0, 0.8], v0=[4.0, -12.0])]
    weak = Gains(Lambda=0.1, beta=0.0, K_r=0.01, K_eps=0.0, Gamma=0.0)
    experiment = Experiment(Cell(members, Coupling.pair(), CartesianSpace("xy")), weak, 0.5)
    error = stop(experiment, integrator, dt=1e-3)
    assert isinstance(error, (SingularJacobianError, NonFiniteError))
    assert_tells_all(error, 1, experiment, dt=1e-3)
    assert "singular" in str(error)
    assert abs(error.result.q[-1, 1, 1]) < 0.1


@pytest.mark.parametrize("integrator", ["rk4", "DOP853"])
def test_what_was_computed_until_then_is_the_run_without_the_failure(integrator):
    experiment = stretched()
    kept = stop(experiment, integrator).result
    good = experiment.simulate(duration=kept.t[-1], dt=5e-3, integrator=integrator)
    np.testing.assert_allclose(kept.t, good.t, rtol=0, atol=1e-12)
    np.testing.assert_allclose(kept.q[:-1], good.q[:-1], rtol=0, atol=1e-7)


def test_what_was_computed_until_then_can_be_saved(tmp_path):
    kept = stop(stretched()).result
    loaded = Result.load(kept.save(tmp_path / "stopped.npz"))
    assert loaded == kept
    assert loaded.status.startswith("stopped: the Jacobian of robot 2 is singular at t = ")


@pytest.mark.parametrize("integrator", ["rk4", *ADAPTIVE])
def test_an_arm_that_starts_outstretched_is_named_at_once(integrator):
    start = ARM.tip_position([0.3, 0.0])[:2]
    members = [
        Member(ARM, Hold(ARM.tip_position([0.3, 1.0])[:2]), [0.3, 1.0]),
        Member(ARM, ExponentialApproach(start, 0.9 * start), [0.3, 0.0]),
    ]
    error = stop(
        Experiment(Cell(members, Coupling.pair(), CartesianSpace("xy")), SMALL_GAINS, 0.1), integrator
    )
    assert isinstance(error, SingularJacobianError)
    assert (error.time, error.robot, len(error.result.t)) == (0.0, 1, 0)
    assert "robot 2" in str(error) and "t = 0 s" in str(error)


def test_a_run_that_failed_at_once_can_be_saved_too(tmp_path):
    members = [Member(ARM, Hold([0.6, 0.0]), [0.0, 0.0]), Member(ARM, Hold([0.3, 0.3]), [0.0, np.pi / 2])]
    kept = stop(Experiment(Cell(members, Coupling.pair(), CartesianSpace("xy")), SMALL_GAINS, 0.1)).result
    assert Result.load(kept.save(tmp_path / "nothing.npz")) == kept
    assert "0 instants" in repr(kept)


def test_the_limit_of_the_condition_number_is_the_users():
    cell = small_cell()
    strict = Cell(cell.members, cell.coupling, CartesianSpace("xy", max_condition=1.5))
    error = stop(Experiment(strict, SMALL_GAINS, 0.1))
    assert isinstance(error, SingularJacobianError) and error.subject == "condition" and error.found > 1.5


def joint_space_experiment(**changes) -> Experiment:
    members = [Member(ARM, Cubic([0.0, 1.0], [1.0, 0.5 + i], 0.5)) for i in range(2)]
    return Experiment(Cell(members, Coupling.pair()), SMALL_GAINS.replace(**changes), 1.0)


@pytest.mark.parametrize("changes", [{"K_r": 1e6}, {"Lambda": 1e5, "beta": 1e5}, {"Gamma": 1e9}])
def test_gains_too_high_for_the_step_are_found_out(changes):
    experiment = joint_space_experiment(**changes)
    error = stop(experiment)
    assert isinstance(error, NonFiniteError)
    assert_tells_all(error, error.robot, experiment)
    assert error.cause == next(reversed(changes)) and error.cause in str(error)


@pytest.mark.parametrize("integrator", ["RK45", "DOP853", "LSODA", "BDF"])
def test_a_solver_that_gets_stuck_is_an_error_with_a_robot(integrator, monkeypatch):
    monkeypatch.setattr("synctrl.simulation.integrators.MAX_TRIES", 100)
    experiment = joint_space_experiment()
    members = [
        experiment.cell.members[0],
        Member(ARM, Wall(), [0.0, 0.0], theta_hat0=ARM.inertial_parameters),
    ]
    experiment = Experiment(Cell(members, Coupling.pair()), SMALL_GAINS, 0.2)
    with np.errstate(all="ignore"):
        error = stop(experiment, integrator, dt=0.01, rtol=1e-4, atol=1e-6)
    assert isinstance(error, NonFiniteError)
    assert error.robot == 1 and "robot 2" in str(error)
    assert 0.05 < error.time <= 0.11 and error.result.t[-1] <= 0.101


class Wall:
    """A desired motion that goes to infinity at 0.1 s."""

    dimension = 2
    breaks = ()

    def __call__(self, t):
        left = 0.1 - np.asarray(t, dtype=float)
        with np.errstate(all="ignore"):
            left = np.where(left > 0, left, np.nan)
            x, x_dot, x_ddot = 1e-3 / left, 1e-3 / left**2, 2e-3 / left**3
        return tuple(np.stack([part, part], axis=-1) for part in (x, x_dot, x_ddot))


# -- before anything runs ---------------------------------------------------------------------------------


def refuses(experiment: Experiment, robot: int) -> UnreachableError:
    told: list[float] = []
    with refused(UnreachableError, f"robot {robot}, trajectory") as caught:
        experiment.simulate(dt=1e-2, progress=told.append)
    assert told == []
    return caught.value


def test_four_arms_that_cannot_reach_their_paths_do_not_start():
    assert refuses(planar_four(phi=0.5), 1).time > 0


@pytest.mark.parametrize("phi", [0.0, 0.1, -0.05, 0.3])
def test_four_arms_that_can_do(phi):
    assert planar_four(phi=phi).simulate(duration=0.02, dt=1e-2).status == "completed"


@pytest.mark.parametrize(
    "path",
    [
        Hold([0.7, 0.0]),
        ExponentialApproach([0.3, 0.3], [0.8, 0.3], 5.0),
        Cubic([0.3, 0.3], [0.3, -3.0], 0.9),
        Circle([0.4, 0.0], 0.25, 2.0),
    ],
)
def test_paths_that_leave_the_workspace_on_the_way_are_refused(path):
    members = [Member(ARM, Hold([0.3, 0.3]), [0.0, 1.5]), Member(ARM, path, [0.0, 1.5])]
    error = refuses(Experiment(Cell(members, Coupling.pair(), CartesianSpace("xy")), SMALL_GAINS, 1.0), 2)
    assert error.found == pytest.approx(path(error.time).x)


def test_a_path_that_no_other_axis_allows_is_refused():
    a460 = load_robot("a460")
    members = [Member(a460, Hold([0.4, 0.0, z]), [0.0, 1.0, -2.5]) for z in (0.5, 1.5)]
    error = refuses(Experiment(Cell(members, Coupling.pair(), CartesianSpace("xyz")), SMALL_GAINS, 1.0), 2)
    assert error.found == (0.4, 0.0, 1.5)


def test_inverse_kinematics_finds_what_forward_kinematics_gives():
    a460, rng = load_robot("a460"), np.random.default_rng(0)
    for q in rng.uniform(-1.5, 1.5, (20, 3)):
        target = a460.tip_position(q)
        found = inverse_kinematics(a460, target, np.full(3, 0.1))
        assert found is not None
        np.testing.assert_allclose(a460.tip_position(found), target, rtol=0, atol=2e-6)


@pytest.mark.parametrize(
    ("arguments", "subject"),
    [
        (("a460", [0.3, 0.3, 0.3], [0, 0]), "robot"),
        ((ARM, [0.3], [0, 0], CartesianSpace("xy")), "target"),
        ((ARM, [0.3, np.nan], [0, 0], CartesianSpace("xy")), "target"),
        ((ARM, [0.3, 0.3], [0], CartesianSpace("xy")), "q"),
        ((ARM, [0.3, 0.3], [0, 0], "xy"), "space"),
    ],
)
def test_inverse_kinematics_refuses_what_it_cannot_solve(arguments, subject):
    with refused(InputError, subject):
        inverse_kinematics(*arguments)


def test_arms_that_start_far_from_a_reachable_path_may_run():
    members = [Member(ARM, Hold([0.3, 0.3]), [3.0, -1.5]), Member(ARM, Hold([0.3, 0.3]), [0.0, 1.5])]
    assert (
        simulate(Cell(members, Coupling.pair(), CartesianSpace("xy")), SMALL_GAINS, 0.01).status
        == "completed"
    )


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
@pytest.mark.parametrize("robot", [0, 1])
def test_of_coupled_robots_the_unstable_one_is_named(robot: int, engine: str) -> None:
    experiment = a460_pair()
    K_r = np.full((2, 3), 8.0)
    K_r[robot] *= 400
    unstable = a460_pair(gains=experiment.gains.replace(K_r=K_r))
    error = stop(unstable, dt=1e-3, engine=engine)
    assert isinstance(error, NonFiniteError)
    assert error.robot == robot
    assert unstable.cell.names[robot] in str(error)


# -- one order, one wording -------------------------------------------------------------------------------

#: what may be wrong with an arm at the start, in the order in which a guard looks
FAULTS = ("turned", "singular", "overflowing")
KINDS = {"turned": OrientationError, "singular": SingularJacobianError, "overflowing": NonFiniteError}
STATES = [(), ("turned",), ("singular",), ("overflowing", "singular")]


def with_faults(faults: tuple[tuple[str, ...], ...]) -> Experiment:
    """Two UR5 in pose space, each with its faults."""
    experiment = ur5_payload()
    cell, members = experiment.cell, []
    for member, own, q0 in zip(experiment.cell.members, faults, cell.q0, strict=True):
        q0 = q0 + np.array([0, 0, 0, 0, 0, 3.1 * ("turned" in own)])
        q0[4] *= "singular" not in own
        guess = np.full(60, 1e308) if "overflowing" in own else member.theta_hat0
        members.append(replace(member, q0=q0, theta_hat0=guess))
    return replace(experiment, cell=Cell(members, cell.coupling, cell.space))


@pytest.mark.parametrize("faults", [((), ("overflowing",)), *[*product(STATES, repeat=2)][1:]], ids=str)
def test_of_several_faults_both_engines_find_the_same_one_in_the_same_words(faults) -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    one, other = (stop(with_faults(faults), dt=1e-3, engine=engine) for engine in ("pinocchio", "compiled"))
    first = next(fault for fault in FAULTS if any(fault in own for own in faults))
    assert type(one) is KINDS[first]
    assert first == "turned" or one.robot == [first in own for own in faults].index(True)
    for attribute in ("robot", "joint", "time", "cause"):
        assert getattr(one, attribute) == getattr(other, attribute)
    assert (type(one), str(one)) == (type(other), str(other))


class Forgetful(Lagging):
    """A network of which a number that nobody measures becomes infinite."""

    def bind(self, cell):
        bound = super().bind(cell)

        def exchange(t, w, memory, heard=bound.exchange):
            received = heard(t, w, memory)
            received.memory_dot[0] = np.inf if t > 0.02 else received.memory_dot[0]
            return received

        bound.exchange = exchange
        return bound


@pytest.mark.parametrize("control_period", [None, 5e-3])
def test_memory_of_a_network_that_is_no_longer_finite_is_named(control_period):
    error = stop(replace(stretched(), network=Forgetful(0.01)), control_period=control_period)
    assert isinstance(error, NonFiniteError) and (error.cause, error.robot) == ("part", None)
    assert "BoundLagging" in str(error)
    assert error.time == pytest.approx(0.02)
