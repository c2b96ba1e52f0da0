"""A first robot: load it by name, move it, and ask what gravity wants of its joints.

Names are those of the catalogue, such as "ur5"; the path of a URDF file of yours does as well.
"""

import numpy as np
from example import arguments

from synctrl import Cubic, load_robot
from synctrl.show.plots import new_figure, save, style
from synctrl.show.scene import Scene

out, short = arguments(__doc__)
robot = load_robot("ur5")
print(f"{robot.name}: {robot.nv} joints, {robot.inertial_parameters[::10].sum():.1f} kg")

way = Cubic([0.0, -2.0, 2.0, -1.6, -1.6, 0.0], [1.5, -0.6, 0.8, -1.8, -1.6, 0.0], duration=2.0)
times = np.linspace(0.0, 2.0, 5 if short else 61)
q = way(times).x  # rad, a row for each instant
gravity = np.array([robot.gravity(each) for each in q])  # N·m
tip = np.array([robot.tip_position(each) for each in q])  # m, in the world

scene = Scene(fps=30, title="A first robot", caption="A UR5 that swings; the line is the way of its tip.")
scene.add_robot("UR5", robot.model, robot.visual, q)
scene.add_line("way of the tip", tip, "#b3001b", 0.006)
scene.write(out / "first_robot.html")

with style():
    figure, axes = new_figure(3.0)
    axes[0, 0].plot(times, gravity, label=robot.joint_names)
    axes[0, 0].set(xlabel="time, s", ylabel="torque of gravity, N·m", xlim=(0, 2))
    figure.legend(loc="outside upper center", ncols=3)
save(figure, out / "first_robot")
