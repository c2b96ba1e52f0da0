"""The documents have a section for each law and each adaptation, with what the code says of itself."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import pytest

from synctrl.control import adaptation, laws

DOCS = Path(__file__).resolve().parent.parent / "docs"
LAWS = (DOCS / "laws.md").read_text("utf-8")
ADAPTATION = (DOCS / "adaptation.md").read_text("utf-8")
#: what an adaptation of one's own has to do with, and nothing to choose
PROTOCOLS = {"Adaptation", "BoundAdaptation", "Seen"}
CLASSES = [name for name in laws.__all__ if hasattr(getattr(laws, name), "statement")]
RULES = [name for name in adaptation.__all__ if name not in PROTOCOLS and name[0].isupper()]


def section(page: str, name: str) -> str:
    """The words under a heading."""
    return re.split(r"^#+ ", page.split(f"### {name}\n", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]


@pytest.mark.parametrize("name", CLASSES)
def test_every_law_has_a_section_with_its_statement_and_what_it_does_badly(name: str) -> None:
    words = section(LAWS, name)
    assert f"> {getattr(laws, name).statement}\n" in words
    assert "badly" in words


def test_every_adaptation_is_explained() -> None:
    assert {"Gradient", "Leakage", "Box", "Ball", "Natural"} <= set(RULES)
    for name in RULES:
        assert f"`{name}`" in ADAPTATION or f"### {name}\n" in ADAPTATION, name
    for name in re.findall(r"^### (.*)", ADAPTATION, flags=re.MULTILINE):
        assert "badly" in section(ADAPTATION, name), name


@pytest.mark.parametrize("page", [LAWS, ADAPTATION])
def test_the_first_example_of_a_page_runs(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    code = re.search(r"(?:^    .*\n|^\n)+", page[page.index("    from synctrl") :], re.MULTILINE)
    assert code is not None
    lines = "\n".join(line[4:] for line in code[0].splitlines())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the step, beside friction at rest
        exec(re.sub(r"duration=3.0|simulate\(1.0\)", _shorter, lines), {})
    assert capsys.readouterr().out


def _shorter(found: re.Match[str]) -> str:
    return "duration=0.01" if "duration" in found[0] else "simulate(0.01)"
