"""Two CRS A460 arms that move a payload, section V-A of the paper: figures 2 to 7.

Joint angles and gains are the paper's. Masses, inertias and friction of the A460 were never published: the
ones used here are synthetic. The time of the motion, the initial estimate and the place of the second base
are our choices as well; with these the two wrists carry a level payload 0.5 m long across its direction of
travel. With all six joints, as in the paper's laboratory, PID controllers hold the last three, while the
adaptive controller knows a lumped mass in place of the wrist.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, Unpack

import numpy as np

from ..checks import boolean
from ..control.gains import Gains
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..robots.catalog import load_robot
from ..robots.friction import Friction
from ..robots.parameters import FrictionParameters
from ..robots.robot import Robot
from ..simulation.held_joints import HeldJointsPlant, Pid
from ..simulation.simulate import Experiment
from ..tasks.spaces import JointSpace
from ..tasks.trajectories import Cubic
from .parts import ControllerParts, Parts, ready_experiment

INITIAL = np.deg2rad([[73.3340, 60.3330, -169.8120], [15.2520, 71.6830, -181.9800]])  # Table I
FINAL = np.deg2rad([[90.0, 63.6090, -174.7290], [-2.9730, 74.1070, -185.1080]])
MOTION_TIME, DURATION = 2.0, 4.0  # s
BASES = (((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((0.026, 1.334, -0.020), (0.0, 0.0, -np.pi / 2)))  # m, rad
GAINS = Gains(Lambda=8.0, beta=8.0, K_r=(80.0, 80.0, 100.0), K_eps=10.0, Gamma=0.3)
#: share of the true parameters that the controller starts with
KNOWN = 0.7
#: adaptation gain of friction coefficients, which have other units than masses and inertias; our choice
GAMMA_FRICTION = 100.0
#: synthetic; the controller does not know it
FRICTION = Friction(viscous=(5.0, 6.0, 4.0), coulomb=(4.0, 6.0, 4.0), smoothing=0.01)
#: what holds joints 4 to 6: ours, about 60 rad/s and well damped for each joint alone
WRIST = Pid(P=(7.0, 20.0, 2.0), I=(70.0, 200.0, 20.0), D=(0.25, 0.6, 0.06))


def a460_pair(
    synchronized: bool = True,
    friction: bool = True,
    gains: Gains | None = None,
    reference_acceleration: str | None = None,
    k_r_space: str | None = None,
    adapt_friction: bool = False,
    gravity: bool = True,
    **parts: Unpack[Parts],
) -> Experiment:
    """The two-arm cell of section V-A, in joint space with epsilon = e_1 - e_2, eq. (45).

    Args:
        synchronized: False sets beta = K_eps = 0, the paper's independent adaptive control.
        friction: whether the plant has friction, which is outside the controller's model.
        gains: by default the paper's.
        reference_acceleration, k_r_space: options of the law, see `Experiment`.
        adapt_friction: whether the controller's model has friction too, see `FrictionParameters`.
        gravity: whether there is gravity, in the plant and in the controller's model.
        parts: `adaptation`, `law`, `network`, `sensors`, `actuators`, see `Experiment`.
    """
    boolean("gravity", gravity)
    boolean("friction", friction)
    boolean("adapt_friction", adapt_friction)
    robot = load_robot("a460") if gravity else load_robot("a460").weightless()
    members, ours = [_member(robot, i, FRICTION if friction else Friction()) for i in range(2)], GAINS
    if adapt_friction:
        members = [_knowing_friction(member) for member in members]
        ours = replace(GAINS, Gamma=np.repeat([float(GAINS.Gamma), GAMMA_FRICTION], [30, 6]))
    cell = Cell(members, Coupling.pair(c=(1.0, -1.0)), JointSpace(), name="A460 pair")
    remarks = [*["without friction"] * (not friction), *["friction adapted"] * adapt_friction]
    remarks += ["without gravity"] * (not gravity)
    options = ControllerParts(reference_acceleration=reference_acceleration, k_r_space=k_r_space, **parts)
    return ready_experiment(cell, DURATION, ours, gains, synchronized, options, *remarks)


def a460_full_pair(wrist: Pid = WRIST, **options: Any) -> Experiment:
    """The cell of section V-A with six joints in the plant and three in the controller.

    Args:
        wrist: the controllers of joints 4 to 6.
        options: of `a460_pair`, its parts of the controller, sensors and actuators too.
    """
    known = a460_pair(**options)
    robot = load_robot("a460_full")
    robots = [robot.placed(*base, name=f"A460 {i + 1}") for i, base in enumerate(BASES)]
    plant = partial(HeldJointsPlant, robots=robots, pid=wrist)
    return replace(known, plant_type=plant, title=f"{known.title}, six joints")


def _member(robot: Robot, i: int, friction: Friction) -> Member:
    placed = robot.placed(*BASES[i], name=f"A460 {i + 1}")
    return Member(
        placed,
        Cubic(INITIAL[i], FINAL[i], MOTION_TIME),
        theta_hat0=KNOWN * placed.inertial_parameters,
        friction=friction,
    )


def _knowing_friction(member: Member) -> Member:
    """The member with friction among what it adapts."""
    knowing = replace(member, parameters=FrictionParameters(member.robot))
    return replace(knowing, theta_hat0=KNOWN * knowing.theta)
