"""Certificates: certified only where the theorem holds, and otherwise the reason."""

from __future__ import annotations

import json
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from refusals import refused
from test_devices import ALL
from test_devices import small as small_devices
from theory_cells import GAINS, coupling, experiment

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Cubic,
    Damping,
    Disturbance,
    Experiment,
    Friction,
    Gains,
    Hold,
    Member,
    Result,
    SmoothTrajectory,
    load_robot,
)
from synctrl.analysis import Certificate, certify
from synctrl.analysis.certify import VERDICTS
from synctrl.analysis.convergence import convergence
from synctrl.analysis.lyapunov import lyapunov
from synctrl.analysis.replay import replay
from synctrl.control.adaptation import Gradient, Leakage
from synctrl.control.laws import SunMills
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four
from synctrl.robots.parameters import FrictionParameters

pytestmark = pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning")  # odd rings are meant
PUSH = Disturbance(robot=0, torque=2.0, start=0.01, stop=0.03)


def small(kind: str = "ring", **options) -> Certificate:
    return certify(experiment(coupling(kind, 4, 2, "moving"), **options).simulate(0.03, 1e-3))


def test_a_run_inside_the_theorem_is_certified() -> None:
    certificate = small()
    assert certificate.certified
    assert certificate.outside == certificate.doubts == ()
    assert certificate.growth is None
    assert certificate.lyapunov.closes
    assert certificate.convergence.identity_holds


@pytest.mark.parametrize(
    ("options", "reason", "verdict"),
    [
        ({"friction": Friction(viscous=0.5)}, "friction", VERDICTS[1]),
        ({"disturbances": (PUSH,)}, "torque from outside", VERDICTS[1]),
        ({"gains": GAINS.replace(Gamma=0.0)}, "not adapted", VERDICTS[1]),
        (
            {"gains": GAINS.replace(K_r=0.01), "reference_acceleration": "paper"},
            "gain condition fails: robot",
            VERDICTS[2],
        ),
    ],
)
def test_what_is_outside_the_theorem_is_named_and_the_balance_closes_nevertheless(
    options: dict, reason: str, verdict: str
) -> None:
    certificate = small(**options)
    assert certificate.verdict == verdict and certificate.meaning in str(certificate)
    assert certificate.unbounded == (certificate.outside if verdict == VERDICTS[2] else ())
    assert len(certificate.outside) == 1
    assert reason in certificate.outside[0]
    assert certificate.lyapunov.closes
    assert certificate.doubts == ()
    assert reason in str(certificate)


def test_the_papers_reference_acceleration_is_certified_where_the_gain_condition_holds() -> None:
    gains = GAINS.replace(K_r=60.0, Gamma=1e-3)
    run = experiment(coupling("ring", 4, 2, "moving"), gains, reference_acceleration="paper")
    certificate = certify(run.simulate(0.03, 2.5e-4))
    assert certificate.gain_condition.needed
    assert certificate.gain_condition.holds
    assert certificate.certified


def test_friction_that_is_adapted_is_inside_the_theorem_and_damps() -> None:
    run = experiment(coupling("ring", 4, 2, "moving"), friction=Friction(0.5, 0.3, 0.1))
    members = []
    for member in run.cell.members:
        known = FrictionParameters(member.robot, member.friction)
        members.append(replace(member, parameters=known, theta_hat0=0.6 * known.theta))
    adapted = replace(run, cell=Cell(members, run.cell.coupling))
    certificate = certify(adapted.simulate(0.03, 1e-3))
    assert certificate.certified, str(certificate)
    assert certificate.lyapunov.supplied["friction in Y"] < 0
    assert certify(run.simulate(0.03, 1e-3)).verdict == "bounded by Theorem A"


def test_a_run_that_is_too_coarse_is_not_certified() -> None:
    stiff = Friction(coulomb=3.0, smoothing=1e-3)
    run = experiment(coupling("pair", 2, 1), joints=1, friction=stiff)
    certificate = certify(run.simulate(0.2, 4e-3))
    assert certificate.verdict == "outside the theorem"
    assert any("does not close" in doubt for doubt in certificate.doubts)


def test_a_run_under_sampled_control_is_not_covered_but_bounded() -> None:
    run = experiment(coupling("ring", 4, 2)).simulate(0.03, 1e-3, control_period=2e-3)
    certificate = certify(run)
    assert certificate.verdict == "bounded by Theorem A"
    assert any("held for 0.002 s" in reason for reason in certificate.outside)


