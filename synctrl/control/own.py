"""What one robot needs of the controller of a cell: one controller for each, that knows its own robot.

Whether the parts of a controller can be taken apart is found out, not believed: at one instant, away from
rest, the torque of every robot by itself is compared with that of all of them together.
"""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from ..coupling.own import own_cell
from ..errors import InputError
from .adaptation import Adaptation
from .controller import Controller
from .gains import RaggedGain
from .network import BoundPosted, Mailbox

#: settings of adaptations that may have a row per robot, with the number of their axes if they do
PER_ROBOT = {"Gamma": 2, "lower": 2, "upper": 2, "radius": 1}
#: of them, those with an entry per parameter
PER_PARAMETER = {"Gamma", "lower", "upper"}
#: how far from its start a robot is looked at, rad and rad/s, and the difference of torques that is rounding
AWAY, ROUNDING = 1e-2, 1e-9


def own_controllers(whole: Controller) -> tuple[Controller, ...]:
    """A controller for each robot of a cell.

    Args:
        whole: of all robots, with a `Network(period=...)` between them.

    Raises:
        InputError: another network, or a law or an adaptation of which no robot can do its part with its own
            errors and messages alone.
    """
    if getattr(whole.law, "needs_slips", False):
        raise _not_alone(whole, 0, "it needs r of others, which the messages of agents do not have")
    if type(whole.network) is not BoundPosted:
        found = whole.network_settings["name"]
        raise InputError.expected("one of messages for agents, Network(period=...)", found, "network")
    own = tuple(_own_controller(whole, i) for i in range(whole.cell.n))
    _compare(whole, own)
    return own


def _own_controller(whole: Controller, i: int) -> Controller:
    """The controller of robot i by itself."""
    cell, (learning, law) = own_cell(whole.cell, i), whole.unbound
    acts_on = cell.nv if whole.k_r_space == "joint" else cell.m
    try:
        return Controller(
            cell,
            whole.gains.replace(K_r=whole.K_r[i, :acts_on], Gamma=None),
            adaptation=own_adaptation(learning, i, [len(p.theta) for p in whole.cell.parameters]),
            law=law,
            network=Mailbox(whole.network, i),  # type: ignore[arg-type]
            torque_limits=whole.torque_limits[i : i + 1, : cell.nv],
            k_r_space=whole.k_r_space,
        )
    except InputError as error:
        raise _not_alone(whole, i, f"{error}") from error


def own_adaptation(adaptation: Adaptation, i: int, sizes: list[int]) -> Adaptation:
    """An adaptation with the rows of robot i, where its settings have rows.

    Args:
        adaptation: for all robots.
        i: which one, counted from 0.
        sizes: number of parameters of each, (n,).
    """
    own = copy(adaptation)
    for name, value in vars(adaptation).items():
        if name in PER_ROBOT:
            value = _row(name, value, i, len(sizes))
            value = value[: sizes[i]] if name in PER_PARAMETER and np.ndim(value) == 1 else value
        elif hasattr(value, "bind"):
            value = own_adaptation(value, i, sizes)
        setattr(own, name, value)
    return own


def _row(name: str, value: Any, i: int, n: int) -> Any:
    """What a setting says of robot i: its row, its matrix, or what it says of all."""
    if isinstance(value, tuple):
        return value[i : i + 1] if len(value) == n else value
    return value[i] if isinstance(value, RaggedGain) or np.ndim(value) == PER_ROBOT[name] else value


def _compare(whole: Controller, own: tuple[Controller, ...]) -> None:
    """Look at one instant whether robots by themselves do what they do together."""
    cell, network, rng = whole.cell, whole.network, np.random.default_rng(0)
    moved = AWAY * rng.standard_normal((2, cell.n, cell.nv))
    motion = np.stack((cell.q0, cell.v0))
    memory = network.start()
    memory += AWAY * rng.standard_normal(memory.shape)
    for i, robot in enumerate(cell.robots):
        motion[:, i, : robot.nv] += moved[:, i, : robot.nv]
    tau = _torque(whole, motion, memory)
    for i, controller in enumerate(own):
        mailbox: Any = controller.network
        nv = controller.cell.nv
        alone = _torque(controller, motion[:, i : i + 1, :nv], mailbox.share(memory, network))[0]
        if not np.allclose(alone, tau[i, :nv], ROUNDING, ROUNDING * np.abs(tau[i]).max(), equal_nan=True):
            raise _not_alone(whole, i, "it needs more of the others")


def _torque(controller: Controller, motion: np.ndarray, memory: np.ndarray) -> np.ndarray:
    """Torque at the beginning, (n, nv), N·m, for any memory of the network."""
    reference, z = controller.cell.references(np.zeros(1))[0], controller.adaptation.start()
    with np.errstate(all="ignore"):
        return controller.unchecked(reference, motion, z, memory).tau


def _not_alone(whole: Controller, i: int, why: str) -> InputError:
    parts = f"{whole.law_settings['name']} and {whole.adaptation_settings['name']}"
    return InputError(
        f"expected parts that need a robot's own errors and messages alone for agents, found {parts}, of "
        f"which {whole.cell.names[i]} cannot do its part by itself: {why}",
        subject="law",
        found=parts,
    )
