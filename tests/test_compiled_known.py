"""What a user has replaced is refused by the compiled engine by name, whether its cache is warm or cold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache as cache_of_results
from functools import partial, wraps

import numpy as np
import pinocchio as pin
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused
from seams.lagging_network import Lagging

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Disturbance,
    Experiment,
    Friction,
    FrictionParameters,
    FullParameters,
    Gains,
    Hold,
    Member,
    PoseSpace,
    Redundancy,
    Robot,
    load_robot,
)
from synctrl.compiled import program
from synctrl.control import law
from synctrl.control.controller import Controller
from synctrl.errors import InputError
from synctrl.robots.base_parameters import BaseParameters
from synctrl.robots.parameters import LinearParameters, planar_two_link_parameters
from synctrl.simulation.closed_loop import ClosedLoop
from synctrl.simulation.plant import Plant
from synctrl.sweep import Sweep, Uniform, gain
from synctrl.sweep.worker import Prepared
from synctrl.tasks import spaces
from synctrl.tasks.redundancy import Pseudoinverse
from synctrl.tune import tune

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")


@pytest.fixture(scope="module")
def warm(tmp_path_factory):
    """A cache that has the code for the small cell."""
    folder = tmp_path_factory.mktemp("warm")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SYNCTRL_CACHE", str(folder))
        plain().simulate(0.01, engine="compiled")
        plain(k_r_space="task").simulate(0.01, engine="compiled")
    return folder


@pytest.fixture(params=["warm", "cold"])
def cache(request, warm, tmp_path, monkeypatch):
    monkeypatch.setenv("SYNCTRL_CACHE", str(warm if request.param == "warm" else tmp_path))


def plain(**options) -> Experiment:
    return Experiment(small_cell(), SMALL_GAINS, 0.05, **options)


def rebuilt(cell: Cell, kind: type[Cell] = Cell, **changes) -> Cell:
    """The same cell with some of its parts exchanged."""
    member = {key: changes.pop(key) for key in ("robot", "parameters", "friction") if key in changes}
    members = [replace(m, **{key: make(m) for key, make in member.items()}) for m in cell.members]
    parts = {"coupling": cell.coupling, "space": cell.space, **changes}
    return kind(members, parts["coupling"], parts["space"])


# What users have plugged in: subclasses that change something, each in another place.


class Damped(Controller):
    def evaluate(self, *arguments):
        signals = super().evaluate(*arguments)
        signals.tau = signals.tau - 0.5 * arguments[1][1]
        return signals


class Leaking(ClosedLoop):
    def derive(self, *arguments):
        signals = super().derive(*arguments)
        arguments[3].theta_hat[...] -= 0.1
        return signals


class Sticky(Plant):
    def friction(self, v):
        return 3 * np.sign(v)


class Scaled:
    """A regressor of a user's own; at this scale it is true, as a cell may ask."""

    scale = 1.0

    def regressor(self, *motion):
        return self.scale * super().regressor(*motion)


class ScaledFull(Scaled, FullParameters):
    pass


class ScaledMap(Scaled, LinearParameters):
    pass


class ScaledBase(Scaled, BaseParameters):
    pass


class ScaledFriction(Scaled, FrictionParameters):
    pass


class Shifted(CartesianSpace):
    def bind(self, robots):
        bound = super().bind(robots)
        measure = bound.measure
        bound.measure = lambda motion, desired: measure(motion + 0.01, desired)
        return bound


class Curled(Redundancy):
    pass


class Leaning(Pseudoinverse):
    pass


class Squared(Coupling):
    def compare(self, w):
        return np.sign(super().compare(w)) * super().compare(w) ** 2


class Heavy(Robot):
    @property
    def gravity_vector(self):
        return 2 * super().gravity_vector


class Slow(Cell):
    def references(self, times):
        return super().references(0.5 * np.asarray(times))


class Growing(Gains):
    @property
    def changing(self):
        return True


@dataclass(frozen=True, eq=False)
class Plugged(Experiment):
    """How a user plugs in a controller or a closed loop of their own."""

    controller: type = Controller
    loop: type = ClosedLoop

    def closed_loop(self, plant="pinocchio"):
        usual = super().closed_loop(plant)
        return self.loop(self.controller(usual.cell, self.gains), usual.plant)


