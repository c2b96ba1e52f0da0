"""Two arms carry one thing: bodies that touch, fixtures that give a little, and the force inside.

Neither arm knows the mass of the box, and none feels a force. The arrows of the animation are the internal
force: what the hands do to the box beyond carrying it.
"""

from example import arguments

from synctrl.experiments import carry_ur5
from synctrl.show import side_by_side
from synctrl.show.assembly_figures import internal_force_curves
from synctrl.show.curves import overlay
from synctrl.show.plots import save

out, short = arguments(__doc__)
runs = {
    name: carry_ur5(name == "synchronized").simulate(0.02 if short else 2.5, dt=2e-3, log_dt=1e-2)
    for name in ("independent", "synchronized")
}
side_by_side(runs).write(out / "carrying.html")
save(overlay(lambda run: internal_force_curves(run)[:1], runs), out / "carrying")
