"""What is wrong with a cell file, or with a cell that cannot be written as one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..errors import InputError, Portable

#: a place in a file: keys and indices from the top
Place = tuple[str | int, ...]
#: problems that a message has in full
SHOWN = 10


class CellFileError(InputError):
    """A cell file that cannot be read, or a cell that cannot be written as one.

    The message begins with the file and the line. The subject is the key, "robots[0].motion.duration" for
    example: arrays are counted from 0.

    Attributes:
        others: what else is wrong with the file, each an error of this kind; the message has the first ten.
    """

    others: tuple[CellFileError, ...] = ()

    def _whole(self, message: str) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        message = super()._whole(message)
        return message if place is None else f"{place}: {message}"

    @classmethod
    def of_all(cls, found: Sequence[CellFileError]) -> CellFileError:
        """The first of some problems, which has the others."""
        first, *others = found
        if not others:
            return first
        more = [f"and {len(others) - SHOWN} more"] * (len(others) > SHOWN)
        words = "\n".join([first.problem, *map(str, others[:SHOWN]), *more])
        whole = cls(words, subject=first.subject, found=first.found, file=first.file, line=first.line)
        whole.others = tuple(others)
        return whole


class Misfit(Portable, Exception):
    """Something that does not fit at a place of a file, before it is known which line that is.

    Args:
        message: what is expected, and what was found.
        place: where.
        found: what was found, as data.
    """

    def __init__(self, message: str, place: Place = (), found: Any = None):
        super().__init__(message)
        self.problem, self.place, self.found = message, place, found

    @classmethod
    def at(cls, place: Place, message: str, found: Any = None) -> Misfit:
        """The misfit of a place."""
        return cls(message, place, found)


def key_of(place: Place) -> str:
    """A place as it is written: robots[0].motion.duration."""
    text = ""
    for step in place:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text
