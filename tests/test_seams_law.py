"""Laws and networks: the package's own and those a user writes, through engines, log and certificate."""

from __future__ import annotations

import re
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused
from seams.lagging_network import Lagging
from seams.pulling_law import Pulling
from theory_cells import coupling, experiment

from synctrl import Controller, Gains, Result, simulate
from synctrl.analysis.certify import certify
from synctrl.analysis.growth import first_growth
from synctrl.analysis.lyapunov import lyapunov
from synctrl.control.adaptation import Gradient
from synctrl.control.laws import Along, Asked, ChungSlotine, Errors, Proof, SunMills
from synctrl.control.network import Ideal
from synctrl.errors import InputError, NonFiniteError
from synctrl.experiments import (
    a460_full_pair,
    a460_pair,
    mixed_four,
    mobile_robot,
    panda_four,
    planar_four,
    rigid_object,
    ur5_payload,
)
from synctrl.sweep.worker import Prepared

compiled = pytest.mark.skipif(
    find_spec("casadi") is None, reason="CasADi is an extra: pip install 'synctrl[compiled]'"
)
ENGINES = ["pinocchio", pytest.param("compiled", marks=compiled)]
SEEDS = st.integers(0, 2**32 - 1)
GAINS = Gains(Lambda=4.0, beta=3.0, K_r=2.0, K_eps=1.5, Gamma=0.02)
LAWS = {
    "SunMills": (SunMills(), GAINS),
    "ChungSlotine": (ChungSlotine((0.4, 0.7)), GAINS.independent()),
}
CELLS = {
    "ring": coupling("ring", 4, 2),
    "pair, full weights": coupling("pair", 2, 2, "constant"),
    "graph, moving weights": coupling("signed graph", 3, 2, "moving"),
    "all with all": coupling("all-to-all", 3, 2),
}


def damped(cell: str, **options):
    """A run of Chung and Slotine's law."""
    law, gains = LAWS["ChungSlotine"]
    return replace(experiment(CELLS[cell], gains, **options), law=law)


def lagging(T: float = 0.01, **options):
    return replace(experiment(CELLS["ring"], **options), network=Lagging(T))


# -- what the proof asks of a law -------------------------------------------------------------------------


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("cell", CELLS)
@given(seed=SEEDS)
@settings(max_examples=10)
def test_energies_change_by_the_power_of_the_force_and_the_named_powers(name, cell, seed):
    rng, (law, gains) = np.random.default_rng(seed), LAWS[name]
    made = experiment(CELLS[cell], gains).cell
    controller = Controller(made, gains, law=law)
    motion = np.stack((made.q0, made.v0)) + 0.1 * rng.standard_normal((2, made.n, made.nv))
    memory = rng.standard_normal((made.coupling.pairs, made.m))
    s = controller.evaluate(made.references(np.array([0.3]))[0], motion, made.theta_hat0, memory)
    c, E, sigma, sigma_dot = s.reference.c, s.E, s.sigma, s.sigma_dot
    at = (part[None] for part in (s.epsilon, s.epsilon_dot, E, sigma, sigma_dot, s.e_star, s.r, c))
    proof = controller.law.proof(Along(*at))
    rates, powers = (
        sum(float(term.sum()) for term in terms.values()) for terms in (proof.rates, proof.powers)
    )
    pushed = float(np.sum(np.matvec(s.reference.c_inv, s.r) * s.force))
    size = 1 + abs(rates) + abs(powers) + abs(pushed)
    assert rates == pytest.approx(pushed + powers, abs=1e-11 * size)
    assert set(proof.energies) == set(proof.rates)
    assert all((term <= 0).all() for term in proof.powers.values())


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("cartesian", [False, True])
def test_the_balance_of_v_closes_with_the_law_of_chung_and_slotine_and_v_never_grows(cell, cartesian):
    result = damped(cell, cartesian=cartesian).simulate(0.05, 1e-3)
    record = lyapunov(result)
    assert record.closes
    assert first_growth(record) is None
    assert set(record.energy) == {"kinetic", "parameter"}
    assert (record.power["mutual damping"] <= 0).all()
    assert record.power["mutual damping"].min() < 0
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert certify(result).certified


