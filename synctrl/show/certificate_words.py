"""A certificate in words, for a page: what is promised, what stands against it, and the numbers behind."""

from __future__ import annotations

from ..analysis.certify import VERDICTS, Certificate
from .page import Block, Facts, Points, Text, number

#: what a kind of verdict is called in the class of its banner
KINDS = dict(zip(VERDICTS, ("good", "so-so", "bad"), strict=True))


def certificate_blocks(certificate: Certificate) -> list[Block]:
    """The verdict and what it says, the reasons one by one, and a table of numbers."""
    reasons = [
        *(f"Outside the theorem: {text}." for text in certificate.outside),
        *(f"Doubt: {text}." for text in certificate.doubts),
    ]
    known = [
        f"{name}: {text}."
        for name, text in (
            ("The law", certificate.statement),
            ("The closed chain", certificate.theorem),
            ("The network", certificate.delay_condition),
            ("The estimates", certificate.consistency),
        )
        if text is not None
    ]
    blocks: list[Block] = [
        Text(f"{in_a_word(certificate)} {_meaning(certificate)}", KINDS[certificate.verdict])
    ]
    if reasons:
        blocks.append(Points(tuple(reasons)))
    if certificate.dissipation is not None:
        known.append(" ".join(line.strip() for line in certificate.dissipation.lines) + ".")
    return [*blocks, _numbers(certificate), Points(tuple(known))]


def in_a_word(certificate: Certificate) -> str:
    """The verdict as a sentence."""
    verdict = certificate.verdict
    return f"{verdict[0].upper()}{verdict[1:]}."


def _meaning(certificate: Certificate) -> str:
    meaning = certificate.meaning
    return f"{meaning[0].upper()}{meaning[1:]}."


def _numbers(certificate: Certificate) -> Facts:
    record, condition = certificate.lyapunov, certificate.gain_condition
    closes = {True: "yes", False: "no", None: "cannot be told from this log"}[certificate.closes]
    needed = "" if condition.needed else ", and is not needed here"
    rows = [
        ("V at the start and at the end", f"{number(record.V[0])} N·m, {number(record.V[-1])} N·m"),
        ("largest V'", f"{number(float(record.V_dot.max()))} W"),
        ("the balance of V closes", closes),
        ("the gain condition", f"{'holds' if condition.holds else 'fails'}{needed}"),
    ]
    if certificate.growth is not None:
        growth = certificate.growth
        rows.append(("V first grows", f"at t = {number(growth.time)} s, by the term '{growth.term}'"))
    return Facts(tuple(rows))
