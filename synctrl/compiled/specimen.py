"""A small closed loop with one robot of each kind: there generated code is compared with Pinocchio.

What is compared belongs to the code, not to the cell: generated functions take gains, weights, desired motion
and placement as inputs. So the specimen stands near the origin, where world axes cost no digits, has weights,
gains and motions of its own, and asks nothing of what a user has plugged in. It grows with the number of
kinds, not of robots.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from typing import Any

import numpy as np

from ..assembly.body import CarriedObject
from ..assembly.grasp import Grasp
from ..assembly.plant import CarryingPlant
from ..control.adaptation.gradient import BoundGradient
from ..control.admittance import Admittance, BoundAdmittance
from ..control.controller import Controller
from ..control.gains import Gains
from ..control.laws import Law, SunMills
from ..control.laws.sun_mills import BoundSunMills
from ..coupling.cell import Cell, Member, Reference
from ..coupling.coupling import Coupling
from ..coupling.desired import rows_of
from ..coupling.weights import Weights
from ..robots.friction import Friction
from ..robots.parameters import FrictionParameters, FullParameters, LinearParameters, Parameters
from ..robots.robot import Robot
from ..simulation.closed_loop import ClosedLoop
from ..simulation.plant import Plant
from ..tasks.redundancy import Redundancy
from ..tasks.rotations import exp
from ..tasks.spaces import JointSpace, Space, TipSpace
from ..tasks.trajectories import Hold
from .kind import Classified, holders
from .plugged import ChosenAdaptation, ChosenLaw, learner

#: robots at least: with three in a ring, each is in two pairs, and each pair leaves one out
ROBOTS = 3
#: where the first joint of each robot is, m
PLACE = (0.3, -0.2, 0.1)
#: where it really is, which the controller does not know, m
TRUE_PLACE = (0.25, -0.1, 0.05)
#: how far from the desired pose the robots are, m and rad: small errors, and some that are not
DISTANCES = (0.1, 0.8, 1.6)
#: configurations that are tried for one that is not close to a singular one
TRIES = 20
#: condition number above which all of them are
SINGULAR = 1e6


class Specimen:
    """A small closed loop for the kinds of a larger one.

    Args:
        loop: the larger one.
        classified: its kinds.

    Attributes:
        loop: the small one.
        index: which kind each of its robots is.
    """

    def __init__(self, loop: ClosedLoop, classified: Classified):
        self._rng = np.random.default_rng(0)
        self._weighing = classified.kinds[0].weighing
        count = len(classified.kinds)
        self.index = [k % count for k in range(max(ROBOTS, count))]
        chosen = [_most_turned(classified, k) for k in range(count)]
        members = [_member(loop.controller.cell, chosen[k]) for k in self.index]
        self.loop = self._loop(loop, members, [chosen[k] for k in self.index])

    def cases(self) -> Iterator[tuple[Reference, np.ndarray, np.ndarray]]:
        """References, states and disturbances to compare y' at; none if a robot is singular everywhere."""
        cell = self.loop.cell
        for distance in DISTANCES:
            q = np.zeros((cell.n, cell.nv))
            for i, robot in enumerate(cell.robots):
                q[i, : robot.nv], condition = self._configuration(robot)
                if condition > SINGULAR:
                    return
            y = self._state(q)
            reference = Reference(self._desired(q, distance), self._weights())
            yield reference, y, self._random(cell.n, cell.nv) * self._joints()

    # -- the loop -----------------------------------------------------------------------------------------

    def _loop(self, whole: ClosedLoop, members: Sequence[Member], robots: Sequence[int]) -> ClosedLoop:
        original, plant, n, m = whole.controller, whole.plant, len(members), whole.cell.m
        coupling = Coupling.signed_ring(n, lambda t: self._moving(n, m)[:3])
        coupling = coupling.weighted(self._positive(n))
        cell = Cell(members, coupling, self._space(original.cell.space, [x.robot for x in members]))
        gains = self._gains(cell, original.k_r_space)
        adaptation: Any = None
        if not isinstance(learner(original), BoundGradient):
            adaptation = ChosenAdaptation(original, robots)
            gains = gains.replace(Gamma=None)
        giving = None if original.admittance is None else _FreelyGiving()
        controller = Controller(
            cell, gains, adaptation=adaptation, law=_law(original, robots), admittance=giving
        )
        return ClosedLoop(controller, self._plant(cell, plant, robots))

    def _plant(self, cell: Cell, original: Plant, robots: Sequence[int]) -> Plant:
        """The true robots, and an object of its own in the hands of those that hold one."""
        true = [_moved(original.schedule.free[i], TRUE_PLACE) for i in robots]
        holding = holders(original)
        hands = [k for k, i in enumerate(robots) if i in holding]
        if not hands:
            return Plant(cell, robots=true)
        p, R = self._random(3), exp(self._random(3))
        spread = exp(self._random(3))
        body = CarriedObject(1.5, self._random(3), spread @ np.diag([1.0, 1.2, 1.4]) @ spread.T)
        tips = {k: true[k].tip_pose(np.zeros(true[k].nv)) for k in hands}
        grasps = [Grasp(k, R.T @ (tip.translation - p), R.T @ tip.rotation) for k, tip in tips.items()]
        plant = _Carrying(cell, body=body, grasps=grasps, at=(p, R), robots=true)
        plant.K, plant.D = self._positive(2, len(grasps), 6)
        plant.arms = self._random(len(grasps), 3)  # equal arms would hold it at one place
        return plant

    def _space(self, space: Space, robots: Sequence[Robot]) -> Space:
        if not isinstance(space, TipSpace):
            return space
        posture = [self._random(robot.nv) for robot in robots]
        weights = [self._positive(robot.nv) for robot in robots]
        other = copy(space)
        other.redundancy = Redundancy(posture, 0.7, weights)
        return other

    def _gains(self, cell: Cell, k_r_space: str) -> Gains:
        columns = cell.nv if k_r_space == "joint" else cell.m
        Lambda, beta, K_eps = self._positive(3, cell.m)
        K_r, Gamma = self._positive(cell.n, columns), self._positive(*cell.theta.shape)
        return Gains(Lambda, beta, K_r, K_eps, Gamma, leak=0.5 * Lambda)

    # -- what it is asked ---------------------------------------------------------------------------------

    def _configuration(self, robot: Robot) -> tuple[np.ndarray, float]:
        """Joint positions of a robot, and how close to a singular configuration they are."""
        space: Any = self.loop.cell.space
        tried = self._rng.uniform(-1.5, 1.5, (TRIES, robot.nv))
        if isinstance(space, JointSpace):
            return tried[0], 1.0
        rows = getattr(space, "rows", slice(None))
        conditions = np.linalg.cond(np.stack([robot.jacobian(q)[rows] for q in tried]))
        best = int(np.argmin(conditions))
        return tried[best], float(conditions[best])

    def _state(self, q: np.ndarray) -> np.ndarray:
        y = self._random(self.loop.size)
        state, cell = self.loop.state(y), self.loop.cell
        state.q[...], known = q, np.zeros(cell.theta.shape)
        state.v[...] *= self._joints()
        for row, parameters in zip(known, cell.parameters, strict=True):
            row[: len(parameters.theta)] = 1
        learns = learner(self.loop.controller)
        z = state.z[:, : learns.start().shape[1]]  # what an admittance has behind it stays random
        if isinstance(learns, BoundGradient):
            z[...] = known * (cell.theta + 0.1 * z)
        else:
            z[...] = learns.start() * (1 + 0.1 * z)
        return y

    def _desired(self, q: np.ndarray, distance: float) -> np.ndarray:
        """A desired motion that begins at a distance from where the robots are."""
        cell = self.loop.cell
        desired = self._random(rows_of(cell.space), cell.n, cell.m)
        offset = distance * desired[0] / np.linalg.norm(desired[0], axis=1, keepdims=True)
        zero = np.zeros_like(desired)
        desired[0] = cell.task.measure(np.stack((q, np.zeros_like(q))), zero).x + offset
        return desired

    def _weights(self) -> Weights:
        return self._moving(self.loop.cell.n, self.loop.cell.m)

    def _moving(self, n: int, m: int) -> Weights:
        """Weights that have an inverse, and rates of any kind, as far as these kinds of robots know such."""
        weights = 0.3 / m * self._random(3, n, m, m)
        weights[0] += np.eye(m)
        return self._weighing.like(*weights)

    def _joints(self) -> np.ndarray:
        """1 for joints that a robot has, else 0, (n, nv)."""
        cell = self.loop.cell
        counts = np.array([robot.nv for robot in cell.robots])
        return (np.arange(cell.nv) < counts[:, None]).astype(float)

    def _random(self, *shape: int) -> np.ndarray:
        return self._rng.standard_normal(shape)

    def _positive(self, *shape: int) -> np.ndarray:
        return self._rng.uniform(0.5, 2.0, shape)


