"""V and V' along runs: V' is what V does, is never positive inside the theorem, and has named terms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused
from scipy.interpolate import make_interp_spline
from theory_cells import GAINS, coupling, experiment, planar_arm, swing, weights

from synctrl import (
    Cell,
    Coupling,
    Disturbance,
    Experiment,
    Friction,
    FullParameters,
    Gains,
    Member,
    Payload,
    Result,
    Robot,
)
from synctrl.analysis.growth import first_growth
from synctrl.analysis.lyapunov import ENERGIES, POWERS, THEOREM, Lyapunov, lyapunov
from synctrl.errors import InputError
from synctrl.robots import documents
from synctrl.robots.parameters import LinearParameters
from synctrl.robots.urdf import describe
from synctrl.robots.urdf.document import Limit

pytestmark = pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning")  # odd rings are meant

PUSH = Disturbance(robot=0, torque=2.0, start=0.02, stop=0.06)
OFF_LOG = Disturbance(robot=0, torque=2.0, start=0.0203, stop=0.0607)
KINDS = [(2, "pair"), (2, "signed graph")]
KINDS += [(n, kind) for n in (3, 4, 5, 16) for kind in ("ring", "signed graph", "all-to-all")]


def assert_never_grows(record: Lyapunov) -> None:
    assert (record.V_dot <= record.rounding).all()
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert record.closes
    assert first_growth(record) is None


def assert_is_derivative(record: Lyapunov, part: slice = slice(None)) -> None:
    """V' against a spline of seventh order through V, up to the error of the spline and of the run."""
    t, V, V_dot = record.t[part], record.V[part], record.V_dot[part]
    inside = slice(6, -6)  # the ends of a spline are less accurate
    slope = make_interp_spline(t, V, k=7).derivative()(t)
    np.testing.assert_allclose(V_dot[inside], slope[inside], rtol=0, atol=2e-6 * np.abs(V_dot).max())


@pytest.mark.parametrize("weight", ["scalar", "constant", "moving"])
@pytest.mark.parametrize(("n", "kind"), KINDS)
def test_v_never_grows_without_friction(n: int, kind: str, weight: str) -> None:
    record = lyapunov(experiment(coupling(kind, n, 2, weight)).simulate(0.03, 1e-3))
    assert_never_grows(record)
    assert record.V[-1] < record.V[0]


@pytest.mark.parametrize("k_r_space", ["joint", "task"])
@pytest.mark.parametrize("cartesian", [False, True])
@pytest.mark.parametrize("weight", ["constant", "moving"])
def test_v_never_grows_in_either_space_and_for_either_place_of_k_r(
    weight: str, cartesian: bool, k_r_space: str
) -> None:
    run = experiment(coupling("ring", 4, 2, weight), cartesian=cartesian, k_r_space=k_r_space)
    assert_never_grows(lyapunov(run.simulate(0.03, 1e-3)))


@settings(max_examples=25)
@given(data=st.data())
def test_v_never_grows_for_any_coupling_weights_and_gains(data: st.DataObject) -> None:
    n = data.draw(st.integers(2, 5))
    joints = data.draw(st.integers(1, 2))
    tree = [(k, data.draw(st.integers(0, k - 1))) for k in range(1, n)]
    more = st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)).filter(lambda e: e[0] < e[1])
    extra = [e for e in data.draw(st.lists(more, max_size=4, unique=True)) if e[::-1] not in tree]
    entry = st.sampled_from([-2.0, -1.0, 0.5, 1.0])
    signs = [(data.draw(entry), data.draw(entry)) for _ in tree + extra]
    size = st.floats(0.2, 8.0)
    diagonal = st.lists(size, min_size=joints, max_size=joints)
    gains = Gains(
        Lambda=data.draw(diagonal), beta=data.draw(diagonal), K_r=data.draw(diagonal),
        K_eps=data.draw(diagonal), Gamma=data.draw(st.floats(0.01, 0.2)),
    )  # fmt: skip
    c = weights(data.draw(st.sampled_from(["scalar", "constant", "moving"])), n, joints)
    link = Coupling(n, tree + extra, signs, c)
    assert_never_grows(lyapunov(experiment(link, gains, joints=joints).simulate(0.02, 1e-3)))


CASES = {
    "theorem": {},
    "cartesian": {"cartesian": True},
    "paper": {"reference_acceleration": "paper"},
    "cartesian, paper": {"cartesian": True, "reference_acceleration": "paper"},
    "task": {"cartesian": True, "k_r_space": "task", "reference_acceleration": "paper"},
    "friction": {"friction": Friction(viscous=0.5, coulomb=0.3, smoothing=0.1)},
    "no adaptation": {"gains": GAINS.replace(Gamma=0.0)},
    "independent": {"gains": GAINS.independent()},
}


