"""The site that `make docs` has built: links lead somewhere, and a browser without network shows all of it.

SYNCTRL_DOCS names its folder. Without it there is nothing to look at, and under CI that is a failure.
"""

from __future__ import annotations

import os
import zlib
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from browser import open_page
from test_docs_site import NAMES, reference

FOLDER = os.environ.get("SYNCTRL_DOCS")
if not FOLDER:
    report = pytest.fail if os.environ.get("CI") else pytest.skip
    report(
        "no site: make docs, and SYNCTRL_DOCS=out/docs",
        **({} if os.environ.get("CI") else {"allow_module_level": True}),
    )
SITE = Path(str(FOLDER)).resolve()
PAGES = sorted(SITE.rglob("*.html"))
#: what an element takes from elsewhere without being asked
TAKEN = {"script": "src", "img": "src", "iframe": "src", "link": "href", "source": "src", "video": "src"}


class Links(HTMLParser):
    """Where a page leads, what it takes, and the names of its places."""

    def __init__(self, text: str):
        super().__init__()
        self.leads, self.takes, self.places = [], [], set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {key: value or "" for key, value in attrs}
        self.places |= {found[key] for key in ("id", "name") if key in found}
        if tag == "a" and "href" in found:
            self.leads.append(found["href"])
        if TAKEN.get(tag) in found:
            self.takes.append(found[TAKEN[tag]])


@cache
def links(page: Path) -> Links:
    return Links(page.read_text("utf-8"))


def broken(page: Path) -> list[str]:
    """Links of a page to files or places that are not there, and what it takes from outside of the site."""
    found = []
    for address in links(page).leads + links(page).takes:
        parts = urlsplit(address)
        if parts.scheme in ("http", "https", "mailto") and address not in links(page).takes:
            continue
        target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
        if parts.scheme == "data":
            continue
        if (
            parts.scheme
            or not target.is_relative_to(SITE)
            or not target.is_file()
            or (
                parts.fragment
                and target.suffix == ".html"
                and unquote(parts.fragment) not in links(target).places
            )
        ):
            found.append(address)
    return found


def test_every_link_leads_to_a_place_that_is_there():
    assert len(PAGES) > 40
    assert {str(page.relative_to(SITE)): broken(page) for page in PAGES if broken(page)} == {}


def test_the_check_finds_links_that_lead_nowhere(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "SITE", tmp_path)
    page = tmp_path / "page.html"
    page.write_text(
        '<p id="a"><a href="#a"><a href="#b"><a href="none.html"><script src="https://x.example/a.js">'
    )
    assert broken(page) == ["#b", "none.html", "https://x.example/a.js"]


def test_every_public_name_has_an_entry():
    inventory = (SITE / "objects.inv").read_bytes().split(b"\n", 4)[4]
    entries = {line.split(" ", 1)[0] for line in zlib.decompress(inventory).decode().splitlines()}
    assert not {each.path for each in reference.entries(NAMES).values()} - entries


@pytest.fixture(scope="module")
def browser():
    with open_page(SITE / "index.html") as page:
        yield page


def test_all_pages_open_from_files_and_ask_for_nothing_outside_of_the_site(browser):
    for page in PAGES:
        if "_modules" not in page.parts:
            browser.go(page)
            formulas = browser.evaluate(FORMULAS)
            assert formulas["shown"] == formulas["written"] and formulas["wrong"] == [], page
        assert (browser.requests, browser.errors) == ([], []), page
    root = f"{SITE.as_uri()}/"
    assert browser.files and not [address for address in browser.files if not address.startswith(root)]


FORMULAS = """(window.MathJax ? MathJax.startup.promise : Promise.resolve()).then(() => ({
    written: document.querySelectorAll('.math').length,
    shown: [...document.querySelectorAll('.math')].filter(e => e.querySelector('mjx-container svg')).length,
    wrong: [...document.querySelectorAll('[data-mml-node="merror"]')].map(e => e.dataset.mjxError || 'error'),
}))"""


def test_scenes_of_the_gallery_have_pictures():
    """A browser that is slow may miss some of them, and these show their figure; it must not miss most."""
    scenes = {path.stem for path in (SITE / "gallery" / "animations").glob("*.html")}
    pictured = {path.name.removesuffix("_scene.png") for path in (SITE / "_images").glob("*_scene.png")}
    assert len(scenes) > 8
    assert len(scenes & pictured) > 0.7 * len(scenes)


def test_formulas_are_on_the_page_about_the_theory(browser):
    browser.go(SITE / "theory.html")
    assert browser.evaluate(FORMULAS)["shown"] > 100


@pytest.mark.parametrize(
    ("words", "page"), [("synchronization", "theory.html"), ("load_robot", "reference/robots.html")]
)
def test_the_search_finds_pages_without_a_server(browser, words, page):
    browser.go(SITE / "search.html", f"?q={words}")
    browser.wait_for("/found/.test(document.querySelector('.search-summary')?.textContent)")
    found = browser.evaluate(
        "[...document.querySelectorAll('#search-results li a')].map(a => a.getAttribute('href'))"
    )
    assert page in {address.partition("#")[0].partition("?")[0] for address in found}
    assert (browser.requests, browser.errors) == ([], [])


def test_pages_are_not_wider_than_a_telephone(browser):
    screen = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    browser.call("Emulation.setDeviceMetricsOverride", **screen)
    wide = []
    for page in PAGES:
        if "_modules" not in page.parts and "tutorials" not in page.parts:
            browser.go(page)
            if browser.evaluate("document.documentElement.scrollWidth") > 390:
                wide.append(page.name)
    assert wide == []
