"""A run gone through again at many instants at once says what it says at one instant after another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from theory_cells import GAINS, coupling, experiment

from synctrl import Cell, Disturbance, Experiment, Friction, Network, Payload
from synctrl.analysis import certify
from synctrl.analysis.moment import Moment
from synctrl.analysis.replay import replay
from synctrl.analysis.stacked import Stack, in_blocks, stackable
from synctrl.control.adaptation import Gradient, Leakage
from synctrl.control.laws import ChungSlotine, PDGravity, SlotineLi, SunMills
from synctrl.experiments import panda_four, planar_four, ur5_payload
from synctrl.robots.parameters import FrictionParameters
from synctrl.simulation.closed_loop import ClosedLoop
from synctrl.simulation.plant import Plant
from synctrl.tasks.redundancy import Damping
from synctrl.tasks.spaces import CartesianSpace

pytestmark = [
    pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning"),  # odd rings are meant
    pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning"),
    pytest.mark.filterwarnings("ignore::synctrl.errors.GainWarning"),
    pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning"),
]
#: beside the largest entry of an array: what a sum in another order may change
ROUNDING = 1e-12
RUBS = Friction(0.5, 0.3, 0.1)
PUSH = Disturbance(robot=0, torque=2.0, start=0.011, stop=0.0205)


def full_metric() -> Gradient:
    """Rates that are no diagonals, one of them with a direction that is never learned."""
    A = np.random.default_rng(3).uniform(-0.1, 0.1, (4, 20, 19))
    return Gradient(list(A @ A.mT))


def adapted_friction() -> Experiment:
    made = experiment(coupling("ring", 4, 2), friction=RUBS)
    members = [
        replace(member, parameters=(known := FrictionParameters(member.robot, RUBS, armature=True)),
                theta_hat0=0.6 * known.theta)
        for member in made.cell.members
    ]  # fmt: skip
    return replace(made, cell=Cell(members, made.cell.coupling))


def mixed() -> Experiment:
    """Robots with different numbers of joints in one Cartesian task."""
    two, three = (
        experiment(coupling("pair", 2, 2), joints=k, cartesian=True).cell.members[0] for k in (2, 3)
    )
    members = replace(two, name="two"), replace(three, name="three")
    space = CartesianSpace("xy", singularity=Damping(0.3, 0.1))
    return Experiment(Cell(members, coupling("pair", 2, 2, "moving"), space), GAINS, 0.1)


alone = GAINS.replace(beta=0.0, K_eps=0.0)
CELLS = {
    "joint space, moving weights": lambda: experiment(coupling("ring", 4, 2, "moving")),
    "Cartesian space, K_r in the task": lambda: experiment(
        coupling("ring", 5, 2), cartesian=True, k_r_space="task", friction=RUBS
    ),
    "the paper's acceleration": lambda: experiment(
        coupling("ring", 3, 2, "moving"), reference_acceleration="paper"
    ),
    "integrals that leak": lambda: experiment(coupling("ring", 4, 2), GAINS.replace(leak=1.0)),
    "a full Gamma": lambda: experiment(
        coupling("ring", 4, 2), GAINS.replace(Gamma=None), adaptation=full_metric()
    ),
    "nothing learned": lambda: experiment(coupling("ring", 4, 2), GAINS.replace(Gamma=0.0)),
    "friction and rotors learned": adapted_friction,
    "pushed": lambda: experiment(coupling("ring", 4, 2), disturbances=(PUSH,)),
    "loads": lambda: replace(
        experiment(coupling("ring", 4, 2)), payloads=(Payload(1, 0.7, start=0.01, stop=0.0205),)
    ),
    "another law": lambda: experiment(coupling("ring", 4, 2), alone, law=ChungSlotine(0.5)),
    "no coupling": lambda: experiment(coupling("ring", 4, 2), alone, law=SlotineLi()),
    "a law without proof": lambda: experiment(coupling("ring", 4, 2), alone, law=PDGravity(3.0)),
    "injection": lambda: experiment(coupling("ring", 4, 2), law=SunMills(injection=True)),
    "robots of two kinds": mixed,
    "poses": ur5_payload,
    "arms with more joints than the task": panda_four,
}


def one_by_one(run, monkeypatch) -> Moment:
    with monkeypatch.context() as patched:
        patched.setattr("synctrl.analysis.replay.stackable", lambda loop: False)
        return replay(run).rows


@pytest.mark.parametrize("name", CELLS)
def test_many_instants_at_once_say_what_each_says_alone(name: str, monkeypatch) -> None:
    run = CELLS[name]().simulate(0.0305, 1e-3)
    again = replay(run)
    assert stackable(again.loop)
    for field, found, expected in zip(Moment._fields, again.rows, one_by_one(run, monkeypatch), strict=True):
        most = ROUNDING * np.abs(expected).max(initial=0.0)
        np.testing.assert_allclose(found, expected, rtol=0, atol=most, err_msg=field)


def test_blocks_of_any_size_say_the_same(monkeypatch) -> None:
    run = experiment(coupling("ring", 4, 2), disturbances=(PUSH,)).simulate(0.0305, 1e-3)
    whole = replay(run).rows
    monkeypatch.setattr("synctrl.analysis.stacked.ENTRIES", 7 * 4 * 2 * 20)
    assert Stack(run.experiment.closed_loop()).instants == 7
    for found, expected in zip(replay(run).rows, whole, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_a_certificate_is_the_same_in_words_and_numbers(monkeypatch) -> None:
    run = planar_four(disturbance="torque").simulate(0.3, 5e-4)
    found = certify(run)
    monkeypatch.setattr("synctrl.analysis.replay.stackable", lambda loop: False)
    alone = certify(run)
    assert (found.verdict, found.outside, found.doubts) == (alone.verdict, alone.outside, alone.doubts)
    for name, power in alone.lyapunov.power.items():
        np.testing.assert_allclose(
            found.lyapunov.power[name], power, rtol=0, atol=alone.lyapunov.rounding.max()
        )


class OwnPlant(Plant):
    pass


@pytest.mark.parametrize(
    "options",
    [
        {"network": Network(delay=0.01)},
        {"adaptation": Leakage(0.3, 2.0), "gains": GAINS.replace(Gamma=None)},
    ],
    ids=lambda options: next(iter(options)),
)
def test_parts_that_may_mind_an_axis_of_time_are_asked_instant_by_instant(options: dict) -> None:
    made = experiment(coupling("ring", 4, 2), **options)
    assert not stackable(made.closed_loop())


def test_neither_may_plants_of_ones_own_or_of_another_library() -> None:
    made = experiment(coupling("ring", 4, 2))
    controller = made.closed_loop().controller
    assert stackable(ClosedLoop(controller, Plant(made.cell)))
    assert not stackable(ClosedLoop(controller, OwnPlant(made.cell)))
    assert not stackable(ClosedLoop(controller, Plant(made.cell, physics="mujoco")))


@pytest.mark.parametrize("T", [1, 2, 3, 4, 7])
def test_blocks_have_every_instant_once(T: int) -> None:
    x, y = np.random.default_rng(T).normal(size=(2, T, 2, 3))
    buffer = np.empty((6, 3))

    def product(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert a.shape == (6, 3)
        return np.multiply(a, b, out=buffer), a.sum(axis=1)

    found, sums = in_blocks(product, 3, x, y)
    np.testing.assert_array_equal(found, x * y)
    np.testing.assert_array_equal(sums, x.sum(axis=2))
