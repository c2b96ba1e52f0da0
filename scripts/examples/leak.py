"""A leak: what the integral of the paper's law does where an error cannot vanish, and how it forgets.

Two arms hold 4 kg between them, and one is wrong by a millimetre about where. The integral pulls until the
fixtures have given that millimetre; one that leaks does not.
"""

import numpy as np
from example import arguments

from synctrl.experiments import carry_ur5
from synctrl.show.assembly_figures import internal_force_curves
from synctrl.show.curves import overlay
from synctrl.show.plots import save

out, short = arguments(__doc__)
cells = {
    "independent": carry_ur5(synchronized=False, geometric_error=True),
    "synchronized": carry_ur5(geometric_error=True),
    "with a leak": carry_ur5(geometric_error=True, leak=True),
}
duration = 0.02 if short else 2.5
runs = {name: cell.simulate(duration, dt=2e-3, log_dt=1e-2) for name, cell in cells.items()}
for name, run in runs.items():
    force = np.linalg.norm(run.outputs["internal_force"][-1, 0, :3])
    print(f"{name}: {force:.1f} N inside at the end")
save(overlay(lambda run: internal_force_curves(run)[:1], runs), out / "leak")  # without the moments
