"""Values of a cell file: numbers, words, names of robots and of files, each read strictly."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from types import GenericAlias
from typing import Annotated, Any

import numpy as np
from pydantic import PlainValidator, WithJsonSchema

from ..coupling.starts import ON_PATH
from ..errors import near
from ..robots.catalog import is_path
from ..robots.urdf.document import Pose

#: what arrays of some depth are called
DEPTHS = ("a number", "a list of numbers", "a list of lists of numbers", "a list of matrices")
_DEGREES = re.compile(r" *([-+]?[0-9]+(?:\.[0-9]+)?) *(?:deg|°) *", re.ASCII)
#: a number, or a text such as "90 deg", as editors are told
_ANGLE = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": f"^{_DEGREES.pattern}$"}]}
PLAIN = (bool, int, float, str)
#: how deep arrays go
DEEPEST = len(DEPTHS)
#: letters of a found text that a message shows
SHOWN = 60


class RobotName(str):
    """A robot of the file, by name."""


class RobotNumber(int):
    """A robot of the file, counted from 0."""


class FileName(str):
    """A file below the folder of the cell file."""


class MotionName(str):
    """One of the motions of the file, by name."""


class PathName(str):
    """One of the paths of the file, by name."""


def shown(value: Any) -> str:
    """What was found, in few words."""
    kinds = ((bool, str(value).lower()), (dict, "a table"), (list, "a list"))
    for kind, words in kinds:
        if isinstance(value, kind):
            return words
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


def misfit(expected: str, found: str) -> ValueError:
    """The error of one value, which pydantic gives a place."""
    return ValueError(f"expected {expected}, found {found}")


def _in_radians(value: Any) -> Any:
    """Numbers in lists, of which texts such as "90 deg" become angles in rad."""
    if isinstance(value, list):
        return [_in_radians(each) for each in value]
    angle = _DEGREES.fullmatch(value) if isinstance(value, str) else None
    return value if angle is None else float(np.deg2rad(float(angle.group(1))))


def _angles(depths: tuple[int, ...], value: Any) -> Any:
    return _numbers(depths, _in_radians(value))


def _depth(value: Any, level: int = 0) -> int:
    """How deep numbers lie in lists, the same everywhere."""
    if isinstance(value, list):
        if level == DEEPEST:
            raise misfit("lists that are not that deep", "more lists in lists")
        depths = {_depth(each, level + 1) for each in value}
        if len(depths) > 1:
            raise misfit("numbers or lists", "some of each in one list")
        return 1 + max(depths, default=0)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise misfit("numbers" if level else "a number", shown(value))
    return 0


def _numbers(depths: tuple[int, ...], value: Any) -> Any:
    if not isinstance(value, (int, float, list)) or isinstance(value, bool):
        raise misfit(_words(depths) if len(depths) < 3 else "numbers", shown(value))
    found = _depth(value)
    if found not in depths:
        raise misfit(_words(depths), DEPTHS[found] if found < DEEPEST else "deeper lists")
    return _floats(value)


def _floats(value: Any) -> Any:
    if isinstance(value, list):
        return [_floats(each) for each in value]
    try:
        return float(value)
    except OverflowError:
        raise misfit("a number", "one that is too large") from None


def _words(depths: tuple[int, ...]) -> str:
    return " or ".join(DEPTHS[depth] for depth in depths)


def _schema(depth: int, number: dict[str, Any]) -> dict[str, Any]:
    return number if depth == 0 else {"type": "array", "items": _schema(depth - 1, number)}


def kept(read: Callable[[Any], Any], schema: dict[str, Any]) -> Any:
    """A type of values that `read` reads."""
    return Annotated[Any, PlainValidator(read), WithJsonSchema(schema)]


def _any_of(schemas: list[dict[str, Any]]) -> dict[str, Any]:
    return schemas[0] if len(schemas) == 1 else {"anyOf": schemas}


def list_of(each: Any) -> Any:
    """A list of values of some type."""
    return GenericAlias(list, (each,))


def by_name(each: Any) -> Any:
    """A table of values of some type, by names that a user chooses."""
    return GenericAlias(dict, (str, each))


def numbers(*depths: int) -> Any:
    """Numbers in lists that are that deep."""
    schemas = [_schema(depth, {"type": "number"}) for depth in depths]
    return kept(partial(_numbers, depths), _any_of(schemas))


def angles(*depths: int) -> Any:
    """Numbers in lists that are that deep, which may be angles in degrees, "90 deg"."""
    return kept(partial(_angles, depths), _any_of([_schema(depth, _ANGLE) for depth in depths]))


def _of(kind: type, words: str, value: Any) -> Any:
    if type(value) is not kind:
        raise misfit(words, shown(value))
    return value


def checked_choice(words: tuple[str, ...], value: Any) -> str:
    """A text, if it is one of some words."""
    known = ", ".join(map(repr, words))
    if not isinstance(value, str):
        raise misfit(f"one of {known}", shown(value))
    if value not in words:
        raise misfit(f"one of {known}", f"{shown(value)}{near(value, words)}")
    return value


def choice(*words: str) -> Any:
    """One of some words."""
    return kept(partial(checked_choice, words), {"enum": list(words)})


def _robot(value: Any) -> RobotName | RobotNumber:
    if isinstance(value, str):
        return RobotName(value)
    return RobotNumber(_of(int, "the name of a robot, or its number, counted from 0", value))


def _rotation(value: Any) -> Any:
    """A rotation matrix, of nine numbers or of three angles about the axes x, y, z, in that order, in rad."""
    read = _angles((1, 2), value)
    if read and isinstance(read[0], list):
        return read
    if len(read) != 3:
        raise misfit("three angles, or a matrix of three rows", f"{len(read)} numbers")
    return Pose(rpy=(read[0], read[1], read[2])).se3.rotation.tolist()


def _velocities(value: Any) -> Any:
    """Joint velocities, which may be in degrees per second, or the word for those of the path."""
    if value == ON_PATH:
        return ON_PATH
    if not isinstance(value, list):
        raise misfit(f'{DEPTHS[1]} or "{ON_PATH}"', shown(value))
    return _angles((1,), value)


def _positive(value: Any) -> float:
    number = _numbers((0,), value)
    if not 0 < number < np.inf:
        raise misfit("a positive, finite number", shown(value))
    return number


def _text_of(kind: Callable[[str], Any], words: str, value: Any) -> Any:
    return kind(_of(str, words, value))


def texts(kind: Callable[[str], Any], words: str) -> Any:
    """A text that stands for something else."""
    return kept(partial(_text_of, kind, words), {"type": "string"})


def _source(value: Any) -> str:
    """A name of a robot, or a path if it looks like one, as `load_robot` tells them apart."""
    text = _of(str, "the name of a robot, or the path of its file", value)
    return FileName(text) if is_path(text) else text


def _scalar(value: Any) -> Any:
    if type(value) not in PLAIN:
        raise misfit("a number, a text, true or false", shown(value))
    return value


def scalar() -> Any:
    """A number, a text or a truth value."""
    return kept(_scalar, {"type": ["number", "string", "boolean"]})


NUMBER, VECTOR, MATRIX = numbers(0), numbers(1), numbers(2)
#: one for all, or one for each
NUMBERS, ANY_NUMBERS = numbers(0, 1), numbers(0, 1, 2, 3)
#: step, period or tolerance
POSITIVE = kept(_positive, {"type": "number", "exclusiveMinimum": 0})
INTEGER = kept(partial(_of, int, "a whole number"), {"type": "integer"})
TEXT = kept(partial(_of, str, "a text"), {"type": "string"})
TRUTH = kept(partial(_of, bool, "true or false"), {"type": "boolean"})
#: (3, 3), or its diagonal, (3,)
INERTIA = numbers(1, 2)
ANGLE, ANGLES, ANGLE_ROWS = angles(0), angles(1), angles(2)
#: joint velocities, or the word for those of the path
VELOCITIES = kept(_velocities, _any_of([_schema(1, _ANGLE), {"enum": [ON_PATH]}]))
ROTATION = kept(_rotation, {"type": "array", "minItems": 3, "maxItems": 3})
ROBOT = kept(_robot, {"type": ["string", "integer"]})
SOURCE = kept(_source, {"type": "string"})
FILE = texts(FileName, "a path below the folder of this file")
MOTION_NAME, PATH_NAME = texts(MotionName, "the name of a motion"), texts(PathName, "the name of a path")


def plain(value: Any) -> Any:
    """Arrays and numbers of numpy's as Python's; anything else as it is."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if type(value) in (list, tuple):
        return [plain(each) for each in value]
    return value
