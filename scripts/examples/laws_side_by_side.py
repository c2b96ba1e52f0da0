"""The field's laws side by side, at equal peak torque: with more gain every law tracks better.

`compare` turns the free gain of each law until its quiet run takes as much torque as the paper's; then all
are pushed.
"""

from example import arguments

from synctrl.analysis import compare
from synctrl.control.laws import ChungSlotine, ComputedTorque, MasterSlave, SlotineLi
from synctrl.experiments import planar_four
from synctrl.show.law_figures import comparison_figure
from synctrl.show.plots import save

out, short = arguments(__doc__)
laws = [SlotineLi(), ChungSlotine(5.0), MasterSlave(), ComputedTorque()]
experiment = planar_four() if short else planar_four(disturbance="torque")
found = compare(
    experiment, laws[: 1 if short else None], ["equal peak torque"], duration=0.1 if short else 1.5, dt=1e-3
)
print(found)
save(comparison_figure(found), out / "laws_side_by_side")
