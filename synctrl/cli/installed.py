"""What is installed, and what each of it is for; what is missing says how to get it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib import metadata
from typing import NamedTuple

#: what users get with each extra of the package
FEATURES = {
    "compiled": "runs by generated C, many times faster, and large sweeps",
    "compiler": "a C compiler, for machines that have none",
    "mujoco": "MuJoCo as a second judge of physics, MJCF files",
    "xacro": "robots from xacro files",
    "robot_descriptions": "robots by name from the package robot_descriptions",
    "sweep": "sweeps by joblib or Dask, tables of them as pandas or xarray",
    "tune": "tuning for several goals",
    "data": "results for xarray, pandas, NetCDF and Foxglove",
    "rerun": "results as recordings for Rerun",
    "notebooks": "the notebooks",
}
PACKAGE = "synctrl"


class Requirement(NamedTuple):
    """A library that is asked for: by which extra, "" for all; from which version; and which is there."""

    name: str
    extra: str
    least: str
    found: str | None

    @property
    def met(self) -> bool:
        """Whether it is there, and not too old."""
        return self.found is not None and _parts(self.found) >= _parts(self.least)


def requirements() -> Iterator[Requirement]:
    """What the installed package asks for, but for extras of its developers.

    Where a folder on the path stands for an installed package, and nobody says what it asks for: nothing.
    """
    try:
        asked = metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:
        return
    for text in asked:
        name, least, extra = _read(text)
        if not extra or extra in FEATURES:
            yield Requirement(name, extra, least, version(name))


def version(name: str) -> str | None:
    """The version of a distribution, or None if it is not installed."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _read(text: str) -> tuple[str, str, str]:
    """Name, least version and extra of a requirement: `casadi>=3.6.6; extra == 'compiled'`."""
    name = re.match(r"[\w.-]+", text)
    least, extra = re.search(r">=\s*([\w.]+)", text), re.search(r"extra\s*==\s*['\"]([\w-]+)['\"]", text)
    words = extra[1].replace("-", "_") if extra else ""
    return name[0] if name else text, least[1] if least else "0", words


def _parts(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text.partition("+")[0])[:3])
