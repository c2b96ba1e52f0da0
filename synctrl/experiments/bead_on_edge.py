"""Two UR5 arms: one carries a plate, the other one spreads adhesive along the plate's edge while it moves.

The errors of the arm that carries count at the frame on its plate where the nozzle should be, so that
epsilon = e_1 - e_2 is where the nozzle is against the plate. The first arm knows nothing of the plate, and
has to learn it. Everything here is our choice and not the paper's.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Unpack

import numpy as np

from ..assembly.bead import BeadPlant
from ..assembly.body import CarriedObject, with_share
from ..assembly.grasp import Grasp
from ..assembly.outline import Outline
from ..checks import boolean
from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..robots.friction import Friction
from ..robots.payload import holding
from ..robots.robot import Robot
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment
from ..tasks.edge import AlongEdge, Edge
from ..tasks.inverse_kinematics import reach
from ..tasks.pose import PoseSpace
from ..tasks.poses import AxisRotation, PoseTrajectory
from ..tasks.rotations import exp
from ..tasks.sliding import Carrier, Rider, SlidingSpace
from ..tasks.ways import RampUp
from .bead_on_path import nozzle
from .carry import FRICTION
from .carry import GAINS as CARRYING
from .parts import ControllerParts, ready_experiment
from .ur5_payload import DURATION, facing_ur5, swing

DISTANCES = 0.65, 0.5  # m, of the bases from the middle
HEIGHT, SWING = 0.25, np.array([0.03, 0.06, 0.05])  # m
TURN, TURN_AXIS = 0.25, (0.3, 0.4, 1.0)  # rad
SPEED, RAMP = 0.14, 0.5  # m/s, s
TILT, STAND_OFF = np.deg2rad(30.0), 5e-3  # rad, m
PLATE = CarriedObject(
    2.0, (0.01, 0.02, 0.0), 2.0 / 12 * np.array([0.16**2, 0.24**2, 0.24**2 + 0.16**2]),
    name="plate",
)  # fmt: skip
HAND = Grasp(0, (-0.20, 0.0, 0.0), exp(np.array([0.0, np.pi / 2, 0.0])))
THICKNESS, CORNERS = 0.01, 80  # m, of the plate, whose upper face has the edge, and corners that are drawn
POSTURES = (0.0, -1.5, 2.0, -0.5, np.pi / 2, 0.0), (0.0, -1.5, 2.0, -2.0, -np.pi / 2, 0.0)  # rad
#: share of the true parameters, without the plate, that the controller starts with
KNOWN = 0.7
#: torque on joints 1 to 3 of arm 1, N·m, from 2 s to 2.3 s
PUSH = Disturbance(0, np.array([15.0, 15.0, 15.0, 0.0, 0.0, 0.0]), 2.0, 2.3)
GAINS = CARRYING.replace(beta=20.0, K_eps=2000.0)


def bead_on_edge(
    synchronized: bool = True,
    push: bool = True,
    friction: bool = False,
    gains: Gains | None = None,
    **parts: Unpack[ControllerParts],
) -> Experiment:
    """Two UR5, one with a plate of 2 kg that nobody knows, the other one with a nozzle on the plate's edge.

    Args:
        synchronized, gains, parts: see `ready_experiment`.
        push: whether joints 1 to 3 of arm 1 are pushed for .3 s.
        friction: whether the joints rub, which the controller does not know.

    Raises:
        InputError: a value that is none of these.
    """
    boolean("friction", friction), boolean("push", push)
    edge = plate_edge()
    plate, frame = plate_motion(), AlongEdge(edge, RampUp(SPEED, RAMP))
    rubs, pushes = FRICTION if friction else Friction(), [PUSH] * bool(push)
    members = [_carrier(Carrier(plate, frame), rubs), _nozzle(Rider(plate, frame), rubs)]
    cell = Cell(members, Coupling.pair(), SlidingSpace(), name="UR5 pair with a bead on an edge")
    made = ready_experiment(cell, DURATION, GAINS, gains, synchronized, parts, disturbances=pushes)
    return replace(made, plant_type=partial(BeadPlant, body=_drawn(edge)))


def plate_edge() -> Edge:
    """The edge, a rounded rectangle of about .24 m by .16 m, and the nozzle's tilt and distance."""

    def curve(u: float) -> tuple[float, float]:
        return 0.12 * (1.1 * np.cos(u) - 0.1 * np.cos(3 * u)), 0.08 * (1.1 * np.sin(u) + 0.1 * np.sin(3 * u))

    return Edge.of(curve, 2 * np.pi, TILT, STAND_OFF)


def _drawn(edge: Edge) -> CarriedObject:
    """The plate as figures show it, within its edge."""
    shape = Outline(edge.outline(CORNERS)[:, :2], THICKNESS)
    return replace(PLATE, shape=shape, center=(0.0, 0.0, -THICKNESS / 2))


def plate_motion() -> PoseTrajectory:
    """Desired motion of the plate: away with 1 - cos, back after one period."""
    way = swing(SWING, offset=np.array([0.0, 0.0, HEIGHT]))
    return PoseTrajectory(way, AxisRotation(np.eye(3), TURN_AXIS, swing(np.array([TURN]))))


def _carrier(motion: Carrier, friction: Friction) -> Member:
    arm, (d, G) = facing_ur5(0, DISTANCES[0]), HAND.object_in_hand
    loaded = holding(with_share(arm, PLATE.parameters, d, G), d, G, "plate")
    return _member(loaded, motion, 0, KNOWN * arm.inertial_parameters, friction)


def _nozzle(motion: Rider, friction: Friction) -> Member:
    robot = nozzle(facing_ur5(1, DISTANCES[1]))
    return _member(robot, motion, 1, KNOWN * robot.inertial_parameters, friction)


def _member(robot: Robot, motion: Carrier | Rider, i: int, guess: np.ndarray, friction: Friction) -> Member:
    q0 = reach(robot, motion(0.0).x, np.array(POSTURES[i]), PoseSpace())
    return Member(robot, motion, q0, theta_hat0=guess, friction=friction, name=robot.name)
