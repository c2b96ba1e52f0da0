"""Expands one xacro file behind a fence: the program of a process of its own, see `xacro.py`.

Expressions in a xacro file are Python. xacro takes the builtins away from them, which is no obstacle for
whoever means harm; so this process gives up what it does not need before it looks at the file: limits of the
operating system on memory, time, open files and the size of written files, then an audit hook that lets
nothing pass but what expanding takes. That is a fence and no sandbox: it is built of Python, inside Python.

It reads one line of JSON, {"file", "args", "roots", "libraries"}, from the standard input, and writes lines
of JSON: {"find": name} for each package it needs, answered by a line with its folder or null, and in the end
{"text": ..., "unused": names} or {"error": ..., "found": ...}, the reason in words and in one word: what the
fence does not let pass, or else the kind of the error. It imports nothing of this package, and runs with
`python -I -S`.
"""

from __future__ import annotations

import errno
import json
import os
import stat
import sys
from collections.abc import Callable
from typing import Any, NoReturn, TextIO

MAX_TEXT = 10_000_000
MEMORY = 1_000_000_000
SECONDS = 60
FILES = 64

PASSING = frozenset({"compile", "exec", "builtins.id"})
"""Events of evaluating an expression."""
LISTING = frozenset({"os.listdir", "os.scandir", "glob.glob"})
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


def main() -> None:
    """Expand the file that the standard input names."""
    source, answer = sys.stdin, os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what the file's messages print is no answer
    request = json.loads(source.readline())
    roots = [os.path.realpath(root) for root in request["roots"]]

    def find(name: str) -> str:
        _send(answer, find=str(name))
        folder = json.loads(source.readline())
        if folder is None:
            raise LookupError(f"package {str(name)!r} is not found")
        roots.append(os.path.realpath(folder))
        return str(folder)

    xacro = _prepared(request["libraries"], find)
    _limit_resources()
    sys.addaudithook(_fence(roots))
    try:
        args = _Arguments(request["args"])
        text = _expanded(xacro, request["file"], args)
        _send(answer, text=text, unused=sorted(set(request["args"]) - args.asked))
    except BaseException as error:
        cause = _cause(error)
        found = getattr(cause, "event", type(cause).__name__)
        _send(answer, error=_reason(xacro, error, cause), found=found)


def _send(answer: TextIO, **message: str | list[str]) -> None:
    answer.write(json.dumps(message) + "\n")
    answer.flush()


def _prepared(libraries: list[str], find: Callable[[str], str]) -> Any:
    """xacro with all that it imports later, and with packages that are found by `find`."""
    sys.path.extend(libraries)
    import encodings.utf_8_sig  # noqa: F401
    import xml.dom.expatbuilder  # noqa: F401

    import xacro
    import yaml  # noqa: F401
    from xacro import substitution_args

    substitution_args._eval_find = find
    substitution_args._eval_dict["find"] = find
    del sys.path[:]
    return xacro


def _limit_resources() -> None:
    try:
        import resource
    except ImportError:  # not on Windows
        return
    limits = {"RLIMIT_AS": MEMORY, "RLIMIT_CPU": SECONDS, "RLIMIT_NOFILE": FILES, "RLIMIT_FSIZE": 0}
    for name, value in {**limits, "RLIMIT_CORE": 0}.items():
        try:
            resource.setrlimit(getattr(resource, name), (value, value))
        except (AttributeError, OSError, ValueError):  # this system has no such limit, or a lower one
            continue


# -- the fence ---------------------------------------------------------------------------------------------


class Fenced(PermissionError):
    """Something that a xacro file may not do: `event` is the one of Python, or what it is about in words."""

    event = ""


def _fence(roots: list[str]) -> Callable[[str, tuple], None]:
    """An audit hook that stops every event but reading and listing below `roots`, and harmless ones."""

    def hook(event: str, args: tuple) -> None:
        if event in PASSING:
            return
        if event == "open":
            _check_open(roots, *args)
        elif event in LISTING:
            _check_inside(roots, args[0])
        else:
            _refuse(event, args, "do this: ")

    return hook


def _check_open(roots: list[str], path: Any, mode: str | None, flags: int) -> None:
    if flags & _WRITING or set(mode or "r") & set("wax+"):
        _refuse("write", path)
    _check_inside(roots, path)
    if not stat.S_ISREG(os.stat(path).st_mode):
        _refuse("read what is no regular file", path)


def _check_inside(roots: list[str], path: Any) -> None:
    if not isinstance(path, (str, bytes)):
        _refuse("read", path)
    real = os.path.realpath(os.fsdecode(path))
    if not any(real == root or real.startswith(root.rstrip(os.sep) + os.sep) for root in roots):
        _refuse("read outside of its packages", path)


def _refuse(what: str, value: Any, doing: str = "") -> NoReturn:
    error = Fenced(errno.EACCES, f"a xacro file may not {doing}{what}", ascii(value)[:200])
    error.event = what
    raise error


# -- expanding ---------------------------------------------------------------------------------------------


class _Arguments(dict[str, str]):
    """Values of arguments; `asked` has the names that the file asked for."""

    def __init__(self, values: dict[str, str]) -> None:
        super().__init__(values)
        self.asked: set[object] = set()

    def __contains__(self, name: object) -> bool:
        self.asked.add(name)
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        self.asked.add(name)
        return super().__getitem__(name)


def _expanded(xacro: Any, file: str, args: dict[str, str]) -> str:
    text = xacro.process_file(file, mappings=args).documentElement.toprettyxml(indent="  ")
    if len(text) > MAX_TEXT:
        raise ValueError(f"expected at most {MAX_TEXT / 1e6:g} MB of URDF, found {len(text) / 1e6:.0f} MB")
    return str(text)


def _cause(error: Any) -> BaseException:
    """What was raised in the end, below what xacro made of it."""
    while getattr(error, "exc", None) is not None:
        error = error.exc
    return error


def _reason(xacro: Any, error: BaseException, cause: BaseException) -> str:
    """xacro's reason in one line, with the files and macros that led to it."""
    kind = "" if str(cause) else type(cause).__name__
    told = cause if str(error).startswith("<class") else error  # xacro repeats what the cause says
    words = " ".join([kind, *str(told).split()]).strip()
    files = [str(file) for file in xacro.filestack or [] if file]
    macros = [macro.body.getAttribute("name") for macro in xacro.macrostack or []]
    where = [f"in {files[-1]}"] if len(files) > 1 else []
    where += [f"in macro {macros[-1]!r}"] if macros else []
    return ", ".join([words[:1000], *where])


if __name__ == "__main__":
    main()
