"""Tuning for two goals: the front between being together and sparing torque, and its knee.

Every point of the front is a set of gains to which no other is preferable in both.
"""

from example import arguments

from synctrl.experiments import planar_four
from synctrl.show.front_figures import front_figure
from synctrl.show.plots import save
from synctrl.sweep import LogUniform
from synctrl.tune import tune

out, short = arguments(__doc__)
ranges = {"beta": LogUniform(5, 150), "K_eps": LogUniform(0.1, 10), "Lambda": LogUniform(2, 50)}
size = {"generations": 1, "population": 5, "duration": 0.02} if short else {"duration": 1.0}
found = tune(
    planar_four(),
    ranges,
    minimize=("sync_rms", "peak_torque"),
    limits={"step_error": 0.002},
    workers=1,
    progress=False,
    dt=1e-3,
    **size,
)
print(found)
save(front_figure(found), out / "tuning_front")
