# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Taking it to a robot
#
# `simulate` moves the robots itself. A real cell moves by itself, and wants from a controller one thing:
# the torque for the next period, in time. Two UR5 that move their hands together go this way here, step by
# step, as far as one can go without the arms.
#
# You will learn
#
# - how long the period may be, and what encoders and motors cost, before anything is switched on;
# - to call the controller in a loop of your own, and why it is the one that was simulated;
# - to drive robots that somebody else computes: MuJoCo stands in for the cell;
# - what happens when a sample is late, lost or nonsense, and how to stop and go on;
# - to give every robot a controller of its own that hears of the others by messages.
#
# You need `pip install '.[compiled,mujoco,notebooks]'` and a C compiler; `ENGINE = "pinocchio"` does
# without the latter, and takes many times as long.

# %%
# %matplotlib inline

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
from IPython.display import display

from synctrl import Message, Network, mujoco_model
from synctrl.analysis import delay_margin
from synctrl.errors import InputError, SimulationError
from synctrl.experiments import ur5_payload
from synctrl.show import scene_of
from synctrl.show.curves import Curves, overlay
from synctrl.show.plots import new_figure, style
from synctrl.simulation.devices import DeadTime, DifferencedVelocity, Lag, Quantisation

# %%
DURATION = 2.0  # s
ENGINE = "compiled"

experiment = ur5_payload()
cell = experiment.cell
print(cell)


def hands(result):
    """How far the hands are from where they should be to each other, and how hard the motors work."""
    apart = 1e3 * np.linalg.norm(result.sync_error[:, 0, :3], axis=1, keepdims=True)
    torque = np.abs(result.tau[:, 0, -3:])
    return [
        Curves("hands against each other", "mm", apart, ["|ε|"]),
        Curves("robot 1", "N·m", torque, ["joint 4", "joint 5", "joint 6"]),
    ]


# %% [markdown]
# ## How long may the period be?
#
# A digital controller measures, computes, and holds the torque until the next sample, T later. A mode that
# dies out with rate λ then goes by the factor $1 - \lambda T$ per period, and begins to swing ever more
# where $\lambda T > 2$. The fastest modes are those of the damping, the eigenvalues of $M^{-1} K_r$.
# `control_period` simulates it.

# %%
M, K_r = cell.robots[0].mass_matrix(cell.q0[0]), np.diag(experiment.gains.K_r)
fastest = np.linalg.eigvals(np.linalg.solve(M, K_r)).real.max()
print(f"the fastest mode of M⁻¹K_r: {fastest:.0f} 1/s, so T has to be below {2e3 / fastest:.0f} ms")

sampled = {}
for period in (2e-3, 8e-3, 16e-3, 24e-3):
    try:
        run = experiment.simulate(DURATION, control_period=period, engine=ENGINE)
        sampled[f"T = {1e3 * period:g} ms"] = run
        print(f"{1e3 * period:g} ms: largest e {np.abs(run.tracking_error[-100:]).max():.2e} at the end")
    except SimulationError as stop:
        print(f"{1e3 * period:g} ms: {str(stop).splitlines()[0]}")

# %%
display(overlay(hands, sampled))

# %% [markdown]
# The bound is necessary and not enough, for the coupling and what is learned are in the loop too: a run
# that stops says which gain it was. `Gains.suggest(cell, bandwidth=8.0, period=2e-3)` takes the period into
# account from the beginning.
#
# ## Encoders and motors
#
# An encoder counts: 2²⁰ steps per turn. Velocities are differences of what it says, through a filter. The
# torque comes a millisecond late, and the motor takes half a millisecond to follow. All of this is a list.

# %%
PERIOD = 2e-3  # s
sensors = [Quantisation(2 * np.pi / 2**20), DifferencedVelocity(omega=500.0)]
actuators = [DeadTime(1e-3), Lag(0.5e-3)]
equipped = replace(experiment, sensors=sensors, actuators=actuators)
real = equipped.simulate(DURATION, dt=5e-4, control_period=PERIOD, engine=ENGINE)
display(overlay(hands, {"T = 2 ms": sampled["T = 2 ms"], "with encoders and motors": real}))