def test_what_the_balance_of_v_misses_falls_with_the_fourth_power_of_the_step():
    coarse, fine = (lyapunov(damped("ring").simulate(0.2, dt)).largest_drift for dt in (4e-3, 2e-3))
    assert fine < coarse / 10


# -- the law of Chung and Slotine -------------------------------------------------------------------------


def test_without_damping_between_robots_it_is_independent_control():
    alone = planar_four(synchronized=False)
    one, other = (run.simulate(0.1) for run in (alone, replace(alone, law=ChungSlotine(0.0))))
    for name in ("q", "v", "tau", "theta_hat"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0, atol=1e-9)


@given(seed=SEEDS)
@settings(max_examples=10)
def test_of_two_robots_it_is_k_1_of_ones_own_velocity_error_less_k_2_of_the_others(seed):
    """The form in which Chung and Slotine print it, with K_1 = K_r + K_2."""
    gains, rng = GAINS.independent(), np.random.default_rng(seed)
    made = experiment(coupling("pair", 2, 2), gains).cell
    controller = Controller(made, gains, law=ChungSlotine(0.4))
    motion = np.stack((made.q0, made.v0)) + 0.1 * rng.standard_normal((2, made.n, made.nv))
    memory = np.zeros((made.coupling.pairs, made.m))
    s = controller.evaluate(made.references(np.array([0.3]))[0], motion, made.theta_hat0, memory)
    s_q = np.matvec(s.reference.c_inv, s.r)
    printed = (gains.K_r + 0.4) * s_q - 0.4 * s_q[::-1]
    np.testing.assert_allclose(gains.K_r * s_q + s.force, printed, atol=1e-12)


def test_damping_between_robots_keeps_them_together():
    alone = planar_four(synchronized=False)
    found = [replace(alone, law=ChungSlotine(K_2)).simulate(1.0) for K_2 in (0.0, 0.3, 1.0)]
    errors = [float(np.square(result.sync_error).mean()) for result in found]
    assert errors == sorted(errors, reverse=True)


def test_gains_it_has_no_place_for_are_refused():
    with refused(InputError, "gains", found=planar_four().gains.beta.max()):
        replace(planar_four(), law=ChungSlotine(0.3))
    with refused(InputError, "K_2"):
        ChungSlotine(-1.0)
    with refused(InputError, "K_2"):
        replace(planar_four(synchronized=False), law=ChungSlotine((1.0, 2.0, 3.0)))


def test_a_step_too_long_for_a_law_is_named():
    run = replace(planar_four(synchronized=False), law=ChungSlotine(30.0))
    with refused(NonFiniteError, cause="law") as caught:
        run.simulate(0.1, 1e-3)
    needed = float(re.search("at most ([0-9.e-]+) s", str(caught.value)).group(1))
    assert run.simulate(0.01, needed / 2).status == "completed"


# -- the paper's law by its name --------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("acceleration", ["exact", "paper"])
@pytest.mark.parametrize("space", ["joint", "task"])
def test_options_beside_the_law_are_shorthand_for_its_own(engine, acceleration, space):
    made = experiment(CELLS["graph, moving weights"], cartesian=True)
    short = replace(made, reference_acceleration=acceleration, k_r_space=space)
    long = replace(made, law=SunMills(acceleration, space), network=Ideal())
    one, other = (run.simulate(0.02, engine=engine) for run in (short, long))
    np.testing.assert_array_equal(one.tau, other.tau)
    assert one.info["law"] == other.info["law"]
    assert one.info["reference_acceleration"] == other.info["reference_acceleration"] == acceleration


@pytest.mark.parametrize(
    "options",
    [
        {"law": SunMills("paper"), "reference_acceleration": "exact"},
        {"law": SunMills("exact"), "reference_acceleration": "paper"},
        {"law": SunMills(k_r_space="joint"), "k_r_space": "task"},
        {"law": Pulling(1.0), "reference_acceleration": "paper"},
    ],
)
def test_an_option_that_the_law_contradicts_is_refused(options):
    with refused(InputError, [*options][-1]):
        replace(planar_four(), **options)