def test_of_sampled_control_samples_are_named_and_not_the_step() -> None:
    certificate = certify(small_devices(**ALL).simulate(0.3, 1e-3, control_period=2e-3))
    assert certificate.growth is not None and certificate.growth.term == "sampling"
    assert certificate.closes is None and "numerical errors explain" not in str(certificate)
    assert certificate.dissipation is not None
    assert f"with what is held, by {np.abs(certificate.dissipation.gap).max():.2g}" in str(certificate)


def test_a_certificate_is_frozen_readable_and_plain_data() -> None:
    certificate = small()
    with pytest.raises(FrozenInstanceError):
        certificate.verdict = "covered by the theorem"  # type: ignore[misc]
    text = str(certificate)
    for word in (
        certificate.title,
        "covered by the theorem",
        certificate.meaning,
        "V'",
        "balance",
        "gain condition",
        "at the end",
        "S+",
    ):
        assert word in text
    data = json.loads(json.dumps(certificate.as_dict(), allow_nan=False))
    assert data["verdict"] == "covered by the theorem"
    assert data["V"]["start"] == certificate.lyapunov.V[0]
    assert set(data["energy"]) == set(certificate.lyapunov.power)


def test_a_loaded_result_is_certified_with_its_experiment(tmp_path) -> None:
    run = experiment(coupling("pair", 2, 2))
    result = run.simulate(0.01, 1e-3)
    loaded = Result.load(result.save(tmp_path / "run.npz"))
    with refused(InputError, "experiment"):
        certify(loaded)
    assert certify(loaded, run).as_dict() == certify(result).as_dict()


@pytest.mark.parametrize(("n", "kind"), [(2, "pair"), (4, "ring"), (5, "ring"), (5, "all-to-all")])
@pytest.mark.parametrize("weight", ["constant", "moving"])
def test_the_weighted_error_is_made_of_e_star_and_epsilon_at_every_instant(
    n: int, kind: str, weight: str
) -> None:
    link = coupling(kind, n, 2, weight)
    found = convergence(experiment(link).simulate(0.02, 1e-3))
    assert found.identity_holds
    assert found.identity < 1e-12
    assert found.modes == n - np.linalg.matrix_rank(link.matrix)


def test_the_errors_of_a_certified_run_vanish() -> None:
    gains = GAINS.replace(K_r=8.0, Lambda=10.0, Gamma=0.001)
    result = experiment(coupling("ring", 4, 1), gains, joints=1, gravity=0.0, known=1.0).simulate(
        1.5, 1.25e-3
    )
    found = convergence(result)
    assert all(found.final[name] < 1e-2 * found.peak[name] for name in found.final)
    assert certify(result).certified


@pytest.mark.parametrize(
    ("run", "verdict"),
    [
        (planar_four(), "covered by the theorem"),
        (planar_four(synchronized=False), "covered by the theorem"),
        (planar_four(disturbance=PUSH), "bounded by Theorem A"),
        (a460_pair(friction=False), "covered by the theorem"),
        (a460_pair(), "bounded by Theorem A"),
    ],
)
def test_the_cells_of_the_paper_are_certified_unless_pushed_or_rubbed(run, verdict: str) -> None:
    certificate = certify(run.simulate(0.05, 2.5e-4))
    assert certificate.verdict == verdict, str(certificate)


@pytest.mark.parametrize("thin", ["log_dt", "decimated"])
@pytest.mark.parametrize(
    "options", [{}, {"friction": Friction(viscous=0.5)}, {"disturbances": (PUSH,)}], ids=str
)
def test_a_thinned_log_is_not_certified_and_no_balance_is_claimed(thin: str, options: dict) -> None:
    run = experiment(coupling("ring", 4, 2, "moving"), **options)
    if thin == "log_dt":
        result = run.simulate(0.04, 1e-3, log_dt=4e-3)
    else:
        result = run.simulate(0.04, 1e-3).decimated(4)
    certificate = certify(result)
    assert certificate.verdict == "outside the theorem" and not certificate.certified
    assert certificate.closes is None and certificate.as_dict()["balance"]["closes"] is None
    assert certificate.every == 4
    (doubt,) = certificate.doubts
    assert "thinned, to one of 4 steps" in doubt
    assert "balance: cannot be seen" in str(certificate)
    assert len(certificate.outside) == len(options)