# %% [markdown]
# ## In a loop of your own
#
# `experiment.controller(period)` is the object that sampled simulation asks at every sample. It is given
# the time and what was measured, q and v with a row per robot, and returns the torque. Fed with the states
# of a run it gives the torques of that run, to the last bit.

# %%
SHORT = min(DURATION, 0.2)  # s
controller = experiment.controller(PERIOD)
run = experiment.simulate(SHORT, control_period=PERIOD, log_dt=PERIOD)
controller.reset(run.t[0], run.q[0], run.v[0])
torques = [controller.step(t, q, v) for t, q, v in zip(run.t, run.q, run.v, strict=True)]
print("the same torques:", np.array_equal(torques, run.tau))

# %% [markdown]
# A driver for your robots needs two methods, `read` and `command`. Here is one whose robots are in MuJoCo,
# which has its own idea of rigid bodies and knows nothing of ours; the loop below would look the same for a
# real cell. A real `read` waits for the next cycle.


# %%
class InMuJoCo:
    """Robots that MuJoCo moves, with a driver's face."""

    def __init__(self, cell, period, steps=2):
        self.model, self.joints = mujoco_model(cell, timestep=period / steps)
        self.data, self.steps = mujoco.MjData(self.model), steps
        self.joints.write(self.data, cell.q0, cell.v0)

    def read(self):
        return self.data.time, *self.joints.read(self.data)

    def command(self, tau):
        self.joints.command(self.data, tau)
        mujoco.mj_step(self.model, self.data, nstep=self.steps)


def hands_apart(t, q):
    """How far the hands are from where they should be to each other, mm, from joint positions alone."""
    desired = cell.references([t])[0].desired[0, :, :3]
    e = desired - [robot.tip_position(own) for robot, own in zip(cell.robots, q, strict=True)]
    return 1e3 * np.linalg.norm(e[0] - e[1])


def drive(robots, controller, until):
    """Periods until then; returns t and how far the hands were apart, (periods, 2)."""
    seen = []
    while robots.read()[0] < until - 1e-9:
        t, q, v = robots.read()
        robots.command(controller.step(t, q, v))
        seen.append((t, hands_apart(t, q)))
    return np.array(seen)


robots = InMuJoCo(cell, PERIOD)
controller.reset(*robots.read())
driven = drive(robots, controller, DURATION)
print(f"MuJoCo, {len(driven)} periods: hands apart by {driven[-1, 1]:.3f} mm at the end")

# %% [markdown]
# `controller.signals` has everything that the last step computed, under its name: `e`, `epsilon`,
# `theta_hat`, and so on. Beside the simulation:

# %%
simulated = sampled["T = 2 ms"]
with style():
    figure, ((panel,),) = new_figure(2.6)
    panel.semilogy(
        simulated.t, 1e3 * np.linalg.norm(simulated.sync_error[:, 0, :3], axis=1), label="simulate"
    )
    panel.semilogy(*driven.T, "--", label="MuJoCo, in our own loop")
    panel.set(xlabel="time, s", ylabel="hands apart, mm")
    panel.legend()
figure

# %% [markdown]
# ## When something goes wrong
#
# With `faults="error"`, as above, the controller refuses what it cannot use: a sample that is late by more
# than a tenth of a period, one that is missing, a number that is none. With `faults="hold"` it repeats the
# last torque, learns nothing, and counts. For how long that may go on is for you to say: watch `held`, and
# stop.

# %%
t, q, v = robots.read()
try:
    controller.step(t + 3 * PERIOD, q, v)
except InputError as error:
    print(error)

patient = experiment.controller(PERIOD, faults="hold")
robots = InMuJoCo(cell, PERIOD)
patient.reset(*robots.read())
drive(robots, patient, SHORT / 2)
last = patient.signals.tau.copy()
for _ in range(3):  # an encoder that says nothing for three periods
    t, q, v = robots.read()
    robots.command(patient.step(t, q, np.full_like(v, np.nan)))
print("held:", patient.held)
drive(robots, patient, SHORT)
print(f"and on it goes: hands apart by {1e3 * np.linalg.norm(patient.signals.epsilon[0, :3]):.2f} mm")

