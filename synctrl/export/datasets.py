"""Results as xarray datasets, with names as coordinates and meanings as attributes, and as netCDF files."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import instance
from ..files import reported, whole_path
from ..simulation.result import Result
from .names import PAPER, own_names
from .needed import needed
from .quantities import AXES, BESIDE, Quantity, quantities


def to_xarray(result: Result) -> Any:
    """An `xarray.Dataset` of a result, see `Result.to_xarray`.

    Raises:
        MissingDependencyError: xarray is not installed.
    """
    xarray = needed("an xarray dataset", "xarray")
    found = quantities(result)
    names = _Dimensions(found)
    variables = {each.name: (("time", *names.of(each)), each.masked(), about(each)) for each in found}
    coordinates: dict[str, Any] = {"time": (("time",), result.t, {"long_name": "time", "units": "s"})}
    for each in found:
        for dim, labels in zip(names.of(each), each.labels, strict=True):
            coordinates.setdefault(dim, ((dim,), _texts(labels), {}))
    own = {names.of(each)[1]: each.own for each in found if each.own is not None}
    for dim, rows in {**own, **_of_robots(result)}.items():
        words = {"long_name": f"name of each {dim.replace('_', ' ')} of each robot"}
        coordinates[f"{dim}_name"] = ("robot", dim), _texts(rows, len(coordinates[dim][1])), words
    return xarray.Dataset({**variables, **_constants(result)}, coordinates | _units(result), _about(result))


def to_netcdf(result: Result, path: str | Path) -> Path:
    """Write a result as netCDF-4, see `Result.to_netcdf`.

    Raises:
        MissingDependencyError: xarray, h5netcdf or h5py is not installed.
        ResultError: the file cannot be written.
    """
    instance("path", path, (str, Path), "a path")
    needed("a netCDF file", "xarray", "h5netcdf", "h5py")
    dataset = to_xarray(result)
    words = {"long_name": "all that the result says of itself, as JSON"}
    dataset["info"] = ((), np.array(dataset.attrs.pop("info"), dtype=object), words)
    with reported("write the netCDF file", path), whole_path(path) as partial:
        dataset.to_netcdf(partial, engine="h5netcdf")
    return Path(path)


def about(quantity: Quantity) -> dict[str, str]:
    """What the attributes of a variable say."""
    found = {"long_name": quantity.long_name, "units": quantity.unit}
    return {**found, "equation": quantity.equation} if quantity.equation else found


class _Dimensions:
    """Names of dimensions: axes of one name that differ in length have it in theirs."""

    def __init__(self, found: Sequence[Quantity]):
        axes = {pair: None for each in found for pair in zip(each.axes, each.values.shape[1:], strict=True)}
        lengths = Counter(axis for axis, _ in axes)
        self._names: dict[tuple[str, int], str] = {}
        taken = {"time", *BESIDE, *(each.name for each in found)}
        for axis, length in axes:
            plain = axis.replace(" ", "_")
            name = plain if axis in AXES or lengths[axis] == 1 else f"{plain}_{length}"
            self._names[axis, length] = _free(name, taken, "axis")
            taken.add(self._names[axis, length])

    def of(self, quantity: Quantity) -> list[str]:
        """Dimensions of a quantity after time; an axis that it has twice is told apart."""
        found: list[str] = []
        for pair in zip(quantity.axes, quantity.values.shape[1:], strict=True):
            found.append(_free(self._names[pair], {*found, "time"}, "2"))
        return found


def _free(name: str, taken: Collection[str], suffix: str) -> str:
    """A name that is not taken: this one, or with something behind it."""
    while name in taken:
        name = f"{name}_{suffix}"
    return name


def _texts(labels: Sequence[Any], size: int | None = None) -> np.ndarray:
    """Names as an array; rows of names are made as long as the longest with empty ones."""
    if size is None:
        return np.array([str(label) for label in labels], dtype=object)
    return np.array([[*row, *[""] * (size - len(row))] for row in labels], dtype=object)


def _of_robots(result: Result) -> dict[str, list[list[str]]]:
    return {kind: own_names(result, kind) or [] for kind in ("joint", "parameter")}


def _units(result: Result) -> dict[str, Any]:
    units, size = result.units("q"), result.q.shape[2]
    return {"joint_unit": (("robot", "joint"), _texts(units, size), {"long_name": "unit of joint positions"})}


def _constants(result: Result) -> dict[str, Any]:
    """True parameters and limits of torque, NaN where there are none."""
    theta, limits = (np.full(array.shape[1:], np.nan) for array in (result.theta_hat, result.tau))
    for i, robot in enumerate(result.info["robots"]):
        theta[i, : len(robot["theta"])] = robot["theta"]
        known = [np.nan if limit is None else limit for limit in robot.get("torque_limits", ())]
        limits[i, : len(known)] = known
    words = {"long_name": "true parameters", "units": result.unit("theta_hat"), "equation": "(9)"}
    torque = {"long_name": "largest torque that the description allows", "units": result.unit("tau")}
    return {
        "theta": (("robot", "parameter"), theta, words),
        "torque_limit": (("robot", "joint"), limits, torque),
    }


def _about(result: Result) -> dict[str, str]:
    """Attributes of the whole."""
    return {
        "title": str(result.info["title"]),
        "status": result.status,
        "source": f"synctrl {result.info['versions'].get('synctrl', '')}".strip(),
        "references": PAPER,
        "info": json.dumps(dict(result.info)),
    }
