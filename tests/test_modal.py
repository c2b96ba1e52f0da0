"""Theorem B: from r to w, mode by mode of S^T S: the filters' norms, and the bounds along runs."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused
from scipy.integrate import simpson, solve_ivp
from scipy.interpolate import CubicSpline
from scipy.linalg import solve_continuous_lyapunov
from scipy.signal import fftconvolve
from theory_cells import GAINS, coupling, experiment, planar_arm

from synctrl import Cell, Coupling, Disturbance, Experiment, Friction, FunctionTrajectory, Member, Network
from synctrl.analysis import modal_bounds
from synctrl.analysis.modal import ModalBounds
from synctrl.analysis.modal_filter import ModalFilter
from synctrl.analysis.modal_signals import true_integral
from synctrl.analysis.replay import replay
from synctrl.control.laws import ChungSlotine, ComputedTorque, SlotineLi, SunMills
from synctrl.control.network import Ideal
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, ur5_payload
from synctrl.show.modal_figures import modal_figure
from synctrl.simulation.devices import Bias
from synctrl.simulation.plant import Plant

RING = Coupling.signed_ring(4).matrix
#: by how much a bound may be missed for the quadrature's sake
QUADRATURE = 1e-5


# -- the filter -------------------------------------------------------------------------------------------


def filters(Lambda: float, beta: float, leak: float, S: np.ndarray = RING) -> ModalFilter:
    return ModalFilter.from_matrix(S, *(np.array([gain]) for gain in (Lambda, beta, leak)))


def of_the_law(Lambda: float, beta: float, leak: float, eigenvalue: float) -> np.ndarray:
    """The rates of (w_j, E_j) without r, from r = w' + Lambda w + beta sigma + (Lambda - l) beta E."""
    return np.array([[-Lambda - beta * eigenvalue, -(Lambda - leak) * beta], [eigenvalue, -leak]])


gains_of_filters = st.tuples(st.floats(0.5, 50), st.floats(0.1, 50), st.sampled_from([0.0, 0.1, 0.7, 1.0]))


@settings(max_examples=15, deadline=None)
@given(gains_of_filters)
def test_the_gain_is_the_largest_value_on_the_imaginary_axis(gains):
    Lambda, beta, share = gains
    modes = filters(Lambda, beta, share * Lambda)
    places = 1j * Lambda * np.geomspace(1e-4, 1e4, 2001)[:, None, None] * np.eye(2)
    for eigenvalue, gain in zip(modes.eigenvalues, modes.gain[:, 0], strict=True):
        values = np.abs(np.linalg.inv(places - of_the_law(Lambda, beta, share * Lambda, eigenvalue))[:, 0, 0])
        assert values.max() == pytest.approx(gain, rel=1e-4)
        assert (values <= gain * (1 + 1e-12)).all()


@settings(max_examples=25, deadline=None)
@given(gains_of_filters)
def test_the_h2_norm_is_that_of_the_lyapunov_equation(gains):
    Lambda, beta, share = gains
    modes = filters(Lambda, beta, share * Lambda)
    driven = np.diag([-1.0, 0.0])  # by r, which is white noise
    for eigenvalue, h2 in zip(modes.eigenvalues, modes.h2[:, 0], strict=True):
        A = of_the_law(Lambda, beta, share * Lambda, eigenvalue)
        A[1, 1] -= eigenvalue == 0  # E is 0 there, and may as well die out
        assert h2**2 == pytest.approx(solve_continuous_lyapunov(A, driven)[0, 0], rel=1e-9)


