"""The page of a run, and what lies beside it in its folder."""

from __future__ import annotations

from pathlib import Path

from ..analysis.certify import Certificate, certify
from ..analysis.metrics import as_data, metrics, write_metrics
from ..errors import InputError, SynctrlError
from ..files import read_regular, reported, write_whole
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .answer import Answer
from .run_tables import certificate_lines, run_tables

#: names of the files in the folder of a run
RESULT, METRICS, CELL = "run.npz", "metrics.json", "cell.toml"


def certified(answer: Answer, result: Result, experiment: Experiment | None) -> Certificate | None:
    """What the proof says of a run; None if its experiment is not known, or nothing can be said."""
    try:
        return certify(result, experiment)
    except SynctrlError as error:
        answer.data["uncertified"] = str(error)
        return None


def tell_run(answer: Answer, result: Result, certificate: Certificate | None) -> None:
    """Put a run into the answer: its numbers and its certificate."""
    found = metrics(result)
    title, end = str(result.info["title"]), float(result.t[-1])
    answer.data |= {"title": title, "status": result.status, "end": end, "metrics": as_data(result, found)}
    answer.show(f"{title}: {result.status}, {end:g} s, {len(result.t)} logged instants", "")
    answer.show(*run_tables(result, found), "")
    if certificate is None:
        answer.show(f"No certificate: {answer.data.get('uncertified', '')}")
    else:
        answer.data["certificate"] = certificate.as_dict()
        answer.show(certificate_lines(certificate))


def prepare_folder(folder: Path, source: Path) -> None:
    """Make the folder of a run, before there is anything that could be lost.

    Args:
        folder: where the run will be written.
        source: the file that it is made of, of which a copy will be there.

    Raises:
        InputError: a cell file is in the place of the copy that is neither the source nor beside a run.
        ResultError: the folder cannot be made.
    """
    copy = folder / CELL
    if copy.exists() and not _same(source, copy) and not (folder / RESULT).exists():
        words = f"expected a folder without a {CELL} of its own, which the copy of '{source}' would replace"
        raise InputError(f"{words}, found one", subject="--out", found=str(folder))
    with reported("write into the folder", folder):
        folder.mkdir(parents=True, exist_ok=True)


def write_run(
    answer: Answer, folder: Path, result: Result, certificate: Certificate | None, source: Path
) -> None:
    """Write a run into a folder: the result, its metrics, and the file that it was made of.

    Raises:
        ResultError: something cannot be written.
    """
    certificates = {} if certificate is None else {"run": certificate.as_dict()}
    numbers = {"run": as_data(result, metrics(result))}
    written = [result.save(folder / RESULT)]
    written.append(write_metrics(folder / METRICS, numbers, [], certificates=certificates))
    with reported("copy the cell file to", folder / CELL):
        content = read_regular(source)
        if not _same(source, folder / CELL):
            write_whole(folder / CELL, content)
    answer.data["written"] = [*written, folder / CELL]


def write_page(
    answer: Answer,
    folder: Path,
    result: Result,
    certificate: Certificate | None,
    experiment: Experiment | None,
) -> Path:
    """The page of a run, with its figures and its animation.

    Raises:
        ResultError: something cannot be written.
    """
    from ..show.run_page import write_run_page

    page = write_run_page(result, folder, certificate=certificate, experiment=experiment)
    answer.data["page"] = page
    answer.show("", f"Open {page}")
    return page


def cell_beside(answer: Answer, path: Path) -> Experiment | None:
    """The experiment of the cell file that lies beside a result; None, and why, if there is none."""
    from ..cells import read_cell

    file = (path if path.is_dir() else path.parent) / CELL
    reason = "the cell that made it is not known; name its file by --cell"
    if file.is_file():
        try:
            return read_cell(file)
        except SynctrlError as error:
            reason = f"{reason}: {error}"
    answer.data["uncertified"] = reason
    return None


def _same(one: Path, other: Path) -> bool:
    return other.exists() and one.samefile(other)
