"""Work that threads do with one object: a Robot, a controller, a cell of every kind, a result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from at_once import Work
from cells import random_experiment
from machines import random_robot

from synctrl import (
    BaseParameters,
    CartesianSpace,
    Cell,
    Coupling,
    Damping,
    Experiment,
    Friction,
    FrictionParameters,
    PoseSpace,
    inverse_kinematics,
    load_robot,
)
from synctrl.analysis.certify import certify
from synctrl.analysis.gain_condition import gain_condition_in_box
from synctrl.experiments import (
    a460_full_pair,
    a460_pair,
    mixed_four,
    mobile_robot,
    panda_four,
    planar_four,
    ur5_payload,
)
from synctrl.experiments.mixed_four import STATIONS
from synctrl.experiments.panda_four import circle_cell
from synctrl.show.plots import joint_trajectories, save, sync_errors, tracking_errors
from synctrl.simulation.result import LAYOUT
from synctrl.simulation.schedules import Payload
from synctrl.sweep.worker import Prepared

DT = 1e-3


class Kind(NamedTuple):
    """An experiment with the options of its runs."""

    make: Callable[[], Experiment]
    options: dict[str, Any] = {}  # noqa: RUF012 - never changed


def changed(experiment: Experiment, space: Any = None, members: Sequence[Any] | None = None) -> Experiment:
    """The experiment with another space or other members."""
    cell = experiment.cell
    cell = Cell(members or cell.members, cell.coupling, space or cell.space, cell.name)
    return replace(experiment, cell=cell)


def damped() -> Experiment:
    return changed(planar_four(), CartesianSpace("xy", singularity=Damping(0.5, 0.05)))


def rubbing() -> Experiment:
    """Arms whose friction is adapted, with base parameters for one of them."""
    experiment, friction = a460_pair(), Friction(5.0, 4.0)
    members = [
        replace(
            member,
            friction=friction,
            parameters=FrictionParameters(member.robot, friction, base),
            theta_hat0=None,
        )
        for member, base in zip(
            experiment.cell.members,
            (None, BaseParameters(experiment.cell.members[1].robot)),
            strict=True,
        )
    ]
    return replace(changed(experiment, members=members), gains=replace(experiment.gains, Gamma=0.1))


def loaded() -> Experiment:
    """Payloads that come and go within a few steps."""
    payloads = [Payload(k % 4, 0.1, start=2e-3 * k, stop=2e-3 * k + 5e-3) for k in range(1, 6)]
    return replace(planar_four(), payloads=payloads)


def in_turn() -> Experiment:
    """Different arms in the order ABAB."""
    a, b, c, d = STATIONS
    return circle_cell((a, c, b, d), "mixed cell, in turn", None, synchronized=True, parts={})


#: every kind of space, weight, parameter and plant, in the engines that have it
KINDS: dict[str, Kind] = {
    "joints": Kind(a460_pair),
    "positions": Kind(planar_four),
    "positions, damping in task space": Kind(lambda: planar_four(k_r_space="task")),
    "positions, redundant": Kind(panda_four),
    "positions, damped": Kind(damped),
    "positions, different arms": Kind(mixed_four),
    "positions, different arms in turn": Kind(in_turn),
    "poses": Kind(ur5_payload),
    "poses, redundant": Kind(lambda: posed(panda_four())),
    "moving weights": Kind(lambda: random_experiment(3)),
    "moving weights of positions": Kind(lambda: random_experiment(4, "cartesian")),
    "weights of a function": Kind(mobile_robot),
    "friction among the parameters": Kind(rubbing),
    "payloads": Kind(loaded),
    "hidden joints": Kind(a460_full_pair),
    "sampled": Kind(planar_four, {"control_period": 2 * DT}),
    "RK45": Kind(planar_four, {"integrator": "RK45"}),
    "LSODA": Kind(planar_four, {"integrator": "LSODA"}),
    "Radau": Kind(planar_four, {"integrator": "Radau", "rtol": 1e-6, "atol": 1e-8}),
    "MuJoCo": Kind(a460_pair, {"plant": "mujoco"}),
}
#: what the compiled engine has
COMPILED = (
    "joints", "positions", "positions, damping in task space", "positions, redundant",
    "positions, different arms in turn", "poses", "moving weights of positions",
    "friction among the parameters", "sampled",
)  # fmt: skip


def posed(experiment: Experiment) -> Experiment:
    """Arms that hold a pose near where they start."""
    from synctrl import Attached, Cubic, PoseTrajectory

    members = []
    for member in experiment.cell.members:
        pose = member.robot.tip_pose(member.q0)
        p = pose.translation.copy()
        body = PoseTrajectory(Cubic(p, p + 0.01, 1.0))
        members.append(replace(member, trajectory=Attached(body, rotation=pose.rotation.copy())))
    return changed(experiment, PoseSpace(), members)


def runs(kind: Kind, duration: float, **more: Any) -> Work:
    """Runs of one experiment of different lengths."""
    experiment = kind.make()

    def work(k: int) -> Sequence[Any]:
        result = experiment.simulate(duration=duration + k % 3 * DT, dt=DT, **kind.options, **more)
        return [getattr(result, name) for name in LAYOUT]

    return work


def evaluations(kind: Kind) -> Work:
    """One closed loop at random states, with the payloads of different instants."""
    loop = kind.make().closed_loop(kind.options.get("plant", "pinocchio"))
    cell, y0 = loop.cell, loop.initial_state()

    def work(k: int) -> Sequence[Any]:
        rng = np.random.default_rng(k)
        y = y0 + 0.05 * rng.uniform(-1, 1, y0.size)
        reference = cell.references(np.array([1e-3 * k]))[0]
        y_dot, s = loop.at(1e-3 * (k % 20)).evaluate(reference, y, rng.uniform(-1, 1, (cell.n, cell.nv)))
        return [y_dot, s.tau, s.Y, s.v_ref, s.a_ref, s.task.x, s.u, s.e_star]

    return work


def questions(name: str) -> Work:
    """Everything that can be asked of one robot."""
    robot = random_robot(1, 5) if name == "random" else load_robot(name)

    def work(k: int) -> Sequence[Any]:
        q, v, a, b = np.random.default_rng(k).uniform(-2, 2, (4, robot.nv))
        pose, J, J_dot = robot.tip_kinematics(q, v)
        return [
            pose.homogeneous, J, J_dot, robot.mass_matrix(q), robot.coriolis_matrix(q, v), robot.gravity(q),
            robot.inverse_dynamics(q, v, a), robot.forward_dynamics(q, v, a), robot.regressor(q, v, a, b),
            robot.tip_pose(q).homogeneous, robot.tip_position(q), robot.jacobian(q),
            robot.jacobian_dot(q, v), robot.placed((1, 2, 3), (0.1, 0.2, 0.3)).gravity(q),
        ]  # fmt: skip

    return work


def reaching(space: Any, name: str) -> Work:
    """Inverse kinematics of one robot."""
    robot = load_robot(name)

    def work(k: int) -> Sequence[Any]:
        q, start = np.random.default_rng(k).uniform(-1.5, 1.5, (2, robot.nv))
        pose = robot.tip_pose(q)
        target = [*pose.translation, 0.1, 0.2, 0.3][: space.m]
        found = inverse_kinematics(robot, target, start, space)
        return [[] if found is None else found]

    return work


def base_parameters(name: str) -> Work:
    """What of one robot's inertial parameters its torques tell."""
    robot = load_robot(name)

    def work(k: int) -> Sequence[Any]:
        found = BaseParameters(robot)
        return [found.theta, found.matrix, found.grouping.K]

    return work


