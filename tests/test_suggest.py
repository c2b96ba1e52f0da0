"""Gains for a bandwidth: they hold what they promise, and work on arms of all sizes."""

from __future__ import annotations

import re
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from sliders import GANTRY, load, pair

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
sys.path.insert(0, str(SCRIPTS))

from bench_gains import BANDWIDTH, LOAD, NAIVE, bench, cell, run, task  # noqa: E402

from synctrl import (  # noqa: E402
    Cell,
    Coupling,
    Friction,
    FrictionParameters,
    Gains,
    Hold,
    JointSpace,
    Member,
    load_robot,
)
from synctrl.control.adaptation import Gradient  # noqa: E402
from synctrl.control.excursion import POINTS, excursion  # noqa: E402
from synctrl.control.learning_scale import learning_scale  # noqa: E402
from synctrl.errors import GainWarning, InputError, UnreachableError  # noqa: E402
from synctrl.experiments import a460_pair, panda_four, planar_four, ur5_payload  # noqa: E402
from synctrl.robots.parameters import LinearParameters  # noqa: E402
from synctrl.robots.payload import Payload, carrying  # noqa: E402
from synctrl.robots.pseudo_inertia import pseudo_inertia, pullback  # noqa: E402

UR5, PLANAR = load_robot("ur5"), load_robot("planar2r")
CELLS = {"planar": planar_four, "A460": a460_pair, "Panda": panda_four, "UR5 pair": ur5_payload}
OMEGA, DT = 5.0, 1e-3


@pytest.fixture(params=CELLS)
def suggested(request):
    """A ready cell and what is suggested for it."""
    found = CELLS[request.param]().cell
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GainWarning)
        return found, Gains.suggest(found, OMEGA, dt=DT)


def fastest(found: Cell, gains: Gains) -> float:
    """The largest rate of the loop in the states that are looked at, 1/s."""
    states, L = excursion(found, 5.0), found.coupling.matrix.T @ found.coupling.matrix
    modes = [
        np.linalg.eigvals(np.linalg.solve(robot.mass_matrix(q[i, : robot.nv]), np.diag(gains.K_r[i])))
        for i, robot in enumerate(found.robots)
        for q in states.q
    ]
    return float(np.max(np.real(modes)) + gains.Lambda + gains.beta * np.linalg.eigvalsh(L)[-1])


def test_everything_in_the_loop_stays_below_what_the_step_can_follow(suggested):
    assert fastest(*suggested) <= 0.35 * 2.78 / DT * (1 + 1e-6)


def test_every_constant_delay_is_tolerated_with_room_to_spare(suggested):
    found, gains = suggested
    d_max = (found.coupling.matrix**2).sum(axis=0).max()
    states = excursion(found, 5.0)
    for i, robot in enumerate(found.robots):
        cJ = states.weighted[:, i, :, : robot.nv]
        added = d_max / (4 * gains.Lambda) * (cJ.mT * gains.K_eps) @ cJ
        slack = np.diag(gains.K_r[i]) - 4 * (1 - 1e-9) * added  # a quarter of what is possible
        root = 1 / np.sqrt(gains.K_r[i])
        assert np.linalg.eigvalsh(root[:, None] * slack * root).min() >= -1e-9


def test_the_estimates_move_no_faster_than_the_damping_along_the_path(suggested):
    found, gains = suggested
    states = excursion(found, 5.0)
    for i, (robot, parameters) in enumerate(zip(found.robots, found.parameters, strict=True)):
        K, nv = np.asarray(gains.K_r[i]), robot.nv
        for q, v, a in zip(*(part[:POINTS, i, :nv] for part in states[:3]), strict=True):
            Y = parameters.regressor(q, v, v, a)
            bound = 0.5 / OMEGA * np.diag(1 / K) + robot.mass_matrix(q) / K[:, None] / K / 6
            learned = (Y * gains.Gamma[i]) @ Y.T
            assert np.linalg.eigvals(bound @ learned).real.max() <= 1 + 1e-9


@pytest.mark.parametrize(("word", "room"), [("period", 0.6 * 2.0), ("dt", 0.35 * 2.78)])
def test_a_longer_period_or_step_takes_damping_from_joints_that_are_too_light_for_it(word, room):
    light = cell(task("ur3", "joint"), 2)
    short, long = (Gains.suggest(light, OMEGA, payload=0.0, **{word: time}) for time in (1e-3, 8e-3))
    assert fastest(light, long) <= room / 8e-3 * (1 + 1e-6) < fastest(light, short)
    assert (long.K_r <= short.K_r).all()