@pytest.mark.parametrize("options", [{"law": SunMills}, {"law": "mine"}, {"network": Ideal}, {"network": 3}])
def test_what_is_no_law_and_no_network_is_refused_by_name(options):
    with refused(InputError, *options):
        replace(planar_four(), **options)


# -- a law of one's own -----------------------------------------------------------------------------------


CASES = {
    "Chung and Slotine, ring": lambda: damped("ring"),
    "Chung and Slotine, moving weights": lambda: damped("graph, moving weights", cartesian=True),
    "Chung and Slotine, A460": lambda: replace(a460_pair(False, friction=False), law=ChungSlotine(20.0)),
    "of one's own": lambda: replace(planar_four(), law=Pulling(0.3)),
    "of one's own, damping in task space": lambda: replace(planar_four(), law=Pulling(0.3), k_r_space="task"),
}


@compiled
@pytest.mark.parametrize("name", CASES)
def test_both_engines_agree_on_any_law(name):
    run = CASES[name]()
    one, other = (run.simulate(0.05, engine=engine) for engine in ("pinocchio", "compiled"))
    for field in ("q", "v", "tau", "theta_hat", "sync_error", "coupled_error", "sync_integral"):
        expected, found = getattr(one, field), getattr(other, field)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * (1 + np.abs(expected).max()))


