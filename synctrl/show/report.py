"""A page: sections of text, figures, tables and verdicts in one HTML file that opens offline.

Everything that comes from data is escaped; the only markup is written here.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Protocol

from ..analysis.claims import Claim
from ..errors import InputError, ResultError

STYLESHEET = Path(__file__).with_name("report.css")


class Block(Protocol):
    """A part of a section."""

    def html(self) -> str:
        """Its markup."""


@dataclass(frozen=True)
class Text:
    """Paragraphs of plain text; `kind` is "plain", "note" or "formula"."""

    paragraphs: tuple[str, ...]
    kind: str = "plain"

    def html(self) -> str:
        """A paragraph each; formulas keep their spaces."""
        tag = "pre" if self.kind == "formula" else "p"
        return "".join(f'<{tag} class="{escape(self.kind)}">{escape(p)}</{tag}>' for p in self.paragraphs)


@dataclass(frozen=True)
class Picture:
    """An SVG figure, inlined, with a caption."""

    svg: Path
    caption: str

    def html(self) -> str:
        """A figure whose picture is part of the page."""
        try:
            data = base64.b64encode(self.svg.read_bytes()).decode("ascii")
        except OSError as error:
            raise ResultError(f"cannot read the figure '{self.svg}': {error.strerror or error}") from error
        picture = f'<img alt="{escape(self.caption)}" src="data:image/svg+xml;base64,{data}">'
        return f"<figure>{picture}<figcaption>{escape(self.caption)}</figcaption></figure>"


@dataclass(frozen=True)
class Row:
    """Blocks side by side."""

    blocks: tuple[Block, ...]

    def html(self) -> str:
        """A grid with a column per block."""
        return f'<div class="row">{"".join(block.html() for block in self.blocks)}</div>'


@dataclass(frozen=True)
class Table:
    """A table of words and numbers, already written as text."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""

    def html(self) -> str:
        """A table; its first column is a heading of the row.

        Raises:
            InputError: a row of another length than the head.
        """
        for row in self.rows:
            if len(row) != len(self.head):
                raise InputError(f"table: expected rows of {len(self.head)} cells, found {list(row)}")
        head = "".join(f"<th scope='col'>{escape(cell)}</th>" for cell in self.head)
        body = "".join(_table_row(row) for row in self.rows)
        caption = f'<p class="caption">{escape(self.caption)}</p>' if self.caption else ""
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        return f'{caption}<div class="wide">{table}</div>'


@dataclass(frozen=True)
class Verdicts:
    """Claims with their verdicts and the figures behind them."""

    claims: tuple[Claim, ...]

    def html(self) -> str:
        """A list; a claim that does not hold says so."""
        return f'<ul class="claims">{"".join(_claim(claim) for claim in self.claims)}</ul>'


@dataclass(frozen=True)
class Links:
    """Links to files that lie beside the page; each a file and what it is."""

    links: tuple[tuple[str, str], ...]

    def html(self) -> str:
        """A list of links."""
        items = (
            f'<li><a href="{escape(file, quote=True)}">{escape(what)}</a></li>' for file, what in self.links
        )
        return f'<ul class="links">{"".join(items)}</ul>'


@dataclass(frozen=True)
class Section:
    """A title and blocks under it."""

    title: str
    blocks: tuple[Block, ...]


def write_page(path: str | Path, title: str, sections: Sequence[Section]) -> Path:
    """Write a page with a table of contents.

    Raises:
        ResultError: the file cannot be written, or a figure cannot be read.
    """
    path = Path(path)
    style = STYLESHEET.read_text(encoding="utf-8")
    contents = "".join(f'<li><a href="#s{k}">{escape(s.title)}</a></li>' for k, s in enumerate(sections))
    page = (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{style}</style></head><body><header><h1>{escape(title)}</h1><nav><ol>{contents}</ol></nav></header>"
        f"<main>{''.join(_section(k, s) for k, s in enumerate(sections))}</main></body></html>\n"
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page, encoding="utf-8")
    except OSError as error:
        raise ResultError(f"cannot write the page '{path}': {error.strerror or error}") from error
    return path


def number(value: float, digits: int = 3) -> str:
    """A number for a table: a few significant digits, powers of ten written as 10ⁿ."""
    text = f"{value:.{digits}g}"
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    return f"{mantissa}·10{str(int(exponent)).translate(_SUPERSCRIPT)}"


_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def _section(k: int, section: Section) -> str:
    blocks = "".join(block.html() for block in section.blocks)
    return f'<section id="s{k}"><h2>{escape(section.title)}</h2>{blocks}</section>'


def _table_row(row: Iterable[str]) -> str:
    first, *rest = row
    cells = "".join(f"<td>{escape(cell)}</td>" for cell in rest)
    return f"<tr><th scope='row'>{escape(first)}</th>{cells}</tr>"


def _claim(claim: Claim) -> str:
    verdict = "holds" if claim.holds else "does not hold"
    figures = "; ".join(f"{q.name}: {number(q.value)} {q.unit}".strip() for q in claim.figures)
    return (
        f'<li class="{"holds" if claim.holds else "fails"}"><strong>{verdict}</strong> '
        f'<span class="what">{escape(claim.text)}</span> <span class="source">{escape(claim.source)}</span>'
        f'<div class="figures">{escape(figures)}</div><div class="why">{escape(claim.explanation)}</div></li>'
    )
