"""Figures for a paper: a column of a journal wide, to be read in grey, with letters embedded.

`style="ieee"` is all it takes; `style="slides"` is for the last row of a hall.
"""

from example import arguments

from synctrl.experiments import planar_four
from synctrl.show import overlays
from synctrl.show.plots import save

out, short = arguments(__doc__)
runs = {
    name: planar_four(name == "synchronized", disturbance="torque").simulate(
        0.1 if short else 2.0, dt=5e-4, log_dt=5e-3
    )
    for name in ("independent", "synchronized")
}
runs["synchronized"].plot("sync_error", "torque", style="ieee").save(out / "for_a_paper")
figures = overlays(runs, "sync_error", style="ieee")
save(figures["sync_error"], out / "for_a_paper", ("png", "pdf"))
