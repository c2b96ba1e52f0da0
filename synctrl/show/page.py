"""A page: sections of text, formulas, figures, tables and verdicts in one HTML file that opens offline.

Everything that comes from data is escaped; the only markup is written here. In text, a letter with an
underscore, as in `e_1`, is shown with its index below the line. Formulas become pictures by matplotlib's own
reader of TeX: without LaTeX, the same in every browser.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from ..errors import InputError
from ..files import reported, write_whole
from .panels import ten_to
from .plots import save_svg, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLESHEET = Path(__file__).with_name("page.css")


class Block(Protocol):
    """A part of a section."""

    def html(self) -> str:
        """Its markup."""


@dataclass(frozen=True)
class Text:
    """A paragraph of plain text; `kind` is "plain", "note" or "formula"."""

    paragraph: str
    kind: str = "plain"

    def html(self) -> str:
        """A paragraph; a formula keeps its spaces."""
        if self.kind == "formula":
            return f'<pre class="formula">{escape(self.paragraph)}</pre>'
        return f'<p class="{escape(self.kind)}">{words(self.paragraph)}</p>'


@dataclass(frozen=True)
class Points:
    """Sentences as a list."""

    sentences: tuple[str, ...]

    def html(self) -> str:
        """A list of small print."""
        return f'<ul class="points">{"".join(f"<li>{words(each)}</li>" for each in self.sentences)}</ul>'


@dataclass(frozen=True)
class Formulas:
    """Formulas one below the other; each in TeX as matplotlib reads it, what it is, and its number."""

    rows: tuple[tuple[str, str, str], ...]

    def html(self) -> str:
        """A table of pictures, the TeX as their text.

        Raises:
            InputError: a formula that matplotlib cannot read.
        """
        return f'<table class="formulas">{"".join(_formula_row(*row) for row in self.rows)}</table>'


@dataclass(frozen=True)
class Picture:
    """An SVG figure, inlined, with a caption."""

    svg: Path
    caption: str

    def html(self) -> str:
        """A figure whose picture is part of the page."""
        with reported("read the figure", self.svg):
            picture = _inlined(self.svg.read_bytes(), self.caption)
        return f"<figure>{picture}<figcaption>{words(self.caption)}</figcaption></figure>"


def as_picture(figure: Figure, stem: Path, caption: str) -> Picture:
    """A figure, which is written to `<stem>.svg`, as a picture of the page."""
    return Picture(save_svg(figure, stem), caption)


@dataclass(frozen=True)
class SideBySide:
    """Blocks side by side."""

    blocks: tuple[Block, ...]

    def html(self) -> str:
        """A grid with a column per block."""
        return f'<div class="row">{"".join(block.html() for block in self.blocks)}</div>'


@dataclass(frozen=True)
class Columns:
    """Blocks in columns, as many as fit, that are filled one after another."""

    blocks: tuple[Block, ...]

    def html(self) -> str:
        """Columns, as on a page of a newspaper."""
        return f'<div class="columns">{"".join(block.html() for block in self.blocks)}</div>'


@dataclass(frozen=True)
class Table:
    """A table of words and numbers, already written as text.

    `groups` stand above the head: each a title and the number of columns below it, the first column left out.
    `marked` are the cells that are to be seen first, each by its row and column, counted from 0.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""
    groups: tuple[tuple[str, int], ...] = ()
    marked: frozenset[tuple[int, int]] = frozenset()

    def html(self) -> str:
        """A table; its first column is a heading of the row.

        Raises:
            InputError: a row of another length than the head, or groups that do not cover the columns.
        """
        for row in self.rows:
            if len(row) != len(self.head):
                raise InputError.expected(
                    f"rows of {len(self.head)} cells", len(row), "table", shown=f"{list(row)}"
                )
        head = "".join(f"<th scope='col'>{words(cell)}</th>" for cell in self.head)
        body = "".join(_table_row(row, self._marks(k)) for k, row in enumerate(self.rows))
        caption = f'<p class="caption">{words(self.caption)}</p>' if self.caption else ""
        table = f"<table><thead>{self._group_row()}<tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        return f'{caption}<div class="wide">{table}</div>'

    def _marks(self, row: int) -> set[int]:
        return {column for k, column in self.marked if k == row}

    def _group_row(self) -> str:
        if not self.groups:
            return ""
        covered = sum(width for _, width in self.groups)
        if covered != len(self.head) - 1:
            raise InputError.expected(f"groups over {len(self.head) - 1} columns", covered, "table")
        titles = (f"<th colspan='{width}'>{words(title)}</th>" for title, width in self.groups)
        return f'<tr class="groups"><th></th>{"".join(titles)}</tr>'


