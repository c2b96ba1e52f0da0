"""Who stops a run is named with its joint, whatever it met on its way to infinity, alike in both engines."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Cubic,
    Disturbance,
    Experiment,
    Friction,
    FullParameters,
    Gains,
    Hold,
    Member,
    load_robot,
)
from synctrl.control.laws import Asked, SunMills
from synctrl.control.laws.sun_mills import BoundSunMills
from synctrl.coupling.weights import Weights
from synctrl.errors import (
    CouplingError,
    NonFiniteError,
    OrientationError,
    SimulationError,
    SingularJacobianError,
)
from synctrl.experiments import a460_pair, planar_four, ur5_payload
from synctrl.simulation.rates import HELD, loop_rates
from synctrl.simulation.schedules import DisturbanceSchedule
from synctrl.simulation.stop import Stop
from synctrl.tasks.trajectories import Motion

ARM = load_robot("planar2r")
ENGINES = ("pinocchio", "compiled")


@pytest.fixture(autouse=True)
def _compiled_is_there() -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")


def small(*pushes: Disturbance, members: dict[str, Any] | None = None, **gains: Any) -> Experiment:
    """Two planar arms, with changes of their members: one value for each."""
    cell = small_cell()
    changed = [
        replace(m, **{name: value[i] for name, value in (members or {}).items()})
        for i, m in enumerate(cell.members)
    ]
    made = Cell(changed, cell.coupling, cell.space, cell.name)
    return Experiment(made, SMALL_GAINS.replace(**gains), 0.5, pushes)


def small_with(law: Any) -> Experiment:
    """The small cell with friction under another law."""
    cell = small(members={"friction": [Friction(0.1), Friction(0.2)]}).cell
    return Experiment(cell, SMALL_GAINS, 0.5, law=law)


def in_joint_space(**gains: Any) -> Experiment:
    members = [Member(ARM, Cubic([0.0, 1.0], [1.0, 0.5 + i], 0.5)) for i in range(2)]
    return Experiment(Cell(members, Coupling.pair()), SMALL_GAINS.replace(**gains), 1.0)


def stretched() -> Experiment:
    """Robot 2 is pushed gently until its elbow is nearly straight."""
    cell = small_cell()
    strict = Cell(cell.members, cell.coupling, CartesianSpace("xy", max_condition=5))
    return Experiment(strict, SMALL_GAINS, 1.0, [Disturbance(1, (0.0, -8.0), 0.1, 0.4)])


def carried_through() -> Experiment:
    """Robot 2 swings through its outstretched pose."""
    postures = ([0.0, 1.0], [0.0, 0.8])
    paths = [Hold(ARM.tip_position(q)[:2]) for q in postures]
    members = [Member(ARM, paths[0], postures[0]), Member(ARM, paths[1], postures[1], v0=[4.0, -12.0])]
    weak = Gains(Lambda=0.1, beta=0.0, K_r=0.01, K_eps=0.0, Gamma=0.0)
    return Experiment(Cell(members, Coupling.pair(), CartesianSpace("xy")), weak, 0.5)


def turned() -> Experiment:
    """The wrist of robot 1 starts almost half a turn away."""
    experiment = ur5_payload()
    cell = experiment.cell
    first = replace(cell.members[0], q0=cell.q0[0] + np.array([0, 0, 0, 0, 0, 3.1]))
    return replace(experiment, cell=Cell([first, *cell.members[1:]], cell.coupling, cell.space))


def one_row(robot: int, joint: int, large: float) -> np.ndarray:
    """K_r that is large at one joint."""
    K_r = np.ones((2, 2))
    K_r[robot, joint] = large
    return K_r


def four(**gains: float) -> Experiment:
    return planar_four(gains=planar_four().gains.replace(**gains))


class Row(NamedTuple):
    """What is run, and who is to blame; None where any will do."""

    make: Callable[[], Experiment]
    cause: str
    robot: int | None = None
    joint: int | None = None
    kind: type[SimulationError] = NonFiniteError
    options: dict[str, Any] = {}  # noqa: RUF012


TABLE = {
    "Lambda": Row(lambda: small(Lambda=1e6), "Lambda"),
    "Lambda of four arms": Row(lambda: four(Lambda=1e6), "Lambda"),
    "beta": Row(lambda: small(beta=1e5), "beta"),
    "Gamma": Row(lambda: small(Gamma=1e5), "Gamma"),
    "Gamma of four arms": Row(lambda: four(Gamma=1e5), "Gamma"),
    "Gamma in joint space": Row(lambda: in_joint_space(Gamma=1e8), "Gamma"),
    "K_eps": Row(lambda: small(K_eps=1e7), "K_eps"),
    "K_r": Row(lambda: in_joint_space(K_r=1e6), "K_r", joint=1),
    "a Lambda beyond all measure": Row(lambda: small(Lambda=1e300), "Lambda"),
    "a K_r beyond all measure": Row(lambda: small(K_r=1e308), "K_r", joint=1),
    "a Gamma beyond all measure": Row(lambda: in_joint_space(Gamma=1e308), "Gamma"),
    "a light joint of robot 1": Row(lambda: small(K_r=one_row(0, 1, 300.0)), "K_r", 0, 1),
    "a light joint of robot 2": Row(lambda: small(K_r=one_row(1, 1, 300.0)), "K_r", 1, 1),
    "a step": Row(small, "step", options={"dt": 0.25}),
    "a step of four arms": Row(planar_four, "step", options={"dt": 0.25, "duration": 3.0}),
    "a step for friction": Row(
        lambda: small(members={"friction": [Friction(viscous=50.0), Friction()]}), "step", 0, 1,
        options={"dt": 4e-3},
    ),
    "friction": Row(lambda: small(members={"friction": [Friction(), Friction(500.0)]}), "friction", 1, 1),
    "a period": Row(planar_four, "period", options={"control_period": 0.03}),
    "a period for K_r": Row(lambda: small(K_r=30.0), "period", joint=1, options={"control_period": 4e-3}),
    "Gamma for a period": Row(lambda: small(Gamma=1e4), "Gamma", options={"control_period": 2e-3}),
    "a push of 1e300 on robot 1": Row(
        lambda: small(Disturbance(0, (1e300, 0.0), 0.1, 0.2)), "disturbance", 0, 0
    ),
    "a push of 1e300 on joint 2": Row(
        lambda: small(Disturbance(1, (0.0, 1e300), 0.1, 0.2)), "disturbance", 1, 1
    ),
    "a push before another": Row(
        lambda: small(Disturbance(0, (1e9, 0.0), 0.1, 0.2), Disturbance(1, (1e12, 0.0), 0.3, 0.4)),
        "disturbance", 0, 0,
    ),
    "a strong push": Row(lambda: small(Disturbance(0, (3e3, 0.0), 0.1, 0.2)), "disturbance", 0, 0),
    "a fast start": Row(lambda: small(members={"v0": [[0, 0], [0, 1e3]]}), "start", 1, 1),
    "a wrong guess": Row(
        lambda: small(members={"theta_hat0": [np.zeros(20), np.full(20, 1e9)]}), "start", 1
    ),
    "a path to the border": Row(stretched, "singular", 1, None, SingularJacobianError),
    "a swing through the border": Row(carried_through, "singular", 1, None, SingularJacobianError),
    "a turned wrist": Row(turned, "orientation", 0, None, OrientationError),
}  # fmt: skip


def stop(row: Row, engine: str) -> SimulationError:
    with pytest.raises(SimulationError) as caught:
        row.make().simulate(engine=engine, **row.options)
    return caught.value


def without_time(error: SimulationError) -> tuple[type, str]:
    return type(error), str(error).replace(f"t = {error.time:g} s", "t")


@pytest.mark.parametrize("name", TABLE)
def test_who_stopped_a_run_is_named_by_both_engines_in_the_same_words(name: str) -> None:
    row = TABLE[name]
    one, other = (stop(row, engine) for engine in ENGINES)
    assert (one.cause, type(one)) == (row.cause, row.kind)
    assert row.robot in (None, one.robot) and row.joint in (None, one.joint)
    for attribute in ("cause", "robot", "joint"):
        assert getattr(one, attribute) == getattr(other, attribute)
    # at 1e17 rad the sine of a position is made of rounding errors: one engine may notice a step later
    slack = row.options.get("dt", 1e-3) if row.kind is NonFiniteError else 0.0
    assert abs(one.time - other.time) <= 1.001 * slack
    assert without_time(one) == without_time(other)
    assert row.make().cell.names[one.robot] in str(one)
    assert one.joint is None or f"joint {one.joint + 1} of" in str(one)


@pytest.mark.parametrize("name", ["a step", "a step of four arms", "a period", "a period for K_r"])
def test_a_step_or_period_that_is_said_to_do_does(name: str) -> None:
    row = TABLE[name]
    found = re.search(r"needs at most (\S+) s", str(stop(row, "compiled")))
    assert found is not None
    longest = float(found[1])
    if "control_period" in row.options:
        options: dict[str, Any] = {"dt": longest, "control_period": longest}
    else:
        options = {"dt": longest}
    assert row.make().simulate(engine="compiled", **options).status == "completed"


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("robot", [0, 1])
def test_the_robot_with_the_high_gain_is_named_not_the_one_it_drags_along(robot: int, engine: str) -> None:
    K_r = np.full((2, 3), 80.0)
    K_r[robot, 2] *= 100
    error = stop(Row(lambda: a460_pair(gains=a460_pair().gains.replace(K_r=K_r)), "K_r"), engine)
    assert (error.cause, error.robot, error.joint) == ("K_r", robot, 2)
    assert f"K_r = {K_r[robot, 2]:g}" in str(error)


def test_what_was_computed_until_then_says_why_too() -> None:
    error = stop(TABLE["a light joint of robot 2"], "pinocchio")
    assert error.result.status == f"stopped: {error}"
    assert np.isfinite(error.result.q).all()


class Braking(SunMills):
    """The paper's law with a brake on what robots do differently; one below zero drives them."""

    def __init__(self, brake: float):
        super().__init__()
        self.brake = brake

    def bind(self, cell: Cell, gains: Gains) -> Any:
        bound, size = super().bind(cell, gains), self.brake

        class Bound:
            def command(self, errors: Any) -> Asked:
                asked = bound.command(errors)
                brake = size * np.matvec(errors.c.mT, errors.sigma_dot)
                return asked._replace(force=asked.force + brake)

        return Bound()


