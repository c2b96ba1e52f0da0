"""Two arms, each in a process of its own with its own simulated plant: all they share is a pipe for messages.

A third run has both arms in one process under one controller. The torques are the same, bit for bit.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from multiprocessing.connection import Connection

import numpy as np

from synctrl import (
    Agent,
    Cell,
    Coupling,
    Cubic,
    Experiment,
    Gains,
    Member,
    Message,
    Network,
    Robot,
    load_robot,
)

PERIOD = 2e-3


def pair() -> Experiment:
    """Two planar arms that swing together, and begin apart."""
    arm = load_robot("planar2r")
    swing = Cubic([0.3, 1.0], [0.8, 0.6], 0.5)
    members = [Member(arm.placed((x, 0, 0)), swing, q0=q) for x, q in ((0.0, [0.2, 1.1]), (1.5, [0.3, 1.0]))]
    gains = Gains(Lambda=10.0, beta=5.0, K_r=4.0, K_eps=2.0, Gamma=0.5)
    return Experiment(Cell(members, Coupling.pair()), gains, 0.5, network=Network(PERIOD))


def moved(robot: Robot, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where a robot is one period later."""
    v = v + PERIOD * robot.forward_dynamics(q, v, tau)
    return q + PERIOD * v, v


def drive(
    agent: Agent, robot: Robot, q: np.ndarray, v: np.ndarray, steps: int, swap: Callable[[bytes], bytes]
) -> np.ndarray:
    """Torques of a robot, (steps, nv), whose agent sends a message and gets one in every period."""
    torques = []
    for k in range(steps):
        (message,) = agent.tell(k * PERIOD, q, v)
        heard = Message.from_bytes(swap(message.to_bytes()))
        torques.append(agent.step(k * PERIOD, q, v, [heard]))
        q, v = moved(robot, q, v, torques[-1])
    return np.array(torques)


def over(pipe: Connection) -> Callable[[bytes], bytes]:
    """Send what there is to say, and wait for the other side: here time is simulated, so nobody is late."""

    def swap(data: bytes) -> bytes:
        pipe.send_bytes(data)
        return pipe.recv_bytes()

    return swap


def elsewhere(pipe: Connection, agent: Agent, robot: Robot, q: np.ndarray, v: np.ndarray, steps: int) -> None:
    """What the other process does; at the end it says what it did."""
    pipe.send_bytes(drive(agent, robot, q, v, steps, over(pipe)).tobytes())


def apart(experiment: Experiment, steps: int) -> np.ndarray:
    """Torques of two agents in two processes, (steps, 2, nv)."""
    cell, (first, second) = experiment.cell, experiment.agents(PERIOD)
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    start = cell.robots[1], cell.q0[1], cell.v0[1], steps
    process = context.Process(target=elsewhere, args=(there, second, *start))
    process.start()
    there.close()
    own = drive(first, cell.robots[0], cell.q0[0], cell.v0[0], steps, over(here))
    other = np.frombuffer(here.recv_bytes()).reshape(own.shape)
    process.join()
    return np.stack((own, other), axis=1)


def together(experiment: Experiment, steps: int) -> np.ndarray:
    """Torques of one controller for both robots, (steps, 2, nv)."""
    controller, robots = experiment.controller(PERIOD), experiment.cell.robots
    q, v, torques = experiment.cell.q0, experiment.cell.v0, []
    for k in range(steps):
        torques.append(controller.step(k * PERIOD, q, v))
        states = [moved(*one) for one in zip(robots, q, v, torques[-1], strict=True)]
        q, v = (np.array(part) for part in zip(*states, strict=True))
    return np.array(torques)


if __name__ == "__main__":
    one, two = together(pair(), 250), apart(pair(), 250)
    print(f"largest torque {np.abs(one).max():.3f} N·m, largest difference {np.abs(one - two).max():g} N·m")