@compiled
def test_the_settings_of_a_law_are_compiled_and_not_mixed_up():
    for k in (0.3, 3.0):
        run = replace(planar_four(), law=Pulling(k))
        one, other = (run.simulate(0.02, engine=engine) for engine in ("pinocchio", "compiled"))
        np.testing.assert_allclose(one.tau, other.tau, rtol=0, atol=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_law_without_a_proof_is_outside_the_theorem_by_name(engine):
    certificate = certify(replace(planar_four(), law=Pulling(0.3)).simulate(0.05, engine=engine))
    assert certificate.verdict == "outside the theorem"
    assert any("the law Pulling" in text for text in certificate.outside)
    assert certificate.closes, "the power of its force is named"
    assert "law" in certificate.lyapunov.power
    assert certificate.as_dict()["verdict"] == "outside the theorem"


@compiled
def test_a_sweep_runs_with_a_law_of_ones_own():
    run = replace(planar_four(), law=Pulling(0.3))
    prepared = Prepared(run, 0.02)
    other = replace(run, gains=run.gains.replace(K_r=2.0))
    np.testing.assert_array_equal(prepared.simulate(other).tau, other.simulate(0.02, engine="compiled").tau)


class Clockwork(Pulling):
    def bind(self, cell, gains):
        bound = super().bind(cell, gains)

        class Ticking(type(bound)):
            def command(self, errors: Errors) -> Asked:
                return super().command(errors)._replace(force=np.sin(errors.t) * errors.sigma)

        return Ticking(self.k, gains.Lambda)


class Gossip(Pulling):
    def bind(self, cell, gains):
        bound = super().bind(cell, gains)

        class Listening(type(bound)):
            def command(self, errors: Errors) -> Asked:
                return super().command(errors)._replace(force=errors.w[::-1])

        return Listening(self.k, gains.Lambda)


@compiled
@pytest.mark.parametrize("law", [Clockwork(1.0), Gossip(1.0)])
def test_a_law_that_cannot_be_traced_is_refused_by_name_and_runs_in_the_reference_engine(law):
    run = replace(planar_four(), law=law)
    with refused(InputError, "law") as caught:
        run.simulate(0.01, engine="compiled")
    assert caught.value.found.endswith((".Ticking", ".Listening"))
    assert run.simulate(0.01).status == "completed"


class Springs:
    """A law of one's own that knows its part in V; Lambda as one number, for constant weights."""

    def __init__(self, k: float, promised: float = 1.0):
        self.k, self.promised = k, promised

    def bind(self, cell, gains):
        self.Lambda = gains.Lambda
        return self

    def as_dict(self):
        return {"k": self.k}

    def command(self, errors: Errors) -> Asked:
        xref_dot = errors.xd_dot + self.Lambda * errors.e
        force = np.matvec(errors.c.mT, self.k * errors.sigma)
        return Asked(xref_dot, errors.xd_ddot + self.Lambda * errors.e_dot, force)

    def proof(self, along: Along) -> Proof:
        eps, k = along.epsilon, self.k * self.promised
        return Proof(
            {"springs": eps * k * eps / 2},
            {"springs": eps * k * along.epsilon_dot},
            {"dampers": -eps * k * self.Lambda * eps},
        )


@pytest.mark.parametrize("engine", ENGINES)
def test_a_law_with_a_proof_of_its_own_is_certified_with_its_energies_and_powers(engine):
    result = replace(experiment(CELLS["pair, full weights"]), law=Springs(1.5)).simulate(0.05, engine=engine)
    certificate = certify(result)
    assert certificate.certified
    assert set(certificate.lyapunov.energy) == {"kinetic", "parameter", "springs"}
    assert (certificate.lyapunov.power["dampers"] <= 0).all()
    assert result.info["law"] == {"name": "Springs", "k": 1.5}


def test_a_law_whose_proof_promises_more_than_it_does_is_found_out():
    run = replace(experiment(CELLS["pair, full weights"]), law=Springs(1.5, promised=1.1))
    certificate = certify(run.simulate(0.05))
    assert not certificate.certified
    assert (np.abs(certificate.lyapunov.power["other"]) > certificate.lyapunov.rounding).any()


def test_a_law_that_fails_is_named_before_it_runs():
    class Failing(Springs):
        def command(self, errors: Errors) -> Asked:
            raise ZeroDivisionError("no")

    with refused(InputError, f"law {Failing.__qualname__}", found="ZeroDivisionError"):
        replace(planar_four(), law=Failing(1.0))


def test_a_law_that_gives_another_shape_is_refused_by_name_before_it_runs():
    class Wrong(Pulling):
        def bind(self, cell, gains):
            bound = super().bind(cell, gains)
            bound.command = lambda errors: Asked(errors.e, errors.e, errors.e[0])
            return bound

    with refused(InputError, "law BoundPulling, force", found=(2,)):
        replace(planar_four(), law=Wrong(1.0))


@pytest.mark.parametrize("nothing", [None, (0.0, 0.0, 0.0)])
def test_a_part_that_gives_something_of_another_kind_is_refused_by_name(nothing):
    class Empty(Pulling):
        def bind(self, cell, gains):
            bound = super().bind(cell, gains)
            bound.command = lambda errors: nothing
            return bound

    class Deaf(Lagging):
        def bind(self, cell):
            bound = super().bind(cell)
            bound.exchange = lambda t, w, memory: nothing
            return bound

    class Untold(Pulling):
        def as_dict(self):
            return nothing

    with refused(InputError, "law BoundPulling, command"):
        replace(planar_four(), law=Empty(1.0))
    with refused(InputError, "network BoundLagging, exchange"):
        replace(planar_four(), network=Deaf(0.1))
    with refused(InputError, f"{Untold.__qualname__}, as_dict"):
        replace(planar_four(), law=Untold(1.0))


READY = {
    "A460 pair": a460_pair, "A460 with six joints": a460_full_pair, "planar four": planar_four,
    "Pandas": panda_four, "mixed four": mixed_four, "UR5": ur5_payload, "mobile robot": mobile_robot,
    "rigid object": rigid_object,
}  # fmt: skip


@pytest.mark.parametrize("name", READY)
def test_ready_cells_hand_on_the_parts_of_their_controller(name):
    parts = {"law": Pulling(0.3), "network": Lagging(0.1), "adaptation": Gradient(0.1)}
    made = READY[name](**parts)
    assert {part: getattr(made, part) for part in parts} == parts
    settings = made.closed_loop().controller
    assert settings.law_settings["name"] == "Pulling"
    assert settings.network_settings["name"] == "Lagging"


# -- a network of one's own -------------------------------------------------------------------------------


def test_the_shorter_the_lag_the_closer_to_an_ideal_network():
    gains = Gains(Lambda=10.0, beta=5.0, K_r=1.0, K_eps=1.0, Gamma=0.1)
    made = planar_four(gains=gains)  # it starts without errors, as the neighbours' silence has it
    ideal = made.simulate(0.2)
    runs = [replace(made, network=Lagging(T)).simulate(0.2) for T in (0.02, 0.01, 0.005)]
    gaps = [float(np.abs(run.q - ideal.q).max()) for run in runs]
    assert gaps == sorted(gaps, reverse=True)
    assert 0 < gaps[-1] < gaps[0] / 2


def test_a_network_with_memory_is_logged_replayed_and_outside_the_theorem_by_name(tmp_path):
    run = lagging()
    result = run.simulate(0.05)
    assert result.outputs["network_state"].shape[1:] == ((2 * 4 + 4) * 2,)
    assert result.info["network"] == {"name": "Lagging", "T": 0.01}
    loaded = Result.load(result.save(tmp_path / "lag.npz"))
    np.testing.assert_array_equal(loaded.outputs["network_state"], result.outputs["network_state"])
    for certificate in (certify(result), certify(loaded, run)):
        assert certificate.verdict == "bounded by Theorem A"
        assert any("the network Lagging" in text for text in certificate.outside)
        assert certificate.closes, "what it changes is named"
        assert (np.abs(certificate.lyapunov.power["other"]) <= certificate.lyapunov.rounding).all()


def test_a_network_with_memory_runs_with_other_integrators_too():
    one, other = lagging().simulate(0.05), lagging().simulate(0.05, integrator="DOP853")
    np.testing.assert_allclose(one.q, other.q, rtol=0, atol=1e-5)
    states = (run.outputs["network_state"] for run in (one, other))
    np.testing.assert_allclose(*states, rtol=0, atol=1e-4)


def test_the_log_has_the_integrals_of_the_synchronization_errors_whatever_the_network_keeps():
    result = lagging().simulate(0.05)
    steps = np.diff(result.t)[:, None, None] * (result.sync_error[1:] + result.sync_error[:-1]) / 2
    found = np.diff(result.sync_integral, axis=0)
    np.testing.assert_allclose(found, steps, rtol=0, atol=1e-5 * np.abs(result.sync_integral).max())


def test_another_network_than_the_one_that_made_a_result_is_noticed():
    with refused(InputError, "experiment", found="network_state"):
        certify(experiment(CELLS["ring"]).simulate(0.01), lagging())


@compiled
def test_a_network_of_ones_own_is_refused_by_name_in_the_compiled_engine():
    with refused(InputError, "network", found="seams.lagging_network.BoundLagging"):
        lagging().simulate(0.01, engine="compiled")


def test_a_network_that_gives_another_shape_is_refused_by_name_before_it_runs():
    class Wrong(Lagging):
        def bind(self, cell):
            bound = super().bind(cell)
            bound.integral = lambda memory: memory
            return bound

    with refused(InputError, "network BoundLagging, integral"):
        replace(planar_four(), network=Wrong(0.1))


def test_a_controller_step_by_step_has_the_network_in_its_state(tmp_path):
    run, period = lagging(), 2e-3
    result = run.simulate(0.04, 1e-3, control_period=period)
    one, other = (run.controller(period) for _ in range(2))
    for made in (one, other):
        made.reset(0.0, result.q[0], result.v[0])
    for k in range(0, 41, 2):
        tau = one.step(result.t[k], result.q[k], result.v[k])
        np.testing.assert_allclose(tau, result.tau[k], rtol=0, atol=1e-10)
        if k == 20:
            one.save(tmp_path / "state.npz")
            other.load(tmp_path / "state.npz")
        if k > 20:
            np.testing.assert_array_equal(other.step(result.t[k], result.q[k], result.v[k]), tau)
    assert "network_state" in one.state
    assert one.sync_integral.shape == (4, 2)


def test_simulate_takes_law_and_network():
    run = replace(experiment(CELLS["ring"]), law=Pulling(0.3), network=Lagging(0.01))
    found = simulate(run.cell, run.gains, 0.02, law=Pulling(0.3), network=Lagging(0.01))
    np.testing.assert_array_equal(found.tau, run.simulate(0.02).tau)
