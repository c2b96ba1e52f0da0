"""The page about the paper: what any page has, and claims with their verdicts."""

from __future__ import annotations

from dataclasses import dataclass

from ..renamed import names_elsewhere
from ..show.page import (
    Block,
    Formulas,
    Links,
    Picture,
    Points,
    Section,
    SideBySide,
    Table,
    Text,
    as_picture,
    formula_svg,
    number,
    words,
    write_page,
)
from ..show.style import display
from .claims import Claim, Finding

__all__ = [
    "Block",
    "Formulas",
    "Links",
    "Picture",
    "Points",
    "Section",
    "SideBySide",
    "Table",
    "Text",
    "Verdicts",
    "as_picture",
    "formula_svg",
    "number",
    "words",
    "write_page",
]


@dataclass(frozen=True)
class Verdicts:
    """Claims with their verdicts and the figures behind them."""

    claims: tuple[Claim, ...]

    def html(self) -> str:
        """A list; a claim that does not hold says so."""
        return f'<ul class="claims">{"".join(_claim(claim) for claim in self.claims)}</ul>'


def _claim(claim: Claim) -> str:
    verdict = "holds" if claim.holds else "does not hold"
    figures = "".join(f"<li>{words(q.name)} <b>{words(_shown(q))}</b></li>" for q in claim.figures)
    why = claim.explanation
    if claim.by_construction:
        why = f"{why} Could hardly have failed: {claim.by_construction}"
    return (
        f'<li class="{"holds" if claim.holds else "fails"}"><strong>{verdict}</strong> '
        f'<span class="what">{words(claim.text)}</span> <span class="source">{words(claim.source)}</span>'
        f'<ul class="figures">{figures}</ul><div class="why">{words(why)}</div></li>'
    )


def _shown(quantity: Finding) -> str:
    """A figure in the unit that people read."""
    unit, factor = display(quantity.unit)
    return f"{number(factor * quantity.value)} {unit}".strip()


__getattr__ = names_elsewhere(__name__, ".report", Row="SideBySide")
