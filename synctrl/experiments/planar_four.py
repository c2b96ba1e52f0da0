"""Four planar two-link arms, section V-B of the paper: figures 8 to 16.

The numbers are those of Tables II and III and the text. Two choices the paper leaves open are arguments: phi
of Table II is never given, and Table II contradicts the text on which robots move on the larger circle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Unpack

import numpy as np

from ..checks import choice, finite_number
from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..errors import InputError
from ..robots.catalog import load_robot
from ..robots.parameters import planar_two_link_parameters, theta_50
from ..robots.robot import Robot
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment
from ..tasks.spaces import CartesianSpace
from ..tasks.trajectories import ExponentialApproach
from .parts import ControllerParts, Parts, ready_experiment

R, D = 5.0, 1.0  # m
TURN = 0.02  # rad, how far each desired path goes along its circle
Q0 = np.pi * np.array([[2 / 3, -1 / 6], [2 / 3, -1 / 6], [2 / 3, -1 / 3], [2 / 3, -1 / 3]])  # Table III
MASS_HAT, LENGTH_HAT = 0.8, 0.2  # kg, m: the initial guess of every link
GAINS = Gains(Lambda=10.0, beta=100.0, K_r=1.0, K_eps=1.0, Gamma=0.1)
DURATION = 5.0  # s
#: +1 N·m for 0.5 <= t < 0.75 s; that it acts on both joints is our choice
TORQUE_DISTURBANCE = Disturbance(robot=0, torque=(1.0, 1.0), start=0.5, stop=0.75)

#: radius of each robot's circle, by source
RADII = {"text": (R, R + D, R + D, R), "table": (R, R + D, R, R + D)}
#: side of the y axis on which each robot starts, and the sense of its path
SIDE = (-1, -1, 1, 1)


def planar_four(
    synchronized: bool = True,
    disturbance: str | Disturbance | Sequence[Disturbance] | None = None,
    phi: float = 0.1,
    radii: str = "text",
    gains: Gains | None = None,
    reference_acceleration: str | None = None,
    k_r_space: str | None = None,
    **parts: Unpack[Parts],
) -> Experiment:
    """The four-arm cell of section V-B, in Cartesian space with the ring (47)-(48).

    Args:
        synchronized: False sets beta = K_eps = 0, the paper's independent adaptive control.
        disturbance: "torque" for the paper's, or own disturbances.
        phi: initial angle of all arms on their circles, rad.
        radii: "text" puts robots 2 and 3 on the larger circle as (46) and (47) do, "table" 2 and 4 as
            Table II.
        gains: by default the paper's.
        reference_acceleration, k_r_space: options of the law, see `Experiment`.
        parts: `adaptation`, `law`, `network`, `sensors`, `actuators`, see `Experiment`.

    Raises:
        InputError: an unknown word, or a number that is not finite.
        UnreachableError: on simulation, when phi puts the paths out of reach.
    """
    phi = finite_number("phi", phi)
    radii = choice("radii", radii, tuple(RADII))
    arm = load_robot("planar2r")
    members = [_member(arm, i, phi, RADII[radii][i]) for i in range(4)]
    coupling = Coupling.ring(4, c=(R + D, -R, R, -(R + D)), unit="m")
    cell = Cell(members, coupling, CartesianSpace("xy"), name="four planar arms")
    options = ControllerParts(reference_acceleration=reference_acceleration, k_r_space=k_r_space, **parts)
    pushes = _disturbances(disturbance)
    return ready_experiment(cell, DURATION, GAINS, gains, synchronized, options, disturbances=pushes)


def circle_point(radius: float, angle: float) -> np.ndarray:
    """Table II's way of writing a point on a circle: radius (sin(angle), cos(angle)), (2,), m."""
    return radius * np.array([np.sin(angle), np.cos(angle)])


def _member(arm: Robot, i: int, phi: float, radius: float) -> Member:
    start = circle_point(radius, SIDE[i] * phi)
    end = circle_point(radius, SIDE[i] * phi + TURN)
    base = np.append(start, 0.0) - arm.tip_position(Q0[i])
    robot = arm.placed(base, name=f"arm {i + 1}")
    return Member(
        robot,
        ExponentialApproach(start, end),
        Q0[i],
        parameters=planar_two_link_parameters(robot),
        theta_hat0=theta_50([MASS_HAT] * 2, [LENGTH_HAT] * 2),
    )


def _disturbances(disturbance: str | Disturbance | Sequence[Disturbance] | None) -> Sequence[Disturbance]:
    if disturbance is None:
        return ()
    if isinstance(disturbance, str) and disturbance == "torque":
        return (TORQUE_DISTURBANCE,)
    if isinstance(disturbance, Disturbance):
        return (disturbance,)
    if isinstance(disturbance, Sequence) and not isinstance(disturbance, str):
        return tuple(disturbance)
    raise InputError.expected("None, 'torque' or Disturbance objects", disturbance, "disturbance")
