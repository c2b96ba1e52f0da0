"""A run knows when its step was too long, says which one does, and says nothing where the step is good."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from frozen import RUNS

from synctrl import Cell, Coupling, Cubic, Disturbance, Experiment, Friction, Member, load_robot
from synctrl.errors import SimulationError, StepWarning
from synctrl.simulation.step_error import BLOCK, LIMIT, StepError

ARM = load_robot("planar2r")
ENGINES = ("pinocchio", "compiled")


def rubbing(coulomb: float, smoothing: float = 0.01) -> Experiment:
    """Two planar arms in joint space on their way, with the same friction at every joint."""
    paths = ([0.0, 1.0], [1.5, -0.5]), ([0.5, 1.2], [-1.0, 0.3])
    friction = Friction(coulomb=coulomb, smoothing=smoothing)
    members = [Member(ARM, Cubic(*path, 0.3), friction=friction) for path in paths]
    return Experiment(Cell(members, Coupling.pair()), SMALL_GAINS.replace(K_r=2.0), 0.2)


def quiet(experiment: Experiment, **options):
    """A run without its warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)
        return experiment.simulate(**options)


def velocity_error(found, reference) -> float:
    """Largest difference at the instants both have, as a share of the largest velocity."""
    every = round(found.t[1] / reference.t[1])
    return np.abs(found.v - reference.v[::every]).max() / np.abs(reference.v).max()


def test_stiff_coulomb_friction_that_the_step_misses_is_told() -> None:
    experiment = rubbing(5.0)
    judge = experiment.simulate(dt=1e-3, integrator="LSODA", rtol=1e-8, atol=1e-10)
    with pytest.warns(StepWarning, match=r"dt = 0\.001 s is too long: .* joint \d of robot \d") as caught:
        found = experiment.simulate(dt=1e-3)
    assert caught[0].filename == __file__
    assert found.status == "completed"
    assert velocity_error(found, judge) > 1e-3
    report = found.info["step_error"]
    assert report["estimate"] > report["limit"] == LIMIT
    assert f"{report['advised_step']:g}" in str(caught[0].message)


def test_a_result_names_joint_and_time_of_the_worst_step_even_in_a_file(tmp_path) -> None:
    found = quiet(rubbing(5.0), dt=1e-3)
    report = found.info["step_error"]
    assert set(report) == {"estimate", "limit", "robot", "joint", "time", "advised_step"}
    assert report["robot"] in (0, 1) and report["joint"] in (0, 1) and 0 < report["time"] <= 0.2
    assert json.loads(json.dumps(report)) == report
    assert type(found).load(found.save(tmp_path / "run.npz")).info["step_error"] == report


@pytest.mark.parametrize("coulomb", [0.5, 2.0, 5.0])
@pytest.mark.parametrize("dt", [1e-3, 4e-3])
def test_the_advised_step_does(coulomb: float, dt: float) -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = rubbing(coulomb)
    advised = quiet(experiment, dt=dt, engine="compiled").info["step_error"]["advised_step"]
    assert advised < dt
    with warnings.catch_warnings():
        warnings.simplefilter("error", StepWarning)
        good = experiment.simulate(dt=advised, engine="compiled").info["step_error"]
    assert good["estimate"] <= LIMIT and good["advised_step"] is None


def test_for_sampled_control_the_advised_step_divides_the_period() -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment, options = rubbing(5.0), {"control_period": 2e-3, "engine": "compiled"}
    report = quiet(experiment, dt=1e-3, **options).info["step_error"]
    assert report["estimate"] > LIMIT
    count = 2e-3 / report["advised_step"]
    assert count == pytest.approx(round(count), rel=1e-12)
    good = experiment.simulate(dt=report["advised_step"], duration=0.1, **options)
    assert good.info["step_error"]["estimate"] <= LIMIT


@pytest.mark.parametrize("make", [lambda: Experiment(small_cell(), SMALL_GAINS, 0.1), lambda: rubbing(0.0)])
@pytest.mark.parametrize("options", [{}, {"control_period": 2e-3}])
def test_a_good_step_is_passed_over_in_silence(make, options) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", StepWarning)
        report = make().simulate(dt=1e-3, **options).info["step_error"]
    assert 0 < report["estimate"] < LIMIT and report["advised_step"] is None