@pytest.mark.parametrize("leak", [0.0, 1.5, 4.0])
@pytest.mark.parametrize("beta", [0.0, 2.0, 3.0])
def test_modes_make_what_the_law_makes_of_any_r_from_any_start(leak, beta):
    """All robots at once, by the law's differential equation, against free response and convolution."""
    Lambda, n, t = 4.0, 4, np.linspace(0.0, 1.5, 1501)
    modes, rng = filters(Lambda, beta, leak), np.random.default_rng(3)
    w0, I0, size = rng.normal(size=n), rng.normal(size=4), rng.normal(size=n)
    E0, L = RING.T @ I0, RING.T @ RING

    def r(time):
        return size[:, None] * np.cos(np.arange(1, n + 1)[:, None] * 2.0 * time)

    def rate(time, y):
        w, E = y[:n], y[n:]
        w_dot = r(time)[:, 0] - Lambda * w - beta * L @ w - (Lambda - leak) * beta * E
        return np.concatenate((w_dot, L @ w - leak * E))

    law = solve_ivp(rate, (0, 1.5), np.concatenate((w0, E0)), rtol=1e-10, atol=1e-12, t_eval=[0.4, 1.5])
    free = modes.free(t, modes.to_modes(w0[:, None]), modes.to_modes(E0[:, None]))[:, :, 0]
    impulse = modes.free(t, np.ones((n, 1)), np.zeros((n, 1)))[:, :, 0]
    for k, row in zip((400, 1500), law.y[:n].T, strict=True):
        pushed = simpson(impulse[k::-1] * (modes.vectors.T @ r(t[: k + 1])).T, x=t[: k + 1], axis=0)
        np.testing.assert_allclose(modes.vectors @ (free[k] + pushed), row, atol=1e-8)


@pytest.mark.parametrize("leak", [0.0, 1.5, 4.0])
def test_the_norm_of_the_free_response_is_its_norm(leak):
    modes, rng = filters(4.0, 3.0, leak), np.random.default_rng(4)
    w0, E0 = rng.normal(size=(4, 1)), modes.to_modes(RING.T @ rng.normal(size=(4, 1)))
    t = np.linspace(0.0, 12.0, 24001)
    norm = np.sqrt(simpson(modes.free(t, w0, E0) ** 2, x=t, axis=0))
    np.testing.assert_allclose(modes.free_norm(w0, E0), norm, rtol=1e-6)
    np.testing.assert_array_equal(modes.free(np.zeros(1), w0, E0)[0], w0)
    assert (np.abs(modes.free(t, w0, 0 * E0)) <= np.abs(w0)).all()


@pytest.mark.parametrize("leak", [0.0, 1.5])
def test_an_r_that_is_made_for_it_reaches_each_norm(leak):
    modes = filters(4.0, 3.0, leak)
    t = np.linspace(0.0, 30.0, 30001)
    impulse = modes.free(t, np.ones((4, 1)), np.zeros((4, 1)))[:, :, 0]
    for j in range(4):
        a, b = 4.0, leak + 3.0 * modes.eigenvalues[j]
        slow = leak**2 - np.sqrt((a**2 - leak**2) * (b**2 - leak**2)) if modes.eigenvalues[j] else 0.0
        tone = np.cos(np.sqrt(max(0.0, -slow)) * t)
        answer = fftconvolve(impulse[:, j], tone)[: t.size] * t[1]
        assert np.linalg.norm(answer) >= 0.95 * modes.gain[j, 0] * np.linalg.norm(tone)
        backwards = impulse[::-1, j]
        peak = simpson(impulse[:, j] ** 2, x=t)
        assert peak >= 0.99 * modes.h2[j, 0] * np.sqrt(simpson(backwards**2, x=t))


def test_what_a_constant_r_leaves_is_what_the_filter_tells():
    for leak in (0.0, 1.5):
        modes, t = filters(4.0, 3.0, leak), np.linspace(0.0, 12.0, 12001)
        impulse = modes.free(t, np.ones((4, 1)), np.zeros((4, 1)))
        np.testing.assert_allclose(simpson(impulse, x=t, axis=0), modes.static, atol=1e-6)
        assert (modes.static[1:] == 0).all() == (leak == 0)
        assert modes.static[0, 0] == 1 / 4.0


# -- runs -------------------------------------------------------------------------------------------------


def holds(bounds) -> bool:
    """No bound is violated, with the r of the run or a priori."""
    for bounded in (bounds.l2, bounds.peak, bounds.errors):
        room = QUADRATURE * bounded.bound.max()
        if (bounded.actual > bounded.bound + room).any():
            return False
        if bounded.a_priori is not None and (bounded.bound > bounded.a_priori + room).any():
            return False
    return True


