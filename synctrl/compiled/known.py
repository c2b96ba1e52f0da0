"""Is every part of a closed loop one that generated code computes? If not, the part is refused by name.

The compiled engine does not call Python objects, it runs equations that were traced before. It may do so only
for objects of exactly the package's own types, with exactly their methods: what else a user has plugged in is
refused by name, even a subclass that changes nothing of importance, for else it would silently run as its
base. Laws and adaptations of a user's own are not refused here: their equations are traced when they are met,
see `plugged.py`. Desired motions, weights and disturbances may be anything: they are called,
and tabulated.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import cache
from types import FunctionType, MethodType
from typing import Any, NamedTuple

import numpy as np

from ..assembly import grasp
from ..assembly.body import CarriedObject
from ..assembly.handling import BODY, GRIPS, HandlingPlant
from ..assembly.plant import CarryingPlant
from ..control import law
from ..control.adaptation.gradient import BoundGradient
from ..control.admittance import BoundAdmittance
from ..control.controller import Controller
from ..control.gains import Gains
from ..control.laws.sun_mills import BoundDiffusion, BoundSunMills
from ..control.network import Messages
from ..coupling.cell import Cell
from ..coupling.coupling import Coupling
from ..errors import InputError
from ..robots.base_parameters import BaseParameters
from ..robots.parameters import FrictionParameters, FullParameters, LinearParameters
from ..robots.robot import Robot
from ..simulation.closed_loop import ClosedLoop
from ..simulation.plant import Plant
from ..simulation.schedules import PayloadSchedule
from ..tasks import algebra, rotations
from ..tasks.measurement import Tips
from ..tasks.pose import BoundPoseSpace, PoseSpace
from ..tasks.redundancy import DampedInverse, Inverse, Pseudoinverse, Redundancy
from ..tasks.sliding import BoundSlidingSpace, SlidingSpace
from ..tasks.spaces import BoundCartesianSpace, BoundJointSpace, CartesianSpace, JointSpace
from .hearing import parts_of
from .plugged import learner

SPACES = (JointSpace, CartesianSpace, PoseSpace, SlidingSpace)
BOUND = (BoundJointSpace, BoundCartesianSpace, BoundPoseSpace, BoundSlidingSpace)
RIGID = (FullParameters, LinearParameters, BaseParameters)
INVERSES = (Inverse, Pseudoinverse, DampedInverse)
#: plants, before those that they are made from
PLANTS = (HandlingPlant, CarryingPlant, Plant)
#: numbers of a grip in the state of a plant
GRIP = 8
#: what a plant may say of a run, or refuse before it, without moving otherwise for it
TELLS = frozenset({"outputs", "report", "account", "chain", "_checked"})
#: what of a plant only arms that give way ask for
FELT = frozenset({"felt", "_inside"})
COMPILED_BEFORE = "its equations were compiled before"
#: modules whose functions the parts of a closed loop call, beside those of their own
LINES = (law, algebra, rotations, grasp)


class Part(NamedTuple):
    """A part of a closed loop: what it is, the object, and the types that generated code stands for."""

    role: str
    value: Any
    known: tuple[type, ...]


def check_known(loop: ClosedLoop) -> None:
    """Refuse a closed loop with a part that generated code does not stand for.

    Args:
        loop: controller and plant of a cell.

    Raises:
        InputError: naming the part, its class, and the way out.
    """
    for part in _parts(loop):
        _check_type(part)
        _check_own_methods(part)
    _check_controller(loop.controller)
    _check_plant(loop)


def check_untouched(loop: ClosedLoop) -> None:
    """Refuse to compile, or to take from the cache, what somebody has exchanged in the package itself.

    Raises:
        InputError: naming the method or function, what was put in its place, and the way out.
    """
    for kind in {type(part.value) for part in _parts(loop)}:
        _check_class(kind)
    for role, function, module in _functions(loop):
        if not _belongs(function, module):
            raise _replaced(role, function)


# -- internals --------------------------------------------------------------------------------------------


def _parts(loop: ClosedLoop) -> Iterator[Part]:
    controller, cell = loop.controller, loop.controller.cell
    task: Any = cell.task
    yield Part("closed loop", loop, (ClosedLoop,))
    beside = TELLS if controller.admittance else TELLS | FELT
    yield Part("plant", loop.plant, (_moved_as(loop.plant, beside), *PLANTS))
    if isinstance(loop.plant, CarryingPlant):
        yield from _held(loop.plant)
    yield Part("schedule of payloads", loop.plant.schedule, (PayloadSchedule,))
    yield Part("controller", controller, (Controller,))
    if isinstance(controller.law, (BoundSunMills, BoundDiffusion)):  # others are traced
        yield Part("law", controller.law, (BoundSunMills,))
    yield from (Part(*part) for part in parts_of(controller.network))
    yield Part("messages", loop.messages, (Messages,))
    learns = learner(controller)
    if isinstance(learns, BoundGradient):  # others are traced
        yield Part("adaptation", learns, (BoundGradient,))
    if controller.admittance is not None:
        yield Part("admittance", controller.admittance, (BoundAdmittance,))
    yield Part("gains", controller.gains, (Gains,))
    yield Part("cell", cell, (Cell,))
    yield Part("coupling", cell.coupling, (Coupling,))
    yield Part("space", cell.space, SPACES)
    yield Part("space bound to the robots", task, BOUND)
    if not isinstance(cell.space, JointSpace):
        space: Any = cell.space
        yield Part("redundancy", space.redundancy, (Redundancy,))
        yield Part("tips of the robots", task._tips, (Tips,))
        yield Part("way from the task to the joints", task._inverse, INVERSES)
        if task._inverse.algebra is not algebra.LAPACK:
            raise _replaced("linear algebra of the way to the joints", task._inverse.algebra)
    for name, robot, parameters in zip(cell.names, cell.robots, cell.parameters, strict=True):
        yield Part(f"model of {name}", robot, (Robot,))
        yield Part(f"parameters of {name}", parameters, (*RIGID, FrictionParameters))
        if type(parameters) is FrictionParameters:
            yield Part(f"parameters of {name} without friction", parameters.base, RIGID)
    for name, robot in zip(cell.names, loop.plant.schedule.free, strict=True):
        yield Part(f"true model of {name}", robot, (Robot,))


def _held(plant: CarryingPlant) -> Iterator[Part]:
    """Parts of a plant that carries an object."""
    yield Part("object", plant.body, (CarriedObject,))
    yield Part("true tips of the robots", plant._tips, (Tips,))


def _functions(loop: ClosedLoop) -> Iterator[tuple[str, Any, str]]:
    """Functions that generated code was traced from: role, function, and the module it was found in."""
    bases = {base for part in _parts(loop) for base in type(part.value).__mro__}
    ours = {base.__module__ for base in bases if _is_ours(base.__module__)}
    for module in sorted(ours | {lines.__name__ for lines in LINES}):
        for name, function in vars(sys.modules[module]).items():
            if callable(function) and name[0].islower() and not isinstance(function, type):
                yield f"function '{name}' of {module}", function, module


def _belongs(function: Any, module: str) -> bool:
    """Whether a function is of this module, or was imported into it from another of ours or of Python's."""
    home = _home(function)
    if home == module:
        return True
    imported = _is_ours(home) and getattr(sys.modules.get(home), function.__name__, None) is function
    return imported or home.partition(".")[0] in sys.stdlib_module_names