@pytest.mark.parametrize("law", [SunMills(), Braking(3.0)])
def test_all_that_damps_through_torque_that_is_held_counts_together_whatever_the_law(law: Any) -> None:
    loop, period = small_with(law).closed_loop(), 2e-3
    cell, motion = loop.cell, np.stack((loop.cell.q0, loop.cell.v0))
    nothing = {"v": np.zeros((0, cell.n, cell.nv))}
    error, pushes = NonFiniteError("", time=0.0), DisturbanceSchedule(cell, [])
    run = Stop(loop, pushes, error, nothing, loop.initial_state(), 1e-3, period)
    held = [each for each in run.excesses(False) if each.held and not each.rate.spring]
    rates = loop_rates(loop, 0.0, motion, sampled=True)
    for i in range(cell.n):
        (own,) = (each for each in held if each.rate.robot == i)
        damping = [r for r in rates if r.robot == i and not r.spring and r.gain != "friction"]
        assert len(damping) == (3 if isinstance(loop.controller.law, BoundSunMills) else 4)
        assert own.longest == pytest.approx(HELD / sum(rate.rate for rate in damping))


@pytest.mark.parametrize("engine", ENGINES)
def test_a_law_that_drives_robots_apart_is_no_gain_and_keeps_no_cause_from_being_found(engine: str) -> None:
    row = Row(lambda: small_with(Braking(-300.0)), "unstable", options={"control_period": 2e-3})
    error = stop(row, engine)
    assert (type(error), error.cause) == (NonFiniteError, "unstable")


