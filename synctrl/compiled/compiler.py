"""The machine's C compiler: found by name, asked what it knows, and told to make a library."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
import threading
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from ..errors import MissingDependencyError
from .process import fault, run

#: for the processor of this machine, which is in the key of the cache, where the compiler knows how
NATIVE = "-march=native"
#: code may stand anywhere in memory; for Windows that goes without saying, and clang refuses to be told
_IN_LIBRARIES = () if sys.platform == "win32" else ("-fPIC",)
#: products and sums are rounded one by one, so that results do not depend on the compiler
FLAGS = ("-O2", NATIVE, "-ffp-contract=off", "-fno-math-errno", *_IN_LIBRARIES)
#: how names of libraries end
SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
#: what the program of the package ziglang is called with: without checks that end a process, and without the
#: libraries for them and for arithmetic that processors do not have, which it would have to compile first
ZIG = ("cc", "-fno-sanitize=undefined", *(() if sys.platform == "win32" else ("--rtlib=none",)))
#: how long one call of the compiler may take, s; the largest arms take about a minute on a slow machine
LONGEST = 900.0
#: how long it may take to say its version, s
LONGEST_VERSION = 30.0


def compiler() -> tuple[str, ...]:
    """The C compiler: the environment variable CC, or cc, gcc or clang, or that of the package ziglang.

    Raises:
        MissingDependencyError: there is none, or CC does not name one; the message says why.
    """
    named = _named()
    for command in [named] if named else [("cc",), ("gcc",), ("clang",)]:
        if shutil.which(command[0]):
            return command
    if named:
        raise _bad_cc(f"'{named[0]}' {_why_not(named[0])}")
    if zig := _zig():
        return zig
    raise MissingDependencyError(
        "engine='compiled' needs cc, gcc or clang, and found none; install one, for example by "
        "pip install 'synctrl[compiler]', or use engine='pinocchio'",
        subject="C compiler",
    )


def compiler_version(command: tuple[str, ...]) -> str:
    """What a compiler prints when asked for its version; it is asked once in a process.

    Raises:
        CompilationError: it cannot be run, or does not come to an end.
    """
    return _printed_version(command, shutil.which(command[0]))


def flags(command: tuple[str, ...]) -> list[str]:
    """The flags for a compiler, without what it does not know; it is asked once in a process.

    Raises:
        CompilationError: it cannot be run, or does not come to an end.
    """
    native = NATIVE in FLAGS and _knows_native(command, shutil.which(command[0]))
    return [flag for flag in FLAGS if native or flag != NATIVE]


def compile_library(sources: Iterable[str], folder: Path) -> Path:
    """Compile each source as soon as it is there, as many at a time as there are cores, and link them.

    Whatever goes wrong, no compiler is left running.

    Raises:
        CompilationError: the compiler refuses, hangs, or does not write what it should.
    """
    command, stop = compiler(), threading.Event()
    compiling = [*command, *flags(command)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            jobs = [
                pool.submit(_compile, compiling, source, folder / f"part{k}.c", stop)
                for k, source in enumerate(sources)
            ]
            objects = [str(job.result()) for job in jobs]
        except BaseException:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return _make(folder / f"library{SUFFIX}", [*command, "-shared", *objects, "-lm"], stop)


# -- internals --------------------------------------------------------------------------------------------


def _named() -> tuple[str, ...]:
    """The command in CC, word by word."""
    text = os.environ.get("CC", "")
    try:
        return tuple(shlex.split(text))
    except ValueError as error:
        raise _bad_cc(f"{text!r} cannot be split into words") from error


def _zig() -> tuple[str, ...] | None:
    """The compiler of the package ziglang, if that is installed.

    It is the program itself: `python -m ziglang` would look for a module of this name in the working folder.
    """
    found = find_spec("ziglang")
    for folder in (found and found.submodule_search_locations) or ():
        program = os.path.join(folder, "zig.exe" if sys.platform == "win32" else "zig")
        if os.access(program, os.X_OK):
            return program, *ZIG
    return None


def _bad_cc(found: str) -> MissingDependencyError:
    return MissingDependencyError(
        "engine='compiled' needs a C compiler, expected a command such as gcc or clang; "
        f"{found}: correct or unset CC, or use engine='pinocchio'",
        subject="CC",
        found=found,
    )


def _why_not(program: str) -> str:
    """What is the matter with a program that cannot be found."""
    if not program:
        return "is no name"
    if os.path.isdir(program):
        return "is a folder"
    return "is not executable" if os.path.isfile(program) else "was not found"


@cache
def _printed_version(command: tuple[str, ...], found_at: str | None) -> str:
    return _asked([*command, "--version"])[1]


@cache
def _knows_native(command: tuple[str, ...], found_at: str | None) -> bool:
    return _asked([*command, NATIVE, "-E", "-x", "c", os.devnull])[0] == 0


def _asked(command: list[str]) -> tuple[int, str]:
    """What a compiler answers to a question about itself."""
    try:
        with TemporaryDirectory(prefix="synctrl-") as place:
            return run(command, LONGEST_VERSION, Path(place))
    except OSError as error:
        raise fault(command[0], "cannot be run", f" without a folder for temporary files: {error}") from error


def _compile(command: list[str], source: str, path: Path, stop: threading.Event) -> Path:
    path.write_text(source, encoding="utf-8")
    return _make(path.with_suffix(".o"), [*command, "-c", str(path)], stop)


def _make(target: Path, command: list[str], stop: threading.Event) -> Path:
    """Let the compiler write a file.

    Raises:
        CompilationError: it does not.
    """
    status, printed = run([*command, "-o", str(target)], LONGEST, target.parent, stop)
    said = f":\n{printed[:2000]}" if printed else ""
    if status < 0:
        raise fault(command[0], f"was ended by signal {-status}", said)
    if status != 0:
        raise fault(command[0], "refused generated code", said or f" with status {status}")
    if not (target.is_file() and target.stat().st_size):
        named = f"; is it a compiler? It was named by {'CC' if os.environ.get('CC') else 'PATH'}"
        raise fault(command[0], f"ended without an error, but wrote no '{target.name}'", named + said)
    return target
