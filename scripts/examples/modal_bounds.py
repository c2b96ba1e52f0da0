"""What beta does, mode by mode: weighted errors of a run inside the bounds of Theorem B.

The modes are those of the coupling. What all robots have in common is left alone; what differs is pressed
down.
"""

from example import arguments

from synctrl.analysis import modal_bounds
from synctrl.experiments import planar_four
from synctrl.show.modal_figures import modal_figure
from synctrl.show.plots import save

out, short = arguments(__doc__)
bounds = modal_bounds(planar_four(disturbance="torque").simulate(0.1 if short else 1.5, dt=5e-4))
print(bounds)
save(modal_figure(bounds), out / "modal_bounds")
