"""Two UR5 arms that spread adhesive on one path, from its ends until their beads meet.

Each arm has a nozzle that points straight down and that its controller knows nothing of. Robot 1 is pushed
back shortly before they meet. Everything here is our choice and not the paper's.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, Unpack

import numpy as np

from ..assembly.meeting import MeetingPlant, lag_of_friction
from ..checks import boolean, choice, finite_number, instance, positive_number
from ..control.adaptation import Gradient, Override, Paced
from ..control.gains import Gains
from ..coupling.along_path import Gate, PathWeights
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..errors import GainWarning, InputError, warn
from ..robots.friction import Friction
from ..robots.payload import Payload, carrying, holding
from ..robots.robot import Robot
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment
from ..tasks.edge import DOWN
from ..tasks.inverse_kinematics import reach
from ..tasks.path import AlongPath, Path
from ..tasks.pose import PoseSpace
from ..tasks.poses import AxisRotation, PoseTrajectory
from ..tasks.ways import Ramped
from .carry import FRICTION
from .carry import GAINS as CARRYING
from .parts import ControllerParts, ready_experiment
from .ur5_payload import facing_ur5

DISTANCE = 0.5  # m, of each base from the path
HEIGHT, WIDTH, HALF = 0.25, 0.06, 0.3  # m, of the path: above the bases, to the sides, and from end to middle
NOZZLE = (0.0, 0.0, 0.10)  # m, from the tip of an arm
SHARE = 0.55  # of the path, that robot 1 goes
GAP, CLEARANCE = 0.02, 0.005  # m: what is left between the nozzles, and what their size needs
SPEED, RAMP = 0.10, 0.3  # m/s and s
DURATION, SLOWED = 5.0, 6.5  # s, of runs, and of those that wait for robots that lag
LOOKED_AT = 0.25, 0.5, 0.75  # of the way, where the lag that friction leaves is reckoned
POSTURE = (-0.5, -1.5, 2.0, -2.0, -np.pi / 2, 0.0)  # rad
KNOWN = 0.7  # of the true parameters
PUSH = -15.0  # N·m, on joint 1 of robot 1
PUSHED = (0.8, 0.3)  # s, before they meet
MODES = "independent", "gap", "gap_weighted", "phase"
#: along the path alone robots are synchronized
_FIRST = np.eye(6)[0]
GAINS = CARRYING.replace(beta=20.0 * _FIRST, K_eps=2000.0 * _FIRST)


def bead_on_path(
    mode: str = "gap_weighted",
    override: Override | bool | None = None,
    push: bool = True,
    friction: bool = True,
    meeting: float = SHARE,
    gap: float = GAP,
    gains: Gains | None = None,
    **parts: Unpack[ControllerParts],
) -> Experiment:
    """Two UR5 on one path, in pose space, synchronized along the path alone.

    Args:
        mode: what is compared: "gap", the gap between the nozzles; "gap_weighted", the same, the more the
            closer they are; "phase", by how much time they are late, which keeps the place where they meet;
            or nothing, "independent", with the gap in the log.
        override: how the motion waits for robots that lag; True for the values of `Override`.
        push: whether joint 1 of robot 1 is pushed back for half a second, shortly before they meet.
        friction: whether the joints rub, which the controller does not know.
        meeting: share of the path that robot 1 goes, between 0 and 1.
        gap: what is left between the nozzles where they meet, m.
        gains, parts: see `ready_experiment`; beta and K_eps are zero except along the path.

    Raises:
        InputError: a value that is none of these.

    Warns:
        GainWarning: an override that friction alone keeps near its floor all the way.
    """
    choice("mode", mode, MODES)
    boolean("push", push), boolean("friction", friction)
    cell, duration = _cell(mode, friction, meeting, gap)
    together, remark, pushes = mode != "independent", mode.replace("_", " "), [_push(duration)] * bool(push)
    made = ready_experiment(cell, DURATION, GAINS, gains, together, parts, remark, disturbances=pushes)
    made = replace(made, plant_type=partial(MeetingPlant, duration=duration))
    if override is None or override is False:
        return made
    return _paced(made, Override() if override is True else override, duration)


def _paced(made: Experiment, override: Override, duration: float) -> Experiment:
    """An experiment whose desired motion waits for robots that lag."""
    instance("override", override, Override, "an Override, True or None")
    controller = made.closed_loop().controller
    lag = min(lag_of_friction(controller, share * duration, override.floor) for share in LOOKED_AT)
    if lag > override.scale:
        few = (
            f"override, scale: friction leaves a lag of {lag:.2g} m even at the slowest feed, and so keeps it"
        )
        warn(f"{few} near its floor; expected a scale above that, found {override.scale:g} m", GainWarning)
    learning = Gradient(made.gains.Gamma) if made.adaptation is None else made.adaptation
    gains = made.gains.replace(Gamma=None)
    return replace(made, gains=gains, duration=SLOWED, adaptation=Paced(learning, override))


def nozzle(robot: Robot) -> Robot:
    """A robot with a nozzle, at the point of which it is controlled."""
    with_point = holding(robot, NOZZLE, np.eye(3), "nozzle")
    return carrying(with_point, Payload(0, 0.5, (0.0, 0.0, -0.05), (1e-3, 1e-3, 1e-3)))


def _cell(mode: str, friction: bool, meeting: float, gap: float) -> tuple[Cell, float]:
    """The cell, and how long its robots take to meet, s."""
    path = Path.from_function(_curve, -HALF, HALF)
    duration, motions = _motions(path, meeting, gap)
    rubs = FRICTION if friction else Friction()
    members = [_member(i, motion, rubs) for i, motion in enumerate(motions)]
    coupling = Coupling.pair(_weights(mode, motions, duration, gap))
    return Cell(members, coupling, PoseSpace(), name="UR5 pair on a path"), duration


def _curve(y: float) -> tuple[float, float, float]:
    return WIDTH * np.sin(np.pi * y / HALF), y, HEIGHT


def _motions(path: Path, meeting: float, gap: float) -> tuple[float, list[PoseTrajectory]]:
    """How long they take to meet, s, and how they go."""
    share, left = finite_number("meeting", meeting), positive_number("gap", gap)
    if left < CLEARANCE:
        raise InputError.expected(f"at least {CLEARANCE:g} m, which the nozzles need", left, "gap")
    stops = share * path.length - left / 2, share * path.length + left / 2
    if not 0 < stops[0] < stops[1] < path.length:
        expected = "a place on the path, with half of the gap on either side"
        raise InputError.expected(expected, share, "meeting")
    starts = 0.0, path.length
    longest = max(abs(stop - start) for start, stop in zip(starts, stops, strict=True))
    duration = longest / SPEED + RAMP
    ways = [Ramped(start, stop, duration, RAMP) for start, stop in zip(starts, stops, strict=True)]
    return duration, [PoseTrajectory(AlongPath(path, way), AxisRotation.fixed(DOWN)) for way in ways]


def _weights(mode: str, motions: list[PoseTrajectory], duration: float, gap: float) -> Any:
    along: list[Any] = [motion.position for motion in motions]
    if mode == "phase":
        return PathWeights.of_phase(along, duration)
    return PathWeights.of_gap(along, Gate(gap) if mode == "gap_weighted" else None)


def _member(i: int, motion: PoseTrajectory, friction: Friction) -> Member:
    robot = nozzle(facing_ur5(i, DISTANCE))
    q0 = reach(robot, motion(0.0).x, np.array(POSTURE), PoseSpace())
    known = KNOWN * robot.inertial_parameters
    return Member(robot, motion, q0, theta_hat0=known, friction=friction, name=robot.name)


def _push(duration: float) -> Disturbance:
    return Disturbance(0, np.array([PUSH, *[0.0] * 5]), *(duration - before for before in PUSHED))