@pytest.mark.parametrize("case", CASES)
def test_v_dot_from_the_formula_is_the_derivative_of_v_along_the_run(case: str) -> None:
    record = lyapunov(experiment(coupling("ring", 4, 2, "moving"), **CASES[case]).simulate(0.04, 5e-4))
    assert_is_derivative(record)
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert record.closes
    assert sum(record.supplied.values()) == pytest.approx(record.V[-1] - record.V[0], abs=record.drift_bound)


def test_the_drift_falls_at_least_with_the_fourth_power_of_the_step() -> None:
    run = experiment(coupling("ring", 4, 2, "moving"))
    coarse, fine = (lyapunov(run.simulate(0.08, dt)).largest_drift for dt in (4e-3, 2e-3))
    assert coarse / fine > 12


@pytest.mark.parametrize("push", [PUSH, OFF_LOG])
def test_the_balance_closes_across_jumps_on_the_log_and_between_two_instants(push: Disturbance) -> None:
    record = lyapunov(experiment(coupling("ring", 4, 2), disturbances=(push,)).simulate(0.1, 1e-3))
    assert record.closes
    assert np.abs(record.power["disturbance"]).max() > 1e3 * record.rounding.max()
    assert_is_derivative(record, slice(21, 60))


def test_the_terms_of_v_are_what_the_proof_says_and_not_negative() -> None:
    link = coupling("ring", 4, 2, "moving")
    result = experiment(link).simulate(0.02, 1e-3)
    record, cell = lyapunov(result), result.experiment.cell
    assert set(record.energy) == set(ENERGIES)
    assert set(record.power) == {*POWERS, "model error"}, "those of any run, and that of its adaptation"
    assert all((record.energy[name] >= 0).all() for name in ENERGIES)
    assert all((record.power[name] <= 0).all() for name in THEOREM)
    k = 11
    M = np.array([robot.mass_matrix(q) for robot, q in zip(cell.robots, result.q[k], strict=True)])
    s, tilde = result.v_error[k], cell.theta - result.theta_hat[k]
    E = link.matrix.T @ result.sync_integral[k]
    expected = {
        "kinetic": np.einsum("ia,iab,ib", s, M, s) / 2,
        "parameter": (tilde**2).sum() / 0.02 / 2,
        "synchronization": 1.5 * (result.sync_error[k] ** 2).sum() / 2,
        "integral": 1.5 * 4.0 * 3.0 * (E**2).sum() / 2,
    }
    assert {name: record.energy[name][k] for name in ENERGIES} == pytest.approx(expected)


def test_for_the_pair_v_is_the_papers_19() -> None:
    result = experiment(coupling("pair", 2, 2)).simulate(0.02, 1e-3)
    integral = result.sync_integral[-1, 0]
    printed = integral @ (1.5 * 4.0 * 3.0 * integral)  # without the factor 1/2, as (19) prints it
    assert lyapunov(result).energy["integral"][-1] == pytest.approx(printed)


def test_what_is_not_adapted_leaves_v_and_enters_as_the_power_of_the_model_error() -> None:
    frozen = np.full(20, 0.4)
    frozen[::3] = 0.0
    link = coupling("ring", 4, 2)
    some = lyapunov(experiment(link, GAINS.replace(Gamma=frozen)).simulate(0.02, 1e-3))
    none = lyapunov(experiment(link, GAINS.replace(Gamma=0.0)).simulate(0.02, 1e-3))
    for record in (some, none):
        assert np.abs(record.power["model error"]).max() > 1e3 * record.rounding.max()
        assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert (none.energy["parameter"] == 0).all()
    assert (some.energy["parameter"] > 0).all()
    right = lyapunov(experiment(link, GAINS.replace(Gamma=0.0), known=1.0).simulate(0.02, 1e-3))
    assert_never_grows(right)
    assert (np.abs(right.power["model error"]) <= right.rounding).all()


def test_robots_with_different_gains_and_numbers_of_parameters_share_one_cell() -> None:
    few, many = planar_arm(name="few"), planar_arm(name="many")
    kinds = [
        LinearParameters(few, few.inertial_parameters[:, None], [1.0], ["scale"]),
        FullParameters(many),
        FullParameters(many),
    ]
    members = [
        Member(robot, swing(np.array([0.3, 0.8]), i), parameters=kind, theta_hat0=0.5 * kind.theta)
        for i, (robot, kind) in enumerate(zip((few, many, many), kinds, strict=True))
    ]
    Gamma = np.array([[0.2], [0.5], [0.0]]) * np.ones(20)
    run = Experiment(Cell(members, coupling("signed graph", 3, 2)), GAINS.replace(Gamma=Gamma), 0.1)
    record = lyapunov(run.simulate(0.04, 1e-3))
    assert_is_derivative(record)
    assert record.closes
    assert (np.abs(record.power["other"]) <= record.rounding).all()


