"""Strict XML for untrusted robot descriptions: no document type, no entities, no limits exceeded.

An `Element` knows its file, line and place ("link 'arm', inertial, mass"), so that whoever reads a value from
it can say exactly where a bad one stands. Values are read here and nowhere else: a number is a plain finite
decimal number; a name may be any text, and is `quoted` wherever it is shown.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

from ...checks import unprintable
from ...errors import RobotError
from .encodings import as_utf8
from .packages import Unusable, read_regular
from .report import Notes

MAX_BYTES = 10_000_000
MAX_DEPTH = 50
MAX_ELEMENTS = 100_000
MAX_NUMBER = 1e16
"""Beyond it nothing about a robot is meant; squares and products of such numbers are still finite."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_INFINITE = re.compile(r"[+-]?inf(inity)?", re.IGNORECASE)
_LONGEST_NAME = 900
_MISSPELT = 0.75
MECHANISM = (
    *("inertial", "mass", "inertia", "origin", "parent", "child", "axis", "mimic", "value", "link", "joint"),
    *("xyz", "rpy", "quat_xyzw", "multiplier", "offset"),
)
"""Elements and attributes without which a file would mean another mechanism, or one that stands elsewhere."""


def quoted(text: str) -> str:
    """`text` from a file as it can be shown: one line, printable, at most 60 characters."""
    return ascii(text if len(text) <= 60 else text[:57] + "...")


def one_line(name: str) -> str:
    """A name from a file in one line: each control character as Python escapes it."""
    return "".join(c if unprintable(c) is None else ascii(c)[1:-1] for c in name)


@dataclass(slots=True, eq=False)
class Element:
    """An XML element and where it stands."""

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    place: str
    notes: Notes
    children: list[Element] = field(default_factory=list)
    content: str = ""

    # -- saying what is wrong -----------------------------------------------------------------------------

    def error(self, problem: str, found: object = None) -> RobotError:
        """An error about this element."""
        return RobotError(problem, subject=self.place, found=found, file=self.file, line=self.line)

    def refuse(self, expected: str, found: str, more: str = "") -> NoReturn:
        """Raise the error: this was expected, that was found; `more` says what about it."""
        raise self.error(f"expected {expected}, found {found}{more}", found)

    def note(self, kind: str, text: str) -> None:
        """Remark something about this element, see `Notes`."""
        self.notes.add(kind, self.place, text, self.line)

    # -- children -----------------------------------------------------------------------------------------

    def all(self, tag: str) -> list[Element]:
        """The children with this tag."""
        return [child for child in self.children if child.tag == tag]

    def optional(self, tag: str) -> Element | None:
        """The child with this tag, or None; two of them are an error."""
        found = self.all(tag)
        if len(found) > 1:
            found[1].refuse(f"one <{tag}>", f"another in line {found[0].line}")
        return found[0] if found else None

    def first(self, tag: str) -> Element | None:
        """The child with this tag, or None; of several that do not matter the first."""
        found = self.all(tag)
        for other in found[1:]:
            other.note("left out", f"another <{tag}>; that in line {found[0].line} is taken")
        return found[0] if found else None

    def walk(self) -> Iterator[Element]:
        """This element and all in it."""
        yield self
        for child in self.children:
            yield from child.walk()

    def required(self, tag: str) -> Element:
        """The one child with this tag."""
        child = self.optional(tag)
        if child is None:
            self.refuse(f"a <{tag}> in it", "none")
        return child

    def know(self, children: Iterable[str] = (), attributes: Iterable[str] = ()) -> None:
        """Remark children and attributes that nobody here reads.

        Raises:
            RobotError: one that looks like a misspelt part of the mechanism, in the place of the right one.
        """
        children, attributes = tuple(children), tuple(attributes)
        for child in self.children:
            if child.tag not in children:
                there = {other.tag for other in self.children}
                child._unknown(f"<{shown_tag(child.tag)}>", child.tag, set(children) - there)
        for attribute in self.attributes:
            if attribute not in attributes and not attribute.startswith("xmlns"):
                missing = set(attributes) - set(self.attributes)
                self._unknown(f"attribute {quoted(attribute)}", attribute, missing)

    def _unknown(self, what: str, name: str, missing: set[str]) -> None:
        for word in sorted(missing.intersection(MECHANISM)):
            if _resembles(name[:60], word):
                raise self.error(f"{what} is not known here (did you mean {word!r}?)")
        self.note("left out", f"{what} is not read")

    # -- values -------------------------------------------------------------------------------------------

    def text(self, attribute: str) -> str:
        """An attribute that has to be there."""
        if attribute not in self.attributes:
            self.refuse(f"an attribute '{attribute}'", "none")
        return self.attributes[attribute]

    def name(self, attribute: str = "name") -> str:
        """An attribute that is the name of something: any text, made one line, which is shown `quoted`."""
        text = self.text(attribute)
        if not text.strip() or len(text) > _LONGEST_NAME:
            found = f"{quoted(text)} of {len(text)}"
            self.refuse(f"a {attribute} of 1 to {_LONGEST_NAME} characters, not all blank", found)
        return one_line(text)

    def number(self, attribute: str, default: float | None = None) -> float:
        """An attribute that is one finite number."""
        return self.numbers(attribute, 1, None if default is None else (default,))[0]

    def numbers(
        self, attribute: str, count: int, default: tuple[float, ...] | None = None
    ) -> tuple[float, ...]:
        """An attribute that is `count` finite numbers, separated by blanks."""
        if default is not None and attribute not in self.attributes:
            return default
        text = self.text(attribute)
        expected = f"{attribute} of {count} finite number{'s' * (count > 1)}"
        words = text.split()
        if len(words) != count:
            self.refuse(expected, f"{len(words)} in {quoted(text)}")
        return tuple(self._finite(word, expected) for word in words)

    def positive(self, attribute: str) -> float:
        """An attribute that is one number above zero."""
        value = self.number(attribute)
        if value <= 0:
            self.refuse(f"{attribute} above 0", f"{value:g}")
        return value

    def bound(self, attribute: str) -> float | None:
        """An attribute that bounds something: infinite if it is beyond measure, NaN if no number, or None."""
        if attribute not in self.attributes:
            return None
        word = self.attributes[attribute].strip()
        if not _INFINITE.fullmatch(word) and not _NUMBER.fullmatch(word):
            return math.nan
        value = float(word)
        return value if abs(value) <= MAX_NUMBER else math.copysign(math.inf, value)

    def _finite(self, word: str, expected: str) -> float:
        if not _NUMBER.fullmatch(word) or not math.isfinite(float(word)):
            self.refuse(expected, quoted(word))
        if abs(float(word)) > MAX_NUMBER:
            self.refuse(f"{expected}, at most {MAX_NUMBER:g}", quoted(word))
        return float(word)


