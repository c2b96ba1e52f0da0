"""Robots in lanes, whatever a cell has: the bits of one lane, and the run of the reference engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from cells import SMALL_GAINS, moving_weights
from side_by_side import WIDTHS, Outcome, apart, assert_same_in_all_lanes, differing, in_lanes, lanes, outcome

from synctrl import (
    CartesianSpace,
    Cell,
    Circle,
    Coupling,
    Cubic,
    Disturbance,
    Experiment,
    Friction,
    FrictionParameters,
    Gains,
    Hold,
    JointSpace,
    Member,
    Payload,
    load_robot,
)
from synctrl import experiments as ready
from synctrl.assembly.handling import HandlingPlant
from synctrl.compiled import compiler, tables
from synctrl.compiled.program import Program
from synctrl.control.adaptation import Box, Composite, Natural
from synctrl.control.admittance import Admittance
from synctrl.control.laws import ChungSlotine
from synctrl.errors import NonFiniteError, SingularJacobianError

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

SPACE = CartesianSpace("xy")
#: for motions that are violent
GENTLE = SMALL_GAINS.replace(Gamma=1e-3)


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    """A cache of this module's own, of code that is compiled quickly: bits do not depend on how it was."""
    quick = tuple("-O0" if flag.startswith("-O") else flag for flag in compiler.FLAGS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SYNCTRL_CACHE", str(tmp_path_factory.mktemp("cache")))
        patch.setattr(compiler, "FLAGS", quick)
        yield


def arms(
    n: int,
    coupling: Coupling | None = None,
    motion: Callable | None = None,
    gains: Gains = SMALL_GAINS,
    clocks: object = 0.0,
    **options,
) -> Experiment:
    """Planar arms with different motions that start with an error, and do not know how heavy they are."""
    arm, members = load_robot("planar2r"), []
    for i in range(n):
        robot = arm.placed((i, 0.1 * i, 0), (0, 0, 0.2 * i), name=f"arm {i + 1}")
        q0 = np.array([0.3 + 0.2 * i, 1.2 + 0.05 * i])
        tip = robot.tip_position(q0)[:2] + 0.01
        path = motion(tip) if motion else Circle(tip - [0.05, 0.0], 0.05, speed=1.0 + 0.1 * i)
        members.append(Member(robot, path, q0, theta_hat0=0.5 * robot.inertial_parameters))
    coupling = coupling or Coupling.chain(n)
    return Experiment(Cell(members, coupling, SPACE, clocks=clocks), gains, 0.02, **options)


def each(experiment: Experiment, change: Callable[[int, Member], Member], **options) -> Experiment:
    """An experiment with other members."""
    cell, coupling = experiment.cell, options.pop("coupling", experiment.cell.coupling)
    members = [change(i, member) for i, member in enumerate(cell.members)]
    return replace(experiment, cell=Cell(members, coupling, options.pop("space", cell.space)), **options)


# -- ready cells ------------------------------------------------------------------------------------------


def handled() -> Experiment:
    """Hands close and open while arms give way."""
    experiment = ready.carry_ur5(
        geometric_error=True, friction=True, admittance=Admittance((5.0, 0.2), (300.0, 9.0))
    )
    kept = experiment.plant_type.keywords
    windows = ({"until": 0.008}, {"until": 0.005}, {"since": 0.012, "xyz": None, "rotation": None})
    grasps = [replace(kept["grasps"][i], **window) for i, window in zip((0, 1, 1), windows, strict=True)]
    return replace(experiment, plant_type=partial(HandlingPlant, **{**kept, "grasps": grasps}))


#: and whether their robots are of one kind, so that they stand in lanes
READY: dict[str, tuple[Callable[[], Experiment], bool]] = {
    "four planar arms": (partial(ready.planar_four, disturbance=Disturbance(2, 0.4, 0.003, 0.0083)), True),
    "two A460": (ready.a460_pair, True),
    "an edge": (ready.bead_on_edge, False),
    "a path": (ready.bead_on_path, True),
    "carried by two UR5": (partial(ready.carry_ur5, geometric_error=True, friction=True, push=True), True),
    "handled by two UR5": (handled, True),
    "carried by planar arms": (partial(ready.carry_planar, geometric_error=True), True),
    "mixed": (ready.mixed_four, False),
    "vehicle": (ready.mobile_robot, True),
    "Pandas": (ready.panda_four, True),
    "rigid object": (ready.rigid_object, True),
    "two UR5": (ready.ur5_payload, True),
}


@pytest.mark.parametrize("name", READY)
def test_ready_cells_have_the_same_bits_in_any_number_of_lanes(name):
    make, in_one_kind = READY[name]
    experiment = make()
    with lanes(2):
        assert Program(experiment.closed_loop()).lanes.width == (2 if in_one_kind else 1)
    assert_same_in_all_lanes(experiment, WIDTHS if in_one_kind else WIDTHS[:2], duration=0.02)


# -- who is compared with whom ----------------------------------------------------------------------------

COUPLINGS: dict[str, Callable[[int], Coupling]] = {
    "ring": Coupling.signed_ring,
    "chain": Coupling.chain,
    "star": Coupling.star,
    "star around the last": lambda n: Coupling.star(n, n - 1),
    "sum": Coupling.sum,
    "all": Coupling.complete,
    "weighted": lambda n: Coupling.chain(n).weighted(np.linspace(0.5, 3, n - 1)),
    "moving": lambda n: Coupling.star(n, c=moving_weights(np.random.default_rng(n), n, 2)),
}


@pytest.mark.parametrize("n", [2, 3, 5, 7, 9, 13])
@pytest.mark.parametrize("name", COUPLINGS)
@pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning")
def test_any_number_of_robots_is_compared_as_with_one_lane(name, n):
    """The number of robots is no multiple of that of lanes, and neighbours are in other lanes and rows."""
    assert_same_in_all_lanes(arms(n, COUPLINGS[name](n)), duration=0.006)


# -- features ---------------------------------------------------------------------------------------------


def rubbing(adapted: bool) -> Experiment:
    def change(i: int, member: Member) -> Member:
        known = FrictionParameters(member.robot) if adapted else member.parameters
        return replace(member, friction=Friction((0.1 * i, 0.2), 0.3 + i), parameters=known, theta_hat0=None)

    return each(arms(5), change)


def learning(adaptation: Callable, n: int = 5) -> Experiment:
    experiment = arms(n, gains=SMALL_GAINS.replace(Gamma=None), adaptation=Natural(0.1))
    return replace(experiment, adaptation=adaptation(experiment))


def boxed() -> Experiment:
    """Estimates that are at the walls of a box soon."""
    return learning(lambda e: Box(0.5, e.cell.theta_hat0 - 1e-4, e.cell.theta_hat0 + 1e-4))


def in_joints() -> Experiment:
    def change(i: int, member: Member) -> Member:
        return replace(member, trajectory=Cubic(member.q0 + 0.01, member.q0 + 0.1 * i, 0.13))

    return each(arms(3, Coupling.sum(3)), change, space=JointSpace())


def loaded(**options) -> Experiment:
    pushes = Disturbance(4, 0.4, 0.002, 0.006), Disturbance(0, (0.3, -0.1), 0.00303, 0.00507)
    loads = (
        Payload(4, 0.3),
        Payload(1, 0.2, start=0.002, stop=0.006),
        Payload(1, 0.1, (0.05, 0.0, 0.02), start=0.00403, stop=0.00707),
    )
    return arms(5, disturbances=pushes, payloads=loads, **options)


def cut() -> Experiment:
    """Arms whose torque is far beyond its limits."""
    return each(
        arms(5, gains=SMALL_GAINS.replace(K_r=2e3), saturate=True),
        lambda i, member: replace(member, v0=np.array([0.5 - i, 0.3])),
    )


def damped() -> Experiment:
    space = CartesianSpace("xy", singularity="damped")
    return each(
        arms(5), lambda i, member: replace(member, q0=[0.3, 0.05 + 0.1 * i]), space=space, gains=GENTLE
    )


def moving(n: int = 5) -> Coupling:
    return Coupling.chain(n, c=moving_weights(np.random.default_rng(n), n, 2))


FEATURES: dict[str, tuple[Callable[[], Experiment], dict]] = {
    "friction": (partial(rubbing, False), {}),
    "adapted friction": (partial(rubbing, True), {}),
    "loads and pushes": (loaded, {}),
    "loads and pushes, sampled": (loaded, {"control_period": 3e-3}),
    "loads and pushes, a log that is thinned": (loaded, {"log_dt": 4e-3}),
    "saturation": (cut, {}),
    "saturation, sampled": (cut, {"control_period": 2e-3, "log_dt": 4e-3}),
    "damped": (damped, {}),
    "joints": (in_joints, {}),
    "damping in the task": (partial(arms, 5, k_r_space="task"), {}),
    "as printed": (partial(arms, 5, reference_acceleration="paper"), {}),
    "moving weights, as printed": (lambda: arms(5, moving(), reference_acceleration="paper"), {}),
    "moving weights, sampled": (lambda: arms(5, moving()), {"control_period": 2e-3}),
    "a leak": (partial(arms, 5, gains=SMALL_GAINS.replace(leak=3.0)), {}),
    "leaps": (partial(learning, lambda _: Natural(0.1)), {"control_period": 2e-3}),
    "settles": (boxed, {}),
    "settles, sampled": (boxed, {"control_period": 2e-3}),
    "forgets": (partial(learning, lambda _: Composite(0.1, 0.5, 20.0), 3), {}),
    "another law": (lambda: arms(5, gains=SMALL_GAINS.independent(), law=ChungSlotine(2.0)), {}),
    "clocks": (partial(arms, 5, clocks=[0.0, 0.1, 0.003, 0.2, 0.05]), {}),
}


@pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning")
@pytest.mark.parametrize("name", FEATURES)
def test_what_a_cell_may_have_has_the_same_bits_in_any_number_of_lanes(name):
    make, options = FEATURES[name]
    assert_same_in_all_lanes(make(), (1, 4, 8), duration=0.012, **options)


# -- motions that break -----------------------------------------------------------------------------------


@pytest.mark.parametrize("clocks", [0.0, [0.0, 0.002, 0.0004]], ids=["one clock", "clocks ahead"])
@pytest.mark.parametrize("length", [1, 3, 1024])
@pytest.mark.parametrize("stop", [0.006, 0.0061, 0.0059999999999999, 0.01, 0.0099])
def test_a_motion_that_breaks_does_so_at_its_instant_in_blocks_of_any_length(
    stop, length, clocks, monkeypatch
):
    """Also at the border of a block of steps, or at the end of the run."""
    monkeypatch.setattr(tables, "BLOCK_STEPS", length)
    experiment = arms(3, motion=lambda tip: Cubic(tip, tip + 5e-4, stop), clocks=clocks, gains=GENTLE)
    assert_same_in_all_lanes(experiment, (1, 4), duration=0.01)


# -- how runs end -----------------------------------------------------------------------------------------


def stopped(experiment: Experiment, kind: type, **options) -> tuple[Outcome, Outcome]:
    """What becomes of a run that stops, by the reference engine and in lanes, however many these are."""
    expected = outcome(experiment, "pinocchio", **options)
    found, *others = (in_lanes(experiment, width, **options) for width in WIDTHS)
    assert not [differing(found, other) for other in others if differing(found, other)]
    assert found.error and expected.error and found.error[0] is expected.error[0] is kind
    return expected, found


@pytest.mark.parametrize("which", [(0,), (3,), (4,), (4, 1), (3, 2, 0)])
def test_a_robot_that_meets_a_singular_configuration_is_named(which):
    """Of several at one instant it is the first, whatever row and lane it stands in."""

    def change(i: int, member: Member) -> Member:
        robot = load_robot("planar2r")
        q0 = np.array([0.3, 1e-2 if i in which else 1.2])
        v0 = np.array([0.0, -3.0 if i in which else 0.0])
        return Member(
            robot, Hold(robot.tip_position(q0)[:2]), q0, v0, theta_hat0=0.5 * robot.inertial_parameters
        )

    gentle = Gains(Lambda=0.1, beta=0.1, K_r=0.1, K_eps=0.1, Gamma=1e-3)
    experiment = each(arms(5, gains=gentle), change)
    expected, found = stopped(experiment, SingularJacobianError, duration=0.02)
    assert found.error[2:4] == expected.error[2:4] == (found.error[2], min(which))
    assert not apart(expected, found)


@pytest.mark.parametrize("which", [0, 3, 4])
def test_a_robot_that_runs_away_is_named(which):
    Gamma = np.full((5, 20), 0.2)
    Gamma[which] = 1e6
    _, found = stopped(arms(5, gains=SMALL_GAINS.replace(Gamma=Gamma)), NonFiniteError, duration=0.02)
    assert found.error[3] == which


@pytest.mark.parametrize("first", [0, 1, 3])
def test_of_equal_steps_the_worst_is_that_of_the_first_robot(first):
    """Some arms are quick, all in the same way; the last one, which fills spare lanes, is one of them."""
    robot = load_robot("planar2r")

    def change(i: int, member: Member) -> Member:
        quick, q0 = i in (first, 4), np.array([0.3, 1.2])
        path = Cubic(q0, q0 + (0.5 if quick else 0.1), 0.05)
        return Member(robot, path, q0, theta_hat0=robot.inertial_parameters)

    alone = SMALL_GAINS.independent()
    experiment = each(arms(5, gains=alone), change, space=JointSpace())
    for width in WIDTHS:
        found = in_lanes(experiment, width, duration=0.02).info["step_error"]
        assert found["robot"] == first and found["estimate"] > 0
