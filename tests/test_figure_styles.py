"""Figures in all sizes and styles: words have their place, lines differ in grey, fonts are embedded."""

from __future__ import annotations

import io
import pickle
import re
import zlib
from dataclasses import replace
from itertools import combinations

import matplotlib
import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from matplotlib.colors import to_hex
from matplotlib.font_manager import FontProperties, findfont
from refusals import refused
from sliders import SCARA, load, pair
from test_panels import check_places

from synctrl import Coupling, Experiment, Result
from synctrl.errors import InputError
from synctrl.show import lyapunov_terms, overlays, paths, save, tip_paths, torques, tracking_errors
from synctrl.show.look import NARROWEST, PLAIN, STYLES, look_of
from synctrl.show.run_figures import FIGURES, ON_REQUEST
from synctrl.show.style import PALETTE

#: sizes that are looked at: a column of a journal, a page, a slide
SIZES = ({"style": "ieee"}, {"width": 3.5}, {"width": 6.4}, {"width": 10.0}, {"style": "slides"})
NAMES = (*FIGURES, *ON_REQUEST)


def titled(size: dict) -> str:
    return " ".join(map(str, size.values()))


@pytest.fixture(scope="module")
def star() -> Result:
    return Experiment(small_cell(4, coupling=Coupling.star(4)), SMALL_GAINS, 0.1).simulate(dt=5e-3)


@pytest.fixture(scope="module")
def scaras(tmp_path_factory: pytest.TempPathFactory) -> Result:
    robot = load(tmp_path_factory.mktemp("scara"), "scara", SCARA, effort=30.0)
    return pair((robot, robot)).simulate(dt=2e-3)


@pytest.mark.parametrize("size", SIZES, ids=titled)
@pytest.mark.parametrize("name", NAMES)
def test_all_words_have_their_place_in_every_size(scaras, name, size):
    figure = scaras.plot(name, **size)[name]
    assert figure.get_figwidth() == pytest.approx(look_of(size.get("style"), size.get("width")).width)
    check_places(figure)


@pytest.mark.parametrize("name", NAMES)
def test_all_words_have_their_place_whatever_they_are_and_however_large_numbers_are(star, name):
    robots = [{**r, "name": f"{k} {'a very long name ' * 9}"} for k, r in enumerate(star.info["robots"])]
    axes = [f"{k} {'coordinate ' * 9}" for k in range(2)]
    kinds = () if name in ("lyapunov", "tip_path") else ("tracking_error", "sync_error", "tau", "theta_hat")
    for scale in (1e-7, 1e6):
        arrays = {kind: scale * getattr(star, kind) for kind in kinds}
        run = replace(star, info={**star.info, "robots": robots, "axes": axes}, **arrays)
        check_places(run.plot(name, style="ieee")[name])


@pytest.mark.parametrize("size", SIZES, ids=titled)
def test_runs_on_one_another_have_room_for_all_words(scaras, star, size):
    for run in (scaras, star):
        for figure in overlays({"one": run, "the other": run}, **size).values():
            check_places(figure)


def curves(panel):
    """Lines of a panel that are curves of a colour of its own."""
    return [l for l in panel.get_lines() if np.size(l.get_xdata()) > 2 and to_hex(l.get_color()) in PALETTE]


@pytest.mark.parametrize("name", NAMES)
def test_no_two_lines_of_a_journal_look_alike_in_grey(star, name):
    for panel in star.plot(name, style="ieee")[name].axes:
        seen = {(line.get_marker(), str(line.get_linestyle())) for line in curves(panel)}
        assert len(seen) == len(curves(panel)) and all(marker != "None" for marker, _ in seen)


def test_what_a_legend_shows_is_what_is_drawn(star):
    figure = tracking_errors(star, style="ieee")
    entries = [line for line in figure.legends[0].get_lines() if to_hex(line.get_color()) in PALETTE]
    assert {(line.get_color(), line.get_marker()) for line in entries} == {
        (line.get_color(), line.get_marker()) for line in curves(figure.axes[0])
    }
    assert len(entries) == 4
    assert all(line.get_marker() == "None" for line in curves(tracking_errors(star).axes[0]))


