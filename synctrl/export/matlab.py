"""Results as MAT-files of version 5, which MATLAB, Octave and SciPy read."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import instance
from ..errors import ResultError
from ..files import reported, whole_file
from ..simulation.result import Result
from .identifiers import identifiers
from .names import PAPER, own_names, pair_names
from .quantities import Quantity, quantities

#: characters that the name of a variable may have
LONGEST = 63


def to_mat(result: Result, path: str | Path) -> Path:
    """Write a result as a MAT-file, see `Result.to_mat`.

    Its variables are `t`, (T, 1), and the arrays and outputs under their names, time first; `robots`,
    `pairs`, `axes` and `quantities`, which say what is what; and `info`, JSON for `jsondecode`.

    Raises:
        ResultError: the file cannot be written, or an array is too large for the format.
    """
    from scipy.io import savemat
    from scipy.io.matlab import MatWriteError

    instance("path", path, (str, Path), "a path")
    found = quantities(result)
    named = dict(zip(identifiers((each.name for each in found), LONGEST), found, strict=True))
    content = {
        "t": result.t,
        **{name: each.masked() for name, each in named.items()},
        "robots": _robots(result),
        "pairs": _cell(pair_names(result)),
        "axes": _cell(result.info["axes"]),
        "quantities": {name: _about(each) for name, each in named.items()},
        "info": json.dumps(dict(result.info)),
        "references": PAPER,
    }
    try:
        with reported("write the MAT-file", path), whole_file(path) as file:
            savemat(file, content, long_field_names=True, oned_as="column")
    except (MatWriteError, OverflowError) as error:
        words = f"expected arrays that a MAT-file can hold, found {error}; to_netcdf has no such limit"
        raise ResultError(words, file=path) from error
    return Path(path)


def _robots(result: Result) -> np.ndarray:
    """A struct array with names, joints, units, parameters, their true values and limits of torque."""
    robots = result.info["robots"]
    keys = ("name", "model", "joints", "joint_units", "parameters", "theta", "torque_limits")
    found = np.empty(len(robots), dtype=[(key, object) for key in keys])
    joints, parameters = (own_names(result, kind) or [] for kind in ("joint", "parameter"))
    for i, robot in enumerate(robots):
        limits = [np.nan if limit is None else limit for limit in robot.get("torque_limits", ())]
        names = _cell(joints[i]), _cell(result.units("q")[i]), _cell(parameters[i])
        numbers = np.array(robot["theta"], dtype=float), np.array(limits, dtype=float)
        found[i] = (robot["name"], robot.get("model", ""), *names, *numbers)
    return found


def _about(quantity: Quantity) -> dict[str, Any]:
    """What is said of an array."""
    return {
        "long_name": quantity.long_name,
        "units": quantity.unit,
        "equation": quantity.equation,
        "dimensions": _cell(["time", *quantity.axes]),
        "labels": _cell([_cell(labels) for labels in quantity.labels]),
    }


def _cell(values: Iterable[Any]) -> np.ndarray:
    """A cell array of texts, or of cell arrays."""
    listed = list(values)
    found = np.empty(len(listed), dtype=object)
    for k, value in enumerate(listed):
        found[k] = value
    return found
