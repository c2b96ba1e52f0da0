"""How a command answers: in words and tables, or as JSON; with an error in a line; and with a code."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from typing import Any

import typer
from rich.text import Text

from ..errors import RunInterrupted, SimulationError, SynctrlError
from . import codes
from .console import complain, out
from .plain import plain


@dataclass
class Answer:
    """What a command has found so far.

    Attributes:
        as_json: whether nothing but one JSON object goes to the standard output.
        data: what that object has in it.
        code: with which the command will end.
    """

    as_json: bool
    data: dict[str, Any] = field(default_factory=dict)
    code: int = codes.DONE

    def show(self, *things: Any) -> None:
        """Print texts and tables, unless the answer is JSON."""
        if not self.as_json:
            for thing in things:
                out().print(thing, soft_wrap=isinstance(thing, str | Text))

    def fault(self, error: BaseException, code: int) -> None:
        """Say an error in a line, and remember it; the command goes on, and will end with the code."""
        self.code = code
        self.data["error"] = about_error(error)
        complain("error" if code != codes.INTERRUPTED else "interrupted", str(error) or "by Ctrl-C")


@contextmanager
def answering(as_json: bool) -> Iterator[Answer]:
    """A block that answers: errors of the package in it are said without a traceback, warnings in a line.

    Raises:
        typer.Exit: at the end, if the code is not 0.
    """
    answer = Answer(as_json)
    with _plain_warnings(answer), redirect_stdout(sys.stderr if as_json else sys.stdout):
        try:
            yield answer
        except (SynctrlError, KeyboardInterrupt) as error:
            answer.fault(error, code_of(error))
    if as_json:
        print(json.dumps(plain(answer.data), ensure_ascii=False, indent=1, allow_nan=False))
    if answer.code:
        raise typer.Exit(answer.code)


def code_of(error: BaseException) -> int:
    """With which code a command ends that an error has ended."""
    if isinstance(error, KeyboardInterrupt):
        return codes.INTERRUPTED
    return codes.STOPPED if isinstance(error, SimulationError) and error.result is not None else codes.REFUSED


def about_error(error: BaseException) -> dict[str, Any]:
    """An error as plain data: its kind, its message, and what it is about."""
    names = ("subject", "found", "file", "line", "time", "cause")
    more = {name: value for name in names if (value := getattr(error, name, None)) is not None}
    kind = "interrupted" if isinstance(error, KeyboardInterrupt | RunInterrupted) else type(error).__name__
    return {"kind": kind, "message": str(error), **more}


@contextmanager
def _plain_warnings(answer: Answer) -> Iterator[None]:
    """Say what is warned of in a line, once, and remember it."""
    said: list[str] = answer.data.setdefault("warnings", [])

    def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        if str(message) not in said and not issubclass(category, DeprecationWarning):
            said.append(str(message))
            complain("warning", str(message))

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield
