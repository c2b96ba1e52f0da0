"""Estimates of bodies that can exist, and of bodies that cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from synctrl import Result
from synctrl.analysis.certify import certify
from synctrl.analysis.consistency import physical_consistency
from synctrl.control.adaptation import Natural
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, mixed_four, planar_four


def natural():
    experiment = a460_pair()
    return replace(experiment, adaptation=Natural(0.1, 0.3), gains=experiment.gains.replace(Gamma=None))


@pytest.fixture(scope="module")
def plain():
    return a460_pair().simulate(1.0, dt=2e-3)


def test_the_law_of_the_paper_leaves_the_bodies_that_can_exist_in_the_papers_own_cell(plain):
    found = physical_consistency(plain)
    assert not found.holds
    t, body, worst = found.left["robot 1"] if "robot 1" in found.left else found.left["robot 2"]
    assert 0.3 < t < 0.8
    assert worst < 0
    assert f"body {body + 1}" in str(found)


def test_the_eigenvalue_is_that_of_a_matrix_put_together_by_hand(plain):
    m, x, y, z, xx, xy, yy, xz, yz, zz = plain.theta_hat[-1, 1, 10:20]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    S = np.trace(inertia) / 2 * np.eye(3) - inertia
    P = np.block([[S, np.array([[x], [y], [z]])], [np.array([[x, y, z, m]])]])
    expected = np.linalg.eigvalsh(P)[0]
    assert physical_consistency(plain).smallest[1][-1, 1] == pytest.approx(expected, rel=1e-9)


def test_natural_adaptation_stays_with_bodies_that_can_exist():
    found = physical_consistency(natural().simulate(1.0, dt=2e-3))
    assert found.holds
    assert found.left == {}
    assert found.as_dict()["holds"]


def test_robots_of_different_kinds_have_bodies_of_their_own():
    found = physical_consistency(mixed_four().simulate(0.01))
    assert [v.shape[1] for v in found.smallest] == [r.body_count for r in mixed_four().cell.robots]


def test_a_loaded_result_needs_the_experiment(plain, tmp_path):
    read = Result.load(plain.save(tmp_path / "run.npz"))
    with refused(InputError, "experiment"):
        physical_consistency(read)
    assert physical_consistency(read, a460_pair()).as_dict() == physical_consistency(plain).as_dict()


def test_parameters_that_are_not_those_of_bodies_are_refused_by_name():
    with refused(InputError, "robot 1, parameters", found="LinearParameters"):
        physical_consistency(planar_four().simulate(0.01))


def test_a_certificate_says_whether_estimates_are_physical_and_when_the_law_converges(plain):

    certificate = certify(plain)
    assert certificate.consistency.as_dict() == physical_consistency(plain).as_dict()
    assert "none that can exist from" in str(certificate)
    assert certificate.as_dict()["statement"] in str(certificate)
    of_a_map = certify(planar_four().simulate(0.02))
    assert of_a_map.consistency is None
    assert of_a_map.as_dict()["consistency"] is None


def test_estimates_that_leave_the_bodies_do_not_change_the_verdict():
    certificate = certify(a460_pair(friction=False).simulate(1.0, dt=1e-3))
    assert not certificate.consistency.holds
    assert certificate.certified
