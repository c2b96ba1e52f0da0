"""Couplings: the matrix S as lists, graphs that cannot synchronize, weights and their inverses."""

from __future__ import annotations

import tracemalloc
import warnings

import networkx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import Cell, Coupling, FunctionTrajectory, Gains, Hold, JointSpace, Member, load_robot, simulate
from synctrl.errors import CouplingError, CouplingWarning, InputError

READY = {
    "pair": (Coupling.pair(), [[1, 1]]),
    "sum": (Coupling.sum(3), [[1, 1, 1]]),
    "ring": (Coupling.ring(4), [[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [1, 0, 0, 1]]),
    "signed ring": (Coupling.signed_ring(3), [[1, -1, 0], [0, 1, -1], [-1, 0, 1]]),
    "chain": (Coupling.chain(3), [[1, -1, 0], [0, 1, -1]]),
    "star": (Coupling.star(3, leader=1), [[-1, 1, 0], [0, 1, -1]]),
    "complete": (Coupling.complete(3), [[1, -1, 0], [1, 0, -1], [0, 1, -1]]),
    "graph": (Coupling.from_graph([(0, 1), (2, 1, 3.0)]), [[1, -1, 0], [0, -3, 3]]),
}


@st.composite
def connected_graphs(draw):
    """Number of robots, edges and signs of any connected graph, with edges in any order and orientation."""
    n = draw(st.integers(2, 9))
    tree = [(draw(st.integers(0, k - 1)), k) for k in range(1, n)]
    more = draw(st.lists(st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)), max_size=8))
    edges = draw(st.permutations(tree + [(i, j) for i, j in more if i != j]))
    sign = st.sampled_from([-1.0, 1.0])
    signs = draw(st.lists(st.tuples(sign, sign), min_size=len(edges), max_size=len(edges)))
    return n, edges, np.array(signs)


def quiet(*arguments, **named):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CouplingWarning)
        return Coupling(*arguments, **named)


# -- S ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", READY)
def test_ready_couplings_have_the_matrix_of_their_name(name):
    coupling, S = READY[name]
    np.testing.assert_array_equal(coupling.matrix, S)


@given(connected_graphs(), st.integers(1, 3), st.randoms(use_true_random=False))
def test_compare_and_distribute_are_s_and_its_transpose(graph, columns, random):
    n, edges, signs = graph
    rng = np.random.default_rng(random.randrange(1000))
    coupling = quiet(n, edges, signs, np.ones(n)).weighted(rng.uniform(0.5, 2, len(edges)))
    S, w, z = coupling.matrix, rng.normal(size=(n, columns)), rng.normal(size=(len(edges), columns))
    np.testing.assert_allclose(coupling.compare(w), S @ w, atol=1e-12)
    np.testing.assert_allclose(coupling.distribute(z), S.T @ z, atol=1e-12)


@given(connected_graphs())
def test_the_degree_is_the_largest_entry_of_the_diagonal_of_s_transposed_s(graph):
    n, edges, signs = graph
    coupling = quiet(n, edges, signs, np.ones(n))
    for made in (coupling, coupling.weighted(np.linspace(0.5, 2.0, len(edges)))):
        np.testing.assert_allclose(made.degree, np.diag(made.matrix.T @ made.matrix).max(), rtol=1e-14)


@given(st.integers(2, 9), st.integers(1, 3))
def test_the_sum_compares_and_distributes_as_its_matrix_does(n, columns):
    rng = np.random.default_rng(n)
    coupling, w, z = Coupling.sum(n), rng.normal(size=(n, columns)), rng.normal(size=(1, columns))
    np.testing.assert_allclose(coupling.compare(w), coupling.matrix @ w, atol=1e-12)
    np.testing.assert_allclose(coupling.distribute(z), coupling.matrix.T @ z, atol=1e-12)


@given(connected_graphs())
def test_the_synchronized_motion_is_the_null_space_of_s(graph):
    coupling = quiet(graph[0], graph[1], graph[2], np.ones(graph[0]))
    w = coupling.synchronized_motion
    dimension = coupling.robots - np.linalg.matrix_rank(coupling.matrix)
    if w is None:
        assert dimension == 0
    else:
        assert dimension == 1
        assert w[0] == 1
        np.testing.assert_array_equal(coupling.matrix @ w, 0)


def test_the_sum_leaves_more_than_one_motion_and_says_so():
    with refused(CouplingError, "edges"):
        _ = Coupling.sum(3).synchronized_motion


