"""Handing over: one hand holds, then both do, then the other one alone.

Hands close and open at instants of a schedule; the plant says what each has to bear.
"""

from functools import partial

import numpy as np
from example import arguments

from synctrl import Cell, Coupling, Experiment, Gains, Hold, Member, load_robot
from synctrl.assembly.body import CarriedObject
from synctrl.assembly.grasp import Fixture, Grasp
from synctrl.assembly.handling import HandlingPlant
from synctrl.show import scene_of
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
first, last = (
    (0.01, 0.02) if short else (0.4, 0.8)
)  # s, from when the second hand holds, and until the first does
arm = load_robot("planar2r")
arms = arm.placed((-0.6, 0, 0), name="left"), arm.placed((0.6, 0, 0), (0, 0, np.pi), name="right")
q0 = [1.2, -1.6], [-1.2, 1.6]
hands = [robot.tip_pose(np.array(q)).translation for robot, q in zip(arms, q0, strict=True)]
plate = CarriedObject(mass=0.5, box=(0.43, 0.1, 0.02), name="plate")
fixture = Fixture(stiffness=(1e4, 200.0), damping=(50.0, 2.0))
grasps = [Grasp(0, compliance=fixture, until=last), Grasp(1, compliance=fixture, since=first)]
place = np.mean(hands, axis=0), np.eye(3)
members = [Member(robot, Hold(q), q0=q, name=robot.name) for robot, q in zip(arms, q0, strict=True)]
gains = Gains(Lambda=8, beta=8, K_r=2, K_eps=5, Gamma=0.1)
plant = partial(HandlingPlant, body=plate, grasps=grasps, at=place)
made = Experiment(Cell(members, Coupling.pair(), name="handing over"), gains, 1.5 * last, plant_type=plant)
run = made.simulate(dt=1e-4) if short else made.simulate(dt=1e-4, log_dt=5e-3, engine="compiled")
scene_of(run).write(out / "handing_over.html")
with style():
    figure, axes = new_figure(2.8)
    axes[0, 0].plot(run.t, run.outputs["hand_wrench"][..., 2], label=["left hand", "right hand"])
    axes[0, 0].set(xlabel="time, s", ylabel="force upwards, N")
    axes[0, 0].legend()
save(figure, out / "handing_over")
