"""Every statement of docs/theory.md names a test, and every test that a document names exists."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
PAGES = {path.name: path.read_text("utf-8") for path in sorted((TESTS.parent / "docs").glob("*.md"))}
PAGE = PAGES["theory.md"]
FILES = {path.name: path.read_text("utf-8") for path in sorted(TESTS.glob("test_*.py"))}
#: sections without statements of their own
PLAIN = {"", "Where the equations are", "References"}
#: where a statement begins, beside headings and paragraphs that begin with bold words: items of a list
ITEM = r"(?m)^(?=#+ |\d+\. |- |\*\*)"


def statements() -> dict[str, str]:
    """Every statement of the page by its first words."""
    found, section = {}, ""
    for block in re.split(ITEM, PAGE):
        if block.startswith("#"):
            section = block.splitlines()[0].lstrip("# ")
        bare = block.startswith("#") and len(block.strip().splitlines()) == 1
        assumed = section == "The theorem" and re.match(r"\d|#", block)  # each has a row in the table
        if section not in PLAIN and not bare and not assumed and not block.startswith("# "):
            found[f"{section}: {' '.join(block.split()[:5])}"] = block
    return found


def named(block: str) -> list[tuple[str, str]]:
    """Tests named in brackets, each with its file: that which was named last, or that of the errata."""
    found = []
    for bracket in re.findall(r"\[([^\[\]]*`test_[^\[\]]*)\](?!\()", block):
        file = "test_errata.py"
        for name in re.findall(r"`(test_\w+(?:\.py)?(?:\.\.\.)?)`", bracket):
            file = name if name.endswith(".py") else file
            found.append((file, "" if name.endswith(".py") else name))
    return found


DEFINED = {file: re.findall(r"(?m)^def (test_\w+)\(", source) for file, source in FILES.items()}
ALL = {name for names in DEFINED.values() for name in names}


def among(name: str, tests: Iterable[str]) -> bool:
    """Whether one of the tests has that name, or begins like a name that ends in dots."""
    begin = name.removesuffix("...")
    return begin in tests or (begin != name and any(test.startswith(begin) for test in tests))


STATEMENTS = statements()


@pytest.mark.parametrize("statement", STATEMENTS)
def test_every_statement_of_the_page_names_a_test(statement: str) -> None:
    assert named(STATEMENTS[statement]), statement


def test_every_assumption_of_the_theorem_has_a_row_that_says_where_it_is_checked() -> None:
    theorem = PAGE.split("## The theorem")[1].split("\n## ")[0]
    assumptions = re.findall(r"(?m)^(\d+)\. \*\*(\w+)", theorem)
    rows = re.findall(r"(?m)^\| (\d+) \| (.*?)\|(.*)", theorem)
    assert [number for number, _ in assumptions] == [number for number, *_ in rows]
    assert len(rows) > 5
    assert all(named(where) for *_, where in rows)


def test_every_test_that_the_page_names_exists_in_its_file() -> None:
    assert not [(file, name) for file, name in named(PAGE) if name and not among(name, DEFINED[file])]


@pytest.mark.parametrize("page", PAGES)
def test_every_test_that_a_page_names_exists(page: str) -> None:
    tests = named(PAGES[page])
    assert not [name for _, name in tests if name and not among(name, ALL)]
    assert not [file for file, name in tests if not name and file not in FILES]


def test_every_citation_has_a_reference_and_every_reference_is_cited() -> None:
    body, references = PAGE.split("## References")
    cited = {*re.findall(r"([A-Z]\w+)(?:\]\S*)?\s+\(((?:19|20)\d\d)\)", body)}
    entries = [" ".join(entry.split()) for entry in references.split("\n- ")[1:]]
    found = {(name, year) for name, year in cited for entry in entries if name in entry and year in entry}
    assert found == cited
    assert all(any(name in entry and year in entry for name, year in cited) for entry in entries)


def test_the_checks_find_what_is_missing() -> None:
    block = "1. Words. [`test_01_...`; `test_leak.py`: `test_a`]"
    begun = ("test_errata.py", "test_01_...")
    assert named(block) == [begun, ("test_leak.py", ""), ("test_leak.py", "test_a")]
    assert not named("1. Words of `test_01_...`, see [there](there.md).")
    tests = ["test_01_a", "test_02"]
    assert among("test_01_...", tests) and among("test_02", tests)
    assert not among("test_01", tests) and not among("test_03_...", tests)


def test_every_file_in_which_the_page_says_that_an_equation_is_exists() -> None:
    table = PAGE.split("## Where the equations are")[1].split("\n## ")[0]
    places = set(re.findall(r"`([\w/]+\.py)`", table))
    assert len(places) > 10
    assert not [place for place in places if not (TESTS.parent / "synctrl" / place).exists()]
