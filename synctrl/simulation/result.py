"""Result: what a run computed, as frozen arrays with names and units."""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field, fields
from functools import partial
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from ..checks import count, instance
from ..errors import InputError, ResultError
from ..robots.model import TURNS, joined, unit_for
from .exported import Exported
from .log_folder import complete, read_folder
from .result_file import LAYOUT, check_shape, read_result, shapes, unit_of, write_result
from .schema import FORMAT

__all__ = ["FORMAT", "LAYOUT", "Result", "unit_of"]

#: what the names of outputs begin with in a file
OUTPUTS = "outputs/"
#: what draws the figures of a result; imported when it is asked for
FIGURES = "synctrl.show.run_figures"


@dataclass(frozen=True, eq=False)
class Result(Exported):
    """A run at T logged instants: n robots, p synchronization errors, m task coordinates, nv joints.

    Units are those of joints that turn; joints that slide are in m, m/s and N, see `units`.

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
        InputError: outputs that are not those that `info["outputs"]` speaks of, or of another shape.

    A row is the state after whatever happens at its instant, with the torques that act from it on. At the end
    nothing happens any more but a sample of sampled control, if one is due.

    Rows of robots with fewer joints or parameters than the largest are padded with zeros;
    `info["robots"]` has their numbers.

    A run with `log_to` keeps its arrays in files of a folder, mapped into memory and read from there when
    they are looked at. With `log_dtype="float32"` all but the times have seven digits.
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
        _check_outputs(self)
        for array in self._arrays().values():
            array.flags.writeable = False

    def _arrays(self) -> dict[str, Any]:
        """All arrays, outputs included, under the names they have in a file."""
        outputs = {f"{OUTPUTS}{name}": array for name, array in self.outputs.items()}
        return {**{name: getattr(self, name) for name in LAYOUT}, **outputs}

    def __reduce__(self) -> tuple:
        return partial(type(self), **{**self._contents(), "experiment": None}), ()

    def __copy__(self) -> Self:
        return type(self)(**self._contents())

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        contents = self._contents()
        shared = {"experiment": contents.pop("experiment")}
        return type(self)(**deepcopy(contents, memo), **shared)

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
        """Unit of one of the arrays, or of the outputs; all of them, as in `rad, m`, where joints differ."""
        return array_unit(self.info, array)

    def units(self, array: str) -> tuple[tuple[str, ...], ...]:
        """Units of the numbers of one of the arrays, or of the outputs, at one instant.

        `units("tau")[0][2]` is that of joint 3 of robot 1: a row for each robot or pair, and a column for
        each coordinate, or joint that the robot has. Arrays of other axes have one row and one column.
        """
        return array_units(self.info, array)

    def plot(self, *names: str, width: float | None = None, style: str | None = None) -> Any:
        """Figures by name, which a notebook shows: errors, torques with limits, paths and estimates.

        Args:
            names: "tracking_error", "sync_error", "torque", "path", "estimates", all of which are drawn by
                default, and if asked for "tip_path", "phase_portrait", "spectrum", "consistency", "lyapunov".
            width: of each figure, inches; by default that of the style.
            style: None, 6.4 inches wide; "ieee", a column of a journal, 3.5 inches, that can be read in grey;
                or "slides", 10 inches, with large words.

        Returns:
            A dictionary of matplotlib figures, a `Gallery`: `.save(folder)` writes them, `.missing` says what
            this result does not have.

        Raises:
            InputError: an unknown name or style, too narrow a figure, or nothing that can be drawn.
        """
        return import_module(FIGURES).gallery(self, *names, width=width, style=style)

    def decimated(self, every: int) -> Self:
        """The first of every so many logged instants, and the last; `info["decimated"]` says how many.

        Raises:
            InputError: no whole number above 0.
        """
        every = count("every", every)
        last = max(len(self.t) - 1, 0)
        kept = np.union1d(np.arange(0, last, every), [last] if len(self.t) else []).astype(int)
        arrays = {name: getattr(self, name)[kept] for name in LAYOUT}
        outputs = {name: array[kept] for name, array in self.outputs.items()}
        info = {**self.info, "decimated": every}
        return type(self)(**arrays, info=info, outputs=outputs, experiment=self.experiment)

    def save(self, path: str | Path) -> Path:
        """Write everything to an .npz file, which appears under its name only once it is complete.

        Any number of processes may save to one path; the last one to finish wins.

        Raises:
            ResultError: the file cannot be written, or `load` would refuse what is in it.
        """
        instance("path", path, (str, Path), "a path")
        write_result(Path(path), {"format": FORMAT, **self.info}, self._arrays())
        return Path(path)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote, or a folder of a run with `log_to`, whose arrays are mapped and not read.

        Raises:
            ResultError: the file is missing, damaged, or no result.
        """
        instance("path", path, (str, Path), "a path")
        info, arrays = read_folder(Path(path)) if Path(path).is_dir() else read_result(Path(path))
        info.pop("format")
        return cls._of(info, arrays)

    def settled(self, folder: Path, dtype: str) -> Self:
        """This result, of which a folder has the rows, with the rest there too, and all arrays mapped."""
        arrays = complete(folder, {"format": FORMAT, **self.info}, self._arrays(), dtype)
        return self._of(self.info, arrays, experiment=self.experiment)

    @classmethod
    def _of(cls, info: Mapping[str, Any], arrays: dict[str, np.ndarray], **others: Any) -> Self:
        """A result of arrays under the names that they have in a file."""
        outputs = {name.removeprefix(OUTPUTS): arrays.pop(name) for name in [*arrays] if name not in LAYOUT}
        return cls(**arrays, info=info, outputs=outputs, **others)

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


