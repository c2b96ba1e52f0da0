"""Base parameters: of sixty inertial parameters of a UR5 a motion can tell thirty-six combinations.

These are the fewest that give every torque. `parameters="base"` adapts them alone.
"""

import numpy as np
from example import arguments

from synctrl import BaseParameters, load_robot
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
with style():
    figure, axes = new_figure(3.4)
    for name in ("planar2r", "a460") if short else ("planar2r", "a460", "ur5", "panda"):
        robot = load_robot(name)
        found = BaseParameters(robot)
        label = f"{name}: {found.grouping.rank} of {robot.inertial_parameters.size}"
        print(f"{label}; the last one is {found.names[-1]}")
        values = np.maximum(found.grouping.singular_values, 1e-17)
        axes[0, 0].semilogy(np.arange(1, values.size + 1), values, "o-", ms=3, lw=0.8, label=label)
    axes[0, 0].set(xlabel="number", ylabel="singular value of the regressor")
    axes[0, 0].legend(loc="upper right")
save(figure, out / "base_parameters")
