"""The whole of a cell file, as pydantic checks it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field

from . import controls, couplings, holding, motions, plants, robots
from .kinds import Kind, make_table
from .values import (
    ANGLES,
    NUMBER,
    NUMBERS,
    POSITIVE,
    TEXT,
    TRUTH,
    VECTOR,
    VELOCITIES,
    by_name,
    choice,
    list_of,
)

#: version of the form of these files
FORM = "1"

_Key = tuple[Any, Any]


def _key(kept: Any, meaning: str, default: Any = ...) -> _Key:
    return kept, Field(default, description=meaning)


def _optional(kept: Any, meaning: str) -> _Key:
    return _key(kept, meaning, None)


def _listed(kept: Any, meaning: str) -> _Key:
    return _key(list_of(kept), meaning, [])


def _named(kept: Any, meaning: str) -> _Key:
    return _key(by_name(kept), meaning, {})


#: what is said of a robot beside the robot itself
MEMBER: dict[str, Any] = {
    "name": _optional(TEXT, "of the robot, for legends and messages"),
    "motion": _optional(motions.MOTION, "desired motion in the cell's space, unless it `holds` an object"),
    "holds": _optional(holding.HOLDS.model, "its share of the object in [plant] that it carries with others"),
    "q0": _optional(ANGLES, "joint positions at t = 0, rad; by default on the path"),
    "v0": _optional(
        VELOCITIES, 'joint velocities at t = 0, rad/s, or "path", as fast as it; by default at rest'
    ),
    "parameters": _optional(robots.PARAMETERS, 'what is adapted; by default "full"'),
    "known": _optional(NUMBER, "share of the true parameters with which the estimate begins"),
    "estimate": _optional(VECTOR, "the estimate at t = 0, in the place of `known`; by default zeros"),
    "friction": _optional(
        robots.RUBS, 'friction of the joints, "none", or "urdf" for what the description states'
    ),
}
#: arguments of `Experiment.simulate`
RUN: dict[str, Any] = {
    "dt": _key(POSITIVE, 'step of "rk4", s', 1e-3),
    "integrator": _key(TEXT, '"rk4", or one of SciPy\'s methods', "rk4"),
    "engine": _key(choice("pinocchio", "compiled"), "what computes the run", "pinocchio"),
    "plant": _key(choice("pinocchio", "mujoco"), "library that computes the plant", "pinocchio"),
    "control_period": _optional(POSITIVE, "how long torque is held, s; by default control is continuous"),
    "log_dt": _optional(POSITIVE, "interval of the log, s; by default dt"),
    "log_dtype": _key(choice("float64", "float32"), "of the numbers of the log", "float64"),
    "rtol": _key(POSITIVE, "relative tolerance of SciPy's methods", 1e-9),
    "atol": _key(POSITIVE, "absolute tolerance of SciPy's methods", 1e-11),
}


RobotTable = make_table("Robot", "A robot of the cell and its desired motion.", MEMBER, robots.ARM.model)
RunTable = make_table("Run", "How the cell is run unless told otherwise.", RUN)
#: parts of an experiment, in the order in which they are written
PARTS: dict[str, Any] = {
    "robots": _key(list_of(RobotTable), "the robots, at least two"),
    "motions": _named(motions.MOTION, "motions to which robots and others refer by name"),
    "paths": _named(motions.PATH.model, "paths to which motions refer by name"),
    "coupling": _key(couplings.COUPLING, "which robots are compared, and how"),
    "gains": _key(controls.GAINS.model, "gains of the controller"),
    "law": _optional(controls.LAW, 'from errors to motion and force; by default "sun-mills"'),
    "adaptation": _optional(controls.ADAPTATION, "how it learns; by default with gains.Gamma, eq. (14)"),
    "network": _optional(controls.NETWORK, 'what robots know of each other; by default "ideal"'),
    "admittance": _optional(controls.ADMITTANCE.model, "how robots give way to forces inside"),
    "sensors": _listed(controls.SENSOR, "what is between joints and controller, in order"),
    "actuators": _listed(controls.ACTUATOR, "what is between controller and joints, in order"),
    "disturbances": _listed(plants.DISTURBANCE.model, "torques from outside"),
    "loads": _listed(plants.LOAD.model, "what robots pick up and put down, untold"),
    "plant": _optional(plants.PLANT, "what there is beside plain robots, such as an object"),
    "run": _optional(RunTable, "how it is run unless told otherwise"),
}
VALUES: dict[str, Any] = {
    "form": _optional(choice(FORM), "version of this form of files"),
    "name": _key(TEXT, "of the cell, for titles", "cell"),
    "title": _optional(TEXT, "of the experiment, for figures and files; by default the name"),
    "duration": _key(NUMBER, "how long it runs unless told otherwise, s"),
    "space": _optional(
        plants.SPACE, 'where the task is given: "joint" by default, "cartesian", "pose" or "sliding"'
    ),
    "clocks": _optional(NUMBERS, "how much the clock of every robot is ahead, s"),
    "saturate": _key(TRUTH, "whether torques are cut off at the robots' limits", False),
    "reference_acceleration": _optional(choice("exact", "paper"), 'option of the law "sun-mills"'),
    "k_r_space": _optional(choice("joint", "task"), "where the damping K_r acts"),
}
CellTable = make_table("Cell", "A cell with its controller and what disturbs it.", {**VALUES, **PARTS})

KINDS: tuple[Kind, ...] = (
    *motions.KINDS, *robots.KINDS, *couplings.KINDS, *controls.KINDS, *plants.KINDS, holding.HOLDS,
)  # fmt: skip
#: the kind of every table, by its type
BY_TABLE: Mapping[type, Kind] = {each.model: each for each in KINDS}
#: the kind of every part that has one, by the part's type
BY_PART: Mapping[Any, Kind] = {each.target: each for each in KINDS if each.target is not None}
