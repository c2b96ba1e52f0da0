"""Objects held at pins: what deforms them, the law that knows it, and four planar arms with a plate."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from inspect import signature

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import Cell, Coupling, Gains, Hold, Member, Result, load_robot
from synctrl.analysis import certify
from synctrl.assembly.grasp import Fixture, Grasp, Pin
from synctrl.assembly.pinned import PinnedPlant
from synctrl.assembly.plant import CarryingPlant
from synctrl.assembly.tare import tared_places
from synctrl.control.admittance import Giving, GivingPlaces
from synctrl.control.laws import Errors, ShapeKeeping
from synctrl.control.laws.protocol import no_errors
from synctrl.errors import InputError
from synctrl.experiments import carry_planar, carry_ur5
from synctrl.experiments.carry_planar import ADMITTANCE, PINS
from synctrl.simulation.plant import Plant
from synctrl.tasks.measurement import Measurement
from synctrl.tasks.rigid_motions import deformation, deformation_rate, place_matrix
from synctrl.tasks.rotations import exp
from synctrl.tasks.spaces import CartesianSpace

SEEDS = st.integers(0, 2**32 - 1)


def places(seed: int, d: int) -> tuple[np.random.Generator, np.ndarray, np.ndarray]:
    """A generator, and places that move, (n, d) each."""
    rng = np.random.default_rng(seed)
    n = rng.integers(d, 6)
    return rng, rng.normal(size=(n, d)), rng.normal(size=(n, d))


# -- what deforms an object -------------------------------------------------------------------------------


@pytest.mark.parametrize("d", [2, 3])
@given(SEEDS)
def test_rigid_motions_deform_nothing_and_deformations_are_orthogonal_to_them(d, seed):
    rng, r, _ = places(seed, d)
    G, N = place_matrix(r), deformation(r)
    moved = G.T @ rng.normal(size=len(G))
    np.testing.assert_allclose(N @ moved, 0.0, atol=1e-8)
    np.testing.assert_allclose(N @ N, N, atol=1e-8)
    np.testing.assert_allclose(N, N.T, atol=1e-12)
    assert np.trace(N) == pytest.approx(r.size - len(G))


@pytest.mark.parametrize("d", [2, 3])
@given(SEEDS)
def test_displacements_by_a_rigid_motion_are_those_of_its_twist(d, seed):
    """In a plane the angular velocity is about z."""
    rng, r, _ = places(seed, d)
    v, w = rng.normal(size=d), rng.normal(size=3) * (1.0 if d == 3 else [0.0, 0.0, 1.0])
    expected = v + np.cross(w, np.pad(r, ((0, 0), (0, 3 - d))))[:, :d]
    twist = np.concatenate((v, w if d == 3 else w[2:]))
    np.testing.assert_allclose((place_matrix(r).T @ twist).reshape(r.shape), expected, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
@given(SEEDS)
def test_what_deforms_does_not_depend_on_the_origin(d, seed):
    rng, r, r_dot = places(seed, d)
    way, speed = rng.normal(size=(2, d))
    np.testing.assert_allclose(deformation(r + way), deformation(r), atol=1e-9)
    np.testing.assert_allclose(
        deformation_rate(r + way, r_dot + speed), deformation_rate(r, r_dot), atol=1e-7, rtol=1e-7
    )


@pytest.mark.parametrize("d", [2, 3])
@given(SEEDS)
def test_the_rate_of_what_deforms_is_its_difference_over_time(d, seed):
    _, r, r_dot = places(seed, d)
    r += np.array([*np.eye(d), *np.zeros((len(r) - d, d))]) * 3  # far from one line
    h = 1e-5
    differences = (deformation(r + h * r_dot) - deformation(r - h * r_dot)) / (2 * h)
    np.testing.assert_allclose(deformation_rate(r, r_dot), differences, atol=1e-5, rtol=1e-4)


# -- the law that knows it --------------------------------------------------------------------------------

GAINS = Gains(Lambda=10.0, beta=20.0, K_r=0.5, K_eps=0.0, Gamma=0.5)
CELL = carry_planar().cell
LAW = ShapeKeeping().bind(CELL, GAINS)


def at(t: float, e: np.ndarray, e_dot: np.ndarray) -> Errors:
    """What the law is told at time t, of these tracking errors."""
    errors = no_errors(CELL.n, CELL.m)
    errors.t, errors.error = t, np.stack((e, e_dot))
    errors.rates = CELL.references(np.array([t]))[0].desired[1:]
    return errors


@given(SEEDS)
@settings(max_examples=10)
def test_the_law_gives_the_exact_derivative_of_its_reference_velocity(seed):
    rng, h = np.random.default_rng(seed), 1e-5
    t, e, e_dot = rng.uniform(0.1, 3.0), *rng.normal(size=(2, 4, 2))
    before, after = (LAW.command(at(t + s * h, e + s * h * e_dot, e_dot)).xref_dot for s in (-1, 1))
    np.testing.assert_allclose(
        LAW.command(at(t, e, e_dot)).xref_ddot, (after - before) / (2 * h), atol=1e-6, rtol=1e-6
    )


@given(SEEDS)
@settings(max_examples=10)
def test_errors_that_deform_are_pulled_by_beta_and_rigid_ones_are_not(seed):
    rng = np.random.default_rng(seed)
    t, e = rng.uniform(0.0, 3.0), rng.normal(size=(4, 2))
    r, xd_dot, _ = CELL.references(np.array([t]))[0].desired
    N = deformation(r)
    rigid, deforming = (np.reshape(x, e.shape) for x in (e.ravel() - N @ e.ravel(), N @ e.ravel()))
    for part, rate in ((rigid, 10.0), (deforming, 10.0 + 20.0)):
        asked = LAW.command(at(t, part, 0 * part))
        np.testing.assert_allclose(asked.xref_dot - xd_dot, rate * part, atol=1e-9)
        assert not asked.force.any()


def test_the_law_is_certified_for_arms_that_nothing_connects():
    experiment = replace(carry_planar(law=ShapeKeeping()), plant_type=Plant)
    certificate = certify(experiment.simulate(0.04, dt=1e-3))
    assert certificate.certified, certificate
    assert set(certificate.lyapunov.energy) == {"kinetic", "parameter"}


def bound(gains: Gains = GAINS, cell: Cell = CELL):
    return ShapeKeeping().bind(cell, gains)


def in_one_point() -> Cell:
    members = [Member(load_robot("planar2r"), Hold([0.3, 0.4]), q0=[0.3, 1.0]) for _ in range(2)]
    return Cell(members, Coupling.pair(), CartesianSpace("xy"))


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: bound(GAINS.replace(K_eps=1.0)), "K_eps"),
        (lambda: bound(GAINS.replace(leak=1.0)), "leak"),
        (lambda: bound(GAINS.replace(beta=(1.0, 2.0))), "beta"),
        (lambda: bound(cell=in_one_point()), "ShapeKeeping, desired motions"),
        (lambda: bound(cell=Cell(in_one_point().members, Coupling.pair())), "ShapeKeeping, space"),
    ],
)
def test_the_law_refuses_what_it_has_no_place_for(make, subject):
    with refused(InputError, subject):
        make()


def test_the_compiled_engine_refuses_a_law_that_mixes_robots():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = replace(carry_planar(law=ShapeKeeping()), plant_type=Plant)
    with refused(InputError, "law"):
        experiment.simulate(0.01, dt=1e-3, engine="compiled")


# -- four arms and a plate --------------------------------------------------------------------------------


def compiled(duration: float, **options) -> Result:
    """A run by the engine that is quick, of arms that do not give way."""
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    return carry_planar(**options).simulate(duration, dt=1.5e-3, log_dt=1.5e-2, engine="compiled")


@pytest.fixture(scope="module")
def run() -> Result:
    return compiled(0.3)


def test_pins_pass_no_moment_and_what_is_inside_is_no_load(run):
    h, inner = run.outputs["hand_wrench"], run.outputs["internal_force"]
    assert inner.shape == (len(run.t), 4, 2) and np.abs(inner).max() > 0.1
    assert not h[..., 3:].any()
    plant = run.experiment.closed_loop().plant
    arms = plant._levers(run.outputs["plant_state"])[..., :2]
    np.testing.assert_allclose(np.matvec(place_matrix(arms), inner.reshape(len(run.t), -1)), 0.0, atol=1e-10)
    loads = [
        np.matvec(place_matrix(arms), f.reshape(len(run.t), -1)) for f in (h[..., :2], h[..., :2] - inner)
    ]
    np.testing.assert_allclose(*loads, atol=1e-9)


def test_synchronization_does_not_take_force_out_of_the_plate(run):
    force = [
        np.sqrt(np.mean(some.outputs["internal_force"] ** 2))
        for some in (compiled(0.3, synchronized=False), run)
    ]
    assert force[0] < force[1]


# -- a tare, and arms that give way ------------------------------------------------------------------------


def apart(r: np.ndarray) -> np.ndarray:
    """How far places, (..., k, d), are from each other, (..., k, k)."""
    return np.linalg.norm(r[..., :, None, :] - r[..., None, :, :], axis=-1)


@pytest.mark.parametrize("d", [2, 3])
@given(SEEDS)
def test_a_tare_of_pins_is_the_best_fit_and_does_not_depend_on_where_the_object_is(d, seed):
    """Nothing is left of the differences of beliefs that a displacement or a turn could explain."""
    rng, rho, noise = places(seed, d)
    turn = exp(rng.normal(size=3) * (1.0 if d == 3 else [0.0, 0.0, 1.0]))[:d, :d]
    way = rng.normal(size=d)
    np.testing.assert_allclose(tared_places(rho, rho @ turn.T + way), rho, atol=1e-7)
    pins = rho + 0.01 * noise
    tared = tared_places(rho, pins @ turn.T + way)
    np.testing.assert_allclose(apart(tared), apart(pins), atol=1e-9)
    np.testing.assert_allclose(tared, tared_places(rho, pins), atol=1e-6)
    np.testing.assert_allclose(place_matrix(rho) @ (tared - rho).ravel(), 0.0, atol=1e-7)


@pytest.mark.parametrize("d", [2, 3])
def test_a_tare_turns_places_and_never_mirrors_them(d):
    rho = np.random.default_rng(1).normal(size=(6, d))
    rho -= rho.mean(axis=0)
    mirrored = rho * [-1.0, *[1.0] * (d - 1)]
    turned = np.linalg.lstsq(mirrored, tared_places(rho, mirrored))[0]
    np.testing.assert_allclose(turned @ turned.T, np.eye(d), atol=1e-12)
    assert np.linalg.det(turned) == pytest.approx(1.0)


def test_a_tare_makes_arms_ask_for_a_plate_of_the_right_shape():
    times = np.linspace(0.0, 2.0, 5)
    wrong, right = (
        np.stack([at_t.xd for at_t in carry_planar(geometric_error=True, tare=tare).cell.references(times)])
        for tare in (False, True)
    )
    shape = np.broadcast_to(apart(PINS), (5, 4, 4))
    assert np.abs(apart(wrong) - shape).max() > 1e-3
    np.testing.assert_allclose(apart(right), shape, atol=1e-12)
    assert np.abs(right - wrong).max() < 2e-3


@pytest.mark.parametrize("massless", [False, True])
@given(SEEDS)
def test_places_give_way_like_poses_whose_axes_do_not_turn(massless, seed):
    rng = np.random.default_rng(seed)
    D, mass = rng.uniform(1.0, 2.0, 6), np.full(6, 0.0 if massless else 0.5)
    y, e, rates, h = rng.normal(size=(4, 2, 4, 6))
    task = Measurement(np.zeros_like(e), e, rates)
    poses = Giving(D, mass, np.sign(mass)).moved(task, y, np.zeros((3, 4, 6)), h[0])[0]
    cut = Measurement(*(part[..., :2] for part in (task.motion, e, rates)))
    parts = (part[:2] for part in (D, mass, np.sign(mass)))
    found, felt = GivingPlaces(*parts).moved(cut, y[..., :2], np.zeros((3, 4, 2)), h[0][:, :2])
    assert np.array_equal(felt, h[0][:, :2])
    np.testing.assert_allclose(found.error, poses.error[..., :2])
    np.testing.assert_allclose(found.rates, poses.rates[..., :2])


@pytest.fixture(scope="module")
def yielding() -> Result:
    return carry_planar(geometric_error=True, admittance=True).simulate(0.6, dt=1.5e-3)


def test_arms_give_way_by_what_the_force_inside_pushed_them(yielding):
    inner, y = (yielding.outputs[name] for name in ("internal_force", "admittance"))
    assert y.shape == inner.shape == (len(yielding.t), 4, 2)
    pushed = np.trapezoid(inner, yielding.t, axis=0)
    np.testing.assert_allclose(-ADMITTANCE.damping[0] * y[-1], pushed, atol=0.01 * np.abs(pushed).max())
    np.testing.assert_allclose(y.sum(axis=1), 0.0, atol=1e-12)


def test_what_hands_feel_at_pins_is_the_force_inside_and_no_load(yielding):
    plant = yielding.experiment.closed_loop().plant
    felt = plant.felt(yielding.q[-1], yielding.v[-1], yielding.outputs["plant_state"][-1])
    np.testing.assert_allclose(felt[:, :2], yielding.outputs["internal_force"][-1])
    assert not felt[:, 2].any()
    np.testing.assert_allclose(felt.sum(axis=0)[[0, 1, 5]], 0.0, atol=1e-10)


def late_force(run: Result) -> float:
    """Root mean square of the force inside after the start, N."""
    return float(np.sqrt(np.mean(run.outputs["internal_force"][run.t > 0.3] ** 2)))


def test_a_tare_and_an_admittance_each_take_out_half_of_the_force_of_wrong_pins(yielding):
    wrong, tared = (
        late_force(compiled(0.6, geometric_error=True, leak=True, tare=tare)) for tare in (False, True)
    )
    assert late_force(yielding) < 0.5 * wrong and tared < 0.5 * wrong


def test_no_theorem_covers_arms_that_give_way_at_pins():
    made = carry_planar(geometric_error=True, admittance=True)
    certificate = certify(made.simulate(0.04, dt=1e-3))
    assert certificate.verdict == "outside the theorem"
    assert any("not the pose" in words for words in certificate.outside)


def test_integrals_leak_with_an_admittance_where_the_law_has_any():
    assert np.array_equal(carry_planar(admittance=True).gains.leak, carry_planar().gains.Lambda)
    assert not np.any(carry_planar(law=ShapeKeeping(), admittance=True).gains.leak)
    assert not np.any(carry_planar(admittance=True, leak=0.0).gains.leak)


@pytest.mark.parametrize("plant", [PinnedPlant, CarryingPlant])
def test_the_compiled_engine_refuses_arms_that_give_way_at_pins(plant):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    made = carry_planar(admittance=True)
    made = replace(made, plant_type=partial(plant, **made.plant_type.keywords))
    with refused(InputError, "plant" if plant is PinnedPlant else "admittance"):
        made.simulate(0.01, dt=1e-3, engine="compiled")


def test_both_cells_that_carry_have_the_same_options():
    options = [
        {name: option.default for name, option in signature(cell).parameters.items()}
        for cell in (carry_planar, carry_ur5)
    ]
    assert options[0] == options[1]


def with_pins(**changed) -> PinnedPlant:
    experiment = carry_planar()
    return PinnedPlant(experiment.cell, **{**experiment.plant_type.keywords, **changed})


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Pin(0.0), "pin, stiffness"),
        (lambda: Pin(1.0, -1.0), "pin, damping"),
        (lambda: with_pins(grasps=[Grasp(i, compliance=Fixture()) for i in range(4)]), "grasps"),
        (lambda: with_pins(grasps=[Grasp(i, compliance=Pin()) for i in (0, 2)]), "grasps"),
        (lambda: carry_planar(grasp="rigid"), "grasp"),
        (lambda: carry_planar(grasp=Fixture()), "grasp"),
        (lambda: carry_planar(geometric_error=1e-3), "geometric_error"),
        (lambda: carry_planar(tare=1), "tare"),
        (lambda: carry_planar(admittance=1.0), "admittance"),
        (lambda: carry_planar(law=ShapeKeeping(), admittance=True, leak=1.0).closed_loop(), "leak"),
        (lambda: tared_places(np.eye(3), np.eye(2)), "found"),
        (lambda: carry_planar(friction=1), "friction"),
    ],
)
def test_what_pins_cannot_carry_is_refused(make, subject):
    with refused(InputError, subject):
        make()
