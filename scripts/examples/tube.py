"""A tube that is known before the run: all errors of all robots stay in it, and clear of singular postures.

Two arms hold a rigid object, example 1 of the paper. The figure shows a run inside the tube of its robot.
"""

from example import arguments

from synctrl.analysis import tube
from synctrl.experiments import rigid_object
from synctrl.show.plots import save
from synctrl.show.tube_figures import tube_figure

out, short = arguments(__doc__)
experiment = rigid_object(disturbed=False)
duration = 0.1 if short else experiment.duration
found = tube(experiment.cell, experiment.gains, duration=duration)
print(found)
run = experiment.simulate(duration, dt=2e-3)
save(tube_figure(found, experiment.cell, run, robot=0), out / "tube")
