"""Task spaces, and what is beside plain robots: objects that they carry, joints that others hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from ..assembly.bead import BeadPlant
from ..assembly.body import CarriedObject, Placed
from ..assembly.grasp import Fixture, Grasp, Pin
from ..assembly.handling import HandlingPlant
from ..assembly.judged import fixture_plant
from ..assembly.meeting import MeetingPlant
from ..assembly.outline import Outline
from ..assembly.pinned import PinnedPlant
from ..assembly.rigid import RigidPlant
from ..robots.payload import Payload
from ..robots.robot import Robot
from ..simulation.held_joints import HeldJointsPlant, Pid
from ..simulation.schedules import Disturbance
from ..tasks.pose import PoseSpace
from ..tasks.poses import PoseTrajectory
from ..tasks.redundancy import Damping, Redundancy
from ..tasks.sliding import SlidingSpace
from ..tasks.spaces import CartesianSpace, JointSpace
from .kinds import kind, one_of, table_or
from .motions import BODY
from .robots import ARM
from .values import (
    INERTIA,
    MATRIX,
    NUMBER,
    NUMBERS,
    ROBOT,
    ROTATION,
    TEXT,
    VECTOR,
    angles,
    choice,
    list_of,
    numbers,
)

# -- spaces ------------------------------------------------------------------------------------------------

DAMPING = kind("", Damping, threshold=NUMBER, largest=NUMBER)
REDUNDANCY = kind("", Redundancy, posture=angles(1, 2), gain=NUMBER, weights=numbers(0, 1, 2))


def _tips(space: Any) -> dict[str, Any]:
    """Keys of spaces of tips."""
    free, damped = space.redundancy, space.damping is not None
    plain = free.posture is None and free.weights is None and free.gain == 1.0
    return {
        "max_condition": None if damped else space.max_condition,
        "singularity": space.damping,
        "redundancy": None if plain else free,
    }


def _axes(space: CartesianSpace) -> dict[str, Any]:
    return {"axes": space.axes, **_tips(space)}


_TIPS: dict[str, Any] = {
    "max_condition": NUMBER,
    "singularity": table_or(DAMPING, choice("stop", "damped")),
    "redundancy": REDUNDANCY.model,
}
SPACES = (
    kind("joint", JointSpace),
    kind("cartesian", CartesianSpace, read=_axes, axes=TEXT, **_TIPS),
    kind("pose", PoseSpace, read=_tips, **_TIPS),
    kind("sliding", SlidingSpace, read=_tips, **_TIPS),
)
SPACE = one_of(*SPACES)

# -- disturbances and loads --------------------------------------------------------------------------------

DISTURBANCE = kind("", Disturbance, robot=ROBOT, torque=NUMBERS, start=NUMBER, stop=NUMBER)
LOAD = kind(
    "", Payload,
    robot=ROBOT, mass=NUMBER, com=VECTOR, inertia=INERTIA, frame=TEXT, start=NUMBER, stop=NUMBER,
)  # fmt: skip

# -- objects -----------------------------------------------------------------------------------------------


def _object(part: CarriedObject) -> dict[str, Any]:
    names = "mass", "com", "inertia", "box", "center", "name"
    shape = part.shape if isinstance(part.shape, Outline) else None
    return {**{name: getattr(part, name) for name in names}, "shape": shape}


def _pin(part: Pin) -> dict[str, Any]:
    return {"stiffness": part.stiffness[0], "damping": part.damping[0]}


OUTLINE = kind("", Outline, points=MATRIX, thickness=NUMBER)
OBJECT = kind(
    "", CarriedObject, read=_object,
    mass=NUMBER, com=VECTOR, inertia=INERTIA, box=VECTOR, center=VECTOR, name=TEXT, shape=OUTLINE.model,
)  # fmt: skip
FIXTURES = (
    kind("fixture", Fixture, stiffness=VECTOR, damping=VECTOR),
    kind("pin", Pin, read=_pin, stiffness=NUMBER, damping=NUMBER),
)
GRASP = kind(
    "", Grasp,
    robot=ROBOT, xyz=VECTOR, rotation=ROTATION, compliance=one_of(*FIXTURES), since=NUMBER, until=NUMBER,
)  # fmt: skip


def at(xyz: Any, rotation: Any) -> Placed:
    """A place and an orientation in the world.

    Args:
        xyz: the place, (3,), m.
        rotation: the orientation, a matrix or three angles about x, y, z in that order, rad.
    """
    return xyz, rotation


AT = kind("", None, at, xyz=VECTOR, rotation=ROTATION)

# -- plants ------------------------------------------------------------------------------------------------

MakesPlant = Callable[..., Any]


def held_joints(robots: Sequence[Robot], pid: Pid, at: Any = 0.0) -> MakesPlant:
    """Real robots with more joints than the controller knows; PID controllers hold the others.

    Args:
        robots: what really stands there, one per robot of the cell, all with as many held joints.
        pid: their controllers.
        at: where the joints are held, number or one per joint, rad.
    """
    return partial(HeldJointsPlant, robots=robots, pid=pid, at=at)


def carried(make: MakesPlant) -> MakesPlant:
    """A kind of plant in which hands carry an object.

    Args:
        make: the plant.
    """

    def plant(
        body: CarriedObject,
        grasps: Sequence[Grasp],
        at: Placed | None = None,
        robots: Sequence[Robot] | None = None,
        desired: PoseTrajectory | None = None,
    ) -> MakesPlant:
        """Robots that carry an object together.

        Args:
            body: the object.
            grasps: which robots hold it, where, and how their hands give.
            at: where the object is at t = 0; by default where its desired motion begins.
            robots: the robots without what their controllers take for their share of the object, one per
                robot of the cell; by default those of the cell.
            desired: the object's desired motion, for figures and for where it begins.
        """
        given = {"at": at, "robots": robots, "desired": desired}
        kept = {name: value for name, value in given.items() if value is not None}
        return partial(make, body=body, grasps=grasps, **kept)

    return plant


def bead(body: CarriedObject, carrier: int = 0, nozzle: int = 1) -> MakesPlant:
    """One robot carries a plate, another one lays a bead on its edge.

    Args:
        body: the plate.
        carrier, nozzle: the robots, by name or counted from 0.
    """
    return partial(BeadPlant, body=body, carrier=carrier, nozzle=nozzle)


def meeting(duration: float) -> MakesPlant:
    """Two robots lay beads on one path, from its ends until they meet.

    Args:
        duration: after which they have met, s.
    """
    return partial(MeetingPlant, duration=duration)


PID = kind("", Pid, P=NUMBERS, I=NUMBERS, D=NUMBERS)
_ARMS = list_of(ARM.model)
_CARRIED: dict[str, Any] = {
    "body": OBJECT.model,
    "grasps": list_of(GRASP.model),
    "at": AT.model,
    "robots": _ARMS,
    "desired": BODY,
}
#: what makes a plant, by the kind that it is in a file
CARRYING: Mapping[str, MakesPlant] = {
    "compliant": fixture_plant,
    "rigid": RigidPlant,
    "pinned": PinnedPlant,
    "handling": HandlingPlant,
}
HELD = kind("held-joints", None, held_joints, robots=_ARMS, pid=PID.model, at=NUMBERS)
BEAD = kind("bead", None, bead, body=OBJECT.model, carrier=ROBOT, nozzle=ROBOT)
MEETING = kind("meeting", None, meeting, duration=NUMBER)
PLANTS: Mapping[Any, Any] = {
    HeldJointsPlant: HELD,
    BeadPlant: BEAD,
    MeetingPlant: MEETING,
    **{make: kind(name, None, carried(make), **_CARRIED) for name, make in CARRYING.items()},
}
PLANT = one_of(*PLANTS.values())
KINDS = (
    DAMPING, REDUNDANCY, *SPACES, DISTURBANCE, LOAD, OUTLINE, OBJECT, *FIXTURES, GRASP, AT, PID,
    *PLANTS.values(),
)  # fmt: skip