# -- what users wrote ---------------------------------------------------------------------------------------

#: from this instant on functions of a user's give no numbers, s
FAULT = 0.0305
WAYS: dict[str, dict[str, str]] = {
    "pinocchio": {}, "compiled": {"engine": "compiled"}, "RK45": {"integrator": "RK45"},
}  # fmt: skip


class UndefinedMotion:
    """A desired motion that is no number from some instant on."""

    breaks = ()

    def __init__(self, path: Any):
        self.path, self.dimension = path, path.dimension

    def __call__(self, t: Any) -> Motion:
        motion, late = self.path(t), np.asarray(t)[..., None] > FAULT
        return motion._replace(x_ddot=np.where(late, np.nan, motion.x_ddot))


class UndefinedWeights:
    """Weights of 1 and -1 whose rate is no number from some instant on."""

    robots = 2

    def at(self, times: np.ndarray, m: int) -> Weights:
        c = np.array([1.0, -1.0])[:, None, None] * np.eye(m) * np.ones((len(times), 1, 1, 1))
        late = np.where(np.asarray(times)[:, None, None, None] > FAULT, np.nan, 0.0)
        return Weights(c, late * c, 0 * c, c)

    def scaled(self, factor: float) -> UndefinedWeights:
        return self

    def size(self, t: float) -> float:
        return 1.0