def weightless(cell, **options):
    """A plant of robots that do not fall."""
    robots = [Robot(pin.Model(robot.model), robot.tip) for robot in cell.robots]
    for robot in robots:
        robot.model.gravity.setZero()
    return Plant(cell, robots=robots, **options)


def longer(cell, **options):
    """A plant of robots with more joints than the controller knows."""
    return Plant(cell, robots=[load_robot("ur5")] * cell.n, **options)


def with_own(make, name, value):
    """A part of a closed loop with a method of its own, put there after it was made."""

    @dataclass(frozen=True, eq=False)
    class Patched(Experiment):
        def closed_loop(self, plant="pinocchio"):
            loop = super().closed_loop(plant)
            setattr(make(loop), name, value)
            return loop

    return Patched(small_cell(), SMALL_GAINS, 0.05)


def in_cell(**changes):
    return replace(plain(), cell=rebuilt(small_cell(), **changes))


FRICTION = Friction(0.1, 0.1)


def mapped(kind, robot):
    pi = robot.inertial_parameters
    return kind(robot, np.eye(pi.size), pi, robot.inertial_parameter_names)


REPLACED = {
    "a controller": (
        lambda: Plugged(small_cell(), SMALL_GAINS, 0.05, controller=Damped),
        "controller",
        f"{__name__}.Damped",
    ),
    "a closed loop": (
        lambda: Plugged(small_cell(), SMALL_GAINS, 0.05, loop=Leaking),
        "closed loop",
        f"{__name__}.Leaking",
    ),
    "a plant": (lambda: plain(plant_type=Sticky), "plant", f"{__name__}.Sticky"),
    "a plant without gravity": (
        lambda: plain(plant_type=weightless),
        "plant",
        "a plant with another gravity than the cell's",
    ),
    "a plant with more joints": (
        lambda: plain(plant_type=longer),
        "plant",
        "a plant with other joints than the cell's",
    ),
    "a cell": (lambda: in_cell(kind=Slow), "cell", f"{__name__}.Slow"),
    "a robot": (
        lambda: in_cell(robot=lambda m: Heavy(m.robot.model, m.robot.tip)),
        "model of robot 1",
        f"{__name__}.Heavy",
    ),
    "a space": (lambda: in_cell(space=Shifted("xy")), "space", f"{__name__}.Shifted"),
    "a redundancy": (
        lambda: in_cell(space=CartesianSpace("xy", redundancy=Curled())),
        "redundancy",
        f"{__name__}.Curled",
    ),
    "a coupling": (lambda: in_cell(coupling=Squared.pair()), "coupling", f"{__name__}.Squared"),
    "gains": (
        lambda: replace(plain(), gains=Growing(**SMALL_GAINS.as_dict())),
        "gains",
        f"{__name__}.Growing",
    ),
    "full parameters": (
        lambda: in_cell(parameters=lambda m: ScaledFull(m.robot)),
        "parameters of robot 1",
        f"{__name__}.ScaledFull",
    ),
    "base parameters": (
        lambda: in_cell(parameters=lambda m: ScaledBase(m.robot)),
        "parameters of robot 1",
        f"{__name__}.ScaledBase",
    ),
    "a map": (
        lambda: in_cell(parameters=lambda m: mapped(ScaledMap, m.robot)),
        "parameters of robot 1",
        f"{__name__}.ScaledMap",
    ),
    "parameters with friction": (
        lambda: in_cell(parameters=lambda m: ScaledFriction(m.robot, FRICTION), friction=lambda m: FRICTION),
        "parameters of robot 1",
        f"{__name__}.ScaledFriction",
    ),
    "parameters beside friction": (
        lambda: in_cell(
            parameters=lambda m: FrictionParameters(m.robot, FRICTION, ScaledFull(m.robot)),
            friction=lambda m: FRICTION,
        ),
        "parameters of robot 1 without friction",
        f"{__name__}.ScaledFull",
    ),
    "a method of one controller": (
        lambda: with_own(lambda loop: loop.controller, "evaluate", Damped.evaluate),
        "controller, Controller.evaluate",
        f"{__name__}.Damped.evaluate",
    ),
    "a gain of one law": (
        lambda: with_own(lambda loop: loop.controller.law, "beta", np.full(2, 7.0)),
        "controller, beta",
        None,
    ),
    "a method of one law": (
        lambda: with_own(lambda loop: loop.controller.law, "command", print),
        "law, BoundSunMills.command",
        "builtins.print",
    ),
    "the network of one controller": (
        lambda: with_own(lambda loop: loop.controller, "network", Lagging(0.1).bind(small_cell())),
        "network",
        "seams.lagging_network.BoundLagging",
    ),
    "a gain of one controller": (
        lambda: with_own(lambda loop: loop.controller, "Lambda", np.full(2, 7.0)),
        "controller, Lambda",
        None,
    ),
    "the inverse map of one space": (
        lambda: with_own(lambda loop: loop.cell.task, "_inverse", Leaning(np.ones((2, 2)), 0, 0)),
        "way from the task to the joints",
        f"{__name__}.Leaning",
    ),
    "a method of one plant": (
        lambda: with_own(lambda loop: loop.plant, "friction", lambda v: 3 * v),
        "plant, Plant.friction",
        f"{__name__}.<lambda>.<locals>.<lambda>",
    ),
    "a method of one space": (
        lambda: with_own(lambda loop: loop.cell.task, "measure", print),
        "space bound to the robots, BoundCartesianSpace.measure",
        "builtins.print",
    ),
    "a method of one coupling": (
        lambda: with_own(lambda loop: loop.cell.coupling, "compare", lambda w: 0 * w[:1]),
        "coupling, Coupling.compare",
        f"{__name__}.<lambda>.<locals>.<lambda>",
    ),
    "a method of one robot": (
        lambda: with_own(lambda loop: loop.cell.robots[1], "regressor", print),
        "model of robot 2, Robot.regressor",
        "builtins.print",
    ),
    "a method of some parameters": (
        lambda: with_own(lambda loop: loop.cell.parameters[1], "regressor", print),
        "parameters of robot 2, FullParameters.regressor",
        "builtins.print",
    ),
}


