"""Load every robot below a folder, and say in a table what became of them.

python scripts/survey_robots.py FOLDER [--xacro] [--compare] [--out TABLE.md]

Each folder in FOLDER is a collection; a file `.commit` in it says which state of it that is. A xacro file is
tried as it is, or with each set of arguments that `.xacro_args.json` has for it: {"file": [{"name": "ur5"}]}.
Each is tried in a process of its own with a time limit, so that a crash is a row too.
"""

from __future__ import annotations

import argparse
import importlib
import json
import multiprocessing
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path

from survey_one import LIBRARIES, Row, Task, survey

TIME_LIMIT = 120.0

SAID: dict[str, Callable[[str, str], bool]] = {
    "some pictures missing": lambda kind, text: kind == "left out" and "is not shown" in text,
    "joints held": lambda kind, text: kind == "locked",
    "limits taken as none": lambda kind, text: kind == "assumed" and ("limit" in text or "range" in text),
    "suspicious": lambda kind, text: kind == "suspicious",
}
"""Columns of the table that count the arms of which something is said, and which notes say it."""
WEIGHTLESS = ("expected a mass above", "expected an inertia, found none")
"""How an arm is refused that has a moving body without mass or inertia."""


def main(arguments: Sequence[str] | None = None) -> list[Row]:
    """Survey a folder, and print or write the table."""
    options = _options(arguments)
    for library in ("yourdfpy", "mujoco", *(["casadi", "scipy.linalg"] if options.compare else [])):
        importlib.import_module(library)  # once, not in every process
    patterns = ["*.urdf", *(["*.xacro"] if options.xacro else [])]
    rows: dict[Path, list[Row]] = {}
    for collection in _collections(options.folder):
        files = sorted({file for pattern in patterns for file in collection.rglob(pattern)})
        with ThreadPoolExecutor(options.workers) as pool:
            tasks = [task for file in files for task in _tasks(file, collection)]
            rows[collection] = list(pool.map(partial(_apart, compare=options.compare), tasks))
        print(f"{collection.name}: {len(tasks)} files", flush=True)
        if options.out:
            _write(options.out, rows)
    print(table(rows))
    return [row for found in rows.values() for row in found]


def _write(out: Path, rows: dict[Path, list[Row]]) -> None:
    """The table, and every row beside it."""
    out.write_text(table(rows), encoding="utf-8")
    everything = {collection.name: [asdict(row) for row in found] for collection, found in rows.items()}
    out.with_suffix(".json").write_text(json.dumps(everything, indent=1), encoding="utf-8")


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--xacro", action="store_true", help="expand and try xacro files too")
    parser.add_argument("--compare", action="store_true", help="compare dynamics, run both engines")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, help="write the table there, and every row beside it as JSON")
    return parser.parse_args(arguments)


def _collections(folder: Path) -> list[Path]:
    """The folders in a folder that hold robots; the folder itself if robots lie in it."""
    if any(folder.glob("*.urdf")) or any(folder.glob("*.xacro")):
        return [folder]
    return [child for child in sorted(folder.iterdir()) if child.is_dir()]


def _tasks(file: Path, collection: Path) -> list[Task]:
    """A file without arguments, or with each set of them that is known."""
    known = collection / ".xacro_args.json"
    sets = json.loads(known.read_text(encoding="utf-8")) if known.is_file() else {}
    return [Task(file, collection, args) for args in sets.get(str(file.relative_to(collection)), [None])]


# -- one file, one process ---------------------------------------------------------------------------------


def _apart(task: Task, compare: bool) -> Row:
    """The row of a file, from a process that may crash or hang."""
    here, there = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.Process(target=_send, args=(there, task, compare), daemon=True)
    process.start()
    there.close()
    row = Row(task.name, refusal=f"CRASH: no answer within {TIME_LIMIT:g} s")
    try:
        if here.poll(TIME_LIMIT):
            row = here.recv()
    except EOFError:
        process.join()
        row.refusal = f"CRASH: the process ended with {process.exitcode}"
    process.kill()
    process.join()
    return row


def _send(there: Connection, task: Task, compare: bool) -> None:
    quiet = os.open(os.devnull, os.O_WRONLY)  # the other libraries' parsers write whatever they find
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    there.send(survey(task, compare))


