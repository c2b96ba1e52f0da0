"""Programs that are run within limits of time and output, and ended with all that they have started."""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import threading
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from time import monotonic

from ..errors import CompilationError

#: what one call may print, bytes
MOST_PRINTED = 1_000_000
#: how often a running program is looked after, s
GLANCE = 0.05
#: variables by which zig is told where to keep what it makes on the way
_ZIG_PLACES = ("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR")
#: whether the system can end a program with the children that it has left, and wait for its pipe; not Windows
_GROUPS = hasattr(os, "killpg")


def run(
    command: Iterable[str], seconds: float, place: Path, stop: threading.Event | None = None
) -> tuple[int, str]:
    """Run a program in a process group of its own, and leave none of that group behind.

    Args:
        command: the program and its arguments.
        seconds: how long it may take, s.
        place: a folder for what it makes on the way.
        stop: ends it early.

    Returns:
        Its exit status, and what it printed.

    Raises:
        CompilationError: it cannot be run, takes longer, prints without end, or was stopped.
    """
    command = list(command)
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env={**os.environ, **dict.fromkeys(_ZIG_PLACES, str(place / "zig"))},
        )
    except (OSError, ValueError) as error:
        raise fault(command[0], "cannot be run", f": {error}") from error
    with process:
        try:
            follow = _follow if _GROUPS else _follow_alone
            printed = follow(process, command[0], seconds, stop or threading.Event())
        finally:
            _end(process)
    return process.returncode, printed.decode(errors="replace").strip()


def fault(program: str, found: str, more: str = "") -> CompilationError:
    """The error about a compiler that does something else than to compile."""
    return CompilationError(f"'{program}' {found}{more}", subject="C compiler", found=found)


# -- internals --------------------------------------------------------------------------------------------


def _follow(process: subprocess.Popen[bytes], name: str, seconds: float, stop: threading.Event) -> bytes:
    """What a program prints until it ends.

    A child that it leaves behind may hold the pipe open: the end of the program counts, not that of the pipe.
    """
    printed, deadline, ended = bytearray(), monotonic() + seconds, False
    with selectors.DefaultSelector() as pipe:
        pipe.register(process.stdout, selectors.EVENT_READ)  # type: ignore[arg-type]
        while not ended:
            _check_limits(name, len(printed), seconds, deadline, stop)
            if not pipe.get_map():
                ended = _ends_soon(process)
            elif not pipe.select(GLANCE):
                ended = process.poll() is not None
            elif chunk := os.read(process.stdout.fileno(), 65536):  # type: ignore[union-attr]
                printed += chunk
            else:
                pipe.unregister(process.stdout)  # type: ignore[arg-type]
    return bytes(printed)


def _check_limits(name: str, printed: int, seconds: float, deadline: float, stop: threading.Event) -> None:
    """Raise if a running program must be stopped."""
    way_out = " with the processes that it had started; name another one by CC, or use engine='pinocchio'"
    if stop.is_set():
        raise fault(name, "was stopped", ", because something else failed")
    if printed > MOST_PRINTED:
        raise fault(name, "printed without end and was stopped", way_out)
    if monotonic() > deadline:
        raise fault(name, f"did not end within {seconds:g} s and was stopped", way_out)


def _ends_soon(process: subprocess.Popen[bytes]) -> bool:
    with suppress(subprocess.TimeoutExpired):
        process.wait(GLANCE)
    return process.returncode is not None


def _follow_alone(
    process: subprocess.Popen[bytes], name: str, seconds: float, stop: threading.Event
) -> bytes:
    """What a program prints until nobody holds the pipe any more."""
    deadline = monotonic() + seconds
    while True:
        try:
            return process.communicate(timeout=GLANCE)[0]
        except subprocess.TimeoutExpired as error:
            _check_limits(name, len(error.output or b""), seconds, deadline, stop)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a program with the children that it has left, where the system can."""
    with suppress(ProcessLookupError, PermissionError):
        if _GROUPS:
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
