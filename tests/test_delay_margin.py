"""How much delay a cell tolerates: the frozen equations, what crosses, and how fast it then grows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused
from theory_cells import planar_arm
from ur5_joints import GAINS, ur5_joints

from synctrl import CartesianSpace, Cell, Coupling, Experiment, Gains, Hold, JointSpace, Member, Redundancy
from synctrl.analysis import DelayMargin, delay_margin
from synctrl.analysis.delay_margin import crossings, differentiation, growth
from synctrl.analysis.frozen import freeze
from synctrl.errors import InputError
from synctrl.experiments import planar_four, ur5_payload

MILD = Gains(Lambda=4.0, beta=3.0, K_r=2.0, K_eps=1.5, Gamma=0.0)
#: finite differences of the loop's rates, and how many of their digits are right
STEP, DIGITS = 1e-6, 1e-5


@pytest.fixture(scope="module")
def ur5() -> Cell:
    return ur5_joints()


@pytest.fixture(scope="module")
def lost(ur5) -> DelayMargin:
    return delay_margin(ur5, GAINS)


def still_cell(space: str, coupling: Coupling, joints: int = 2) -> Cell:
    """Planar arms that are where they should be, and know what they are."""
    arm, members = planar_arm(joints, gravity=3.0), []
    posture = np.array([0.4, 1.1, 0.7])[:joints]
    for i in range(coupling.robots):
        q = posture + 0.1 * i
        x = q if space == "joint" else arm.tip_position(q)[:2]
        members.append(Member(arm, Hold(x), q, theta_hat0=arm.inertial_parameters))
    q0 = [member.q0 for member in members]
    spaces = {"joint": JointSpace(), "tip": CartesianSpace("xy", redundancy=Redundancy(q0, 2.0))}
    return Cell(members, coupling, spaces[space])


def linearized(cell: Cell, gains: Gains, k_r_space: str) -> np.ndarray:
    """Eigenvalues of the closed loop with ideal communication about its start, by central differences."""
    loop = Experiment(cell, gains, 1.0, k_r_space=k_r_space).closed_loop()
    reference, nothing = cell.references(np.array([0.0]))[0], np.zeros((cell.n, cell.nv))
    start = loop.initial_state()
    columns = []
    for step in STEP * np.eye(loop.size):
        ahead, behind = (loop.evaluate(reference, start + s, nothing)[0] for s in (step, -step))
        columns.append((ahead - behind) / (2 * STEP))
    return np.linalg.eigvals(np.transpose(columns))


@pytest.mark.parametrize("k_r_space", ["joint", "task"])
@pytest.mark.parametrize("leak", [0.0, 1.5])
@pytest.mark.parametrize(("space", "joints"), [("joint", 2), ("tip", 2), ("tip", 3)])
def test_without_delay_the_frozen_cell_has_the_roots_of_the_loop_itself(space, joints, leak, k_r_space):
    cell = still_cell(space, Coupling.signed_ring(3, c=[1.0, 0.7, 1.3]), joints)
    gains = MILD.replace(leak=leak)
    frozen = freeze(cell, gains, k_r_space=k_r_space)
    ours = np.linalg.eigvals(frozen.own + frozen.delayed)
    theirs = linearized(cell, gains, k_r_space)
    for some, others in ((ours, theirs), (theirs, ours)):
        for root in some[
            np.abs(some) > 1e-2
        ]:  # at 0 there are more or fewer, as the memory is larger or smaller
            assert np.abs(others - root).min() <= DIGITS * max(1.0, abs(root))


@pytest.mark.parametrize("delay", [0.02, 0.1, 0.4])
def test_with_no_stiffness_the_roots_are_those_of_lamberts_function(delay):
    from scipy.special import lambertw

    cell, gains = still_cell("joint", Coupling.ring(4)), MILD.replace(K_eps=0.0, beta=20.0)
    b = 2 * 20.0  # beta times the diagonal of S^T S, whose rest has the eigenvalues -2, 0 and 2
    branches = [sign * b * delay * np.exp(b * delay) for sign in (1, -1)]
    roots = np.array([lambertw(x, k) / delay - b for x in branches for k in range(4)])
    slowest = roots[np.abs(roots) > 1e-6].real.max()
    arms = linearized(cell, gains.independent(), "joint")  # what K_r and Lambda do, which no delay changes
    expected = max(slowest, arms[np.abs(arms) > 1e-3].real.max())
    assert growth(freeze(cell, gains), delay) == pytest.approx(expected, rel=1e-6)


def graph(seed: int, n: int) -> Coupling:
    """A random connected graph."""
    rng = np.random.default_rng(seed)
    edges = [(int(rng.integers(k)), k) for k in range(1, n)]
    more = [(i, j) for i in range(n) for j in range(i + 1, n) if rng.random() < 0.4]
    return Coupling.from_graph(sorted({*edges, *more}), n=n)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 1000), st.integers(2, 4), st.floats(0.5, 20.0), st.floats(0.5, 20.0))
def test_no_root_crosses_where_damping_outweighs_the_stiffness(seed, n, Lambda, beta):
    cell = still_cell("joint", graph(seed, n))
    gains = MILD.replace(Lambda=Lambda, beta=beta)
    a = (cell.coupling.matrix**2).sum(axis=0).max()
    frozen = freeze(cell, gains.replace(K_eps=0.999 * 2.0 * 4 * Lambda / a))
    assert frozen.proved and crossings(frozen) == []


def test_the_theorem_says_so_and_the_ring_of_the_paper_is_one_of_its_cells():
    paper = planar_four()
    margin = delay_margin(paper.cell, paper.gains)
    assert margin.by == "theorem" and margin.delay == np.inf and margin.rate == 0.0
    assert margin.robot is margin.joint is margin.frequency is None
    assert min(margin.least_eigenvalue) == pytest.approx(0.24, abs=0.005)  # as the theorem's source prints it
    assert all(margin.growth(delay) < 0 for delay in (0.0, 0.05, 0.3))


def test_a_robot_that_is_compared_with_a_sum_of_others_has_no_theorem():
    cell = still_cell("joint", Coupling.sum(3))
    assert not freeze(cell, MILD.replace(K_eps=0.0)).proved
    assert freeze(still_cell("joint", Coupling.complete(3)), MILD.replace(K_eps=0.0)).proved


def test_a_leak_leaves_the_theorem_and_not_the_analysis():
    cell = still_cell("joint", Coupling.pair())
    margin = delay_margin(cell, MILD.replace(leak=4.0))
    assert margin.by == "analysis" and margin.delay == np.inf


# -- a cell that a delay brings down ----------------------------------------------------------------------


def test_the_bound_is_the_least_eigenvalue_of_what_is_left_of_the_damping(lost):
    a, Lambda, K_eps = 1.0, 6.0, 50.0
    left = np.array([50.0, 60.0, 20.0, 6.0, 10.0, 0.6]) - a * K_eps / (4 * Lambda)  # J = 1, so it is diagonal
    np.testing.assert_allclose(lost.least_eigenvalue, left.min())
    assert lost.by == "analysis"


def test_growth_changes_its_sign_at_the_margin_and_nowhere_before(lost):
    assert all(lost.growth(share * lost.delay) < 0 for share in (0.0, 0.3, 0.6, 0.9, 0.999))
    assert lost.growth(1.001 * lost.delay) > 0
    assert lost.growth(lost.delay) == pytest.approx(0.0, abs=1e-6)
    assert lost.rate == lost.growth(1.1 * lost.delay) > 0


def test_the_joint_with_too_little_damping_is_the_one_that_is_lost(lost):
    assert lost.joint == 5
    assert "joint 6" in str(lost) and f"{1e3 * lost.delay:.3g} ms" in str(lost)


def test_a_root_stands_on_the_axis_at_every_crossing(lost):
    frozen = lost.frozen
    found = crossings(frozen)
    assert (lost.delay, lost.frequency) == min(found)
    for delay, omega in found:
        s = 1j * omega
        A = frozen.own + np.exp(-s * delay) * frozen.delayed
        assert np.abs(np.linalg.eigvals(A) - s).min() < 1e-6 * omega


@pytest.mark.parametrize(
    "cure", [{"K_eps": 14.0}, {"K_r": (50.0, 60.0, 20.0, 6.0, 10.0, 2.1)}, {"Lambda": 21.0}]
)
def test_what_the_theorem_asks_for_cures_it(ur5, cure):
    assert delay_margin(ur5, GAINS.replace(**cure)).by == "theorem"


def test_a_slower_cell_tolerates_longer_delays_in_proportion(ur5, lost):
    """Time in other units: rates and damping by k, stiffness by k^2."""
    slow = GAINS.replace(Lambda=3.0, beta=3.0, K_r=0.5 * GAINS.K_r, K_eps=0.25 * GAINS.K_eps)
    margin = delay_margin(ur5, slow)
    assert margin.delay == pytest.approx(2 * lost.delay, rel=1e-6)
    assert margin.frequency == pytest.approx(0.5 * lost.frequency, rel=1e-6)


def test_poses_and_joints_of_the_same_arms_lose_the_same_joint(lost):
    arms = ur5_payload()
    margin = delay_margin(arms.cell, arms.gains)
    assert margin.joint == lost.joint and 0 < margin.delay < np.inf


def test_polynomials_are_differentiated_exactly():
    x = np.cos(np.pi * np.arange(9) / 8)
    np.testing.assert_allclose(differentiation(8) @ x**7, 7 * x**6, atol=1e-12)


@pytest.mark.parametrize(
    ("wrong", "subject"),
    [({"q": np.zeros((2, 5))}, "q"), ({"k_r_space": "tool"}, "k_r_space"), ({"t": "now"}, "t")],
)
def test_what_does_not_fit_is_refused_by_name(ur5, wrong, subject):
    with refused(InputError, subject):
        delay_margin(ur5, GAINS, **wrong)


def test_a_negative_delay_is_refused(lost):
    with refused(InputError, "delay", -0.1):
        lost.growth(-0.1)