def _check_outputs(result: Result) -> None:
    """Refuse outputs that are not those that info speaks of."""
    described = result.info.get("outputs", {})
    if described.keys() != result.outputs.keys():
        raise InputError.expected(f"those of info['outputs'], {[*described]}", [*result.outputs], "outputs")
    expected = shapes(result.info, len(result.t)) if described else {}
    for name, array in result.outputs.items():
        try:
            check_shape(name, array.dtype, array.shape, expected[f"{OUTPUTS}{name}"])
        except ResultError as error:
            raise InputError(str(error), subject="outputs") from None


# -- units: coordinates and joints may differ in theirs ----------------------------------------------------


def array_unit(info: Mapping[str, Any], array: str) -> str:
    """Units of an array, or of an output, in one text: `rad`, or `rad, m` where joints differ."""
    return joined(unit for row in array_units(info, array) for unit in row)


def array_units(info: Mapping[str, Any], array: str) -> tuple[tuple[str, ...], ...]:
    """Unit of every number of an array, or of an output, at one instant: rows and columns.

    Rows are robots or pairs, columns are coordinates or the robot's own joints; an array of other axes has
    one unit for all. Results of earlier versions say nothing of joints, which then count as turning.
    """
    if array in info.get("outputs", {}):
        axes, unit = tuple(info["outputs"][array]["axes"]), str(info["outputs"][array]["unit"])
    else:
        axes, unit = LAYOUT[array][0], unit_of(array, info["task_unit"], info["weighted_unit"])
    if axes[1:] == ("robot", "joint"):
        joints = (robot.get("joint_units") or [TURNS] * len(robot["joints"]) for robot in info["robots"])
        return tuple(tuple(unit_for(unit, joint) for joint in row) for row in joints)
    if array in LAYOUT and axes[2:] == ("axis",):
        rows = len(info["robots"] if axes[1] == "robot" else info["pairs"])
        return (_of_coordinates(info, array),) * rows
    return ((unit,),)


def _of_coordinates(info: Mapping[str, Any], array: str) -> tuple[str, ...]:
    count = len(info["axes"])
    tasks = info.get("axis_units") or [info["task_unit"]] * count
    weighted = info.get("weighted_units") or [info["weighted_unit"]] * count
    return tuple(unit_of(array, *pair) for pair in zip(tasks, weighted, strict=True))
