"""Theorem C: the linear system of small errors, its multipliers, and the closed loop itself."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cells import along, look, random_experiment
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import rod_arm, seeds
from refusals import refused
from scipy.linalg import expm
from theory_cells import planar_arm

from synctrl import (
    AxisRotation,
    CartesianSpace,
    Cell,
    Circle,
    Coupling,
    Damping,
    Disturbance,
    Experiment,
    Friction,
    FunctionTrajectory,
    Gains,
    Hold,
    Member,
    PoseSpace,
    PoseTrajectory,
    load_robot,
)
from synctrl.analysis import ExponentialRate, RatesOverGamma, exponential_rate, rates_over_gamma
from synctrl.analysis.decay import simulated_decay
from synctrl.analysis.monodromy import monodromy
from synctrl.analysis.on_motion import DesiredMotion
from synctrl.analysis.small_errors import Coordinates, error_matrices, make_coordinates
from synctrl.control.adaptation import Gradient
from synctrl.control.controller import Signals
from synctrl.control.laws import ChungSlotine
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four
from synctrl.robots.parameters import FrictionParameters, planar_two_link_parameters
from synctrl.show.rate_figures import rates_figure

GAINS = Gains(Lambda=6.0, beta=3.0, K_r=2.0, K_eps=0.4, Gamma=0.3)
PERIOD = 1.0
PAGE = Path(__file__).parents[1] / "docs" / "theorem_c.md"
ROD = rod_arm((1.0, 1.0), (0.3, 0.3))
THREE = planar_two_link_parameters(ROD, (1.0, 1.0), (0.3, 0.3))


def sines(center, size, turns, phase, period: float = PERIOD) -> FunctionTrajectory:
    """Whole numbers of turns in a period, about a center."""
    size, w = np.asarray(size), 2 * np.pi / period * np.asarray(turns)
    return FunctionTrajectory(
        lambda t: center + size * np.sin(np.multiply.outer(t, w) + phase),
        lambda t: size * w * np.cos(np.multiply.outer(t, w) + phase),
        lambda t: -size * w**2 * np.sin(np.multiply.outer(t, w) + phase),
    )


def rods(center=(0.3, 1.0), size=(0.5, 0.5), gains=GAINS, **options) -> Experiment:
    """Arms of rods that swing in joint space, with the three parameters of (50)."""
    own = {"parameters": THREE, **options}
    members = [
        Member(
            ROD,
            sines(np.array(center), size, (1, 2), np.array([0.4 * i, 1.0 + i])),
            name=f"arm {i + 1}",
            **own,
        )
        for i in range(2)
    ]
    return Experiment(Cell(members, Coupling.pair()), gains, PERIOD)


def circles(moving: bool = True) -> Experiment:
    """Tips of two arms on circles, under weights that turn with them and are not diagonal."""

    def c(t: float) -> tuple[np.ndarray, ...]:
        w = 2 * np.pi / 0.5
        base = np.array([[1.2, 0.2], [-0.1, 0.9]])
        swing = 0.3 * np.array([[0.5, 1.0], [-0.4, 0.2]])
        parts = base + swing * np.sin(w * t), swing * w * np.cos(w * t), -swing * w * w * np.sin(w * t)
        return tuple(np.array([part, -part.T]) for part in parts)

    members = []
    for i, q in enumerate(np.array([[0.3, 1.2], [0.8, 1.6]])):
        center = ROD.tip_position(q)[:2]
        motion = Circle(center, 0.05, 2 * np.pi / 0.5, phase=1.0 * i)
        members.append(Member(ROD, motion, q, parameters=THREE, name=f"arm {i + 1}"))
    cell = Cell(members, Coupling.pair(c if moving else (1.0, -1.0)), CartesianSpace("xy"))
    gains = GAINS.replace(leak=2.0, K_r=4.0, K_eps=30.0, beta=[2.0, 4.0])
    return Experiment(cell, gains, 0.5, k_r_space="task")


def weighed() -> Experiment:
    """Two arms that hold still under gravity."""
    arm = planar_arm(2, 9.81)
    members = [
        Member(arm, Hold(q), parameters="base", name=f"arm {i + 1}")
        for i, q in enumerate(np.array([[0.3, 1.0], [-0.4, 0.7]]))
    ]
    return Experiment(Cell(members, Coupling.pair()), GAINS.replace(Gamma=0.5), 0.4)


def rubbing() -> Experiment:
    """Two arms whose viscous and Coulomb friction is adapted."""
    friction = Friction(viscous=0.3, coulomb=0.05, smoothing=2.0)
    parameters = FrictionParameters(ROD, friction, THREE)
    gains = GAINS.replace(Gamma=[0.3, 0.2, 0.4, 1.0, 2.0, 1.0, 2.0])
    return rods(gains=gains, parameters=parameters, friction=friction)


#: experiment and period; the second to last has directions that are not excited
CELLS: dict[str, tuple[Callable[[], Experiment], float]] = {
    "slow": (lambda: rods(gains=GAINS.replace(Gamma=0.03)), PERIOD),
    "fast": (rods, PERIOD),
    "moving weights, task damping, leak": (circles, 0.5),
    "friction in Y": (rubbing, PERIOD),
    "straight arm": (lambda: rods(center=(0.3, 0.0), size=(0.5, 0.0)), PERIOD),
    "at rest": (weighed, 0.4),
}
FOUND: dict[str, ExponentialRate] = {}


def rate_of(name: str) -> tuple[Experiment, ExponentialRate]:
    """A cell and its rate, computed once."""
    make, period = CELLS[name]
    if name not in FOUND:
        FOUND[name] = exponential_rate(make(), period)
    return make(), FOUND[name]


# -- against the closed loop -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CELLS)
def test_a_small_error_falls_in_a_simulated_period_by_the_multiplier(name: str) -> None:
    experiment, rate = rate_of(name)
    found = simulated_decay(experiment, rate, dt=2e-3)
    assert 0 < abs(found.multiplier) < 1
    assert found.misfit < 0.01
    np.testing.assert_allclose(found.after, found.expected, atol=0.02 * np.abs(found.expected).max())


def test_parameters_that_are_not_excited_keep_their_error() -> None:
    experiment, rate = rate_of("straight arm")
    assert rate.multipliers[:2].tolist() == [1.0, 1.0] and abs(rate.multipliers[2]) < 1
    assert rate.radius == 1.0 and rate.rate == 0.0 < rate.excited_rate and not rate.stable
    assert [text.partition(":")[0] for text in rate.unexcited] == ["arm 1", "arm 2"]
    found = simulated_decay(experiment, rate, 0, dt=2e-3)
    assert found.simulated == pytest.approx(1.0, abs=1e-6)
    assert np.abs(found.after).max() == pytest.approx(np.abs(found.before).max(), rel=1e-6)


def test_at_rest_as_many_combinations_are_excited_as_joints_are_loaded() -> None:
    _, rate = rate_of("at rest")
    z = rate.coordinates
    assert [found.rank - count for found, count in zip(z.groupings, z.unexcited, strict=True)] == [2, 2]
    assert len(rate.unexcited) == sum(z.unexcited)


def test_the_papers_a460_at_rest_learn_what_their_gravity_shows() -> None:
    """Joint 1 is vertical, so gravity loads two joints of each arm, in one posture."""
    rate = exponential_rate(a460_pair(friction=False), 1.0, start=5.0)
    z = rate.coordinates
    assert [found.rank - count for found, count in zip(z.groupings, z.unexcited, strict=True)] == [2, 2]
    assert 0 < rate.excited_rate < z.controller.Lambda.min() / 60
    assert f"at {rate.excited_rate:.2f} 1/s" in PAGE.read_text("utf-8")


def test_a_rate_does_not_depend_on_how_many_periods_count_as_one() -> None:
    """Of directions that are not excited nothing may leak into what is left of the others."""
    for name, periods in (("at rest", 400), ("straight arm", 8)):
        experiment, rate = rate_of(name)
        longer = exponential_rate(experiment, periods * rate.period)
        assert longer.unexcited and longer.excited_rate == pytest.approx(rate.excited_rate, rel=1e-4)


def test_errors_that_grow_beyond_numbers_are_refused() -> None:
    with refused(InputError, "period", found=1.0):
        monodromy(lambda times: np.tile(1e4 * np.eye(2), (len(times), 1, 1)), [0.0, 1.0])


def test_a_period_after_which_only_rounding_is_left_is_refused() -> None:
    with refused(InputError, "period", found=250.0):
        exponential_rate(weighed(), 250.0)


def test_a_motion_that_has_faded_away_excites_nothing() -> None:
    rate = exponential_rate(planar_four(), 1.0, start=25.0)  # what rounding leaves of it does not count
    assert rate.coordinates.unexcited == (3, 3, 3, 3)
    assert rate.slowest.startswith("robot") and rate.excited_rate > 0


def test_learning_faster_is_not_always_faster() -> None:
    """Best in between: less than half as fast with a thirtieth of that Gamma, and with five times as much."""
    rates = rates_over_gamma(rods(gains=GAINS.replace(Gamma=1.0)), PERIOD, [0.1, 3.0, 16.0])
    assert rates.best == 3.0
    assert rates.rates[0] < rates.rates[1] / 2 and rates.rates[2] < rates.rates[1] / 2
    fastest = rods(gains=GAINS.replace(Gamma=16.0))
    rate = exponential_rate(fastest, PERIOD)
    assert rate.rate == pytest.approx(rates.rates[2], rel=1e-6)
    assert simulated_decay(fastest, rate, dt=5e-4, engine="compiled").misfit < 0.01


# -- the linear system -------------------------------------------------------------------------------------


def errors_of(z: Coordinates, s: Signals, memory: np.ndarray) -> np.ndarray:
    return z.of(s.s_q, s.theta_hat, s.e_star, memory)


def linear_and_differences(experiment: Experiment, t: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A z, and half the difference of z' at errors z and -z in the nonlinear closed loop."""
    loop, rng = experiment.closed_loop(), np.random.default_rng(seed)
    motion = DesiredMotion(loop)
    on = motion.at(np.array([t]))
    z = make_coordinates(loop.controller, on)
    state = loop.state(loop.initial_state())
    state.q[...], state.v[...], state.z[...] = motion.arrived(t), 0.0, loop.cell.theta
    state.v[...] = look(loop, t, state.flat)[1].v_ref
    change = rng.uniform(-1e-4, 1e-4, loop.size)
    loop.state(change).memory[...] = z.B @ rng.uniform(-1e-4, 1e-4, (z.B.shape[1], loop.cell.m))
    found = []
    for y in (state.flat + change, state.flat - change):
        now = errors_of(z, look(loop, t, y)[1], loop.state(y).memory)
        grown = along(loop, t, y, lambda _, at, s: errors_of(z, s, loop.state(at).memory))
        found.append((now, grown))
    (first, first_rate), (second, second_rate) = found
    return error_matrices(on, z)[0] @ (first - second) / 2, (first_rate - second_rate) / 2


