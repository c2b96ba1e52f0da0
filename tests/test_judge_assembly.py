"""MuJoCo as judge of robots that hold an object: one model of arms and object, from the same documents."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from refusals import refused
from test_rigid import TEAMS, Held

from synctrl import Hold, Member, Robot
from synctrl.assembly.body import CarriedObject
from synctrl.assembly.grasp import Fixture, Grasp, fixture_wrenches, grasp_matrix
from synctrl.assembly.judge import SprungChain, WeldedChain
from synctrl.assembly.judged import JudgedPlant, fixture_plant
from synctrl.assembly.plant import CarryingPlant
from synctrl.assembly.rigid import RigidPlant
from synctrl.coupling.cell import Cell
from synctrl.errors import InputError, MissingDependencyError
from synctrl.experiments import carry_ur5
from synctrl.robots.model import PerThread
from synctrl.tasks.measurement import Tips
from synctrl.tasks.rotations import exp

pytest.importorskip("mujoco", reason="MuJoCo is an extra: pip install 'synctrl[mujoco]'")

#: an object whose inertia has entries everywhere
TURNED = exp(np.array([0.4, -0.3, 0.9]))
BODY = CarriedObject(3.0, (0.05, -0.02, 0.03), TURNED @ np.diag([0.03, 0.05, 0.04]) @ TURNED.T)
#: equal accelerations up to rounding in chains of seven bodies
SAME = 1e-10


@cache
def both(grasp, duration, dt, **options):
    """A run, and the same with MuJoCo as the plant."""
    experiment = carry_ur5(grasp=grasp, **options)
    return [experiment.simulate(duration, dt=dt, plant=plant) for plant in ("pinocchio", "mujoco")]


def difference(runs, name: str) -> float:
    ours, theirs = (run.outputs[name] for run in runs)
    return float(np.abs(ours - theirs).max())


def test_fixtures_in_mujoco_move_arms_and_object_as_ours_do():
    runs = both("compliant", 0.04, 1e-3, geometric_error=True)
    assert difference(runs, "object_pose") < 1e-12
    force = np.abs(runs[0].outputs["hand_wrench"]).max()
    assert difference(runs, "hand_wrench") < 1e-9 * force > 1e-9
    assert difference(runs, "internal_force") < 1e-9 * force
    np.testing.assert_allclose(runs[1].q, runs[0].q, atol=1e-12)


def test_welds_in_mujoco_move_arms_and_object_as_grasps_that_do_not_give():
    """As far as MuJoCo's welds, of which it keeps a ten-thousandth soft, do not give themselves."""
    runs = both("rigid", 0.2, 2e-3)
    assert difference(runs, "object_pose") < 8e-6
    late = runs[0].t > 0.05  # after the welds have taken up the load that is there at once
    for name in ("hand_wrench", "internal_force"):
        ours, theirs = (run.outputs[name][late] for run in runs)
        assert np.abs(ours - theirs).max() < 4e-3 * np.abs(ours).max()


def test_a_judge_would_see_a_fifth_of_a_gram_and_a_stiffness_that_is_off_by_a_tenth_of_a_percent():
    experiment = carry_ur5()
    kept = experiment.plant_type.keywords
    ours = experiment.simulate(0.02, dt=1e-3)
    body = kept["body"]
    heavy = CarriedObject(body.mass + 2e-4, body.com, body.inertia)
    stiff = [replace(grasp, compliance=Fixture((1.001e5, 1.001e3))) for grasp in kept["grasps"]]
    for changed in ({"body": heavy}, {"grasps": stiff}):
        other = replace(experiment, plant_type=partial(fixture_plant, **{**kept, **changed}))
        theirs = other.simulate(0.02, dt=1e-3, plant="mujoco")
        assert difference((ours, theirs), "hand_wrench") > 1e-4