@st.composite
def cells(draw):
    """Any coupling, weights, gains, and what acts from outside, on arms that are square or redundant."""
    cartesian = draw(st.booleans())
    joints = draw(st.sampled_from([2, 3])) if cartesian else 2
    kind = draw(st.sampled_from(["pair", "ring", "signed graph", "all-to-all"]))
    n = 2 if kind == "pair" else draw(st.sampled_from([3, 4]))
    link = coupling(kind, n, 2, draw(st.sampled_from(["scalar", "constant", "moving"])))
    gains = GAINS.replace(
        Lambda=draw(st.floats(2, 8)),
        beta=draw(st.sampled_from([0.0, 0.5, 6.0])),
        K_eps=draw(st.sampled_from([0.0, 2.0])),
        Gamma=draw(st.sampled_from([0.0, 0.02])),
        leak=draw(st.sampled_from([0.0, 1.0])),
    )
    push = [(), (Disturbance(0, 3.0, 0.05, 0.1),)][draw(st.booleans())]
    rubs = [None, Friction(viscous=0.5, coulomb=0.5)][draw(st.booleans())]
    task = draw(st.sampled_from(["joint", "task"])) if joints == 2 else "joint"
    return experiment(
        link, gains, joints=joints, cartesian=cartesian, friction=rubs, disturbances=push, k_r_space=task
    )


@pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning", "ignore::synctrl.errors.StepWarning")
@settings(max_examples=12, deadline=None)
@given(cells())
def test_no_bound_is_violated_whatever_the_coupling_and_whatever_acts(cell):
    bounds = modal_bounds(cell.simulate(0.1, dt=1e-3))
    assert holds(bounds) and bounds.reason is None
    assert bounds.gap.max() <= 1e-9 * bounds.rho.max()


@pytest.mark.parametrize("kind", ["pair", "all-to-all"])
def test_before_a_run_errors_have_the_bound_of_kappa_however_many_robots_there_are(kind):
    cell = experiment(coupling(kind, 2 if kind == "pair" else 4, 2), cartesian=True)
    bounds = modal_bounds(cell.simulate(0.1, dt=1e-3))
    r = bounds.kappa * bounds.X_bound + np.linalg.norm(bounds.gap)
    c_inv = np.linalg.norm(cell.cell.coupling.weights(np.zeros(1), 2).c_inv[0], 2, axis=(1, 2))
    plain = c_inv * (np.linalg.norm(bounds.w[0]) + r / np.sqrt(2 * bounds.filter.Lambda.min()))
    assert (bounds.errors.bound <= bounds.errors.a_priori).all()
    assert (bounds.errors.a_priori <= plain).all()


def test_no_bound_is_violated_for_poses_of_arms_under_an_unknown_payload():
    bounds = modal_bounds(ur5_payload().simulate(0.1, dt=5e-4, engine="compiled"))
    assert holds(bounds) and bounds.reason is None and bounds.w.shape[1:] == (2, 6)


@pytest.mark.parametrize("cell", [ur5_payload, a460_pair], ids=["ur5", "a460"])
def test_errors_are_bounded_a_priori_by_no_more_than_all_of_r_makes_of_them(cell):
    """|c^-1| (|w(0)| + kappa X / sqrt(2 min Lambda)), for c = 1 and -1."""
    bounds = modal_bounds(cell().simulate(0.1, dt=5e-4, engine="compiled"))
    plain = np.linalg.norm(bounds.w[0]) + bounds.kappa * bounds.X_bound / np.sqrt(
        2 * bounds.filter.Lambda.min()
    )
    assert (bounds.errors.actual <= bounds.errors.bound).all()
    assert (bounds.errors.bound <= bounds.errors.a_priori).all()
    assert (bounds.errors.a_priori <= plain).all()


def filtered(bounds: ModalBounds, start: np.ndarray) -> np.ndarray:
    """w_j at the end, (n, m), of the law's differential equation with the r of a run."""
    modes, shape, r = bounds.filter, bounds.w[0].shape, CubicSpline(bounds.t, bounds.r)

    def rate(t, y):
        w, E = y.reshape(2, *shape)
        w_dot = r(t) - (modes.Lambda + modes.pull) * w - (modes.Lambda - modes.leak) * modes.beta * E
        return np.stack((w_dot, modes.eigenvalues[:, None] * w - modes.leak * E)).ravel()

    y0 = np.stack((bounds.w[0], modes.to_modes(start))).ravel()
    run = solve_ivp(rate, (0, bounds.t[-1]), y0, rtol=1e-8, atol=1e-11, max_step=5e-3)
    return run.y[:, -1].reshape(2, *shape)[0]


