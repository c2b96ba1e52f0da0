"""`synctrl doctor`: what is installed, what is missing, and for what."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.text import Text

from . import codes
from .answer import answering
from .checks import Finding, findings
from .console import BAD, GOOD, lines, readable, table
from .options import Json

Trial = Annotated[bool, typer.Option(help="Let both engines make a short run; the first time C is compiled.")]


def doctor(trial: Trial = True, as_json: Json = False) -> None:
    """Say what is installed, compiler and cache, and what is missing for which feature.

    Ends with 4 if something is wrong that everybody needs. Missing extras are no fault.
    """
    with answering(as_json) as answer:
        found = [*findings(trial)]
        answer.data["findings"] = [{**each._asdict(), "wanting": each.wanting} for each in found]
        answer.show(table("", ("", "", ""), [_row(each) for each in found], left=3))
        wanting = [each.what for each in found if each.wanting]
        remedies = [f"{each.what}: {each.remedy}" for each in found if each.remedy and each.state != "ok"]
        if remedies:
            answer.show("", lines("What to do", remedies))
        answer.show(
            "", f"Wanting: {', '.join(wanting)}." if wanting else "All that everybody needs is there."
        )
        answer.code = codes.FOUND_WANTING if wanting else codes.DONE


def _row(each: Finding) -> tuple[str, Text, str]:
    style = GOOD if each.state == "ok" else BAD if each.needed else "yellow"
    return each.what, Text(each.state, style=style), readable(each.found)
