"""The gain condition: what (18) prints, what is right, and what each says about V'."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from refusals import refused
from theory_cells import GAINS, coupling, experiment, planar_arm

from synctrl import Cell, Coupling, Experiment, FunctionTrajectory, Member
from synctrl.analysis.gain_condition import gain_condition, gain_condition_in_box, margins, rate_matrix
from synctrl.analysis.lyapunov import lyapunov
from synctrl.errors import InputError

matrices = arrays(float, (2, 2), elements=st.floats(-2, 2))
BOX = np.array([-3.0, 0.3]), np.array([3.0, 2.8])


def growing(rates: tuple[float, float]) -> Coupling:
    """A pair with diagonal weights exp(rate t), so that d(c^-1)/dt c = -diag(rates) at all times."""
    a = np.array(rates)

    def c(t: float) -> tuple[np.ndarray, ...]:
        E = np.diag(np.exp(a * t))
        sign = np.array([1.0, -1.0])[:, None, None]
        return sign * E, sign * (a[:, None] * E), sign * (a[:, None] ** 2 * E)

    return Coupling.pair(c)


def test_18_can_hold_while_the_quadratic_form_is_positive() -> None:
    H = np.array([[2.0, 1.9], [1.9, 2.0]])
    rate = np.diag(
        [-1.0, 1.0]
    )  # c' c^-1 of diagonal weights: even diagonal c is enough, as H is not diagonal
    B = rate_matrix(H, np.eye(2), rate, np.eye(2), np.eye(2))
    K_r = np.array([1.0, 1.0])
    margin, corrected, printed = margins(B, K_r)
    assert K_r.min() >= printed  # (18) holds
    assert corrected > K_r.min()  # what it should compare with does not
    s = np.array([1.0, 0.0])
    assert s @ (B - np.diag(K_r)) @ s > 0  # and V' is positive for this s
    assert margin < 0


@given(B=matrices, s=arrays(float, 2, elements=st.floats(-1, 1)), k=st.floats(0.01, 5))
def test_the_margin_bounds_the_quadratic_form_and_is_reached(B: np.ndarray, s: np.ndarray, k: float) -> None:
    K_r = np.array([k, 2 * k])
    margin, corrected, _ = margins(B, K_r)
    assert s @ (np.diag(K_r) - B) @ s >= margin * (s @ s) - 1e-12
    assert s @ B @ s <= corrected * (s @ s) + 1e-12
    worst = np.linalg.eigh(np.diag(K_r) - (B + B.T) / 2)[1][:, 0]
    assert worst @ (np.diag(K_r) - B) @ worst == pytest.approx(margin, abs=1e-12)
    assert margin >= k - corrected - 1e-12  # comparing the eigenvalues apart is safe, but coarser


@given(B=matrices)
def test_the_printed_eigenvalue_is_never_the_larger_one(B: np.ndarray) -> None:
    _, corrected, printed = margins(B, np.ones(2))
    assert printed <= corrected + 1e-9


def test_joint_and_task_coordinates_give_the_same_power() -> None:
    rng = np.random.default_rng(1)
    M, c_inv, c_dot, J = (rng.normal(size=(2, 2)) for _ in range(4))
    M, s_q = M @ M.T + np.eye(2), rng.normal(size=2)
    J_inv = np.linalg.inv(J)
    joint = rate_matrix(M, c_inv, c_dot, J, J_inv)
    task = rate_matrix(J_inv.T @ M @ J_inv, c_inv, c_dot, np.eye(2), np.eye(2))
    s = J @ s_q
    assert s_q @ joint @ s_q == pytest.approx(s @ task @ s)


@pytest.mark.parametrize("k_r_space", ["joint", "task"])
@pytest.mark.parametrize("cartesian", [False, True])
def test_the_condition_along_a_run_bounds_the_weight_rate_power(cartesian: bool, k_r_space: str) -> None:
    run = experiment(
        coupling("ring", 4, 2, "moving"),
        cartesian=cartesian,
        k_r_space=k_r_space,
        reference_acceleration="paper",
    )
    result = run.simulate(0.03, 1e-3)
    record, condition = lyapunov(result), gain_condition(result)
    power = record.power["damping"] + record.power["weight rate"]
    s = result.v_error
    if k_r_space == "task":
        cell = run.cell
        J = np.array([[r.jacobian(q)[:2] for r, q in zip(cell.robots, qs, strict=True)] for qs in result.q])
        s = np.matvec(J, s) if cartesian else s
    assert (power <= -condition.margin * (s**2).sum(axis=(1, 2)) + record.rounding).all()
    assert condition.needed


def test_18_holds_along_a_run_in_which_v_grows() -> None:
    """The printed condition accepts the gains; one arm moving along the worst direction makes V grow."""
    link, arm = growing((-20.0, 20.0)), planar_arm()
    q0 = np.array([0.0, 0.0])
    M = arm.mass_matrix(q0)
    B = rate_matrix(M, np.eye(2), np.diag([-20.0, 20.0]), np.eye(2), np.eye(2))
    _, corrected, printed = margins(B, np.ones(2))
    gains = GAINS.replace(K_r=0.5 * (corrected + printed), beta=0.0, K_eps=0.0)
    worst = np.linalg.eigh((B + B.T) / 2)[1][:, -1]
    still = FunctionTrajectory(lambda t: q0, lambda t: 0 * q0, lambda t: 0 * q0)
    members = [Member(arm, still, q0, v0=-0.1 * worst, theta_hat0=arm.inertial_parameters) for _ in range(2)]
    run = Experiment(Cell(members, link), gains, 0.01, reference_acceleration="paper")
    result = run.simulate(dt=5e-4)
    condition, record = gain_condition(result), lyapunov(result)
    assert condition.holds_as_printed
    assert not condition.holds
    assert record.V_dot[0] > record.rounding[0]
    assert record.V[1] > record.V[0]


def test_constant_weights_leave_the_whole_of_k_r_as_margin() -> None:
    condition = gain_condition(experiment(coupling("ring", 4, 2, "constant")).simulate(0.01, 1e-3))
    assert condition.margin == pytest.approx(2.0)
    assert condition.corrected == pytest.approx(0.0)
    assert not condition.needed


def test_the_box_finds_the_worst_configuration_of_a_planar_arm() -> None:
    link = growing((-3.0, 2.0))
    run = experiment(link, reference_acceleration="paper")
    found = gain_condition_in_box(run, *BOX, samples=64)
    grid = []
    for q2 in np.linspace(0.3, 2.8, 2001):  # the mass matrix depends on q2 alone, B on nothing else
        M = run.cell.robots[0].mass_matrix(np.array([0.0, q2]))
        B = rate_matrix(M, np.eye(2), np.diag([-3.0, 2.0]), np.eye(2), np.eye(2))
        grid.append(float(margins(B, np.full(2, 2.0))[0]))
    assert found.margin == pytest.approx(min(grid), abs=1e-6)


def test_what_the_box_reports_is_a_configuration_of_the_box_with_that_margin() -> None:
    run = experiment(coupling("ring", 4, 2, "moving"), cartesian=True, reference_acceleration="paper")
    found = gain_condition_in_box(run, *BOX, duration=0.5, samples=64)
    again = gain_condition_in_box(run, *BOX, duration=0.5, samples=64)
    assert found == again
    q, i = np.array(found.q), found.robot
    assert (q >= BOX[0]).all()
    assert (q <= BOX[1]).all()
    assert 0 <= found.time <= 0.5
    robot, weights = run.cell.robots[i], run.cell.coupling.weights(np.array([found.time]), 2)
    J = robot.jacobian(q)[:2]
    B = rate_matrix(robot.mass_matrix(q), weights.c_inv[0, i], weights.c_dot[0, i], J, np.linalg.inv(J))
    assert found.margin == pytest.approx(float(margins(B, np.full(2, 2.0))[0]))


def test_no_random_configuration_is_much_worse_than_what_the_box_search_found() -> None:
    run = experiment(coupling("pair", 2, 2, "moving"), reference_acceleration="paper")
    found = gain_condition_in_box(run, *BOX, duration=1.0)
    rng = np.random.default_rng(0)
    for _ in range(300):
        q, t = rng.uniform(*BOX), rng.uniform(0, 1, 1)
        weights = run.cell.coupling.weights(t, 2)
        M = run.cell.robots[0].mass_matrix(q)
        for i in range(2):
            B = rate_matrix(M, weights.c_inv[0, i], weights.c_dot[0, i], np.eye(2), np.eye(2))
            assert margins(B, np.full(2, 2.0))[0] >= found.margin - 1e-3 * abs(found.margin)


def test_a_box_of_the_wrong_size_or_upside_down_is_refused() -> None:
    run = experiment(coupling("pair", 2, 2))
    with refused(InputError, "lower"):
        gain_condition_in_box(run, [0.0], [1.0, 1.0])
    with refused(InputError, "lower, upper"):
        gain_condition_in_box(run, [1.0, 1.0], [0.0, 2.0])
    with refused(InputError, "duration"):
        gain_condition_in_box(run, *BOX, duration=-1.0)
    for samples in (0, -1, 2.5, "many"):
        with refused(InputError, "samples"):
            gain_condition_in_box(run, *BOX, samples=samples)