class _FreelyGiving(Admittance):
    """One that takes the weights of the specimen, and has a mass in some directions only."""

    def bind(self, cell: Cell, adaptation: Any, network: Any) -> BoundAdmittance:
        """With numbers near one, as those of all else here."""
        return BoundAdmittance(adaptation, np.array([1.5, 0.7, 0.0, 1.2, 0.0, 0.8]), np.linspace(0.6, 1.7, 6))


class _Carrying(CarryingPlant):
    """A plant of which no theorem is asked, nor whether arms know the object as their load."""

    def chain(self, controller: Controller) -> Any:
        """None."""
        return None


def _most_turned(classified: Classified, kind: int) -> int:
    """The robot of a kind whose base is turned furthest: where code could forget to turn it, it shows."""
    robots = [i for i, found in enumerate(classified.kind_of) if found == kind]
    return min(robots, key=lambda i: float(np.trace(classified.bases[i].rotation)))


def _law(original: Controller, robots: Sequence[int]) -> Law:
    """The paper's law with the same options, or the law of the larger cell for some of its robots."""
    if type(original.law) is BoundSunMills:
        return SunMills(original.reference_acceleration, original.k_r_space)
    return ChosenLaw(original, robots)


def _member(cell: Cell, i: int) -> Member:
    """Robot i near the origin, with parameters of the same kind."""
    robot = _moved(cell.robots[i], PLACE)
    friction = Friction(0.3, 0.2, getattr(cell.parameters[i], "smoothing", 0.01))
    return Member(
        robot,
        Hold(np.zeros(cell.m)),
        q0=np.zeros(robot.nv),
        parameters=_parameters(cell.parameters[i], robot, friction),
        friction=friction,
    )


def _moved(robot: Robot, place: tuple[float, float, float]) -> Robot:
    """A robot with the first joint somewhere else."""
    alone = Robot(robot.model, robot.tip, name=robot.name)
    first = next(j for j in range(1, robot.model.njoints) if robot.model.parents[j] == 0)
    return alone.placed(place - robot.model.jointPlacements[first].translation)


def _parameters(parameters: Parameters, robot: Robot, friction: Friction) -> Parameters:
    """Parameters of the same kind for a robot that differs in place."""
    if isinstance(parameters, FrictionParameters):
        base = _parameters(parameters.base, robot, friction)
        return FrictionParameters(robot, friction, base, parameters.armature)
    if isinstance(parameters, LinearParameters):
        return LinearParameters(robot, parameters.matrix, parameters.theta, parameters.names)
    return FullParameters(robot)
