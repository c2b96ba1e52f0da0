"""Grasps that do not give: arms and object as one mechanism, and what control does there."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from held import posture
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Disturbance,
    Experiment,
    Gains,
    Hold,
    Member,
    Payload,
    load_robot,
)
from synctrl.analysis import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.assembly.body import CarriedObject, place_of, pose_of
from synctrl.assembly.grasp import Fixture, Grasp, grasp_matrix
from synctrl.assembly.holding import CLOSED
from synctrl.assembly.plant import CarryingPlant
from synctrl.assembly.rigid import RigidPlant
from synctrl.errors import InputError
from synctrl.experiments import carry_ur5
from synctrl.experiments.carry import PAYLOAD
from synctrl.robots.rigid_chain import RigidChain
from synctrl.tasks.measurement import Tips
from synctrl.tasks.poses import AxisRotation, PoseTrajectory
from synctrl.tasks.rotations import exp, skew

BODY = CarriedObject(3.0, (0.05, -0.02, 0.03), (0.03, 0.05, 0.04))

TEAMS = {
    "two of a kind": (("ur5", "ur5"), (0, 1)),
    "of different kinds": (("ur5", "panda"), (0, 1)),
    "redundant, and one that holds nothing": (("panda", "ur5", "xarm7"), (0, 2)),
    "joints that turn without end": (("kinova", "kinova"), (1, 0)),
    "four": (("ur5", "panda", "ur5", "ur5"), (0, 1, 2, 3)),
    "one": (("ur5",), (0,)),
}


class Held:
    """A team in a random state in which its hands hold `BODY`, and random torques."""

    def __init__(self, team: str, seed: int = 0):
        rng = np.random.default_rng(seed)
        names, self.hands = TEAMS[team]
        self.robots = [
            load_robot(name).placed(rng.normal(size=3), rng.normal(size=3)).with_armature(0.05)
            for name in names
        ]
        self.joints = [robot.nv for robot in self.robots]
        self.q, self.v, self.tau = np.zeros((3, len(names), max(self.joints)))
        for i, nv in enumerate(self.joints):
            self.q[i, :nv], self.tau[i, :nv] = rng.uniform(0.4, 1.4, nv), 20 * rng.normal(size=nv)
        self.nu, self.R = rng.normal(size=6), exp(rng.normal(size=3))
        self.p = 0.3 * rng.normal(size=3)
        (p_h, _), R_h, J, _ = Tips(self.robots).poses(self.q, self.v)
        self.arms = (p_h[[*self.hands]] - self.p) @ self.R
        self.places = self.arms, self.R.T @ R_h[[*self.hands]]
        G = grasp_matrix(self.arms @ self.R.T)
        for i, G_i in zip(self.hands, G, strict=True):
            rest = 0.3 * rng.normal(size=self.joints[i])  # of which what moves no hand remains
            there = np.linalg.pinv(J[i, :, : self.joints[i]])
            v = rest + there @ (G_i.T @ self.nu - J[i, :, : self.joints[i]] @ rest)
            self.v[i, : self.joints[i]] = v

    def chain(self) -> RigidChain:
        return RigidChain(self.robots, self.hands, BODY.parameters, self.places)

    @property
    def state(self):
        return self.q, self.v, self.tau, pose_of(self.p, self.R), self.nu


def eliminated(held: Held):
    """v', nu' and h by elimination of the wrenches, in plain numpy.

    (M_o + sum W_i^-1) nu' = sum W_i^-1 a_i - c_o, h_i = W_i^-1 (a_i - nu'), with W_i and a_i the mobility and
    the acceleration of the body's frame by arm i alone.
    """
    _, _, J, J_dot = Tips(held.robots).poses(held.q, held.v)
    w, g = held.nu[3:], held.robots[0].gravity_vector
    left, right = BODY.mass_matrix(held.R), -BODY.bias(held.R, w, g)
    v_dot, parts = np.zeros(held.q.shape), []
    for i, robot in enumerate(held.robots):
        q, v, tau = (part[i, : robot.nv] for part in (held.q, held.v, held.tau))
        M, n = robot.mass_matrix(q), robot.inverse_dynamics(q, v, 0 * v)
        free = np.linalg.solve(M, tau - n)
        v_dot[i, : robot.nv] = free
        if i in held.hands:
            r = held.arms[held.hands.index(i)] @ held.R.T
            to_body, to_body_dot = np.eye(6), np.zeros((6, 6))  # twists of the hand to those of the body
            to_body[:3, 3:], to_body_dot[:3, 3:] = skew(r), skew(np.cross(w, r))
            J_o = to_body @ J[i, :, : robot.nv]
            a = J_o @ free + (to_body @ J_dot[i] + to_body_dot @ J[i])[:, : robot.nv] @ v
            W = J_o @ np.linalg.solve(M, J_o.T)
            parts.append((i, robot.nv, M, J_o, W, a))
            left, right = left + np.linalg.inv(W), right + np.linalg.solve(W, a)
    nu_dot = np.linalg.solve(left, right)
    wrenches = {}
    for i, nv, M, J_o, W, a in parts:
        wrenches[i] = np.linalg.solve(W, a - nu_dot)
        v_dot[i, :nv] -= np.linalg.solve(M, J_o.T @ wrenches[i])
    return v_dot, nu_dot, np.array([wrenches[i] for i in held.hands])


@pytest.mark.parametrize("team", TEAMS)
def test_a_closed_chain_moves_as_exact_elimination_says(team):
    for seed in range(2):
        held = Held(team, seed)
        found, expected = held.chain().motion(*held.state), eliminated(held)
        for one, other in zip(found, expected, strict=True):
            assert np.abs(one - other).max() < 2e-10 * max(1.0, np.abs(other).max())


def test_loops_stay_closed_in_their_accelerations_and_a_gap_is_drawn_together():
    held = Held("two of a kind")
    still = replace_velocity(held)
    chain = held.chain()
    for shift in (0.0, 1e-3):
        q, v, tau, pose, nu = still
        pose = pose + shift * np.eye(7)[0]
        v_dot, nu_dot, _ = chain.motion(q, v, tau, pose, nu)
        _, _, J, _ = Tips(held.robots).poses(q, v)
        G = grasp_matrix(held.arms @ held.R.T)
        apart = np.matvec(J, v_dot) - np.vecmat(nu_dot, G)  # of places on the body from hands, at rest
        np.testing.assert_allclose(apart[:, 0] / 100.0, shift, atol=2e-2 * shift + 1e-12)


def replace_velocity(held: Held):
    q, v, tau, pose, nu = held.state
    return q, 0 * v, tau, pose, 0 * nu


def test_copies_and_other_threads_compute_the_same():
    held = Held("of different kinds")
    chain = held.chain()
    expected = chain.motion(*held.state)
    for other in (copy.copy(chain), pickle.loads(pickle.dumps(chain))):
        for one, same in zip(other.motion(*held.state), expected, strict=True):
            np.testing.assert_array_equal(one, same)


def test_robots_in_different_gravity_hold_nothing_together():
    held = Held("two of a kind")
    model = pin.Model(held.robots[1].model)
    model.gravity.linear = np.zeros(3)
    floating = type(held.robots[1])(model, held.robots[1].tip, name="floating")
    with refused(InputError, "robot 'floating'", found=(0.0, 0.0, 0.0)):
        RigidChain([held.robots[0], floating], held.hands, BODY.parameters, held.places)


# -- the plant --------------------------------------------------------------------------------------------


@cache
def run(grasp="rigid", duration=0.32, dt=2e-3, **options):
    return carry_ur5(grasp=grasp, **options).simulate(duration, dt=dt, log_dt=dt)


@cache
def closed(**options):
    """A run of arms whose hands are on their places to the last bits, so that geometry is exact."""
    experiment = carry_ur5(grasp="rigid", **options)
    p, R = experiment.plant_type.keywords["at"]
    members = [replace(m, q0=posture(m.robot, p, R, m.q0)) for m in experiment.cell.members]
    cell = Cell(members, experiment.cell.coupling, experiment.cell.space)
    return replace(experiment, cell=cell).simulate(0.16, dt=1e-3)


def off_closure(result, plant) -> np.ndarray:
    """How far hands are from their places on the object, (T, k), m."""
    tips = Tips(plant.robots)
    p, R = place_of(result.outputs["object_pose"])
    hands = np.array([tips.poses(q, v)[0][0] for q, v in zip(result.q, result.v, strict=True)])
    return np.linalg.norm(hands - p[:, None] - plant.arms @ R.mT, axis=2)


def test_hands_do_not_leave_their_places():
    apart = off_closure(run(), carry_ur5(grasp="rigid").closed_loop().plant)
    assert apart.max() < 1e-9


def test_runs_keep_the_order_of_the_method():
    experiment = carry_ur5(grasp="rigid")
    runs = [experiment.simulate(0.016, dt=4e-3 / 2**k) for k in range(4)]
    ends = [np.concatenate((one.outputs["plant_state"][-1], one.q[-1].ravel())) for one in runs]
    errors = [np.linalg.norm(end - ends[-1]) for end in ends[:-1]]
    assert errors[0] > 12 * errors[1] > 144 * errors[2] > 0


@pytest.mark.parametrize("grasp", ["rigid", "compliant"])
def test_what_is_told_of_wrenches_explains_how_arms_and_object_move(grasp):
    """Newton and Euler for the object, inverse dynamics with the opposite wrenches for the arms."""
    experiment = carry_ur5(grasp=grasp, friction=True)
    plant, rng = experiment.closed_loop().plant, np.random.default_rng(1)
    q, hidden, tau = experiment.cell.q0, plant.hidden0.copy(), 20 * rng.normal(size=(2, 6))
    J = Tips(plant.robots).poses(q, 0 * q)[2]
    arms = plant.arms @ place_of(hidden[:7])[1].T
    hidden[7:] = nu = 0.3 * rng.normal(size=6)
    v = np.linalg.solve(J, np.vecmat(nu, grasp_matrix(arms))[..., None])[..., 0]
    v_dot, hidden_dot = plant.move(q, v, tau, hidden)
    names = ("t", "q", "v", "tau", "disturbance", "plant_state")
    at = zip(names, (np.zeros(()), q, v, tau, 0 * tau, hidden), strict=True)
    h = plant.account({name: part[None] for name, part in at})[1]["hand_wrench"][0][0]
    for i, robot in enumerate(plant.robots):
        needed = robot.inverse_dynamics(q[i], v[i], v_dot[i]) + J[i].T @ h[i] + plant.friction(v)[i]
        np.testing.assert_allclose(needed, tau[i], atol=1e-8)
    R, g = place_of(hidden[:7])[1], plant.robots[0].gravity_vector
    load = np.matvec(grasp_matrix(arms), h).sum(axis=0)
    found = PAYLOAD.mass_matrix(R) @ hidden_dot[7:] + PAYLOAD.bias(R, nu[3:], g)
    np.testing.assert_allclose(found, load, atol=1e-8)


@pytest.mark.parametrize("grasp", ["rigid", "compliant"])
def test_the_momentum_of_the_object_is_what_hands_and_gravity_gave_it(grasp):
    result = run(grasp, 0.05, 2.5e-4)
    p, R = place_of(result.outputs["object_pose"])
    nu, h = result.outputs["object_twist"], result.outputs["hand_wrench"]
    plant = carry_ur5(grasp=grasp).closed_loop().plant
    r = np.matvec(R, PAYLOAD.com)
    momentum = PAYLOAD.mass * (nu[:, :3] + np.cross(nu[:, 3:], r))
    spin = np.matvec(R @ PAYLOAD.inertia @ R.mT, nu[:, 3:]) + np.cross(p + r, momentum)
    weight = PAYLOAD.mass * np.array(plant.robots[0].gravity_vector)
    force = h[..., :3].sum(axis=1) + weight
    at = p[:, None] + plant.arms @ R.mT
    moment = (h[..., 3:] + np.cross(at, h[..., :3])).sum(axis=1) + np.cross(p + r, weight)
    for kept, rate in ((momentum, force), (spin, moment)):
        given = simpson(rate, result.t[1] - result.t[0])
        np.testing.assert_allclose(given, kept[-1] - kept[0], atol=1e-6 * np.abs(rate).max())


def simpson(rate: np.ndarray, h: float) -> np.ndarray:
    """Integral over an even number of intervals."""
    return h / 3 * (rate[0] + 4 * rate[1:-1:2].sum(axis=0) + 2 * rate[2:-1:2].sum(axis=0) + rate[-1])


def test_arms_and_object_have_the_energy_that_torque_gave_them():
    result = run()
    plant = carry_ur5(grasp="rigid").closed_loop().plant

    def energy(k: int) -> float:
        (p, R), nu = place_of(result.outputs["object_pose"][k]), result.outputs["object_twist"][k]
        g = np.array(plant.robots[0].gravity_vector)
        total = 0.5 * nu @ PAYLOAD.mass_matrix(R) @ nu - PAYLOAD.mass * g @ (p + R @ PAYLOAD.com)
        for robot, q, v in zip(plant.robots, result.q[k], result.v[k], strict=True):
            total += 0.5 * v @ robot.mass_matrix(q) @ v
            total += pin.computePotentialEnergy(robot.model, robot.model.createData(), q)
        return float(total)

    power = np.sum(result.tau * result.v, axis=(1, 2))
    assert simpson(power, 2e-3) == pytest.approx(energy(-1) - energy(0), abs=1e-5 * np.abs(power).max())


# -- what control does ------------------------------------------------------------------------------------


def shared(result) -> np.ndarray:
    """J s_q of the body's frame by each arm, and the hands' wrenches less their shares, about its origin."""
    cell = result.experiment.cell
    h = result.outputs["hand_wrench"]
    plant = carry_ur5(grasp="rigid").closed_loop().plant
    G = grasp_matrix(plant.arms @ place_of(result.outputs["object_pose"])[1].mT)
    h = np.matvec(G, h)
    tips = Tips(cell.robots)
    J = np.array([tips.poses(q, v)[2] for q, v in zip(result.q, result.v, strict=True)])
    return np.matvec(J, result.v_error), h - h.mean(axis=1, keepdims=True)


def test_forces_inside_have_no_power_through_velocity_errors_if_geometry_is_exact():
    speed, inner = shared(closed())
    assert np.linalg.norm(inner[..., :3], axis=2).min() > 5.0
    power = np.sum(speed * inner, axis=(1, 2))
    assert np.abs(power).max() < 1e-8 < 1.0 < np.abs(speed * inner).sum(axis=(1, 2)).max()


def test_the_certificate_finds_that_power_too_and_a_lyapunov_function_that_only_falls():
    certificate = certify(closed())
    V = lyapunov(closed()).V
    assert (np.diff(V) < 1e-12 * V[0]).all() and V[-1] < 0.9 * V[0]
    assert all("RigidPlant" in reason for reason in certificate.outside)


def test_in_a_rigid_loop_of_exact_geometry_synchronization_does_nothing():
    """eps = 0 all the time, so neither beta nor K_eps have anything to act on."""
    with_it, without = closed(), closed(synchronized=False)
    assert np.abs(with_it.tracking_error).max() > 5e-3
    assert np.abs(with_it.sync_error).max() < 1e-10
    np.testing.assert_allclose(with_it.q, without.q, atol=1e-10)


def test_the_papers_integral_lets_force_grow_for_a_millimetre_of_error_that_cannot_vanish():
    error = (1e-3, 0.0, 0.0, 0.0, 0.0, 0.0)
    paper = run(duration=0.48, dt=4e-3, geometric_error=error)
    alone = run(duration=0.48, dt=4e-3, geometric_error=error, synchronized=False)
    apart = np.linalg.norm(paper.sync_error[:, 0, :3], axis=1)
    np.testing.assert_allclose(apart, 1e-3, rtol=1e-2)
    late = paper.t > 0.2
    forces = [np.linalg.norm(one.outputs["internal_force"][late, 0, :3], axis=1) for one in (paper, alone)]
    assert (np.diff(forces[0]) > 0).all() and forces[0][-1] > 1.3 * forces[1][-1]


def test_forces_inside_need_not_vanish_where_all_errors_do():
    """Arms that believe shares whose sum is right hold the object still, and press against each other."""
    experiment = carry_ur5(grasp="rigid")
    p, R = experiment.plant_type.keywords["at"]
    still = PoseTrajectory(Hold(p), AxisRotation.fixed(R))
    members = []
    for member, sign in zip(experiment.cell.members, (1.0, -1.0), strict=True):
        bare = load_robot("ur5").inertial_parameters
        share = member.robot.inertial_parameters - bare
        theta = member.robot.inertial_parameters + 0.5 * sign * share
        members.append(replace(member, trajectory=still, theta_hat0=theta))
    cell = Cell(members, experiment.cell.coupling, experiment.cell.space)
    result = replace(experiment, cell=cell).simulate(0.1, dt=2e-3)
    assert np.abs(result.tracking_error).max() < 1e-6
    force = np.linalg.norm(result.outputs["internal_force"][:, 0, :3], axis=1)
    assert force[-1] > 0.9 * force[0] > 4.0


def test_fixtures_come_closer_to_grasps_that_do_not_give_the_stiffer_they_are():
    rigid = run()
    late = rigid.t > 0.3
    off = []
    for k in (1e4, 1e5):
        soft = run(Fixture((k, k / 100), (0.3 * np.sqrt(k), 0.003 * np.sqrt(k))))
        off.append(
            [
                np.abs(soft.outputs[name] - rigid.outputs[name])[late].max()
                for name in ("object_pose", "hand_wrench")
            ]
        )
    assert (np.array(off)[1:] < 0.6 * np.array(off)[:-1]).all()


# -- what is refused --------------------------------------------------------------------------------------


def test_the_compiled_engine_refuses_grasps_that_do_not_give_by_name():
    with refused(InputError, "plant", found="synctrl.assembly.rigid.RigidPlant"):
        carry_ur5(grasp="rigid").simulate(0.01, engine="compiled")


def test_an_admittance_is_refused_since_its_force_would_depend_on_its_own_torque():
    experiment = carry_ur5(grasp="rigid")
    plant = experiment.closed_loop().plant
    with refused(InputError, "admittance", found="rigid"):
        plant.felt(experiment.cell.q0, experiment.cell.v0, plant.hidden0)


def test_pushes_friction_samples_and_limits_act_on_a_rigid_loop_and_are_seen_in_its_wrenches():
    push = Disturbance(0, np.full(6, 15.0), 0.004, 0.02)
    experiment = replace(carry_ur5(grasp="rigid", friction=True), disturbances=[push], saturate=True)
    result = experiment.simulate(0.016, dt=5e-4, control_period=2e-3)
    plant, g = experiment.closed_loop().plant, experiment.cell.robots[0].gravity_vector
    R, nu = place_of(result.outputs["object_pose"])[1], result.outputs["object_twist"]
    G = grasp_matrix(plant.arms @ R.mT)
    load = np.matvec(G, result.outputs["hand_wrench"]).sum(axis=1)
    within = [k for k in range(1, len(result.t) - 1) if k % 4 in (1, 2, 3)]  # torque jumps at every fourth
    for k in within:
        nu_dot = (nu[k + 1] - nu[k - 1]) / 1e-3
        found = PAYLOAD.mass_matrix(R[k]) @ nu_dot + PAYLOAD.bias(R[k], nu[k, 3:], g)
        np.testing.assert_allclose(found, load[k], atol=0.02 * np.abs(load).max())
    assert off_closure(result, plant).max() < 1e-9
    assert np.linalg.norm(load[9] - load[7]) > 0.1 * np.linalg.norm(load[7])  # the push comes at 8


def test_a_hand_off_its_place_is_refused():
    kept = carry_ur5(grasp="rigid").plant_type.keywords
    off = {**kept, "at": (kept["at"][0] + [0.0, 2e-6, 0.0], kept["at"][1])}
    with refused(InputError, "grasps, robot 'UR5 1'"):
        RigidPlant(carry_ur5().cell, **off)


def test_hands_that_move_apart_at_the_start_are_refused():
    experiment = carry_ur5(grasp="rigid")
    for speed, wrong in ((0.5 * CLOSED, False), (4 * CLOSED, True)):
        J = Tips(experiment.cell.robots).poses(experiment.cell.q0, experiment.cell.v0)[2]
        twist = np.array([speed, 0.0, 0.0, 0.0, 0.0, 0.0])
        first, second = experiment.cell.members
        moving = replace(first, v0=np.linalg.solve(J[0], twist))
        cell = Cell([moving, second], experiment.cell.coupling, experiment.cell.space)
        if not wrong:
            RigidPlant(cell, **experiment.plant_type.keywords)
            continue
        with refused(InputError, "grasps, robot 'UR5 1'"):
            RigidPlant(cell, **experiment.plant_type.keywords)


class Hinge(Fixture):
    """A fixture that lets the object turn about z."""

    K = np.array([1e5, 1e5, 1e5, 1e3, 1e3, 0.0])


def test_a_grasp_that_leaves_a_direction_free_is_refused():
    kept = carry_ur5(grasp="rigid").plant_type.keywords
    loose = [kept["grasps"][0], replace(kept["grasps"][1], compliance=Hinge())]
    with refused(InputError, "grasps, robot 'UR5 2'"):
        RigidPlant(carry_ur5().cell, **{**kept, "grasps": loose})


@pytest.mark.parametrize(("name", "q"), [("planar2r", (0.4, 0.9)), ("ur5", (0.0, -1.5, 2.0, -0.5, 0.0, 0.0))])
def test_an_arm_with_too_few_joints_and_one_in_a_singular_posture_are_refused(name, q):
    robot, q = load_robot(name), np.array(q)
    hand = robot.tip_pose(q)
    other = load_robot(name).placed((0.0, 0.0, 0.0), name="other")
    members = [Member(one, Hold(q), q0=q) for one in (robot, other)]
    options = {
        "body": BODY,
        "grasps": [Grasp(i, (0.0, 0.0, 0.0), hand.rotation) for i in range(2)],
        "at": (hand.translation, np.eye(3)),
    }
    cell = Cell(members, Coupling.pair())
    CarryingPlant(cell, **options)
    with refused(InputError, f"grasps, robot '{cell.names[0]}'"):
        RigidPlant(cell, **options)


@pytest.mark.filterwarnings("ignore::synctrl.errors.RobotWarning")  # of friction, which nobody asks for
def test_redundant_arms_of_different_kinds_carry_an_object_in_a_cell_of_ones_own():
    held = Held("of different kinds")
    members = [
        Member(robot, Hold(robot.tip_position(q[: robot.nv])), q0=q[: robot.nv])
        for robot, q in zip(held.robots, held.q, strict=True)
    ]
    cell = Cell(members, Coupling.pair(), CartesianSpace())
    grasps = [Grasp(i, held.arms[i], held.places[1][i]) for i in range(2)]
    options = {
        "body": BODY,
        "grasps": grasps,
        "at": (held.p, held.R),
        "payloads": (Payload(0, 1.0, start=0.02),),
    }
    plant = RigidPlant(cell, **options)
    assert plant.at(0.0) is plant
    later = plant.at(0.03)
    q, v, tau = cell.q0, cell.v0, held.tau
    assert (
        np.abs(later.move(q, v, tau, plant.hidden0)[0] - plant.move(q, v, tau, plant.hidden0)[0]).max() > 0.1
    )
    gains = Gains(Lambda=5.0, beta=2.0, K_r=5.0, K_eps=5.0, Gamma=0.05)
    kind = lambda cell, **more: RigidPlant(cell, **{**more, **options})  # noqa: E731
    result = Experiment(cell, gains, 0.05, plant_type=kind).simulate(dt=1e-3)
    assert off_closure(result, plant).max() < 1e-9
