"""Every erratum of docs/theory.md, demonstrated: what the paper prints, and what holds instead."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from held import carried_along, evaluate_held
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq
from theory_cells import GAINS, coupling, experiment, planar_arm

from synctrl import Cell, Coupling, Disturbance, Experiment, Friction, FunctionTrajectory, Hold, Member
from synctrl.analysis import certify
from synctrl.analysis.gain_condition import margins, rate_matrix
from synctrl.analysis.growth import first_growth
from synctrl.analysis.lyapunov import lyapunov
from synctrl.assembly.grasp import Fixture
from synctrl.control.controller import Controller
from synctrl.coupling.synchronization import SynchronizationFunction
from synctrl.errors import SimulationError, SynchronizationError, UnreachableError
from synctrl.experiments import a460_pair, carry_ur5, planar_four
from synctrl.experiments.a460_pair import FINAL, INITIAL
from synctrl.experiments.carry import GAINS as CARRY
from synctrl.experiments.mobile_robot import heading, radius
from synctrl.experiments.planar_four import Q0, TURN, D, R
from synctrl.experiments.quadratic import quadratic_analysis
from synctrl.simulation.closed_loop import ClosedLoop
from synctrl.simulation.plant import Plant

pytestmark = pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning")  # odd rings, rings of two
rng = np.random.default_rng(7)


def ring(n: int) -> np.ndarray:
    """S of the paper's ring."""
    return np.eye(n) + np.roll(np.eye(n), 1, axis=1)


def evaluate(run: Experiment, **changes: np.ndarray):
    """y' and signals at the initial state, parts of which may be changed."""
    loop, cell = run.closed_loop(), run.cell
    parts = {"q": cell.q0, "v": cell.v0, "theta_hat": cell.theta_hat0}
    parts["integral"] = np.zeros((cell.coupling.pairs, cell.m))
    parts.update(changes)
    y = np.concatenate([parts[name].ravel() for name in ("q", "v", "theta_hat", "integral")])
    return loop.evaluate(cell.references(np.zeros(1))[0], y, np.zeros_like(cell.q0))


def test_01_equation_16_is_the_rate_of_the_estimation_error_not_of_the_estimate() -> None:
    run = experiment(coupling("ring", 4, 2))
    result, (_, s) = run.simulate(1e-4, 1e-5), evaluate(run)
    right = 0.02 * np.vecmat(s.s_q, s.Y)  # (14)
    estimate = (result.theta_hat[1] - result.theta_hat[0]) / 1e-5
    np.testing.assert_allclose(estimate, right, atol=1e-2 * np.abs(right).max())
    # With the sign of (16) for theta_hat', what (22) sets to zero is twice the power of the model error.
    tilde = run.cell.theta - run.cell.theta_hat0
    power = np.vdot(s.s_q, np.matvec(s.Y, tilde))
    assert np.vdot(tilde / 0.02, -right) + power == pytest.approx(0, abs=1e-12 * abs(power))
    assert np.vdot(tilde / 0.02, right) + power == pytest.approx(2 * power)
    assert abs(power) > 1e-3


def test_02_condition_18_compares_with_the_wrong_eigenvalue() -> None:
    H, c_dot = np.array([[2.0, 1.9], [1.9, 2.0]]), np.diag([-1.0, 1.0])
    B = rate_matrix(H, np.eye(2), c_dot, np.eye(2), np.eye(2))
    margin, corrected, printed = margins(B, np.full(2, 1.0))
    assert printed <= 1.0 < corrected  # (18) holds, the quadratic form is positive all the same
    assert margin < 0
    assert margins(B, np.full(2, 1.01 * corrected))[0] > 0


@pytest.mark.parametrize("space", ["joint", "task"])
def test_02_condition_18_is_right_but_for_its_sign_where_c_is_a_number(space: str) -> None:
    """c = gamma 1: B = -(gamma'/gamma) H is symmetric in the coordinates of H, whichever they are."""
    gamma, gamma_dot, J = 1.7, -0.8, np.array([[1.2, 0.3], [-0.4, 0.9]])
    H, identity = np.array([[2.0, 1.9], [1.9, 2.0]]), np.eye(2)
    maps = (J, np.linalg.inv(J)) if space == "joint" else (identity, identity)
    B = rate_matrix(H, identity / gamma, gamma_dot * identity, *maps)
    _, corrected, printed = margins(B, np.ones(2))
    assert printed == pytest.approx(corrected)
    assert margins(B, np.full(2, printed))[0] == pytest.approx(0)  # equality, as (18) allows: V' may be 0


