"""Where hands take hold, and hands that close and open in the middle of a run."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from refusals import refused
from sliders import GANTRY, load, pair
from test_assembly import energies, rates_of_fixtures
from test_compiled_plant import both

from synctrl import Experiment, Payload, Result
from synctrl.analysis import certify
from synctrl.assembly.body import CarriedObject, place_of
from synctrl.assembly.grasp import Fixture, Grasp, fixture_wrenches
from synctrl.assembly.handling import HandlingPlant
from synctrl.assembly.plant import CarryingPlant
from synctrl.errors import InputError
from synctrl.experiments import carry_ur5
from synctrl.experiments.ur5_payload import payload_motion
from synctrl.tasks.rotations import exp, skew

# -- where hands take hold --------------------------------------------------------------------------------


def displaced(grasps: list[Grasp], way: float) -> CarryingPlant:
    """The plant of two UR5 with the payload somewhere else than the hands expect it."""
    experiment = carry_ur5()
    kept = experiment.plant_type.keywords
    at = kept["at"][0] + way, exp(np.full(3, way)) @ kept["at"][1]
    return CarryingPlant(experiment.cell, **{**kept, "at": at, "grasps": grasps})


def test_a_hand_without_a_place_takes_hold_wherever_it_is_and_begins_without_force():
    plant = displaced([Grasp(0), Grasp(1)], 5e-3)
    wrench = plant._wrenches(plant.cell.q0, plant.cell.v0, plant.hidden0)[0]
    assert np.abs(wrench / plant.K).max() < 1e-12


def test_a_hand_with_a_place_has_to_be_there():
    places = carry_ur5().plant_type.keywords["grasps"]
    with refused(InputError, "grasps, robot 'UR5 2'"):
        displaced([Grasp(0), places[1]], 2e-6)


def test_with_and_without_places_it_is_the_same_plant():
    experiment = carry_ur5()
    kept = experiment.plant_type.keywords
    free = CarryingPlant(experiment.cell, **{**kept, "grasps": [Grasp(i) for i in range(2)]})
    given = CarryingPlant(experiment.cell, **kept)
    np.testing.assert_array_equal(free.arms, given.arms)
    np.testing.assert_array_equal(free.turned, given.turned)


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Grasp(0, (0.0, 0.0)), "grasp, xyz"),
        (lambda: Grasp(0, (0.0, 0.0, 0.0), since=0.1), "grasp, xyz"),
        (lambda: Grasp(0, rotation=np.eye(3)), "grasp, rotation"),
        (lambda: Grasp(0, since=-0.1), "grasp"),
        (lambda: Grasp(0, since=0.2, until=0.2), "grasp"),
        (lambda: Grasp(0).object_in_hand, "grasp, xyz"),
        (lambda: displaced([Grasp(0, until=0.1)], 0.0), "grasps"),
        (lambda: displaced([Grasp(0), Grasp(0)], 0.0), "grasps"),
    ],
)
def test_a_grasp_that_says_too_little_or_too_much_is_refused(make, subject):
    with refused(InputError, subject):
        make()


# -- hands that close and open ----------------------------------------------------------------------------

BODY = CarriedObject(3.0, (0.02, 0.01, -0.03), (0.02, 0.06, 0.05))
SOFT = Fixture((800.0, 16.0), (8.0, 0.15))
#: the world lets go at .04 s, another hand closes at .08 s, the first opens at .12 s, that one at .16 s
WINDOWS = (Grasp(0, None, None, SOFT, 0.04, 0.12), Grasp(1, None, None, SOFT, 0.08, 0.16))
END = 0.2


@pytest.fixture(scope="module")
def gantries(tmp_path_factory):
    return pair((load(tmp_path_factory.mktemp("slides"), "gantry", GANTRY),) * 2)


def handling(experiment: Experiment, grasps=WINDOWS, **parts) -> Experiment:
    """Robots that handle an object between their hands."""
    hands = [robot.tip_pose(q) for robot, q in zip(experiment.cell.robots, experiment.cell.q0, strict=True)]
    middle = 0.5 * (hands[0].translation + hands[1].translation)
    options = {"body": BODY, "grasps": grasps, "at": (middle, np.eye(3))}
    return replace(experiment, plant_type=partial(HandlingPlant, **options), **parts)


@pytest.fixture(scope="module")
def run(gantries) -> Result:
    return handling(gantries).simulate(END, dt=5e-4)


def row(run: Result, t: float) -> int:
    (k,) = np.flatnonzero(np.abs(run.t - t) < 1e-9)
    return int(k)


def between(run: Result, *instants: float) -> list[slice]:
    """Rows between instants; the last of each is before what happens there."""
    rows = [row(run, t) for t in instants]
    return [slice(a, b) for a, b in pairwise(rows)]


def integral(t: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Of a smooth rate over time, from the first instant to each."""
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(t, rate, k=3).antiderivative()(t)


