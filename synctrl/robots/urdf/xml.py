"""Strict XML for untrusted robot descriptions: no document type, no entities, no limits exceeded.

An `Element` knows its file, line and place ("link 'arm', inertial, mass"), so that whoever reads a value from
it can say exactly where a bad one stands. Values are read here and nowhere else: a number is a plain finite
decimal number, a name is made of characters that mean nothing to a browser, a shell or a file system.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

from ...errors import RobotError, RobotWarning, warn

MAX_BYTES = 10_000_000
MAX_DEPTH = 50
MAX_ELEMENTS = 100_000
MAX_NUMBER = 1e16
"""Beyond it nothing about a robot is meant; squares and products of such numbers are still finite."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.\-]{0,127}", re.ASCII)
_RESERVED = ("universe",)
_MISSPELT = 0.65


def quoted(text: str) -> str:
    """`text` from a file as it can be shown: one line, printable, at most 60 characters."""
    return ascii(text if len(text) <= 60 else text[:57] + "...")


def is_name(text: str) -> bool:
    """Whether `text` can be the name of a robot, link or joint."""
    return bool(_NAME.fullmatch(text)) and text not in _RESERVED


NAME_RULE = (
    "1 to 128 letters, digits, '_', '-' or '.', beginning with a letter, a digit or '_', "
    f"and not {' or '.join(map(repr, _RESERVED))}"
)


@dataclass(slots=True, eq=False)
class Element:
    """An XML element and where it stands."""

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    place: str
    children: list[Element] = field(default_factory=list)

    # -- saying what is wrong -----------------------------------------------------------------------------

    def error(self, problem: str) -> RobotError:
        """An error about this element."""
        return RobotError(problem, subject=self.place, file=self.file, line=self.line)

    def refuse(self, expected: str, found: str) -> NoReturn:
        """Raise the error: this was expected, that was found."""
        raise self.error(f"expected {expected}, found {found}")

    def warn(self, message: str) -> None:
        """Warn about this element."""
        warn(str(self.error(message)), RobotWarning)

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

    def required(self, tag: str) -> Element:
        """The one child with this tag."""
        child = self.optional(tag)
        if child is None:
            self.refuse(f"a <{tag}> in it", "none")
        return child

    def know(self, children: Iterable[str] = (), attributes: Iterable[str] = ()) -> None:
        """Refuse children and attributes that are misspelt; warn of others that nobody here reads."""
        children, attributes = tuple(children), tuple(attributes)
        for child in self.children:
            if child.tag not in children:
                _unknown(child, f"<{shown_tag(child.tag)}>", child.tag, children)
        for attribute in self.attributes:
            if attribute not in attributes and not attribute.startswith("xmlns"):
                _unknown(self, f"attribute {quoted(attribute)}", attribute, attributes)

    # -- values -------------------------------------------------------------------------------------------

    def text(self, attribute: str) -> str:
        """An attribute that has to be there."""
        if attribute not in self.attributes:
            self.refuse(f"an attribute '{attribute}'", "none")
        return self.attributes[attribute]

    def name(self, attribute: str = "name") -> str:
        """An attribute that is the name of something."""
        text = self.text(attribute)
        if not is_name(text):
            self.refuse(f"a {attribute} of {NAME_RULE}", quoted(text))
        return text

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

    def _finite(self, word: str, expected: str) -> float:
        if not _NUMBER.fullmatch(word) or not math.isfinite(float(word)):
            self.refuse(expected, quoted(word))
        if abs(float(word)) > MAX_NUMBER:
            self.refuse(f"{expected}, at most {MAX_NUMBER:g}", quoted(word))
        return float(word)


def shown_tag(tag: str) -> str:
    """An XML tag as it can be shown."""
    return quoted(tag)[1:-1]


def _unknown(element: Element, what: str, name: str, known: tuple[str, ...]) -> None:
    meant = get_close_matches(name[:60], known, n=1, cutoff=_MISSPELT)
    if meant:
        raise element.error(f"{what} is not known here (did you mean {meant[0]!r}?)")
    element.warn(f"{what} is not read")


def read_bytes(file: Path) -> bytes:
    """The content of a file that is there and not too large."""
    try:
        with file.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise RobotError(f"cannot be read: {error.strerror}", file=file) from error
    if len(data) > MAX_BYTES:
        raise RobotError(f"expected at most {MAX_BYTES / 1e6:g} MB, found more", file=file)
    return data


def parse_xml(file: str, data: bytes) -> Element:
    """The root element of an XML document.

    Args:
        file: what messages call it.
        data: the document, in UTF-8.

    Raises:
        RobotError: not UTF-8, not well-formed, a document type declaration, or nested or filled without end.
    """
    return _Reader(file).read(_utf8(file, data))


def _utf8(file: str, data: bytes) -> bytes:
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        found = f"byte {data[error.start]:#04x}"
        raise RobotError(f"expected text in UTF-8, found {found}", file=file, line=line) from error
    return data


class _Reader:
    """Builds elements from Expat's events, and stops at the first that has no business in a URDF."""

    def __init__(self, file: str):
        self.file = file
        self.count = 0
        self.open: list[Element] = []
        self.root: Element | None = None
        self.parser = expat.ParserCreate("utf-8")
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = lambda tag: self.open.pop()
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.XmlDeclHandler = self._declaration

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
        element = Element(tag, attributes, self.file, self.parser.CurrentLineNumber, place)
        if parent is None:
            self.root = element
        else:
            parent.children.append(element)
        self.open.append(element)

    def _doctype(self, *_: Any) -> None:
        self._refuse("a document without <!DOCTYPE> and entities", "<!DOCTYPE>")

    def _declaration(self, _version: str, encoding: str | None, _standalone: int) -> None:
        if encoding is not None and encoding.lower() not in ("utf-8", "utf8", "us-ascii", "ascii"):
            self._refuse("text in UTF-8", f"a declaration of {quoted(encoding)}")

    def _refuse(self, expected: str, found: str, line: int = 0) -> NoReturn:
        line = line or self.parser.CurrentLineNumber
        raise RobotError(f"expected {expected}, found {found}", file=self.file, line=line)


def _place(parent: Element | None, tag: str, attributes: dict[str, str]) -> str:
    """Where an element stands: "robot", "link 'arm'", "link 'arm', inertial, mass"."""
    named = parent is not None and parent.tag == "robot" and "name" in attributes
    here = f"{shown_tag(tag)} {quoted(attributes['name'])}" if named else shown_tag(tag)
    return here if parent is None or parent.tag == "robot" else f"{parent.place}, {here}"