def test_a_load_asks_for_more_damping():
    pair = cell(task("ur5", "joint"), 2)
    empty, loaded = (Gains.suggest(pair, OMEGA, payload=mass) for mass in (0.0, 2.0))
    assert (loaded.K_r >= empty.K_r).all()
    assert loaded.K_r.max() > 1.05 * empty.K_r.max()


def test_robots_of_different_kinds_get_rows_of_their_own():
    from synctrl.experiments import mixed_four

    mixed = mixed_four().cell
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GainWarning)
        gains = Gains.suggest(mixed, OMEGA)
    assert [len(row) for row in gains.K_r] == [robot.nv for robot in mixed.robots]
    assert [len(row) for row in gains.Gamma] == [len(p.theta) for p in mixed.parameters]


# -- what is said ------------------------------------------------------------------------------------------


def test_a_bandwidth_that_a_robot_cannot_have_is_said():
    pair = cell(task("panda", "joint"), 2)
    with pytest.warns(GainWarning, match=r"K_r of arm 0 gives"):
        Gains.suggest(pair, 200.0)


def test_a_period_that_is_too_long_for_the_bandwidth_is_said():
    with pytest.warns(GainWarning, match=r"Lambda gives"):
        Gains.suggest(a460_pair().cell, OMEGA, period=0.1)


def test_damping_that_the_period_cuts_below_what_bears_the_load_is_said_with_the_sag():
    pair, load = cell(task("ur3", "joint"), 2), 2.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Gains.suggest(pair, OMEGA, payload=load)
    with pytest.warns(GainWarning, match=r"0.1 rad \(m\) of sag .*: arm 0, joint 4: ") as told:
        gains = Gains.suggest(pair, OMEGA, period=4e-3, payload=load)
    robot, states = pair.robots[0], excursion(pair, 5.0)
    carried = carrying(robot, Payload(0, load))
    known, whole = ([arm.gravity(q)[3] for q in states.q[:, 0]] for arm in (robot, carried))
    missing = np.max(0.3 * np.abs(known) + np.abs(np.subtract(whole, known)))
    said = re.search(r"arm 0, joint 4: (\S+) rad", str(told[0].message))
    assert float(said[1]) == pytest.approx(missing / (gains.K_r[0][3] * gains.Lambda), rel=1e-2)


def test_a_start_far_off_the_path_is_said_before_it_breaks_anything():
    path = Hold(np.array([0.1, -1.2, 0.8, -0.6, 0.4, 0.3]))
    near, far = (Member(UR5, path, path(0.0).x + shift) for shift in (0.0, 0.5))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Gains.suggest(Cell([near, near], Coupling.pair()), OMEGA)
    with pytest.warns(GainWarning, match=r"robot 2, joint \d: a start 0.5 rad off"):
        Gains.suggest(Cell([near, far], Coupling.pair()), OMEGA)


def test_the_start_of_a_slide_is_told_in_metres_and_newtons(tmp_path):
    slides = pair((load(tmp_path, "gantry", GANTRY, effort=100.0),) * 2).cell
    far = [replace(member, q0=np.array([5.2, 0.2, 0.2])) for member in slides.members]
    with pytest.warns(GainWarning, match=r"joint 1: a start 5 m off .* takes about \S+ N, .* of 100 N;"):
        Gains.suggest(Cell(far, slides.coupling), OMEGA)


def test_a_limit_that_gravity_alone_passes_is_not_blamed_on_the_start(tmp_path):
    slides = pair((load(tmp_path, "weak", GANTRY, effort=10.0),) * 2).cell
    on_path = [replace(member, q0=None) for member in slides.members]
    with pytest.warns(GainWarning, match=r"joint 3: gravity at the start takes 19.6 N, .* of 10 N;"):
        Gains.suggest(Cell(on_path, slides.coupling), OMEGA)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("bandwidth", {"bandwidth": 0.0}),
        ("bandwidth", {"bandwidth": "5"}),
        ("period", {"bandwidth": 5.0, "period": -1e-3}),
        ("payload", {"bandwidth": 5.0, "payload": -1.0}),
        ("dt", {"bandwidth": 5.0, "dt": np.nan}),
        ("duration", {"bandwidth": 5.0, "duration": 0.0}),
        ("cell", {"bandwidth": 5.0, "cell": "a460"}),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(name, arguments):
    with refused(InputError, name):
        Gains.suggest(**{"cell": a460_pair().cell, **arguments})


def test_a_path_out_of_reach_is_refused():
    what = task("ur5", "position")
    member = Member(what.robot, Hold([5.0, 0.0, 0.0]), what.q0)
    with refused(UnreachableError):
        Gains.suggest(Cell([member, member], Coupling.pair(), what.space), OMEGA)