def test_nothing_grows_with_the_square_of_the_number_of_robots():
    n = 3000  # S would take 72 MB
    tracemalloc.start()
    coupling = Coupling.ring(n)
    coupling.weights(np.zeros(1), 1)
    coupling.distribute(coupling.compare(np.ones((n, 1))))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10e6


# -- what a graph may be ----------------------------------------------------------------------------------


@given(st.integers(2, 12))
def test_the_papers_ring_leaves_a_synchronized_motion_only_for_even_numbers(n):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        coupling = Coupling.ring(n)
    said = [str(warning.message) for warning in caught]
    assert any("signed_ring" in message for message in said) == (n % 2 == 1)
    assert any("Coupling.pair" in message for message in said) == (n == 2)
    assert (coupling.synchronized_motion is None) == (n % 2 == 1)


@given(st.integers(3, 12))
def test_the_signed_ring_leaves_equal_errors_free_for_every_number(n):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(Coupling.signed_ring(n).synchronized_motion, np.ones(n))


@pytest.mark.parametrize("edges", [[(0, 1), (0, 1), (1, 2)], [(0, 1), (1, 2), (1, 0)]])
def test_a_repeated_pair_warns_of_its_double_effect(edges):
    with pytest.warns(CouplingWarning, match="robots 0 and 1 are compared 2 times.*edge weights"):
        Coupling.from_graph(edges)


def test_an_inconsistent_loop_of_signs_warns_that_nothing_is_left_to_synchronize():
    with pytest.warns(CouplingWarning, match="no synchronized motion"):
        Coupling(3, [(0, 1), (1, 2), (2, 0)], [(1, -1), (1, -1), (1, 1)], np.ones(3))


@pytest.mark.parametrize(
    ("edges", "subject", "data"),
    [
        ([(0, 1), (2, 2)], "edge 1, of robots [2, 2]", {}),
        ([(0, 1), (2, 5)], "edge 1, of robots [2, 5]", {}),
        ([(0, 1), (2, -1)], "edge 1, of robots [2, -1]", {}),
        ([(0, 1)], "edges", {"robot": 2}),
        ([], "graph", {}),
    ],
)
def test_graphs_that_cannot_synchronize_are_refused_with_the_part_at_fault(edges, subject, data):
    with refused(CouplingError, subject, **data):
        Coupling.from_graph(edges, n=3)


@pytest.mark.parametrize(
    ("graph", "error", "subject"),
    [
        ([(0, 1), (1, 1.5)], InputError, "graph"),
        ([(0, 1), (1, np.nan)], InputError, "graph"),
        ([(0, 1, 0.0)], InputError, "edge_weights"),
        ([(0, 1, -2.0)], InputError, "edge_weights"),
        ([(0, 1, "heavy")], InputError, "graph"),
        ([(0, 1, 2, 3)], InputError, "graph"),
        ([7], InputError, "graph"),
        (7, InputError, "graph"),
        (networkx.DiGraph([(0, 1)]), CouplingError, "graph"),
        (networkx.Graph([("a", "b")]), CouplingError, "graph"),
        (networkx.empty_graph(2), CouplingError, "graph"),
    ],
)
def test_what_is_no_graph_of_robots_is_refused(graph, error, subject):
    with refused(error, subject):
        Coupling.from_graph(graph)


@pytest.mark.parametrize(
    ("arguments", "subject"),
    [
        ((3, np.zeros((0, 2)), np.zeros((0, 2)), np.ones(3)), "edges"),
        ((4, [(0, 1, 2)], [(1, 1, 1)], np.ones(4)), "edges"),
        ((2, [(0, 1)], [(1, 0)], np.ones(2)), "edge 0, of robots [0, 1]"),
        ((3, [(0, 1)], [(1, 1)], np.ones(2)), "edges"),
        ((2, [(0, 1)], [(1, 1)], np.ones(3)), "c"),
        ((2, [(0, 1)], [(1, 1)], 1.0), "c"),
        ((1, [(0, 1)], [(1, 1)], [1.0]), "robots"),
        ((2.5, [(0, 1)], [(1, 1)], [1.0]), "robots"),
    ],
)
def test_arguments_that_make_no_coupling_are_refused(arguments, subject):
    with refused((CouplingError, InputError), subject):
        Coupling(*arguments)


def test_a_star_needs_a_leader_among_its_robots():
    with refused(CouplingError, "leader"):
        Coupling.star(4, leader=4)


