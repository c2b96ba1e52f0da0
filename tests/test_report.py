"""The page: self-contained, escaped, complete; and the script that makes it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from browser import open_page, require_browser
from refusals import refused

from synctrl.errors import InputError, ResultError
from synctrl.paper import whole
from synctrl.paper.claims import Claim, Finding
from synctrl.paper.report import (
    Formulas,
    Links,
    Picture,
    Section,
    SideBySide,
    Table,
    Text,
    Verdicts,
    number,
    words,
    write_page,
)
from synctrl.show.style import display
from synctrl.simulation.result import Result

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

import reproduce as script  # noqa: E402

NASTY = "</p><script>alert('x')</script><img src=x onerror=alert(1)>"


def page_of(tmp_path, *blocks):
    return write_page(tmp_path / "page.html", "title", [Section("section", blocks)]).read_text("utf-8")


def test_words_from_data_never_become_markup(tmp_path):
    claim = Claim(NASTY, NASTY, False, (Finding(NASTY, 1.0, NASTY),), NASTY)
    svg = tmp_path / "f.svg"
    svg.write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    blocks = [Text(NASTY), Table((NASTY,), ((NASTY,),), NASTY), Verdicts((claim,)), Picture(svg, NASTY)]
    blocks += [Formulas((("x", NASTY, NASTY),)), Table(("", ""), (), groups=((NASTY, 1),))]
    text = page_of(tmp_path, *blocks, SideBySide((Text(NASTY),)), Links(((NASTY, NASTY),)))
    assert "<script" not in text
    assert "<img src=x" not in text
    assert text.count("&lt;script&gt;") >= 10


def test_a_claim_that_does_not_hold_says_so(tmp_path):
    text = page_of(tmp_path, Verdicts((Claim("it is so", "here", False, (), "because"),)))
    assert "does not hold" in text


def test_a_row_that_does_not_fit_its_table_is_refused(tmp_path):
    with refused(InputError, "table", found=1):
        page_of(tmp_path, Table(("a", "b"), (("1",),)))


def test_groups_that_do_not_cover_the_columns_are_refused(tmp_path):
    text = page_of(tmp_path, Table(("", "b", "c"), (("1", "2", "3"),), groups=(("both", 2),)))
    assert "<th colspan='2'>both</th>" in text
    with refused(InputError, "table", found=3):
        page_of(tmp_path, Table(("", "b", "c"), (), groups=(("too wide", 3),)))


@pytest.mark.parametrize(
    ("text", "markup"),
    [
        ("ε = e_1 - e_2", "ε = e<sub>1</sub> - e<sub>2</sub>"),
        ("K_ε, e*_i, θ̂_i", "K<sub>ε</sub>, e*<sub>i</sub>, θ̂<sub>i</sub>"),
        ("planar_four and joint_1", "planar_four and joint_1"),
        ("a_<b>", "a_&lt;b&gt;"),
    ],
)
def test_a_letter_with_an_underscore_gets_an_index(text, markup):
    assert words(text) == markup


def test_formulas_are_pictures_with_their_text(tmp_path):
    row = (r"\epsilon_k = \sum_i S_{ki} c_i e_i", "synchronization error", "(7)")
    text = page_of(tmp_path, Formulas((row,)))
    assert f'alt="{row[0]}" src="data:image/svg+xml;base64,' in text
    assert text == page_of(tmp_path, Formulas((row,))), "the same formula, the same bytes"
    with refused(InputError, "formula '\\nonsense{'"):
        page_of(tmp_path, Formulas(((r"\nonsense{", "", ""),)))


def test_a_missing_figure_and_an_unwritable_page_are_clear_errors(tmp_path):
    with refused(ResultError, file=str(tmp_path / "none.svg")):
        page_of(tmp_path, Picture(tmp_path / "none.svg", ""))
    (tmp_path / "file").write_text("")
    page = tmp_path / "file" / "page.html"
    with refused(ResultError, file=str(page)):
        write_page(page, "t", [])


@pytest.mark.parametrize(
    ("value", "text"), [(0.0123456, "0.0123"), (1.5e-7, "1.5·10⁻⁷"), (264.1, "264"), (-3e12, "-3·10¹²")]
)
def test_numbers_are_short(value, text):
    assert number(value) == text


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory):
    """Everything that the script writes: what CI has made already, or of runs cut off after a second."""
    if made := os.environ.get("SYNCTRL_REPRODUCED"):
        return Path(made)
    out = tmp_path_factory.mktemp("reproduced") / "out"
    done = run_script("--out", str(out), "--quick")
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.rstrip().endswith(str(out / "index.html"))
    return out


def test_all_figures_of_the_paper_are_there_as_png_and_svg(reproduced):
    for k in (*range(2, 17),):
        png = (reproduced / "figures" / f"figure_{k:02d}.png").read_bytes()
        svg = (reproduced / "figures" / f"figure_{k:02d}.svg").read_text("utf-8")
        assert png.startswith(b"\x89PNG")
        assert svg.rstrip().endswith("</svg>")


def test_the_page_loads_nothing_from_elsewhere_and_every_link_leads_somewhere(reproduced):
    text = (reproduced / "index.html").read_text("utf-8")
    assert not re.search(r"""(src|href)\s*=\s*["'](https?:)?//""", text)
    links = re.findall(r'href="([^"#][^"]*)"', text)
    assert len(links) >= 6
    for link in links:
        assert (reproduced / link).is_file(), link