def test_a_thinned_log_is_recognized_in_a_file_too(tmp_path) -> None:
    run = experiment(coupling("pair", 2, 2))
    result = run.simulate(0.02, 1e-3, log_dt=2e-3)
    loaded = Result.load(result.save(tmp_path / "run.npz"))
    assert certify(loaded, run).as_dict() == certify(result).as_dict()


def test_a_log_that_has_every_step_is_not_thinned() -> None:
    result = experiment(coupling("pair", 2, 2)).simulate(0.0203, 1e-3, log_dt=1e-3).decimated(1)
    certificate = certify(result)
    assert certificate.certified and certificate.every == 1 and certificate.closes is True


@pytest.mark.parametrize("log_dt", [1e-3, 5e-3])
def test_a_push_between_two_logged_instants_is_known_from_the_left(log_dt: float) -> None:
    push = Disturbance(robot=0, torque=2.0, start=0.0095, stop=0.01)
    run = experiment(coupling("pair", 2, 2), disturbances=(push,))
    gone_through = replay(run.simulate(0.02, 1e-3, log_dt=log_dt))
    k = round(0.01 / log_dt)
    left, right = gone_through.logged[k] - 1, gone_through.logged[k]
    np.testing.assert_array_equal(gone_through.rows.disturbance[left, 0], 2.0)
    np.testing.assert_array_equal(gone_through.rows.disturbance[right, 0], 0.0)


def lifted(rise: float) -> Experiment:
    """Two A460 with known parameters that begin at rest on their path, which goes straight up, m."""
    robot, q0 = load_robot("a460"), np.array([0.3, 1.0, -2.8])
    start = robot.tip_position(q0)
    way = Cubic(start, start + np.array([0.0, 0.0, rise]), duration=1.0)
    member = Member(robot, way, q0=q0, theta_hat0=robot.inertial_parameters)
    return Experiment(Cell([member] * 2, Coupling.pair(), CartesianSpace()), GAINS, duration=0.01)


@pytest.mark.parametrize("rise", [0.05, 0.0])
def test_a_compiled_run_from_rest_on_its_path_is_known_again_and_keeps_the_identity(rise: float) -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    result = lifted(rise).simulate(dt=5e-4, engine="compiled")
    assert np.allclose(replay(result).rows.s_q, result.v_error, rtol=0, atol=1e-12)
    assert convergence(result).identity_holds


@pytest.mark.parametrize("gain", ["Lambda", "beta", "K_r", "K_eps", "Gamma"])
def test_a_run_with_slightly_other_gains_is_another_one(gain: str) -> None:
    run = experiment(coupling("pair", 2, 2))
    other = replace(run, gains=GAINS.replace(**{gain: 1.001 * getattr(GAINS, gain)}))
    with refused(InputError, "experiment", found="adaptation" if gain == "Gamma" else "gains"):
        replay(run.simulate(0.03, 1e-3), other)


@pytest.mark.parametrize(
    ("found", "options"),
    [
        ("law", {"law": SunMills("paper")}),
        ("adaptation", {"adaptation": Gradient(0.2)}),
        ("adaptation", {"adaptation": Leakage(0.3, 0.2)}),
    ],
)
def test_a_run_with_another_part_is_another_one(found: str, options: dict) -> None:
    with refused(InputError, "experiment", found=found):
        replay(a460_pair(adaptation=Gradient(0.3)).simulate(0.01, 1e-3), a460_pair(**options))


def test_gamma_among_the_gains_is_the_same_as_the_gradient_with_it() -> None:
    made = experiment(coupling("pair", 2, 2))
    same = replace(made, gains=GAINS.replace(Gamma=None), adaptation=Gradient(GAINS.Gamma))
    assert replay(made.simulate(0.01, 1e-3), same).experiment is same


def test_other_weights_show_in_the_velocity_errors() -> None:
    made, other = experiment(coupling("pair", 2, 2)), experiment(coupling("pair", 2, 2, "moving"))
    with refused(InputError, "experiment", found="v_error"):
        replay(made.simulate(0.03, 1e-3), other)


# -- what the referee of version 0.1 found ------------------------------------------------------------------


def through_a_singularity(**options) -> Experiment:
    """A pair of planar arms of which one is straight, under damped inverse kinematics, without K_eps."""
    robot = load_robot("planar2r")
    members = []
    for q in ((0.3, 1.2), (0.3, 0.15)):
        start = robot.tip_position(np.array(q))[:2]
        members.append(Member(robot, Hold(start - (0.02, 0.01)), np.array(q)))
    space = CartesianSpace("xy", singularity=Damping(0.1, 0.05))
    gains = Gains(Lambda=5.0, beta=0.0, K_r=2.0, K_eps=0.0, Gamma=0.02)
    return Experiment(Cell(members, Coupling.pair(), space), gains, **options)