def test_02_joint_damping_must_be_compared_in_joint_coordinates() -> None:
    """K_r in N·m·s/rad against H_x d(c^-1)/dt c in N·s/m is no comparison: long links show it."""
    H_x, c_dot, J = np.eye(2), -np.eye(2), 2.0 * np.eye(2)
    K_r = np.full(2, 1.5)
    in_task = margins(rate_matrix(H_x, np.eye(2), c_dot, np.eye(2), np.eye(2)), K_r)
    assert in_task[1] < K_r.min()  # lambda_min(K_r) > lambda_max(sym(H_x d(c^-1)/dt c)) as numbers
    M, J_inv = J.T @ H_x @ J, np.linalg.inv(J)
    assert margins(rate_matrix(M, np.eye(2), c_dot, J, J_inv), K_r)[0] < 0  # and yet V' is positive
    s_q = np.array([1.0, 0.0])
    s = J @ s_q
    assert -s_q @ (K_r * s_q) + s @ (-H_x @ c_dot) @ s > 0


def test_03_the_exact_reference_acceleration_needs_no_condition() -> None:
    link, gains = coupling("ring", 4, 2, "moving"), GAINS.replace(K_r=0.01)
    exact = certify(experiment(link, gains).simulate(0.06, 1e-3))
    paper = certify(experiment(link, gains, reference_acceleration="paper").simulate(0.06, 1e-3))
    assert exact.gain_condition.margin < 0
    assert exact.certified
    assert paper.verdict == "outside the theorem"
    assert paper.growth is not None
    assert paper.growth.term == "weight rate"


def test_04_equation_38_has_two_merged_lines() -> None:
    n, k_eps, Lambda, beta = 5, 1.3, 0.7, 2.0
    w_dot, epsilon, integral = rng.normal(size=n), rng.normal(size=n), rng.normal(size=n)
    S = ring(n)
    epsilon_dot, sigma, E = S @ w_dot, S.T @ epsilon, S.T @ integral
    w = np.linalg.solve(S, epsilon)
    r = w_dot + beta * sigma + Lambda * (w + beta * E)
    left = k_eps * (S @ r) @ epsilon
    rate = k_eps * epsilon @ (epsilon_dot + Lambda * epsilon)
    right = rate + k_eps * beta * sigma @ sigma + k_eps * Lambda * beta * sigma @ E
    # As printed: the sum with beta over i >= 2 and the term with Lambda beta of i = 1 have become one
    merged = k_eps * Lambda * beta * sigma[1:].sum() * E[0] + k_eps * Lambda * beta * sigma[1:] @ E[1:]
    assert left == pytest.approx(right)
    assert left != pytest.approx(rate + k_eps * beta * sigma[0] ** 2 + merged)


@pytest.mark.parametrize("n", [3, 4, 5, 6])
def test_05_equation_43_has_the_wrong_sign_and_assumes_what_it_is_to_show(n: int) -> None:
    beta, S = 2.0, ring(n)
    integral = rng.normal(size=n)
    integral -= integral.mean()  # (42)
    w = -beta * S.T @ integral  # e* = 0 in (29)
    first = w[0] - w[1:].sum()
    assert first == pytest.approx(2 * beta * integral[1:-1].sum())  # + instead of -
    assert integral[1:-1].sum() != pytest.approx(integral.sum())  # the second equality of (43) needs
    assert integral[0] + integral[-1] != pytest.approx(0)  # I_1 + I_n = 0, which nothing has shown


@pytest.mark.parametrize("n", [2, 3, 4, 5, 8])
@pytest.mark.parametrize("kind", ["ring", "signed graph", "all-to-all"])
def test_05_the_weighted_errors_follow_from_e_star_and_epsilon_for_any_coupling(n: int, kind: str) -> None:
    S = coupling(kind if n > 2 else "pair", n, 1).matrix
    w, integral = rng.normal(size=n), rng.normal(size=len(S))
    e_star, epsilon = w + 2.0 * S.T @ integral, S @ w
    S_plus = np.linalg.pinv(S)
    N = np.eye(n) - S_plus @ S
    np.testing.assert_allclose(N @ S.T, 0, atol=1e-12)
    np.testing.assert_allclose(N @ e_star + S_plus @ epsilon, w, atol=1e-12)


