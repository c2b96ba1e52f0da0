"""Robots that hold an object of the file: their loads, believed tips and starts follow from the object."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

from ..assembly.carrier import carrier
from ..coupling.cell import Member
from ..errors import InputError
from ..robots.robot import Robot
from .kinds import kind
from .values import ANGLES, NUMBER, VECTOR


class Holds(NamedTuple):
    """What a robot has of the object that it carries with others, in pose space.

    Args:
        share: of the object's inertia that the controller of this robot takes as its own; the shares of all
            robots add up to 1.
        known: how much of that share the first estimate has, all of the robot being known.
        error: what the robot believes of the object in its hand beside the truth: displacement, m, and
            rotation vector, rad, (6,), in the object's axes.
        near: joint positions to look for its start from, rad; by default far from singular ones.
    """

    share: float = 0.5
    known: float = 1.0
    error: Any = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    near: Any = None


HOLDS = kind("", None, Holds, share=NUMBER, known=NUMBER, error=VECTOR, near=ANGLES)


def held_by(robot: Robot, index: int, holds: Holds, plant: Any) -> Member:
    """A robot with its share of the object of a plant, controlled where it believes the object.

    Args:
        robot: without the object.
        index: its number, counted from 0.
        holds: what it has of the object.
        plant: that has the object, the grasps, and the object's desired motion.

    Raises:
        InputError: a plant without these, or a value that `carrier` does not take.
    """
    given = plant.keywords if isinstance(plant, partial) else {}
    grasp = next((each for each in given.get("grasps", ()) if each.robot == index), None)
    if grasp is None or grasp.xyz is None or given.get("desired") is None:
        words = "expected an object in [plant] with its `desired` motion and a place, `xyz`, where this robot"
        raise InputError(f"{words} grasps it, found none", subject="holds")
    parts = {"at": given.get("at"), "share": holds.share, "known": holds.known, "error": holds.error}
    return carrier(robot, grasp, given["body"], given["desired"], holds.near, **parts)


def with_robots(plant: Any, robots: Sequence[Robot]) -> Any:
    """A plant that has the robots without their shares of the object, unless it was told of robots."""
    return plant if "robots" in plant.keywords else partial(plant, robots=list(robots))
