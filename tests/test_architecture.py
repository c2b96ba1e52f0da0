"""The page about the house is true, and its examples run."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from pkgutil import resolve_name

import pytest
import test_imports
from test_trip import calls, trip

from synctrl import load_robot
from synctrl.errors import StepWarning
from synctrl.experiments import a460_pair, planar_four
from synctrl.robots.urdf import urdf_folder

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "architecture.md").read_text("utf-8")
PAGES = [
    *sorted(DOCS.glob("*.md")),
    *(DOCS.parent / f"{name}.md" for name in ("README", "CONTRIBUTING", "SECURITY")),
]
PICTURE = (DOCS / "architecture.svg").read_text("utf-8")


def test_the_examples_of_the_page_run_one_after_another():
    names: dict = {}
    blocks = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    assert len(blocks) >= 7
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)
        for number, block in enumerate(blocks, start=1):
            exec(compile(block, f"block {number} of docs/architecture.md", "exec"), names)


def test_the_way_to_a_torque_is_the_one_that_the_page_tells():
    told = re.findall(r"^\| \d+ \| `([\w.]+)` \|", PAGE, flags=re.MULTILINE)
    assert told == trip(planar_four())
    assert len(trip(a460_pair())) == 9  # "in joint space there are nine"


def test_the_way_of_a_file_to_a_robot_is_the_one_that_the_page_tells():
    told = re.findall(r"^\| `(\w+)` \| `(robots/urdf/\w+\.py)` \|", PAGE, flags=re.MULTILINE)
    names = [name for name, _ in told]
    called = calls(load_robot, urdf_folder() / "planar2r" / "planar2r.urdf")
    assert list(dict.fromkeys(name for name in called if name in names)) == names
    for name, file in told:
        assert f"\ndef {name}(" in (test_imports.PACKAGE / file).read_text("utf-8"), (name, file)


def test_the_page_has_every_module_that_reads_robots():
    modules = {path.name for path in (test_imports.PACKAGE / "robots" / "urdf").glob("[!_]*.py")}
    assert modules == set(re.findall(r"`robots/urdf/(\w+\.py)`", PAGE))


def test_the_picture_has_the_rooms_from_the_ground_up():
    words = re.findall(r'font-weight="bold"[^>]*>([^<]+)<', PICTURE)
    floors = [word.split(", ") for word in reversed(words) if "/" not in word]
    assert [room for floor in floors for room in floor] == list(test_imports.ROOMS)


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_the_way_that_imports_run_is_told_as_it_is(page):
    words = (DOCS.parent / page).read_text("utf-8")
    told = re.search(r"Imports run one way, from (.*?) to `cli`", words, re.DOTALL)
    rooms = test_imports.ROOMS[test_imports.ROOMS.index("robots") :]
    assert told is not None and (*re.findall(r"`(\w+)`", told[1]), "cli") == rooms


def test_the_page_names_every_room():
    rooms = set(re.findall(r"^\| `(\w+)`", PAGE, flags=re.MULTILINE))
    folders = {path.parent.name for path in test_imports.PACKAGE.glob("*/__init__.py")}
    assert folders <= rooms


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_file_and_every_part_of_the_package_that_a_page_names_is_there(page):
    text = page.read_text("utf-8")
    for name in re.findall(r"`((?:\w+/)+\w+\.py)`", text):
        assert (test_imports.PACKAGE / name).is_file() or (DOCS.parent / name).is_file(), name
    for name in re.findall(r"`(synctrl(?:\.\w+)+)", text):
        resolve_name(name)