@pytest.mark.parametrize("make", [lambda: Experiment(small_cell(), SMALL_GAINS, 0.24), lambda: rubbing(0.0)])
def test_the_estimate_falls_with_the_fourth_power_of_the_step(make) -> None:
    errors = [make().simulate(dt=dt).info["step_error"]["estimate"] for dt in (4e-3, 2e-3, 1e-3)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert ((orders > 3.5) & (orders < 5.0)).all()


def test_friction_that_sets_in_within_a_step_is_seen_by_the_rule_over_two_steps() -> None:
    """Both derivatives at the end of the first step are behind the jump: only Simpson's rule sees it."""
    experiment = rubbing(0.5, smoothing=1e-4)
    judge = experiment.simulate(dt=1e-3, integrator="LSODA", rtol=1e-8, atol=1e-10, duration=4e-3)
    found = quiet(experiment, dt=1e-3, duration=4e-3)
    assert velocity_error(found, judge) > 1e-3
    assert found.info["step_error"]["estimate"] > LIMIT


# -- where the right-hand side jumps -----------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("options", [{}, {"control_period": 4e-3}])
def test_jumps_are_no_errors(engine: str, options) -> None:
    """A push that begins and ends between steps, and a path that ends with an acceleration."""
    if engine == "compiled":
        pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    members = [Member(ARM, Cubic([0.0, 1.0], [0.02 + 0.01 * i, 0.97], 0.0607)) for i in range(2)]
    push = Disturbance(0, (0.5, -0.1), 0.0303, 0.0501)
    experiment = Experiment(Cell(members, Coupling.pair()), SMALL_GAINS, 0.1, [push])
    estimates = [
        experiment.simulate(dt=dt, engine=engine, **options).info["step_error"]["estimate"]
        for dt in (2e-3, 1e-3)
    ]
    assert max(estimates) < 1e-3 * LIMIT or estimates[1] < estimates[0] / 8


@pytest.mark.parametrize("engine", ENGINES)
def test_a_path_that_ends_with_the_run_is_no_error(engine: str) -> None:
    if engine == "compiled":
        pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    members = [Member(ARM, Cubic([0.0, 1.0], [0.02 + 0.01 * i, 0.97], 0.05)) for i in range(2)]
    ends, goes_on = (
        Experiment(Cell(members, Coupling.pair()), SMALL_GAINS, duration).simulate(dt=1e-3, engine=engine)
        for duration in (0.05, 0.06)
    )
    one, other = (run.info["step_error"]["estimate"] * np.abs(run.v).max() for run in (ends, goes_on))
    assert one <= other * (1 + 1e-9)


# -- all runs ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name, run in RUNS.items() if run.compiled])
def test_both_engines_find_the_same_error_on_every_ready_cell(name: str) -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    run = RUNS[name]
    options = {**run.options, "duration": min(run.options["duration"], 0.2)}
    one, other = (quiet(run.make(), engine=engine, **options).info["step_error"] for engine in ENGINES)
    assert abs(one["estimate"] - other["estimate"]) <= 1e-6 * max(one["estimate"], 1e-3 * LIMIT)
    if one["estimate"] > 1e-3 * LIMIT:  # below, rounding decides which step is the worst
        assert [one[k] for k in ("robot", "joint", "time")] == [other[k] for k in ("robot", "joint", "time")]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_that_stopped_has_its_estimate_too(engine: str) -> None:
    if engine == "compiled":
        pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = Experiment(small_cell(), SMALL_GAINS.replace(K_r=300.0), 0.5)
    with pytest.raises(SimulationError) as caught:
        experiment.simulate(dt=1e-3, engine=engine)
    report = caught.value.result.info["step_error"]
    assert LIMIT < report["estimate"] < np.inf and 0 < report["advised_step"] < 1e-3


def test_a_method_that_chooses_its_steps_has_none() -> None:
    found = Experiment(small_cell(), SMALL_GAINS, 0.02).simulate(dt=1e-3, integrator="DOP853")
    assert found.info["step_error"] is None


def test_where_nothing_moves_there_is_no_estimate() -> None:
    members = [Member(ARM, Cubic([0.0, 1.0], [0.0, 1.0], 1.0)) for _ in range(2)]
    report = Experiment(Cell(members, Coupling.pair()), SMALL_GAINS, 0.01).simulate().info["step_error"]
    assert (report["estimate"], report["robot"], report["advised_step"]) == (None, None, None)


def test_the_worst_of_many_steps_is_found_wherever_it_is() -> None:
    """Also at the borders of the blocks in which steps are looked at."""
    rng = np.random.default_rng(0)
    for at in (3, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK + 7):
        watch = StepError(2, 3)
        for k in range(2 * BLOCK + 20):
            gap = rng.uniform(0, 1, (2, 3))
            gap[1, 2] += 10.0 * (k == at)
            watch.add(0.1 * k, np.full((2, 3), -2.0), 0.06, gap)
        worst = watch.worst()
        assert worst is not None
        assert (worst.robot, worst.joint, worst.time) == (1, 2, pytest.approx(0.1 * at))
        assert 0.01 * 10 / 2 <= worst.estimate <= 0.01 * 11 / 2


def test_a_parabola_of_accelerations_is_no_error_and_a_corner_is() -> None:
    """Simpson's rule is exact for cubics, also from one block of steps to the next."""
    h, t = 0.01, 0.01 * np.arange(2 * BLOCK)

    def estimate(corner: int | None) -> float:
        watch = StepError(1, 1)
        for k, now in enumerate(t):
            late = 0.0 if corner is None or k <= corner else 5.0 * (k - corner - 0.5) * h
            v, a = now**3 - now + late, 3 * now**2 - 1 + (5.0 if late else 0.0)
            watch.add(now, np.array([[v]]), h if k else 0.0, np.zeros((1, 1)), np.array([[a]]))
        worst = watch.worst()
        return 0.0 if worst is None else worst.estimate * watch.speed

    assert estimate(None) < 1e-12
    for corner in (5, BLOCK - 2, BLOCK - 1, BLOCK):
        assert estimate(corner) > 0.1 * 5.0 * h
