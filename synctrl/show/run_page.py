"""The page of any run: a summary first, then the certificate in words, figures and the animation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..analysis.certify import Certificate
from ..analysis.metrics import metrics
from ..checks import instance, printable
from ..errors import SynctrlError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .captions import CAPTIONS
from .cell_scene import scene_of
from .certificate_words import KINDS, certificate_blocks, in_a_word
from .consistency_plots import consistency
from .html import policy
from .lyapunov_plots import lyapunov_figure
from .page import (
    Block,
    Columns,
    Facts,
    Links,
    Picture,
    Points,
    Section,
    Text,
    as_picture,
    number,
    write_page,
)
from .phase_figures import phase_portraits
from .run_figures import Gallery, gallery
from .run_summary import headline, pairs_table, robots_table, sentences, warnings
from .runs import as_far_as_it_means, check_run
from .shown import Shown
from .spectrum_figures import spectra
from .tip_figures import tip_paths

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE, ANIMATION, FIGURES = "index.html", "animation.html", "figures"
#: height of the animation within the page, pixels
HEIGHT = 560
#: of a list of settings so many are written
MOST_ITEMS = 8


def write_run_page(
    result: Result,
    folder: str | Path,
    certificate: Certificate | None = None,
    experiment: Experiment | None = None,
) -> Path:
    """Write the page of a run: one HTML file that asks nothing of a network.

    Beside it are `animation.html`, which the page has in it too unless it is very large, and the figures as
    SVG in `figures`. What cannot be drawn is left out, and the page says why.

    Args:
        result: the run, of any cell, complete or stopped, fresh or loaded.
        folder: where everything is written; it is made.
        certificate: of `synctrl.analysis.certify`; without one the page says how to get it.
        experiment: what made the run, for a result loaded from a file whose robots cannot be made again.

    Returns:
        The path of the page, `index.html` in the folder.

    Raises:
        InputError: no run, or one without instants.
        ResultError: a file cannot be written.
    """
    check_run(result)
    if certificate is not None:
        instance("certificate", certificate, Certificate, "what `certify` gives")
    folder = Path(folder)
    seen = as_far_as_it_means(result)
    sections = [
        _summary(result, certificate),
        _certificate(certificate, folder),
        _animation(seen, experiment, folder),
        _figures(seen, experiment, folder, _until(seen, result)),
        _made_with(result),
    ]
    title = printable(str(result.info["title"])) or "a run"
    return write_page(folder / PAGE, title, sections, policy())


@dataclass(frozen=True)
class Animation:
    """An animation within the page."""

    shown: Shown

    def html(self) -> str:
        """A frame with a closed world of its own."""
        return self.shown.html(HEIGHT)


def _summary(result: Result, certificate: Certificate | None) -> Section:
    computed = metrics(result)
    ended, well = headline(result)
    blocks: list[Block] = [Text(ended, "good" if well else "bad")]
    if certificate is not None:
        blocks.append(Text(f"The proof: {in_a_word(certificate)}", KINDS[certificate.verdict]))
    blocks += [Text(each, "note") for each in warnings(result)]
    blocks += [Points(tuple(sentences(result, computed))), robots_table(result, computed)]
    if result.info["pairs"]:
        blocks.append(pairs_table(result, computed))
    return Section("Summary", tuple(blocks))


def _certificate(certificate: Certificate | None, folder: Path) -> Section:
    if certificate is None:
        blocks: list[Block] = [
            Text("This page was written without a certificate: synctrl.analysis.certify(result) makes one.")
        ]
    else:
        blocks = certificate_blocks(certificate)
        figure = lyapunov_figure(certificate.lyapunov)
        blocks.append(as_picture(figure, folder / FIGURES / "lyapunov", CAPTIONS["lyapunov"]))
    return Section("Certificate", tuple(blocks))


def _animation(result: Result, experiment: Experiment | None, folder: Path) -> Section:
    """The animation, in the page and beside it; or why there is none."""
    try:
        scene = scene_of(result, experiment)
        scene.write(folder / ANIMATION)
    except SynctrlError as error:
        return Section("Animation", (Text(f"Not shown: {error}", "note"),))
    link = Links(((ANIMATION, "The animation in a window of its own"),))
    try:
        scene.html(HEIGHT)
    except SynctrlError:
        return Section("Animation", (link,))
    return Section("Animation", (Animation(scene), link))


def _figures(result: Result, experiment: Experiment | None, folder: Path, until: list[Block]) -> Section:
    try:
        found = gallery(result)
        _add(found, result, experiment)
    except SynctrlError as error:
        return Section("Figures", (Text(f"Nothing can be drawn: {error}", "note"),))
    pictures = Columns(tuple(_picture(name, figure, folder) for name, figure in found.items()))
    missing = tuple(f"Not shown: {name}: {reason}" for name, reason in found.missing.items())
    return Section("Figures", (*until, pictures, *([Points(missing)] if missing else [])))


def _until(seen: Result, result: Result) -> list[Block]:
    """What is said of a run of which only the beginning is drawn."""
    if len(seen.t) == len(result.t):
        return []
    end = number(float(seen.t[-1]), 6)
    return [Text(f"Drawn until t = {end} s: what the run has later has no meaning.", "note")]


def _add(found: Gallery, result: Result, experiment: Experiment | None) -> None:
    """Add the figures that are drawn on request, as far as the run has what they show."""
    drawn: dict[str, Callable[[], Figure]] = {
        "tip_path": partial(tip_paths, result, experiment),
        "phase_portrait": partial(phase_portraits, result),
        "spectrum": partial(spectra, result),
        "consistency": partial(consistency, result, experiment),
    }
    for name, draw in drawn.items():
        try:
            found[name] = draw()
        except SynctrlError as error:
            found.missing[name] = str(error)


def _picture(name: str, figure: Figure, folder: Path) -> Picture:
    return as_picture(figure, folder / FIGURES / name, CAPTIONS[name])


def _made_with(result: Result) -> Section:
    """Gains, parts, and versions, as they are in the result."""
    info = result.info
    parts = {key: info.get(key) for key in ("law", "adaptation", "network")}
    rows = [(key, _part(dict(value))) for key, value in parts.items() if value]
    rows += [(words, _in_words(info[key])) for key, words in _PLAIN.items() if info.get(key) is not None]
    return Section("How it was made", (Facts(tuple(rows)),))


_PLAIN = {
    "gains": "gains",
    "coupling": "coupling",
    "dt": "step, s",
    "log_dt": "logged every, s",
    "control_period": "control period, s",
    "integrator": "integrator",
    "engine": "engine",
    "plant": "plant",
    "saturate": "torque cut off at limits",
    "versions": "versions",
}


def _part(described: dict[str, Any]) -> str:
    """A part by its name, and its settings in brackets."""
    name, settings = described.pop("name", ""), _in_words(described)
    return f"{name} ({settings})" if settings else str(name)


def _in_words(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_in_words(each)}" for key, each in value.items())
    if isinstance(value, float):
        return number(value, 6)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return _list_in_words([_in_words(each) for each in value])
    return str(value)


def _list_in_words(items: list[str]) -> str:
    """Items one by one, or how often the only one of them is there, or as many as can be read."""
    if len(items) > 1 and len({*items}) == 1:
        return f"{len(items)} times {items[0]}"
    more = f", ... ({len(items)} in all)" if len(items) > MOST_ITEMS else ""
    return f"[{', '.join(items[:MOST_ITEMS])}{more}]"
