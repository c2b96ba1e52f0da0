"""Adaptations whose state is not theta_hat, and one of a user's own, through every part of the toolkit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from seams.leaky_adaptation import Leaky

from synctrl import Controller, DiscreteController, Experiment, Result
from synctrl.analysis.certify import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.control.adaptation import Gradient, Natural
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, mixed_four, planar_four
from synctrl.robots.pseudo_inertia import smallest_eigenvalues
from synctrl.simulation.result import LAYOUT

ADAPTATIONS = {"natural": Natural(0.1), "leaky": Leaky(0.3, 0.1), "gradient": Gradient(0.3)}
CONTROL = {"continuous": {}, "sampled": {"control_period": 2e-3}}


def with_adaptation(experiment: Experiment, adaptation) -> Experiment:
    return replace(experiment, adaptation=adaptation, gains=experiment.gains.replace(Gamma=None))


@pytest.fixture(scope="module")
def run():
    """Short runs of the A460 pair without friction, each made once: `run(name)`."""
    known: dict[str, Result] = {}

    def made(name: str) -> Result:
        if name not in known:
            experiment = with_adaptation(a460_pair(friction=False), ADAPTATIONS[name])
            known[name] = experiment.simulate(0.3, dt=5e-4)
        return known[name]

    return made


def test_an_adaptation_and_its_shorthand_among_the_gains_are_the_same():
    experiment = a460_pair()
    one = experiment.simulate(0.02)
    other = with_adaptation(experiment, Gradient(experiment.gains.Gamma)).simulate(0.02)
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize("both", [True, False])
def test_gamma_and_an_adaptation_exclude_each_other_and_one_is_needed(both):
    experiment = a460_pair()
    gains = experiment.gains if both else experiment.gains.replace(Gamma=None)
    with refused(InputError, "adaptation"):
        replace(experiment, gains=gains, adaptation=Gradient(0.3) if both else None)


@pytest.mark.parametrize("wrong", [Gradient, 0.3, "natural"])
def test_what_is_no_adaptation_is_refused(wrong):
    with refused(InputError, "adaptation"):
        with_adaptation(a460_pair(), wrong)


@pytest.mark.parametrize("name", ADAPTATIONS)
def test_v_changes_by_what_its_powers_supply(name, run):
    record = lyapunov(run(name))
    assert record.closes
    assert (np.abs(record.power["other"]) <= record.rounding).all()


def test_natural_adaptation_is_certified_and_stays_physical(run):
    assert certify(run("natural")).certified
    assert (smallest_eigenvalues(run("natural").theta_hat) > 0).all()


def test_a_power_that_feeds_v_is_named_in_the_certificate(run):
    certificate = certify(run("leaky"))
    assert certificate.verdict == "bounded by Theorem A"
    assert any("leakage" in found for found in certificate.outside)


@pytest.mark.parametrize("name", ["natural", "leaky"])
def test_its_runs_are_saved_read_and_certified_again(name, run, tmp_path):
    read = Result.load(run(name).save(tmp_path / "run.npz"))
    assert read == run(name)
    assert read.info["adaptation"] == ADAPTATIONS[name].as_dict()
    again = certify(read, run(name).experiment)
    assert again.verdict == certify(run(name)).verdict


def test_a_state_that_is_not_theta_hat_is_in_the_log(run):
    states = run("natural").outputs["adaptation_state"]
    assert states.shape == run("natural").theta_hat.shape
    assert not np.array_equal(states, run("natural").theta_hat)
    assert "adaptation_state" not in run("gradient").outputs


@pytest.mark.parametrize("control", CONTROL)
@pytest.mark.parametrize("name", ["natural", "leaky"])
def test_both_engines_learn_alike(name, control):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = with_adaptation(a460_pair(), ADAPTATIONS[name])
    one, other = (
        experiment.simulate(0.05, engine=engine, **CONTROL[control]) for engine in ("pinocchio", "compiled")
    )
    for array in LAYOUT:
        scale = np.abs(getattr(one, array)).max() + 1e-12
        assert np.abs(getattr(one, array) - getattr(other, array)).max() <= 1e-9 * scale, array
    for array, values in one.outputs.items():
        np.testing.assert_allclose(other.outputs[array], values, rtol=1e-9, atol=1e-9, err_msg=array)


def test_robots_of_different_kinds_learn_alike_in_both_engines():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = with_adaptation(mixed_four(), Leaky(0.05, 0.1))
    one, other = (experiment.simulate(0.01, engine=engine) for engine in ("pinocchio", "compiled"))
    assert np.abs(one.theta_hat - other.theta_hat).max() <= 1e-9 * np.abs(one.theta_hat).max()


class Mixing(Leaky):
    """Robots that learn from what others see."""

    def bind(self, cell):
        bound = super().bind(cell)
        bound.rate = lambda z, seen: seen.gradient[::-1] + 0 * z
        return bound


class Searching(Leaky):
    """Something that is no plain array arithmetic."""

    def bind(self, cell):
        bound = super().bind(cell)
        bound.rate = lambda z, seen: seen.gradient @ np.linalg.inv(z.T @ z + np.eye(z.shape[1]))
        return bound


@pytest.mark.parametrize("kind", [Mixing, Searching])
def test_what_cannot_be_traced_is_refused_by_name(kind):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    with refused(InputError, "adaptation", found="seams.leaky_adaptation.BoundLeaky"):
        with_adaptation(a460_pair(), kind(0.3, 0.1)).simulate(0.01, engine="compiled")


@pytest.mark.parametrize(
    ("method", "gives", "data"),
    [
        ("start", lambda z: z.tolist(), {}),
        ("start", lambda z: z[0], {"found": (30,)}),
        ("start", lambda z: z * np.nan, {}),
        ("estimate", lambda z: z[:, :2], {"found": (2, 2)}),
        ("estimate", lambda z: None, {"found": ()}),
        ("settle", lambda z: None, {"found": ()}),
        ("rate", lambda z: z[:1], {"found": (1, 30)}),
        ("rate", lambda z: 0.0, {"found": ()}),
    ],
)
def test_arrays_that_do_not_fit_are_refused_with_the_adaptation_before_anything_runs(method, gives, data):
    class Unfit(Leaky):
        def bind(self, cell):
            bound = super().bind(cell)
            setattr(bound, method, lambda *z: gives(z[0] if z else cell.theta_hat0))
            return bound

    with refused(InputError, f"adaptation BoundLeaky, {method}", **data):
        with_adaptation(a460_pair(), Unfit(0.3, 0.1))
    pair = a460_pair()
    controller = Controller(pair.cell, pair.gains.replace(Gamma=None), adaptation=Unfit(0.3, 0.1))
    with refused(InputError, f"adaptation BoundLeaky, {method}", **data):
        DiscreteController(controller, 1e-3)


class Clipped(Leaky):
    """Estimates that keep to their first values, whatever the rate is."""

    def bind(self, cell):
        bound = super().bind(cell)
        bound.settle = lambda z: np.clip(z, bound.theta_hat0 - 1e-6, bound.theta_hat0 + 1e-6)
        return bound


@pytest.mark.parametrize("integrator", ["rk4", "RK45", "LSODA"])
def test_every_integrator_lets_estimates_settle_where_steps_end(integrator):
    experiment = with_adaptation(a460_pair(), Clipped(0.3, 0.1))
    moved = np.abs((run := experiment.simulate(0.02, integrator=integrator)).theta_hat - run.theta_hat[0])
    assert moved.max() == pytest.approx(1e-6)


def test_maps_without_bodies_are_refused_by_name():
    with refused(InputError, "robot 1, adaptation", found="LinearParameters"):
        with_adaptation(planar_four(), Natural(0.1))


@pytest.mark.parametrize("dt", [2e-3, 5e-4])
def test_both_engines_go_from_sample_to_sample_along_the_same_geodesic(dt):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = with_adaptation(a460_pair(), Natural(2.0))
    one, other = (
        experiment.simulate(0.1, dt=dt, engine=engine, control_period=2e-3)
        for engine in ("pinocchio", "compiled")
    )
    scale = np.abs(one.theta_hat).max()
    assert np.abs(one.theta_hat - one.theta_hat[0]).max() > 1e-3 * scale
    assert np.abs(one.theta_hat - other.theta_hat).max() <= 1e-9 * scale