def shown_tag(tag: str) -> str:
    """An XML tag as it can be shown."""
    return quoted(tag)[1:-1]


def _resembles(name: str, word: str) -> bool:
    """Whether a name can be a misspelt word: nearly the same, or the same letters in another order."""
    return bool(get_close_matches(name, (word,), cutoff=_MISSPELT)) or sorted(name) == sorted(word)


def read_bytes(file: Path) -> bytes:
    """The content of a regular file that is not too large."""
    try:
        return read_regular(file, MAX_BYTES)
    except Unusable as error:
        raise RobotError(str(error), file=file, found=str(error)) from error


def parse_xml(file: str, data: bytes, notes: Notes | None = None) -> Element:
    """The root element of an XML document.

    Args:
        file: what messages call it.
        data: the document, in an encoding of `ENCODINGS`, or UTF-16 with a mark.
        notes: where its elements take their notes.

    Raises:
        RobotError: another encoding, not well-formed, a document type, or nested or filled without end.
    """
    return _Reader(file, notes or Notes(file)).read(as_utf8(file, data))


class _Reader:
    """Builds elements from Expat's events, and stops at the first that has no business in a URDF."""

    def __init__(self, file: str, notes: Notes):
        self.file, self.notes = file, notes
        self.count = 0
        self.open: list[Element] = []
        self.root: Element | None = None
        self.parser = expat.ParserCreate("utf-8")
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = lambda tag: self.open.pop()
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = self._doctype

    def read(self, data: bytes) -> Element:
        try:
            self.parser.Parse(data, True)
        except expat.ExpatError as error:
            reason = f"at column {error.offset + 1}: {expat.errors.messages[error.code]}"
            self._refuse("well-formed XML", reason, line=error.lineno)
        assert self.root is not None  # Expat refuses a document without one
        return self.root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if self.count > MAX_ELEMENTS:
            self._refuse(f"at most {MAX_ELEMENTS} elements", "more")
        if len(self.open) >= MAX_DEPTH:
            self._refuse(f"elements nested at most {MAX_DEPTH} deep", "a deeper one")
        parent = self.open[-1] if self.open else None
        place = _place(parent, tag, attributes)
        line = self.parser.CurrentLineNumber
        element = Element(tag, attributes, self.file, line, place, self.notes)
        if parent is None:
            self.root = element
        else:
            parent.children.append(element)
        self.open.append(element)

    def _text(self, text: str) -> None:
        element = self.open[-1]
        element.content += text if len(element.content) < _LONGEST_NAME else ""

    def _doctype(self, *_: Any) -> None:
        self._refuse("a document without <!DOCTYPE> and entities", "<!DOCTYPE>")

    def _refuse(self, expected: str, found: str, line: int = 0) -> NoReturn:
        line = line or self.parser.CurrentLineNumber
        words = f"expected {expected}, found {found}"
        raise RobotError(words, file=self.file, line=line, found=found)


def _place(parent: Element | None, tag: str, attributes: dict[str, str]) -> str:
    """Where an element stands: "robot", "link 'arm'", "link 'arm', inertial, mass"."""
    named = parent is not None and parent.tag == "robot" and "name" in attributes
    here = f"{shown_tag(tag)} {quoted(attributes['name'])}" if named else shown_tag(tag)
    return here if parent is None or parent.tag == "robot" else f"{parent.place}, {here}"
