"""`synctrl compare`: laws side by side on one cell, fairly."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from ..analysis.comparison import RULES, Comparison
from ..analysis.comparison import compare as compare_laws
from ..analysis.trial_rows import Row, Sizes
from ..control.laws import SunMills
from ..errors import InputError
from ..files import reported, write_whole
from ..simulation.simulate import Experiment
from .answer import Answer, answering
from .console import DIM, GOOD, lines, number, table
from .made import planned
from .names import law_names
from .options import CellFile, Duration, Engine, Json, Step
from .plain import plain
from .progress import waiting

Laws = Annotated[
    str,
    typer.Option(
        metavar="NAME,...",
        help="What the cell's own law is compared with: independent (slotine-li), chung-slotine, "
        "master-slave, computed-torque, pd-gravity, sun-mills.",
        autocompletion=law_names,
    ),
]
Equal = Annotated[
    list[str],
    typer.Option(
        metavar="WHAT", help="What is made equal, a row each: pole, peak-torque, tracking. By default all."
    ),
]
Pages = Annotated[
    Path | None, typer.Option("--out", "-o", metavar="FOLDER", help="Write a figure and all numbers there.")
]
#: of the command line, and of the comparison
WORDS = {rule.removeprefix("equal ").replace(" ", "-"): rule for rule in RULES}


def compare(
    cell: CellFile,
    laws: Laws = "chung-slotine,independent",
    equal: Equal = [],  # noqa: B006
    out: Pages = None,
    duration: Duration = None,
    dt: Step = None,
    engine: Engine = None,
    as_json: Json = False,
) -> None:
    """Compare the law of a cell with others, each with as much gain, torque or tracking error as it.

    A law that is given more gain tracks better, whatever it is: so one free gain of each is solved for, until
    what --equal names is the same as with the cell's own law. Each row is one of these; if something disturbs
    the cell there is a second run with that.
    """
    with answering(as_json) as answer:
        from .laws import named_laws

        asked = {"duration": duration, "dt": dt, "engine": engine}
        experiment, how, _ = planned(answer, cell, **asked)
        rules = [_rule(word) for word in equal] or [*RULES]
        others = named_laws(_others(laws, experiment), experiment.gains)
        with waiting(f"comparing {len(others)} laws with that of the cell, {len(rules)} rows each"):
            found = compare_laws(experiment, others, rules, **how)
        found = replace(found, rows=tuple(_renamed(row) for row in found.rows))
        _tell(answer, found)
        if out is not None:
            _write(answer, found, out)


def _rule(word: str) -> str:
    if word not in WORDS:
        raise InputError.expected(f"one of {', '.join(WORDS)}", word, "--equal")
    return WORDS[word]


def _others(text: str, experiment: Experiment) -> list[str]:
    """Names of laws but for the cell's own, which is compared with them anyway."""
    own = "sun-mills" if isinstance(experiment.law or SunMills(), SunMills) else ""
    names = [name for name in (word.strip() for word in text.split(",")) if name and name != own]
    if not names:
        raise InputError.expected("at least one law beside the cell's own", text, "--laws")
    return [*dict.fromkeys(names)]


def _renamed(row: Row) -> Row:
    """A row with the name that its law has on the command line."""
    return replace(row, law="sun-mills") if row.law == "SunMills" else row


def _tell(answer: Answer, found: Comparison) -> None:
    answer.data |= found.as_dict()
    told = "RMS is over all robots and coordinates, where `synctrl run` has a row for each robot"
    answer.show(f"{found.title}, {found.duration:g} s of every run; {told}", "")
    for situation in found.situations:
        answer.show(_table(found, situation), "")
    remarks = [f"{row.law}, {row.rule}: {row.remark}" for row in found.rows if row.remark]
    answer.show(lines("What the numbers say", found.verdict))
    if remarks:
        answer.show("", lines("Missing", remarks))


def _table(found: Comparison, situation: str) -> Any:
    """A row for each law and rule; green is what is smaller than in the first row."""
    from ..show.style import display

    (e, by_e), (s, by_s) = (display(unit) for unit in found.units[:2])
    columns = {
        f"peak e, {e}": ("tracking_peak", by_e),
        "RMS e": ("tracking_rms", by_e),
        f"peak ε, {s}": ("sync_peak", by_s),
        "RMS ε": ("sync_rms", by_s),
        f"peak torque, {found.units[2]}": ("peak_torque", 1.0),
    }
    first = getattr(found.rows[0], situation)
    rows = [
        [row.law, row.rule, row.gain, _gain(row.value), *_cells(getattr(row, situation), first, columns)]
        for row in found.rows
    ]
    title = "Undisturbed" if situation == "quiet" else "Disturbed"
    return table(title, ("law", "made equal", "free gain", "", *columns), rows, left=3)


def _cells(sizes: Sizes | None, first: Sizes | None, columns: Mapping[str, tuple[str, float]]) -> list[Text]:
    found = []
    for name, factor in columns.values():
        value = None if sizes is None else getattr(sizes, name)
        less = value is not None and first is not None and value < getattr(first, name)
        words = number(None if value is None else factor * value)
        found.append(Text(words, style=GOOD if less else "" if sizes else DIM))
    return found


def _gain(value: Any) -> str:
    """A gain in short: one number if all are the same."""
    if value is None:
        return "–"
    flat = value if isinstance(value, list) else [value]
    while flat and isinstance(flat[0], list):
        flat = [each for part in flat for each in part]
    return number(flat[0]) if len({*flat}) == 1 else f"{number(min(flat))} to {number(max(flat))}"


def _write(answer: Answer, found: Comparison, folder: Path) -> None:
    from ..show.law_figures import comparison_figure
    from ..show.plots import save

    with reported("write into the folder", folder):
        folder.mkdir(parents=True, exist_ok=True)
    path = folder / "comparison.json"
    with reported("write the comparison to", path):
        write_whole(path, json.dumps(plain(found.as_dict()), indent=1, ensure_ascii=False) + "\n")
    answer.data["written"] = [path, *save(comparison_figure(found), folder / "comparison")]
    answer.show("", f"Written: {', '.join(map(str, answer.data['written']))}")
