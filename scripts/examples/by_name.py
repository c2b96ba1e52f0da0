"""Results by name: an xarray dataset knows robots, joints and units, and divides torques by their limits.

Two arms of six joints and two of seven share a task. Where an arm has no seventh joint there is no number,
and no bar. The same dataset goes into a netCDF file and comes back with every name.
"""

from tempfile import TemporaryDirectory

import numpy as np
import xarray
from example import arguments

from synctrl.experiments import mixed_four
from synctrl.show.plots import new_figure, save, style
from synctrl.show.style import robot_color

out, short = arguments(__doc__)
result = mixed_four().simulate(0.05 if short else 2.0, dt=1e-3)
with TemporaryDirectory() as folder:
    run = xarray.load_dataset(result.to_netcdf(f"{folder}/run.nc"), engine="h5netcdf")

share = 100 * abs(run.tau).max("time") / run.torque_limit  # percent, for each robot and joint
print(share.to_series().dropna().sort_values().tail(3))
print(run.sync_error.attrs["long_name"], run.sync_error.attrs["equation"], "in", run.sync_error.units)

with style():
    figure, ((panel,),) = new_figure(3.0, 1, 1, width=6.4)
    for k, robot in enumerate(run.robot.values):
        joints = share.sel(robot=robot).dropna("joint")
        places = np.arange(joints.size) + 0.2 * k
        panel.bar(places, joints, width=0.2, color=robot_color(k), label=robot)
    panel.set(ylabel="largest torque, % of its limit", xlabel="joint", xticks=np.arange(7) + 0.3)
    panel.set_xticklabels(range(1, 8))
    figure.legend(loc="outside upper center", ncols=4)
save(figure, out / "by_name")
