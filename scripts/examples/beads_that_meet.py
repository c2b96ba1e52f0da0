"""Two beads that meet: two arms spread adhesive on one path, from its ends, and one is pushed back.

What is compared is the gap between the nozzles, the more the closer they are: however late, nothing
collides.
"""

from example import arguments

from synctrl.experiments import bead_on_path
from synctrl.show import scene_of
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
engine, duration, log_dt = ("pinocchio", 2e-3, 1e-4) if short else ("compiled", 5.0, 1e-2)
with style():
    figure, axes = new_figure(2.8)
    for mode in ("independent", "gap", "gap_weighted"):
        run = bead_on_path(mode).simulate(duration, dt=1e-4, log_dt=log_dt, engine=engine)
        axes[0, 0].plot(run.t, 1e3 * run.outputs["gap_error"], label=mode.replace("_", " "))
    axes[0, 0].set(xlabel="time, s", ylabel="gap less what is planned, mm")
    axes[0, 0].legend()
save(figure, out / "beads_that_meet")
scene_of(run).write(out / "beads_that_meet.html")
