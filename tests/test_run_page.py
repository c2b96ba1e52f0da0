"""The page of a run: the worst is marked, names are text, a network is asked nothing, any run has one."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from browser import open_page, require_browser
from cells import SMALL_GAINS, small_cell
from refusals import refused
from sliders import SCARA, load, pair

from synctrl import Coupling, Experiment, Result
from synctrl.analysis import certify
from synctrl.analysis.metrics import metrics
from synctrl.errors import InputError, ResultError
from synctrl.show.run_page import PAGE, write_run_page
from synctrl.show.run_summary import pairs_table, peaks, robots_table, sentences, warnings
from synctrl.show.runs import as_far_as_it_means
from synctrl.simulation.result import LAYOUT

NASTY = "</title><script>alert(1)</script><img src=x onerror=alert(2)>\"'"


@pytest.fixture(scope="module")
def star() -> Result:
    return Experiment(small_cell(4, coupling=Coupling.star(4)), SMALL_GAINS, 0.1).simulate(dt=5e-3)


@pytest.fixture(scope="module")
def scaras(tmp_path_factory: pytest.TempPathFactory) -> Result:
    robot = load(tmp_path_factory.mktemp("scara"), "scara", SCARA, effort=30.0)
    return pair((robot, robot)).simulate(dt=2e-3)


def renamed(run: Result, name: str) -> Result:
    """The run with a name, counted, for all that has one."""

    def names(like: list) -> list[str]:
        return [f"{k} {name}" for k in range(len(like))]

    robots = [
        {**about, "name": own, "joints": names(about["joints"])}
        for own, about in zip(names(run.names), run.info["robots"], strict=True)
    ]
    return replace(run, info={**run.info, "title": name, "robots": robots, "axes": names(run.info["axes"])})


class Elements(HTMLParser):
    """Tags of a page, and the addresses in them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.addresses += [str(value) for name, value in attrs if name in ("src", "href", "action", "data")]


def column(table, head: str) -> list[str]:
    k = table.head.index(head)
    return [row[k] for row in table.rows]


def marked(table, head: str) -> list[int]:
    return sorted(row for row, k in table.marked if k == table.head.index(head))


def test_every_robot_and_every_pair_has_a_row_with_its_numbers(star):
    computed = metrics(star)
    robots, pairs = robots_table(star, computed), pairs_table(star, computed)
    assert [row[0] for row in robots.rows] == star.names and len(pairs.rows) == 3
    unit, factor = ("deg", np.rad2deg(1.0)) if star.unit("tracking_error") == "rad" else ("mm", 1e3)
    shown = [float(text) for text in column(robots, f"largest |e|, {unit}")]
    np.testing.assert_allclose(shown, factor * computed.tracking_error.peak.max(axis=1), rtol=5e-3)


@pytest.mark.parametrize("worst", range(4))
def test_the_worst_of_a_column_is_marked_and_no_other(star, worst):
    e = np.where(np.arange(4)[:, None] == worst, 3.0, 1.0) * np.ones_like(star.tracking_error)
    run = replace(star, tracking_error=e)
    table = robots_table(run, metrics(run))
    (largest,) = (head for head in table.head if head.startswith("largest |e|"))
    assert marked(table, largest) == [worst]


def test_where_all_are_alike_nothing_is_marked_but_what_is_bad_is(star):
    even = replace(star, tracking_error=np.ones_like(star.tracking_error), tau=np.ones_like(star.tau))
    limited = [{**about, "torque_limits": [1e3] * len(about["joints"])} for about in star.info["robots"]]
    even = replace(even, info={**star.info, "robots": limited})
    table = robots_table(even, metrics(even))
    assert {table.head[k] for _, k in table.marked} == {"settled, s"}
    weak = [{**about, "torque_limits": [0.5] * len(about["joints"])} for about in star.info["robots"]]
    over = replace(even, info={**star.info, "robots": weak})
    table = robots_table(over, metrics(over))
    assert marked(table, "of its limit, %") == [0, 1, 2, 3] and {*column(table, "of its limit, %")} == {"200"}


def test_the_largest_error_is_told_with_its_place(scaras):
    found = peaks(scaras, "tracking_error")
    assert [peak.unit for peak in found] == ["deg", "mm"]
    lift = np.abs(scaras.tracking_error[:, :, 2])
    t, row = np.unravel_index(lift.argmax(), lift.shape)
    assert (found[1].time, found[1].row) == (scaras.t[t], scaras.names[row])
    assert found[1].size == pytest.approx(1e3 * lift.max())
    assert any(str(found[1]) == line for line in sentences(scaras, metrics(scaras)))


