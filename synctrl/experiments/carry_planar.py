"""Four planar arms that carry a plate at pins: forces pass through it, and no moment.

Each arm is told where its own pin should be. There are no weights with an inverse by which eps = 0 would say
that the plate is not deformed, so differences of errors also resist when the plate turns. `ShapeKeeping` is
the law that knows the difference. Each arm learns a quarter of the plate as a mass at its pin. All of this is
our choice and not the paper's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from ..assembly.body import CarriedObject, with_share
from ..assembly.grasp import Grasp, Pin
from ..assembly.pinned import PinnedPlant
from ..assembly.tare import tared_places
from ..checks import boolean, choice
from ..control.admittance import Admittance
from ..control.gains import Gains
from ..control.laws import ShapeKeeping
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..robots.catalog import load_robot
from ..robots.friction import Friction
from ..robots.robot import Robot
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment
from ..tasks.inverse_kinematics import inverse_kinematics
from ..tasks.poses import AxisRotation, InPlane, PoseTrajectory
from ..tasks.rotations import exp
from ..tasks.spaces import CartesianSpace
from ..tasks.swings import Sway
from .parts import ControllerParts, error_of_geometry, giving_way, leaking, ready_experiment

MASS, EDGE = 2.0, 0.24  # kg, m
_IZZ = 2 / 6 * EDGE**2  # kg·m^2
PLATE = CarriedObject(
    MASS, (0.02, -0.01, 0.0), (_IZZ / 2, _IZZ / 2, _IZZ),
    box=(EDGE, EDGE, 0.01), center=(0.0, 0.0, 0.0), name="plate",
)  # fmt: skip
CORNERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
BASES, PINS = 0.45 * CORNERS, 0.12 * CORNERS  # m
SWING, TURN, SPEED = (0.06, 0.04), 0.15, 2 * np.pi / 3  # m, rad, rad/s
#: error of the plate at the start, desired less actual: position, m, and angle, rad
OFFSET, TURNED = np.array([0.01, -0.005, 0.0]), 0.03
#: what the first estimates know of the arms, and of the quarter of the plate at each pin
ARMS_KNOWN, SHARES_KNOWN = 0.8, (1.0, 1.0, 1.0, 0.0)
#: where each arm believes its pin on the plate beside the truth, m
GEOMETRIC_ERROR = 1e-3 * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.7, -0.7]])
FRICTION = Friction(0.05, 0.05, 0.01)
PUSH = Disturbance(0, (1.0, 1.0), 1.0, 1.25)
PIN = Pin(1e5, 100.0)
GAINS = Gains(Lambda=10.0, beta=20.0, K_r=0.5, K_eps=20.0, Gamma=0.5)
DURATION = 4.0  # s
#: without a mass; the second numbers, against turning, have no part in it
ADMITTANCE = Admittance(mass=(0.0, 0.0), damping=(200.0, 200.0))
SPACE = CartesianSpace("xy")


def carry_planar(
    synchronized: bool = True,
    grasp: str | Pin = "compliant",
    geometric_error: bool | ArrayLike = False,
    friction: bool = False,
    push: bool = False,
    leak: float | bool | None = None,
    tare: bool = False,
    admittance: bool | Admittance = False,
    gains: Gains | None = None,
    **parts: Unpack[ControllerParts],
) -> Experiment:
    """Four arms with two joints each that carry a plate of 2 kg, with epsilon_k = e_k - e_(k+1) in a ring.

    Args:
        synchronized, gains, parts: see `ready_experiment`; with `law=ShapeKeeping()`, which has no place for
            them, the gains of the cell leave out K_eps and a leak.
        grasp: "compliant" for the pins of the cell, or a `Pin`.
        geometric_error: whether the arms are wrong about where their pins are on the plate, by about 1 mm, or
            by how much, (4, 2), m, in the plate's axes.
        friction: whether the joints rub, which the controller does not know.
        push: whether both joints of arm 1 are pushed for a quarter of a second.
        leak: of the integrals of epsilon, 1/s, see `Gains`; True for Lambda, which is the default with an
            admittance; without one it is 0.
        tare: whether all arms take over at closure where their beliefs together put the plate, see
            `tared_places`.
        admittance: whether the arms give way to the forces inside, as `ADMITTANCE` does, or how.

    Raises:
        InputError: a value that is none of these.
    """
    boolean("friction", friction), boolean("push", push), boolean("tare", tare)
    arms = [load_robot("planar2r").placed((*BASES[i], 0.0), name=f"arm {i + 1}") for i in range(4)]
    cell = _cell(arms, _places(geometric_error, tare), FRICTION if friction else Friction())
    shape, yielding = isinstance(parts.get("law"), ShapeKeeping), giving_way(admittance, ADMITTANCE)
    default, pushes = GAINS.replace(K_eps=0.0) if shape else GAINS, [PUSH] * bool(push)
    made = ready_experiment(cell, DURATION, default, gains, synchronized, parts, disturbances=pushes)
    gains = leaking(made.gains, yielding is not None and not shape if leak is None else leak)
    return replace(made, gains=gains, plant_type=_plant(arms, grasp), admittance=yielding)


def plate_motion() -> PoseTrajectory:
    """Desired motion of the plate: to and fro along x, away and back along y while it turns."""
    way = Sway([SWING[0], 0.0, 0.0], [0.0, SWING[1], 0.0], SPEED)
    return PoseTrajectory(way, AxisRotation(np.eye(3), (0, 0, 1), Sway([0.0], [TURN], SPEED)))


def _places(given: bool | ArrayLike, tare: bool) -> np.ndarray:
    """Where the arms believe their pins on the plate, (4, 2), m."""
    places = PINS + error_of_geometry(given, GEOMETRIC_ERROR)
    return tared_places(places, _start_of_pins()) if tare else places


def _cell(arms: list[Robot], places: np.ndarray, friction: Friction) -> Cell:
    members = [_member(arm, i, places[i], friction) for i, arm in enumerate(arms)]
    return Cell(members, Coupling.signed_ring(4), SPACE, name="four planar arms that carry a plate")


def _start_of_plate() -> tuple[np.ndarray, np.ndarray]:
    return -OFFSET, exp(np.array([0.0, 0.0, -TURNED]))


def _start_of_pins() -> np.ndarray:
    """Where the pins are when the hands close, (4, 2), m."""
    p, R = _start_of_plate()
    return p[:2] + PINS @ R[:2, :2].T


def _member(arm: Robot, i: int, place: np.ndarray, friction: Friction) -> Member:
    """An arm controlled at its pin, with a quarter of the plate's mass there, at a place that it believes."""
    quarter = np.array([MASS / 4, *[0.0] * 9])
    loaded = with_share(arm, quarter, np.zeros(3), np.eye(3))
    pin = _start_of_pins()[i]
    heading = np.arctan2(*(pin - BASES[i])[::-1])
    q0 = inverse_kinematics(arm, pin, np.array([heading - 0.7, 1.4]), SPACE)
    known = ARMS_KNOWN * arm.inertial_parameters
    share = SHARES_KNOWN[i] * (loaded.inertial_parameters - arm.inertial_parameters)
    motion = InPlane(plate_motion(), (*place, 0.0))
    return Member(loaded, motion, q0, theta_hat0=known + share, friction=friction, name=arm.name)


def _plant(arms: list[Robot], grasp: str | Pin) -> Callable[..., PinnedPlant]:
    grasps = [Grasp(i, (*PINS[i], 0.0), compliance=_pin(grasp)) for i in range(4)]
    kept: dict[str, Any] = {"body": PLATE, "grasps": grasps, "at": _start_of_plate(), "robots": arms}
    return partial(PinnedPlant, **kept, desired=plate_motion())


def _pin(grasp: str | Pin) -> Pin:
    if not isinstance(grasp, Pin):
        choice("grasp", grasp, ("compliant",))
        return PIN
    return grasp