def close(linear: np.ndarray, differences: np.ndarray) -> None:
    np.testing.assert_allclose(linear, differences, atol=1e-4 * np.abs(differences).max())


@settings(max_examples=8)
@given(seeds, st.sampled_from(["joint", "xy"]), st.sampled_from(["pair", "ring", "chain"]), st.booleans())
def test_the_linear_system_is_the_derivative_of_the_closed_loop(seed, space, coupling, moving):
    close(*linear_and_differences(random_experiment(seed, space, coupling, moving), 0.3, seed))


def posed() -> Experiment:
    """Two UR5 whose poses are desired, with a Gamma that is a matrix."""
    arm, members = load_robot("ur5"), []
    for i in range(2):
        q = np.array([0.1 + 0.2 * i, -1.4, 1.8, -0.6, 1.2, 0.2])
        pose = arm.tip_pose(q)
        motion = PoseTrajectory(
            Circle(pose.translation, 0.03, 4.0, phase=1.0 * i), AxisRotation.fixed(pose.rotation)
        )
        members.append(Member(arm, motion, q, parameters="base"))
    cell = Cell(members, Coupling.pair(), PoseSpace())
    r = members[0].theta.size
    root = np.random.default_rng(0).uniform(-0.3, 0.3, (r, r)) + np.eye(r)
    gains = Gains(Lambda=4.0, beta=3.0, K_r=5.0, K_eps=2.0, Gamma=None, leak=1.0)
    return Experiment(cell, gains, 1.0, adaptation=Gradient([0.1 * root @ root.T]))


