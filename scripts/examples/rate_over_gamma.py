"""How fast errors vanish, over Gamma: the best rate, and where more learning harms.

Along a motion that repeats small errors of motion and of parameters are multiplied by a matrix once a
period. Its eigenvalues say it all.
"""

import numpy as np
from example import arguments

from synctrl import Cell, Coupling, Experiment, Gains, Member, SmoothTrajectory, load_robot
from synctrl.analysis import rates_over_gamma
from synctrl.show.plots import save
from synctrl.show.rate_figures import rates_figure

out, short = arguments(__doc__)
arm, turns = load_robot("planar2r"), 2 * np.pi * np.array([1.0, 2.0])


def swing(phase):
    return SmoothTrajectory(lambda t: [0.3, 1.0] + 0.5 * np.sin(turns * t + phase), duration=2.0)


members = [Member(arm, swing(k), parameters="base", name=f"arm {k + 1}") for k in range(2)]
gains = Gains(Lambda=6.0, beta=3.0, K_r=2.0, K_eps=0.4, Gamma=0.05)
experiment = Experiment(Cell(members, Coupling.pair()), gains, duration=2.0)
rates = rates_over_gamma(experiment, 1.0, np.geomspace(0.05, 20, 3 if short else 25))
print(rates)
save(rates_figure({"two arms that swing": rates}), out / "rate_over_gamma")
