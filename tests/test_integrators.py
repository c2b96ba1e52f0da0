"""Ways through time: order of convergence, jumps met exactly, and agreement with SciPy's methods."""

from __future__ import annotations

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import Cell, Coupling, Cubic, Disturbance, Experiment, Gains, Member, load_robot
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four
from synctrl.simulation.clock import make_clock
from synctrl.simulation.integrators import ADAPTIVE

ARM = load_robot("planar2r")
TIGHT = {"rtol": 1e-12, "atol": 1e-13}


def cubic_experiment(duration: float, disturbances=()) -> Experiment:
    """Two arms in joint space whose desired acceleration jumps at `duration`."""
    paths = ([0.0, 1.0], [0.6, 0.5]), ([1.0, 1.0], [0.5, 0.7])
    members = [
        Member(ARM, Cubic(*path, duration), theta_hat0=0.5 * ARM.inertial_parameters) for path in paths
    ]
    return Experiment(Cell(members, Coupling.pair()), SMALL_GAINS.replace(K_r=0.2), 0.96, disturbances)


def plain() -> Experiment:
    return Experiment(small_cell(), SMALL_GAINS, 0.96)


def pushed() -> Experiment:
    """A window of torque whose edges are no multiples of any step tried."""
    return Experiment(small_cell(), SMALL_GAINS, 0.96, [Disturbance(0, (0.3, -0.2), 0.1003, 0.2507)])


PROBLEMS = {
    "smooth": plain,
    "pushed between two steps": pushed,
    "a path that ends between two steps": lambda: cubic_experiment(0.50123),
    # 35 * 0.02 = 0.7000000000000001 and 70 * 0.01 = 0.7000000000000001
    "a path that ends a rounding beside a step": lambda: cubic_experiment(0.7),
    "everything": lambda: cubic_experiment(0.7, disturbances=[Disturbance(1, 0.4, 0.1003, 0.7001)]),
}


def difference(one, two) -> float:
    return max(np.abs(getattr(one, name) - getattr(two, name)).max() for name in ("q", "v"))


@pytest.mark.parametrize("problem", PROBLEMS)
def test_half_the_step_has_a_sixteenth_of_the_error(problem):
    experiment = PROBLEMS[problem]()
    reference = experiment.simulate(dt=0.02, integrator="DOP853", **TIGHT)
    errors = []
    for halvings in range(3):
        run = experiment.simulate(dt=0.02 / 2**halvings)
        every = 2**halvings
        errors.append(
            max(
                np.abs(getattr(run, k)[::every] - getattr(reference, k)).max()
                for k in ("q", "v", "theta_hat")
            )
        )
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert errors[-1] > 1e-11  # not lost in rounding
    assert ((orders > 3.5) & (orders < 4.7)).all(), (errors, orders)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_scipys_methods_agree_with_the_fixed_step(method):
    tolerances = {"RK23": (1e-7, 1e-9), "Radau": (1e-8, 1e-10), "BDF": (1e-8, 1e-10)}.get(
        method, (1e-10, 1e-12)
    )
    experiment = Experiment(small_cell(), SMALL_GAINS, 0.2, [Disturbance(0, 0.3, 0.05, 0.1)])
    adaptive = experiment.simulate(dt=0.01, integrator=method, rtol=tolerances[0], atol=tolerances[1])
    fixed = experiment.simulate(dt=0.001)
    np.testing.assert_array_equal(adaptive.t, fixed.t[::10])
    np.testing.assert_array_equal(adaptive.disturbance, fixed.disturbance[::10])
    loose = 3e-5 if method in ("RK23", "BDF", "Radau") else 1e-7
    assert np.abs(adaptive.q - fixed.q[::10]).max() < 0.1 * loose
    for name in ("v", "theta_hat", "sync_integral", "tracking_error"):
        np.testing.assert_allclose(getattr(adaptive, name), getattr(fixed, name)[::10], rtol=0, atol=loose)


@pytest.mark.parametrize("method", ["DOP853", "LSODA"])
def test_the_papers_four_arms_agree_through_the_push(method):
    experiment = planar_four(disturbance=Disturbance(0, 1.0, 0.05, 0.1))
    adaptive = experiment.simulate(duration=0.2, dt=0.01, integrator=method, rtol=1e-9, atol=1e-11)
    fixed = experiment.simulate(duration=0.2, dt=5e-4)
    assert np.abs(adaptive.tracking_error - fixed.tracking_error[::20]).max() < 1e-7
    assert np.abs(adaptive.theta_hat - fixed.theta_hat[::20]).max() < 1e-5