# %% [markdown]
# Many robots add the torque of gravity by themselves: `experiment.controller(PERIOD,
# include_gravity=False)` takes it off. Limits of torque are those of the robots' descriptions if the
# experiment has `saturate=True`.
#
# ## Stopping and going on
#
# What was learned is too good to be thrown away. `save` writes all that the next step depends on, and
# `load` reads it into another controller, which goes on as the first one would have.

# %%
Path("out").mkdir(exist_ok=True)
patient.save("out/controller.npz")
another = experiment.controller(PERIOD, faults="hold")
another.load("out/controller.npz")
sample = robots.read()
print("the same next torque:", np.array_equal(another.step(*sample), patient.step(*sample)))

# %% [markdown]
# ## A controller for each robot
#
# Robots that stand apart have computers of their own. `agents(period)` gives an `Agent` for each: it knows
# its own robot, and of the others what their messages say. A sample has two halves: `tell` gives the
# messages that are due, `step` takes those that came. Between them is your wire; here it is bytes, and one
# message in ten is lost.

# %%
talking = replace(experiment, network=Network(period=PERIOD))
agents = talking.agents(PERIOD)
robots = InMuJoCo(cell, PERIOD)
rng, sent, lost, apart = np.random.default_rng(0), 0, 0, []
while robots.read()[0] < DURATION / 2:
    t, q, v = robots.read()
    messages = [m for agent, *own in zip(agents, q, v, strict=True) for m in agent.tell(t, *own)]
    wire = [m.to_bytes() for m in messages if t == 0 or rng.random() > 0.1]
    sent, lost = sent + len(messages), lost + len(messages) - len(wire)
    came = [Message.from_bytes(data) for data in wire]
    tau = [
        agent.step(t, *own, [m for m in came if m.sender in agent.hears])
        for agent, *own in zip(agents, q, v, strict=True)
    ]
    robots.command(np.array(tau))
    apart.append((t, hands_apart(t, q)))
print(
    f"{sent} messages of {len(wire[0])} bytes, {lost} lost; hands apart by {apart[-1][1]:.3f} mm at the end"
)
with style():
    figure, ((panel,),) = new_figure(2.6)
    panel.semilogy(*driven.T, label="one controller")
    panel.semilogy(*np.array(apart).T, "--", label="two agents, one message in ten lost")
    panel.set(xlabel="time, s", ylabel="hands apart, mm")
    panel.legend()
display(figure)
print(delay_margin(cell, experiment.gains))

# %% [markdown]
# How much delay and loss the cell takes can be known before: [how much delay can this cell
# take?](delay.ipynb)
#
# ## In motion
#
# With encoders and motors, as it would be on the desk.

# %%
scene_of(real)

# %% [markdown]
# ## Before you switch it on
#
# 1. Does the model stand? Compare `robot.gravity(q)` with the torque that your robot needs to stand still,
#    in several poses.
# 2. Is the order of joints the robot's, and the sign of every one? Move one joint by hand, and read.
# 3. Simulate with your period, your encoders, your delays, and a load that nobody tells of; certify the
#    run.
# 4. Begin with gains for a low bandwidth, `Gains.suggest(cell, bandwidth=2.0, period=...)`, with limits of
#    torque far below those of the motors, and with Γ = 0 for the first minutes.
# 5. Decide what stops the cell: `held` above a number, |e| above a number, a person.
#
# This package has been run on no robot; the list is what we would do, not what was done.
#
# ## Exercises
#
# 1. At which period does the run of the first section stop? Halve `K_r` of the last joint and look again.
# 2. Let the encoder have 2¹² counts. What do the last joints do, and which `omega` of the filter makes them
#    quiet?
# 3. Lose half of the messages, then nine of ten. What does `Network(receiver="filter")` change?
# 4. Write `InMuJoCo.read` so that every hundredth sample comes 1 ms late. What does each of `faults=` make
#    of it?
# 5. Put a box of 1 kg into the hand of robot 2 in MuJoCo's model, and tell the controller nothing.
#
# ## Further
#
# [A loop of your own](../docs/own_loop.md) has every detail of time, faults, saving and agents; [sensors
# and actuators](../docs/devices.md) has all parts and how to write more. `scripts/agents_over_a_pipe.py`
# has two arms in two processes.
