"""Result: what a run computed, as frozen arrays with names and units."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from ..checks import instance
from ..errors import InputError, ResultError

FORMAT = "synctrl result 1"

#: array -> (dimensions, unit); "task" stands for the unit of the task, "weighted" for that of c e
LAYOUT: Mapping[str, tuple[tuple[str, ...], str]] = MappingProxyType(
    {
        "t": (("time",), "s"),
        "x": (("time", "robot", "axis"), "task"),
        "x_desired": (("time", "robot", "axis"), "task"),
        "tracking_error": (("time", "robot", "axis"), "task"),
        "sync_error": (("time", "pair", "axis"), "weighted"),
        "sync_integral": (("time", "pair", "axis"), "weighted·s"),
        "coupled_error": (("time", "robot", "axis"), "weighted"),
        "q": (("time", "robot", "joint"), "rad"),
        "v": (("time", "robot", "joint"), "rad/s"),
        "v_error": (("time", "robot", "joint"), "rad/s"),
        "tau": (("time", "robot", "joint"), "N·m"),
        "disturbance": (("time", "robot", "joint"), "N·m"),
        "theta_hat": (("time", "robot", "parameter"), "SI"),
    }
)


def unit_of(array: str, task: str, weighted: str) -> str:
    """Unit of an array of `LAYOUT`, given those of the task and of c e."""
    return LAYOUT[array][1].replace("task", task).replace("weighted", weighted)


@dataclass(frozen=True, eq=False)
class Result:
    """A run at T logged instants: n robots, p synchronization errors, m task coordinates, nv joints.

    Attributes:
        t: (T,), s.
        x, x_desired: task coordinates, (T, n, m), rad or m.
        tracking_error: e = desired minus actual, (T, n, m), rad or m.
        sync_error: epsilon, (T, p, m), in the unit of c e.
        sync_integral: integral of epsilon, (T, p, m).
        coupled_error: e*, (T, n, m), in the unit of c e.
        q, v: joint positions and velocities, (T, n, nv), rad and rad/s.
        v_error: s_q = v_ref - v, (T, n, nv), rad/s.
        tau: torque of the controller, (T, n, nv), N·m.
        disturbance: torque from outside, (T, n, nv), N·m.
        theta_hat: estimates, (T, n, P).
        info: what the arrays mean and how they came about: names, units, gains, options, versions, `status`.
        experiment: the closed loop that made it, while in memory; not saved and not compared.

    Rows of robots with fewer joints or parameters than the largest are padded with zeros;
    `info["robots"]` has their numbers.
    """

    t: np.ndarray
    x: np.ndarray
    x_desired: np.ndarray
    tracking_error: np.ndarray
    sync_error: np.ndarray
    sync_integral: np.ndarray
    coupled_error: np.ndarray
    q: np.ndarray
    v: np.ndarray
    v_error: np.ndarray
    tau: np.ndarray
    disturbance: np.ndarray
    theta_hat: np.ndarray
    info: Mapping[str, Any]
    experiment: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in LAYOUT:
            getattr(self, name).flags.writeable = False
        object.__setattr__(self, "info", MappingProxyType(dict(self.info)))

    @property
    def status(self) -> str:
        """`completed`, or why the run stopped."""
        return str(self.info["status"])

    @property
    def names(self) -> list[str]:
        """Names of the robots."""
        return [robot["name"] for robot in self.info["robots"]]

    def unit(self, array: str) -> str:
        """Unit of one of the arrays."""
        return unit_of(array, self.info["task_unit"], self.info["weighted_unit"])

    def decimated(self, every: int) -> Self:
        """The first of every so many logged instants, and the last; `info["decimated"]` says how many.

        Raises:
            InputError: no whole number above 0.
        """
        instance("every", every, (int, np.integer), "a whole number")
        if isinstance(every, bool) or every < 1:
            raise InputError(f"every: expected a whole number above 0, found {every!r}")
        last = max(len(self.t) - 1, 0)
        kept = np.union1d(np.arange(0, last, every), [last] if len(self.t) else []).astype(int)
        arrays = {name: getattr(self, name)[kept] for name in LAYOUT}
        return type(self)(**arrays, info={**self.info, "decimated": int(every)}, experiment=self.experiment)

    def save(self, path: str | Path) -> Path:
        """Write everything to an .npz file; it appears under its name only once it is complete.

        Raises:
            ResultError: the file cannot be written.
        """
        instance("path", path, (str, Path), "a path")
        path = Path(path)
        if path.is_dir():
            raise ResultError(f"cannot write the result to '{path}': it is a folder")
        content = {name: getattr(self, name) for name in LAYOUT}
        info = json.dumps({"format": FORMAT, **self.info}, ensure_ascii=False)
        partial = path.with_name(path.name + ".part")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with partial.open("wb") as file:
                np.savez(file, info=np.array(info), **content)
            partial.replace(path)
        except (OSError, ValueError) as error:
            raise ResultError(f"cannot write the result to '{path}': {error}") from error
        return path

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote.

        Raises:
            ResultError: the file is missing, damaged, or no result.
        """
        instance("path", path, (str, Path), "a path")
        path = Path(path)
        if not path.is_file():
            raise ResultError(f"no result file at '{path}'")
        try:
            info, arrays = _read(path)
        except _DAMAGE as error:
            raise ResultError(f"'{path}' is no complete result file of synctrl: {error}") from error
        _check_content(path, info, arrays)
        info.pop("format")
        return cls(**arrays, info=info)

    def __eq__(self, other: object) -> bool:
        """Same arrays, bit for bit, and same info."""
        if not isinstance(other, Result):
            return NotImplemented
        same_info = json.dumps(dict(self.info)) == json.dumps(dict(other.info))
        return same_info and all(
            np.array_equal(getattr(self, name), getattr(other, name), equal_nan=True) for name in LAYOUT
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        n, m = self.x.shape[1:]
        return f"Result({self.info['title']!r}, {n} robots, {m} axes, {len(self.t)} instants, {self.status})"


#: what reading a file that is no archive, or a damaged one, may raise
_DAMAGE = (OSError, ValueError, KeyError, EOFError, RuntimeError, MemoryError, zipfile.BadZipFile)


def _read(path: Path) -> tuple[Any, dict[str, np.ndarray]]:
    """Content of an archive as `save` writes it: uncompressed, so no larger in memory than on disk."""
    with zipfile.ZipFile(path) as archive:
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.infolist()):
            raise ValueError("expected uncompressed entries")
    with np.load(path, allow_pickle=False) as content:
        return json.loads(str(content["info"])), {name: content[name] for name in LAYOUT}


