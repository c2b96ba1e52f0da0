"""Whatever parts of an assembly are given that they cannot be made of, they refuse, and say what it was."""

import re
from collections.abc import Callable
from functools import cache, partial
from itertools import chain
from typing import Any

import numpy as np
import pytest

from synctrl import Cell, Coupling, Hold, Member, PoseTrajectory, load_robot
from synctrl.assembly.bead import BeadPlant
from synctrl.assembly.body import CarriedObject, with_share
from synctrl.assembly.carrier import carrier
from synctrl.assembly.grasp import Fixture, Grasp, Pin
from synctrl.assembly.handling import HandlingPlant
from synctrl.assembly.meeting import MeetingPlant
from synctrl.assembly.outline import Outline
from synctrl.assembly.pinned import PinnedPlant
from synctrl.assembly.plant import CarryingPlant
from synctrl.assembly.rigid import RigidPlant
from synctrl.assembly.tare import tared
from synctrl.control.adaptation import Gradient, Override, Paced
from synctrl.control.admittance import Admittance
from synctrl.coupling.along_path import Gate, PathWeights
from synctrl.errors import SynctrlError
from synctrl.experiments import bead_on_edge, bead_on_path, carry_planar, carry_ur5
from synctrl.tasks.edge import AlongEdge, Edge
from synctrl.tasks.path import AlongPath, Path
from synctrl.tasks.sliding import Carrier, Rider
from synctrl.tasks.ways import Ramped as ToRest
from synctrl.tasks.ways import RampUp as ToSpeed

NAN, INF, EYE, ZERO = np.nan, np.inf, np.eye(3), np.zeros(3)
#: none of these is a part, and only `None` may stand for a default
NO_PART = "x", 1.5, NAN, True, [], {}, object(), np.zeros(0), CarriedObject, lambda t: t
#: none of these is one number
NO_NUMBER = (
    "1",
    b"1",
    NAN,
    INF,
    -INF,
    True,
    1j,
    [],
    {},
    [1.0, 2.0],
    np.zeros(0),
    np.datetime64("2020"),
    10**400,
)
NOT_POSITIVE = (*NO_NUMBER, None, 0, -1.0)
#: none of these is a place
NO_PLACE = (
    "abc",
    NAN,
    True,
    [],
    {},
    [[1], [2, 3]],
    [0, 0, NAN],
    [0, 0, INF],
    [[0, 0, 0]],
    ["0", "0", "0"],
    10**400,
)
NO_ROTATION = (*NO_PLACE, 2 * EYE, -EYE, EYE[:2], EYE * NAN)
NO_FLAG = "x", 1, None, NAN

u = np.linspace(0, 2 * np.pi, 60)
CIRCLE = 0.1 * np.column_stack((np.cos(u), np.sin(u)))
CIRCLE[-1] = CIRCLE[0]
LINE = np.linspace((0, 0, 0), (0.5, 0, 0), 20)
TRIANGLE = [(0, 0), (1, 0), (0, 1)]
BODY = CarriedObject(1.0)
STILL = PoseTrajectory(Hold((0.4, 0.0, 0.4)))

Case = tuple[str, Callable[[], Any]]


def bad(make: Callable[..., Any], good: dict[str, Any] | None = None, **values: Any) -> list[Case]:
    """For every argument one case per bad value, all others being good."""
    name = getattr(make, "__qualname__", "")
    return [
        (f"{name}-{argument}-{k}", partial(make, **{**(good or {}), argument: value}))
        for argument, some in values.items()
        for k, value in enumerate(some)
    ]


@cache
def path() -> Path:
    return Path(LINE)


@cache
def edge() -> Edge:
    return Edge(CIRCLE)


def motions() -> list[AlongPath]:
    return [AlongPath(path(), ToRest(0.0, 0.2, 1.0, 0.1)), AlongPath(path(), ToRest(0.5, 0.3, 1.0, 0.1))]


@cache
def pair() -> Cell:
    arms = (load_robot("planar2r").placed((side, 0, 0)) for side in (-0.6, 0.6))
    return Cell([Member(arm, Hold((0.5, 0.5))) for arm in arms], Coupling.pair())


