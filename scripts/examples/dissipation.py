"""Where the energy of V went, below what Theorem A lets it be: a bound that holds under friction and pushes.

X is what damping has taken in all; D is what acts from outside the model, and known beforehand.
"""

from example import arguments

from synctrl.analysis import dissipation
from synctrl.experiments import planar_four
from synctrl.show.dissipation_figures import dissipation_figure
from synctrl.show.plots import save

out, short = arguments(__doc__)
found = dissipation(planar_four(disturbance="torque").simulate(0.1 if short else 1.5, dt=5e-4))
print(found)
save(dissipation_figure(found), out / "dissipation")
