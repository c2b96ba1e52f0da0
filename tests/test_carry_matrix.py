"""Two arms with an object, and every law, way to learn, circumstance and plant that the package has."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from refusals import refused
from test_assembly import energies, rates_of_fixtures
from test_rigid import simpson

from synctrl import Cell, Coupling, Disturbance, Experiment, Gains, Hold, Member, Result, load_robot
from synctrl.analysis import Certificate, certify
from synctrl.assembly.body import CarriedObject, with_share
from synctrl.assembly.grasp import Fixture, Grasp
from synctrl.assembly.plant import CarryingPlant
from synctrl.assembly.theorems import THEOREMS
from synctrl.control.adaptation import (
    Ball,
    Box,
    Composite,
    EModification,
    Gradient,
    Guarded,
    Hedged,
    Leakage,
    Natural,
    Override,
    Paced,
    Switching,
)
from synctrl.control.laws import (
    ChungSlotine,
    ComputedTorque,
    MasterSlave,
    PDGravity,
    ShapeKeeping,
    SlotineLi,
    SunMills,
)
from synctrl.errors import InputError
from synctrl.experiments import carry_ur5
from synctrl.experiments.carry import GAINS
from synctrl.experiments.ur5_payload import payload_motion
from synctrl.tasks.poses import AxisRotation, PoseTrajectory

pytestmark = [
    pytest.mark.filterwarnings("ignore::synctrl.errors.GainWarning"),
    pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning"),
    pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning"),
]

GAMMA = GAINS.Gamma
#: how long, and in which steps, s
RUN = {"duration": 0.01, "dt": 4e-4}
PUSH = Disturbance(0, np.array([10.0, 10.0, 10.0, 0.0, 0.0, 0.0]), 0.003, 0.007)
#: what every run with fixtures has beside other reasons, as the certificate begins to say it
OBJECT = "an object that does not move as the hands do"


def checked(made: Experiment, **options) -> tuple[Result, Certificate]:
    """A run in which an object is carried, and what the proof says of it."""
    result = made.simulate(**{**RUN, **options})
    held = result.outputs
    assert result.status == "completed"
    assert all(np.isfinite(held[name]).all() for name in ("object_pose", "object_twist", "hand_wrench"))
    lifted = held["hand_wrench"][-1, :, 2].sum()
    assert 0 < lifted < 2 * 4.0 * 9.81  # it neither falls nor is thrown
    moved = np.linalg.norm(held["object_pose"][-1, :3] - held["object_pose"][0, :3])
    assert moved < 5e-3
    certificate = certify(result)
    record = certificate.lyapunov
    assert record.power.get("fixtures", np.zeros(1)).max() <= record.rounding.max()
    assert certificate.growth is None or certificate.outside
    return result, certificate


def reasons(certificate: Certificate) -> set[str]:
    """What is outside, each by its first words."""
    return {text.split(":")[0] for text in certificate.outside}


# -- laws -------------------------------------------------------------------------------------------------

#: laws, the number of the theorem that covers them, and what is outside beside the object
LAWS = {
    "the paper's": (SunMills(), 2, set()),
    "Slotine and Li's": (SlotineLi(), 2, set()),
    "computed torque": (
        ComputedTorque(),
        0,
        {"the law ComputedTorque in a closed chain", "the law ComputedTorque"},
    ),
    "a spring": (
        PDGravity(1000.0),
        0,
        {
            "the law PDGravity in a closed chain",
            "the law PDGravity",
            "the force of a law without a proof",
            "parameters that are wrong and not adapted",
        },
    ),
    "Chung and Slotine's": (ChungSlotine(1.0), 0, {"the law ChungSlotine in a closed chain"}),
    "master and slave": (
        MasterSlave(),
        0,
        {"the law MasterSlave in a closed chain", "the law MasterSlave"},
    ),
}


@pytest.mark.parametrize("name", LAWS)
def test_every_law_carries_and_the_certificate_says_whether_a_theorem_knows_it(name):
    law, number, outside = LAWS[name]
    _, certificate = checked(carry_ur5(law=law))
    assert certificate.theorem == THEOREMS[number]
    assert reasons(certificate) == {OBJECT, *outside}
    assert not (number and certificate.doubts)
    alone = f"law of robots that nothing connects: {law.statement}"
    assert alone in str(certificate)


def test_a_law_of_pins_is_refused_where_hands_hold_poses():
    with refused(InputError, "ShapeKeeping, space"):
        carry_ur5(law=ShapeKeeping(), synchronized=False, gains=GAINS.replace(K_eps=0.0)).closed_loop()


# -- adaptations ------------------------------------------------------------------------------------------

FIRST = carry_ur5().cell.theta_hat0
#: ways to learn, and their powers that the theorem does not know
LEARNING = {
    "gradient": (Gradient(GAMMA), set()),
    "leakage": (Leakage(GAMMA, 0.2), {"the adaptation's leakage"}),
    "leakage far away": (Leakage(GAMMA, Switching(0.2, 3.0)), set()),
    "leakage with speed": (Leakage(GAMMA, EModification(0.2)), {"the adaptation's leakage"}),
    "box": (Box(GAMMA, FIRST - 10, FIRST + 10), set()),
    "ball": (Ball(GAMMA, 30.0), set()),
    "natural": (Natural(0.05), set()),
    "composite": (Composite(GAMMA, 0.01, 20.0), {"the adaptation's prediction"}),
    "guarded": (Guarded(Ball(GAMMA, 30.0)), set()),
}


@pytest.mark.parametrize("name", LEARNING)
def test_every_adaptation_learns_while_it_carries_and_its_powers_are_named(name):
    adaptation, outside = LEARNING[name]
    result, certificate = checked(carry_ur5(adaptation=adaptation))
    assert np.abs(result.theta_hat[-1] - result.theta_hat[0]).max() > 0
    assert certificate.theorem == THEOREMS[2] and certificate.verdict == "bounded by Theorem A"
    assert reasons(certificate) == {OBJECT, *outside}


@pytest.mark.parametrize(
    ("adaptation", "subject"),
    [
        (Hedged(Ball(GAMMA, 30.0), 6.0), "space"),
        (Paced(Gradient(GAMMA), Override()), "UR5 1, trajectory"),
    ],
)
def test_adaptations_that_move_what_is_desired_are_refused_by_name(adaptation, subject):
    with refused(InputError, subject):
        carry_ur5(adaptation=adaptation)


# -- circumstances ----------------------------------------------------------------------------------------

#: options of the cell and of the run, the number of the theorem, and what is outside beside the object
CIRCUMSTANCES = {
    "friction": ({"friction": True}, {"dt": 2.5e-4}, 2, {"friction that the model does not contain"}),
    "a push": ({"disturbances": [PUSH]}, {}, 2, {"torque from outside"}),
    "limits": (
        {"saturate": True, "gains": GAINS.replace(K_r=12 * np.array(GAINS.K_r))},
        {"duration": 3e-3, "dt": 2.5e-4},
        2,
        {"torque that saturation takes away, for which no adaptation makes up while it lasts"},
    ),
    "samples": ({}, {"control_period": 2e-3}, 2, {"torque and adaptation are held for 0.002 s at a time"}),
    "a leak": ({"leak": True}, {}, 2, set()),
    "a tare": ({"geometric_error": True, "tare": True}, {}, 2, set()),
    "an admittance": ({"geometric_error": True, "admittance": True}, {}, 3, set()),
    "an admittance and samples": (
        {"geometric_error": True, "admittance": True},
        {"control_period": 2e-3},
        3,
        {"torque and adaptation are held for 0.002 s at a time"},
    ),
    "everything": (
        {"geometric_error": True, "friction": True, "tare": True, "admittance": True},
        {"dt": 2.5e-4},
        3,
        {"friction that the model does not contain"},
    ),
}


def carrying(options: dict) -> Experiment:
    own = {name: options[name] for name in ("saturate", "disturbances") if name in options}
    return replace(carry_ur5(**{n: v for n, v in options.items() if n not in own}), **own)


@pytest.mark.parametrize("name", CIRCUMSTANCES)
def test_in_every_circumstance_arms_carry_and_the_certificate_names_what_is_outside(name):
    options, run, number, outside = CIRCUMSTANCES[name]
    _, certificate = checked(carrying(options), **run)
    assert certificate.theorem == THEOREMS[number] and not certificate.doubts
    assert reasons(certificate) == {OBJECT, *outside}


@pytest.mark.parametrize("options", [{}, {"geometric_error": True, "admittance": True, "leak": True}])
def test_mujoco_carries_what_pinocchio_carries_and_the_same_theorem_covers_it(options):
    pytest.importorskip("mujoco", reason="MuJoCo is an extra: pip install 'synctrl[mujoco]'")
    (ours, one), (judged, other) = (checked(carry_ur5(**options), plant=p) for p in ("pinocchio", "mujoco"))
    assert one.theorem == other.theorem != THEOREMS[0]
    np.testing.assert_allclose(judged.outputs["object_pose"], ours.outputs["object_pose"], atol=1e-6)


@pytest.mark.parametrize(
    ("options", "number"),
    [
        ({}, 1),
        ({"leak": True}, 1),
        ({"synchronized": False}, 1),
        ({"law": SlotineLi()}, 1),
        ({"geometric_error": True, "tare": True}, 1),
        ({"geometric_error": True}, 0),
        ({"law": ChungSlotine(1.0)}, 0),
    ],
)
def test_v_never_grows_in_a_rigid_loop_where_the_first_theorem_says_so(options, number):
    """With a tare too, for then both arms are wrong by the same, and the geometry of the grasps is kept."""
    _, certificate = checked(carry_ur5(grasp="rigid", **options))
    record = certificate.lyapunov
    assert certificate.theorem == THEOREMS[number]
    if number:
        assert (np.diff(record.V) <= 0).all() and not certificate.doubts


@pytest.mark.parametrize("grasp", ["rigid", "compliant"])
@pytest.mark.parametrize("name", ["twice the weight", "a sum", "two motions"])
def test_no_theorem_covers_arms_that_are_not_compared_as_one_body(grasp, name):
    """Then epsilon does not vanish where the geometry of the grasps is kept."""
    made = carry_ur5(grasp=grasp)
    first, second = made.cell.members
    coupling = made.cell.coupling
    if name == "twice the weight":
        coupling = Coupling.pair((2.0, -1.0))
    elif name == "a sum":
        coupling = Coupling.sum(2)
    else:
        p, R = made.plant_type.keywords["at"]
        second = replace(second, trajectory=PoseTrajectory(Hold(p), AxisRotation.fixed(R)))
    found = replace(made, cell=Cell([first, second], coupling, made.cell.space)).closed_loop().chain
    assert found.theorem == THEOREMS[0] and found.energies is None and len(found.outside) == 1


# -- the compiled engine ----------------------------------------------------------------------------------


def two_arms(**parts) -> Experiment:
    """Two light arms with a plate, which take little time to compile."""
    arm = load_robot("planar2r")
    arms = arm.placed((-0.6, 0, 0), name="left"), arm.placed((0.6, 0, 0), (0, 0, np.pi), name="right")
    q0 = [1.2, -1.6], [-1.2, 1.6]
    hands = [robot.tip_pose(np.array(q)) for robot, q in zip(arms, q0, strict=True)]
    middle = 0.5 * (hands[0].translation + hands[1].translation)
    plate = CarriedObject(0.5, box=(0.43, 0.1, 0.02))
    grasps = [Grasp(i, compliance=Fixture((1e4, 20.0), (50.0, 0.1))) for i in range(2)]
    members = []
    for robot, hand, q in zip(arms, hands, q0, strict=True):
        d, R = hand.rotation.T @ (middle - hand.translation), hand.rotation.T
        loaded = with_share(robot, plate.parameters / 2, d, R)
        guess = 0.8 * loaded.inertial_parameters
        members.append(Member(loaded, Hold(np.array(q) + 0.02), q0=q, theta_hat0=guess))
    kept = {"body": plate, "grasps": grasps, "at": (middle, np.eye(3)), "robots": arms}
    plant = partial(CarryingPlant, **kept, desired=payload_motion())
    gains = Gains(8.0, 8.0, 2.0, 5.0, 0.1)
    cell = Cell(members, Coupling.pair())
    return Experiment(cell, **{"gains": gains, "duration": 0.02, "plant_type": plant, **parts})


ALONE = Gains(8.0, 0.0, 2.0, 0.0, 0.0)
#: laws and ways to learn that have not been seen to carry in both engines elsewhere
TOGETHER = {
    "natural": {"adaptation": Natural(0.05), "gains": Gains(8.0, 8.0, 2.0, 5.0, leak=3.0)},
    "Chung and Slotine's, composite": {
        "law": ChungSlotine(0.5),
        "adaptation": Composite(0.1, 0.01, 20.0),
        "gains": ALONE.replace(Gamma=None),
    },
    "Slotine and Li's, guarded": {
        "law": SlotineLi(),
        "adaptation": Guarded(Ball(0.1, 5.0)),
        "gains": ALONE.replace(Gamma=None),
    },
    "a spring": {"law": PDGravity(40.0), "gains": ALONE},
}


@pytest.mark.parametrize("name", TOGETHER)
def test_laws_and_ways_to_learn_carry_alike_in_both_engines(name):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    from test_compiled_plant import both  # which is skipped as a whole without CasADi

    runs = both(two_arms(**TOGETHER[name]), dt=2e-4)
    ours, compiled = (certify(run) for run in runs)
    assert ours.outside == compiled.outside and np.abs(runs[0].outputs["hand_wrench"]).max() > 1.0


# -- balances ---------------------------------------------------------------------------------------------


def test_energy_of_arms_object_and_fixtures_is_what_torque_friction_and_a_push_left_of_it():
    """Over a run, with joints that rub, of which the controller does not know."""
    push = replace(PUSH, start=0.0, stop=1.0)
    made = replace(carry_ur5(friction=True, geometric_error=True), disturbances=[push])
    plant, result = made.closed_loop().plant, made.simulate(0.01, dt=2.5e-4)
    hidden = result.outputs["plant_state"]
    rows = list(zip(result.q, result.v, hidden, strict=True))
    damped = [np.sum(plant.D * rates_of_fixtures(plant, *row) ** 2) for row in rows]
    friction = np.array([plant.friction(v) for v in result.v])
    torque = result.tau - friction
    torque[:, 0] += push.torque
    power = np.sum(torque * result.v, axis=(1, 2)) - damped
    change = energies(plant, *rows[-1]) - energies(plant, *rows[0])
    assert simpson(power, 2.5e-4) == pytest.approx(change, abs=1e-4 * np.abs(power).max() * 0.01)