def test_06_the_closed_loop_depends_on_time_and_lasalle_does_not_apply() -> None:
    run = experiment(coupling("ring", 4, 2))
    loop, y = run.closed_loop(), run.closed_loop().initial_state()
    now, later = run.cell.references(np.array([0.0, 0.3]))
    push = np.zeros_like(run.cell.q0)
    assert np.abs(loop.evaluate(now, y, push)[0] - loop.evaluate(later, y, push)[0]).max() > 0.1


def test_06_where_time_enters_zero_is_not_reached_although_v_dot_is_zero_only_there() -> None:
    """x' = -exp(-t) x, V = x^2 / 2: V' < 0 unless x = 0, yet x -> x_0 / e. Barbalat gives V' -> 0 alone."""
    t = np.linspace(0, 30, 3001)
    x = np.exp(np.exp(-t) - 1)
    V_dot = -np.exp(-t) * x**2
    np.testing.assert_allclose(np.gradient(x, t)[5:-5], -(np.exp(-t) * x)[5:-5], atol=2e-3)
    assert (V_dot < 0).all()
    assert V_dot[-1] == pytest.approx(0, abs=1e-12)
    assert x[-1] == pytest.approx(1 / np.e)


@pytest.mark.parametrize("n", [2, 3, 4, 5])
@pytest.mark.parametrize("kind", ["ring", "signed graph", "all-to-all"])
def test_06_the_step_for_which_lasalle_is_called_is_algebra(n: int, kind: str) -> None:
    """e* = 0 and epsilon = 0 at one instant leave no w, whatever moved before: no invariant set is needed."""
    S = coupling(kind if n > 2 else "pair", n, 1).matrix
    beta, reached = 2.0, np.linalg.svd(S)[0][:, : np.linalg.matrix_rank(S)]  # I stays in the range of S
    system = np.block([[np.eye(n), beta * S.T @ reached], [S, np.zeros((len(S), reached.shape[1]))]])
    assert np.linalg.matrix_rank(system) == n + reached.shape[1]  # e*, epsilon -> w, I


@pytest.mark.parametrize("n", [3, 5, 7, 9])
def test_07_an_odd_ring_has_no_synchronized_motion_and_a_signed_ring_has(n: int) -> None:
    odd, signed = Coupling.ring(n), Coupling.signed_ring(n)
    assert np.linalg.matrix_rank(odd.matrix) == n  # epsilon = 0 only where e = 0
    assert np.linalg.matrix_rank(signed.matrix) == n - 1
    together = np.ones((n, 1))
    np.testing.assert_array_equal(signed.compare(together), 0)  # all errors equal: synchronized
    alternating = np.array([(-1.0) ** i for i in range(n)])[:, None]
    epsilon = odd.compare(alternating * together)  # the same motion, in the weights (1, -1, 1, ...)
    np.testing.assert_array_equal(epsilon[:-1], 0)
    assert epsilon[-1] == 2.0  # the last "difference" is e_n + e_1


def test_07_an_even_ring_has_a_synchronized_motion() -> None:
    for n in (4, 6, 16):
        assert np.linalg.matrix_rank(Coupling.ring(n).matrix) == n - 1


def test_08_a_ring_of_two_is_the_pair_with_twice_beta_and_k_eps() -> None:
    double = GAINS.replace(beta=2 * GAINS.beta, K_eps=2 * GAINS.K_eps)
    of_two, pair, same = (
        experiment(link, gains).simulate(0.05, 1e-3).q
        for link, gains in ((Coupling.ring(2), GAINS), (Coupling.pair(), double), (Coupling.pair(), GAINS))
    )
    np.testing.assert_allclose(of_two, pair, rtol=1e-12)
    assert np.abs(of_two - same).max() > 1e-6


def test_09_example_3_has_second_order_coefficients_of_one_and_weights_without_inverse() -> None:
    analysis = quadratic_analysis()
    expansion = analysis.expansion
    for i in range(2):
        np.testing.assert_allclose(expansion.second[0, i, i], np.eye(2), atol=1e-6)  # not -2
    xd, e = np.array([[0.3, 0.0], [0.4, 0.0]]), rng.normal(size=(2, 2))
    x = xd - e
    series = sum(-2 * xd[i] @ e[i] + e[i] @ e[i] for i in range(2))
    assert (x**2).sum() - (xd**2).sum() == pytest.approx(series)
    assert expansion.c.shape == (2, 1, 2)  # row vectors
    assert not expansion.invertible
    assert analysis.refusal


