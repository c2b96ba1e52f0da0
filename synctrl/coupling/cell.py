"""A cell: robots, each with its desired motion, in one task space and under one coupling."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, offers, per_joint
from ..errors import InputError
from ..robots.friction import Friction
from ..robots.model import joined
from ..robots.parameters import Parameters
from ..robots.robot import Robot
from ..tasks.algebra import padded
from ..tasks.spaces import JointSpace, Space, units_of
from ..tasks.trajectories import Motion, Trajectory
from .coupling import Coupling
from .desired import desired_motion, further_rows, weights_by_clocks
from .graphs import largest_share
from .member_checks import (
    check_friction,
    check_labels,
    check_names,
    check_trajectory,
    first_estimates,
    member_parameters,
    with_urdf_friction,
)
from .reference import Reference as Reference
from .starts import on_paths, start_positions, start_velocities
from .together import asked_together
from .weights import StillWeights, Weights


@dataclass(frozen=True, eq=False)
class Member:
    """One robot of a cell and what it starts from.

    Args:
        robot: the robot, placed in the world.
        trajectory: its desired motion in the cell's space.
        q0: joint positions at t = 0, (nv,), rad; by default on the path: in joint space that is said by the
            path itself, in others found by inverse kinematics, within the robot's limits and close to the
            space's posture if it has one.
        v0: joint velocities at t = 0, (nv,), rad/s; by default at rest; "path" is as fast as the path asks.
        parameters: what is adapted, or its name: "full", all inertial parameters, by default; "base", the
            fewest that give the same torques. Their true values have to be those of this robot, as it is
            placed, and of this friction.
        theta_hat0: estimate at t = 0, (P,); by default zeros, which is to know nothing.
        friction: friction of the true plant, which the controller does not know, unless what is adapted are
            `FrictionParameters`; by default none. "urdf" is what the robot's description states, rotors
            included, in the plant and among what is adapted: `parameters` that are None or a name become
            `FrictionParameters`. What the description states and nobody asks for, a run warns of.
        name: for legends and messages.
    """

    robot: Robot
    trajectory: Trajectory
    q0: ArrayLike | None = None
    v0: ArrayLike | str | None = None
    parameters: Parameters | str | None = None
    theta_hat0: ArrayLike | None = None
    friction: Any = None
    name: str | None = None
    _friction_from: str = field(default="given", init=False, repr=False)

    def __post_init__(self) -> None:
        if self.friction is None:
            self._set(friction=Friction(), _friction_from="nobody")
        elif isinstance(self.friction, str) and self.friction == "urdf" and isinstance(self.robot, Robot):
            self._set(friction=self.robot.urdf_friction, _friction_from="urdf")
            self._set(parameters=with_urdf_friction(self.robot, self.parameters))

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def friction_from(self) -> str:
        """Who says what the friction is: "given", "urdf", or "nobody", and then there is none."""
        return self._friction_from

    @property
    def theta(self) -> np.ndarray:
        """True values of what is adapted, (P,), of which `theta_hat0` is an estimate.

        Raises:
            InputError: parameters that do not describe the robot and its friction.
        """
        return member_parameters(self.name or "robot", self.robot, self.friction, self.parameters).theta


class Cell:
    """n robots that perform one task.

    Robots with fewer joints or parameters than the largest have their rows padded with zeros.

    Args:
        members: the robots, at least two.
        coupling: which of them are compared.
        space: where the task is given; joint space by default.
        name: for titles.
        clocks: how much the clock of every robot is ahead, a number or (n,), s: at t it is told what is
            desired at t + clock, and has the weights of that time.

    Attributes:
        members, coupling, space, name, clocks: as given, the clocks as (n,).
        robots, names: those of the members.
        labels, units: names and units of the m task coordinates, as the space has them.
        task: the space bound to these robots, see `BoundSpace`; it is asked at every instant of a run.
        parameters: what is adapted of every robot, see `Parameters`.
        theta: the true values of these, which the controller does not know, (n, P).
        q0, v0, theta_hat0: where the robots and the estimates start, (n, nv), (n, nv) and (n, P).
        starts: where q0 comes from, a word for each robot: "given", "path" or "inverse kinematics".

    Raises:
        InputError: sizes that do not fit together; the message names the member.
        CouplingError: a coupling for another number of robots.
        UnreachableError: no joint positions for the start of a path.

    Warns:
        LimitWarning: a robot that nobody told where to start has to do so beyond the limits of its joints.
    """

    def __init__(
        self, members: Sequence[Member], coupling: Coupling, space: Space | None = None,
        name: str = "cell", clocks: ArrayLike = 0.0,
    ):  # fmt: skip
        instance("members", members, Iterable, "Member objects")
        self.members = tuple(members)
        self.coupling = coupling
        self.space = JointSpace() if space is None else space
        self.name = name
        for member in self.members:
            instance("members", member, Member, "Member objects")
            instance("robot", member.robot, Robot, "a Robot, for example from load_robot")
        instance("coupling", coupling, Coupling, "a Coupling")
        if coupling.robots != len(self.members):
            raise InputError(
                f"made for {coupling.robots} robots, but the cell has {len(self.members)}", subject="coupling"
            )
        self.clocks = per_joint("clocks", clocks, len(self.members))
        self.robots = tuple(member.robot for member in self.members)
        self.names = tuple(m.name or f"robot {i}" for i, m in enumerate(self.members, start=1))
        check_names(name, self.names)
        offers("space", self.space, ("labels", "unit", "bind"), "a space, for example CartesianSpace('xy')")
        self.labels = self.space.labels(self.robots)
        self.units = units_of(self.space, self.robots)
        self.task = self.space.bind(self.robots)
        self._read_members()
        check_labels(self)

    # -- sizes --------------------------------------------------------------------------------------------

    @property
    def n(self) -> int:
        """Number of robots."""
        return len(self.members)

    @property
    def m(self) -> int:
        """Dimension of the task."""
        return len(self.labels)

    @property
    def nv(self) -> int:
        """Largest number of joints."""
        return max(robot.nv for robot in self.robots)

    @cached_property
    def largest_share(self) -> float:
        """The largest eigenvalue of S^T S: the most by which synchronization errors answer together."""
        return largest_share(self.coupling)

    @property
    def unit(self) -> str:
        """Unit of the task coordinates; those of all coordinates where they differ."""
        return joined(self.units)

    @property
    def weighted_unit(self) -> str:
        """Unit of c e, and so of the synchronization errors; those of all coordinates where they differ."""
        return joined(self.weighted_units)

    @property
    def weighted_units(self) -> tuple[str, ...]:
        """Unit of each of the m coordinates of c e."""
        c = self.coupling.unit
        return tuple({"": unit, unit: f"{c}²"}.get(c, f"{c}·{unit}") for unit in self.units)

    @property
    def breaks(self) -> tuple[float, ...]:
        """Instants at which a desired motion is not smooth, s."""
        told = zip(self.members, self.clocks.tolist(), strict=True)
        return tuple(sorted({b - ahead for member, ahead in told for b in member.trajectory.breaks}))

    def with_clocks(self, clocks: ArrayLike) -> Cell:
        """This cell with clocks that are ahead by so much; itself if that is what they are.

        Raises:
            InputError: not numbers, or for another number of robots.
        """
        same = np.array_equal(per_joint("clocks", clocks, self.n), self.clocks)
        return self if same else type(self)(self.members, self.coupling, self.space, self.name, clocks)

    # -- desired motion -----------------------------------------------------------------------------------

    def reference_table(self, times: np.ndarray) -> Reference:
        """What is desired at all of the times, (T,), with time as the first axis."""
        times = np.asarray(times, dtype=float)
        motions = self.told_together(range(self.n), times)
        return Reference(motions.swapaxes(0, 1), self.weights(times), times)

    def motion(self, robot: int, times: np.ndarray) -> Motion:
        """What is desired of one robot at the times, (T,); see `desired_motion`."""
        ahead = times + self.clocks[robot]
        return desired_motion(self.names[robot], robot, self.members[robot].trajectory, ahead)

    def told(self, robot: int, times: np.ndarray) -> np.ndarray:
        """All that is told of one robot, (3, T, m), and more of it; see `further` of `Space`."""
        name, trajectory = self.names[robot], self.members[robot].trajectory
        further = further_rows(name, robot, self.space, trajectory, times + self.clocks[robot])
        return np.concatenate((self.motion(robot, times), further))

    def told_together(self, robots: Sequence[int], times: np.ndarray) -> np.ndarray:
        """`told` of some robots at once, (3 or more, T, number of robots, m)."""
        return asked_together(self, robots, times)

    def weights(self, times: np.ndarray) -> Weights:
        """Weights of the coupling at the times, (T,); see `desired_weights`."""
        if self.coupling.is_constant:
            return self.coupling.weights(times, self.m)
        return weights_by_clocks(self.coupling.weights, times, self.m, self.clocks)

    def references(self, times: np.ndarray) -> list[Reference]:
        """What is desired at each of the times, (T,)."""
        return list(self.instants(self.reference_table(times)))

    def instants(self, table: Reference, part: slice = slice(None)) -> Iterator[Reference]:
        """The instants in a part of a table, one after another."""
        desired, times = np.ascontiguousarray(table.desired[part]), table.t[part].tolist()
        if self.coupling.is_constant:
            constant = StillWeights(*(weight[0] for weight in table.weights))
            return (Reference(row, constant, t) for row, t in zip(desired, times, strict=True))
        rows = zip(desired, times, *(weight[part] for weight in table.weights), strict=True)
        return (Reference(row, Weights(*weights), t) for row, t, *weights in rows)

    # -- internals ----------------------------------------------------------------------------------------

    def _read_members(self) -> None:
        starts, parameters, q0, v0, theta_hat0 = [], [], [], [], []
        for i, (name, member) in enumerate(zip(self.names, self.members, strict=True)):
            nv = member.robot.nv
            check_trajectory(name, member.trajectory, self.labels)
            check_friction(name, member.friction, member.robot)
            parameters.append(member_parameters(name, member.robot, member.friction, member.parameters))
            source, start = start_positions(self, i)
            starts.append(source)
            q0.append(finite_array(f"{name}, q0", start, (nv,)))
            v0.append(start_velocities(name, member.v0, nv))
            theta_hat0.append(first_estimates(name, parameters[-1], member.theta_hat0))
        self.starts = tuple(starts)
        self.parameters, self.theta = tuple(parameters), padded([p.theta for p in parameters])
        self.q0, self.theta_hat0 = padded(q0), padded(theta_hat0)
        self.v0 = on_paths(self, padded(v0))

    def __reduce__(self) -> tuple:
        """Copies and other processes bind the space anew: arrays that share memory would come apart."""
        return type(self), (self.members, self.coupling, self.space, self.name, self.clocks)

    def __repr__(self) -> str:
        return f"Cell('{self.name}', {self.n} robots, {self.space!r}, {self.coupling!r})"
