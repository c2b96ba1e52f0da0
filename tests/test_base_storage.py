"""The energy of the errors of base parameters: as good a storage as that of all parameters, and no larger."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import random_robot

from synctrl import Cell, Coupling, Member
from synctrl.analysis.base_storage import base_storages
from synctrl.control.adaptation import Gradient
from synctrl.tasks.trajectories import Hold

#: which entries of theta may be adapted: all, or none of the first bodies
RATES = ("all", "some", "none", "matrices")


def make_cell(seed: int) -> Cell:
    """Two robots of three joints that hold still."""
    robots = [random_robot(seed + k, 3) for k in range(2)]
    members = [Member(robot, Hold(np.zeros(3)), name=f"arm {k}") for k, robot in enumerate(robots)]
    return Cell(members, Coupling.pair())


def make_rates(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Gamma, (2, 30), or matrices, (2, 30, 30)."""
    diagonal = rng.uniform(0.1, 2.0, (2, 30))
    if kind == "some":
        diagonal *= rng.random((2, 30)) < 0.5
    if kind == "none":
        diagonal *= 0
    if kind == "matrices":
        A = rng.standard_normal((2, 30, 30))
        return A @ A.mT + diagonal[:, :, None] * np.eye(30)
    return diagonal


@pytest.mark.parametrize("kind", RATES)
@given(seed=st.integers(0, 2**20))
@settings(max_examples=5)
def test_it_falls_by_the_power_of_the_model_error_but_for_what_is_never_learned(kind: str, seed: int) -> None:
    rng, cell = np.random.default_rng(seed), make_cell(seed)
    Gamma = make_rates(kind, rng)
    adaptation = Gradient(Gamma).bind(cell)
    for i, base in enumerate(base_storages(cell, adaptation.Gamma)):
        q, v, v_ref, a_ref = rng.uniform(-1, 1, (4, 3))
        tilde, s_q = rng.standard_normal(30), v_ref - v
        Y = cell.parameters[i].regressor(q, v, v_ref, a_ref)
        one = Gamma[i] if Gamma.ndim == 3 else np.diag(Gamma[i])
        moved = -one @ Y.T @ s_q
        rate = base.energy(tilde + 0.5 * moved) - base.energy(tilde - 0.5 * moved)  # exact: it is quadratic
        frozen = Y[:, base.grouping.columns] @ base.frozen(tilde)
        size = np.abs(s_q) @ np.abs(Y) @ np.abs(tilde)
        assert rate == pytest.approx(-s_q @ Y @ tilde + s_q @ frozen, abs=1e-8 * size)
        assert base.frozen(moved) == pytest.approx(
            0, abs=1e-8 * np.abs(base.grouping.K @ moved).max(initial=1)
        )


@pytest.mark.parametrize("kind", ["all", "matrices"])
@given(seed=st.integers(0, 2**20))
@settings(max_examples=5)
def test_it_is_at_most_that_of_all_parameters_and_nothing_of_errors_that_no_torque_shows(
    kind: str, seed: int
) -> None:
    rng, cell = np.random.default_rng(seed), make_cell(seed)
    adaptation = Gradient(make_rates(kind, rng)).bind(cell)
    tilde = rng.standard_normal((2, 30))
    for i, base in enumerate(base_storages(cell, adaptation.Gamma)):
        whole = float(0.5 * tilde[i] @ adaptation.metric.lowered(tilde)[i])
        assert 0 < base.energy(tilde[i]) < whole
        hidden = np.linalg.svd(base.grouping.K)[2][base.grouping.rank :]
        assert base.energy(tilde[i] + 3 * hidden[0]) == pytest.approx(base.energy(tilde[i]))
        assert base.frozen(tilde[i]) == pytest.approx(0, abs=1e-9)
