"""What the plant does beside moving, in both engines: torque that is cut off, and payloads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from test_saturation import pair as saturating

from synctrl import Disturbance, Experiment, Payload, Result, Robot
from synctrl.compiled.known import check_known
from synctrl.compiled.program import Program
from synctrl.control.adaptation import Gradient
from synctrl.errors import InputError, SaturationWarning
from synctrl.experiments import a460_pair, planar_four, ur5_payload
from synctrl.simulation.plant import Plant
from synctrl.simulation.result import LAYOUT
from synctrl.simulation.schedules import PayloadSchedule

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

pytestmark = pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")

AGREEMENT = 1e-9
#: loads on and between steps of 1 ms, one over another, there from the start, kept to the end
LOADS = (
    Payload(0, 0.3),
    Payload(1, 0.2, start=0.02, stop=0.06),
    Payload(1, 0.1, (0.05, 0.0, 0.02), start=0.0403, stop=0.0707),
    Payload(0, 0.4, start=0.0555),
)
WAYS = {
    "continuous": {},
    "sampled": {"control_period": 3e-3},
    "thinned": {"log_dt": 0.01},
    "sampled and thinned": {"control_period": 2e-3, "log_dt": 4e-3},
}


def carrying(experiment: Experiment, *payloads: Payload) -> Experiment:
    return replace(experiment, payloads=payloads or LOADS)


def both(experiment: Experiment, **options) -> tuple[Result, Result]:
    """The same run by both engines, known to agree."""
    runs = experiment.simulate(**options), experiment.simulate(engine="compiled", **options)
    expected, found = ({**{n: getattr(r, n) for n in LAYOUT}, **r.outputs} for r in runs)
    assert expected.keys() == found.keys()
    for name, array in expected.items():
        scale = np.abs(array).max() + 1e-12
        assert np.abs(found[name] - array).max() <= AGREEMENT * scale, name
    estimates = [run.info["step_error"]["estimate"] for run in runs]
    assert estimates[1] == pytest.approx(estimates[0], rel=1e-3, abs=1e-9)
    return runs


@pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning")
@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_both_engines_cut_off_the_same_torque_and_say_so_alike(options):
    reference, compiled = both(saturating(way=60.0), dt=1e-3, **options)
    assert (reference.outputs["applied_torque"] != reference.tau).any()
    assert len(reference.info["saturation"]) == len(compiled.info["saturation"]) > 0
    for expected, found in zip(reference.info["saturation"], compiled.info["saturation"], strict=True):
        assert {**found, "largest": 0, "theta_hat": 0} == {**expected, "largest": 0, "theta_hat": 0}
        assert found["largest"] == pytest.approx(expected["largest"], rel=AGREEMENT)


def test_the_compiled_engine_warns_of_torque_that_it_cuts_off():
    with pytest.warns(SaturationWarning):
        saturating(way=60.0).simulate(engine="compiled")


def test_limits_that_are_not_reached_change_nothing_in_the_compiled_engine():
    gentle = [saturating(way=0.01, K_r=0.1, saturate=cut) for cut in (True, False)]
    cut, free = (experiment.simulate(engine="compiled") for experiment in gentle)
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(cut, name), getattr(free, name))


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize("make", [planar_four, a460_pair, ur5_payload])
def test_both_engines_carry_the_same_payloads(make, options):
    reference, _ = both(carrying(make()), duration=0.1, dt=1e-3, **options)
    free = make().simulate(duration=0.1, dt=1e-3, **options)
    assert np.abs(reference.q - free.q).max() > 1e-6


@pytest.mark.parametrize("edge", [0.05, 0.05 + 1e-13, 0.0501, 0.0599])
def test_the_edge_of_a_payload_acts_from_its_instant_on_in_both_engines(edge):
    run, _ = both(carrying(a460_pair(), Payload(0, 1.0, start=edge)), duration=0.1, dt=1e-3)
    free = a460_pair().simulate(duration=0.1, dt=1e-3)
    before = run.t <= edge
    np.testing.assert_array_equal(run.q[before], free.q[before])
    assert (run.v[~before][0, 0] != free.v[~before][0, 0]).any()


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_payloads_saturation_and_disturbances_act_together_in_both_engines(options):
    """With edges on steps and samples, and between them."""
    pushes = Disturbance(2, 0.4, 0.02, 0.06), Disturbance(0, 0.3, 0.0303, 0.0507)
    experiment = replace(carrying(planar_four(disturbance=pushes)), saturate=True)
    run, _ = both(experiment, duration=0.1, dt=1e-3, **options)
    assert (run.disturbance[:, 2] != 0).any()


def other(cell, **options) -> Plant:
    """Robots that stand elsewhere than the controller knows, are shorter, and heavier."""
    robots = []
    for robot in cell.robots:
        model = pin.Model(robot.model)
        model.jointPlacements[2].translation *= 0.98
        shorter = Robot(model, robot.tip).placed((0.01, 0.02, 0.0), (0.0, 0.0, 0.02))
        robots.append(shorter.with_parameters(1.1 * robot.inertial_parameters))
    return Plant(cell, robots=robots, **options)


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_both_engines_have_plants_of_other_robots_than_the_controller_knows(options):
    experiment = replace(carrying(planar_four()), plant_type=other)
    run, _ = both(experiment, duration=0.1, dt=1e-3, **options)
    known = carrying(planar_four()).simulate(duration=0.1, dt=1e-3, **options)
    assert np.abs(run.q - known.q).max() > 1e-6


def test_payloads_need_no_new_code():
    libraries: dict = {}
    plain = planar_four(adaptation=Gradient(0.1))  # not in a ball, whose radius is part of the code
    for experiment in (planar_four(), carrying(planar_four()), replace(plain, saturate=True)):
        Program(experiment.closed_loop(), libraries)
    assert len(libraries) == 1


def test_a_schedule_of_another_kind_is_refused_by_name():
    class Mine(PayloadSchedule):
        pass

    loop = planar_four().closed_loop()
    loop.plant.schedule = Mine(loop.cell.robots, LOADS)
    with refused(InputError, "schedule of payloads", found=f"{Mine.__module__}.{Mine.__qualname__}"):
        check_known(loop)