def test_damped_inverse_kinematics_are_outside_even_where_their_power_is_zero_by_construction() -> None:
    result = through_a_singularity(duration=0.3).simulate(dt=1e-3)
    certificate = certify(result)
    assert result.info["damping"], "the damping is on"
    power, rounding = certificate.lyapunov.power["damped inverse"], certificate.lyapunov.rounding
    assert (np.abs(power) <= rounding).all()
    assert certificate.verdict == "outside the theorem"
    assert any("J s_q and c^-1 r" in text for text in certificate.unbounded)


def test_damping_in_task_space_takes_and_what_it_gives_is_the_damped_inverse() -> None:
    run = replace(through_a_singularity(duration=0.1), law=SunMills(k_r_space="task"))
    record = lyapunov(run.simulate(dt=5e-4))
    assert (record.power["damping"] <= record.rounding).all()
    assert record.power["damped inverse"].any() and record.closes


def kinked() -> Experiment:
    """Joints that rest and then move on at once: a desired velocity jumps from 0 to 1 and -0.5 rad/s."""
    robot, members = load_robot("planar2r"), []
    for share, q in zip((1.0, 0.9), np.array([[0.3, 1.2], [-0.2, 0.9]]), strict=True):
        rates = share * np.array([1.0, -0.5])
        path = SmoothTrajectory(lambda t, q=q, v=rates: q + max(t - 0.05, 0.0) * v, 0.1, breaks=(0.05,))
        members.append(Member(robot, path, q, theta_hat0=0.7 * robot.inertial_parameters))
    return Experiment(Cell(members, Coupling.pair()), GAINS, 0.1)


def test_a_jump_of_the_desired_velocity_is_counted_and_called_outside() -> None:
    certificate = certify(kinked().simulate(dt=2.5e-4))
    record = certificate.lyapunov
    assert certificate.verdict == "outside the theorem"
    assert any(
        "desired velocity of robot 1 jumps by 1 at t = 0.05 s" in text for text in certificate.unbounded
    )
    assert abs(record.jumped) > 10 * record.drift_bound
    accounted = sum(record.supplied.values()) + record.jumped + record.drift[-1]
    np.testing.assert_allclose(accounted, record.V[-1] - record.V[0], rtol=1e-9, atol=1e-12)
    assert certificate.as_dict()["balance"]["jumped"] == record.jumped


@pytest.mark.parametrize("dt", [1e-3, 7e-4], ids=["at an instant of the log", "between two"])
def test_v_does_not_grow_by_integration_where_the_desired_velocity_jumps(dt: float) -> None:
    certificate = certify(kinked().simulate(dt=dt))
    assert np.diff(certificate.lyapunov.V).max() > 0.1
    assert certificate.growth is None


def test_a_balance_whose_bound_is_a_large_share_of_what_v_lost_says_nothing() -> None:
    coarse, fine = (certify(planar_four().simulate(0.5, dt=dt)) for dt in (6.25e-3, 1e-3))
    record = coarse.lyapunov
    assert record.closes and not record.resolved
    assert record.drift_bound > 1e-3 * (record.V[0] - record.V[-1])
    assert coarse.verdict == "outside the theorem" and "may hide in the balance" in coarse.doubts[0]
    assert fine.certified and fine.lyapunov.resolved


def test_each_verdict_says_what_it_means_and_what_it_does_not() -> None:
    certificate = small()
    assert "nothing outside the theorem acted" in certificate.meaning
    assert "does not say that errors are small" in certificate.meaning
    assert certificate.as_dict()["meaning"] == certificate.meaning


def test_errors_and_energies_have_units() -> None:
    text = str(small())
    for line in ("V goes from", "by term", "balance", "Theorem A"):
        assert any(line in told and told.endswith(" N·m") for told in text.splitlines())
    units = small().convergence.units
    assert units == dict.fromkeys(("tracking error", "sync error", "coupled error"), "rad") | {
        "coupled velocity error": "rad/s"
    }


def test_a_console_shows_what_a_report_says() -> None:
    certificate = small()
    for report in (certificate, certificate.dissipation):
        assert repr(report) == str(report)
