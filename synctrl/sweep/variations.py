"""Variations of an experiment: pure functions from an experiment and a value to another experiment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..checks import index
from ..control.network import Ideal, Network
from ..coupling.cell import Cell, Member
from ..coupling.coupling import Coupling
from ..errors import InputError
from ..robots.base_parameters import BaseParameters
from ..robots.parameters import FrictionParameters, FullParameters, LinearParameters, Parameters
from ..robots.robot import Robot
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment
from .distributions import Value


def with_gain(experiment: Experiment, value: float, gain: str) -> Experiment:
    """Another value for all entries of a gain."""
    return replace(experiment, gains=experiment.gains.replace(**{gain: value}))


def with_scaled_gain(experiment: Experiment, value: float, gain: str) -> Experiment:
    """All entries of a gain times a number.

    Raises:
        InputError: a Gamma that an adaptation has taken the place of.
    """
    entries = getattr(experiment.gains, gain)
    if entries is None:
        raise InputError(
            f"expected gains with {gain}, found none beside an adaptation", subject=f"{gain}_scale"
        )
    return with_gain(experiment, value * entries, gain)


def with_part(experiment: Experiment, value: Value, part: str, meant: Mapping[Value, Any]) -> Experiment:
    """Another adaptation, law or network, by its label; an adaptation takes the place of the gain Gamma."""
    gains = experiment.gains.replace(Gamma=None) if part == "adaptation" else experiment.gains
    return replace(experiment, gains=gains, **{part: meant[value]})


def with_scaled_bodies(
    experiment: Experiment, value: float, robot: int | None = None, body: int | None = None
) -> Experiment:
    """True inertial parameters of bodies times a number; the controller's initial estimate stays."""

    def change(i: int, member: Member) -> Member:
        pi = member.robot.inertial_parameters.reshape(-1, 10)
        pi[slice_of("body", body, len(pi))] *= value
        scaled = member.robot.with_parameters(pi.ravel())
        parameters = same_parameters(experiment.cell.parameters[i], scaled)
        return replace(member, robot=scaled, parameters=parameters)

    return _with_members(experiment, change, robot)


def with_scaled_estimates(experiment: Experiment, value: float, robot: int | None = None) -> Experiment:
    """Initial estimates theta_hat(0) times a number."""
    return _with_estimates(experiment, lambda theta, theta_hat0: value * theta_hat0, robot)


def with_model_error(experiment: Experiment, value: float, robot: int | None = None) -> Experiment:
    """Initial estimates theta_hat(0) = (1 + value) theta."""
    return _with_estimates(experiment, lambda theta, theta_hat0: (1 + value) * theta, robot)


def with_moved_start(
    experiment: Experiment, value: float, quantity: str, robot: int | None = None, joint: int | None = None
) -> Experiment:
    """Joint positions "q0" or velocities "v0" at t = 0 plus a number."""
    cell = experiment.cell

    def change(i: int, member: Member) -> Member:
        start = getattr(cell, quantity)[i, : member.robot.nv].copy()
        start[slice_of("joint", joint, len(start))] += value
        # who starts as fast as its path keeps that velocity, wherever it starts
        kept = {"v0": cell.v0[i, : member.robot.nv]} if isinstance(member.v0, str) else {}
        return replace(member, **{**kept, quantity: start})

    return _with_members(experiment, change, robot)


def with_scaled_disturbance(experiment: Experiment, value: float, disturbance: int) -> Experiment:
    """Torque of a disturbance times a number."""
    return _with_disturbance(experiment, disturbance, lambda d: replace(d, torque=value * d.torque))


def with_disturbance_from(experiment: Experiment, value: float, disturbance: int) -> Experiment:
    """A disturbance that starts at another time and lasts as long as before."""
    return _with_disturbance(
        experiment, disturbance, lambda d: replace(d, start=value, stop=value + (d.stop - d.start))
    )


def with_scaled_weights(experiment: Experiment, value: float, robot: int | None = None) -> Experiment:
    """Weights c_i of the coupling times a number."""
    cell = experiment.cell
    scale = np.ones((cell.n, 1, 1))
    scale[slice_of("robot", robot, cell.n)] = value
    coupling = scaled_coupling(cell.coupling, cell.m, scale)
    return replace(experiment, cell=Cell(cell.members, coupling, cell.space, cell.name, cell.clocks))


def with_setting(experiment: Experiment, value: Value, setting: str) -> Experiment:
    """Another value for a setting of the network."""
    return replace(experiment, network=_network(experiment).replace(**{setting: value}))


def with_seed(experiment: Experiment, value: Value) -> Experiment:
    """Another seed of the network."""
    return with_setting(experiment, as_whole(value), "seed")