@pytest.mark.parametrize("make", [circles, rubbing, posed], ids=["task damping", "friction", "pose"])
def test_so_it_is_with_all_that_the_theorem_reaches(make: Callable[[], Experiment]) -> None:
    close(*linear_and_differences(make(), 0.13, 0))


def test_integrals_that_act_on_nothing_do_not_count() -> None:
    gains = GAINS.replace(beta=[3.0, 0.0])
    half, none = (exponential_rate(rods(gains=g), PERIOD) for g in (gains, gains.independent()))
    assert half.stable and none.stable
    assert len(none.multipliers) == len(half.multipliers) - 1
    close(*linear_and_differences(rods(gains=gains), 0.13, 0))


@pytest.mark.parametrize("name", CELLS)
def test_the_volume_of_errors_falls_by_the_integral_of_the_trace(name: str) -> None:
    """Liouville: det Phi = exp(int trace A), in a time after which there is still some volume."""
    experiment, rate = rate_of(name)
    motion = DesiredMotion(experiment.closed_loop())

    def matrices(times: np.ndarray) -> np.ndarray:
        return error_matrices(motion.at(times), rate.coordinates)

    places, weights = np.polynomial.legendre.leggauss(8)
    end = 0.03
    trace = np.einsum("tkk->t", matrices(end * (places + 1) / 2)) @ weights * end / 2
    assert -40 < trace < -0.4
    Phi, error = monodromy(matrices, [0.0, end])
    assert np.linalg.det(Phi) == pytest.approx(np.exp(trace), rel=1e-6)
    assert error < 1e-8