def test_synchronization_errors_are_the_differences_of_the_modes():
    run = experiment(coupling("ring", 4, 2, "constant")).simulate(0.05, dt=1e-3)
    bounds = modal_bounds(run)
    of_modes = ((bounds.differences[:, None] * bounds.w) ** 2).sum(axis=1)
    np.testing.assert_allclose(of_modes, (run.sync_error**2).sum(axis=1), rtol=1e-9)


@pytest.mark.parametrize("leak", [0.0, 1.0])
def test_w_filtered_from_the_r_of_the_law_is_the_w_of_the_run(leak):
    link = coupling("signed graph", 3, 2, "moving")
    run = experiment(link, GAINS.replace(leak=leak), cartesian=True).simulate(0.15, dt=1e-3)
    bounds = modal_bounds(run)
    law = replay(run).rows.r[replay(run).logged]
    np.testing.assert_allclose(bounds.r, bounds.filter.to_modes(law), atol=1e-12 * np.abs(law).max())
    start = np.zeros(bounds.w.shape[1:])
    np.testing.assert_allclose(filtered(bounds, start), bounds.w[-1], atol=1e-6 * np.abs(bounds.w).max())


class Remembering(Ideal):
    """Integrals that do not start at 0."""

    def bind(self, cell):
        bound = super().bind(cell)
        bound.start = lambda: np.full((cell.coupling.pairs, cell.m), 0.02)
        return bound


@pytest.mark.parametrize("leak", [0.0, 1.0])
def test_integrals_that_do_not_start_at_zero_are_treated_exactly(leak):
    cell = experiment(coupling("pair", 2, 2), GAINS.replace(leak=leak), network=Remembering(leak))
    run = cell.simulate(0.3, dt=1e-3)
    bounds = modal_bounds(run)
    start = cell.cell.coupling.distribute(run.sync_integral[0])
    assert np.abs(start).min() > 0 and holds(bounds)
    np.testing.assert_allclose(filtered(bounds, start), bounds.w[-1], atol=1e-6 * np.abs(bounds.w).max())
    assert not np.allclose(filtered(bounds, 0 * start), bounds.w[-1], atol=1e-3 * np.abs(bounds.w).max())


@pytest.mark.parametrize("leak", [0.0, 1.0, 4.0])
def test_integrals_of_the_true_sigma_are_those_of_a_law_that_is_told_it(leak):
    run = replay(experiment(coupling("pair", 2, 2), GAINS.replace(leak=leak)).simulate(0.1, dt=1e-3))
    x, link = run.rows, run.loop.cell.coupling
    E = true_integral(run, x.sigma, link.distribute(x.epsilon_dot))
    np.testing.assert_allclose(E, x.E, rtol=0, atol=1e-7 * np.abs(x.E).max())


def kicked(q_jump: float, v_jump: float) -> Experiment:
    class Kicked(Plant):
        events = (0.0503,)

        def meet(self, t, q, v, hidden):
            return q + q_jump, v + v_jump, hidden

    return replace(experiment(coupling("pair", 2, 2)), plant_type=Kicked)


def test_a_jump_of_velocities_is_in_r_and_one_of_positions_is_refused():
    assert holds(modal_bounds(kicked(0.0, 0.5).simulate(0.1, dt=1e-3)))
    run = kicked(0.01, 0.0).simulate(0.1, dt=1e-3)
    with refused(InputError, "result", found=run.t[run.t > 0.0503][0]):
        modal_bounds(run)


OTHERS = {
    "delay": ({"network": Network(delay=0.02)}, {}),
    "messages": ({"network": Network(period=0.01, loss=0.3, receiver="hold")}, {}),
    "sampled": ({}, {"control_period": 5e-3}),
    "sensors": ({"sensors": [Bias(1e-2)]}, {"control_period": 5e-3}),
}


