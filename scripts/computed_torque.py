"""Computed torque on one arm, by three libraries, with the same fourth-order method and the same gains.

tau = M (xd'' + K_d e' + K_p e) + C v + g in joint space, evaluated in all four stages. It has no estimates
and no neighbours: much less than the adaptive law, and a task that every library of the field can do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

from synctrl import Cubic, Robot
from synctrl.robots.urdf.writer import dynamics_xml

K_P, K_D = 100.0, 20.0


class Task:
    """One arm and its desired motion, off the path by 0.05 rad at the start.

    Args:
        robot: the arm.
        start: joint positions, (nv,), rad.
        duration: of the motion, s.
    """

    def __init__(self, robot: Robot, start: np.ndarray, duration: float):
        self.robot, self.path = robot, Cubic(start, start + 0.3, duration)
        self.q0, self.v0 = start + 0.05, np.zeros(robot.nv)

    def table(self, steps: int, dt: float) -> np.ndarray:
        """Desired position, velocity and acceleration at every half step, (2 steps + 1, 3, nv)."""
        return np.stack(self.path(np.arange(2 * steps + 1) * dt / 2), axis=1)


def wanted(desired: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """xd'' + K_d e' + K_p e, (nv,)."""
    return desired[2] + K_D * (desired[1] - v) + K_P * (desired[0] - q)


class Fixed:
    """The classical Runge-Kutta method around a library that computes v' from q, v and what is desired."""

    def __init__(self, task: Task):
        self.task = task

    def acceleration(self, q: np.ndarray, v: np.ndarray, desired: np.ndarray) -> np.ndarray:
        """v' under computed torque, (nv,)."""
        raise NotImplementedError

    def run(self, steps: int, dt: float) -> np.ndarray:
        """Joint positions at the end, (nv,)."""
        table, nv = self.task.table(steps, dt), self.task.robot.nv
        y = np.concatenate((self.task.q0, self.task.v0))

        def rate(y: np.ndarray, desired: np.ndarray) -> np.ndarray:
            return np.concatenate((y[nv:], self.acceleration(y[:nv], y[nv:], desired)))

        for k in range(steps):
            start, middle, end = table[2 * k : 2 * k + 3]
            k1 = rate(y, start)
            k2 = rate(y + dt / 2 * k1, middle)
            k3 = rate(y + dt / 2 * k2, middle)
            k4 = rate(y + dt * k3, end)
            y = y + dt / 6 * (k1 + 2 * (k2 + k3) + k4)
        return y[:nv]


class Pinocchio(Fixed):
    """By `rnea` and `aba`."""

    def __init__(self, task: Task):
        super().__init__(task)
        self.model, self.data = task.robot.model, task.robot.model.createData()

    def acceleration(self, q: np.ndarray, v: np.ndarray, desired: np.ndarray) -> np.ndarray:
        tau = pin.rnea(self.model, self.data, q, v, wanted(desired, q, v))
        return pin.aba(self.model, self.data, q, v, tau)


class Drake(Fixed):
    """By a `MultibodyPlant` that reads the arm's URDF; Drake has no classical Runge-Kutta method."""

    def __init__(self, task: Task):
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.plant import MultibodyPlant
        from pydrake.multibody.tree import MultibodyForces

        super().__init__(task)
        plant = self.plant = MultibodyPlant(0.0)
        arm = Parser(plant).AddModelsFromString(dynamics_xml(task.robot.document), "urdf")[0]
        if "world" not in {link.name for link in task.robot.document.links}:
            plant.WeldFrames(plant.world_frame(), plant.get_body(plant.GetBodyIndices(arm)[0]).body_frame())
        plant.mutable_gravity_field().set_gravity_vector(task.robot.gravity_vector)
        plant.Finalize()
        self.context, self.forces = plant.CreateDefaultContext(), MultibodyForces(plant)
        self.input = plant.get_applied_generalized_force_input_port()
        self.output = plant.get_generalized_acceleration_output_port()

    def acceleration(self, q: np.ndarray, v: np.ndarray, desired: np.ndarray) -> np.ndarray:
        plant, context = self.plant, self.context
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        plant.CalcForceElementsContribution(context, self.forces)
        self.input.FixValue(context, plant.CalcInverseDynamics(context, wanted(desired, q, v), self.forces))
        return self.output.Eval(context)


class Mujoco:
    """By `mj_step` with MuJoCo's own Runge-Kutta method, the control in its callback."""

    def __init__(self, task: Task):
        import mujoco

        from synctrl.simulation.mujoco import MujocoArm

        self.mujoco, self.task, self.model = mujoco, task, MujocoArm(task.robot).model
        self.model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        self.data, self.torque = mujoco.MjData(self.model), np.zeros(task.robot.nv)

    def run(self, steps: int, dt: float) -> np.ndarray:
        """Joint positions at the end, (nv,)."""
        mujoco, model, data = self.mujoco, self.model, self.data
        table, half = self.task.table(steps, dt), dt / 2
        model.opt.timestep = dt
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = self.task.q0, self.task.v0

        def control(model: Any, data: Any) -> None:
            acceleration = wanted(table[round(data.time / half)], data.qpos, data.qvel)
            mujoco.mj_mulM(model, data, self.torque, acceleration)
            data.qfrc_applied[:] = self.torque + data.qfrc_bias

        mujoco.set_mjcb_control(control)
        try:
            for _ in range(steps):
                mujoco.mj_step(model, data)
        finally:
            mujoco.set_mjcb_control(None)
        return data.qpos.copy()


PEERS: dict[str, Callable[[Task], Any]] = {"Pinocchio": Pinocchio, "MuJoCo": Mujoco, "Drake": Drake}


def installed(task: Task) -> dict[str, Any]:
    """The libraries that are here, ready to run the task."""
    found = {}
    for name, make in PEERS.items():
        try:
            found[name] = make(task)
        except ImportError:
            continue
    return found


def exact(task: Task, duration: float) -> np.ndarray:
    """Joint positions at the end by a method of order eight with tight tolerances, (nv,)."""
    from scipy.integrate import solve_ivp

    nv, arm = task.robot.nv, Pinocchio(task)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate((y[nv:], arm.acceleration(y[:nv], y[nv:], np.stack(task.path(t)))))

    y0 = np.concatenate((task.q0, task.v0))
    solution = solve_ivp(rate, (0, duration), y0, "DOP853", rtol=1e-12, atol=1e-13)
    return solution.y[:nv, -1]