def test_until_a_hand_closes_the_world_holds_the_object(run):
    (still,) = between(run, 0.0, 0.04)
    for name in ("object_pose", "object_twist"):
        found = run.outputs[name][still]
        np.testing.assert_array_equal(found, np.broadcast_to(found[0], found.shape))
    assert not run.outputs["hand_wrench"][still].any() and not run.outputs["hand_closed"][still].any()


def test_hands_are_closed_in_their_windows_and_open_hands_do_nothing(run):
    closed = run.outputs["hand_closed"]
    for k, grasp in enumerate(WINDOWS):
        window = (run.t > grasp.since - 1e-9) & (run.t < grasp.until - 1e-9)
        np.testing.assert_array_equal(closed[:, k], window)
        assert not run.outputs["hand_wrench"][~window, k].any()
    alone = closed.sum(axis=1) < 2
    assert np.abs(run.outputs["internal_force"][alone]).max() < 1e-12
    assert np.abs(run.outputs["internal_force"][~alone]).max() > 0.1


def test_a_hand_that_closes_begins_with_the_force_of_its_damper_alone(run):
    for k, grasp in enumerate(WINDOWS):
        at = row(run, grasp.since)
        hidden = run.outputs["plant_state"][at]
        arm, nu = (
            place_of(hidden[:7])[1] @ hidden[14:].reshape(-1, 8)[k, 1:4],
            run.outputs["object_twist"][at],
        )
        slip = np.concatenate((run.v[at, k] - nu[:3] - skew(nu[3:]) @ arm, -nu[3:]))  # slides do not turn
        np.testing.assert_allclose(run.outputs["hand_wrench"][at, k], SOFT.D * slip, atol=1e-9)
        assert np.abs(slip).max() > 1e-3


def test_a_hand_that_closes_or_opens_leaves_all_that_moves_as_it_is(gantries, run):
    for t in (0.08, 0.12):
        until, at = handling(gantries).simulate(t, dt=5e-4), row(run, t)
        for now, then in ((run.q, until.q), (run.v, until.v)):
            np.testing.assert_array_equal(now[at], then[-1])
        before, after = until.outputs["plant_state"][-1], run.outputs["plant_state"][at]
        np.testing.assert_array_equal(before[:13], after[:13])
        assert (before[13:] != after[13:]).any()


def test_the_momentum_of_arms_and_object_changes_by_their_motors_and_weight_alone(gantries, run):
    """Of slides along three axes the momentum of the joints is that of the links, axis by axis."""
    robots, g = gantries.cell.robots, np.array(gantries.cell.robots[0].gravity_vector)
    R = place_of(run.outputs["object_pose"])[1]
    com = run.outputs["object_twist"][:, :3] + np.cross(run.outputs["object_twist"][:, 3:], R @ BODY.com)
    arms = sum(run.v[:, i] @ robots[i].mass_matrix(run.q[0, i]) for i in range(2))
    momentum = arms + BODY.mass * com
    held_up = np.array([robot.gravity(np.zeros(3)) for robot in robots]).sum(axis=0)
    acting = run.tau.sum(axis=1) - held_up + BODY.mass * g
    for rows in between(run, 0.04, 0.08, 0.12, 0.16, END):
        gained = integral(run.t[rows], acting[rows])
        np.testing.assert_allclose(momentum[rows] - momentum[rows][0], gained, atol=1e-6)
    assert np.abs(np.diff(momentum[row(run, 0.04) :], axis=0)).max() < 0.1  # and there is no jump in between