def _home(function: Any) -> str:
    """The module in which a function was written: unlike its `__module__`, wrappers do not copy it."""
    if hasattr(function, "cache_info"):  # kept results: the function is inside
        return _home(function.__wrapped__)
    return str(getattr(function, "__globals__", {}).get("__name__", ""))


def _is_ours(module: str) -> bool:
    return module.partition(".")[0] == __name__.partition(".")[0]


def _check_type(part: Part) -> None:
    if type(part.value) not in part.known:
        names = ", ".join(known.__name__ for known in part.known)
        name = _name(type(part.value))
        raise _refusal(part.role, name, f"{name}, only {names} and no subclass: {COMPILED_BEFORE}")


def _moved_as(plant: Any, tells: frozenset[str]) -> type:
    """The type of a plant that the package's own moves, of whatever else it tells; else the package's own."""
    own = next((kind for kind in PLANTS if isinstance(plant, kind)), Plant)
    kinds = type(plant).__mro__
    beside = kinds[: kinds.index(own)] if own in kinds else kinds
    changed = {name for kind in beside for name in vars(kind)}.intersection(_names_of(own)) - tells
    return own if changed else type(plant)


@cache
def _names_of(plant: type) -> frozenset[str]:
    """What a plant of the package is made of, without what Python puts into every class."""
    inner = "__", "_abc_"
    return frozenset(name for kind in plant.__mro__ for name in vars(kind) if not name.startswith(inner))


