"""Desired motions in cell files."""

from __future__ import annotations

from typing import Any

from ..experiments.mobile_robot import WheelPath
from ..tasks.edge import AlongEdge, Edge
from ..tasks.path import AlongPath, Path
from ..tasks.poses import Attached, AxisRotation, InPlane, PoseTrajectory, SteadyAngle
from ..tasks.sliding import Carrier, Rider
from ..tasks.splines import ENDS, Spline
from ..tasks.swings import FigureEight, Sway, Swing
from ..tasks.trajectories import Circle, Cubic, ExponentialApproach, Hold
from ..tasks.ways import Ramped, RampUp
from .kinds import kind, one_of, table_or
from .samples import samples
from .values import (
    ANGLE,
    ANGLE_ROWS,
    ANGLES,
    FILE,
    INTEGER,
    MATRIX,
    MOTION_NAME,
    NUMBER,
    PATH_NAME,
    ROTATION,
    VECTOR,
    angles,
    choice,
)


def _held(part: Hold) -> dict[str, Any]:
    return {"position": part.start}


def _turned(part: AxisRotation) -> dict[str, Any]:
    return {"start": part.start, "axis": part.given_axis, "angle": part.angle}


_POINTS: dict[str, Any] = {"start": ANGLES, "end": ANGLES}
_AXES: dict[str, Any] = {"first": VECTOR, "second": VECTOR}
_ROUND: dict[str, Any] = {"speed": ANGLE, "phase": ANGLE, **_AXES}

PATH = kind("", Path, points=MATRIX, up=VECTOR)
EDGE = kind("", Edge, points=MATRIX, tilt=ANGLE, stand_off=NUMBER)

#: motions of any numbers
BASIC = (
    kind("hold", Hold, read=_held, position=ANGLES),
    kind("cubic", Cubic, **_POINTS, duration=NUMBER),
    kind("exponential", ExponentialApproach, **_POINTS, rate=NUMBER),
    kind("circle", Circle, center=VECTOR, radius=NUMBER, **_ROUND),
    kind("figure-eight", FigureEight, center=VECTOR, along=NUMBER, across=NUMBER, **_ROUND),
    kind("spline", Spline, times=VECTOR, points=ANGLE_ROWS, ends=choice(*ENDS)),
    kind("samples", None, samples, file=FILE, ends=choice(*ENDS)),
    kind("swing", Swing, amplitude=ANGLES, period=NUMBER, offset=angles(0, 1)),
    kind("sway", Sway, to=ANGLES, away=ANGLES, speed=ANGLE),
    kind("ramp-up", RampUp, speed=NUMBER, ramp=NUMBER),
    kind("ramp", Ramped, start=NUMBER, end=NUMBER, duration=NUMBER, ramp=NUMBER),
    kind("steady-angle", SteadyAngle, speed=ANGLE),
    kind("wheel", WheelPath, wheel=INTEGER),
)
WAY = one_of(*BASIC, named=MOTION_NAME)
ALONG_PATH = kind("along-path", AlongPath, path=table_or(PATH, PATH_NAME), way=WAY)
POSITION = one_of(*BASIC, ALONG_PATH, named=MOTION_NAME)

ORIENTATIONS = (
    kind("axis", AxisRotation, read=_turned, start=ROTATION, axis=VECTOR, angle=WAY),
    kind("fixed", None, AxisRotation.fixed, orientation=ROTATION),
    kind("between", None, AxisRotation.between, start=ROTATION, end=ROTATION, duration=NUMBER),
    kind("steady", None, AxisRotation.steady, start=ROTATION, axis=VECTOR, speed=ANGLE),
)
BODIES = (
    kind("pose", PoseTrajectory, position=POSITION, orientation=one_of(*ORIENTATIONS)),
    kind("along-edge", AlongEdge, edge=EDGE.model, way=WAY),
)
BODY = one_of(*BODIES, named=MOTION_NAME)
#: motions of what moves on a body, or carries it
ON_BODIES = (
    kind("attached", Attached, body=BODY, xyz=VECTOR, rotation=ROTATION),
    kind("in-plane", InPlane, body=BODY, xyz=VECTOR),
    kind("carrier", Carrier, body=BODY, frame=BODY),
    kind("rider", Rider, body=BODY, frame=BODY),
)
MOTIONS = (*BASIC, ALONG_PATH, *BODIES, *ON_BODIES)
MOTION = one_of(*MOTIONS, named=MOTION_NAME)
KINDS = (PATH, EDGE, *MOTIONS, *ORIENTATIONS)