def things() -> list[Case]:
    return [
        *bad(
            CarriedObject,
            {"mass": 1.0},
            mass=(*NOT_POSITIVE, 1e308),
            com=(*NO_PLACE, None, (1e300, 0, 0)),
            inertia=(*NO_PLACE, -EYE, 0 * EYE, (1, 1, 3)),
            shape=(*NO_PLACE, (1, 1, 0), Outline),
            box=(*NO_PLACE, (1, 1, -1)),
            center=NO_PLACE,
            name=(*NO_FLAG[1:], "a\nb", "x" * 2000),
        ),
        *bad(
            Outline,
            {"points": TRIANGLE, "thickness": 0.1},
            points=(
                *NO_PLACE,
                None,
                TRIANGLE[:2],
                3 * TRIANGLE[:1],
                [(0, 0), (1, 0), (2, 0)],
                [*TRIANGLE, (1, 0)],
                [(0, 0), (1, 1), (1, 0), (0, 1)],
                [(1e308, 0), (-1e308, 0), (0, 1e308)],
            ),
            thickness=NOT_POSITIVE,
        ),
        *bad(Fixture, stiffness=(*NO_PLACE, None, (1, 0), (1, NAN), (1, -1), (1, 1, 1)), damping=((0, 1), 1)),
        *bad(Pin, stiffness=NOT_POSITIVE, damping=NOT_POSITIVE),
        *bad(
            Grasp,
            {"robot": 0},
            robot=(*NO_NUMBER[:-1], None, -1, 0.5),
            xyz=NO_PLACE,
            rotation=(EYE,),
            compliance=(*NO_PART, None, Fixture),
            since=(*NO_NUMBER, None, -1),
            until=(*NO_NUMBER, 0, -1),
        ),
        *bad(Grasp, {"robot": 0, "xyz": ZERO}, rotation=NO_ROTATION, since=(1.0,)),
        *bad(Admittance, mass=(*NO_PLACE, None, (-1, 1), (1, NAN)), damping=(*NO_PLACE, None, (1, 0))),
    ]


def ways() -> list[Case]:
    flat = [(x, 0) for x, _ in CIRCLE]
    along = {"motions": motions(), "a": (1, -1)}
    return [
        *bad(
            Edge,
            {"points": CIRCLE},
            points=(*NO_PLACE, None, CIRCLE[:3], CIRCLE[:-1], CIRCLE[::-1], flat, 0 * CIRCLE, 1e300 * CIRCLE),
            tilt=(*NO_NUMBER, None, 2, np.pi / 2),
            stand_off=(*NO_NUMBER, None, -1),
        ),
        *bad(
            Edge.of,
            {"curve": lambda u: (np.cos(u), np.sin(u))},
            curve=(
                *NO_PART[:-2],
                None,
                lambda u: (u, 0),
                lambda u: "ab",
                lambda u: (NAN, 0),
                lambda u: (0, 0),
            ),
            period=NOT_POSITIVE,
            tilt=(*NO_NUMBER, None),
        ),
        *bad(
            AlongEdge,
            {"edge": edge(), "way": ToSpeed(0.1, 0.1)},
            edge=(*NO_PART, None, path()),
            way=(*NO_PART, None, ToSpeed, STILL),
        ),
        *bad(ToSpeed, {"speed": 0.1, "ramp": 0.1}, speed=(*NO_NUMBER, None), ramp=NOT_POSITIVE),
        *bad(
            ToRest,
            {"start": 0, "end": 1, "duration": 1, "ramp": 0.1},
            start=(*NO_NUMBER, None),
            end=(*NO_NUMBER, None),
            duration=NOT_POSITIVE,
            ramp=(*NOT_POSITIVE, 0.6),
        ),
        *bad(
            Path,
            {"points": LINE},
            points=(
                *NO_PLACE,
                None,
                LINE[:3],
                0 * LINE,
                NAN * LINE,
                LINE[:, :2],
                1e300 * LINE,
                np.vstack((LINE, LINE[-2::-1])),
            ),
            up=(*NO_PLACE, None, (1, 0, 0), (0, 0, 0)),
        ),
        *bad(
            Path.from_function,
            {"curve": lambda u: (u, 0, 0), "start": 0, "end": 1},
            curve=(
                *NO_PART,
                None,
                lambda u: (u, 0),
                lambda u: (NAN, 0, 0),
                lambda u: (0, 0, 0),
                lambda u: (abs(u - 0.5), 0, 0),
            ),
            start=(*NO_NUMBER, None, 1),
            end=(*NO_NUMBER, None, 0),
        ),
        *bad(
            AlongPath,
            {"path": path(), "way": ToRest(0, 1, 1, 0.1)},
            path=(*NO_PART, None),
            way=(*NO_PART, None, ToRest),
        ),
        *bad(Gate, {"gap": 0.02}, gap=(*NO_NUMBER, None), reach=NOT_POSITIVE),
        *bad(
            PathWeights,
            along,
            motions=(*NO_PART, None, motions()[:1], [1, 2]),
            a=(*NO_PLACE, None, (1, 0), (1, NAN)),
            gate=NO_PART,
        ),
        *bad(
            PathWeights.of_phase,
            {"motions": motions(), "duration": 1.0},
            motions=(*NO_PART, None),
            duration=NOT_POSITIVE,
        ),
        *bad(PathWeights.of_gap, {"motions": motions()}, motions=(*NO_PART, None), gate=NO_PART),
        *bad(Override, floor=(*NOT_POSITIVE, 1.1), scale=NOT_POSITIVE, rate=NOT_POSITIVE),
        *bad(
            Paced,
            {"adaptation": Gradient(0.3), "override": Override()},
            adaptation=(*NO_PART, None, Gradient),
            override=(*NO_PART, None, Override),
        ),
        *bad(Carrier, {"body": STILL, "frame": STILL}, body=(*NO_PART, None), frame=(*NO_PART, None)),
        *bad(Rider, {"body": STILL, "frame": STILL}, body=(*NO_PART, None), frame=(*NO_PART, None)),
    ]


