"""Kind: what equal robots share in generated code."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from ..assembly.plant import CarryingPlant
from ..control.controller import Controller
from ..robots.lumped import Lumping, lumping
from ..robots.mechanism import Mechanism, mechanism
from ..robots.parameters import FrictionParameters
from ..robots.robot import Robot
from ..simulation.closed_loop import ClosedLoop
from ..simulation.plant import Plant
from ..tasks.algebra import Algebra
from ..tasks.measurement import Kinematics
from ..tasks.redundancy import Posture
from ..tasks.spaces import BoundJointSpace, BoundTipSpace, JointSpace, TipSpace
from .momentum import momentum_function
from .plugged import Learning, learner, trace_law, trace_learning
from .weighing import Weighing, weighing_of


@dataclass(frozen=True, eq=False)
class Kind:
    """What equal robots share; everything else is an input of the generated functions.

    Attributes:
        fixed: the mechanism, as the controller knows it; if it holds an object, with its tip on its link, for
            where the tip is differs from hand to hand, and is an input of the code.
        true: the same of what really stands there.
        space: of the task.
        matrix: map from theta to inertial parameters, (10 bodies, P), or None for all of them.
        base_rotation, true_rotation: rotation of the first joint's placement, as the controller knows it and
            as it is, if all robots with the mechanism share it, else None.
        gravity: in the world's axes, m/s^2.
        reference_acceleration, k_r_space: options of the controller.
        weighing: structure of the weights.
        smoothing: velocity at which adapted Coulomb friction reaches tanh(1), or None without it.
        rotors: whether rotors are adapted too.
        made_of: names of the types that the user has plugged in.
        learning: how it learns, or None for (14).
        law: CasADi function of what it does, see `trace_law`, or None for `SunMills`.
        holds: whether its tip holds an object.
        gives_at: where y and y' of an admittance stand in the state of the adaptation, or None without one.
    """

    fixed: Mechanism
    true: Mechanism
    space: TipSpace | JointSpace
    matrix: np.ndarray | None
    base_rotation: np.ndarray | None
    true_rotation: np.ndarray | None
    gravity: tuple[float, ...]
    reference_acceleration: str
    k_r_space: str
    weighing: Weighing
    smoothing: float | None = None
    rotors: bool = False
    made_of: tuple[str, ...] = ()
    learning: Learning | None = None
    law: Any = None
    holds: bool = False
    gives_at: int | None = None

    @property
    def nv(self) -> int:
        """Number of joints."""
        return len(self.fixed.joints)

    @property
    def m(self) -> int:
        """Dimension of the task."""
        return self.space.m if isinstance(self.space, TipSpace) else self.nv

    @property
    def tip(self) -> bool:
        """Whether the task is one of the tip."""
        return isinstance(self.space, TipSpace)

    @property
    def rigid_parameters(self) -> int:
        """Number of adapted parameters of the rigid bodies; they come first."""
        return 10 * self.nv if self.matrix is None else self.matrix.shape[1]

    @property
    def adapted(self) -> int:
        """Number of adapted parameters."""
        rub = 0 if self.smoothing is None else (2 + self.rotors) * self.nv
        return self.rigid_parameters + rub

    @property
    def learned(self) -> int:
        """Entries of the state of the adaptation, without what an admittance adds."""
        return self.adapted if self.learning is None else self.learning.estimate.numel_in()

    @cached_property
    def lumping(self) -> Lumping:
        """How the true inertial parameters are lumped."""
        return lumping(self.true)

    @property
    def damped(self) -> bool:
        """Whether singular configurations are damped."""
        return getattr(self.space, "damping", None) is not None

    @property
    def solves(self) -> bool:
        """Whether the way to the joints is a pseudo-inverse."""
        return self.damped or self.nv > self.m

    @property
    def slides(self) -> bool:
        """Whether errors may count at a point that slides on what is carried."""
        return hasattr(self.space, "further")

    @property
    def watches(self) -> tuple[str, ...]:
        """Names of what the guard watches."""
        return tuple(getattr(self.space, "limits", ()))

    def bound(self, tip: Kinematics, posture: Posture, algebra: Algebra) -> BoundTipSpace | BoundJointSpace:
        """The space of one such robot.

        Args:
            tip: its tip.
            posture: W^-1, posture and gain, (nv,).
            algebra: of all these numbers or symbols.
        """
        if not isinstance(self.space, TipSpace):
            return BoundJointSpace()
        return self.space.over(tip, [self.nv], posture, algebra)

    @property
    def sizes(self) -> dict[str, int]:
        """What the lengths of its rows are made of, see `SIZES`."""
        return {
            "m": self.m,
            "nv": self.nv,
            "P": self.adapted,
            "Z": self.learned if self.gives_at is None else self.gives_at + 12,
            "K": self.nv if self.k_r_space == "joint" else self.m,
            "bodies": self.lumping.size,
            "slides": int(self.slides),
            "tip": int(self.tip),
            "spare": int(self.solves),
            "damped": int(self.damped),
            "watches": len(self.watches),
            "weighs": self.weighing.count(self.m),
            "hand": int(self.holds),
            "gives": int(self.gives_at is not None),
        }

    def key(self) -> list[Any]:
        """Plain data that is equal for robots of one kind."""
        rotations = (self.base_rotation, self.true_rotation)
        shared = [None if rotation is None else rotation.tolist() for rotation in rotations]
        matrix = None if self.matrix is None else self.matrix.tolist()
        options: list[Any] = [self.reference_acceleration, self.k_r_space, list(self.gravity)]
        options += [self.smoothing, self.rotors, list(self.made_of), self.holds, self.gives_at]
        options += [list(self.weighing.parts), self.weighing.full]
        options += [None if part is None else part.serialize() for part in (*(self.learning or ()), self.law)]
        damping = asdict(self.space.damping) if self.damped else None  # type: ignore[union-attr, arg-type]
        space = [list(getattr(self.space, "rows", ())), damping, list(self.watches)]
        return [self.fixed.key(), self.true.key(), space, matrix, shared, options]


class Standing(NamedTuple):
    """Robots that stand somewhere.

    Attributes:
        fixed: their mechanisms, (n,).
        bases: placement of the first joint of each, (n,).
    """

    fixed: list[Mechanism]
    bases: list[pin.SE3]

    @property
    def shared(self) -> list[np.ndarray | None]:
        """Rotation of each first joint's placement if all with the mechanism share it, else None."""
        names = [repr(fixed.key()) for fixed in self.fixed]
        rotations: dict[str, set[bytes]] = {}
        for name, base in zip(names, self.bases, strict=True):
            rotations.setdefault(name, set()).add((base.rotation + 0.0).tobytes())  # -0 counts as 0
        return [
            base.rotation if len(rotations[name]) == 1 else None
            for name, base in zip(names, self.bases, strict=True)
        ]