@pytest.mark.parametrize("name", REPLACED)
def test_what_was_replaced_is_refused_by_name_in_a_run(cache, name):
    make, subject, found = REPLACED[name]
    with refused(InputError, subject, found=found) as caught:
        make().simulate(0.01, engine="compiled")
    assert "engine='pinocchio'" in str(caught.value)


@pytest.mark.parametrize("name", REPLACED)
def test_what_was_replaced_is_refused_by_name_before_the_runs_of_a_sweep(cache, name):
    make, subject, found = REPLACED[name]
    with refused(InputError, subject, found=found):
        Prepared(make(), 0.01)


@pytest.mark.parametrize("name", ["a controller", "full parameters", "a plant"])
def test_what_was_replaced_is_refused_by_name_in_sweeps_and_in_tuning(cache, name, tmp_path):
    make, subject, found = REPLACED[name]
    with refused(InputError, subject, found=found):
        sweep = Sweep(make(), [gain("beta", Uniform(1, 2))], samples=2, duration=0.01)
        sweep.run(tmp_path / "sweep", backend="serial", progress=False)
    with refused(InputError, subject, found=found):
        tune(
            make(), {"beta": Uniform(1, 2)}, generations=1, population=5, duration=0.01,
            backend="serial", progress=False,
        )  # fmt: skip


@pytest.mark.parametrize("name", REPLACED)
def test_nothing_is_compiled_for_what_is_refused(name, tmp_path, monkeypatch):
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path))
    with pytest.raises(InputError):
        REPLACED[name][0]().simulate(0.01, engine="compiled")
    assert not list(tmp_path.iterdir())


def dressed(function):
    """A function of a user's that calls itself what it wraps."""

    @wraps(function)
    def wrapped(*arguments):
        return function(*arguments)

    return wrapped


