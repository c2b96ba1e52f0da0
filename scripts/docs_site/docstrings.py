"""Docstrings of the package as Sphinx reads them: plain words, names in single backticks, indented code.

They follow Google's style, but are no reStructuredText: a * or | in them is a star or an absolute value, and
a name in backticks is code, and a link where the reference has that name. One item may have several names.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator

#: headings of Google's style, and what stands for them on the page
SECTIONS = {
    "Args": "Arguments",
    "Attributes": "Attributes",
    "Raises": "Raises",
    "Returns": "Returns",
    "Yields": "Yields",
    "Note": "Note",
    "Example": "Example",
}
HEADING = re.compile(rf"(?:{'|'.join(SECTIONS)}):\s*$")
#: what an item of a section begins with: names, and perhaps a word in parentheses
ITEM = re.compile(
    r"(\*{0,2}[A-Za-z_]\w*(?:\.\w+)*(?:, \*{0,2}[A-Za-z_]\w*)*)(?: \([^)]*\))?: *(.*)", re.DOTALL
)
CODE = re.compile(r"(`+)(.+?)\1", re.DOTALL)
#: what would begin markup outside of code
MARKUP = re.compile(r"([\\*|])|(?<=\w)(_)(?!\w)")
#: code that is a name, and so can be linked
NAME = re.compile(r"[A-Za-z_][\w.]*$")


def as_markup(lines: list[str]) -> list[str]:
    """Lines of a docstring, dedented, as reStructuredText of the same words."""
    found: list[str] = []
    for kind, block in parts(lines):
        if kind == "words":
            found += escaped("\n".join(block)).split("\n")
        elif kind == "code":
            found += ["", "::", "", *indented(textwrap.dedent("\n".join(block)).split("\n")), ""]
        else:
            found += ["", f":{SECTIONS[kind]}:", *indented(section(kind, block)), ""]
    return found


def parts(lines: list[str]) -> Iterator[tuple[str, list[str]]]:
    """The lines in parts, each with what it is: "words", "code", or the heading of a section above it."""
    kind, block, before = "words", [], ""
    for line in lines:
        new = kind
        if line.strip() and not line.startswith("    "):
            new = line.strip(" :") if HEADING.match(line) else "words"
        elif line.startswith("    ") and kind == "words" and not before.strip():
            new = "words" if re.match(r" +(?:[-*]|\d+\.) ", line) else "code"
        if new != kind or HEADING.match(line):
            yield kind, block
            kind, block = new, []
        if not HEADING.match(line):
            block.append(line)
        before = line
    yield kind, block


def section(kind: str, block: list[str]) -> list[str]:
    """What is below a heading: a list of names and what they are, or words."""
    lines = textwrap.dedent("\n".join(block)).strip().split("\n")
    items: list[list[str]] = []
    for line in lines:
        if not items or (line.strip() and not line.startswith(" ")):
            items.append([])
        items[-1].append(line)
    found = [ITEM.match("\n".join(item)) for item in items]
    if kind in ("Returns", "Yields", "Note", "Example") or not all(found):
        return escaped("\n".join(lines)).split("\n")
    return [line for item in found if item for line in described(item[1], item[2])]


def described(names: str, words: str) -> list[str]:
    """An item of a definition list."""
    first, _, rest = words.partition("\n")
    words = "\n".join([first, textwrap.dedent(rest)]).strip()
    return [", ".join(linked(name) for name in names.split(", ")), *indented(escaped(words).split("\n"))]


def indented(lines: list[str]) -> list[str]:
    """Lines with a margin."""
    return [f"   {line}" if line.strip() else "" for line in lines]


def escaped(text: str) -> str:
    """Words with what would be markup escaped, and code in backticks as a link or as code."""
    pieces, end = [], 0
    for code in CODE.finditer(text):
        pieces += [MARKUP.sub(r"\\\1\2", text[end : code.start()]), linked(" ".join(code[2].split()))]
        end = code.end()
    return "".join([*pieces, MARKUP.sub(r"\\\1\2", text[end:])])


def linked(code: str) -> str:
    """A name as a reference, anything else as code."""
    return f":py:obj:`{code}`" if NAME.match(code) else f"``{code}``"