def standing(robots: Sequence[Robot], hands: Collection[int] = ()) -> Standing:
    """Mechanisms and places of robots, with the tips of some on their links."""
    fixed, bases = zip(*map(mechanism, robots), strict=True)
    open_tip = {"tip_translation": np.zeros(3), "tip_rotation": np.eye(3)}
    return Standing([replace(x, **open_tip) if i in hands else x for i, x in enumerate(fixed)], [*bases])


class Classified(NamedTuple):
    """The robots of a cell, sorted.

    Attributes:
        kinds: the kinds of robots there are.
        kind_of: which one each robot is, (n,).
        bases, true_bases: placement of the first joint of each robot, as the controller knows it and as it
            is, (n,).
    """

    kinds: list[Kind]
    kind_of: list[int]
    bases: list[pin.SE3]
    true_bases: list[pin.SE3]


def classify(loop: ClosedLoop) -> Classified:
    """The kinds of robots in a closed loop of known parts, see `check_known`.

    Raises:
        InputError: the cell uses something the compiled engine does not have.
    """
    controller = loop.controller
    bare, known, true = _bare(loop)
    momentum = [
        partial(momentum_function, kind, base.rotation) for kind, base in zip(bare, known.bases, strict=True)
    ]
    kinds: dict[str, Kind] = {}
    index, plugged = [], zip(trace_learning(controller, momentum), trace_law(controller), strict=True)
    for plain, (learning, law) in zip(bare, plugged, strict=True):
        kind = replace(plain, learning=learning, law=law)
        key = repr(kind.key())
        kinds.setdefault(key, kind)
        index.append(list(kinds).index(key))
    return Classified(list(kinds.values()), index, known.bases, true.bases)


def holders(plant: Plant) -> tuple[int, ...]:
    """The robots of a plant whose tips hold its object, in the order of its grasps."""
    return tuple(grasp.robot for grasp in plant.grasps) if isinstance(plant, CarryingPlant) else ()


def _bare(loop: ClosedLoop) -> tuple[list[Kind], Standing, Standing]:
    """Kinds of robots without what users have plugged in; the robots as they are known, and as they are."""
    robots, holding = loop.cell.robots, holders(loop.plant)
    known, true = (standing(those, holding) for those in (robots, loop.plant.schedule.free))
    parts = zip(known.fixed, true.fixed, known.shared, true.shared, strict=True)
    kinds = [
        _kind(loop.controller, i, (fixed, real), (rotation, true_rotation), i in holding)
        for i, (fixed, real, rotation, true_rotation) in enumerate(parts)
    ]
    return kinds, known, true


def _kind(
    controller: Controller,
    i: int,
    mechanisms: tuple[Mechanism, Mechanism],
    rotations: tuple[np.ndarray | None, np.ndarray | None],
    holds: bool,
) -> Kind:
    cell, parameters = controller.cell, controller.cell.parameters[i]
    rigid: Any = parameters.base if isinstance(parameters, FrictionParameters) else parameters
    return Kind(
        *mechanisms,
        cell.space,  # type: ignore[arg-type]
        getattr(rigid, "matrix", None),
        *rotations,
        tuple(map(float, cell.robots[i].gravity_vector)),
        controller.reference_acceleration,
        controller.k_r_space,
        weighing_of(cell),
        getattr(parameters, "smoothing", None),
        getattr(parameters, "armature", False),
        tuple(type(part).__qualname__ for part in (cell.space, parameters, rigid)),
        holds=holds,
        gives_at=None if controller.admittance is None else learner(controller).start().shape[1],
    )
