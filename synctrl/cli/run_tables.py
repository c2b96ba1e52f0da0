"""A run in a table: a row for each robot and each pair, the worst numbers marked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.text import Text

from ..analysis.certify import Certificate
from ..analysis.metrics import ErrorMetrics, Metrics, row_names
from ..simulation.result import Result
from .console import BAD, GOOD, number, table

#: from which share of its limit a torque is marked
NEAR = 1.0
#: columns of errors, with what makes one number of those of all coordinates
SIZES = {"peak": "peak", "RMS": "rms", "at the end": "final"}


def run_tables(result: Result, found: Metrics) -> list[Any]:
    """Tables of tracking errors with torques, and of synchronization errors."""
    return [_robots(result, found), *_beyond(result, found), "", _pairs(result, found)]


def _robots(result: Result, found: Metrics) -> Any:
    rows = _errors(result, "tracking_error", found.tracking_error)
    torques = [_torque(result, found, i) for i in range(len(rows))]
    columns = ("robot", *(f"{name} e" for name in SIZES), "settled", "peak torque", "of limit")
    return table("Robots", columns, [[*row, *torque] for row, torque in zip(rows, torques, strict=True)])


def _pairs(result: Result, found: Metrics) -> Any:
    rows = _errors(result, "sync_error", found.sync_error)
    return table("Compared", ("", *(f"{name} ε" for name in SIZES), "settled"), rows)


def _errors(result: Result, kind: str, sizes: ErrorMetrics) -> list[list[Any]]:
    """Rows of names and of the largest numbers over the coordinates; the worst of a column is marked."""
    from ..show.style import display

    unit, factor = display(result.unit(kind))
    columns = [factor * np.abs(getattr(sizes, name)).max(axis=1) for name in SIZES.values()]
    settled = sizes.settling_time.max(axis=1)
    cells = [[f"{number(value)} {unit}" for value in column] for column in columns]
    cells.append([f"{number(t)} s" if np.isfinite(t) else "no" for t in settled])
    marked = [_marked(texts, values) for texts, values in zip(cells, [*columns, settled], strict=True)]
    return [
        [name, *row] for name, row in zip(row_names(result, kind), zip(*marked, strict=True), strict=True)
    ]


def _marked(texts: Sequence[str], values: np.ndarray) -> list[str | Text]:
    """Cells of a column, the largest in red where they differ."""
    if not len(values) or values.max() <= values.min():
        return [*texts]
    worst = int(np.argmax(values))
    return [Text(text, style=BAD) if k == worst else text for k, text in enumerate(texts)]


def _torque(result: Result, found: Metrics, robot: int) -> list[str | Text]:
    """The peak torque of a robot, and the largest share of a limit."""
    about = result.info["robots"][robot]
    peaks = found.peak_torque[robot, : len(about["joints"])]
    units = result.units("tau")[robot]
    worst = int(np.argmax(peaks))
    share = float(_shares(about, peaks).max())
    words = f"{number(100 * share)} %" if share else "no limit"
    beyond = share > NEAR
    return [f"{number(peaks[worst])} {units[worst]}", Text(words, style=BAD) if beyond else words]


def _shares(about: dict[str, Any], peaks: np.ndarray) -> np.ndarray:
    """Peak torques over their limits, 0 where there is none, (nv,)."""
    limits = [limit if limit else np.inf for limit in about.get("torque_limits") or [None] * len(peaks)]
    return peaks / np.array(limits, float)


def _beyond(result: Result, found: Metrics) -> list[Text]:
    """What to make of torques that no robot has."""
    asked: list[str] = []
    if result.info.get("saturation"):  # it was cut off, and the run says so
        return []
    for about, peaks in zip(result.info["robots"], found.peak_torque, strict=True):
        shares = _shares(about, peaks[: len(about["joints"])])
        worst = int(np.argmax(shares))
        if shares[worst] > NEAR:
            asked.append(f"{about['name']}, {about['joints'][worst]}: {number(100 * shares[worst])} %")
    if not asked:
        return []
    words = (
        "more torque than there is, which the run took for granted; `saturate = true` in the file cuts it off"
    )
    return [Text(f"{words}, `synctrl advise` says what to change: {'; '.join(asked)}", style=BAD)]


def certificate_lines(certificate: Certificate) -> Text:
    """What the proof says of a run, in words."""
    made = Text("Certificate: ", style="bold")
    made.append(certificate.verdict, style=GOOD if certificate.certified else "yellow")
    made.append(f"\n  {certificate.meaning}", style="not bold")
    for word, texts in (("outside", certificate.outside), ("doubt", certificate.doubts)):
        for text in texts:
            made.append(f"\n  {word}: {text}", style="not bold")
    return made
