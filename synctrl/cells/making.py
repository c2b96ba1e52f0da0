"""From the tables of a cell file to the parts that they stand for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..coupling.cell import Cell, Member
from ..errors import SynctrlError, near
from ..robots.friction import Friction
from ..robots.robot import Robot
from ..simulation.simulate import Experiment
from .couplings import Told
from .file import BY_TABLE, MEMBER
from .folders import below
from .kinds import Table
from .problems import Misfit, Place
from .robots import ARM, Base
from .values import FileName, MotionName, PathName, RobotName, RobotNumber

#: parts of an experiment that are made as they stand, with the argument that each becomes
PARTS = {
    "law": "law", "adaptation": "adaptation", "network": "network", "admittance": "admittance",
    "sensors": "sensors", "actuators": "actuators", "disturbances": "disturbances", "loads": "payloads",
    "plant": "plant_type",
}  # fmt: skip
#: what messages call parts of a file
OTHERWISE: dict[str, Place] = {
    "name": ("robots",), "disturbance": ("disturbances",), "payload": ("loads",), "payloads": ("loads",), "plant_type": ("plant",),
}  # fmt: skip
#: what messages call what is said of a robot
WORDS = {
    "trajectory": "motion", "q0": "q0", "v0": "v0", "theta_hat0": "estimate", "friction": "friction",
    "parameters": "parameters",
}  # fmt: skip
#: values of an experiment
VALUES = "title", "saturate", "reference_acceleration", "k_r_space"


class Maker:
    """What makes the parts of one file.

    Args:
        file: the file as it was read.
        folder: its folder, below which all files lie that it names.
    """

    def __init__(self, file: Any, folder: Path):
        self._file, self._folder = file, folder
        self._names = [robot.name for robot in file.robots]
        self._made: dict[Place, Any] = {}

    def experiment(self) -> Experiment:
        """The experiment of the file.

        Raises:
            Misfit: something that its class refuses, with its place.
        """
        file, keys = self._file, self._file.model_fields_set
        cell = self._cell()
        gains = self.part(file.gains, ("gains",))
        options = {name: getattr(file, name) for name in VALUES if name in keys}
        made = {PARTS[name]: self.part(getattr(file, name), (name,)) for name in PARTS if name in keys}
        with _placed((), self._meant()):
            return Experiment(cell, gains, file.duration, **options, **made)

    def part(self, value: Any, place: Place) -> Any:
        """The part that a value of a table stands for."""
        if isinstance(value, Table):
            return self._of_table(value, place)
        if isinstance(value, list):
            return [self.part(each, (*place, k)) for k, each in enumerate(value)]
        if isinstance(value, dict):
            return {name: self.part(each, (*place, name)) for name, each in value.items()}
        for kind, meant in self._names_of().items():
            if type(value) is kind:
                return meant(value, place)
        return value

    # -- internals ----------------------------------------------------------------------------------------

    def _names_of(self) -> dict[type, Callable[[Any, Place], Any]]:
        """What texts stand for."""
        return {
            FileName: lambda name, place: below(self._folder, name, place),
            RobotName: self._robot_index,
            RobotNumber: self._robot_number,
            MotionName: lambda name, place: self._shared("motions", "a motion", name, place),
            PathName: lambda name, place: self._shared("paths", "a path", name, place),
        }

    def _of_table(self, table: Table, place: Place) -> Any:
        kind = BY_TABLE[type(table)]
        given = [name for name in kind.fields if name in table.model_fields_set]
        values = {name: self.part(getattr(table, name), (*place, name)) for name in given}
        with _placed(place, {name: (*place, name) for name in given}):
            return kind.make(**values)

    def _shared(self, table: str, words: str, name: str, place: Place) -> Any:
        """A motion or a path of the file, made once."""
        known, key = getattr(self._file, table), (table, str(name))
        if name not in known:
            found = f"{name!r}{near(name, known)}"
            raise Misfit(place, f"expected the name of {words} in [{table}], found {found}", str(name))
        if key not in self._made:
            self._made[key] = _Unfinished
            self._made[key] = self.part(known[name], key)
        if self._made[key] is _Unfinished:
            raise Misfit(place, f"expected {words} that does not refer to itself, found {name!r}", str(name))
        return self._made[key]

    def _robot_index(self, name: str, place: Place) -> int:
        if name not in self._names:
            known = [each for each in self._names if each]
            listed = (
                f"one of {', '.join(map(repr, known))}" if known else "a number: the robots have no names"
            )
            raise Misfit(place, f"expected {listed}, found {str(name)!r}{near(name, known)}", str(name))
        return self._names.index(name)

    def _robot_number(self, number: int, place: Place) -> int:
        if not 0 <= number < len(self._names):
            last = len(self._names) - 1
            raise Misfit(place, f"expected the number of a robot, from 0 to {last}, found {number}", number)
        return int(number)

    def _meant(self) -> dict[str, Place]:
        """Places in the file, by the words with which errors about a cell name them."""
        gains = {name: ("gains", name) for name in self._file.gains.model_fields_set}
        names = [name or f"robot {i}" for i, name in enumerate(self._names, start=1)]
        robots: dict[str, Place] = {name: ("robots", i) for i, name in enumerate(names)}
        robots |= {f"{name}, {word}": (*robots[name], key) for name in names for word, key in WORDS.items()}
        values = {name: (name,) for name in self._file.model_fields_set}
        return {**values, **OTHERWISE, **gains, **robots}

    def _cell(self) -> Cell:
        file = self._file
        members = [self._member(robot, ("robots", i)) for i, robot in enumerate(file.robots)]
        told = Told([member.trajectory for member in members], file.duration)
        maker = self.part(file.coupling, ("coupling",))
        with _placed(("coupling",), {"c": ("coupling", "c")}):
            coupling = maker(told)
        space = None if file.space is None else self.part(file.space, ("space",))
        clocks = {} if file.clocks is None else {"clocks": file.clocks}
        with _placed((), self._meant()):
            return Cell(members, coupling, space, file.name, **clocks)

    def _member(self, table: Any, place: Place) -> Member:
        robot, given = self._robot(table, place), table.model_fields_set
        parts = {name: self.part(getattr(table, name), (*place, name)) for name in MEMBER if name in given}
        known, estimate = parts.pop("known", None), parts.pop("estimate", None)
        if known is not None and estimate is not None:
            raise Misfit((*place, "estimate"), "expected one of `known` and `estimate`, found both")
        parts["trajectory"] = parts.pop("motion")
        if parts.get("friction") == "none":
            parts["friction"] = Friction()
        adapted = parts.pop("parameters", None)
        with _placed(place, {name: (*place, name) for name in given}):
            parts["parameters"] = None if adapted is None else adapted(robot)
            member = Member(robot, **parts, theta_hat0=estimate)
            return member if known is None else Member(robot, **parts, theta_hat0=known * member.theta)

    def _robot(self, table: Any, place: Place) -> Robot:
        """The robot of a member, which is called as the member is."""
        given = [name for name in ARM.fields if name in table.model_fields_set]
        values = {name: self.part(getattr(table, name), (*place, name)) for name in given}
        base: Base | None = values.get("base")
        if base is not None and base.name is None:
            values["base"] = base._replace(name=table.name)
        keys = {name: (*place, name) for name in given}
        keys |= {name: (*place, "base", name) for name in ("xyz", "rpy") if base is not None}
        with _placed(place, keys):
            return ARM.make(**values)


class _Unfinished:
    """A part that is being made."""


@contextmanager
def _placed(place: Place, keys: Mapping[str, Place]) -> Iterator[None]:
    """Say at which place something is that is refused in between.

    Args:
        place: of the whole.
        keys: places of what an error may be about, by a word of its subject.
    """
    try:
        yield
    except SynctrlError as error:
        subject = error.subject or ""
        words = [subject] if subject in keys else [word.strip() for word in subject.split(",") if subject]
        at = next((keys[word] for word in reversed(words) if word in keys), place)
        left = [word for word in words if word not in keys]
        problem = (
            (error.problem or str(error)) if not left else f"{', '.join(left)}: {error.problem or error}"
        )
        raise Misfit(at, problem, error.found) from error
