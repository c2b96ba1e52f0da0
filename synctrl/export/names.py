"""What the arrays of a result are called in words, and where in the paper they are defined."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import permutations
from types import MappingProxyType

from ..simulation.result import Result

#: the paper that equation numbers are those of
PAPER = (
    "D. Sun and J. K. Mills, Adaptive synchronized control for coordination of multirobot assembly tasks, "
    "IEEE Transactions on Robotics and Automation 18(4), 498-510, 2002"
)
#: array of a result -> what it is, and the equations that define it, if the paper has some
ARRAYS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "t": ("time", ""),
        "x": ("task coordinates", ""),
        "x_desired": ("desired task coordinates", ""),
        "tracking_error": ("tracking error e, desired minus actual", "(1)"),
        "sync_error": ("synchronization error epsilon", "(7), (28)"),
        "sync_integral": ("integral of the synchronization error", "(10)"),
        "coupled_error": ("coupled error e*", "(10), (29)"),
        "q": ("joint position", ""),
        "v": ("joint velocity", ""),
        "v_error": ("joint velocity error s_q, reference minus actual", "(13)"),
        "tau": ("torque of the controller", "(8), (13)"),
        "disturbance": ("torque from outside", ""),
        "theta_hat": ("estimated parameters", "(9), (14)"),
    }
)
#: output of a run -> what it is; others are called by their names
OUTPUTS: Mapping[str, str] = MappingProxyType(
    {
        "object_pose": "pose of the object: place, and orientation as a unit quaternion x y z w",
        "object_desired": "desired pose of the object: place, and orientation as a unit quaternion x y z w",
        "object_twist": "velocity of the object's origin, and angular velocity, in world axes",
        "hand_wrench": "force and moment of each hand on the object, in world axes",
        "internal_force": "part of the hands' forces and moments that does not move the object",
        "hand_closed": "whether each hand is closed, 1 or 0",
        "bead_points": "where adhesive is laid",
        "bead_error": "by how much adhesive is laid beside its place",
        "bead_speed": "speed of the nozzle along its path",
        "bead_speed_desired": "desired speed of the nozzle along its path",
        "speed_error": "speed of the nozzle along its path, less the desired one",
        "normal_angle": "by how much the nozzle is off its tilt",
        "gap_error": "by how much the gap between two robots on one path is off",
        "messages_sent": "messages that each robot has sent until then",
        "messages_heard": "messages that have come over each link until then",
        "message_age": "age of what is known over each link",
        "admittance": "by how much each arm gave way",
        "hedge": "by how much the desired motion gave way",
        "phase": "how far along the desired motion is",
        "feed": "rate of the phase",
        "applied_torque": "torque within the limits, as applied",
        "measured_q": "joint position as measured",
        "measured_v": "joint velocity as measured",
        "actuator_torque": "torque of the actuators",
        "held_position": "position of joints that are held",
        "held_velocity": "velocity of joints that are held",
        "held_torque": "torque of joints that are held",
        "adaptation_state": "state of the adaptation",
        "network_state": "memory of the network",
        "plant_state": "state that the plant has of its own",
    }
)
#: what the entries of coordinates are called, by their number
COORDINATES: Mapping[int, tuple[str, ...]] = MappingProxyType(
    {
        2: ("x", "y"),
        3: ("x", "y", "z"),
        6: ("x", "y", "z", "about x", "about y", "about z"),
        7: ("x", "y", "z", "qx", "qy", "qz", "qw"),
    }
)


def coordinate_units(unit: str, length: int) -> list[str]:
    """Units of coordinates, of which three are of places or forces, and further ones of turns or moments."""
    linear, _, angular = unit.partition(", ")
    if length not in (6, 7) or not angular:
        return [unit] * length
    return [linear] * 3 + ["1" if length == 7 else angular] * (length - 3)


def pair_names(result: Result) -> list[str]:
    """What each synchronization error compares: `robot 1, robot 2`, or `all 3 robots`; no two are alike."""
    names = [_compared(result.names, pair) for pair in result.info["pairs"]]
    times = Counter(names)
    return [f"{k}: {name}" if times[name] > 1 else name for k, name in enumerate(names, start=1)]


def _compared(names: Sequence[str], pair: Sequence[int]) -> str:
    many = len(pair) > 2 and len(pair) == len(names)
    return f"all {len(pair)} robots" if many else ", ".join(names[i] for i in pair)


def shared_names(result: Result, axis: str, length: int) -> list[str]:
    """What the entries along an axis are called, where all that has the axis calls them the same."""
    known = {
        "robot": lambda: result.names,
        "pair": lambda: pair_names(result),
        "axis": lambda: list(result.info["axes"]),
        "coordinate": lambda: list(COORDINATES.get(length, ())),
        "grasp": lambda: _grasps(result),
        "link": lambda: _links(result),
    }
    found = known[axis]() if axis in known else []
    return found if len(found) == length else [f"{axis} {k + 1}" for k in range(length)]


def own_names(result: Result, axis: str) -> list[list[str]] | None:
    """What the entries along an axis are called at each robot, if each has its own, as many as it has."""
    robots = result.info["robots"]
    if axis in ("joint", "parameter"):
        return [list(robot[f"{axis}s"]) for robot in robots]
    if axis == "held joint" and "held_joints" in result.info:
        return [list(held["joints"]) for held in result.info["held_joints"]]
    return None


def _grasps(result: Result) -> list[str]:
    """Robots whose hands hold the object, with a number from the second grasp of one on."""
    held = [result.names[int(grasp["robot"])] for grasp in result.info.get("grasps", ())]
    before = [held[:k].count(name) for k, name in enumerate(held)]
    return [f"{name}, grasp {k + 1}" if k else name for name, k in zip(held, before, strict=True)]


def _links(result: Result) -> list[str]:
    """Who hears whom: robots i and j for which S^T S has an entry that is not 0."""
    if "signs" not in result.info:
        return []
    entries: dict[tuple[int, int], float] = {}
    for pair, signs in zip(result.info["pairs"], result.info["signs"], strict=True):
        row = list(zip(pair, signs, strict=False))
        for (i, a), (j, b) in permutations(row, 2):
            entries[i, j] = entries.get((i, j), 0.0) + a * b
    return [f"{result.names[i]} hears {result.names[j]}" for i, j in sorted(entries) if entries[i, j]]
