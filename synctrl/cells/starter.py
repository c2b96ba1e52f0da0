"""A cell file to start from, which says what each line is for."""

from __future__ import annotations

STARTER = """\
# A cell of two planar arms that move together. All numbers are in SI units: m, kg, s, N·m, rad. Angles may
# also be texts in degrees, such as "90 deg".
# Run it:  synctrl run cell.toml -o out/          What may stand here: docs/cell_files.md

name = "my first cell"
duration = 6.0                                    # s

# Where the task is given: "joint", "pose", or positions of the tips along some axes.
space = { kind = "cartesian", axes = "xy" }

# ---- robots: one [[robots]] for each ---------------------------------------------------------------------

[[robots]]
name = "left"
robot = "planar2r"                                # a name, or a file beside this one: "arm.urdf", "arm.xacro"
base = { xyz = [-0.35, 0.0, 0.0] }                # where it stands; rpy = [0.0, 0.0, "90 deg"] turns it
known = 0.7                                       # how much of its masses the controller knows at the start
friction = { viscous = 0.02, coulomb = 0.02 }     # which the controller does not know
motion = { kind = "circle", center = [-0.15, 0.35], radius = 0.08, speed = "90 deg" }
v0 = "path"                                       # it starts as fast as its path; without this line, at rest

[[robots]]
name = "right"
robot = "planar2r"
base = { xyz = [0.35, 0.0, 0.0] }
known = 0.7
friction = { viscous = 0.02, coulomb = 0.02 }
motion = { kind = "circle", center = [0.15, 0.35], radius = 0.08, speed = "90 deg" }
v0 = "path"

# ---- control ---------------------------------------------------------------------------------------------

[coupling]                                        # which robots are compared: epsilon = e_1 - e_2
kind = "pair"

[gains]
Lambda = 5.0                                      # how fast errors vanish, 1/s
beta = 10.0                                       # weight of the synchronization errors, 1/s; 0 is without
K_r = 5.0                                         # damping of the joints, N·m·s/rad
K_eps = 20.0                                      # stiffness between the robots
Gamma = 2.0                                       # how fast the controller learns

# ---- what happens ----------------------------------------------------------------------------------------

[[disturbances]]                                  # something pushes against one arm
robot = "left"
torque = 1.0                                      # on every joint, N·m
start = 2.0                                       # s
stop = 2.2
"""
