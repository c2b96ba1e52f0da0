"""From a synchronization function to its coupling: derivatives, checks, and what is refused."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import Circle, Coupling, FunctionTrajectory, Hold, SynchronizationFunction
from synctrl.errors import CouplingError, CouplingWarning, InputError, SynchronizationError

DURATION = 5.0
TIMES = np.linspace(0, DURATION, 777)


class Wave:
    """a + b sin(w t + p) + d exp(-k t), with its derivatives."""

    def __init__(self, a, b, w, p, d, k):
        self.numbers = a, b, w, p, d, k

    def __call__(self, t, order=0):
        a, b, w, p, d, k = self.numbers
        oscillation = b * w**order * np.sin(w * t + p + order * np.pi / 2)
        return a * (order == 0) + oscillation + d * (-k) ** order * np.exp(-k * t)


waves = st.builds(
    Wave,
    st.floats(3, 10),
    st.floats(-1, 1),
    st.floats(0.1, 10),
    st.floats(0, 6),
    st.floats(-1, 1),
    st.floats(0.1, 10),
)


def still(n, m=1):
    """Desired motions at the origin."""
    return [Hold(np.zeros(m))] * n


def relative(found, expected):
    """Largest error over the run, in multiples of the largest value."""
    return np.abs(found - expected).max() / np.abs(expected).max()


# -- weights and their derivatives ------------------------------------------------------------------------


@settings(max_examples=15)
@given(waves, waves)
def test_weights_and_both_derivatives_are_accurate_to_1e_8(R_1, R_2):
    f = SynchronizationFunction(lambda x_1, x_2, t: R_2(t) * x_1 - R_1(t) * x_2, 2, 1)
    w = f.coupling(still(2), DURATION).weights(TIMES, 1)
    found = np.array(w[:3])[:, :, :, 0, 0]
    size = np.array([[np.abs(R(TIMES, order)).max() for R in (R_2, R_1)] for order in range(3)])
    rate = np.maximum((size / size[0]).max(axis=1), DURATION ** -np.arange(3.0))  # of the faster one
    for order in range(3):
        expected = np.stack([-R_2(TIMES, order), R_1(TIMES, order)], axis=1)
        error = np.abs(found[order] - expected).max(axis=0)
        assert (error <= 1e-8 * size[0] * rate[order]).all()


@pytest.mark.parametrize(
    ("rate", "start"),
    [(1.0, 2.0), (30.0, np.e / 2)],
    ids=["slow", "a fast change that falls between evenly spaced instants"],
)
def test_a_weight_with_one_feature_is_accurate_to_1e_8_in_every_derivative(rate, start):
    f = SynchronizationFunction(lambda x, y, t: (2 + np.tanh(rate * (t - start))) * x - y, 2, 1)
    w = f.coupling(still(2), DURATION).weights(TIMES, 1)
    th = np.tanh(rate * (TIMES - start))
    analytic = [2 + th, rate * (1 - th**2), -2 * rate**2 * th * (1 - th**2)]
    for found, expected in zip(w[:3], analytic, strict=True):
        assert relative(-found[:, 0, 0, 0], expected) < 1e-8


def test_a_narrow_bump_between_the_first_nodes_is_found():
    bump = Wave(2, 0, 1, 0, 0, 1)
    f = SynchronizationFunction(lambda x, y, t: (bump(t) + np.exp(-(((t - 2.62) / 0.02) ** 2))) * x - y, 2, 1)
    w = f.coupling(still(2), DURATION).weights(TIMES, 1)
    assert relative(-w.c[:, 0, 0, 0], 2 + np.exp(-(((TIMES - 2.62) / 0.02) ** 2))) < 1e-8


def test_normalized_smooth_weights_are_divided_with_their_derivatives_by_one_constant():
    f = SynchronizationFunction(lambda x, y, t: (3 + np.sin(t)) * x - 5 * y, 2, 2)
    coupling = f.coupling(still(2, 2), DURATION)
    one, other = coupling.weights(TIMES, 2), coupling.normalized(t=1.0).weights(TIMES, 2)
    size = np.sqrt((3 + np.sin(1.0)) * 5)
    for part, scaled in zip(one[:3], other[:3], strict=True):
        np.testing.assert_allclose(scaled * size, part, rtol=1e-12)
    np.testing.assert_allclose(one.c_inv * size, other.c_inv, rtol=1e-12)


def matrices(t, order=0):
    """Three 2 by 2 matrices, not diagonal, (3, 2, 2), or a derivative of them."""
    rates = np.array([0.5, 1.0, 2.0])[:, None, None]
    angle = rates * t + order * np.pi / 2
    turn = np.concatenate(
        [
            np.concatenate([np.cos(angle), -np.sin(angle)], axis=2),
            np.concatenate([np.sin(angle), np.cos(angle)], axis=2),
        ],
        axis=1,
    )
    return rates**order * turn @ np.array([[2.0, 0.3], [0.0, 1.0]])


def test_full_matrices_are_recovered_with_their_derivatives():
    def f(x_1, x_2, x_3, t):
        A = matrices(t)
        return A[0] @ x_1 + A[1] @ x_2 + A[2] @ x_3

    w = SynchronizationFunction(f, 3, 2).coupling(still(3, 2), DURATION).weights(TIMES, 2)
    for order in range(3):
        expected = -np.array([matrices(t, order) for t in TIMES])
        for i in range(3):
            assert relative(w[order][:, i], expected[:, i]) < 1e-8


def test_matrices_given_with_derivatives_are_used_as_they_are():
    f = SynchronizationFunction.from_matrices(
        matrices, 2, A_dot=lambda t: matrices(t, 1), A_ddot=lambda t: matrices(t, 2)
    )
    w = f.coupling(still(3, 2), DURATION).weights(TIMES, 2)
    for order in range(3):
        np.testing.assert_array_equal(w[order], -np.array([matrices(t, order) for t in TIMES]))


def test_matrices_and_function_give_the_same_weights():
    given_function = SynchronizationFunction(lambda x, y, t: (2 + np.sin(t)) * x - 3 * y, 2, 2)
    from_matrices = SynchronizationFunction.from_matrices(lambda t: np.array([2 + np.sin(t), -3]), 2)
    for one, other in zip(
        given_function.coupling(still(2, 2), DURATION).weights(TIMES, 2),
        from_matrices.coupling(still(2, 2), DURATION).weights(TIMES, 2),
        strict=True,
    ):
        np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.parametrize(
    "f",
    [
        SynchronizationFunction(lambda x, y, t: 0.1 * x - 0.3 * y - np.sin(t) * 0, 2, 2),
        SynchronizationFunction.from_matrices([0.1, -0.3], 2),
    ],
)
def test_a_function_without_time_has_constant_weights_at_all_times(f):
    w = f.coupling(still(2, 2), DURATION).weights(np.array([0.0, 100.0]), 2)
    np.testing.assert_allclose(w.c[1], [-0.1 * np.eye(2), 0.3 * np.eye(2)], rtol=1e-15)
    assert not w.c_dot.any() and not w.c_ddot.any()


def test_a_large_offset_does_not_swallow_the_weights():
    f = SynchronizationFunction(lambda x, y, t: x - np.pi * y + 1e6 * (1 + np.sin(t)), 2, 1)
    np.testing.assert_allclose(f.c(0.7)[:, 0, 0], [-1, np.pi], rtol=1e-14)


@pytest.mark.parametrize(
    ("weight", "subject", "time"),
    [
        (lambda t: 2 + abs(t - 2.5), "c'", 2.5),
        (lambda t: 2 + abs(t - np.e), "c", np.e),
        (lambda t: 2 + (t > 1.7), "c", 1.7),
    ],
    ids=["kink at a border of pieces", "kink", "jump"],
)
def test_weights_whose_derivatives_cannot_be_certified_are_refused(weight, subject, time):
    f = SynchronizationFunction(lambda x, y, t: weight(t) * x - y, 2, 1)
    with refused(SynchronizationError, subject, robot=0) as caught:
        f.coupling(still(2), DURATION)
    assert caught.value.time == pytest.approx(time, abs=0.02)


def test_weights_with_noise_are_refused():
    f = SynchronizationFunction(lambda x, y, t: (2 + np.sin(t) + 1e-9 * np.sin(1e6 * t)) * x - y, 2, 1)
    with refused(SynchronizationError, robot=0):
        f.coupling(still(2), DURATION)


def test_weights_end_with_the_duration_they_were_made_for():
    f = SynchronizationFunction(lambda x, y, t: (2 + np.sin(t)) * x - y, 2, 1)
    coupling = f.coupling(still(2), DURATION)
    with refused(CouplingError, "c", time=5.5):
        coupling.check_weights(np.linspace(0, 5.5, 3), 1)


# -- epsilon and f ----------------------------------------------------------------------------------------


@settings(max_examples=15)
@given(st.integers(2, 5), st.integers(1, 3), st.integers(0, 1000))
def test_the_synchronization_error_is_the_function_itself(n, m, seed):
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, m, m)) + 3 * np.eye(m)
    xd = rng.normal(size=(n, m))
    b = -np.einsum("imk,ik->m", A, xd)
    f = SynchronizationFunction(lambda *a: sum(Ai @ x for Ai, x in zip(A, a[:-1], strict=True)) + b, n, m)
    coupling = f.coupling([Hold(x) for x in xd], 1.0)
    x = xd + rng.normal(size=(n, m))
    c = coupling.weights(np.zeros(1), m).c[0]
    np.testing.assert_allclose(coupling.compare(np.matvec(c, xd - x)), [f(x, 0.0)], atol=1e-9)


def total(n, m=1):
    """x_1 + ... + x_n = 0."""
    return SynchronizationFunction(lambda *arguments: sum(arguments[:-1]), n, m)


def test_an_even_ring_divides_the_function_into_pairs():
    coupling = total(4).coupling(still(4), 1.0, graph=Coupling.ring)
    np.testing.assert_array_equal(coupling.matrix, Coupling.ring(4).matrix)
    assert coupling.synchronized_motion.sum() == 0


def test_an_odd_ring_is_allowed_with_a_warning():
    with pytest.warns(CouplingWarning, match="no synchronized motion"):
        total(3).coupling(still(3), 1.0, graph=Coupling.ring)


@pytest.mark.parametrize(
    "graph",
    [
        Coupling.signed_ring,
        Coupling.complete,
        lambda n, c, unit: Coupling(n, [(0, 1), (1, 2)], [(1, 1), (1, 1)], c),
        lambda n, c, unit: Coupling(n, [(0, 1, 2)], [(1, 1, -1)], c),
    ],
    ids=["signed ring", "complete", "chain of three", "sum with another sign"],
)
def test_a_graph_whose_errors_vanish_without_the_function_is_refused(graph):
    with refused(SynchronizationError, "graph"):
        total(3).coupling(still(3), 1.0, graph=graph)


def test_a_graph_on_which_equal_shares_cancel_is_accepted():
    star = lambda n, c, unit: Coupling(n, [(0, 1), (0, 2), (0, 3)], [(1, 3), (1, 3), (1, 3)], c)  # noqa: E731
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        w = total(4).coupling(still(4), 1.0, graph=star).synchronized_motion
    assert w.sum() == pytest.approx(0)


# -- what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("f", "subject", "data"),
    [
        (lambda x, y, t: x * x - y, "function", {"robots": (0,)}),
        (lambda x, y, t: x - np.sin(y), "function", {"robots": (1,)}),
        (lambda x, y, t: x * y - 1, "function", {"robots": (0, 1)}),
        (lambda x, y, t: x - y + 1e-6 * y**3, "function", {"robots": (1,)}),
        (lambda x, y, t: x - np.abs(y), "function", {"robots": (1,)}),
        (lambda x, y, t: [x[0], y[0]], "function", {"found": 2, "robots": ()}),
        (lambda x, y, t: x, "c", {"robot": 1}),
        (lambda x, y, t: (t - np.e) * x - y, "c", {"robot": 0}),
        (lambda x, y: x - y, "function", {"time": 0.0}),
        (lambda x, y, t: x - y * np.nan, "function", {"time": 0.0}),
        (lambda x, y, t: "zero", "function", {"time": 0.0}),
    ],
)
def test_functions_outside_the_theorem_are_refused_with_the_reason(f, subject, data):
    with refused(SynchronizationError, subject, **data):
        SynchronizationFunction(f, 2, 1).coupling(still(2), DURATION)


def test_a_desired_motion_off_the_function_is_refused_with_robot_time_and_amount():
    f = SynchronizationFunction(lambda x, y, t: 2 * x - y, 2, 1)
    late = FunctionTrajectory(lambda t: [max(0.0, t - 3) ** 2], lambda t: [0.0], lambda t: [0.0])
    with refused(SynchronizationError, "trajectories", time=5.0, found=(8.0,)) as caught:
        f.coupling([late, Hold([0.0])], DURATION)
    assert "robot 1 alone would have to be moved by [-4.0] from [4.0]" in str(caught.value)


@settings(max_examples=15)
@given(st.integers(0, 1000))
def test_moving_the_robot_named_by_the_amount_named_satisfies_the_function(seed):
    rng = np.random.default_rng(seed)
    a, b, xd = rng.uniform(1, 3), rng.uniform(-3, -1), rng.uniform(1, 2, (2, 1))
    f = SynchronizationFunction(lambda x, y, t: a * x + b * y, 2, 1)
    if np.abs(f(xd, 0.0)) < 1e-3:
        return
    with pytest.raises(SynchronizationError) as caught:
        f.coupling([Hold(x) for x in xd], 1.0)
    moved = xd.copy()
    moved[caught.value.robot] += caught.value.shift
    np.testing.assert_allclose(f(moved, 0.0), 0, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: SynchronizationFunction(1.0, 2, 1), "function"),
        (lambda: SynchronizationFunction(lambda *a: a[0], 1, 1), "robots"),
        (lambda: SynchronizationFunction(lambda *a: a[0], 2, 0), "dimension"),
        (lambda: SynchronizationFunction(lambda *a: a[0], 2, 1.5), "dimension"),
        (lambda: SynchronizationFunction.from_matrices([1.0, np.inf], 1), "matrices"),
        (lambda: SynchronizationFunction.from_matrices(matrices, 2, A_dot=matrices), "A_dot, A_ddot"),
        (lambda: total(2).coupling(still(3), 1.0), "trajectories"),
        (lambda: total(2).coupling(still(2, 2), 1.0), "robot 1, trajectory"),
        (lambda: total(2).coupling(None, 1.0), "trajectories"),
        (lambda: total(2).coupling([1.0, 2.0], 1.0), "robot 1, trajectory"),
        (lambda: total(2).coupling(still(2), 1.0, graph=3), "graph"),
        (lambda: SynchronizationFunction.from_matrices(3.0, 1), "robots"),
        (lambda: total(2).coupling(still(2), -1.0), "duration"),
        (lambda: total(2)(np.zeros(3), 0.0), "x"),
    ],
)
def test_arguments_that_do_not_fit_are_refused(make, subject):
    with refused(InputError, subject):
        make()


def test_given_derivatives_that_are_none_are_refused():
    f = SynchronizationFunction.from_matrices(
        matrices, 2, A_dot=lambda t: -matrices(t, 1), A_ddot=lambda t: matrices(t, 2)
    )
    with refused(SynchronizationError, "c'"):
        f.coupling(still(3, 2), DURATION)


# -- second order -----------------------------------------------------------------------------------------


@given(st.integers(2, 3), st.integers(1, 2), st.integers(0, 1000))
def test_the_expansion_of_a_quadratic_function_is_exact(n, m, seed):
    rng = np.random.default_rng(seed)
    H = rng.normal(size=(n * m, n * m))
    H, g = H + H.T, rng.normal(size=n * m)

    def f(*arguments):
        x = np.concatenate(arguments[:-1])
        return x @ H @ x + g @ x - 2

    xd, e = rng.normal(size=(n, m)), rng.normal(size=(n, m))
    function = SynchronizationFunction(f, n, m)
    series = function.expand(xd)
    first = np.einsum("ikm,im->k", series.c, e)
    second = np.einsum("im,kijmo,jo->k", e, series.second, e)
    np.testing.assert_allclose(series.value + first + second, function(xd - e, 0.0), atol=1e-8)


def test_the_expansion_of_a_smooth_function_has_its_derivatives():
    function = SynchronizationFunction(lambda x, y, t: np.sin(x) * np.exp(y) - t, 2, 1)
    x, y, t = 0.4, -0.3, 1.5
    series = function.expand([[x], [y]], t)
    np.testing.assert_allclose(series.value, np.sin(x) * np.exp(y) - t)
    np.testing.assert_allclose(
        series.c[:, 0, 0], [-np.cos(x) * np.exp(y), -np.sin(x) * np.exp(y)], rtol=1e-10
    )
    hessian = np.exp(y) * np.array([[-np.sin(x), np.cos(x)], [np.cos(x), np.sin(x)]])
    np.testing.assert_allclose(series.second[0, :, :, 0, 0], hessian / 2, rtol=1e-8)


def test_a_linear_function_has_no_second_order_terms():
    series = SynchronizationFunction(lambda x, y, t: 2 * x - y + t, 2, 2).expand(np.ones((2, 2)), 1.0)
    assert series.linear and series.invertible and series.second_order_terms() == []


def test_second_order_terms_are_named_robot_by_robot():
    function = SynchronizationFunction(lambda x, y, t: [x @ y, x[0] - x[0] * y[1]], 2, 2)
    terms = function.expand(np.ones((2, 2))).second_order_terms()
    assert terms[0] == "+0.5 e_1^T e_2 in row 1"
    assert any(term.startswith("e_1^T [[") and term.endswith("e_2 in row 2") for term in terms)


def test_a_function_with_a_kink_on_the_desired_motion_has_no_expansion():
    function = SynchronizationFunction(lambda x, y, t: x - np.abs(y), 2, 1)
    with refused(SynchronizationError, "function", time=0.0):
        function.expand([[0.0], [0.0]])
    assert function.expand([[1.0], [1.0]]).linear


def test_a_function_that_is_not_linear_is_refused_with_its_second_order_terms():
    function = SynchronizationFunction(lambda x, y, t: x @ x + y @ y - 5, 2, 2)
    with pytest.raises(SynchronizationError) as caught:
        function.coupling([Circle([0, 0], 1, 1), Circle([0, 0], 2, 1)], 3.0)
    said = str(caught.value)
    assert "1 by 2 and has no inverse" in said
    assert "not linear (assumption 1) in the coordinates of robot" in said
    assert "+1 e_1^T e_1, +1 e_2^T e_2" in said
