"""Result: what a run computed, as frozen arrays with names and units."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self, TypeVar

import numpy as np

from ..checks import instance
from ..errors import InputError, ResultError
from ..files import whole_file

FORMAT = "synctrl result 2"
#: what is read; files of format 1 have no outputs
FORMATS = ("synctrl result 1", FORMAT)

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

R = TypeVar("R", bound="Result")
#: what the names of outputs begin with in a file
OUTPUTS = "outputs/"


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
        outputs: further arrays by name, each with time as its first axis; `info["outputs"][name]` has the
            "unit" of each and the names of its "axes".
        experiment: the closed loop that made it, while it stays in one process: copies share it, but it is
            neither compared, nor saved, nor pickled, for it may hold functions that cannot be.

    Raises:
        InputError: an output without a description, or of another number of instants.

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
    outputs: Mapping[str, np.ndarray] = field(default_factory=dict)
    experiment: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "info", MappingProxyType(dict(self.info)))
        object.__setattr__(self, "outputs", MappingProxyType(dict(self.outputs)))
        _check_described(self)
        for array in self._arrays().values():
            array.flags.writeable = False

    def _arrays(self) -> dict[str, Any]:
        """All arrays, outputs included, under the names they have in a file."""
        outputs = {f"{OUTPUTS}{name}": array for name, array in self.outputs.items()}
        return {**{name: getattr(self, name) for name in LAYOUT}, **outputs}

    def __reduce__(self) -> tuple:
        return _remade, (type(self), {**self._contents(), "experiment": None})

    def __copy__(self) -> Self:
        return _remade(type(self), self._contents())

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        contents = self._contents()
        shared = {"experiment": contents.pop("experiment")}
        return _remade(type(self), {**deepcopy(contents, memo), **shared})

    def _contents(self) -> dict[str, Any]:
        """All fields, mappings as plain dictionaries."""
        contents = {each.name: getattr(self, each.name) for each in fields(self)}
        return {**contents, "info": dict(self.info), "outputs": dict(self.outputs)}

    @property
    def status(self) -> str:
        """`completed`, or why the run stopped."""
        return str(self.info["status"])

    @property
    def names(self) -> list[str]:
        """Names of the robots."""
        return [robot["name"] for robot in self.info["robots"]]

    def unit(self, array: str) -> str:
        """Unit of one of the arrays, or of the outputs."""
        if array in self.outputs:
            return str(self.info["outputs"][array]["unit"])
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
        outputs = {name: array[kept] for name, array in self.outputs.items()}
        info = {**self.info, "decimated": int(every)}
        return type(self)(**arrays, info=info, outputs=outputs, experiment=self.experiment)

    def save(self, path: str | Path) -> Path:
        """Write everything to an .npz file; it appears under its name only once it is complete.

        Raises:
            ResultError: the file cannot be written.
        """
        instance("path", path, (str, Path), "a path")
        path = Path(path)
        content = self._arrays()
        info = json.dumps({"format": FORMAT, **self.info}, ensure_ascii=False)
        try:
            with whole_file(path) as file:
                np.savez(file, info=np.array(info), **content)
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
        outputs = {name.removeprefix(OUTPUTS): arrays.pop(name) for name in [*arrays] if name not in LAYOUT}
        try:
            return cls(**arrays, info=info, outputs=outputs)
        except InputError as error:
            raise ResultError(f"'{path}': {error}") from None

    def __eq__(self, other: object) -> bool:
        """Same arrays, bit for bit, and same info."""
        if not isinstance(other, Result):
            return NotImplemented
        ours, theirs = self._arrays(), other._arrays()
        same_info = json.dumps(dict(self.info)) == json.dumps(dict(other.info))
        return (
            same_info
            and ours.keys() == theirs.keys()
            and all(np.array_equal(ours[name], theirs[name], equal_nan=True) for name in ours)
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        n, m = self.x.shape[1:]
        return f"Result({self.info['title']!r}, {n} robots, {m} axes, {len(self.t)} instants, {self.status})"


def _remade(kind: type[R], contents: dict[str, Any]) -> R:
    return kind(**contents)


def _check_described(result: Result) -> None:
    described = result.info.get("outputs", {})
    for name, array in result.outputs.items():
        about = described.get(name)
        if not isinstance(about, Mapping) or not {"unit", "axes"} <= about.keys():
            raise InputError(
                f"outputs, {name}: expected its unit and axes in info['outputs'], found {about!r}"
            )
        if len(array) != len(result.t) or array.ndim != len(about["axes"]) or about["axes"][0] != "time":
            raise InputError(
                f"outputs, {name}: expected the axes {about['axes']} with {len(result.t)} instants, found an "
                f"array of shape {array.shape}"
            )


#: what reading a file that is no archive, or a damaged one, may raise
_DAMAGE = (OSError, ValueError, KeyError, EOFError, RuntimeError, MemoryError, zipfile.BadZipFile)


def _read(path: Path) -> tuple[Any, dict[str, np.ndarray]]:
    """Content of an archive as `save` writes it: uncompressed, so no larger in memory than on disk."""
    with zipfile.ZipFile(path) as archive:
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.infolist()):
            raise ValueError("expected uncompressed entries")
    with np.load(path, allow_pickle=False) as content:
        outputs = [name for name in content.files if name.startswith(OUTPUTS)]
        return json.loads(str(content["info"])), {name: content[name] for name in (*LAYOUT, *outputs)}


def _check_content(path: Path, info: Any, arrays: dict[str, np.ndarray]) -> None:
    if not isinstance(info, dict) or info.get("format") not in FORMATS:
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