def plants() -> list[Case]:
    cell, arm = pair(), load_robot("ur5")
    place = cell.robots[0].tip_position(np.array([0.5, 0.5]))
    held = {"cell": cell, "body": BODY, "grasps": [Grasp(0), Grasp(1)], "at": (place, EYE)}
    pins = [Grasp(i, compliance=Pin()) for i in range(2)]
    no_grasps = (
        NO_PART,
        [Grasp(2)],
        [Grasp(0), 1],
        [Grasp(0), Grasp(0)],
        [Grasp(0, (1, 0, 0))],
        pins,
        Grasp(0),
    )
    found = []
    for plant in (CarryingPlant, RigidPlant, HandlingPlant, PinnedPlant):
        found += bad(
            plant,
            held if plant is not PinnedPlant else {**held, "grasps": pins},
            cell=(*NO_PART, None),
            body=(*NO_PART, None),
            grasps=(*no_grasps[0], None, *no_grasps[1:]),
            at=(*NO_PART, None, (place,), (place, EYE, EYE), (place, 2 * EYE), (NAN * place, EYE)),
            robots=(*NO_PART, cell.robots[:1], (arm, arm), [arm, 1]),
            desired=(*NO_PART, Hold(ZERO)),
        )
    loaded = {"robot": arm, "theta": BODY.parameters, "xyz": ZERO, "rotation": EYE}
    near = (0.0, -1.5, 2.0, -0.5, np.pi / 2, 0.0)
    carried = {"arm": arm, "grasp": Grasp(0, ZERO), "body": BODY, "motion": STILL, "near": near}
    return [
        *found,
        *bad(tared, {"cell": cell}, cell=(*NO_PART, None), by=(*NO_NUMBER, None, -1, 2)),
        *bad(
            BeadPlant,
            {"cell": cell, "body": BODY},
            cell=(*NO_PART, None),
            body=(*NO_PART, None),
            carrier=(*NO_NUMBER, 1, 2),
            nozzle=(0,),
        ),
        *bad(MeetingPlant, {"cell": cell, "duration": 1.0}, cell=(*NO_PART, None), duration=NOT_POSITIVE),
        *bad(
            with_share,
            loaded,
            robot=(*NO_PART, None),
            theta=(*NO_PLACE, -1e3 * BODY.parameters, [1e308] * 10),
            xyz=NO_PLACE,
            rotation=NO_ROTATION,
        ),
        *bad(
            carrier,
            carried,
            arm=(*NO_PART, None),
            grasp=(*NO_PART, None, Grasp(0)),
            body=(*NO_PART[:-2], None),
            motion=(*NO_PART, None, Hold(ZERO)),
            near=NO_PLACE,
            at=NO_PART,
            share=(*NO_NUMBER, None, -1e3),
            known=(*NO_NUMBER, None),
            error=(*NO_PLACE, None),
        ),
    ]


def ready() -> list[Case]:
    flags = {"synchronized": NO_FLAG, "push": NO_FLAG, "friction": NO_FLAG}
    no_error = [value for value in NO_PLACE if value is not True]
    leaks = "x", NAN, INF, -1, 99.0, [1], 1j, {}, np.array([1, -2])
    return [
        *bad(
            carry_ur5,
            **flags,
            grasp=(*NO_PART, None),
            geometric_error=no_error,
            leak=leaks,
            tare=NO_FLAG,
            admittance=("x", 1, None, NAN, Fixture()),
            gains=("x", 1, {}),
            law=("x",),
            adaptation=("x",),
            network=("x",),
        ),
        *bad(
            carry_planar,
            **flags,
            grasp=(*NO_PART, None, "rigid", Fixture()),
            geometric_error=no_error,
            leak=leaks,
            tare=NO_FLAG,
            admittance=("x", 1, None, NAN, Fixture()),
            gains=("x", 1, {}),
        ),
        *bad(bead_on_edge, **flags, gains=("x", 1, {})),
        *bad(
            bead_on_path,
            push=NO_FLAG,
            friction=NO_FLAG,
            mode=(*NO_FLAG, "Gap"),
            override=("x", 1, NAN, [], Override),
            meeting=(*NOT_POSITIVE, 1, 2),
            gap=NOT_POSITIVE,
            gains=("x",),
        ),
    ]


CASES = list(chain(things(), ways(), plants(), ready()))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of numbers that overflow on their way to the error
@pytest.mark.parametrize(("name", "make"), CASES, ids=[name for name, _ in CASES])
def test_it_is_refused_and_said_what_was_expected_and_found(name: str, make: Callable[[], Any]) -> None:
    with pytest.raises(SynctrlError) as caught:
        make()
    assert caught.value.subject
    assert re.search("expect|cannot", str(caught.value)), caught.value