def as_whole(value: Value) -> Value:
    """A whole number that a table has as a float as what it is; any other value stays."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def with_burst(experiment: Experiment, value: float, part: int) -> Experiment:
    """Another probability for links to turn bad, part 0, or to heal, part 1."""
    burst = list(_network(experiment).burst or (0.0, 1.0))
    burst[part] = value
    return replace(experiment, network=_network(experiment).replace(burst=burst))


def with_clock(experiment: Experiment, value: float, robot: int | None = None) -> Experiment:
    """Clocks of one robot or of all that are ahead, s."""
    network, n = _network(experiment), experiment.cell.n
    offset = network.clocks(n)
    offset[slice_of("robot", robot, n)] = value
    return replace(experiment, network=network.replace(offset=offset))


def scaled_coupling(coupling: Coupling, m: int, scale: np.ndarray) -> Coupling:
    """A coupling with its weights times a number for each robot, (n, 1, 1); in space of dimension m."""

    def at(t: float) -> tuple[Any, ...]:
        return tuple(scale * part[0] for part in coupling.weights(np.array([t]), m)[:3])

    c = at(0.0)[0] if coupling.is_constant else at
    return Coupling(coupling.robots, coupling.edges, coupling.signs, c, coupling.name, coupling.unit)


def same_parameters(parameters: Parameters, robot: Robot) -> Parameters:
    """Parameters of the same kind for a robot with other true inertial parameters.

    Raises:
        InputError: a kind whose true values cannot be found out, or one that cannot describe this robot.
    """
    if type(parameters) is FullParameters:
        return FullParameters(robot)
    if type(parameters) is FrictionParameters:
        rigid = same_parameters(parameters.base, robot)
        return FrictionParameters(robot, parameters.friction, rigid, parameters.armature)
    if isinstance(parameters, LinearParameters) and type(parameters) in (LinearParameters, BaseParameters):
        theta = fitted(parameters.matrix, states_of(robot), robot.inertial_parameters)
        return LinearParameters(robot, parameters.matrix, theta, parameters.names)
    raise InputError(
        f"expected full, linear or friction parameters, found {type(parameters).__name__} "
        f"for robot '{robot.name}'; vary them with a function of your own",
        subject="true parameters",
        found=type(parameters).__name__,
    )


def fitted(matrix: np.ndarray, Y: np.ndarray, pi: np.ndarray) -> np.ndarray:
    """theta for which Y B theta is Y pi, by least squares.

    Args:
        matrix: B, (10 bodies, P).
        Y: regressors at many states, one below the other, see `states_of`.
        pi: inertial parameters, (10 bodies,).
    """
    return np.linalg.lstsq(Y @ matrix, Y @ pi, rcond=None)[0]


def states_of(robot: Robot) -> np.ndarray:
    """Regressors of a robot at random states, one below the other, which do not depend on its inertia."""
    rng = np.random.default_rng(0)
    states = rng.uniform(-2, 2, (20, 3, robot.nv))
    return np.concatenate([robot.regressor(q, v, v, a) for q, v, a in states])


def robots_of(cell: Cell, robot: int | None) -> list[int]:
    """One of the robots of a cell, counted from 0, or all of them.

    Raises:
        InputError: it has no such robot.
    """
    return [*range(cell.n)[slice_of("robot", robot, cell.n)]]


def _network(experiment: Experiment) -> Network:
    """The network of an experiment, whose settings are known.

    Raises:
        InputError: it is of another kind.
    """
    network = experiment.network
    if isinstance(network, Network):
        return network
    if not isinstance(network, Ideal | None):
        raise InputError.expected("a Network, which has settings", type(network).__name__, "network")
    return Network()


def _with_members(
    experiment: Experiment, change: Callable[[int, Member], Member], robot: int | None
) -> Experiment:
    cell = experiment.cell
    members = list(cell.members)
    for i in robots_of(cell, robot):
        members[i] = change(i, members[i])
    return replace(experiment, cell=Cell(members, cell.coupling, cell.space, cell.name, cell.clocks))


def _with_estimates(
    experiment: Experiment, estimate: Callable[[np.ndarray, np.ndarray], np.ndarray], robot: int | None
) -> Experiment:
    cell = experiment.cell

    def change(i: int, member: Member) -> Member:
        theta = cell.parameters[i].theta
        return replace(member, theta_hat0=estimate(theta, cell.theta_hat0[i, : len(theta)]))

    return _with_members(experiment, change, robot)


def _with_disturbance(
    experiment: Experiment, disturbance: int, change: Callable[[Disturbance], Disturbance]
) -> Experiment:
    disturbances = list(experiment.disturbances)
    here = slice_of("disturbance", disturbance, len(disturbances))
    disturbances[here] = [change(d) for d in disturbances[here]]
    return replace(experiment, disturbances=disturbances)


def slice_of(what: str, given: int | None, count: int) -> slice:
    """One of so many, counted from 0, or all of them.

    Raises:
        InputError: there are not so many.
    """
    if given is None:
        return slice(None)
    k = index(what, given, count)
    return slice(k, k + 1)
