"""A certificate: V and V' along a run, each by its terms, and what the theorem says of it.

V falls by damping while nothing acts from outside; the push is a power of its own, and the verdict says so.
"""

from example import arguments

from synctrl.analysis import certify
from synctrl.experiments import planar_four
from synctrl.show.lyapunov_plots import lyapunov_figure
from synctrl.show.plots import save

out, short = arguments(__doc__)
run = planar_four(disturbance="torque").simulate(0.1 if short else 1.5, dt=5e-4)
certificate = certify(run)
print(certificate)
save(lyapunov_figure(certificate.lyapunov), out / "certify")