class UndefinedLaw(SunMills):
    """The paper's law, which asks for no number from some instant on."""

    def bind(self, cell: Cell, gains: Gains) -> Any:
        bound = super().bind(cell, gains)

        class Bound:
            def command(self, errors: Any) -> Asked:
                asked = bound.command(errors)
                return asked._replace(xref_ddot=asked.xref_ddot * (np.nan if errors.t > FAULT else 1.0))

        return Bound()


class UndefinedParameters(FullParameters):
    """A regressor that is no number while the robot moves slowly."""

    def regressor(self, q: Any, v: Any, *rest: Any) -> Any:
        return super().regressor(q, v, *rest) * (np.nan if 0.005 < np.abs(v).max() < 0.05 else 1.0)


def with_members(**changes: Callable[[Member], Any]) -> Experiment:
    """The pair of arms with friction, with changes of its second robot."""
    pair = a460_pair()
    first, second = pair.cell.members
    second = replace(second, **{name: make(second) for name, make in changes.items()})
    return replace(pair, cell=Cell([first, second], pair.cell.coupling, pair.cell.space))


def coupled(c: Any) -> Experiment:
    """The pair of arms with friction under other weights."""
    pair = a460_pair()
    return replace(pair, cell=Cell(pair.cell.members, Coupling.pair(c=c), pair.cell.space))


UNDEFINED: dict[str, tuple[Callable[[], Experiment], str, int | None, str]] = {
    "a motion": (
        lambda: with_members(trajectory=lambda m: UndefinedMotion(m.trajectory)), "motion", 1,
        "the desired motion of robot 2",
    ),
    "weights": (lambda: coupled(UndefinedWeights()), "weights", 0, "c' of the robot at index 0"),
    "a law": (lambda: a460_pair(law=UndefinedLaw()), "part", 0, "UndefinedLaw.bind.<locals>.Bound"),
    "parameters": (
        lambda: with_members(parameters=lambda m: UndefinedParameters(m.robot)), "part", 1,
        "UndefinedParameters",
    ),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", UNDEFINED)
def test_what_a_user_wrote_is_named_where_it_gives_no_number_and_no_friction_or_gain(
    name: str, way: str
) -> None:
    make, cause, robot, subject = UNDEFINED[name]
    if way == "compiled" and cause == "part":
        pytest.skip("generated code has no such part")
    with refused(NonFiniteError, subject, cause=cause, robot=robot, joint=None) as stop:
        make().simulate(0.1, **WAYS[way])
    assert not re.search("ran away|friction|gain", str(stop.value))
    assert 1 <= len(stop.value.result.t) <= 100
    assert np.isfinite(stop.value.result.q).all()


@pytest.mark.parametrize("way", WAYS)
def test_weights_that_are_seen_to_be_no_numbers_are_refused_before_the_run(way: str) -> None:
    def c(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        one = np.array([1.0, -1.0])
        return one * (np.nan if t > FAULT else 1.0), 0 * one, 0 * one

    with refused(CouplingError, "c") as stop:
        coupled(c).simulate(0.1, **WAYS[way])
    assert stop.value.time > FAULT