def test_parameters_of_an_unknown_kind_are_refused_by_name():
    with refused(InputError, "parameters"):
        learning_scale(object(), UR5, np.zeros((1, 6)))


# -- the sizes of parameters -------------------------------------------------------------------------------


def test_the_rates_are_the_inverse_hessian_of_the_volume_of_a_body():
    """-log det P by central differences: its inverse Hessian has the diagonal tr(D_k P D_k P)."""
    theta = UR5.inertial_parameters[20:30]

    def potential(x: np.ndarray) -> float:
        return -np.linalg.slogdet(pseudo_inertia(x))[1]

    step = 1e-3 * np.sqrt(pullback(theta))
    at = [[[potential(theta + s * a + u * b) for s in (1, -1) for u in (1, -1)] for b in np.diag(step)]
          for a in np.diag(step)]  # fmt: skip
    scaled = np.array(at) @ [1, -1, -1, 1] / 4
    hessian = scaled / step[:, None] / step
    np.testing.assert_allclose(np.diag(np.linalg.inv(hessian)), pullback(theta), rtol=1e-3)


def test_the_rates_of_a_robot_do_not_depend_on_the_unit_of_length():
    """In millimetres mass is the same, first moments 1e3 and moments of inertia 1e6 times as large."""
    unit = np.tile(np.array([1.0, *[1e3] * 3, *[1e6] * 6]), 6)
    theta = UR5.inertial_parameters
    np.testing.assert_allclose(pullback(unit * theta), unit**2 * pullback(theta), rtol=1e-9)


def test_a_gradient_takes_its_rates_from_the_bodies_of_a_robot():
    matrix = Gradient.pullback(UR5, 0.2).Gamma[0]
    np.testing.assert_allclose(np.diagonal(matrix), 0.2 * pullback(UR5.inertial_parameters))
    with refused(InputError, "gamma"):
        Gradient.pullback(UR5, -1.0)
    with refused(InputError, "robot"):
        Gradient.pullback("ur5", 1.0)


KINDS = {
    "base": lambda: "base",
    "friction": lambda: FrictionParameters(UR5),
    "friction and rotors": lambda: FrictionParameters(UR5, armature=True),
}


@pytest.mark.parametrize("kind", KINDS)
def test_parameters_of_every_kind_get_a_rate_each(kind):
    q0 = np.array([0.1, -1.2, 0.8, -0.6, 0.4, 0.3])
    member = Member(UR5, Hold(q0), parameters=KINDS[kind](), friction=Friction(0.5, 0.5))
    pair = Cell([member, member], Coupling.pair(), JointSpace())
    gains = Gains.suggest(pair, OMEGA)
    assert gains.Gamma.shape == (2, len(pair.parameters[0].theta))
    assert (gains.Gamma > 0).all()


def test_base_parameters_that_are_all_of_one_body_have_the_rates_of_their_body():
    """An identity as the map leaves the sizes as they are."""
    same = LinearParameters(PLANAR, np.eye(20), PLANAR.inertial_parameters, PLANAR.inertial_parameter_names)
    q = np.zeros((1, 2))
    np.testing.assert_allclose(learning_scale(same, PLANAR, q), pullback(PLANAR.inertial_parameters))


# -- it works on arms --------------------------------------------------------------------------------------

#: a large industrial arm, a light one, one with seven joints, and a small one
SHORT = [("a460", "joint"), ("a460", "position"), ("ur5", "pose"), ("xarm7", "position"), ("z1", "joint")]


@pytest.mark.parametrize(("name", "space"), SHORT)
def test_suggested_gains_do_the_task_with_and_without_a_load(name, space):
    found = cell(task(name, space), 2)
    heavy = min(LOAD, 0.2 * found.robots[0].inertial_parameters[::10].sum())
    for period in (None, 2e-3):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            gains = Gains.suggest(found, BANDWIDTH, period=period)
            for load in (0.0, heavy):
                outcome = run(found, gains, period, load)
                assert outcome.good, (period, load, outcome)


def test_the_bench_can_fail_for_gains_that_suit_no_arm_fail_on_most():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        outcomes = [run(cell(task(*which), 2), NAIVE, None, 0.0) for which in SHORT]
    assert sum(outcome.good for outcome in outcomes) < len(outcomes) / 2


def test_the_bench_goes_through_pairs_and_rings():
    rows = list(bench(["planar2r"], BANDWIDTH, (0.0,), (None,), (2, 3)))
    assert [(row[1], row[2]) for row in rows] == [(s, n) for s in ("joint", "position") for n in (2, 3)]
    assert all(row[-1].good for row in rows)