def test_energy_goes_into_dampers_and_is_lost_with_the_spring_of_a_hand_that_opens(gantries, run):
    plant = handling(gantries).closed_loop().plant
    hidden = run.outputs["plant_state"]

    def total(k: int, grips: np.ndarray) -> float:
        return energies(
            plant._held_now(np.concatenate((hidden[k, :13], grips))), run.q[k], run.v[k], hidden[k, :13]
        )

    def power(k: int) -> float:
        held = plant._held_now(hidden[k])
        slips = rates_of_fixtures(held, run.q[k], run.v[k], hidden[k, :13])
        return float(np.sum(run.tau[k] * run.v[k]) - np.sum(held.D * slips**2))

    for a, b in ((0.04, 0.08), (0.08, 0.12), (0.12, 0.16), (0.16, END)):
        first, last = row(run, a), row(run, b)
        grips = hidden[first, 13:]
        powers = [power(k) for k in range(first, last)]
        gained = integral(run.t[first:last], np.array(powers))[-1]
        assert total(last - 1, grips) - total(first, grips) == pytest.approx(gained, abs=5e-6)
    for grasp in WINDOWS:
        at = row(run, grasp.until)
        closed, opened = hidden[at - 1, 13:], hidden[at, 13:]
        spring = total(at, closed) - total(at, opened)
        assert spring > 1e-4  # J


def test_an_object_that_nobody_holds_falls(gantries, run):
    (falls,) = between(run, 0.16, END)
    t, R = run.t[falls] - 0.16, place_of(run.outputs["object_pose"][falls])[1]
    twist, g = run.outputs["object_twist"][falls], np.array(gantries.cell.robots[0].gravity_vector)
    com = run.outputs["object_pose"][falls, :3] + R @ BODY.com
    start = twist[0, :3] + np.cross(twist[0, 3:], R[0] @ BODY.com)
    np.testing.assert_allclose(com, com[0] + t[:, None] * start + 0.5 * t[:, None] ** 2 * g, atol=1e-10)
    spin = np.matvec(R @ BODY.inertia @ R.mT, twist[:, 3:])
    np.testing.assert_allclose(spin, np.broadcast_to(spin[0], spin.shape), atol=1e-10)


def test_fixtures_do_opposite_things_to_hands_and_object_about_any_point():
    rng = np.random.default_rng(0)
    p_h, p_g, nu_h, nu_g = rng.normal(size=(2, 2, 3)).tolist() + rng.normal(size=(2, 2, 6)).tolist()
    p_h, p_g, nu_h, nu_g = map(np.array, (p_h, p_g, nu_h, nu_g))
    turned = np.array([exp(rng.normal(size=3)) for _ in range(2)])
    on_object, on_hand = fixture_wrenches((p_h, turned, nu_h), (p_g, turned[::-1], nu_g), SOFT.K, SOFT.D)
    moment = (
        np.cross(p_g, on_object[:, :3]) + on_object[:, 3:] + np.cross(p_h, on_hand[:, :3]) + on_hand[:, 3:]
    )
    np.testing.assert_allclose(on_object[:, :3], -on_hand[:, :3])
    np.testing.assert_allclose(moment, 0.0, atol=1e-9)


def test_hands_that_never_open_make_the_plant_that_carries(gantries):
    grasps = [Grasp(0, None, None, SOFT), Grasp(1, None, None, SOFT)]
    experiment = handling(gantries, grasps)
    kept = experiment.plant_type.keywords
    carried = replace(experiment, plant_type=partial(CarryingPlant, **kept)).simulate(0.05, dt=1e-3)
    handled = experiment.simulate(0.05, dt=1e-3)
    for name in ("object_pose", "hand_wrench", "internal_force"):
        np.testing.assert_allclose(handled.outputs[name], carried.outputs[name], atol=1e-9)


def test_an_open_hand_feels_nothing_and_closed_ones_what_they_would_without_events(gantries):
    grasps = [Grasp(0, None, None, SOFT), Grasp(1, None, None, SOFT, until=0.1)]
    experiment = handling(gantries, grasps)
    plant, q, v = experiment.closed_loop().plant, gantries.cell.q0, gantries.cell.v0
    closed = [Grasp(i, None, None, SOFT) for i in range(2)]
    carried = CarryingPlant(gantries.cell, **{**experiment.plant_type.keywords, "grasps": closed})
    moved = plant.hidden0.copy()
    moved[:13] += 1e-2
    expected = carried.felt(q, v, moved[:13])
    assert np.abs(expected).max() > 1e-2
    np.testing.assert_allclose(plant.felt(q, v, moved), expected, atol=1e-9)
    opened = plant.meet(0.1, q, v, moved)[2]
    assert np.abs(plant.felt(q, v, opened)).max() < 1e-9  # one hand alone deforms nothing
    nobody = handling(gantries).closed_loop().plant
    assert not nobody.felt(q, v, nobody.hidden0).any()


