"""Xacro files: expanded in a process of their own, with a fence around it (`xacro_child.py`)."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from threading import Event, Timer
from typing import IO, Any

from ...checks import instance
from ...errors import InputError, MissingDependencyError, RobotError
from . import xacro_child
from .packages import Packages
from .report import Notes
from .xml import quoted

SUFFIX = ".xacro"
TIME_LIMIT = 30.0
"""Time in s that a file may take; large robots take about one."""

_NEEDED = ("SYSTEMROOT",)
"""Variables of the environment without which Python does not start (on Windows)."""
_LONGEST_LINE = 6 * xacro_child.MAX_TEXT + 1000
"""Characters of an answer: JSON writes one of the text as up to six."""


def expand_xacro(
    file: str | Path,
    args: Mapping[str, object] | None = None,
    package_dirs: Iterable[str | Path] = (),
) -> str:
    """The URDF text that a xacro file expands to.

    Expressions in such a file are code. They run in a process of their own, without environment, for at most
    30 s, and can neither write, nor connect, nor start programs, nor read outside of the file's package, the
    packages beside it, `package_dirs` and what `$(find ...)` finds. This is a fence and no sandbox.

    Args:
        file: the file.
        args: values of its arguments (`<xacro:arg>`), each a text, a number or a truth value.
        package_dirs: folders in which `$(find name)` looks, see `load_robot`.

    Raises:
        RobotError: the file is not there, or does not expand, with xacro's reason.
        MissingDependencyError: xacro is not installed.
    """
    return expand(Path(file), args, Packages(Path(file), package_dirs))


def expand(
    file: Path, args: Mapping[str, object] | None, packages: Packages, notes: Notes | None = None
) -> str:
    """`expand_xacro` among packages that are known; `notes` takes arguments that the file has not."""
    notes = notes or Notes(file)
    request = {
        "file": str(file.absolute()),
        "args": _mappings(args or {}),
        "roots": [str(root) for root in packages.roots],
        "libraries": [_library("xacro", file), _library("yaml", file)],
    }
    answer = _conversation(file, request, packages)
    if "text" not in answer:
        raise _failure(file, answer)
    for name in answer.get("unused", ()):
        notes.add("left out", "xacro_args", f"the file asks for no argument {quoted(str(name))}")
    return str(answer["text"])


def _failure(file: Path, answer: Mapping[str, Any]) -> RobotError:
    """Why a file does not expand; where the user can mend it, the subject is the argument that does."""
    reason = str(answer.get("error") or "the process that expands it ended without an answer")
    words, found = (
        f"expected a xacro file that can be expanded, found: {reason}",
        answer.get("found", "nothing"),
    )
    if missing := re.search(r"Undefined substitution argument (\w+)", reason):
        words += f"; give it with xacro_args={{{missing[1]!r}: ...}}"
        return RobotError(words, file=file).about("xacro_args", found=missing[1])
    if missing := re.search(r"package '([^']*)' is not found", reason):
        words += "; give a folder that holds it with package_dirs=[...]"
        return RobotError(words, file=file).about("package_dirs", found=missing[1])
    return RobotError(words, file=file, found=found)


def _mappings(args: Mapping[str, object]) -> dict[str, str]:
    """Arguments as xacro takes them: all of them text, truth values in small letters."""
    instance("xacro_args", args, Mapping, "names with values")
    for name, value in args.items():
        if not isinstance(name, str) or not isinstance(value, (str, int, float)):
            kind = type(value).__name__
            words = f"expected a text, number or truth value, found {name!a}: {kind}"
            raise InputError(words, subject="xacro_args", found=kind)
    return {n: str(value).lower() if isinstance(value, bool) else str(value) for n, value in args.items()}


def _library(name: str, file: Path) -> str:
    """The folder that a library lies in; it is not imported here."""
    spec = find_spec(name)
    if spec is None or spec.origin is None:
        raise MissingDependencyError(
            f"{file}: expanding a xacro file needs {name}: pip install 'synctrl[xacro]'; or expand it with "
            "ROS first, and load the URDF",
            file=file,
            found=name,
        )
    return str(Path(spec.origin).parent.parent)


def _conversation(file: Path, request: dict[str, Any], packages: Packages) -> dict[str, Any]:
    """The child's last word; {} if it had none. Meanwhile it is told where packages are."""
    with _child(file) as (source, answers):
        try:
            _say(source, request)
            while line := answers.readline(_LONGEST_LINE):
                message = json.loads(line)
                if "find" not in message:
                    return dict(message)
                folder = packages.folder(str(message["find"]))
                _say(source, None if folder is None else str(folder))
        except (OSError, ValueError):  # it is gone, or what it said is cut short
            pass
    return {}


def _say(stream: IO[str], message: object) -> None:
    stream.write(json.dumps(message) + "\n")
    stream.flush()


@contextmanager
def _child(file: Path) -> Iterator[tuple[IO[str], IO[str]]]:
    """The child's standard input and output; it is gone when the block is left, or after the time limit.

    Raises:
        RobotError: the time limit was met.
    """
    command = [sys.executable, "-I", "-S", "-X", "utf8", xacro_child.__file__]
    pipe, nothing = subprocess.PIPE, subprocess.DEVNULL
    given = {name: os.environ[name] for name in _NEEDED if name in os.environ}
    try:
        child = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=nothing, env=given, encoding="utf-8"
        )
    except OSError as error:
        words = f"expected a process of Python that expands it, found: {error}"
        raise RobotError(words, file=file, found="no process") from error
    late = Event()

    def stop() -> None:
        late.set()
        child.kill()

    timer = Timer(TIME_LIMIT, stop)
    timer.start()
    try:
        assert child.stdin is not None and child.stdout is not None
        yield child.stdin, child.stdout
    finally:
        timer.cancel()
        child.kill()
        with suppress(OSError):  # what was not sent is lost with it
            child.communicate()
    if late.is_set():
        words = f"expected a xacro file that expands within {TIME_LIMIT:g} s, found more"
        raise RobotError(words, file=file, found="no end")