def _check_own_methods(part: Part) -> None:
    """Refuse an object that has a method of its own in place of its class's."""
    kind: Any = type(part.value)
    own = vars(part.value)
    for name in sorted(_methods(kind).intersection(own)):
        raise _replaced(f"{part.role}, {kind.__name__}.{name}", own[name])


def _check_class(kind: type) -> None:
    """Refuse a class of the package into which somebody has put another method."""
    for base in kind.__mro__[:-1]:
        for name, value in vars(base).items():
            function = _unwrapped(value)
            if (
                callable(function)
                and not isinstance(function, type)
                and _home(function) != base.__module__
                and (name == "__call__" or not name.startswith("__"))
            ):
                raise _replaced(f"{base.__name__}.{name}", function)


def _check_controller(controller: Controller) -> None:
    """Refuse a controller whose parts no longer say what it does: it made some of them into others."""
    learns = learner(controller)
    if any(hasattr(learns, part) for part in ("shift", "pace")):
        raise _refusal("adaptation", _name(learns), "an adaptation that moves the desired motion")
    own = [part for part in (controller, controller.law) if isinstance(part, (Controller, BoundSunMills))]
    for name in ("Lambda", "beta", "K_eps", "leak"):
        then = np.broadcast_to(getattr(controller.gains, name), (controller.cell.m,))
        if not all(np.array_equal(getattr(part, name), then) for part in own):
            what = f"a controller whose {name} was changed after its law was made of it"
            raise _refusal(f"controller, {name}", None, f"{what} (make another one of changed gains)")


def _check_plant(loop: ClosedLoop) -> None:
    plant = loop.plant
    robots = [*zip(plant.schedule.free, loop.cell.robots, strict=True)]
    special = {
        f"plant='{plant.physics}'": plant.physics != "pinocchio",
        "a plant with a state of its own": plant.hidden0.size != _remembered(plant),
        "a plant with other robots than its schedule": plant.robots is not plant.schedule.robots[0],
        "a plant with events": len(plant.events) > 0 and not isinstance(plant, HandlingPlant),
        "a plant with other joints than the cell's": any(true.nv != known.nv for true, known in robots),
        "a plant with another gravity than the cell's": not all(
            np.array_equal(true.gravity_vector, known.gravity_vector) for true, known in robots
        ),
        "other torque limits than those that the controller knows": not np.array_equal(
            plant.torque_limits, loop.controller.torque_limits
        ),
    }
    for name in (name for name, found in special.items() if found):
        raise _refusal("plant", name, name)


def _remembered(plant: Plant) -> int:
    """How many numbers a plant of the package has for a state of its own."""
    body = BODY.stop * isinstance(plant, CarryingPlant)
    return GRIPS.start + GRIP * len(plant.grasps) if isinstance(plant, HandlingPlant) else body


def _replaced(role: str, function: Any) -> InputError:
    name = _name(function)
    return _refusal(role, name, f"{name} in its place: {COMPILED_BEFORE}")


def _refusal(role: str, found: str | None, what: str) -> InputError:
    message = f"engine='compiled' does not have {what}; use engine='pinocchio'"
    return InputError(message, subject=role, found=found)


def _name(thing: Any) -> str:
    """What a class or function is called, with its module."""
    kind = thing if hasattr(thing, "__qualname__") else type(thing)
    return f"{kind.__module__}.{kind.__qualname__}"


@cache
def _methods(kind: Any) -> frozenset[str]:
    """Names of the methods and computed attributes of a class, without those that are kept once computed."""
    return frozenset(
        name
        for name in dir(kind)
        if isinstance(getattr(kind, name, None), (FunctionType, MethodType, property))
    )


def _unwrapped(method: Any) -> Any:
    """The function of a method."""
    return getattr(method, "fget", None) or getattr(method, "__func__", method)