# -- the table ---------------------------------------------------------------------------------------------


def table(rows: dict[Path, list[Row]]) -> str:
    """A line per collection, which robots are refused, what is said of the others, and how exact they are."""
    every = [row for found in rows.values() for row in found]
    lines = [
        f"| collection | commit | files | arms with masses | load | {' | '.join([*SAID, *LIBRARIES])} |",
        "| --- | --- | ---: | ---: | ---: |" + " ---: |" * len([*SAID, *LIBRARIES]),
        *(_line(collection.name, _commit(collection), found) for collection, found in rows.items()),
        _line("together", "", every),
        "",
        *_shares(every),
        "",
        "Refused:",
        "",
        *(f"- {row.file}: {row.refusal}" for row in every if row.refusal),
    ]
    parts = [
        (
            "What is said of arms that load",
            Counter(n for row in every for n in {_note(*x) for x in row.notes}),
        ),
        ("What is no arm with masses", Counter(_kind(row.what) for row in every if row.what != "arm")),
    ]
    for title, counts in parts:
        lines += ["", f"{title}:", "", *_counted(counts)]
    return "\n".join([*lines, "", *_exactness(every), ""])


def _line(name: str, commit: str, rows: Iterable[Row]) -> str:
    rows = list(rows)
    arms = [row for row in rows if row.what == "arm"]
    loaded = sum(not row.refusal for row in arms)
    said = [sum(any(says(*note) for note in row.notes) for row in arms) for says in SAID.values()]
    others = [sum(not row.others.get(name, "no") for row in arms) for name in LIBRARIES]
    return f"| {' | '.join(map(str, (name, commit, len(rows), len(arms), loaded, *said, *others)))} |"


def _shares(rows: Iterable[Row]) -> list[str]:
    """How many arms load: of all with any mass, and of those with mass and inertia wherever they move."""
    arms = [row for row in rows if row.what == "arm"]
    whole = [row for row in arms if not any(words in row.refusal for words in WEIGHTLESS)]
    return [
        _share("arms that have any mass", arms),
        _share("arms that are not refused for a missing mass or inertia of what moves", whole),
    ]


def _share(what: str, arms: Sequence[Row]) -> str:
    loaded = sum(not row.refusal for row in arms)
    return f"- Of {len(arms)} {what}, {loaded} load, {100 * loaded / max(len(arms), 1):.1f} %."


def _commit(collection: Path) -> str:
    file = collection / ".commit"
    return file.read_text(encoding="utf-8").split()[0][:10] if file.is_file() else ""


def _note(kind: str, text: str) -> str:
    return f"{kind}: {_kind(text)}"


def _kind(text: str) -> str:
    """A message without names, numbers, files and lines, so that those of one kind are the same."""
    text = re.sub(r"^\S*?:?\d+: ", "", text.partition("\n")[0])
    text = re.sub(r"'[^']*'", "'...'", text)
    text = re.sub(r"/\S+", "...", text)
    text = re.sub(r"[-+]?\d[\d.e+-]*", "#", text)
    return re.sub(r"(#|'...')([, ]+(#|'...'))+", r"\1", text)[:160]


def _counted(counts: Counter[str]) -> list[str]:
    return [f"- {count}: {text}" for text, count in counts.most_common(60)] or ["- none"]


def _exactness(rows: Sequence[Row]) -> list[str]:
    compared = [row for row in rows if "M" in row.errors]
    if not compared:
        return []
    worst = {name: max(row.errors[name] for row in compared) for name in compared[0].errors}
    loops = [row.loop for row in compared if row.loop == row.loop]
    words = ", ".join(f"{name} {value:.1e}" for name, value in worst.items())
    apart, stopped = max(loops, default=0.0), Counter(_kind(row.stopped) for row in compared if row.stopped)
    return [
        f"Largest relative difference from plain Pinocchio over {len(compared)} arms: {words}.",
        f"Largest difference between the engines after a short run of {len(loops)} arms: {apart:.1e}.",
        *(f"No such run: {line[2:]}" for line in _counted(stopped) if stopped),
    ]


if __name__ == "__main__":
    main()
