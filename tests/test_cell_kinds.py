"""Every kind of part that a cell file knows is written and read back to the same, and the schema knows it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from cell_variants import PARTS
from pydantic import TypeAdapter

from synctrl import (
    Attached,
    AxisRotation,
    CartesianSpace,
    Circle,
    Cubic,
    Damping,
    Disturbance,
    ExponentialApproach,
    Friction,
    Gains,
    Hold,
    JointSpace,
    Payload,
    PoseSpace,
    PoseTrajectory,
    Redundancy,
)
from synctrl.assembly.body import CarriedObject
from synctrl.assembly.grasp import Fixture, Grasp, Pin
from synctrl.assembly.outline import Outline
from synctrl.cells import STARTER, schema, toml
from synctrl.cells.controls import (
    ACTUATOR,
    ADAPTATION,
    ADMITTANCE,
    GAINS,
    LAW,
    NETWORK,
    OVERRIDE,
    RATES,
    SENSOR,
)
from synctrl.cells.couplings import GATE
from synctrl.cells.file import BY_PART, CellTable
from synctrl.cells.kinds import one_of
from synctrl.cells.making import Maker
from synctrl.cells.motions import EDGE, MOTION, ORIENTATIONS, PATH
from synctrl.cells.plants import (
    DAMPING,
    DISTURBANCE,
    FIXTURES,
    GRASP,
    LOAD,
    OBJECT,
    OUTLINE,
    PID,
    REDUNDANCY,
    SPACE,
)
from synctrl.cells.robots import FRICTION
from synctrl.cells.writing import Writer
from synctrl.control.adaptation import EModification, Gradient, Override, Paced, Sigma, Switching
from synctrl.control.admittance import Admittance
from synctrl.control.laws import MasterSlave, ShapeKeeping, SunMills
from synctrl.coupling.along_path import Gate
from synctrl.experiments.mobile_robot import WheelPath
from synctrl.simulation.held_joints import Pid
from synctrl.tasks.edge import AlongEdge, Edge
from synctrl.tasks.path import AlongPath
from synctrl.tasks.path import Path as Curve
from synctrl.tasks.poses import InPlane, SteadyAngle
from synctrl.tasks.sliding import Carrier, Rider, SlidingSpace
from synctrl.tasks.splines import Spline
from synctrl.tasks.swings import FigureEight, Sway, Swing
from synctrl.tasks.ways import Ramped, RampUp

TURN, HOLD = one_of(*ORIENTATIONS), one_of(*FIXTURES)
TIMES = np.linspace(0.0, 0.9, 7)
_U = np.linspace(0.0, 2 * np.pi, 60)
LINE = Curve(np.column_stack((np.linspace(0, 1, 9), np.linspace(0, 0.3, 9) ** 2, np.zeros(9))))
RIM = Edge(
    np.append(np.column_stack((0.2 * np.cos(_U), 0.1 * np.sin(_U)))[:-1], [[0.2, 0.0]], axis=0), 0.1, 0.002
)
BODY = PoseTrajectory(
    Swing((0.1, 0.2, 0.1), 2.0, 0.3), AxisRotation(np.eye(3), (0.3, 0.2, 1.0), Swing([0.5], 2.0))
)
FRAME = AlongEdge(RIM, RampUp(0.1, 0.3))
#: a motion of every kind
MOTIONS = [
    Hold((0.1, -0.2)),
    Cubic((0.0, 0.1), (0.3, 1 / 3), 0.7),
    ExponentialApproach((0.0, 0.1), (0.3, 0.2), 1.7),
    Circle((0.1, 0.2, 0.3), 0.1, -1.1, 0.3, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    FigureEight((0.1, 0.2), 0.1, 0.05, 1.3, 0.2),
    Spline((0.0, 0.3, 1.0), [(0.0, 1.0), (0.2, 0.4), (1.0, 0.1)]),
    Spline(np.linspace(0, 1, 8), np.sin(np.linspace(0, 1, 8))[:, None], "free"),
    Swing((0.1, 0.2), 3.0),
    Sway((0.1, 0.2), (0.3, 0.0), 1.1),
    RampUp(0.2, 0.5),
    Ramped(0.1, 0.4, 0.8, 0.1),
    SteadyAngle(0.7),
    AlongPath(LINE, Ramped(0.0, 0.9, 0.8, 0.1)),
    BODY,
    PoseTrajectory(AlongPath(LINE, RampUp(0.3, 0.2))),
    FRAME,
    Attached(BODY, (0.1, 0.0, 0.0)),
    InPlane(BODY, (0.1, 0.0, 0.0)),
    Carrier(BODY, FRAME),
    Rider(BODY, FRAME),
]


def _given(name: str) -> list[Any]:
    return [parts[name] for parts in PARTS if name in parts]


#: parts of other kinds that have a name, and what they may stand for
OTHERS = [
    (LINE, PATH.model), (RIM, EDGE.model), (AxisRotation(np.eye(3), (1.0, 1.0, 0.0), Hold([0.2])), TURN),
    (Gains([1.0, 2.0], 0.5, [[1.0], [2.0, 3.0]], 0.1, [0.3, 0.2], 0.4), GAINS.model),
    (Gains(1.0, 0.5, 2.0, 0.1), GAINS.model),
    (Friction((0.1, 0.2), 0.3, 0.02), FRICTION.model),
    (Payload(1, 0.4, (0.0, 0.1, 0.0), (0.1, 0.2, 0.15), "tip", 0.2, 0.4), LOAD.model),
    (Disturbance(1, (0.3, 0.4), 0.1, 0.7), DISTURBANCE.model),
    (Damping(0.03, 0.02), DAMPING.model),
    (Redundancy([0.1, 0.2], 3.0), REDUNDANCY.model),
    (Outline([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], 0.01), OUTLINE.model),
    (ShapeKeeping(), LAW),
    (JointSpace(), SPACE),
    (CartesianSpace("yx", 300.0), SPACE),
    (CartesianSpace("xyz", singularity=Damping(0.04, 0.03)), SPACE),
    (PoseSpace(redundancy=Redundancy([[0.1], [0.2, 0.3]], 2.0, [1.0, 2.0])), SPACE),
    (SlidingSpace(singularity="damped"), SPACE),
    (Gate(0.02, 0.1), GATE.model), (Admittance((1.0, 2.0), (3.0, 4.0)), ADMITTANCE.model),
    (Override(0.3, 0.02, 10.0), OVERRIDE.model),
    (CarriedObject(2.0, (0.1, 0.0, 0.0), None, box=(0.1, 0.2, 0.3), name="crate"), OBJECT.model),
    (CarriedObject(2.0, shape=Outline([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], 0.01)), OBJECT.model),
    (Fixture((2.0, 3.0), (4.0, 5.0)), HOLD), (Pin(3.0, 4.0), HOLD),
    (Grasp(1, (0.1, 0.0, 0.0), np.diag([1.0, -1.0, -1.0]), Pin(2.0, 1.0), 0.0, 2.0), GRASP.model),
    (Grasp(0, since=0.5), GRASP.model),
    (Pid((1.0, 2.0), 3.0, 4.0), PID.model),
    *((part, LAW) for part in (SunMills(), MasterSlave(1), *_given("law"))),
    *((part, ADAPTATION) for part in (Paced(Gradient(0.1), Override()), *_given("adaptation"))),
    *((part, one_of(*RATES)) for part in (Sigma(0.1), Switching(0.1, 2.0), EModification(0.3))),
    *((part, NETWORK) for part in _given("network")),
    *((part, SENSOR) for parts in _given("sensors") for part in parts),
    *((part, ACTUATOR) for parts in _given("actuators") for part in parts),
]  # fmt: skip
ALL = [*((motion, MOTION) for motion in MOTIONS), *OTHERS]


def told(part: Any) -> Any:
    """A part as a file says it, read by another reader of TOML."""
    return tomllib.loads(toml.document({"part": Writer(Path()).part(part, ())}))["part"]


def back(data: Any, kept: Any, folder: Path = Path()) -> Any:
    """The part that plain data stand for."""
    file = CellTable.model_validate(tomllib.loads(STARTER))
    return Maker(file, folder).part(TypeAdapter(kept).validate_python(data), ())


@pytest.mark.parametrize(
    ("part", "kept"), ALL, ids=[f"{type(part).__name__}-{k}" for k, (part, _) in enumerate(ALL)]
)
def test_a_part_is_told_and_made_again(part: Any, kept: Any) -> None:
    again = back(told(part), kept)
    assert type(again) is type(part)
    assert told(again) == told(part)
    if kept is MOTION:
        assert [row.tobytes() for row in again(TIMES)] == [row.tobytes() for row in part(TIMES)]
        assert again.breaks == part.breaks


def test_every_kind_of_part_is_among_them() -> None:
    assert {type(part) for part, _ in ALL} | {WheelPath} == set(BY_PART)


def test_the_schema_is_one_and_takes_the_starter() -> None:
    made = json.loads(json.dumps(schema()))
    jsonschema.Draft202012Validator.check_schema(made)
    jsonschema.Draft202012Validator(made).validate(tomllib.loads(STARTER))


@pytest.mark.parametrize(
    "change", [{"duration": "4"}, {"lenght": 1.0}, {"robots": 3}, {"law": {"kind": "new"}}]
)
def test_the_schema_refuses_what_the_reader_refuses(change: dict[str, Any]) -> None:
    judge = jsonschema.Draft202012Validator(schema())
    assert not judge.is_valid({**tomllib.loads(STARTER), **change})


def test_every_key_of_the_schema_says_what_it_means() -> None:
    tables = {"Cell": schema(), **schema()["$defs"]}
    silent = [
        f"{name}.{key}"
        for name, table in tables.items()
        for key, about in table.get("properties", {}).items()
        if key != "kind" and not about.get("description")
    ]
    assert not silent