def test_09_example_3_is_not_linear_and_assumption_1_excludes_it() -> None:
    one, other = rng.normal(size=(2, 2, 2))

    def f(x: np.ndarray) -> float:
        return float((x**2).sum()) - 1.0

    middle = f((one + other) / 2) - (f(one) + f(other)) / 2  # 0 for what Assumption 1 calls linear
    assert middle == pytest.approx(-((one - other) ** 2).sum() / 4)


def test_10_scaling_f_scales_epsilon_and_by_its_square_k_eps() -> None:
    one, five = (Coupling.pair((a, -a)) for a in (1.0, 5.0))
    first = experiment(one).simulate(0.05, 1e-3)
    scaled = experiment(five).simulate(0.05, 1e-3)
    corrected = experiment(five, GAINS.replace(K_eps=GAINS.K_eps / 25)).simulate(0.05, 1e-3)
    assert np.abs(scaled.q - first.q).max() > 1e-6
    np.testing.assert_allclose(corrected.q, first.q, rtol=1e-11)
    np.testing.assert_allclose(corrected.sync_error, 5 * first.sync_error, atol=1e-12)
    normal = experiment(five.normalized()).simulate(0.05, 1e-3)
    np.testing.assert_allclose(normal.q, first.q, rtol=1e-11)


class LiteralController(Controller):
    """(13) and (14) as printed, with Cartesian x: task-space vectors are added to joint torques."""

    def evaluate(self, *state):
        s = super().evaluate(*state)
        slip = np.matvec(s.reference.c_inv, s.r)
        force = np.vecmat(self.K_eps * s.sigma, s.reference.c)
        tau = np.matvec(s.Y, state[-2]) + self.K_r * slip + force
        return replace(s, tau=tau, z_dot=self.adaptation.Gamma * np.vecmat(slip, s.Y))


class LiteralExperiment(Experiment):
    def closed_loop(self, plant: str = "pinocchio") -> ClosedLoop:
        return ClosedLoop(LiteralController(self.cell, self.gains), Plant(self.cell))


@pytest.mark.parametrize("synchronized", [True, False])
def test_11_the_literal_cartesian_form_diverges_within_half_a_second(synchronized: bool) -> None:
    ours = planar_four(synchronized)
    literal = LiteralExperiment(ours.cell, ours.gains, ours.duration)
    stopped = []
    for dt in (2e-3, 1e-3):
        with pytest.raises(SimulationError) as failure:
            literal.simulate(0.5, dt)
        stopped.append(failure.value)
    assert stopped[0].time < 0.5
    assert stopped[1].time == pytest.approx(stopped[0].time, rel=0.02)  # an escape, whatever the step
    escaped, result = stopped[1].result, ours.simulate(0.5, 2.5e-3)
    assert np.abs(escaped.tracking_error[-1]).max() > 2 * np.abs(result.tracking_error).max()
    half = len(escaped.t) // 2
    assert np.nanmax(np.abs(escaped.tau)) > 10 * np.abs(escaped.tau[:half]).max()
    assert np.abs(result.tracking_error[-1]).max() < 0.1 * np.abs(result.tracking_error).max()


def test_11_a_literal_force_is_no_torque_and_takes_power_that_the_proof_does_not_know() -> None:
    run = planar_four()
    _, s = evaluate(run, q=Q0 + rng.uniform(-0.05, 0.05, (4, 2)))
    force = np.vecmat(run.gains.K_eps * s.sigma, s.reference.c)
    power = np.vdot(np.matvec(s.task.J, s.s_q), force)
    assert power == pytest.approx(np.vdot(s.r, run.gains.K_eps * s.sigma))  # as the proof needs it
    assert np.vdot(s.s_q, force) != pytest.approx(power, rel=0.1)


def test_11_as_forces_along_x_all_of_13_fits_together_and_is_our_law_with_k_r_in_task_space() -> None:
    run = replace(planar_four(), k_r_space="task")
    _, s = evaluate(run, q=Q0 + rng.uniform(-0.05, 0.05, (4, 2)))
    model = np.vecmat(np.matvec(s.Y, s.theta_hat), np.linalg.inv(s.task.J))  # H_x c^-1 (...) + C_x c^-1 u
    slip = np.matvec(s.reference.c_inv, s.r)
    along_x = model + run.gains.K_r * slip + np.vecmat(run.gains.K_eps * s.sigma, s.reference.c)
    np.testing.assert_allclose(np.vecmat(along_x, s.task.J), s.tau, rtol=1e-9)