def certificates(kind: Kind) -> Work:
    """The certificate of one result, which goes through its run again."""
    experiment = kind.make()
    result = experiment.simulate(duration=0.02)

    def work(k: int) -> Sequence[Any]:
        found = certify(result, experiment)
        return [found.lyapunov.V, found.lyapunov.V_dot, found.gain_condition.margin, found.certified]

    return work


def margins(kind: Kind) -> Work:
    """The gain condition of one experiment in a box."""
    experiment = kind.make()
    q0 = experiment.cell.q0

    def work(k: int) -> Sequence[Any]:
        found = gain_condition_in_box(experiment, q0 - 0.1, q0 + 0.1, samples=4 + k % 2)
        return [found.margin, found.q, found.time]

    return work


def loading(names: Sequence[str]) -> Work:
    """Robots read from their files, and couplings."""

    def work(k: int) -> Sequence[Any]:
        robot = load_robot(names[k % len(names)])
        coupling = Coupling.ring(4).normalized().weighted([1.0, 2.0, 3.0, 4.0])
        return [
            robot.inertial_parameters,
            robot.placed((1, 0, 0)).gravity(np.ones(robot.nv)),
            coupling.matrix,
        ]

    return work


def figures(kind: Kind, folder: Path) -> Work:
    """Figures of one result, as the bytes of their files."""
    result = kind.make().simulate(duration=0.02)

    def work(k: int) -> Sequence[Any]:
        figure = (tracking_errors, sync_errors, partial(joint_trajectories, robot=0))[k % 3](result)
        files = save(figure, folder / f"figure {k}")
        return [np.frombuffer(file.read_bytes(), dtype=np.uint8) for file in files]

    return work


def variations(engine: str) -> Work:
    """Runs of what was prepared once; every second changes the motions, and the table of what is desired."""
    experiments = [planar_four(), planar_four(phi=0.11)]
    prepared = Prepared(experiments[0], 0.01, DT, engine)

    def work(k: int) -> Sequence[Any]:
        result = prepared.simulate(experiments[k % 2])
        return [getattr(result, name) for name in LAYOUT]

    return work