@pytest.mark.parametrize("others", OTHERS)
@pytest.mark.parametrize("leak", [0.0, 1.0])
def test_bounds_are_of_the_true_r_where_robots_were_told_others(others, leak):
    options, way = OTHERS[others]
    cell = experiment(coupling("pair", 2, 2), GAINS.replace(leak=leak), **options)
    run = cell.simulate(0.2, dt=1e-3, **way)
    bounds = modal_bounds(run)
    assert holds(bounds) and "told" in bounds.reason
    assert bounds.gap.max() > 1e-6 * bounds.rho.max()
    start = np.zeros(bounds.w.shape[1:])
    np.testing.assert_allclose(filtered(bounds, start), bounds.w[-1], atol=1e-4 * np.abs(bounds.w).max())


@pytest.mark.parametrize("law", [SlotineLi(), ChungSlotine(2.0)], ids=lambda law: type(law).__name__)
def test_laws_whose_r_is_that_of_tracking_are_covered(law):
    cell = experiment(coupling("pair", 2, 2), GAINS.independent(), law=law)
    bounds = modal_bounds(cell.simulate(0.1, dt=1e-3))
    assert holds(bounds) and bounds.reason is None
    assert (bounds.filter.gain == 1 / GAINS.Lambda).all() and bounds.sentence.startswith("without beta")


def test_damping_of_r_beside_the_force_changes_r_and_no_bound():
    bounds = modal_bounds(experiment(coupling("pair", 2, 2), law=SunMills(injection=True)).simulate(0.1))
    assert holds(bounds) and bounds.reason is None and bounds.unbounded is None


def test_another_law_is_named_as_the_reason():
    gains = GAINS.independent()
    cell = experiment(coupling("pair", 2, 2), gains, law=ComputedTorque())
    assert "law ComputedTorque" in modal_bounds(cell.simulate(0.05, dt=1e-3)).reason
    moving = experiment(coupling("pair", 2, 2, "moving"), gains, law=SlotineLi())
    assert "law SlotineLi" in modal_bounds(moving.simulate(0.05, dt=1e-3)).reason


def frozen_pair(Lambda: float, beta: float, K_r: float, known: tuple[float, float], size=0.0, rate=1.0):
    """Two equal arms under gravity, known wrongly for good, that start in place and swing apart."""
    arm, q0 = planar_arm(gravity=9.81), np.array([0.4, 1.1])

    def swung(a: float) -> FunctionTrajectory:
        return FunctionTrajectory(
            lambda t: q0 + a * (1 - np.cos(rate * t)),
            lambda t: a * rate * np.sin(rate * t) * np.ones(2),
            lambda t: a * rate**2 * np.cos(rate * t) * np.ones(2),
        )

    wrong = [(share * arm.inertial_parameters, a) for share, a in zip(known, (size, -size), strict=True)]
    members = [Member(arm, swung(a), q0, theta_hat0=theta) for theta, a in wrong]
    gains = GAINS.replace(Lambda=Lambda, beta=beta, K_r=K_r, K_eps=0.0, Gamma=0.0)
    return Experiment(Cell(members, Coupling.pair()), gains, 1.0)


@pytest.mark.parametrize(
    ("name", "mode", "cell", "duration"),
    [  # a long push, one that begins slowly, one that swings at sqrt(a b), and two that begin fast or slowly
        ("l2", 0, lambda: frozen_pair(20.0, 3.0, 20.0, (0.5, 0.5)), 0.8),
        ("peak", 0, lambda: frozen_pair(4.0, 3.0, 2.0, (0.5, 0.5)), 0.3),
        ("l2", 1, lambda: frozen_pair(20.0, 10.0, 10.0, (0.5, 1.5), 0.1, 20.0), 1.0),
        ("peak", 1, lambda: frozen_pair(4.0, 1.0, 1.0, (1.0, 0.5)), 0.25),
        ("errors", 0, lambda: frozen_pair(4.0, 3.0, 2.0, (0.5, 0.5)), 0.3),
    ],
    ids=["energy of the common mode", "its peak", "energy of the differences", "their peak", "errors"],
)
def test_a_run_from_rest_reaches_nine_tenths_of_the_bound(name, mode, cell, duration):
    bounds = modal_bounds(cell().simulate(duration, dt=1e-3, engine="compiled"))
    assert not bounds.free.any() and holds(bounds)
    assert 0.9 <= getattr(bounds, name).share[mode].max() <= 1


@pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")
def test_constant_r_leaves_no_difference_once_beta_is_there():
    """The zero at p = 0: late errors of two A460 that friction holds, with beta and without."""
    with_beta, alone = (
        modal_bounds(a460_pair(synchronized=on).simulate(5.0, engine="compiled", log_dt=1e-2))
        for on in (True, False)
    )
    late = with_beta.t > 4.5
    common, apart = 0, 1
    for bounds in (with_beta, alone):
        r, w = bounds.r[late], bounds.w[late]
        static = bounds.filter.static * r
        assert np.abs(w[:, common] - static[:, common]).max() < 0.1 * np.abs(w[:, common]).max()
        assert np.abs(r[:, apart]).max() > 0.05 * np.abs(r[:, common]).max()
    size = [np.abs(bounds.w[late][:, apart]).max() for bounds in (with_beta, alone)]
    assert size[0] < size[1] / (1 + 2 * 8.0 / 8.0)
    np.testing.assert_allclose(
        np.abs(with_beta.w[late][:, common]).max(), np.abs(alone.w[late][:, common]).max(), rtol=0.05
    )


def test_the_sentence_says_how_much_smaller_the_gain_is():
    assert "3 times smaller" in filters(4.0, 4.0, 0.0, np.array([[1.0, -1.0]])).sentence
    ring = filters(4.0, 4.0, 0.0).sentence
    assert "3 to 5 times smaller" in ring
    assert "leaves nothing in them, and r/Lambda in the common mode" in ring
    leaky = filters(4.0, 4.0, 1.0)
    assert f"at most {leaky.static[1, 0]:.3g} s times r in them" in leaky.sentence
    odd = filters(4.0, 4.0, 0.0, np.array([[1.0, 1, 0], [0, 1, 1], [1, 0, 1]])).sentence
    assert "common mode" not in odd


def test_bounds_are_plain_data_and_words():
    bounds = modal_bounds(experiment(coupling("pair", 2, 2)).simulate(0.05, dt=1e-3))
    told = json.loads(json.dumps(bounds.as_dict(), allow_nan=False))
    assert np.shape(told["peak"]["bound"]) == (2, 2) and told["reason"] is None
    assert bounds.sentence in str(bounds) and all(name in str(bounds) for name in bounds.names)
    assert repr(bounds) == str(bounds)


def test_modes_of_one_eigenvalue_are_told_apart_and_every_number_has_its_unit():
    run = experiment(coupling("signed graph", 4, 2)).simulate(0.05, dt=1e-3)
    bounds = modal_bounds(replace(run, info=run.info | {"weighted_units": ["m", "rad"]}), run.experiment)
    rows = [line.strip() for line in str(bounds).splitlines() if "sup |w|" in line]
    assert [row.partition(",")[0] for row in rows] == [f"mode {j}" for j in (1, 1, 2, 2, 3, 3, 4, 4)]
    assert [row.rpartition(" ")[2] for row in rows] == ["m", "rad"] * 4
    mixed = str(replace(bounds, error_unit="m, rad"))
    assert all(row.endswith(" (m, rad)") for row in mixed.splitlines() if "sup |e|" in row)


@pytest.mark.parametrize("known", [0.6, 1.0])
def test_the_figure_has_a_panel_for_each_eigenvalue_with_the_run_inside_the_bands(known):
    run = experiment(coupling("signed graph", 4, 2), known=known).simulate(0.05, dt=1e-3)
    bounds = modal_bounds(run)
    panels = modal_figure(bounds).axes
    assert [panel.get_title(loc="left").partition(":")[0] for panel in panels] == [
        "common mode, λ = 0", "differences, λ = 2", "differences, λ = 4",
    ]  # fmt: skip
    for panel in panels:
        inner, outer = (band.get_paths()[0].vertices[:, 1].max() for band in panel.collections)
        line = panel.lines[0].get_ydata()
        assert line.max() <= inner <= outer
        assert panel.get_ylim() == panels[0].get_ylim() and panel.get_ylim()[0] < line.max()
    still = replace(bounds, w=bounds.w * np.array([1.0, 1, 1, 1e-7])[:, None])
    assert all(panel.get_ylim()[0] < panel.lines[0].get_ydata().max() for panel in modal_figure(still).axes)