def test_stiff_friction_agrees_too():
    experiment = a460_pair()
    adaptive = experiment.simulate(duration=0.3, dt=0.01, integrator="LSODA", rtol=1e-9, atol=1e-11)
    fixed = experiment.simulate(duration=0.3, dt=1e-3)
    assert np.abs(adaptive.q - fixed.q[::10]).max() < 1e-6


def test_energy_without_torque_and_gravity_is_kept():
    # nothing is asked (gains next to nothing, nothing known): the arms coast
    still = Gains(Lambda=1e-9, beta=0.0, K_r=1e-12, K_eps=0.0, Gamma=0.0)
    members = [Member(ARM, Cubic([0.3, 1.0], [0.3, 1.0], 1.0), v0=[2.0, -3.0 + i]) for i in range(2)]
    experiment = Experiment(Cell(members, Coupling.pair()), still, 0.5)

    def drift(dt: float) -> float:
        run = experiment.simulate(dt=dt)
        assert np.abs(run.tau).max() < 1e-9
        energy = [0.5 * v @ ARM.mass_matrix(q) @ v for q, v in zip(run.q[:, 0], run.v[:, 0], strict=True)]
        return np.abs(np.array(energy) / energy[0] - 1).max()

    coarse, fine = drift(0.02), drift(0.01)
    assert coarse < 1e-5 and fine < coarse / 12


# -- the clock --------------------------------------------------------------------------------------------


@given(
    duration=st.floats(0.01, 10),
    steps=st.integers(1, 200),
    part=st.sampled_from([1.0, 0.37, 0.999]),
    edges=st.lists(st.floats(0, 12), max_size=4),
    breaks=st.lists(st.floats(0, 12), max_size=4),
)
def test_the_clock_lands_on_every_jump_and_logs_every_step(duration, steps, part, edges, breaks):
    dt = duration / max(1.0, steps - 1 + part)
    clock = make_clock(duration, dt, edges, breaks)
    assert clock.times[0] == clock.logged[0] == 0.0
    assert clock.times[-1] == clock.logged[-1] == pytest.approx(duration, rel=1e-9)
    assert (np.diff(clock.times) > 0).all() and (np.diff(clock.logged) > 0).all()
    assert set(clock.logged) <= set(clock.times) and set(clock.jumps) <= set(clock.times)
    assert set(clock.times) == set(clock.logged) | set(clock.jumps)
    np.testing.assert_allclose(
        clock.logged[:-1], np.arange(len(clock.logged) - 1) * dt, rtol=0, atol=1.1e-9 * dt
    )
    for instant in (*edges, *breaks):
        if 2e-9 * dt < instant < duration - 2e-9 * dt:
            assert np.abs(clock.times - instant).min() <= 1.1e-9 * dt
    for instant in breaks:
        if 0 < instant < clock.logged[-1]:
            near = np.sort(np.abs(np.array(breaks) - instant))[1:2]
            assert instant in clock.jumps or (near.size and near[0] <= 2e-9 * dt)


def test_a_rounding_beside_a_step_is_that_step():
    clock = make_clock(1.0, 0.1, edges=[0.3], breaks=[0.7])
    assert len(clock.times) == 11
    assert 0.7 in clock.logged  # although 7 * 0.1 is 0.7000000000000001
    assert 3 * 0.1 in clock.logged and 3 * 0.1 != 0.3
    np.testing.assert_array_equal(clock.jumps, [3 * 0.1, 0.7])


def test_disturbances_on_the_grid_do_not_move_it():
    plain, disturbed = make_clock(2.0, 1e-3, []), make_clock(2.0, 1e-3, [0.3, 0.7, 1.1, 1.9])
    np.testing.assert_array_equal(plain.times, disturbed.times)


def test_the_last_step_may_be_shorter():
    np.testing.assert_allclose(make_clock(1.0, 0.3, []).logged, [0, 0.3, 0.6, 0.9, 1.0], atol=1e-15)
    np.testing.assert_array_equal(make_clock(0.5, 0.5, []).logged, [0, 0.5])


@pytest.mark.parametrize(
    ("duration", "dt"),
    [(0.0, 0.1), (-1.0, 0.1), (1.0, 0.0), (1.0, -0.1), (1.0, 2.0), (np.nan, 0.1), (1.0, np.inf), (1.0, 1e-9)],
)
def test_steps_that_make_no_clock_are_refused(duration, dt):
    with refused(InputError) as caught:
        make_clock(duration, dt, [])
    assert caught.value.subject in ("duration", "dt")
