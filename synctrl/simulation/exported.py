"""Exported: the ways of a result to other tools. What writes them is imported when it is asked for."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

#: what exports results
EXPORTS = "synctrl.export"


class Exported:
    """Methods that give a result to other tools.

    Names of robots, pairs, coordinates and joints go along, and units, long names and the numbers of the
    paper's equations where a format has room for them. Joints and parameters that a robot does not have,
    since others have more, are NaN in arrays, and left out of tables and recordings. A file appears under its
    name once it is complete; its folder is made. docs/data.md shows each of them.
    """

    def to_xarray(self) -> Any:
        """The result as an `xarray.Dataset`.

        Each array and output is a variable over `time` and its further axes, which have names as coordinates.
        Attributes of a variable are `long_name`, `units` and `equation`; those of the whole are `title`,
        `status`, `source`, `references` and `info`, which is JSON. `theta` and `torque_limit` do not change.

        Returns:
            The dataset; its arrays are those of the result, without a copy, wherever that is possible.

        Raises:
            MissingDependencyError: xarray is not installed; the extra `data` brings it.
        """
        return _module("datasets").to_xarray(self)

    def to_netcdf(self, path: str | Path) -> Path:
        """Write what `to_xarray` gives as netCDF-4; `info` is a variable there.

        Args:
            path: the file.

        Returns:
            The same path.

        Raises:
            MissingDependencyError: xarray, h5netcdf or h5py is not installed; the extra `data` brings them.
            ResultError: the file cannot be written.
        """
        return _module("datasets").to_netcdf(self, path)

    def to_pandas(self) -> Any:
        """The result as a `pandas.DataFrame`.

        Returns:
            A row for each logged instant, with the time, s, as its index, and a column for each number.
            Columns have three levels: quantity, robot or pair, and coordinate or joint. `attrs` has `title`,
            `status`, `units`, `long_names` and `equations`.

        Raises:
            MissingDependencyError: pandas is not installed; the extra `data` brings it.
        """
        return _module("tables").to_pandas(self)

    def to_csv(self, path: str | Path) -> Path:
        """Write a table of comma-separated values, in UTF-8.

        The first column is `time [s]`, others are called like `tau/robot 1/joint2 [N·m]`. Floats have all
        their digits; what has no value is an empty field.

        Args:
            path: the file.

        Returns:
            The same path.

        Raises:
            ResultError: the file cannot be written.
        """
        return _module("tables").to_csv(self, path)

    def to_mat(self, path: str | Path) -> Path:
        """Write a MAT-file of version 5, for MATLAB, Octave and SciPy.

        It has `t`, each array and output with time as its first axis, the structs `robots` and `quantities`
        that say what is what, the names of `pairs` and `axes`, and `info` for `jsondecode`.

        Args:
            path: the file.

        Returns:
            The same path.

        Raises:
            ResultError: the file cannot be written, or an array has more than its format can hold, 2 GB.
        """
        return _module("matlab").to_mat(self, path)

    def to_mcap(self, path: str | Path, *, fps: float = 30.0) -> Path:
        """Write an MCAP recording, and beside it a layout with which Foxglove opens it.

        It has every number at every logged instant, and with Foxglove's schemas the states of the joints, and
        frames and shapes of the scene that `scene_of` makes.

        Args:
            path: the file; the layout has its name, with `.layout.json` for its ending.
            fps: pictures of the scene per second of the run.

        Returns:
            The same path.

        Raises:
            InputError: fps is not positive, or asks for too many pictures; times that no recording can have.
            MissingDependencyError: mcap or Foxglove's schemas are not installed; the extra `data`.
            ResultError: a file cannot be written.

        Warns:
            RobotWarning: the robots cannot be shown, and why; the recording then has no scene.
        """
        return _module("mcap_file").to_mcap(self, path, fps=fps)

    def to_rerun(self, path: str | Path, *, fps: float = 30.0) -> Path:
        """Write a recording for Rerun, with every number, the scene, and a layout inside.

        Args:
            path: the file, usually called `.rrd`.
            fps: pictures of the scene per second of the run.

        Returns:
            The same path.

        Raises:
            InputError: see `to_mcap`.
            MissingDependencyError: rerun is not installed; the extra `rerun` brings it.
            ResultError: the file cannot be written.

        Warns:
            RobotWarning: see `to_mcap`.
        """
        return _module("rerun_file").to_rerun(self, path, fps=fps)


def _module(name: str) -> Any:
    return import_module(f"{EXPORTS}.{name}")