def test_phi_is_that_of_a_system_seen_from_a_turning_frame() -> None:
    """A = R B R^T with R = exp(W t) has Phi = R(T) exp((B - W) T), within the error that is stated."""
    rng = np.random.default_rng(0)
    B, W = rng.normal(size=(4, 4)) - 2 * np.eye(4), 6 * rng.normal(size=(4, 4))
    W -= W.T

    def matrices(times: np.ndarray) -> np.ndarray:
        R = expm(times[:, None, None] * W)
        return R @ B @ R.mT

    Phi, error = monodromy(matrices, [0.0, 0.3, 1.0])
    assert np.abs(Phi - expm(W) @ expm(B - W)).max() < max(2 * error, 1e-13) < 1e-9


@pytest.mark.parametrize("name", ["fast", "moving weights, task damping, leak"])
def test_multipliers_do_not_depend_on_where_the_period_begins(name: str) -> None:
    experiment, rate = rate_of(name)
    other = exponential_rate(experiment, rate.period, start=0.37)
    assert not np.allclose(other.Phi, rate.Phi, rtol=0.1)
    np.testing.assert_allclose(np.abs(other.multipliers), np.abs(rate.multipliers), atol=1e-6)


def storage(experiment: Experiment, z: Coordinates, t: float) -> np.ndarray:
    """P of V = z^T P z on zero error, with S e* - beta S S^T I for epsilon."""
    loop = experiment.closed_loop()
    cell, gains = loop.cell, loop.controller
    on, S = DesiredMotion(loop).at(np.array([t])), cell.coupling.matrix
    P = np.zeros((z.size, z.size))
    for i, s in enumerate(z.parts["s"]):
        P[s, s] = on.M[0, i]
    for u in z.parts["u"]:
        P[u, u] = np.eye(u.stop - u.start)
    e, I, m = slice(z.parts["e*"][0].start, z.parts["e*"][-1].stop), z.parts["i"][0], cell.m
    epsilon = np.zeros((len(S) * m, z.size))
    epsilon[:, e] = np.kron(S, np.eye(m))
    epsilon[:, I] = -np.kron(S @ S.T @ z.B, np.diag(gains.beta)[:, z.acting])
    E = np.zeros((cell.n * m, z.size))
    E[:, I] = np.kron(S.T @ z.B, np.eye(m)[:, z.acting])
    spring = gains.K_eps * (gains.Lambda - gains.leak) * gains.beta
    P += epsilon.T @ (np.tile(gains.K_eps, len(S))[:, None] * epsilon)
    return (P + E.T @ (np.tile(spring, cell.n)[:, None] * E)) / 2


