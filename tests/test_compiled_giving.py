"""Arms that give way to forces inside what they hold, in the compiled engine: the same runs, or a refusal."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from faults import check_fault, empty_cache, row, sources_of
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused
from test_compiled_carry import PUSH, mixed
from test_compiled_plant import WAYS, both

from synctrl import Cell, Coupling, Experiment, Friction, FrictionParameters, Gains, Hold, Member
from synctrl.assembly.body import place_of
from synctrl.assembly.grasp import grasp_matrix
from synctrl.assembly.handling import HandlingPlant
from synctrl.compiled.carrying import _shares, felt_at_origin
from synctrl.compiled.known import check_known
from synctrl.compiled.program import Program
from synctrl.control.adaptation import Box, Natural
from synctrl.control.admittance import Admittance, BoundAdmittance
from synctrl.errors import InputError
from synctrl.experiments import carry_ur5
from synctrl.robots.catalog import load_robot
from synctrl.tasks.rotations import log

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

pytestmark = [
    pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning"),
    pytest.mark.filterwarnings("ignore::synctrl.errors.GainWarning"),
]
SEEDS = st.integers(0, 2**32 - 1)
#: light, so that arms give way by what can be seen within a few steps
LIGHT = Admittance((5.0, 0.2), (300.0, 9.0))

GAINS = Gains(6.0, 6.0, 20.0, 50.0, 0.1, leak=6.0)


def giving(admittance: Admittance = LIGHT, **options) -> Experiment:
    return carry_ur5(geometric_error=True, friction=True, tare=True, admittance=admittance, **options)


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_two_ur5_give_way_alike_in_both_engines(options):
    run, _ = both(replace(giving(), disturbances=[PUSH]), duration=0.03, dt=1e-3, **options)
    assert np.abs(run.outputs["admittance"][-1]).max() > 1e-4


def test_arms_without_a_mass_give_way_alike():
    massless = Admittance((0.0, 0.2), (300.0, 9.0))
    run, _ = both(giving(massless), duration=0.02, dt=1e-3)
    assert np.abs(run.outputs["admittance"][-1, :, :3]).max() > 1e-4


def box(experiment: Experiment) -> Box:
    """So narrow that estimates are at its walls soon."""
    first = experiment.cell.theta_hat0
    return Box(0.3, first - 1e-4, first + 1e-4)


ADAPTATIONS = {"settles": box, "leaps": lambda _: Natural(0.01)}


@pytest.mark.parametrize("options", [WAYS["continuous"], WAYS["sampled"]], ids=["continuous", "sampled"])
@pytest.mark.parametrize("adaptation", ADAPTATIONS.values(), ids=ADAPTATIONS)
def test_adaptations_that_settle_or_leap_do_so_beside_what_gives_way(adaptation, options):
    experiment = giving()
    gains = experiment.gains.replace(Gamma=None)
    other = replace(experiment, gains=gains, adaptation=adaptation(experiment))
    run, _ = both(other, duration=0.01, dt=1e-3, **options)
    assert np.abs(run.theta_hat[-1] - run.theta_hat[0]).max() > 1e-6


def three() -> Experiment:
    """A pair of which one arm learns its friction too, and a third arm that holds nothing."""
    experiment = giving()
    first, second = experiment.cell.members
    rubbing = FrictionParameters(second.robot, second.friction)
    learning = replace(second, parameters=rubbing, theta_hat0=None)
    arm = load_robot("ur5").placed((0.0, 1.5, 0.0))
    q = np.array([0.0, -1.5, 2.0, -0.5, 1.5, 0.0])
    tip = arm.tip_pose(q)
    still = Member(arm, Hold(np.append(tip.translation + 0.01, log(tip.rotation))), q, friction=Friction(1.0))
    cell = Cell([first, learning, still], Coupling.chain(3), experiment.cell.space)
    kept = experiment.plant_type
    plant = partial(kept.func, **{**kept.keywords, "robots": [*kept.keywords["robots"], arm]})
    return replace(experiment, cell=cell, gains=GAINS, plant_type=plant)


def test_arms_that_learn_otherwise_or_hold_nothing_are_beside_those_that_give_way():
    """The state of what gives way stands behind the longest state of an adaptation."""
    run, _ = both(three(), duration=0.01, dt=1e-3)
    y = np.abs(run.outputs["admittance"][-1]).max(axis=1)
    assert y[0] > 0 and y[1] > 0 and y[2] == 0


def test_arms_give_way_alike_while_hands_close_and_open():
    """Where but one hand holds the object there is no force inside: arms are slowed down by dampers alone."""
    experiment = giving()
    kept = experiment.plant_type.keywords
    windows = ({"until": 0.008}, {"until": 0.005}, {"since": 0.012, "xyz": None, "rotation": None})
    grasps = [replace(kept["grasps"][i], **window) for i, window in zip((0, 1, 1), windows, strict=True)]
    plant = partial(HandlingPlant, **{**kept, "grasps": grasps})
    run, _ = both(replace(experiment, plant_type=plant), duration=0.015, dt=1e-3)
    y_dot = run.outputs["adaptation_state"][..., -6:]
    slowing = np.exp(-1e-3 * LIGHT.damping / LIGHT.mass).repeat(3)
    alone = slice(6, 13), slice(5, 12)  # from one hand's opening to its closing again
    np.testing.assert_allclose(y_dot[alone[0]], slowing * y_dot[alone[1]], rtol=1e-6)
    assert np.abs(y_dot[5]).max() > 1e-4 and np.abs(y_dot[-1]).max() > 0


# -- the split of forces ----------------------------------------------------------------------------------


@settings(max_examples=20)
@given(SEEDS)
def test_what_a_hand_feels_is_what_the_plant_says_wherever_the_object_is(seed):
    """Part by part in the object's axes, with the sum of all wrenches, and nothing of other hands."""
    rng, plant = np.random.default_rng(seed), mixed().closed_loop().plant
    q, v = rng.normal(size=(2, *plant.cell.v0.shape))
    body = rng.normal(size=13)
    wrenches = np.zeros((plant.cell.n, 6))
    levers = plant.arms @ place_of(body[:7])[1].T
    wrenches[plant._hands] = np.matvec(grasp_matrix(levers), plant._wrenches(q, v, body)[0])
    lift, expected, shares = wrenches.sum(axis=0), plant.felt(q, v, body), _shares(plant)
    np.testing.assert_allclose(shares.sum(axis=0).reshape(6, 6), np.eye(6), atol=1e-12)
    for felt, wrench, share in zip(expected, wrenches, shares, strict=True):
        found = felt_at_origin(wrench, share, lift, body)
        np.testing.assert_allclose(found, felt, rtol=0, atol=1e-11 * np.abs(wrenches).max())


