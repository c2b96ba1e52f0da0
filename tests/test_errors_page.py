"""The page about errors has every kind, what it derives from, and examples that end as it says."""

from __future__ import annotations

import re
import warnings
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import pytest

import synctrl
from synctrl.errors import Portable, SynctrlError

PAGE = (Path(__file__).parents[1] / "docs" / "errors.md").read_text("utf-8")
SECTIONS = dict(re.findall(r"(?ms)^### (\w+)\n(.*?)(?=^##|\Z)", PAGE))
EXAMPLES = {
    name: re.search(r"```python\n(.*?)```\n\n```text\n(.*?)\n```", words, re.DOTALL)
    for name, words in SECTIONS.items()
    if "```python" in words
}


def kinds() -> dict[str, type]:
    """Kinds of errors and warnings that a user can meet, by name."""
    rooms = [synctrl.errors]
    for found in walk_packages(synctrl.__path__, "synctrl."):
        if found.ispkg:
            rooms.append(import_module(found.name))
    public = {name: thing for room in rooms for name, thing in vars(room).items() if isinstance(thing, type)}
    ours = {name: kind for name, kind in public.items() if kind.__module__.startswith("synctrl.")}
    bases = (SynctrlError, Warning, KeyboardInterrupt)
    return {name: kind for name, kind in ours.items() if issubclass(kind, bases) and kind is not SynctrlError}


KINDS = kinds()


def test_the_page_has_every_kind_and_no_other():
    assert len(KINDS) > 20
    assert set(SECTIONS) == set(KINDS)


@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if not issubclass(kind, Warning)])
def test_a_section_says_what_its_kind_derives_from(name):
    (told,) = re.findall(r"(?m)^\*A kind of (.*)\.\*$", SECTIONS[name])
    assert re.findall(r"`(\w+)`", told) == [
        base.__name__ for base in KINDS[name].__bases__ if base is not Portable
    ]


@pytest.mark.parametrize("name", SECTIONS)
def test_a_section_has_a_way_out(name):
    assert "**Way out.** " in SECTIONS[name]


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_ends_with_the_error_that_stands_below_it(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, said = EXAMPLES[name].groups()
    with pytest.raises(KINDS[name]) as caught, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        exec(compile(code, f"example of {name}", "exec"), {})
    assert type(caught.value) is KINDS[name]
    begin = said.removesuffix("...")
    message = f"{name}: {caught.value}"
    assert message == said or (begin != said and message.startswith(begin.rstrip()))


def test_what_the_first_example_prints_stands_below_it(capsys):
    code, said = re.search(r"```python\n(.*?)```\n\n```text\n(.*?)```", PAGE, re.DOTALL).groups()
    exec(code, {})
    assert capsys.readouterr().out == said


def test_the_table_has_the_data_of_every_error():
    data = re.findall(r"`(\w+)`", " ".join(re.findall(r"(?m)^\| (`.*?) \|", PAGE)))
    assert data == ["subject", "found", "file", "line", "result", "problem"]
    assert all(hasattr(SynctrlError("wrong"), name) for name in data)
