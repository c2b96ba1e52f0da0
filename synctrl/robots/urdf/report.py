"""What a description did not say, said wrongly, or said in vain: collected while it is read, told once.

Whatever makes the mechanism wrong is an error, see `RobotError`. All else is a `Note` in the `Report` of the
robot, of one of four kinds:

- "left out": pictures, limits and extensions of other programs that cannot be used, and are not needed;
- "assumed": what was taken in the place of something missing or senseless;
- "locked": a joint that is held, and why;
- "suspicious": what is possible, and yet most often a mistake.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import overload

from ...errors import RobotError

KINDS = ("left out", "assumed", "locked", "suspicious")


@dataclass(frozen=True)
class Note:
    """One remark: its kind, what it is about ("joint 'elbow', limit"), its words, and the line, 0 if none."""

    kind: str
    where: str
    text: str
    line: int = 0

    def __str__(self) -> str:
        line = f"line {self.line}: " if self.line else ""
        return f"{line}{self.where}: {self.text}" if self.where else f"{line}{self.text}"


@dataclass(frozen=True)
class Report(Sequence[Note]):
    """All notes about one robot, in the order of its description.

    `source` is what messages call it. `known` is what is no oddity, and good to know: it is shown with the
    rest, but neither counts nor warns.
    """

    notes: tuple[Note, ...] = ()
    source: str = ""
    known: tuple[Note, ...] = ()

    def of_kind(self, kind: str) -> tuple[Note, ...]:
        """The notes of one kind."""
        return tuple(note for note in self.notes if note.kind == kind)

    def summary(self) -> str:
        """A few lines: how many notes of each kind, the first of each, and where to see all."""
        if not self.notes:
            return f"{self.source}: nothing to say"
        found = [(kind, notes) for kind in KINDS if (notes := self.of_kind(kind))]
        lines = [f"  {kind} ({len(notes)}): {notes[0]}{_more(notes)}" for kind, notes in found]
        return "\n".join([f"{self.source}:", *lines, "  all of it: print(robot.report)"])

    def __str__(self) -> str:
        lines = [f"  {note.kind}: {note}" for note in (*self.notes, *self.known)]
        return "\n".join([f"{self.source}:", *lines]) if lines else self.summary()

    def __len__(self) -> int:
        return len(self.notes)

    def __iter__(self) -> Iterator[Note]:
        return iter(self.notes)

    @overload
    def __getitem__(self, index: int) -> Note: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Note]: ...
    def __getitem__(self, index: int | slice) -> Note | Sequence[Note]:
        return self.notes[index]


NOTHING = Report()
"""The report of a robot about which there is nothing to say."""


def _more(notes: tuple[Note, ...]) -> str:
    return f"; and {len(notes) - 1} more" if len(notes) > 1 else ""


@dataclass
class Notes:
    """Collects notes while a description is read; a strict one raises the first instead.

    Args:
        file: the description, or None if there is none.
        strict: whether every note is an error.
    """

    file: str | Path | None = None
    strict: bool = False
    collected: list[Note] = field(default_factory=list)

    def add(self, kind: str, where: str, text: str, line: int = 0) -> None:
        """Take a note.

        Raises:
            RobotError: the collector is strict.
        """
        if self.strict:
            raise RobotError(text, subject=where or None, file=self.file, line=line)
        note = Note(kind, where, text, line)
        if note not in self.collected:
            self.collected.append(note)

    def absorb(self, error: RobotError) -> None:
        """Leave out, with a note of why, what could not be read and is not needed.

        Raises:
            RobotError: the error itself, if the collector is strict.
        """
        if self.strict:
            raise error
        self.add("left out", error.subject or "", error.problem, error.line or 0)

    def report(self, source: str) -> Report:
        """What was collected."""
        return Report(tuple(self.collected), source)