def test_12_the_estimate_does_not_enter_the_kinematics() -> None:
    run = planar_four()
    _, right = evaluate(run, theta_hat=run.cell.theta)
    _, wrong = evaluate(run)
    for name in ("v_ref", "a_ref", "e", "epsilon", "r"):
        np.testing.assert_array_equal(getattr(wrong, name), getattr(right, name))
    np.testing.assert_array_equal(wrong.task.J, right.task.J)
    assert np.abs(wrong.tau - right.tau).max() > 0.01
    for robot, q in zip(run.cell.robots, Q0, strict=True):
        along = np.exp(1j * np.cumsum(q)).sum()  # tip of two links of length 1
        J = robot.jacobian(q)[:2, 0]
        assert complex(*J) == pytest.approx(1j * 0.3 * along)  # the true lengths are in use
        assert abs(0.3 * along - 0.2 * along) > 0.1  # 0.2 m would miss by as much as the whole path


def in_other_time_unit(a: float, power: int) -> np.ndarray:
    """q of a run in which time counts a to the old unit, torque a^-2 and k_eps a^-power."""
    arm = planar_arm()
    scale = {"Lambda": 1 / a, "beta": 1 / a, "K_r": 1 / a, "K_eps": a**-power, "Gamma": a**2}
    gains = GAINS.replace(**{name: factor * getattr(GAINS, name) for name, factor in scale.items()})
    members = [
        Member(
            arm,
            FunctionTrajectory(
                lambda t: 0.3 + 0.1 * np.sin(2 * t / a) * np.ones(2),
                lambda t: 0.2 / a * np.cos(2 * t / a) * np.ones(2),
                lambda t: -0.4 / a**2 * np.sin(2 * t / a) * np.ones(2),
            ),
            q0=[0.2, 0.4 + 0.1 * i],
            theta_hat0=0.6 * arm.inertial_parameters,
        )
        for i in range(2)
    ]
    return Experiment(Cell(members, Coupling.pair()), gains, 0.05 * a).simulate(dt=1e-3 * a).q


def test_13_k_eps_is_a_torque_per_angle_not_per_angle_and_second() -> None:
    seconds, milliseconds = in_other_time_unit(1.0, 2), in_other_time_unit(1000.0, 2)
    np.testing.assert_allclose(milliseconds, seconds, rtol=1e-10)  # N·m/rad
    for power in (1, 3):  # the print may be read as N·m·s/rad or as N·m/(rad·s): both give another motion
        assert np.abs(in_other_time_unit(1000.0, power) - seconds).max() > 1e-6


def test_13_with_weights_in_metres_epsilon_is_in_square_metres() -> None:
    assert planar_four().cell.weighted_unit == "m²"
    assert a460_pair().cell.weighted_unit == "rad"


def test_14_a_robot_needs_the_errors_of_its_neighbours_and_nothing_else() -> None:
    run = experiment(coupling("ring", 5, 2, "constant"))
    cell = run.cell
    _, base = evaluate(run)

    def shaken(name: str, robots: list[int]) -> np.ndarray:
        parts = {"q": cell.q0, "v": cell.v0, "theta_hat": cell.theta_hat0}
        value = parts[name].copy()
        value[robots] += 0.1
        return evaluate(run, **{name: value})[1].tau

    for name in ("q", "v", "theta_hat"):  # robots 2 and 3 are no neighbours of robot 0
        np.testing.assert_array_equal(shaken(name, [2, 3])[0], base.tau[0])
    np.testing.assert_array_equal(shaken("theta_hat", [1, 4])[0], base.tau[0])
    for name in ("q", "v"):  # of its neighbours it feels e and e'
        assert np.abs(shaken(name, [1])[0] - base.tau[0]).max() > 1e-6
        assert np.abs(shaken(name, [4])[0] - base.tau[0]).max() > 1e-6


def test_14_of_its_neighbours_a_robot_needs_the_weights_too() -> None:
    link = coupling("ring", 5, 2, "constant")
    c = link.weights(np.zeros(1), 2).c[0]

    def torque(changed: int | None) -> np.ndarray:
        own = c.copy()
        own[changed] *= 1.1
        other = Coupling(5, link.edges, link.signs, c if changed is None else own)
        return evaluate(experiment(other))[1].tau[0]

    np.testing.assert_array_equal(torque(2), torque(None))
    assert all(np.abs(torque(i) - torque(None)).max() > 1e-6 for i in (1, 4))


def test_15_the_desired_difference_of_the_two_robots_is_not_constant() -> None:
    difference = np.rad2deg([INITIAL[0, 0] - INITIAL[1, 0], FINAL[0, 0] - FINAL[1, 0]])
    np.testing.assert_allclose(difference, [58.1, 93.0], atol=0.05)
    paths = [m.trajectory for m in a460_pair().cell.members]
    same = SynchronizationFunction(lambda x_1, x_2, t: x_1 - x_2, robots=2, dimension=3)
    with pytest.raises(SynchronizationError):  # x_1 - x_2 = A, example 1, is not what this motion satisfies
        same.coupling(paths, 2.0)


def test_15_the_desired_cubics_move_the_wrists_apart_on_the_way() -> None:
    """Straight in joint space, they carry a payload whose length would have to change by a centimetre."""
    members = a460_pair().cell.members
    times = np.linspace(0.0, 2.0, 41)
    wrists = np.array([[m.robot.tip_position(m.trajectory(t).x) for m in members] for t in times])
    length = np.linalg.norm(wrists[:, 1] - wrists[:, 0], axis=1)
    assert np.ptp(length) == pytest.approx(10.5e-3, abs=1e-4)


def at_rest(friction: Friction, duration: float = 2.0, **changes: float):
    """A pair that is to hold its place, started off it."""
    arm = planar_arm(1)
    members = [
        Member(arm, Hold([0.3]), [q], theta_hat0=arm.inertial_parameters, friction=friction)
        for q in (0.2, 0.34)
    ]
    gains = GAINS.replace(**{"K_r": 2.0, "Gamma": 1e-6, **changes})
    return Experiment(Cell(members, Coupling.pair()), gains, duration).simulate(dt=2.5e-3)


def test_15_offsets_are_left_where_friction_is_outside_y_and_contradict_the_theorem_otherwise() -> None:
    rubbed, free = at_rest(Friction(coulomb=0.3, smoothing=0.01)), at_rest(Friction())
    left, gone = (np.abs(result.tracking_error[-1]).max() for result in (rubbed, free))
    assert left > 5 * gone
    assert certify(free).certified
    assert any("friction" in reason for reason in certify(rubbed).outside)


def test_16_the_integral_of_epsilon_vanishes_so_epsilon_changes_its_sign() -> None:
    result = at_rest(Friction(), 3.0)
    epsilon, integral = result.sync_error[:, 0, 0], result.sync_integral[:, 0, 0]
    assert abs(integral[-1]) < 2e-2 * np.abs(integral).max()
    assert epsilon.min() < 0 < epsilon.max()
    assert np.sign(epsilon[0]) == np.sign(integral[np.abs(integral).argmax()])
    overshoot = -np.sign(epsilon[0]) * epsilon
    assert overshoot.max() > 0.01 * np.abs(epsilon).max()


def test_16_without_beta_nothing_forces_epsilon_to_change_its_sign() -> None:
    result = at_rest(Friction(), 3.0, beta=0.0, K_eps=0.0, K_r=8.0)
    epsilon = result.sync_error[:, 0, 0]
    assert np.abs(epsilon[-1]) < 1e-3 * np.abs(epsilon[0])
    assert (np.sign(epsilon) == np.sign(epsilon[0])).all()
    assert result.sync_integral[-1, 0, 0] * np.sign(epsilon[0]) > 0.1 * np.abs(epsilon[0])


def test_17_table_2_contradicts_the_text_and_its_weights() -> None:
    c = np.array([R + D, -R, R, -(R + D)])  # (47)
    radii = {
        source: np.linalg.norm([m.trajectory.start for m in planar_four(radii=source).cell.members], axis=1)
        for source in ("text", "table")
    }
    np.testing.assert_allclose(radii["text"], [R, R + D, R + D, R])
    np.testing.assert_allclose(radii["table"], [R, R + D, R, R + D])
    # Equal turns of all robots, c_i R_i the same but for the sign: what (46) is for.
    assert np.ptp(np.abs(c) * radii["text"]) == pytest.approx(0)
    assert np.ptp(np.abs(c) * radii["table"]) > 1


