"""An independent model of the four arms, written from the paper's formulas, moves like the toolkit's."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import paper_model as paper
import pytest

from synctrl.experiments import planar_four

SCENARIOS = [
    paper.Scenario(synchronized, pushed) for synchronized in (True, False) for pushed in (False, True)
]
TOLERANCE = 1e-6


@pytest.fixture(scope="module")
def states():
    """States of the independent model, (T, scenario, 4, 9), every 1 ms."""
    return paper.FourArms(SCENARIOS).run(5.0, 1e-3)[1]


def test_the_second_opinion_imports_numpy_and_nothing_of_the_toolkit():
    tree = ast.parse(Path(paper.__file__).read_text(encoding="utf-8"))
    modules = {
        alias.name if isinstance(node, ast.Import) else node.module
        for node in ast.walk(tree)
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for alias in node.names
    }
    assert modules == {"__future__", "collections.abc", "dataclasses", "numpy"}


@pytest.mark.parametrize("k", range(4), ids=[str(s) for s in SCENARIOS])
def test_both_models_have_the_same_trajectories_over_the_whole_run(planar_run, states, k):
    run = planar_run(SCENARIOS[k].synchronized, "torque" if SCENARIOS[k].pushed else None)
    q, v, theta_hat, integral = np.split(states[:, k], [2, 4, 7], axis=-1)
    assert len(run.t) == 5001 and run.t[-1] == 5.0
    for name, theirs in {"q": q, "v": v, "theta_hat": theta_hat, "sync_integral": integral}.items():
        np.testing.assert_allclose(getattr(run, name), theirs, rtol=0, atol=TOLERANCE, err_msg=name)


@pytest.mark.parametrize("k", range(4), ids=[str(s) for s in SCENARIOS])
def test_both_models_have_the_same_errors_and_torques(planar_run, states, k):
    run = planar_run(SCENARIOS[k].synchronized, "torque" if SCENARIOS[k].pushed else None)
    arms = paper.FourArms([SCENARIOS[k]])
    for row in range(0, 5001, 50):
        t, state = run.t[row], states[row, k][None]
        tau, _, epsilon = arms.control(t, state)
        x = arms.base + paper.tip(state[0, :, :2])
        np.testing.assert_allclose(run.x[row], x, atol=TOLERANCE)
        np.testing.assert_allclose(run.tracking_error[row], arms.desired(t)[0] - x, atol=TOLERANCE)
        np.testing.assert_allclose(run.sync_error[row], epsilon[0], atol=TOLERANCE)
        np.testing.assert_allclose(run.tau[row], tau[0], atol=TOLERANCE)


def test_the_scenarios_are_far_more_apart_than_the_two_models(states):
    for k in range(4):
        for other in range(k):
            assert np.abs(states[:, k, :, :2] - states[:, other, :, :2]).max() > 1000 * TOLERANCE


def test_both_models_agree_for_another_phi():
    _, states = paper.FourArms(SCENARIOS[:1], phi=0.25).run(0.2, 1e-3)
    run = planar_four(phi=0.25).simulate(duration=0.2)
    np.testing.assert_allclose(run.q, states[:, 0, :, :2], rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(run.theta_hat, states[:, 0, :, 4:7], rtol=0, atol=TOLERANCE)


def test_the_printed_coriolis_terms_make_h_dot_minus_two_c_skew():
    # Y with z_1 = 0 is C z_2: read C off column by column, and H' off H by differences
    rng = np.random.default_rng(3)
    q, dq, p = rng.normal(size=(50, 2)), rng.normal(size=(50, 2)), paper.theta(1.3, 0.4, 0.7, 0.5)
    none, columns = np.zeros((50, 2)), []
    for axis in np.eye(2):
        Y = paper.printed_regressor(none, np.tile(axis, (50, 1)), q, dq)
        columns.append(Y @ p)
    coriolis, h = np.stack(columns, axis=-1), 1e-6
    rate = (paper.mass_matrix(q + h * dq, p) - paper.mass_matrix(q - h * dq, p)) / (2 * h)
    skew = rate - 2 * coriolis
    np.testing.assert_allclose(skew, -paper.transposed(skew), atol=1e-8)
    np.testing.assert_allclose(paper.times(coriolis, dq), paper.coriolis_torque(q, dq, p), atol=1e-14)
