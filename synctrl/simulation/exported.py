"""Exported: the ways of a result to other tools. What writes them is imported when it is asked for."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

#: what exports results
EXPORTS = "synctrl.export"


class Exported:
    """Methods that give a result to other tools; docs/data.md shows each of them.

    All but the last say units, and names of robots, pairs, coordinates and joints. Joints and parameters that
    a robot does not have, since others have more, are left out of tables and recordings, and NaN in arrays.
    Files appear under their names once they are complete. What needs a package that is not installed raises a
    `MissingDependencyError` with the extra that brings it; what cannot be written raises a `ResultError`.
    """

    def to_xarray(self) -> Any:
        """An `xarray.Dataset`: a variable for each array and output, with long name, units and equations."""
        return _module("datasets").to_xarray(self)

    def to_netcdf(self, path: str | Path) -> Path:
        """Write the same as netCDF-4; what the result says of itself is its variable `info`, as JSON."""
        return _module("datasets").to_netcdf(self, path)

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame`: rows by time, columns by quantity, robot or pair, and coordinate or joint."""
        return _module("tables").to_pandas(self)

    def to_csv(self, path: str | Path) -> Path:
        """Write a table with columns `quantity/robot/coordinate [unit]`; floats have all their digits."""
        return _module("tables").to_csv(self, path)

    def to_mat(self, path: str | Path) -> Path:
        """Write a MAT-file, of version 5, for MATLAB, Octave and SciPy."""
        return _module("matlab").to_mat(self, path)

    def to_mcap(self, path: str | Path, *, fps: float = 30.0) -> Path:
        """Write an MCAP recording, and beside it a layout with which Foxglove opens it.

        Args:
            path: the file; the layout has its name, with `.layout.json` for its ending.
            fps: frames of the scene per second of the run. Numbers are those of all logged instants.
        """
        return _module("mcap_file").to_mcap(self, path, fps=fps)

    def to_rerun(self, path: str | Path, *, fps: float = 30.0) -> Path:
        """Write the same as a recording for Rerun, with its layout inside; this needs the extra `rerun`."""
        return _module("rerun_file").to_rerun(self, path, fps=fps)


def _module(name: str) -> Any:
    return import_module(f"{EXPORTS}.{name}")
