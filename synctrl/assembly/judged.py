"""Robots that hold an object in fixtures, moved by MuJoCo as a whole: the judge of `CarryingPlant`."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ..checks import choice
from ..coupling.cell import Cell
from .judge import SprungChain
from .plant import CarryingPlant
from .rigid import ChainPlant, Mover


class JudgedPlant(ChainPlant, CarryingPlant):
    """`CarryingPlant` of which MuJoCo computes all: arms, object, and where the fixtures' hands are."""

    @cached_property
    def _mover(self) -> Mover:
        parts = self.robots, self._hands.tolist(), self.body, (self.arms, self.turned)
        return SprungChain(self.K, self.D, *parts)


#: kinds of plants with fixtures by the library that computes them
KINDS: dict[str, type[CarryingPlant]] = {"pinocchio": CarryingPlant, "mujoco": JudgedPlant}


def fixture_plant(cell: Cell, *, physics: str = "pinocchio", **parts: Any) -> CarryingPlant:
    """A plant with fixtures by the library that is asked for.

    Args:
        cell: what the controller knows.
        physics: one of `KINDS`.
        parts: of `CarryingPlant`.

    Raises:
        InputError: an unknown library, or see `CarryingPlant`.
    """
    return KINDS[choice("plant", physics, tuple(KINDS))](cell, physics=physics, **parts)