def test_a_step_has_to_do_for_hands_that_close_later_too(gantries):
    always = [Grasp(grasp.robot, compliance=SOFT) for grasp in WINDOWS]
    later, first = (handling(gantries, some).closed_loop() for some in (WINDOWS, always))
    K_r = later.controller.K_r
    assert later.plant.longest_step(K_r) == first.plant.longest_step(K_r)
    limit = later.plant.longest_step(K_r)
    with refused(InputError, "dt", found=1.01 * limit):
        handling(gantries).simulate(5 * limit, dt=1.01 * limit)


def test_another_method_goes_the_same_way_through_hands_that_close_and_open(gantries, run):
    other = handling(gantries).simulate(0.13, dt=1e-3, integrator="DOP853", rtol=1e-8, atol=1e-9)
    same = slice(0, 2 * len(other.t) - 1, 2)
    np.testing.assert_allclose(other.t, run.t[same])
    for name in ("object_pose", "hand_closed"):
        np.testing.assert_allclose(other.outputs[name], run.outputs[name][same], atol=1e-6)


def test_a_hand_may_take_hold_again_and_of_an_object_that_falls(gantries):
    again = [Grasp(0, None, None, SOFT, until=0.04), Grasp(0, None, None, SOFT, since=0.06)]
    run = handling(gantries, again).simulate(0.1, dt=1e-3)
    fall = run.outputs["object_twist"][:, 2]
    assert fall[row(run, 0.06)] < fall[row(run, 0.04)] - 0.015 * 9.81
    assert (run.outputs["hand_wrench"][row(run, 0.06) :, 1, 2] > 0).all()
    places = run.outputs["plant_state"][-1, 14:].reshape(2, 8)[:, 1:4]
    assert np.linalg.norm(places[1] - places[0]) > 1e-3
    np.testing.assert_array_equal([g["arm"] for g in run.info["grasps"]], places)


def test_loads_of_the_robots_come_and_go_beside_what_their_hands_do(gantries):
    load = Payload(0, 1.0, start=0.06, stop=0.1)
    loaded = handling(gantries, payloads=[load]).simulate(END, dt=1e-3)
    free = handling(gantries).simulate(END, dt=1e-3)
    same = loaded.t < 0.06 - 1e-9
    np.testing.assert_array_equal(loaded.q[same], free.q[same])
    assert np.abs(loaded.q[-1] - free.q[-1]).max() > 1e-6
    assert loaded.outputs["hand_closed"].any(axis=0).all()


def test_a_run_with_hands_that_close_is_gone_through_again_and_is_outside_the_theorem(
    gantries, run, tmp_path
):
    run.save(tmp_path / "run.npz")
    again = Result.load(tmp_path / "run.npz")
    certificate = certify(again, handling(gantries))
    assert certificate.verdict != "covered by the theorem"
    assert any("HandlingPlant" in text and "4 of 400" in text for text in certificate.outside)


@pytest.mark.parametrize(
    "grasps", [[Grasp(0, until=0.1), Grasp(0, since=0.05)], [Grasp(1), Grasp(0), Grasp(1, since=0.1)]]
)
def test_a_hand_that_would_hold_twice_at_a_time_is_refused(gantries, grasps):
    with refused(
        InputError, f"grasps, robot '{gantries.cell.names[grasps[-1].robot]}'", found=grasps[-1].since
    ):
        handling(gantries, grasps).closed_loop()


@pytest.mark.parametrize("options", [{}, {"control_period": 3e-3, "log_dt": 3e-3}], ids=["often", "rarely"])
def test_hands_close_and_open_alike_in_both_engines(gantries, options):
    """On steps and between them; the world holds the object at first, and nobody does in between."""
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    windows = ((0, 0.0043, 0.012), (1, 0.008, 0.0162), (0, 0.02, None))
    grasps = [Grasp(robot, None, None, SOFT, *window) for robot, *window in windows]
    made = handling(gantries, grasps, payloads=[Payload(1, 0.5, start=0.01)])
    plant = partial(made.plant_type, desired=payload_motion())
    run, _ = both(replace(made, plant_type=plant), duration=0.03, dt=1e-3, **options)
    hands = {tuple(row) for row in run.outputs["hand_closed"]}
    assert hands == {(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)}
    assert np.abs(run.outputs["object_twist"][-1]).max() > 1e-3
