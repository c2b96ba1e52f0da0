"""A cell in a file: TOML, which `synctrl run cell.toml` takes as well, and nothing in it is ever executed.

What is wrong in a file is said with line and key, and with the names that are near.
"""

from example import arguments

from synctrl import Experiment
from synctrl.cells import CellFileError
from synctrl.show import scene_of
from synctrl.show.plots import save

CELL = """
name = "two arms, two circles"
duration = 2.0
space = { kind = "cartesian", axes = "xy" }
coupling = "pair"
gains = { Lambda = 10.0, beta = 20.0, K_r = 0.5, K_eps = 20.0, Gamma = 2.0 }

[[robots]]
name = "left"
robot = "planar2r"
base = { xyz = [-0.35, 0.0, 0.0] }
known = 0.7
motion = { kind = "circle", center = [-0.15, 0.35], radius = 0.08, speed = "90 deg" }

[[robots]]
name = "right"
robot = "planar2r"
base = { xyz = [0.35, 0.0, 0.0] }
known = 0.7
motion = { kind = "circle", center = [0.15, 0.35], radius = 0.08, speed = "90 deg" }
"""
out, short = arguments(__doc__)
file = out / "cell.toml"
file.write_text(CELL.replace("coupling", "cuopling"))
try:
    Experiment.from_file(file)
except CellFileError as error:
    print(error)
file.write_text(CELL)
run = Experiment.from_file(file).simulate(0.05 if short else None)
scene_of(run).write(out / "cell_from_file.html")
save(run.plot("path")["path"], out / "cell_from_file")