def test_a_style_changes_how_a_figure_looks_and_nothing_of_what_it_shows(star):
    for one, two in combinations([paths(star, style=style) for style in (None, *STYLES)], 2):
        for a, b in zip(one.axes, two.axes, strict=True):
            assert (a.get_xlim(), a.get_ylim(), a.get_ylabel()) == (
                b.get_xlim(),
                b.get_ylim(),
                b.get_ylabel(),
            )
            for first, second in zip(a.get_lines(), b.get_lines(), strict=True):
                np.testing.assert_array_equal(first.get_xydata(), second.get_xydata())


def test_words_are_as_large_as_a_style_says(star):
    sizes = {style: torques(star, style=style).axes[0].yaxis.label.get_size() for style in (None, *STYLES)}
    assert sizes["ieee"] == pytest.approx(8.0) and sizes["slides"] >= 1.5 * sizes[None]
    label = torques(star, style="ieee").axes[0].yaxis.label
    assert "STIX" in findfont(FontProperties(family=label.get_family()))


def embedded(pdf: bytes) -> set[str]:
    """Kinds of fonts in a PDF, in its plain objects and in those that are packed."""
    packed = (found for found in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf, flags=re.DOTALL))
    texts = [pdf]
    for stream in packed:
        try:
            texts.append(zlib.decompress(stream))
        except zlib.error:
            continue
    every = b"\n".join(texts)
    assert b"/FontFile2" in every
    return {kind.decode() for kind in re.findall(rb"/Subtype\s*/(Type\w+|TrueType|CIDFontType\w+)", every)}


@pytest.mark.parametrize("settings", [{}, {"pdf.fonttype": 3, "font.size": 30.0}])
def test_fonts_are_embedded_as_outlines_however_a_figure_is_saved(star, tmp_path, settings):
    with matplotlib.rc_context(settings):
        (file,) = star.plot("torque", style="ieee").save(tmp_path, ("pdf",))
        other = io.BytesIO()
        torques(star, style="ieee").savefig(other, format="pdf")
    for pdf in (file.read_bytes(), other.getvalue()):
        assert pdf.startswith(b"%PDF") and "Type3" not in embedded(pdf)
        width = float(re.search(rb"/MediaBox\s*\[\s*0 0 ([\d.]+)", pdf)[1])
        assert width == pytest.approx(72 * 3.5)


def test_a_gallery_is_written_in_the_formats_of_its_style_or_in_those_that_are_named(star, tmp_path):
    def written(folder, *formats, **look):
        return [file.name for file in star.plot("path", **look).save(tmp_path / folder, *formats)]

    assert written("plain") == ["path.png", "path.svg"] and written("ieee", style="ieee") == [
        "path.pdf",
        "path.png",
    ]
    assert written("chosen", ("svg", "pdf")) == ["path.svg", "path.pdf"]
    first = [file.read_bytes() for file in star.plot("path", style="ieee").save(tmp_path / "again")]
    assert first == [(tmp_path / "ieee" / name).read_bytes() for name in ("path.pdf", "path.png")]


def test_what_is_no_style_format_or_width_is_refused(star, tmp_path):
    with refused(InputError, "style", found="nature"):
        star.plot(style="nature")
    with refused(InputError, "format", found="gif"):
        save(paths(star), tmp_path / "path", ("gif",))
    with refused(InputError, "runs, 'file'"):
        overlays({"run": star, "file": "run.npz"})
    assert not list(tmp_path.iterdir())
    for style, look in (("slides", STYLES["slides"]), (None, PLAIN)):
        least = NARROWEST * look.scale
        paths(star, style=style, width=least)
        with refused(InputError, "width", found=0.99 * least):
            paths(star, style=style, width=0.99 * least)


def test_a_figure_in_a_style_can_be_sent_to_another_process(star):
    figure = pickle.loads(pickle.dumps(tip_paths(star, style="ieee")))
    figure.savefig(io.BytesIO(), format="pdf")
    assert figure.get_figwidth() == 3.5
    assert len(lyapunov_terms(star, width=4.0).axes) == 2