# -- the code ---------------------------------------------------------------------------------------------


def test_other_masses_and_dampings_and_none_need_no_new_code():
    libraries: dict = {}
    for admittance in (LIGHT, Admittance(), Admittance((0.0, 0.0))):
        Program(giving(admittance).closed_loop(), libraries)
    assert len(libraries) == 1


#: faults of the lists before the driver and of the driver: a text, and what stands in its place
FAULTS = {
    "another hand's share": row("share", "gives*36"),
    "forces of a moment ago": ("    if (c->o) feel(c, a);\n    command(", "    command("),
    "another robot's force": row("felt", "gives*6"),
}


@pytest.fixture(scope="module")
def sources():
    return sources_of(giving().closed_loop())


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_in_what_gives_way_is_found(name, sources, monkeypatch, tmp_path):
    empty_cache(monkeypatch, tmp_path)
    check_fault(giving().closed_loop(), sources, FAULTS[name], monkeypatch)


# -- what is refused --------------------------------------------------------------------------------------


class Yielding(Admittance):
    """One that gives way otherwise than the package's own."""

    def bind(self, cell, adaptation, network):
        class Bound(BoundAdmittance):
            pass

        return Bound(adaptation, np.repeat(self.mass, 3), np.repeat(self.damping, 3))


def test_another_admittance_than_the_packages_own_is_refused_by_name():
    with refused(InputError, "admittance") as caught:
        check_known(giving(Yielding()).closed_loop())
    assert caught.value.found.startswith(f"{__name__}.Yielding")