def test_limits_that_were_left_and_a_step_that_is_too_long_are_told(star):
    left = [
        {"robot": k % 4, "joint": 1, "kind": "velocity", "unit": "rad/s", "start": 0.01 * k, "stop": 0.1}
        | {"limit": 2.0, "reached": 3.0}
        for k in range(9)
    ]
    info = {**star.info, "limits": left, "step_error": {**star.info["step_error"], "advised_step": 1e-3}}
    *named, more, step = warnings(replace(star, info=info))
    assert len(named) == 3 and all(name in line for name, line in zip(star.names, named, strict=False))
    assert " 6 " in more and "1 ms" in step
    assert warnings(star) == []


def test_names_never_become_markup_and_nothing_is_asked_of_a_network(star, tmp_path):
    runs, certificate = (renamed(star, NASTY), star), certify(star)
    page, plain = (Elements(write_run_page(run, tmp_path, certificate).read_text("utf-8")) for run in runs)
    assert page.tags == plain.tags and "script" not in page.tags
    assert all(address.startswith(("data:", "#")) or "/" not in address for address in page.addresses)
    assert (tmp_path / "animation.html").is_file()


def test_the_page_shows_itself_and_plays_without_a_network(scaras, tmp_path):
    require_browser()
    with open_page(write_run_page(renamed(scaras, NASTY), tmp_path)) as page:
        page.wait_for("document.querySelector('iframe') !== null")
        titles = page.evaluate("[...document.querySelectorAll('h2')].map(h => h.textContent)")
        assert titles == ["Summary", "Certificate", "Animation", "Figures", "How it was made"]
        assert page.evaluate("[...document.images].every(i => i.complete && i.naturalWidth > 0)")
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        assert page.requests == [] and page.errors == []


def test_a_run_that_stopped_or_went_astray_has_a_page_that_says_so(star, tmp_path):
    huge = np.full_like(star.q, 1e40)
    info = {**star.info, "status": "not finite at t = 0.1 s", "duration": 7.0}
    arrays = {name: np.full_like(getattr(star, name), 1e40) for name in LAYOUT if name != "t"}
    run = replace(star, info=info, **{**arrays, "q": huge}, experiment=None)
    text = write_run_page(run, tmp_path).read_text("utf-8")
    assert "The run stopped at t = 0.1 s of 7 s" in text and "not finite at t = 0.1 s" in text
    assert "went astray" in text and text.count("<figure>") == 0


def test_of_a_run_that_ran_away_the_beginning_is_drawn(star, tmp_path):
    growing = np.geomspace(1e-3, 1e40, len(star.t))[:, None, None]
    arrays = {name: growing * np.ones_like(getattr(star, name)) for name in ("tracking_error", "v", "tau")}
    run = replace(star, info={**star.info, "status": "stopped: joint 2 ran away"}, **arrays)
    seen = as_far_as_it_means(run)
    assert np.abs(seen.v).max() <= 1e3 < np.abs(run.v[len(seen.t)]).min()
    ended = replace(run, info=star.info)
    assert as_far_as_it_means(ended) is ended
    text = write_run_page(run, tmp_path).read_text("utf-8")
    assert f"Drawn until t = {seen.t[-1]:g} s" in text and text.count("<figure>") >= 5
    assert "stopped:" not in text


def test_a_certificate_is_told_in_words(star, tmp_path):
    certificate = certify(star)
    text = re.sub(r"<[^>]*>", "", write_run_page(star, tmp_path, certificate).read_text("utf-8"))
    assert certificate.meaning[1:] in text
    for doubt in (*certificate.outside, *certificate.doubts):
        assert doubt in text
    assert "certify(result)" not in text
    assert "certify(result)" in write_run_page(star, tmp_path).read_text("utf-8")


def test_what_has_no_page_is_refused(star, tmp_path):
    with refused(InputError, f"run '{star.info['title']}'", found=0):
        write_run_page(replace(star, **{name: getattr(star, name)[:0] for name in LAYOUT}), tmp_path)
    with refused(InputError, "certificate"):
        write_run_page(star, tmp_path, "covered")
    (tmp_path / "file").write_text("")
    with pytest.raises((ResultError, InputError)):
        write_run_page(star, tmp_path / "file")
    assert not (tmp_path / PAGE).exists()
