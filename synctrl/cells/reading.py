"""From a cell file to an experiment."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from ..checks import instance
from ..errors import near
from ..files import read_regular
from ..simulation.simulate import Experiment
from .file import CellTable
from .making import Maker
from .places import lines_of, nearest
from .problems import CellFileError, Misfit, Place, key_of
from .schema import Loc, keys_at, kinds_at, meaning_at
from .values import shown

#: bytes of a cell file, at most
LARGEST = 16 * 2**20

#: what kinds are called elsewhere
OTHER_NAMES = {
    "line": "cubic", "straight": "cubic", "linear": "cubic", "point-to-point": "cubic", "waypoints": "spline",
    "points": "spline", "csv": "samples", "lemniscate": "figure-eight", "fixed": "hold", "still": "hold",
    "sine": "swing",
}  # fmt: skip


class CellFile(NamedTuple):
    """What a cell file says.

    Attributes:
        experiment: the cell with its controller and what disturbs it.
        run: how it is run unless told otherwise: arguments of `Experiment.simulate`.
    """

    experiment: Experiment
    run: Mapping[str, Any]


def read_cell(path: str | Path) -> Experiment:
    """The experiment that a cell file describes.

    Nothing in a file is executed, and files that it names lie below its own folder.

    Args:
        path: of the file, in TOML.

    Raises:
        InputError: no path.
        CellFileError: no such file, or what is wrong with it: with file, line and key, with what was found
            and what is expected, and with near names.
    """
    return read_cell_file(path).experiment


def read_cell_file(path: str | Path) -> CellFile:
    """All that a cell file says, how it is run too.

    Args:
        path: of the file, in TOML.

    Raises:
        InputError, CellFileError: see `read_cell`.
    """
    instance("path", path, (str, Path), "a path")
    path = Path(path)
    text = _text(path)
    data = _parsed(path, text)
    try:
        file: Any = CellTable.model_validate(data)
    except ValidationError as error:
        found = sorted(_problems(path, text, data, error), key=lambda problem: problem.line or 0)
        raise CellFileError.of_all(found) from None
    try:
        made = Maker(file, path.parent).experiment()
    except Misfit as misfit:
        raise _error(path, text, misfit) from misfit.__cause__
    return CellFile(made, file.run.model_dump(exclude_unset=True) if file.run else {})


def _text(path: Path) -> str:
    if "\0" in str(path):
        raise CellFileError("expected the name of a file, found a zero byte in it", file=path)
    try:
        if path.stat().st_size > LARGEST:
            raise CellFileError(f"expected a cell file of at most {LARGEST} bytes", file=path)
        return read_regular(path).decode("utf-8")
    except OSError as error:
        raise CellFileError(f"expected a cell file, found: {error.strerror}", file=path) from None
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise CellFileError("expected UTF-8, found other bytes", file=path, line=line) from None


def _parsed(path: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number of thousands of digits is no TOMLDecodeError
        found = re.search(r"\(at line (\d+), column \d+\)", str(error))
        line = int(found.group(1)) if found else text.count("\n") + 1
        raise CellFileError(f"expected TOML, found: {error}", file=path, line=line) from None


def _error(path: Path, text: str, misfit: Misfit) -> CellFileError:
    line = nearest(lines_of(text), misfit.place)
    key = key_of(misfit.place) or None
    return CellFileError(misfit.problem, subject=key, found=misfit.found, file=path, line=line)


def _problems(path: Path, text: str, data: Any, error: ValidationError) -> Iterator[CellFileError]:
    lines, found = lines_of(text), error.errors(include_url=False)
    mistyped = {name for problem in found for name in _meant(problem, found)}
    for problem in found:
        if problem["type"] == "missing" and problem["loc"] in mistyped:
            continue  # it is there under a name that is nearly the right one, which is said
        place, words, value = _said(problem, data)
        key, line = key_of(place) or None, nearest(lines, place)
        yield CellFileError(words, subject=key, found=value, file=path, line=line)


def _meant(problem: Any, found: Sequence[Any]) -> list[Loc]:
    """Missing keys that a key without a meaning may have meant."""
    *table, name = problem["loc"] or ("",)
    if problem["type"] != "extra_forbidden":
        return []
    missing = [p["loc"] for p in found if p["type"] == "missing" and [*p["loc"][:-1]] == table]
    return [loc for loc in missing if near(str(name), [str(loc[-1])])]


def _said(problem: Any, data: Any) -> tuple[Place, str, Any]:
    """Where a problem is, in words, and what was found."""
    kind, found, loc = problem["type"], problem["input"], problem["loc"]
    place = _place(loc, data, kind == "missing")
    if kind == "missing":
        meaning = meaning_at(loc).rstrip(".")
        return place, f"expected a value{f' ({meaning})' if meaning else ''}, found none", None
    if kind == "extra_forbidden":
        known = keys_at(loc[:-1])
        words = f"expected no key of this name{near(str(loc[-1]), known)}"
        return place, f"{words}; {_whereabouts(loc)}known are {', '.join(known)}", loc[-1]
    if kind.startswith("union_tag"):
        return _unknown_kind(place, found, kinds_at(loc))
    if kind == "value_error":
        return place, str(problem["ctx"]["error"]), found
    if kind == "list_type" and isinstance(found, dict):
        return place, f"expected [[{place[-1]}]] before each of them, found [{place[-1]}]", None
    words = {"list_type": "a list", "dict_type": "a table", "model_type": "a table"}.get(kind, kind)
    return place, f"expected {words}, found {shown(found)}", found


def _whereabouts(loc: Loc) -> str:
    """Where a key should stand that is one of the file itself."""
    is_of_file = len(loc) > 1 and loc[-1] in keys_at(())
    return "a key of the whole file stands before the first [table]; " if is_of_file else ""


def _unknown_kind(place: Place, found: Any, known: list[str]) -> tuple[Place, str, Any]:
    listed = f"one of {', '.join(map(repr, known))}"
    if not isinstance(found, dict):
        return place, f"expected a table with a `kind`, {listed}, found {shown(found)}", found
    if "kind" not in found:
        return (*place, "kind"), f"expected a value, {listed}, found none", None
    kind = found["kind"]
    said = f"{shown(kind)}{_like(kind, known) if isinstance(kind, str) else ''}"
    return (*place, "kind"), f"expected {listed}, found {said}", kind


def _like(kind: str, known: list[str]) -> str:
    """What a kind of another name may have meant."""
    meant = OTHER_NAMES.get(kind)
    return f" (did you mean {meant!r}?)" if meant in known else near(kind, known)


def _place(loc: tuple[str | int, ...], data: Any, missing: bool) -> Place:
    """The place that pydantic means, without the names of kinds that it goes through."""
    place: list[str | int] = []
    for k, step in enumerate(loc):
        inside = isinstance(data, dict) and step in data
        if inside or (isinstance(data, list) and isinstance(step, int) and step < len(data)):
            data = data[step]
        elif not missing or k < len(loc) - 1:
            continue
        place.append(step)
    return tuple(place)