def test_18_phi_is_limited_by_the_reach_of_the_arms() -> None:
    def slack(phi: float) -> float:
        """How far the end of the worst path stays inside the reach of 0.6 m."""
        ends = []
        for i, side in enumerate((-1, -1, 1, 1)):
            start, end = (
                (R, R + D, R + D, R)[i] * np.array([np.sin(a), np.cos(a)])
                for a in (side * phi, side * phi + TURN)
            )
            tip = 0.3 * sum(np.array([np.cos(a), np.sin(a)]) for a in np.cumsum(Q0[i]))
            ends.append(0.6 - np.linalg.norm(tip + end - start))
        return min(ends)

    limit = brentq(slack, 0.0, 1.0)
    assert limit == pytest.approx(0.34, abs=0.01)
    planar_four(phi=limit - 0.01).simulate(2e-3)
    with pytest.raises(UnreachableError):
        planar_four(phi=limit + 0.01).simulate()


def test_18_with_phi_of_a_tenth_the_cell_is_nearly_square() -> None:
    starts = [m.trajectory.start for m in planar_four(phi=0.1).cell.members]
    distance = {(i, j): math.dist(starts[i - 1], starts[j - 1]) for i, j in ((1, 4), (2, 3), (1, 2), (3, 4))}
    assert distance[1, 4] == pytest.approx(1.0, abs=0.01)
    assert distance[2, 3] == pytest.approx(1.2, abs=0.01)
    assert distance[1, 2] == pytest.approx(D)
    assert distance[3, 4] == pytest.approx(D)


def test_19_the_desired_motion_of_the_four_arms_does_not_satisfy_46() -> None:
    """Robots 1, 2 and 4, 3 move along mirrored arcs: across, (3) fails in y by a tenth of the motion."""
    c = np.array([R + D, -R, R, -(R + D)])
    paths = [m.trajectory for m in planar_four().cell.members]
    moved = np.array([path.end - path.start for path in paths])
    difference = Coupling.ring(4, c).compare(c[:, None] * moved)
    size = np.abs(c[:, None] * moved).max()
    np.testing.assert_allclose(difference[[0, 2]], 0, atol=1e-12 * size)  # 1-2 and 3-4: satisfied
    assert (np.abs(difference[[1, 3], 1]) > 0.05 * size).all()  # 2-3 and 4-1: not
    # The distances, which the task is about, do stay: all arms turn together about the origin.
    for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)):
        before, after = (math.dist(getattr(paths[i], at), getattr(paths[j], at)) for at in ("start", "end"))
        assert after == pytest.approx(before, rel=1e-12)


def test_20_equations_21_and_22_print_y_transposed() -> None:
    run = experiment(coupling("ring", 4, 2))
    _, s = evaluate(run)
    tilde = run.cell.theta - run.cell.theta_hat0
    assert s.Y.shape == (4, 2, 20)
    np.vdot(s.s_q, np.matvec(s.Y, tilde))  # r^T c^-T Y tilde is a number
    with pytest.raises(ValueError, match="mismatch"):  # numpy's words
        s.s_q[0] @ s.Y[0].T @ tilde[0]  # r^T c^-T Y^T tilde is not


def test_21_in_a_rigid_loop_epsilon_is_zero_and_synchronization_does_nothing() -> None:
    """Wherever a rigid object goes, both arms are wrong by the same, and torque is the independent one."""
    pair = [carry_ur5(synchronized=way) for way in (True, False)]
    for seed in range(3):
        moved, twist = np.random.default_rng(seed).normal(size=(2, 6)) * [[0.02], [0.1]]
        q, v = carried_along(pair[0], moved, twist)
        (_, s), (_, alone) = (evaluate_held(run, q, v) for run in pair)
        assert np.abs(s.e).max() > 1e-2 and np.abs(s.e_dot).max() > 1e-2
        assert max(np.abs(s.epsilon).max(), np.abs(s.epsilon_dot).max()) < 1e-10
        np.testing.assert_allclose(s.tau, alone.tau, atol=1e-8)


@pytest.mark.filterwarnings("ignore::synctrl.errors.GainWarning", "ignore::synctrl.errors.StepWarning")
@pytest.mark.parametrize(("stiffness", "error"), [(2e4, 1e-3), (1e4, -1e-3)])
def test_22_the_integral_turns_an_error_of_the_geometry_into_the_whole_force_of_the_fixtures(
    stiffness: float, error: float
) -> None:
    """It grows until both fixtures, springs in a row, give all of the error: K/2 times that.

    With soft fixtures and a high beta that takes half a second, and minutes of computing with others. What
    the error adds is the difference of two runs.
    """

    def inside(g: float) -> np.ndarray:
        gains = CARRY.replace(beta=40.0)
        made = carry_ur5(grasp=Fixture((stiffness, 1e3)), geometric_error=[g, 0, 0, 0, 0, 0], gains=gains)
        return made.simulate(0.5, dt=2e-3, log_dt=0.1).outputs["internal_force"][-1, 0, :3]

    added = np.linalg.norm(inside(error) - inside(0.0))
    assert added == pytest.approx(stiffness / 2 * abs(error), rel=0.05)