@pytest.mark.parametrize(
    ("term", "options"),
    [
        ("disturbance", {"disturbances": (Disturbance(0, -60.0, 0.02, 0.06),)}),
        ("model error", {"gains": GAINS.replace(Gamma=0.0, K_r=0.1), "known": 3.0}),
        ("weight rate", {"gains": GAINS.replace(K_r=0.01), "reference_acceleration": "paper"}),
    ],
)
def test_the_monitor_names_the_first_growth_of_v_and_its_term(term: str, options: dict) -> None:
    record = lyapunov(experiment(coupling("ring", 4, 2, "moving"), **options).simulate(0.06, 1e-3))
    growth = first_growth(record)
    assert growth is not None
    assert growth.term == term
    before, after = record.V[growth.index : growth.index + 2]
    assert after > before
    assert (np.diff(record.V[: growth.index + 1]) <= 0).all()


def test_the_exact_reference_acceleration_needs_no_gain_where_the_papers_fails() -> None:
    link, gains = coupling("ring", 4, 2, "moving"), GAINS.replace(K_r=0.01)
    assert_never_grows(lyapunov(experiment(link, gains).simulate(0.06, 1e-3)))
    assert first_growth(
        lyapunov(experiment(link, gains, reference_acceleration="paper").simulate(0.06, 1e-3))
    )


def test_a_step_that_is_too_long_is_found_by_the_balance_that_does_not_close() -> None:
    stiff = Friction(coulomb=3.0, smoothing=1e-3)
    record = lyapunov(experiment(coupling("pair", 2, 1), joints=1, friction=stiff).simulate(0.2, 4e-3))
    assert not record.closes
    assert (np.abs(record.power["other"]) <= record.rounding).all()


def test_forces_the_model_does_not_know_appear_as_other_power() -> None:
    run = experiment(coupling("pair", 2, 2))
    result = run.simulate(0.02, 1e-3)
    claimed = replace(run, cell=Cell(run.cell.members, run.cell.coupling))
    claimed.cell.theta = 1.1 * claimed.cell.theta  # what the plant does not have, and no cell would take
    record = lyapunov(result, claimed)
    assert (np.abs(record.power["other"]) > record.rounding).any()


def test_a_loaded_result_needs_its_experiment(tmp_path) -> None:
    run = experiment(coupling("pair", 2, 2))
    result = run.simulate(0.01, 1e-3)
    loaded = Result.load(result.save(tmp_path / "run.npz"))
    with refused(InputError, "experiment"):
        lyapunov(loaded)
    np.testing.assert_array_equal(lyapunov(loaded, run).V_dot, lyapunov(result).V_dot)


def test_another_experiment_than_the_one_that_made_the_result_is_refused() -> None:
    result = experiment(coupling("pair", 2, 2)).simulate(0.01, 1e-3)
    with refused(InputError, "experiment"):
        lyapunov(result, experiment(coupling("pair", 2, 2), GAINS.replace(Lambda=7.0)))
    with refused(InputError, "experiment"):
        lyapunov(result, experiment(coupling("ring", 3, 2)))
    with refused(InputError, "experiment"):
        lyapunov(result, result)  # type: ignore[arg-type]
    with refused(InputError, "result"):
        lyapunov(None)  # type: ignore[arg-type]


def test_torque_that_saturation_takes_away_is_named_and_the_balance_closes() -> None:
    document = documents.planar_arm([0.3, 0.3], [1.0, 1.0])
    joints = [replace(j, limit=Limit(0.2, 10.0, -3.0, 3.0)) if j.moves else j for j in document.joints]
    weak = describe(replace(document, joints=tuple(joints)))
    robot = Robot(weak.model, weak.tip, document=weak.document)
    run = experiment(coupling("pair", 2, 2))
    members = [replace(member, robot=robot) for member in run.cell.members]
    record = lyapunov(replace(run, cell=Cell(members, run.cell.coupling), saturate=True).simulate(0.03, 1e-3))
    assert np.abs(record.power["saturation"]).max() > 1e3 * record.rounding.max()
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert record.closes


def test_a_payload_is_a_force_that_the_model_does_not_contain_and_the_balance_closes() -> None:
    run = replace(experiment(coupling("pair", 2, 2)), payloads=(Payload(0, 0.5, start=0.0103),))
    record = lyapunov(run.simulate(0.03, 1e-3))
    before, after = record.t < 0.0103, record.t > 0.0103
    assert (np.abs(record.power["other"][before]) <= record.rounding[before]).all()
    assert (np.abs(record.power["other"][after]) > record.rounding[after]).any()
    assert record.closes
