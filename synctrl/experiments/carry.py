"""Two UR5 arms that really carry a payload: forces pass through it from hand to hand.

The cell, motion and hands are those of `ur5_payload`; here the payload has mass, and fixtures that give a
little connect it to the hands. Both arms are controlled at the payload's own frame, as each believes to hold
it, so that epsilon = 0 says exactly that the geometry of the grasps is kept. The load is learned: half of the
payload's ten parameters belongs to the last link of each arm. Everything here is our choice and not the
paper's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from ..assembly.body import CarriedObject, Placed
from ..assembly.carrier import carrier
from ..assembly.grasp import Fixture, Grasp
from ..assembly.holding import HoldingPlant
from ..assembly.judged import fixture_plant
from ..assembly.rigid import RigidPlant
from ..assembly.tare import tared
from ..checks import boolean, choice
from ..control.admittance import Admittance
from ..control.gains import Gains
from ..coupling.cell import Cell
from ..coupling.coupling import Coupling
from ..robots.friction import Friction
from ..robots.robot import Robot
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment
from ..tasks.pose import PoseSpace
from ..tasks.rotations import exp
from .parts import ControllerParts, error_of_geometry, giving_way, leaking, ready_experiment
from .ur5_payload import DURATION, POSTURE, facing_ur5, hand_on_payload, payload_motion
from .ur5_payload import GAINS as HANDS_ALONE

PAYLOAD = CarriedObject(
    4.0, (0.03, 0.01, 0.0), 4.0 / 12 * np.array([0.12**2 + 0.12**2, 0.4**2 + 0.12**2, 0.4**2 + 0.12**2]),
    box=(0.4, 0.12, 0.12), center=(0.0, 0.0, 0.0), name="payload",
)  # fmt: skip
#: error of the payload at the start, desired less actual: position, m, and rotation vector, rad
OFFSET = np.array([0.01, -0.01, 0.01, 0.03, 0.0, -0.02])
#: what the first estimates know of the half of the payload that each arm carries
SHARES_KNOWN = (0.8, 0.0)
#: what arm 1 believes of the object in its hand beside the truth: displacement, m, and rotation vector, rad
GEOMETRIC_ERROR = np.array([1e-3, 0.0, 0.0, 0.0, np.deg2rad(0.5), 0.0])
_RUBS = np.array([3.0, 3.0, 2.0, 0.5, 0.5, 0.5])
FRICTION = Friction(_RUBS, _RUBS, 0.01)
#: torque on joints 1 to 3 of arm 1, N·m, from 1 s to 1.5 s
PUSH = Disturbance(0, np.array([10.0, 10.0, 10.0, 0.0, 0.0, 0.0]), 1.0, 1.5)
LAST_LINK = (5.0, 0.3, 0.3, 0.3, *[0.03] * 6)
GAINS = HANDS_ALONE.replace(Gamma=np.array([*[0.3] * 40, *[0.03] * 10, *LAST_LINK]))


def carry_ur5(
    synchronized: bool = True,
    grasp: str | Fixture = "compliant",
    geometric_error: bool | ArrayLike = False,
    friction: bool = False,
    push: bool = False,
    leak: float | bool | None = None,
    tare: bool = False,
    admittance: bool | Admittance = False,
    gains: Gains | None = None,
    **parts: Unpack[ControllerParts],
) -> Experiment:
    """Two UR5 that carry a payload of 4 kg, in pose space, with epsilon = e_1 - e_2.

    Args:
        synchronized, gains, parts: see `ready_experiment`.
        grasp: "compliant" for the fixtures of the cell, "rigid" for none that gives, or a `Fixture`.
        geometric_error: whether arm 1 is wrong about where it holds the payload, by 1 mm and 0.5 deg, or by
            how much: displacement, m, and rotation vector, rad, (6,), in the payload's axes.
        friction: whether the joints rub, which the controller does not know.
        push: whether joints 1 to 3 of arm 1 are pushed for half a second.
        leak: of the integrals of epsilon, 1/s, see `Gains`; True for Lambda, which is the default with an
            admittance; without one it is 0.
        tare: whether both arms take over at closure where arm 1 believes the payload, see `tared`.
        admittance: whether the arms give way to the forces inside, as `Admittance()` does, or how.

    Raises:
        InputError: a value that is none of these.
    """
    boolean("friction", friction), boolean("push", push), boolean("tare", tare)
    fixture, kind = _held(grasp)
    grasps = [Grasp(i, *hand_on_payload(i), fixture) for i in range(2)]
    at, arms = _start_of_payload(), [facing_ur5(i) for i in range(2)]
    cell = _cell(arms, grasps, at, error_of_geometry(geometric_error, GEOMETRIC_ERROR), friction)
    cell, pushes = tared(cell) if tare else cell, [PUSH] * bool(push)
    yielding = giving_way(admittance, Admittance())
    made = ready_experiment(cell, DURATION, GAINS, gains, synchronized, parts, disturbances=pushes)
    plant = partial(kind, body=PAYLOAD, grasps=grasps, at=at, robots=arms, desired=payload_motion())
    forgetful = leaking(made.gains, yielding is not None if leak is None else leak)
    return replace(made, gains=forgetful, plant_type=plant, admittance=yielding)


def _held(grasp: str | Fixture) -> tuple[Fixture, Callable[..., HoldingPlant]]:
    """Fixtures, and what makes a plant that has them."""
    if isinstance(grasp, Fixture):
        return grasp, fixture_plant
    kinds: dict[str, Callable[..., HoldingPlant]] = {"compliant": fixture_plant, "rigid": RigidPlant}
    return Fixture(), kinds[choice("grasp", grasp, tuple(kinds))]


def _start_of_payload() -> Placed:
    desired = payload_motion()(0.0).x
    return desired[:3] - OFFSET[:3], exp(-OFFSET[3:]) @ exp(desired[3:])


def _cell(arms: list[Robot], grasps: list[Grasp], at: Placed, error: np.ndarray, friction: bool) -> Cell:
    """Both arms, of which the first is wrong by `error` about the payload in its hand."""
    rubs = FRICTION if friction else Friction()
    members = [
        carrier(
            arms[i], grasps[i], PAYLOAD, payload_motion(), POSTURE,
            at=at, known=SHARES_KNOWN[i], error=error * (i == 0),
        )
        for i in range(2)
    ]  # fmt: skip
    members = [replace(member, friction=rubs) for member in members]
    return Cell(members, Coupling.pair(), PoseSpace(), name="UR5 pair that carries a payload")