def test_23_the_two_forms_of_example_2_differ_by_a_factor_that_changes_with_time() -> None:
    """x_1/R_1 - x_2/R_2 = 0 and R_2 x_1 - R_1 x_2 = 0 are one task, with weights R_1 R_2 apart."""
    R_1, R_2 = (radius(np.linspace(0, 4, 9), wheel)[0] for wheel in (0, 1))
    fractions, products = np.array([-1 / R_1, 1 / R_2]), np.array([-R_2, R_1])  # c = -df/dx, (5)
    factor = products / fractions
    np.testing.assert_allclose(factor, [R_1 * R_2] * 2)
    assert np.ptp(factor) > 0.5 * factor.min()  # no constant, as in erratum 10: c' and (18) differ too


def test_23_displacements_satisfy_example_2_with_mean_radii_and_not_with_radii_of_curvature() -> None:
    """A vehicle that turns by theta on a curve of radii R_i(t): x_i' = R_i theta'."""
    t = np.linspace(0, 4, 4001)
    theta, theta_dot = heading(t)[:2]
    R = np.array([radius(t, wheel)[0] for wheel in (0, 1)])
    way = cumulative_simpson(R * theta_dot, x=t, initial=0.0)
    assert np.abs(np.subtract(*way / R)[-1]) > 1e-2 * theta[-1]
    mean = way[:, 1:] / theta[1:]  # as the cell of example 2 takes R_i: both wheels are then at theta
    np.testing.assert_allclose(np.subtract(*way[:, 1:] / mean), 0, atol=1e-12)


def test_24_what_is_not_in_y_theta_keeps_its_power_and_can_make_v_grow() -> None:
    """(22) cancels Y tilde. A torque d from outside has the power -s_q d, and nothing cancels that."""
    link, push = coupling("ring", 4, 2), Disturbance(0, -60.0, 0.01, 0.03)
    pushed = lyapunov(experiment(link, disturbances=(push,)).simulate(0.04, 1e-3))
    growth = first_growth(pushed)
    assert growth is not None and growth.term == "disturbance"
    assert first_growth(lyapunov(experiment(link).simulate(0.04, 1e-3))) is None


@pytest.mark.parametrize("n", [3, 4, 5, 6])
def test_25_equation_27_demands_n_minus_1_equations_or_n_where_the_task_has_one(n: int) -> None:
    whole, divided = Coupling.sum(n), Coupling.ring(n)
    assert np.linalg.matrix_rank(whole.matrix) == 1  # (6)
    assert np.linalg.matrix_rank(divided.matrix) == n - 1 + n % 2  # (27)
    w = np.zeros((n, 1))
    w[:2, 0] = 1.0, -1.0  # c_1 e_1 + c_2 e_2 = 0: the task is kept
    assert not whole.compare(w).any()
    assert divided.compare(w).any()  # and (27) asks for more


def test_26_arms_that_hold_one_object_feel_a_wrench_that_8_does_not_have() -> None:
    run = carry_ur5()
    moved, twist = np.random.default_rng(0).normal(size=(2, 6)) * [[0.02], [0.1]]
    q, v = carried_along(run, moved, twist)
    y_dot, s = evaluate_held(run, q, v)
    v_dot = run.closed_loop().split(y_dot)[1]
    arms = run.plant_type.keywords["robots"]
    needed = np.array([arm.inverse_dynamics(*state) for arm, *state in zip(arms, q, v, v_dot, strict=True)])
    assert np.abs(needed - s.tau).max() > 1.0  # N·m, of the object on the arms


def test_what_the_paper_calls_asymptotic_holds_with_any_of_beta_and_k_eps_switched_off() -> None:
    """V' <= 0 needs neither; without both the law is Slotine and Li's."""
    for part in ({"beta": 0.0}, {"K_eps": 0.0}, {"beta": 0.0, "K_eps": 0.0}):
        record = lyapunov(
            experiment(coupling("ring", 4, 2, "moving"), GAINS.replace(**part)).simulate(0.03, 1e-3)
        )
        assert first_growth(record) is None
        assert record.closes