@pytest.mark.parametrize("name", CELLS)
def test_v_of_small_errors_does_not_grow_in_a_period(name: str) -> None:
    experiment, rate = rate_of(name)
    P = storage(experiment, rate.coordinates, 0.0)
    change = rate.Phi.T @ P @ rate.Phi - P
    assert np.linalg.eigvalsh(change).max() < 1e-6 * np.abs(P).max()


# -- what is refused ---------------------------------------------------------------------------------------


def test_a_period_that_is_none_is_refused_with_what_was_found() -> None:
    with refused(InputError, "period", found=0.4) as caught:
        exponential_rate(rods(), 0.4)
    assert "arm" in str(caught.value)
    with refused(InputError, "period", found=0.3):  # the motion rests, but the weights turn
        exponential_rate(circles(), 0.3)


@pytest.mark.parametrize("name, value", [("period", -1.0), ("period", np.nan), ("start", -0.5)])
def test_times_that_are_none_are_refused(name: str, value: float) -> None:
    with refused(InputError, name):
        exponential_rate(rods(), **{"period": PERIOD, name: value})


def test_a_rate_is_not_simulated_with_another_experiment() -> None:
    experiment, rate = rate_of("fast")
    faster = replace(experiment, gains=experiment.gains.replace(Lambda=7.0))
    for other, found in ((planar_four(), "robots"), (faster, "gains"), (None, "NoneType")):
        with refused(InputError, "experiment", found=found):
            simulated_decay(other, rate)
    with refused(InputError, "rate"):
        simulated_decay(experiment, experiment)


PUSH = Disturbance(0, 1.0, 0.1, 0.2)


@pytest.mark.parametrize(
    "subject, change",
    [
        ("law", {"law": ChungSlotine(1.0), "gains": GAINS.independent()}),
        ("disturbances", {"disturbances": [PUSH]}),
        ("saturate", {"saturate": True}),
    ],
)
def test_what_the_theorem_does_not_reach_is_refused_by_name(subject: str, change: dict) -> None:
    with refused(InputError, subject):
        exponential_rate(replace(rods(), **change), PERIOD)


def test_saturation_is_named_and_not_the_adaptation_that_comes_with_it() -> None:
    limited = a460_pair(friction=False)
    with refused(InputError, "saturate"):
        exponential_rate(replace(limited, saturate=True), 1.0, start=5.0)


def test_friction_that_is_not_adapted_is_refused_even_at_rest() -> None:
    with refused(InputError, "arm 1, parameters"):
        exponential_rate(rods(size=(0.0, 0.0), friction=Friction(viscous=0.5)), PERIOD)


@pytest.mark.parametrize("damping", [Damping(0.6, 0.05), Damping(0.9, 0.3)], ids=["a little", "much"])
def test_damped_inverse_kinematics_at_work_on_the_motion_are_refused(damping: Damping) -> None:
    run = circles()
    space = CartesianSpace("xy", singularity=damping)
    with refused(InputError, "arm 1, singularity"):
        exponential_rate(replace(run, cell=Cell(run.cell.members, run.cell.coupling, space)), 0.5)