@given(connected_graphs())
def test_a_networkx_graph_gives_the_coupling_of_its_edges_and_weights(graph):
    n, edges, _ = graph
    weighted = [(min(e), max(e), 1.0 + k) for k, e in enumerate(edges)]
    G = networkx.empty_graph(n)
    G.add_weighted_edges_from(weighted)
    expected = {(i, j): a for i, j, a in weighted}
    from_list = Coupling.from_graph([(*e, a) for e, a in expected.items()], n=n).matrix
    from_graph = Coupling.from_graph(G).matrix
    np.testing.assert_allclose(from_graph.T @ from_graph, from_list.T @ from_list)


# -- weights ----------------------------------------------------------------------------------------------

GEARED = np.array([[[2.0, 0.5], [0.0, 1.0]], [[1.0, 0.0], [0.3, -1.5]]])


@pytest.mark.parametrize("c", [np.array([2.0, -3.0]), np.array([[1.0, 2.0], [3.0, -4.0]]), GEARED])
def test_constant_weights_come_with_their_inverse_and_are_made_once(c):
    coupling = Coupling.pair(c)
    w = coupling.weights(np.linspace(0, 1, 5), 2)
    assert w.c.shape == (5, 2, 2, 2)
    np.testing.assert_allclose(w.c @ w.c_inv, np.broadcast_to(np.eye(2), (5, 2, 2, 2)), atol=1e-15)
    assert not w.c_dot.any() and not w.c_ddot.any()
    assert np.shares_memory(w.c_inv, coupling.weights(np.array([7.0]), 2).c_inv)


@pytest.mark.parametrize("form", [lambda a: a, lambda a: a[:, None] * np.ones(2)])
def test_weight_functions_may_return_numbers_or_diagonals(form):
    c = np.array([2.0, -3.0])
    w = Coupling.pair(lambda t: (form(c * (1 + t)), form(c), form(0 * c))).weights(np.array([1.0]), 2)
    np.testing.assert_array_equal(w.c[0], [4 * np.eye(2), -6 * np.eye(2)])
    np.testing.assert_array_equal(w.c_dot[0], [2 * np.eye(2), -3 * np.eye(2)])


@pytest.mark.parametrize(
    ("c", "data"),
    [
        ([1.0, 0.0], {"robot": 1, "time": 3.0}),
        ([[1.0, 2.0], [1.0, 1e-14]], {"robot": 1, "time": 3.0}),
        ([np.eye(2), np.ones((2, 2))], {"robot": 1, "time": 3.0}),
        (lambda t: (np.array([t - 3, 1.0]), np.ones(2), np.zeros(2)), {"robot": 0, "time": 3.0}),
        (lambda t: np.ones(2), {}),
        (lambda t: (np.ones(2), np.ones(2)), {}),
        (lambda t: (np.ones(2), np.ones(3), np.ones(2)), {"time": 3.0, "found": ((2,), (3,), (2,))}),
        (lambda t: (np.ones(2), np.array([np.nan, 1]), np.ones(2)), {"time": 3.0}),
    ],
)
def test_weights_that_are_none_are_refused_with_robot_and_time(c, data):
    with refused(CouplingError, "c", **data):
        Coupling.pair(c).weights(np.array([3.0]), 2)


def test_weights_of_another_dimension_are_refused():
    with refused(InputError, "c"):
        Coupling.pair(GEARED).weights(np.zeros(1), 3)


TIMES = np.linspace(0, 4, 4001)


@pytest.mark.parametrize(
    ("c", "subject", "robot"),
    [
        (lambda t: ([t - np.e, 1], [1, 0], [0, 0]), "c", 0),
        (lambda t: ([1, (t - np.e) ** 2], [0, 2 * (t - np.e)], [0, 2]), "c", 1),
        (lambda t: ([1, 2 + np.sin(t)], [0, 0], [0, 0]), "c'", 1),
        (lambda t: ([2 + t, 1], [2, 0], [0, 0]), "c'", 0),
        (lambda t: ([2 + t * t, 1], [2 * t, 0], [-2, 0]), "c''", 0),
    ],
)
def test_a_run_is_refused_before_it_starts_if_weights_fail_on_the_way(c, subject, robot):
    with refused(CouplingError, subject, robot=robot) as caught:
        Coupling.pair(c).check_weights(TIMES, 2)
    assert subject != "c" or caught.value.time == pytest.approx(np.e, abs=0.01)