def _check_content(path: Path, info: Any, arrays: dict[str, np.ndarray]) -> None:
    if not isinstance(info, dict) or info.get("format") != FORMAT:
        found = info.get("format") if isinstance(info, dict) else type(info).__name__
        raise ResultError(f"'{path}': expected the format '{FORMAT}', found {found!r}")
    for name in ("status", "title", "task_unit", "weighted_unit"):
        if not isinstance(info.get(name), str):
            raise ResultError(f"'{path}': info, {name}: expected a text, found {info.get(name)!r}")
    sizes, robots = info.get("sizes"), info.get("robots")
    if not isinstance(sizes, dict):
        raise ResultError(f"'{path}': info, sizes: expected lengths by name, found {sizes!r}")
    if not isinstance(robots, list) or not all(
        isinstance(robot, dict) and isinstance(robot.get("name"), str) for robot in robots
    ):
        raise ResultError(f"'{path}': info, robots: expected one entry with a name per robot")
    _check_shapes(path, {**sizes, "time": arrays["t"].size}, arrays)


def _check_shapes(path: Path, sizes: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
    for name, (dimensions, _) in LAYOUT.items():
        expected = tuple(sizes.get(d) for d in dimensions)
        if arrays[name].shape != expected or arrays[name].dtype != np.float64:
            raise ResultError(
                f"'{path}': array '{name}': expected float64 of shape {expected}, "
                f"found {arrays[name].dtype} of shape {arrays[name].shape}"
            )