@dataclass(frozen=True)
class Facts:
    """What is known of one thing; each what it is, and its value as text."""

    rows: tuple[tuple[str, str], ...]

    def html(self) -> str:
        """A table of two columns of words."""
        rows = "".join(f'<tr><th scope="row">{words(a)}</th><td>{words(b)}</td></tr>' for a, b in self.rows)
        return f'<table class="facts">{rows}</table>'


@dataclass(frozen=True)
class Links:
    """Links to files that lie beside the page; each a file and what it is."""

    links: tuple[tuple[str, str], ...]

    def html(self) -> str:
        """A list of links."""
        items = (
            f'<li><a href="{escape(file, quote=True)}">{words(what)}</a></li>' for file, what in self.links
        )
        return f'<ul class="links">{"".join(items)}</ul>'


@dataclass(frozen=True)
class Section:
    """A title and blocks under it."""

    title: str
    blocks: tuple[Block, ...]


def write_page(path: str | Path, title: str, sections: Sequence[Section], policy: str = "") -> Path:
    """Write a page with a table of contents.

    Args:
        path: the file.
        title: of the page.
        sections: in their order.
        policy: content security policy; by default none.

    Raises:
        ResultError: the file cannot be written, or a figure cannot be read.
    """
    style = STYLESHEET.read_text(encoding="utf-8")
    contents = "".join(f'<li><a href="#s{k}">{words(s.title)}</a></li>' for k, s in enumerate(sections))
    page = (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'{_guard(policy)}<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{style}</style></head><body><header><h1>{escape(title)}</h1><nav><ol>{contents}</ol></nav></header>"
        f"<main>{''.join(_section(k, s) for k, s in enumerate(sections))}</main></body></html>\n"
    )
    with reported("write the page", path):
        write_whole(path, page.encode("utf-8", "replace"))
    return Path(path)


def _guard(policy: str) -> str:
    return f'<meta http-equiv="Content-Security-Policy" content="{escape(policy)}">' if policy else ""


def number(value: float, digits: int = 3) -> str:
    """A number for a table: a few significant digits, powers of ten written as 10ⁿ."""
    text = f"{value:.{digits}g}"
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    return f"{mantissa}·{ten_to(int(exponent))}"


def words(text: str) -> str:
    """Text as markup: escaped, and with indices below the line."""
    return _INDEXED.sub(r"\1<sub>\2</sub>", escape(text))


#: one letter, perhaps starred or hatted, and an index of up to three characters
_INDEXED = re.compile(r"(?<![\w&#])([^\W\d_][*\u0302\u0303]?)_(\w{1,3})(?!\w)")


def _section(k: int, section: Section) -> str:
    blocks = "".join(block.html() for block in section.blocks)
    return f'<section id="s{k}"><h2>{words(section.title)}</h2>{blocks}</section>'


def _inlined(svg: bytes, instead: str) -> str:
    """A picture that is part of the page, with the words that stand for it where it cannot be seen."""
    data = base64.b64encode(svg).decode("ascii")
    return f'<img alt="{escape(instead)}" src="data:image/svg+xml;base64,{data}">'


def _formula_row(tex: str, what: str, number: str) -> str:
    return (
        f"<tr><td>{_inlined(formula_svg(tex), tex)}</td><td>{words(what)}</td><td>{words(number)}</td></tr>"
    )


def _table_row(row: Iterable[str], marks: Container[int]) -> str:
    first, *rest = row
    cells = "".join(
        f'<td class="marked">{words(cell)}</td>' if k in marks else f"<td>{words(cell)}</td>"
        for k, cell in enumerate(rest, start=1)
    )
    return f"<tr><th scope='row'>{words(first)}</th>{cells}</tr>"


SIZE = 14.0  # points


def formula_svg(tex: str) -> bytes:
    """A formula as an SVG picture; the same formula gives the same bytes.

    Args:
        tex: without dollar signs, in the part of TeX that matplotlib knows.

    Raises:
        InputError: matplotlib cannot read it.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure
    from matplotlib.font_manager import FontProperties
    from matplotlib.mathtext import MathTextParser

    font = FontProperties(size=SIZE, math_fontfamily="stix")
    with style():
        try:
            width, height, depth, _, _ = MathTextParser("path").parse(f"${tex}$", dpi=72, prop=font)
        except ValueError as error:
            raise InputError(
                f"expected TeX that matplotlib can read; {error}", subject=f"formula '{tex}'"
            ) from error
        figure = Figure(figsize=(width / 72, height / 72), facecolor="none")
        FigureCanvasSVG(figure)
        figure.text(0, depth / height, f"${tex}$", fontproperties=font)
        file = BytesIO()
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    return file.getvalue()