def turning(t, rates=(0.0, 30.0)):
    """Weights that shear, grow, and turn fast, with derivatives."""
    parts = []
    for w in rates:
        c, s = np.cos(w * t), np.sin(w * t)
        R = np.array([[c, -s], [s, c]])
        J = np.array([[0.0, -1.0], [1.0, 0.0]])
        parts.append((R, w * J @ R, -w * w * R))
    return tuple(np.array(part) for part in zip(*parts, strict=True))


def test_weights_that_turn_fast_but_keep_their_inverse_pass():
    Coupling.pair(turning).check_weights(TIMES, 2)
    Coupling.pair(GEARED).check_weights(TIMES, 2)


# -- variations -------------------------------------------------------------------------------------------


@given(st.floats(0.01, 100), st.sampled_from([-1.0, 1.0]), st.sampled_from([[2.0, -3.0], GEARED, turning]))
def test_normalized_weights_do_not_depend_on_the_scale_of_the_function(factor, sign, c):
    a = factor * sign
    scaled = (lambda t: tuple(a * part for part in c(t))) if callable(c) else a * np.array(c)
    one = Coupling.pair(c, unit="m").normalized().weights(TIMES[::500], 2)
    other = Coupling.pair(scaled).normalized().weights(TIMES[::500], 2)
    for expected, found in zip(one, other, strict=True):
        np.testing.assert_allclose(sign * found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("c", [[2.0, -3.0], np.array([[1.0, 2.0], [3.0, -4.0]]), GEARED, turning])
def test_normalized_weights_have_singular_values_of_geometric_mean_one(c):
    coupling = Coupling.pair(c, unit="m").normalized(t=1.5)
    singular = np.linalg.svd(coupling.weights(np.array([1.5]), 2).c[0], compute_uv=False)
    assert np.exp(np.log(singular).mean()) == pytest.approx(1.0, rel=1e-12)
    assert coupling.unit == ""


def test_weights_without_a_scale_cannot_be_normalized():
    with refused(CouplingError, "c", time=0.0):
        Coupling.pair([1.0, 0.0]).normalized()


def test_edge_weights_multiply_the_rows_of_s():
    coupling = Coupling.chain(3)
    np.testing.assert_array_equal(coupling.weighted([2, 5]).matrix, np.diag([2, 5]) @ coupling.matrix)
    with refused(InputError, "edge_weights", found=(1,)):
        coupling.weighted([1.0])


# -- in the loop ------------------------------------------------------------------------------------------

GAINS = Gains(Lambda=5.0, beta=4.0, K_r=0.5, K_eps=3.0, Gamma=0.02)


def wheels(coupling, gains=GAINS, duration=0.1, dt=1e-3):
    """A short run of wheels that start apart from where they should be."""
    wheel = load_robot("wheel")
    members = [
        Member(
            wheel.placed(name=f"wheel {i + 1}"),
            FunctionTrajectory(lambda t: [np.sin(t)], lambda t: [np.cos(t)], lambda t: [-np.sin(t)]),
            q0=[0.1 * (i + 1)],
            theta_hat0=0.5 * wheel.inertial_parameters,
        )
        for i in range(coupling.robots)
    ]
    return simulate(Cell(members, coupling, JointSpace()), gains, duration, dt)


@pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning")
def test_a_ring_of_two_is_the_pair_with_twice_its_beta_and_k_eps():
    ring = wheels(Coupling.ring(2))
    pair = wheels(Coupling.pair(), GAINS.replace(beta=2 * GAINS.beta, K_eps=2 * GAINS.K_eps))
    np.testing.assert_allclose(ring.tracking_error, pair.tracking_error, atol=1e-12)


def test_multiplying_the_weights_is_the_same_as_multiplying_k_eps_by_the_square():
    scaled = wheels(Coupling.pair([3.0, -3.0]))
    stiffer = wheels(Coupling.pair(), GAINS.replace(K_eps=9 * GAINS.K_eps))
    np.testing.assert_allclose(scaled.tracking_error, stiffer.tracking_error, atol=1e-12)
    np.testing.assert_allclose(scaled.sync_error, 3 * stiffer.sync_error, atol=1e-12)


def test_an_edge_weight_multiplies_beta_and_k_eps_by_its_square():
    weighted = wheels(Coupling.pair().weighted([2.0]))
    stronger = wheels(Coupling.pair(), GAINS.replace(beta=4 * GAINS.beta, K_eps=4 * GAINS.K_eps))
    np.testing.assert_allclose(weighted.tracking_error, stronger.tracking_error, atol=1e-12)


def test_the_sum_of_an_odd_number_of_robots_converges():
    result = wheels(Coupling.sum(3, c=[1.0, -2.0, 0.5]), GAINS.replace(Gamma=0.2), duration=6.0, dt=1e-2)
    assert np.abs(result.sync_error[-1]).max() < 1e-3 * np.abs(result.sync_error[0]).max()
    assert np.abs(result.tracking_error[-1]).max() < 1e-2 * np.abs(result.tracking_error[0]).max()


def test_200_arms_on_a_signed_ring_move_as_the_same_law_with_dense_matrices_says():
    n, dt, steps = 200, 4e-3, 4
    arm = load_robot("planar2r")
    rng = np.random.default_rng(0)
    q0 = rng.uniform(-1, 1, (n, 2))
    members = [
        Member(
            arm.placed(name=f"arm {i}"), Hold([0.3, -0.5]), q0[i], theta_hat0=0.7 * arm.inertial_parameters
        )
        for i in range(n)
    ]
    phases = rng.uniform(0, 1, n)

    def weights(t):
        parts = [turning(t + phase, (3.0,)) for phase in phases]
        shear = np.array([[1.0, 0.4], [0.0, 1.3]])
        return tuple(np.array([part[k][0] @ shear for part in parts]) for k in range(3))

    result = simulate(Cell(members, Coupling.signed_ring(n, weights), JointSpace()), GAINS, steps * dt, dt)
    law = DenseLaw(arm, weights, n, GAINS)
    expected = law.run(q0, 0.7 * arm.inertial_parameters, [0.3, -0.5], dt, steps)
    np.testing.assert_allclose(result.sync_error, expected, atol=1e-10)


class DenseLaw:
    """The law as docs/theory.md states it, with S, c and c' as full matrices over all robots."""

    def __init__(self, arm, weights, n, gains):
        self.arm, self.weights, self.n, self.gains = arm, weights, n, gains
        self.S = np.kron(np.eye(n) - np.roll(np.eye(n), 1, axis=1), np.eye(2))

    def run(self, q0, theta0, xd, dt, steps):
        """Synchronization errors, (steps + 1, n, 2), by the classical Runge-Kutta method."""
        n = self.n
        self.xd = np.tile(xd, n)
        y = np.concatenate([q0.ravel(), np.zeros(2 * n), np.tile(theta0, n), np.zeros(2 * n)])
        errors = []
        for k in range(steps + 1):
            t = k * dt
            k1, epsilon = self.rhs(t, y)
            errors.append(epsilon.reshape(n, 2))
            k2 = self.rhs(t + dt / 2, y + dt / 2 * k1)[0]
            k3 = self.rhs(t + dt / 2, y + dt / 2 * k2)[0]
            k4 = self.rhs(t + dt, y + dt * k3)[0]
            y = y + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return np.array(errors)

    def rhs(self, t, y):
        n, S, g = self.n, self.S, self.gains
        q, v, theta, integral = np.split(y, np.cumsum([2 * n, 2 * n, 20 * n]))
        c, c_dot, c_ddot = (block_diagonal(part) for part in self.weights(t))
        e, e_dot = self.xd - q, -v
        w, w_dot = c @ e, c @ e_dot + c_dot @ e
        epsilon, epsilon_dot = S @ w, S @ w_dot
        e_star = w + g.beta * S.T @ integral
        u = c_dot @ e + g.beta * S.T @ epsilon + g.Lambda * e_star
        e_star_dot = w_dot + g.beta * S.T @ epsilon
        u_dot = c_dot @ e_dot + c_ddot @ e + g.beta * S.T @ epsilon_dot + g.Lambda * e_star_dot
        v_ref = np.linalg.solve(c, u)
        a_ref = np.linalg.solve(c, u_dot - c_dot @ v_ref)
        force = c.T @ (g.K_eps * S.T @ epsilon)
        s = v_ref - v
        a, theta_dot = np.empty(2 * n), np.empty(20 * n)
        for i in range(n):
            j, k = slice(2 * i, 2 * i + 2), slice(20 * i, 20 * i + 20)
            Y = self.arm.regressor(q[j], v[j], v_ref[j], a_ref[j])
            a[j] = self.arm.forward_dynamics(q[j], v[j], Y @ theta[k] + g.K_r * s[j] + force[j])
            theta_dot[k] = g.Gamma * Y.T @ s[j]
        return np.concatenate([v, a, theta_dot, epsilon]), epsilon


def block_diagonal(blocks):
    n, m, _ = blocks.shape
    full = np.zeros((n, m, n, m))
    full[np.arange(n), :, np.arange(n), :] = blocks
    return full.reshape(n * m, n * m)
