"""What is proved of networks: the W form, delays, filters, events, each as an identity or a bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cells import random_experiment
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import lambertw
from theory_cells import GAINS, coupling, experiment

from synctrl import Experiment, Network
from synctrl.analysis.certify import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.analysis.replay import replay
from synctrl.control.adaptation import Composite, Leakage
from synctrl.control.laws import ChungSlotine, SlotineLi
from synctrl.control.network import Received
from synctrl.control.network.delayed import FINEST, GRID
from synctrl.experiments import carry_planar

FREE = GAINS.replace(K_eps=0.0)
#: nothing is learned, and nothing has to be
KNOWN = {"gains": GAINS.replace(Gamma=0.0), "known": 1.0}


def heard(network, run: Experiment, duration: float = 0.05, dt: float = 1e-3):
    return replace(run, network=network).simulate(duration, dt)


def late(rng: np.random.Generator, n: int, longest: float) -> np.ndarray:
    """Delays that differ from link to link, s."""
    return rng.uniform(0.1, 1.0, (n, n)) * longest * (1 - np.eye(n))


# -- the W form -------------------------------------------------------------------------------------------


@settings(max_examples=8)
@given(
    seed=st.integers(0, 2**31), graph=st.sampled_from(["pair", "ring", "chain"]), space=st.sampled_from("jc")
)
def test_robots_that_tell_each_other_w_move_as_with_integrals_of_epsilon(seed, graph, space):
    made = random_experiment(seed, "joint" if space == "j" else "cartesian", graph)
    ours, papers = (heard(network, made, 0.01, 2e-3) for network in (Network(), None))
    for name in ("q", "v", "tau", "coupled_error", "sync_integral"):
        expected = getattr(papers, name)
        np.testing.assert_allclose(getattr(ours, name), expected, atol=1e-12 * (1 + np.abs(expected).max()))


def test_one_message_restores_e_however_many_were_lost_before():
    link = coupling("ring", 4, 2)
    network = Network(period=5e-3, receiver="hold", loss=0.2, seed=3)
    run = replay(heard(network, experiment(link), 0.3, 5e-3))
    parts = run.loop.controller.network.parts(run.result.outputs["network_state"])
    exact = np.abs(run.rows.E - link.matrix.T @ link.matrix @ parts.W).max(axis=(1, 2))
    fresh = (parts.stamp >= run.result.t[:, None] - 1e-9).all(axis=1)
    lost = parts.come.min(axis=1) < np.arange(len(fresh)) - 5
    assert (fresh & lost).any() and (~fresh).any()
    np.testing.assert_allclose(exact[fresh], 0.0, atol=1e-15)
    assert (exact[~fresh] > 1e-6).all()


class EdgeIntegrals:
    """Robots that each integrate the errors of their pairs from what they hear; robot 1 is deaf at first."""

    def __init__(self, deaf: float):
        self.deaf = deaf

    def bind(self, cell):
        return BoundEdgeIntegrals(self.deaf, cell.coupling, cell.m)

    def as_dict(self):
        return {"name": "EdgeIntegrals", "deaf": self.deaf}


class BoundEdgeIntegrals:
    def __init__(self, deaf, link, m):
        self.deaf, self.S, self.m = deaf, link.matrix, m

    def start(self):
        return np.zeros((1 + len(self.S.T), len(self.S), self.m))  # int epsilon, then every robot's copy

    def exchange(self, t, w, memory):
        knows = np.ones((len(self.S.T),) * 2)
        knows[0, 1:] = t >= self.deaf
        S = self.S * knows[:, None, :]  # (robot who hears, pair, robot)
        epsilon, sigma = self.S @ w, np.einsum("ki,ikj,djm->dim", self.S, S, w)
        E = np.einsum("ki,ikm->im", self.S, memory[1:])
        rates = np.concatenate((epsilon[:1], S @ w[0]))
        return Received(*epsilon, np.stack((E, *sigma)), rates)

    def integral(self, memory):
        return memory[0]


def test_integrals_that_both_ends_keep_stay_apart_after_a_loss_and_pull_the_robots_off_their_paths():
    link = coupling("ring", 4, 1)
    made = experiment(link, joints=1, **KNOWN)
    run = replace(made, network=EdgeIntegrals(0.2)).simulate(4.0, 5e-3)
    memory = run.outputs["network_state"][-1].reshape(5, 4, 1)
    S, beta = link.matrix, float(GAINS.beta)
    apart = np.einsum("ki,ikm->im", S, memory[1:] - memory[0])
    in_null = np.eye(4) - np.linalg.pinv(S) @ S
    w = run.experiment.cell.coupling.weights(run.t[-1:], 1).c[0] @ run.tracking_error[-1][..., None]
    assert np.abs(apart).max() > 1e-3
    np.testing.assert_allclose(w[..., 0], -beta * in_null @ apart, atol=2e-2 * np.abs(w).max())
    told = heard(Network(), made, 4.0, 5e-3)
    assert np.abs(told.tracking_error[-1]).max() < 0.02 * np.abs(w).max()


# -- constant delays --------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_without_k_eps_v_falls_by_damping_alone_whatever_the_delays(seed):
    network = Network(delay=late(np.random.default_rng(seed), 4, 0.02))
    found = certify(heard(network, experiment(coupling("ring", 4, 2, "moving"), FREE)))
    record = found.lyapunov
    assert found.certified, str(found)
    np.testing.assert_allclose(record.V_dot, record.power["damping"], atol=record.rounding.max())


@pytest.mark.parametrize("delay", [FINEST, GRID])
def test_rounding_of_w_leaves_what_is_heard_of_its_derivatives_alone(delay):
    cell = experiment(coupling("pair", 2, 1)).cell
    network, start, rate = Network(delay=delay).bind(cell), 1.0, 9.0

    def at(t: float) -> np.ndarray:
        W = [0.1 + np.sin(rate * t) / rate, np.cos(rate * t), -rate * np.sin(rate * t)]
        return np.broadcast_to(np.array(W)[:, None, None], (3, cell.n, cell.m))

    memory, first = network.start(), round(start / delay)
    for k in range(first, first + 3):
        network.parts(memory).W[...] = at(k * delay)[0]
        memory = network.meet(k * delay, at(k * delay)[1:], memory)
    for share in np.linspace(0.05, 0.95, 19):
        t = (first + 1 + share) * delay
        found = network.heard(t + delay, at(t + delay), memory)
        np.testing.assert_allclose(found, at(t)[:, network.links.sender], rtol=0, atol=1e-2)


def graphs(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """D and A of a random connected graph of pairs with entries of any size and sign."""
    n = int(rng.integers(2, 6))
    edges = [(k, int(rng.integers(k))) for k in range(1, n)] + [(0, n - 1)]
    S = np.zeros((len(edges), n))
    for row, edge in zip(S, edges, strict=True):
        row[list(edge)] = rng.choice((-1.0, 1.0), 2) * rng.uniform(0.3, 2.0, 2)
    L = S.T @ S
    return np.diag(np.diag(L)), L - np.diag(np.diag(L))


def delayed(rng: np.random.Generator, A: np.ndarray, s: complex) -> np.ndarray:
    return A * np.exp(-s * rng.exponential(1.0, A.shape))


def test_no_graph_of_pairs_and_no_delays_have_a_pole_on_the_right_but_the_one_that_cancels():
    rng = np.random.default_rng(1)
    for _ in range(1000):
        D, A = graphs(rng)
        s, beta = complex(rng.exponential(1.0) * rng.integers(0, 2), 3 * rng.normal()), rng.uniform(0.1, 10)
        scale = np.sqrt(np.diag(D))
        heard_of_others = beta * delayed(rng, A, s) / (s + beta * np.diag(D))[:, None]
        similar = heard_of_others * scale[:, None] / scale
        assert np.abs(np.linalg.eigvals(similar)).max() < 1


def index(rng: np.random.Generator, beta: float, Lambda: float) -> float:
    """The least eigenvalue of Re H over -a/(4 Lambda), of one graph, delays and frequency."""
    D, A = graphs(rng)
    s = 1j * Lambda * np.exp(rng.normal())
    L = D + delayed(rng, A, s)
    H = s * L @ np.linalg.inv((s + Lambda) * (s * np.eye(len(L)) + beta * L))
    return -np.linalg.eigvalsh((H + H.conj().T) / 2)[0] * 4 * Lambda / D.max()


def test_what_delays_may_take_of_the_damping_is_at_most_a_over_4_lambda():
    rng = np.random.default_rng(2)
    found = [index(rng, *np.exp(rng.normal(size=2))) for _ in range(2000)]
    assert 0.3 < max(found) <= 1  # some come near


def test_the_bound_of_the_index_is_reached_by_slow_integrals():
    found = []
    D, A = np.diag([1.0, 1.0]), np.array([[0.0, 1.0], [1.0, 0.0]])
    for turn in np.linspace(0, 2 * np.pi, 721):  # of e^-sd at s = j sqrt(3) Lambda, with beta to 0
        L = D + A * np.exp(-1j * turn)
        H = L / (1j * np.sqrt(3) + 1)
        found.append(-4 * np.linalg.eigvalsh((H + H.conj().T) / 2)[0])
    assert 0.999 < max(found) <= 1 + 1e-12


def test_a_cell_inside_the_theorem_converges_under_a_delay_much_longer_than_its_own_times():
    made = experiment(coupling("pair", 2, 1), joints=1, **KNOWN)
    run = heard(Network(delay=0.2), made, 0.9, 4e-3)
    found = certify(run)
    assert found.delay_condition.theorem and found.verdict == "covered by the theorem", str(found)
    w = np.abs(run.sync_error).max(axis=(1, 2))
    assert w[-40:].max() < 0.1 * w.max()


def test_stable_is_not_fast_the_slowest_pole_goes_to_zero_with_the_cube_of_the_delay():
    beta_a = 6.0
    ratios = []
    for delay in (1.0, 4.0, 16.0):
        k = beta_a * delay
        z = k + np.log(k) + 2j * np.pi  # x + k = W(k e^k), whose logarithm does not overflow
        for _ in range(50):
            z = k + np.log(k) + 2j * np.pi - np.log(z)
        s = (z - k) / delay
        assert abs(s + beta_a * (1 - np.exp(-s * delay))) < 1e-9
        ratios.append(s.real / (-2 * np.pi**2 / (beta_a**2 * delay**3)))
        if k < 100:
            np.testing.assert_allclose(z, lambertw(k * np.exp(k), 1), rtol=1e-9)
    assert abs(ratios[0] - 1) > abs(ratios[1] - 1) > abs(ratios[2] - 1) and ratios[2] == pytest.approx(
        1, abs=0.05
    )


# -- the filter -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "chance",
    [{"loss": 0.9}, {"burst": (0.1, 0.1)}, {"jitter": 0.02}, {"delay": 0.01, "loss": 0.5, "jitter": 0.02}],
    ids=lambda chance: ", ".join(chance),
)
def test_v_never_grows_with_the_filter_whatever_becomes_of_the_messages(chance):
    made = experiment(coupling("ring", 4, 2, "moving"), FREE)
    found = certify(heard(Network(period=5e-3, seed=1, **chance), made, 0.1))
    assert found.certified, str(found)
    assert (np.diff(found.lyapunov.V) < 0).all()


# -- events -----------------------------------------------------------------------------------------------


def test_events_send_a_tenth_of_the_messages_for_nearly_the_same_errors():
    made = experiment(coupling("pair", 2, 1), FREE, joints=1)
    always, seldom = (
        heard(Network(period=4e-3, event=event, heartbeat=heartbeat), made, 0.8, 4e-3)
        for event, heartbeat in ((None, None), (2e-3, 0.5))
    )
    sent = [run.outputs["messages_sent"][-1].sum() for run in (always, seldom)]
    rms = [np.sqrt((run.sync_error**2).mean()) for run in (always, seldom)]
    assert sent[1] < 0.1 * sent[0]
    assert rms[1] < 1.3 * rms[0]


# -- with everything else ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "network", [Network(delay=8e-3), Network(period=4e-3, loss=0.3)], ids=["delays", "filter"]
)
def test_the_balance_of_robots_that_carry_one_object_closes_with_integrals_that_leak(network):
    made = replace(carry_planar(), network=network)
    gains = made.gains.replace(leak=0.5 * made.gains.Lambda, K_eps=0.0)
    found = certify(replace(made, gains=gains).simulate(0.03, 1e-3))
    record = found.lyapunov
    assert record.closes and record.events == ()
    assert (np.abs(record.power["network"]) <= record.rounding).all()
    assert "nothing connects" in found.delay_condition.reason


@pytest.mark.parametrize(
    "adaptation", [Composite(0.02, 0.1, 10.0), Leakage(0.02, 0.5)], ids=["composite", "leakage"]
)
def test_the_balance_closes_with_other_adaptations_and_delays(adaptation):
    made = experiment(coupling("pair", 2, 2), GAINS.replace(Gamma=None), adaptation=adaptation)
    record = lyapunov(heard(Network(delay=0.01), made))
    assert record.closes and (np.abs(record.power["other"]) <= record.rounding).all()


def test_of_a_law_that_hears_nobody_the_network_takes_nothing_and_of_one_that_does_it_does():
    gains = GAINS.independent()
    for law, hears in ((SlotineLi(), False), (ChungSlotine(0.3), True)):
        made = experiment(coupling("pair", 2, 2), gains, law=law)
        record = lyapunov(heard(Network(delay=0.01), made))
        assert record.closes and (np.abs(record.power["other"]) <= record.rounding).all()
        assert (np.abs(record.power["network"]) > record.rounding).any() == hears