@pytest.mark.parametrize("team", [team for team in TEAMS if team != "joints that turn without end"])
def test_mujoco_ties_hands_of_every_kind_with_the_same_wrenches(team):
    held, rng = Held(team), np.random.default_rng(3)
    count = len(held.hands)
    K, D = np.tile([2e3] * 3 + [40.0] * 3, (count, 1)), np.tile([30.0] * 3 + [0.7] * 3, (count, 1))
    q, v, tau, pose, nu = held.state
    q = q + 1e-3 * rng.normal(size=q.shape) * (q != 0)
    chain = SprungChain(K, D, held.robots, held.hands, BODY, held.places)
    v_dot, nu_dot, h = chain.motion(q, v, tau, pose, nu)
    (p_h, _), R_h, J, _ = Tips(held.robots).poses(q, v)
    rows = [*held.hands]
    levers = held.arms @ held.R.T
    G = grasp_matrix(levers)
    hands = p_h[rows], R_h[rows], np.matvec(J, v)[rows]
    on_object, on_hands = fixture_wrenches(
        hands, (held.p + levers, held.R @ held.places[1], np.vecmat(nu, G)), K, D
    )
    load = np.matvec(G, on_object)
    np.testing.assert_allclose(h, load, atol=SAME * np.abs(load).max())
    given = BODY.mass_matrix(held.R) @ nu_dot + BODY.bias(held.R, nu[3:], held.robots[0].gravity_vector)
    np.testing.assert_allclose(given, load.sum(axis=0), atol=SAME * np.abs(load).max())
    for i, robot in enumerate(held.robots):
        joints = slice(0, robot.nv)
        needed = robot.inverse_dynamics(q[i, joints], v[i, joints], v_dot[i, joints])
        if i in rows:
            needed = needed - J[i, :, joints].T @ on_hands[rows.index(i)]
        np.testing.assert_allclose(needed, tau[i, joints], atol=SAME * np.abs(needed).max())


@pytest.mark.parametrize("seed", range(3))
def test_welds_give_the_accelerations_and_wrenches_of_a_closed_chain_to_two_percent(seed):
    held = Held("two of a kind", seed)
    parts = held.robots, held.hands
    ours = held.chain().motion(*held.state)
    theirs = WeldedChain(*parts, CarriedObject(3.0, (0.05, -0.02, 0.03), (0.03, 0.05, 0.04)), held.places)
    for one, other in zip(ours, theirs.motion(*held.state), strict=True):
        assert np.abs(one - other).max() < 0.02 * np.abs(one).max()


def test_the_library_that_is_asked_for_makes_the_plant():
    for grasp, kinds in (("compliant", (CarryingPlant, JudgedPlant)), ("rigid", (RigidPlant, RigidPlant))):
        experiment = carry_ur5(grasp=grasp)
        for plant, kind in zip(("pinocchio", "mujoco"), kinds, strict=True):
            assert type(experiment.closed_loop(plant).plant) is kind
    with refused(InputError, "plant"):
        carry_ur5().simulate(0.01, plant="bullet")


# -- what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize("grasp", ["compliant", "rigid"])
def test_without_mujoco_the_message_says_how_to_get_it(grasp, monkeypatch):
    experiment = carry_ur5(grasp=grasp)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with refused(MissingDependencyError, "MuJoCo"):
        experiment.simulate(0.01, plant="mujoco")


def judged(robot: Robot, body: CarriedObject = BODY) -> JudgedPlant:
    """The judge of one robot that holds a body at its tip."""
    q = np.full(robot.nv, 0.5)
    place = robot.tip_pose(q)
    cell = Cell([Member(one, Hold(q), q0=q) for one in (robot, robot)], carry_ur5().cell.coupling)
    at = place.translation, place.rotation
    return JudgedPlant(cell, body=body, grasps=[Grasp(0)], at=at, physics="mujoco")


def test_robots_without_a_description_and_tips_that_are_no_links_are_refused():
    robot = carry_ur5().plant_type.keywords["robots"][0]
    bare = Robot(robot.model, robot.tip, name="bare")
    with refused(InputError, "plant='mujoco', robot 'bare'"):
        judged(bare).prepare()
    joint = Robot(robot.model, "wrist_3_joint", name="joint", document=robot.document)
    with refused(InputError, "plant='mujoco', robot 'joint'", found="wrist_3_joint"):
        judged(joint).prepare()
    assert isinstance(judged(robot)._mover._data, PerThread)


@pytest.mark.parametrize("seed", range(5))
def test_thin_plates_are_objects_to_mujoco_whichever_way_they_are_turned(seed):
    robot = carry_ur5().plant_type.keywords["robots"][0]
    R = exp(np.random.default_rng(seed).normal(size=3))
    plate = CarriedObject(2.0, inertia=R @ np.diag([0.02, 0.03, 0.05]) @ R.T)
    plant = judged(robot, plate)
    model = plant._mover.model
    axes = np.zeros(9)
    pytest.importorskip("mujoco").mju_quat2Mat(axes, model.body("object").iquat)
    axes = axes.reshape(3, 3)
    np.testing.assert_allclose(axes * model.body("object").inertia @ axes.T, plate.inertia, atol=1e-15)


def test_an_object_that_mujoco_refuses_is_refused_by_name():
    robot = carry_ur5().plant_type.keywords["robots"][0]
    with refused(InputError, "plant='mujoco', object"):
        judged(robot, CarriedObject(1e-16)).prepare()