def test_every_claim_of_the_page_is_in_the_metrics(reproduced):
    text = (reproduced / "index.html").read_text("utf-8")
    data = json.loads((reproduced / "metrics.json").read_text("utf-8"))
    verdicts = re.findall(r'<li class="(holds|fails)">', text)
    assert verdicts.count("holds") == sum(claim["holds"] for claim in data["claims"])
    assert verdicts.count("fails") == sum(not claim["holds"] for claim in data["claims"])
    for claim in data["claims"]:
        assert words(claim["text"]) in text
        for figure in claim["figures"]:
            unit, factor = display(figure["unit"])
            shown = f"{number(factor * figure['value'])} {unit}".strip()
            assert f"<li>{words(figure['name'])} <b>{shown}</b></li>" in text
    assert set(data["runs"]) == {path.stem for path in (reproduced / "runs").glob("*.npz")}


def shown_metric(data, run, kind, row, axis, name):
    """A metric of the file as the page has to show it."""
    found = data["runs"][run][kind]
    value = found["values"][row][axis][name]
    return "–" if value is None else number(display(found["units"][name]).factor * value)


def test_every_metric_of_the_page_is_in_the_metrics(reproduced):
    text = (reproduced / "index.html").read_text("utf-8")
    data = json.loads((reproduced / "metrics.json").read_text("utf-8"))
    compared = ("a460_pair_{}", "planar_four_{}", "planar_four_{}_disturbed")
    rows = 0
    for pattern in compared:
        pair = [pattern.format(kind) for kind in ("synchronized", "independent")]
        for kind, prefix in (("tracking_error", ""), ("sync_error", "ε_")):
            for row, axes in data["runs"][pair[0]][kind]["values"].items():
                for axis in axes:
                    (start,) = re.findall(
                        f"<th scope='row'>{re.escape(words(f'{prefix}{row}, {axis}'))}</th>(.*?)</tr>",
                        section_of(text, data["runs"][pair[0]]["title"]),
                    )
                    cells = re.findall("<td>(.*?)</td>", start)
                    del cells[5], cells[2]  # the ratios
                    expected = [
                        shown_metric(data, run, kind, row, axis, name)
                        for name in ("peak", "rms", "ise", "settling_time", "final")
                        for run in pair
                    ]
                    assert cells == expected
                    rows += 1
    assert rows == 2 * 3 + 3 + 2 * (4 + 4) * 2


def section_of(text, title):
    """The tables of the page that compare a run: from the first caption with its title on to the torques."""
    start = text.index(f"Tracking error e: {title} (sync.)")
    return text[start : text.index("Peak torque", start)]


@pytest.mark.parametrize(("longest", "trial"), [(whole.TRIAL, True), (1.1 * whole.TRIAL, False)])
def test_a_page_of_shortened_runs_says_so(tmp_path, longest, trial):
    text = whole.write(tmp_path / "page.html", [], longest).read_text("utf-8")
    assert ("This page is a trial" in text) == trial


def test_a_trial_shortens_every_run_and_every_comparison(monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(script, "reproduce", lambda *arguments: asked.extend(arguments) or tmp_path)
    monkeypatch.setattr(sys, "argv", ["reproduce.py", "--out", str(tmp_path), "--quick"])
    assert script.main() == 0
    out, _, planned, limit = asked
    assert out == tmp_path and limit < whole.TRIAL
    assert len(planned) > len(whole.PLANNED)
    assert all(run.duration <= whole.TRIAL for run in planned.values())


@pytest.mark.parametrize("workers", ["0", "-1", "two", "1.5"])
def test_a_number_of_processes_that_is_none_is_refused(workers):
    done = run_script("--workers", workers)
    assert done.returncode == 2
    assert "expected a number of at least 1" in done.stderr


def test_a_folder_that_cannot_be_written_is_an_error_before_anything_runs(tmp_path):
    (tmp_path / "file").write_text("")
    done = run_script("--out", str(tmp_path / "file" / "out"))
    assert done.returncode == 1
    assert done.stderr.startswith("error: cannot write into the folder")
    assert "Traceback" not in done.stderr


def run_script(*arguments):
    command = [sys.executable, str(ROOT / "scripts" / "reproduce.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_every_run_can_be_loaded_and_says_what_it_is(reproduced):
    for path in (reproduced / "runs").glob("*.npz"):
        run = Result.load(path)
        assert run.status == "completed"
        assert run.info["gains"]
        assert run.info["versions"]["pin"]


def test_the_page_opens_in_a_browser_without_asking_for_anything(reproduced):
    require_browser()
    with open_page(reproduced / "index.html") as page:
        assert page.evaluate("document.querySelectorAll('figure img').length") >= 15
        broken = "[...document.images].filter(i => !i.complete || !i.naturalWidth).length"
        assert page.evaluate(broken) == 0
        assert page.requests == []
        assert page.errors == []


def test_every_animation_plays_without_a_network(reproduced):
    require_browser()
    animations = sorted((reproduced / "animations").glob("*.html"))
    assert len(animations) >= 6
    for path in animations:
        with open_page(path) as page:
            page.check_plays()
            assert page.requests == []
            assert page.errors == []
