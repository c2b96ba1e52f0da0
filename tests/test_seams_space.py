"""A space of one's own: everything that asks a space asks what it offers, not what it is."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused
from seams.degrees import DEGREES, BoundDegrees, Degrees

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Cubic,
    Experiment,
    Gains,
    Hold,
    JointSpace,
    Member,
    PoseSpace,
    Result,
    inverse_kinematics,
    load_robot,
)
from synctrl.analysis.certify import certify
from synctrl.errors import (
    InputError,
    SimulationError,
    SingularJacobianError,
    TrajectoryError,
    UnreachableError,
)
from synctrl.sweep import Grid, Sweep, gain, load
from synctrl.tasks.spaces import BoundTipSpace, Measurement, TipSpace, units_of

ARM, START = load_robot("planar2r"), np.array([0.3, 1.0])
WAYS = {
    "continuous": {},
    "sampled": {"control_period": 2e-3},
    "adaptive": {"integrator": "RK45", "rtol": 1e-9, "atol": 1e-11},
}


def experiment(space, unit: float = DEGREES) -> Experiment:
    """Two arms on cubic ways of different length; gains such that unit and 1 rad make the same run."""
    ends = START + np.array([[0.4, 0.5], [0.8, 0.5]])
    ways = [Cubic(unit * START, unit * end, 0.5) for end in ends]
    members = [Member(ARM, way, q0=START, theta_hat0=0.5 * ARM.inertial_parameters) for way in ways]
    gains = Gains(Lambda=10.0, beta=5.0, K_r=4.0, K_eps=2.0 / unit**2, Gamma=0.5)
    return Experiment(Cell(members, Coupling.pair(), space), gains, 0.5)


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_joints_move_alike_in_degrees_and_in_radians(options):
    mine, ours = (experiment(*x).simulate(0.2, **options) for x in ((Degrees(),), (JointSpace(), 1.0)))
    np.testing.assert_allclose(mine.q, ours.q, atol=1e-12)
    np.testing.assert_allclose(mine.tau, ours.tau, atol=1e-9)
    np.testing.assert_allclose(mine.tracking_error, DEGREES * ours.tracking_error, atol=1e-10)
    assert mine.unit("tracking_error") == "deg" and mine.unit("q") == "rad"


class DegreesFromTheirPath(Degrees):
    """Degrees that say where a robot begins."""

    def start(self, robot, x):
        return x / DEGREES


def test_a_space_may_say_where_a_robot_begins_and_is_asked_only_without_a_start():
    way = Cubic(DEGREES * START, DEGREES * (START + 0.1), 0.5)
    members = [Member(ARM, way), Member(ARM, way, q0=START + 0.2)]
    cell = Cell(members, Coupling.pair(), DegreesFromTheirPath())
    np.testing.assert_allclose(cell.q0, [START, START + 0.2])
    with refused(InputError, "robot 1, q0"):
        Cell(members, Coupling.pair(), Degrees())


def test_a_start_that_a_space_gives_has_to_be_one_of_the_robot():
    class Short(DegreesFromTheirPath):
        def start(self, robot, x):
            return x[:1]

    way = Cubic(DEGREES * START, DEGREES * (START + 0.1), 0.5)
    with refused(InputError, "robot 1, q0", found=(1,)):
        Cell([Member(ARM, way)] * 2, Coupling.pair(), Short())


def test_a_run_in_degrees_is_certified():
    certificate = certify(experiment(Degrees()).simulate())
    assert certificate.certified and certificate.closes


def test_the_certificate_of_a_run_in_degrees_has_the_powers_of_the_one_in_radians():
    mine, ours = (certify(experiment(*x).simulate(0.2)).lyapunov for x in ((Degrees(),), (JointSpace(), 1.0)))
    np.testing.assert_allclose(mine.V, ours.V, rtol=1e-12)
    for name, power in ours.power.items():
        np.testing.assert_allclose(mine.power[name], power, atol=1e-9)


def test_a_run_in_degrees_is_saved_and_read_again(tmp_path):
    run = experiment(Degrees()).simulate(0.05)
    found = Result.load(run.save(tmp_path / "run.npz"))
    assert found == run and found.unit("x") == "deg"
    assert certify(found, experiment(Degrees())).certified


def test_a_sweep_takes_a_space_of_ones_own(tmp_path):
    tables = []
    for case in ((Degrees(),), (JointSpace(), 1.0)):
        study = Sweep(experiment(*case), [gain("beta", Grid([2.0, 4.0]))], duration=0.05, engine="pinocchio")
        study.run(tmp_path / case[0].unit, backend="serial", progress=False)
        tables.append(load(tmp_path / case[0].unit))
    found, expected = tables
    assert found["status"].tolist() == ["completed"] * 2
    np.testing.assert_allclose(found["tracking_peak"], DEGREES * expected["tracking_peak"])


def test_the_compiled_engine_refuses_a_space_of_ones_own_by_name():
    with refused(InputError, "space", found="seams.degrees.Degrees"):
        experiment(Degrees()).simulate(engine="compiled")


class BoundTurned(BoundTipSpace):
    def measure(self, motion, desired):
        turn = self._space.turn
        moved, J, J_dot = self._tips.positions(*motion)
        moved, J, J_dot = np.matvec(turn, moved[..., :2]), turn @ J[..., :2, :], turn @ J_dot[..., :2, :]
        inversion = self._inverse.invert(J, J_dot, *motion)
        return Measurement(moved, desired[:2] - moved, desired[1:], J, inversion.J_inv, J_dot, inversion)


class Turned(TipSpace):
    """Positions of tips in axes that are turned against those of the world."""

    unit, bound = "m", BoundTurned
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])

    def __init__(self):
        super().__init__(2, 1e4, "stop", None)

    def labels(self, robots):
        return "along", "across"

    def miss(self, robot, target, q):
        pose, J, _ = robot.tip_kinematics(q, np.zeros(robot.nv))
        return target - self.turn @ pose.translation[:2], self.turn @ J[:2]


def test_a_further_space_of_the_tip_is_compiled_once_its_name_is_known(monkeypatch):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    from synctrl.compiled import known

    tip = ARM.tip_pose(START).translation[:2]
    ends = [tip + way for way in ([0.1, 0.0], [0.1, 0.1])]
    ways = [Cubic(Turned.turn @ tip, Turned.turn @ end, 0.5) for end in ends]
    members = [Member(ARM, way, q0=START, theta_hat0=0.5 * ARM.inertial_parameters) for way in ways]
    gains = Gains(Lambda=10.0, beta=5.0, K_r=4.0, K_eps=80.0, Gamma=0.5)
    turned = Experiment(Cell(members, Coupling.pair(), Turned()), gains, 0.5)
    with refused(InputError, "space"):
        turned.simulate(0.1, engine="compiled")
    monkeypatch.setattr(known, "SPACES", (*known.SPACES, Turned))
    monkeypatch.setattr(known, "BOUND", (*known.BOUND, BoundTurned))
    found, expected = (turned.simulate(0.1, engine=engine) for engine in ("compiled", "pinocchio"))
    np.testing.assert_allclose(found.q, expected.q, rtol=1e-9)
    assert np.abs(expected.sync_error).max() > 1e-4


class Narrow(Degrees):
    """Degrees that mean nothing beyond a limit."""

    def __init__(self, limit: float):
        self.limit = limit

    def bind(self, robots):
        return BoundNarrow(robots, {"angle": self.limit})

    def __repr__(self) -> str:
        return f"Narrow({self.limit:g})"


class BoundNarrow(BoundDegrees):
    def __init__(self, robots, limits):
        super().__init__(len(robots), robots[0].nv)
        self.limits = limits

    def watched(self, task):
        return np.abs(task.x).max(axis=1, keepdims=True)


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_what_a_space_calls_invalid_ends_the_run_in_its_own_words(options):
    limit = DEGREES * 1.2
    with refused(SimulationError, "angle") as stop:
        experiment(Narrow(limit)).simulate(**options)
    whole = experiment(Degrees()).simulate(**options)
    beyond = np.abs(whole.x).max(axis=(1, 2)) > limit
    assert stop.value.time == pytest.approx(whole.t[beyond][0])
    assert stop.value.found > limit and f"Narrow({limit:g}" in stop.value.problem
    assert stop.value.robot == int(np.abs(whole.x[beyond][0]).max(axis=1).argmax())
    assert len(stop.value.result.t) == np.argmax(beyond)


def test_a_digital_controller_refuses_what_a_space_calls_invalid():
    controller = experiment(Narrow(1.0)).controller(1e-3)
    q, v = controller.cell.q0, controller.cell.v0
    controller.reset(0.0, q, v)
    with refused(SimulationError, time=0.0, robot=0):
        controller.step(0.0, q, v)


def test_a_space_that_finds_nothing_invalid_changes_nothing():
    found, expected = (experiment(space).simulate(0.1) for space in (Narrow(1e6), Degrees()))
    np.testing.assert_array_equal(found.q, expected.q)


class Sided(Degrees):
    """Degrees of an elbow that may not be stretched in a step."""

    def bind(self, robots):
        return BoundSided(len(robots), robots[0].nv)


class BoundSided(BoundDegrees):
    def sides(self, task):
        return task.x[:, 1:]


def test_a_robot_that_changes_sides_ends_the_run():
    straight = Cubic(DEGREES * np.array([0.3, 0.2]), DEGREES * np.array([0.3, -0.5]), 0.5)
    bent = Hold(DEGREES * np.array([0.3, 0.2]))
    members = [
        Member(ARM, way, q0=[0.3, 0.2], theta_hat0=ARM.inertial_parameters) for way in (bent, straight)
    ]
    cell = Cell(members, Coupling.pair(), Sided())
    with refused(SingularJacobianError, robot=1, cause="singular") as stop:
        Experiment(cell, Gains(10.0, 0.0, 4.0, 0.0, 0.1), 0.5).simulate()
    assert (stop.value.result.x[:, 1, 1] > 0).all()


class Shifted:
    """Position of the tip from a corner of the table: a wrapper that offers what it can."""

    unit = "m"

    def __init__(self, corner):
        self.tip, self.corner = CartesianSpace("xy"), np.asarray(corner)

    def labels(self, robots):
        return "along", "across"

    def bind(self, robots):
        return self.tip.bind(robots)

    def miss(self, robot, target, q):
        return self.tip.miss(robot, target, q)


def test_inverse_kinematics_follow_any_space_that_says_how_far_a_target_is_missed():
    space, q = Shifted([0.0, 0.0]), np.array([0.4, 0.9])
    target = ARM.tip_position(q)[:2]
    found = inverse_kinematics(ARM, target, START, space)
    np.testing.assert_allclose(ARM.tip_position(found)[:2], target, atol=1e-6)


def test_a_path_out_of_reach_is_refused_in_any_space_that_says_how_far_a_target_is_missed():
    members = [Member(ARM, Hold([9.0, 9.0]), q0=START) for _ in range(2)]
    cell = Cell(members, Coupling.pair(), Shifted([0.0, 0.0]))
    with refused(UnreachableError, "robot 1, trajectory", time=0.0, found=(9.0, 9.0)):
        Experiment(cell, Gains(1.0, 0.0, 1.0, 0.0, 0.1), 0.1).simulate()


@pytest.mark.parametrize("space", [JointSpace(), JointSpace, Degrees(), 5])
def test_inverse_kinematics_refuse_a_space_that_does_not(space):
    with refused(InputError, "space"):
        inverse_kinematics(ARM, [0.1, 0.2], START, space)


class Turns(Degrees):
    """Velocities in turns per second, which are no derivatives of degrees."""

    def displacement(self, start, end):
        return (end - start) / 360


def test_a_space_says_which_velocities_fit_its_positions():
    with pytest.raises(TrajectoryError):
        experiment(Turns()).simulate(0.01)


def test_units_of_coordinates_are_those_of_the_space_or_one_each():
    robots = (load_robot("planar2r"),)
    assert units_of(Degrees(), robots) == ("deg", "deg")
    assert units_of(PoseSpace(), robots) == ("m", "m", "m", "rad", "rad", "rad")


@pytest.mark.parametrize(
    ("labels", "subject", "found"),
    [
        (("a", "a"), "space", ("a", "a")),
        (("a", ""), "space", ("a", "")),
        (("a", "b\nc"), "space: name of a coordinate", "b\nc"),
        (("a", 5), "space: name of a coordinate", "int"),
    ],
)
def test_coordinates_have_different_names_of_one_line(labels, subject, found):
    class Named(Degrees):
        def labels(self, robots):
            return labels

    with refused(InputError, subject, found=found):
        experiment(Named())
