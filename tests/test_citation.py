"""The citation says what the package says of itself."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

yaml = pytest.importorskip("yaml", reason="PyYAML is an extra: pip install 'synctrl[xacro]'")

ROOT = Path(__file__).resolve().parents[1]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def test_it_has_what_the_format_asks_for():
    assert {"cff-version", "message", "title", "authors"} <= set(CITATION)
    assert CITATION["cff-version"] == "1.2.0" and CITATION["type"] == "software"


def test_it_agrees_with_the_package():
    assert [author["name"] for author in CITATION["authors"]] == [
        author["name"] for author in PROJECT["authors"]
    ]
    assert CITATION["version"] == PROJECT["version"]
    assert CITATION["license"] == PROJECT["license"]


def test_it_names_the_paper_as_the_theory_page_does():
    (paper,) = CITATION["references"]
    page = " ".join((ROOT / "docs" / "theory.md").read_text("utf-8").split())
    authors = " and ".join(f"{author['given-names']} {author['family-names']}" for author in paper["authors"])
    pages = f"{paper['volume']}({paper['issue']}), {paper['start']}–{paper['end']}, {paper['year']}"
    name = paper["authors"][1]["given-names"]
    assert name in authors and pages in page
    assert f'- D. Sun and {name} Mills, "{paper["title"]}", *{paper["journal"]}*' in page
