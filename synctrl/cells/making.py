"""From the tables of a cell file to the parts that they stand for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..coupling.cell import Cell, Member
from ..errors import InputError, SynctrlError, near
from ..robots.catalog import load_robot
from ..robots.friction import Friction
from ..robots.robot import Robot
from ..simulation.devices import Devices
from ..simulation.schedules import DisturbanceSchedule, PayloadSchedule
from ..simulation.simulate import Experiment
from .couplings import Told
from .file import BY_TABLE, MEMBER
from .folders import below
from .holding import held_by, with_robots
from .kinds import Table
from .motions import MOTIONS
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
    "name": ("robots",), "disturbance": ("disturbances",), "payload": ("loads",), "payloads": ("loads",),
    "plant_type": ("plant",),
}  # fmt: skip
#: keys of a robot that say the same, or that follow from each other
APART = (
    ("known", "estimate"), *(("holds", key) for key in ("motion", "q0", "known", "estimate", "parameters")),
)  # fmt: skip
#: what looks at each of several parts by itself
FITS: dict[str, Callable[[Cell, Any], Any]] = {
    "sensors": lambda cell, part: Devices(cell, [part]),
    "actuators": lambda cell, part: Devices(cell, (), [part]),
    "disturbances": lambda cell, part: DisturbanceSchedule(cell, [part]),
    "loads": lambda cell, part: PayloadSchedule(cell.robots, [part]),
}
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
        options = {name: getattr(file, name) for name in VALUES if name in keys}
        made = {PARTS[name]: self.part(getattr(file, name), (name,)) for name in PARTS if name in keys}
        places = [("robots", i) for i in range(len(file.robots))]
        arms = [self._robot(table, place) for table, place in zip(file.robots, places, strict=True)]
        cell = self._cell(arms, made.get("plant_type"))
        gains = self.part(file.gains, ("gains",))
        self._check(cell, made)
        if any(table.holds for table in file.robots):
            made["plant_type"] = with_robots(made["plant_type"], arms)
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

    def _check(self, cell: Cell, made: Mapping[str, Any]) -> None:
        """Refuse what does not go with the cell where it stands, and not with the whole."""
        if "adaptation" in made and self._file.gains.Gamma is not None:
            words = "expected none, for [adaptation] says how the controller learns, found one"
            raise Misfit.at(("gains", "Gamma"), words)
        for name, fits in FITS.items():
            for k, part in enumerate(made.get(PARTS[name], ())):
                keys = {key: (name, k, key) for key in getattr(self._file, name)[k].model_fields_set}
                with _placed((name, k), keys):
                    fits(cell, part)

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
            kinds = [each.name for each in MOTIONS]
            is_kind = f'; for a kind write {{ kind = "{name}", ... }}' if name in kinds else near(name, known)
            found = f"{str(name)!r}{is_kind}"
            raise Misfit.at(place, f"expected the name of {words} in [{table}], found {found}", str(name))
        if key not in self._made:
            self._made[key] = _Unfinished
            self._made[key] = self.part(known[name], key)
        if self._made[key] is _Unfinished:
            raise Misfit.at(
                place, f"expected {words} that does not refer to itself, found {name!r}", str(name)
            )
        return self._made[key]

    def _robot_index(self, name: str, place: Place) -> int:
        if name not in self._names:
            known = [each for each in self._names if each]
            listed = (
                f"one of {', '.join(map(repr, known))}" if known else "a number: the robots have no names"
            )
            raise Misfit.at(place, f"expected {listed}, found {str(name)!r}{near(name, known)}", str(name))
        return self._names.index(name)

    def _robot_number(self, number: int, place: Place) -> int:
        if not 0 <= number < len(self._names):
            last = len(self._names) - 1
            raise Misfit.at(
                place, f"expected the number of a robot, from 0 to {last}, found {number}", number
            )
        return int(number)

    def _meant(self) -> dict[str, Place]:
        """Places in the file, by the words with which errors about a cell name them."""
        gains = {name: ("gains", name) for name in self._file.gains.model_fields_set}
        names = [name or f"robot {i}" for i, name in enumerate(self._names, start=1)]
        robots: dict[str, Place] = {name: ("robots", i) for i, name in enumerate(names)}
        robots |= {f"{name}, {word}": (*robots[name], key) for name in names for word, key in WORDS.items()}
        values = {name: (name,) for name in self._file.model_fields_set}
        return {**values, **OTHERWISE, **gains, **robots}

    def _cell(self, arms: Sequence[Robot], plant: Any) -> Cell:
        file = self._file
        members = [self._member(i, arm, plant) for i, arm in enumerate(arms)]
        told = Told([member.trajectory for member in members], file.duration)
        maker = self.part(file.coupling, ("coupling",))
        with _placed(("coupling",), {"c": ("coupling", "c")}):
            coupling = maker(told)
        space = None if file.space is None else self.part(file.space, ("space",))
        clocks = {} if file.clocks is None else {"clocks": file.clocks}
        with _placed((), self._meant()):
            return Cell(members, coupling, space, file.name, **clocks)

    def _member(self, i: int, robot: Robot, plant: Any) -> Member:
        table, place = self._file.robots[i], ("robots", i)
        given = [name for name in MEMBER if name in table.model_fields_set]
        parts = {name: self.part(getattr(table, name), (*place, name)) for name in given}
        for first, second in APART:
            if first in parts and second in parts:
                raise Misfit.at((*place, second), f"expected one of `{first}` and `{second}`, found both")
        if parts.get("friction") == "none":
            parts["friction"] = Friction()
        with _placed(place, {name: (*place, name) for name in given}):
            if "holds" in parts:
                return replace(held_by(robot, i, parts.pop("holds"), plant), **parts)
            if "motion" not in parts:
                raise InputError(
                    "expected a desired motion, or what it `holds`, found none", subject="motion"
                )
            return _free(robot, **parts)

    def _load(self, *source: Any, **options: Any) -> Robot:
        """A robot that is loaded once, for however many robots of the file."""
        key = ("loaded", repr((source, options)))
        if key not in self._made:
            self._made[key] = load_robot(*source, **options)
        return self._made[key]

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
            return ARM.make(**values, load=self._load)


def _free(
    robot: Robot, motion: Any, known: float | None = None, estimate: Any = None, **parts: Any
) -> Member:
    """A member that holds nothing."""
    adapted = parts.pop("parameters", None)
    parts["parameters"] = None if adapted is None else adapted(robot)
    member = Member(robot, motion, theta_hat0=estimate, **parts)
    return member if known is None else Member(robot, motion, theta_hat0=known * member.theta, **parts)


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
    except ArithmeticError as error:
        raise Misfit.at(
            place, f"expected numbers with which one can reckon, found some that end in: {error}"
        ) from error
    except SynctrlError as error:
        subject = error.subject or ""
        words = [subject] if subject in keys else [word.strip() for word in subject.split(",") if subject]
        at = next((keys[word] for word in reversed(words) if word in keys), place)
        left = [word for word in words if word not in keys]
        said = str(error) if error.file or not error.problem else ": ".join([*left, error.problem])
        raise Misfit.at(at, said, error.found) from error