CLASSES = {
    "a method": (Controller, "evaluate", lambda *_: None),
    "a computed attribute": (Robot, "gravity_vector", property(lambda self: np.zeros(3))),
    "a line of the law": (law, "compute_joint_command", lambda asked, *_: asked),
    "another line of the law": (law, "compute_weighted_errors", lambda weights, error: error),
    "a dressed method": (Controller, "evaluate", dressed(Controller.evaluate)),
    "a dressed line of the law": (law, "compute_joint_command", dressed(law.compute_joint_command)),
    "a dressed line with a memory": (
        law,
        "compute_joint_command",
        cache_of_results(dressed(law.compute_joint_command)),
    ),
    "a function of a space": (spaces, "inverse_map", dressed(spaces.inverse_map)),
    "a partial line": (law, "compute_joint_command", partial(law.compute_joint_command)),
}


@pytest.mark.parametrize("name", CLASSES)
def test_what_was_exchanged_in_the_package_itself_is_refused(cache, name, monkeypatch):
    experiment = plain()
    monkeypatch.setattr(*CLASSES[name])
    with refused(InputError) as caught:
        experiment.plan(0.01, 1e-3)
        program.Program(experiment.closed_loop())
    assert CLASSES[name][1] in caught.value.subject


def test_motions_weights_and_disturbances_of_a_user_are_traced(cache):
    """They are called, not replaced: a run with them is that of the reference engine."""

    class Trembling(Hold):
        def __call__(self, t):
            x, x_dot, x_ddot = super().__call__(t)
            s = np.asarray(t, dtype=float)[..., None]
            return type(super().__call__(t))(
                x + 0.01 * np.sin(20 * s), x_dot + 0.2 * np.cos(20 * s), x_ddot - 4 * np.sin(20 * s)
            )

    def weights(t):
        return (1 + 0.1 * t, -1 - t), (0.1, -1.0), (0.0, 0.0)

    class Push(Disturbance):
        pass

    plain_cell = small_cell()
    members = [replace(m, trajectory=Trembling(m.trajectory(0.0).x)) for m in plain_cell.members]
    cell = Cell(members, Coupling.pair(c=weights), CartesianSpace("xy"))
    experiment = Experiment(cell, SMALL_GAINS, 0.05, [Push(0, 0.1, 0.01, 0.02)])
    expected, found = experiment.simulate(), experiment.simulate(engine="compiled")
    assert np.abs(found.q - expected.q).max() < 1e-9
    assert np.abs(found.tau - expected.tau).max() < 1e-8


def test_a_map_of_a_user_is_traced(cache):
    cell = rebuilt(small_cell(), parameters=lambda m: planar_two_link_parameters(m.robot))
    experiment = Experiment(cell, SMALL_GAINS, 0.05)
    assert np.abs(experiment.simulate(engine="compiled").q - experiment.simulate().q).max() < 1e-9


def test_the_types_of_what_is_plugged_in_are_part_of_the_key():
    robot = load_robot("planar2r")
    base = BaseParameters(robot)
    same = LinearParameters(robot, base.matrix, base.theta, base.names)

    def keys(parameters):
        cell = rebuilt(small_cell(), parameters=lambda m: parameters)
        loop = Experiment(cell, SMALL_GAINS, 0.05).closed_loop()
        return [kind.key() for kind in program.classify(loop).kinds]

    assert keys(base) != keys(same)


def test_a_subclass_of_a_pose_space_is_named_itself(cache):
    class Tilted(PoseSpace):
        pass

    ur5 = load_robot("ur5")
    q = np.array([0.3, -1.2, 1.5, -0.5, 0.4, 0.2])
    pose = ur5.tip_pose(q)
    from synctrl.tasks import rotations

    hold = Hold(np.concatenate((pose.translation, rotations.log(pose.rotation))))
    cell = Cell([Member(ur5, hold, q), Member(ur5, hold, q)], Coupling.pair(), Tilted())
    with refused(InputError, "space", found=f"{Tilted.__module__}.{Tilted.__qualname__}"):
        Experiment(cell, Gains(4, 4, 10, 1, 0.1), 0.1).simulate(engine="compiled")