def test_arms_with_spare_joints_are_refused() -> None:
    arm = planar_arm(3)
    q = np.array([0.3, 0.8, 0.5])
    members = [Member(arm, Hold(arm.tip_position(q)[:2]), q, name=f"arm {i}") for i in range(2)]
    cell = Cell(members, Coupling.pair(), CartesianSpace("xy"))
    with refused(InputError, "arm 0", found=3):
        exponential_rate(Experiment(cell, GAINS, 1.0), 1.0)


# -- how to choose Gamma -----------------------------------------------------------------------------------


def test_errors_that_no_synchronization_error_sees_fall_at_lambda_whatever_gamma() -> None:
    for name in ("slow", "fast"):
        _, rate = rate_of(name)
        assert np.isclose(rate.multipliers, np.exp(-6.0 * PERIOD), rtol=1e-6).sum() >= 2
    rates = rates_over_gamma(circles(), 0.5, [4.0, 1.0])
    assert rates.limit == 6.0 and (rates.rates < 6.0).all()
    assert rates.factors.tolist() == [1.0, 4.0]


def test_the_figure_marks_the_best_gamma() -> None:
    found = RatesOverGamma(np.array([0.1, 1.0, 10.0]), np.array([1.0, 3.0, 2.0]), 6.0, ())
    for limit, lines in ((6.0, 3), (np.inf, 2)):
        (panel,) = rates_figure({"two arms": replace(found, limit=limit)}).axes
        assert len(panel.get_lines()) == lines
        assert panel.get_lines()[1].get_xydata().tolist() == [[1.0, 3.0]]
        assert panel.get_ylim()[1] > found.rates.max()


def test_rates_far_below_lambda_are_drawn_on_a_logarithmic_axis() -> None:
    found = RatesOverGamma(np.array([0.1, 1.0, 10.0]), np.array([1e-6, 3e-6, 2e-5]), 6.0, ())
    (panel,) = rates_figure({"two arms": found}).axes
    low, high = panel.get_ylim()
    assert panel.get_yscale() == "log" and 0 < low < found.rates.min() and high > found.limit
    with refused(InputError, "found"):
        rates_figure(found)  # type: ignore[arg-type]


def test_rates_over_gamma_say_which_is_best_and_whether_it_is_at_an_end() -> None:
    found = RatesOverGamma(np.array([0.1, 1.0, 10.0]), np.array([1.0, 3.0, 2.0]), 6.0, ("arm 1: m",))
    for words in (
        "Gamma times 10: 2 1/s",
        "best: times 1\n",
        "6 1/s whatever Gamma",
        "not learned: arm 1: m",
    ):
        assert words in str(found)
    growing = replace(found, rates=np.array([1.0, 2.0, 3.0]), limit=np.inf, unexcited=())
    assert "beyond" in str(growing) and "whatever" not in str(growing)
    assert repr(found) == str(found)


def test_a_rate_within_its_own_error_is_said_not_to_tell() -> None:
    _, rate = rate_of("straight arm")
    assert "cannot be told" not in str(rate)
    assert "cannot be told" in str(replace(rate, error=1.0))


def test_factors_that_are_not_above_0_are_refused() -> None:
    with refused(InputError, "factors"):
        rates_over_gamma(rods(), PERIOD, [0.0, 1.0])


def test_the_page_of_the_theorem_runs_and_has_the_numbers_that_it_shows() -> None:
    page = PAGE.read_text("utf-8")
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL):
        exec(compile(block, "docs/theorem_c.md", "exec"), names)
    assert str(names["rate"]) in page
    shown = re.findall(r"^\| rate, 1/s \| (.*) \|$", page, flags=re.MULTILINE)[0].split(" | ")
    np.testing.assert_allclose(names["rates"].rates, np.array(shown, float), atol=0.006)
    assert names["check"].misfit < 0.01
    for line in str(names["rates"]).splitlines()[-2:]:
        assert f"    {line}\n" in page
    assert repr(names["check"]).partition("they differ")[0] in page
    assert set(re.findall(r"`(test_\w+)`", page)) <= {*globals(), *TESTS_ELSEWHERE}


#: that the page names beside those of this file
TESTS_ELSEWHERE = {"test_what_adaptation_had_the_time_for_is_not_said_to_be_learned"}
