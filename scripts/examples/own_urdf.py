"""An arm of your own: a URDF file is all that is needed, here one that is written on the spot.

What a file leaves out or has wrong is said with file and line; `robot.report` has it too.
"""

from example import arguments

from synctrl import Cell, Coupling, Cubic, Gains, Member, load_robot, simulate
from synctrl.show import scene_of
from synctrl.show.plots import save

out, short = arguments(__doc__)
LINK = """<link name="link{k}"><inertial><origin xyz="0 0 0.2"/><mass value="3"/>
  <inertia ixx="0.04" iyy="0.04" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.05" length="0.4"/></geometry></visual>
  </link>"""
JOINT = """<joint name="joint{k}" type="revolute"><parent link="link{p}"/><child link="link{k}"/>
  <origin xyz="0 0 {z}"/><axis xyz="{axis}"/>
  <limit lower="-3" upper="3" velocity="3" effort="80"/></joint>"""
parts = ['<link name="link0"/>']
for k, axis in enumerate(("0 0 1", "0 1 0", "0 1 0"), start=1):
    parts += [LINK.format(k=k), JOINT.format(k=k, p=k - 1, z=0.4 * (k > 1), axis=axis)]
file = out / "own_arm.urdf"
file.write_text(f'<robot name="own">{"".join(parts)}</robot>')

arm = load_robot(file, tip="link3")
way = Cubic([0.0, 0.3, 0.4], [1.2, 0.9, 0.9], duration=1.0)
members = [
    Member(arm.placed((0, y, 0)), way, q0=[0.05 * y, 0.3, 0.4], theta_hat0=0.7 * arm.inertial_parameters)
    for y in (0.0, 1.2, 2.4)
]
cell = Cell(members, Coupling.chain(3), name="arms of my own")
run = simulate(cell, Gains.suggest(cell, bandwidth=8.0), duration=0.05 if short else 2.0, dt=2e-3)
scene_of(run).write(out / "own_urdf.html")
save(run.plot("sync_error")["sync_error"], out / "own_urdf")
