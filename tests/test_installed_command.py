"""The command where only the wheel is, as pipx and uvx install it: nothing of the checkout is used."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from test_packaging import ROOT, build

from synctrl.cli.app import app


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> Path:
    """A folder with the wheel installed into it; libraries are those of this environment."""
    folder = tmp_path_factory.mktemp("installed")
    wheel = build(ROOT, "wheel", folder / "wheel")
    where = ("--target", str(folder / "site"), str(wheel))
    words = ("-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--no-compile", *where)
    subprocess.run([sys.executable, *words], check=True, capture_output=True, timeout=300)
    return folder


def said(installed: Path, *command: str) -> str:
    """What a command prints that comes to its end without an error, in a folder of its own."""
    env = {**os.environ, "PYTHONPATH": str(installed / "site"), "COLUMNS": "200"}
    here = {"cwd": installed, "env": env, "timeout": 300, "check": False}
    done = subprocess.run(command, capture_output=True, text=True, **here)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def synctrl(installed: Path, *words: str) -> str:
    """What the console script prints."""
    return said(installed, str(installed / "site" / "bin" / "synctrl"), *words)


def test_the_wheel_brings_the_command_with_all_that_it_does(installed):
    words = synctrl(installed, "--help")
    assert all(command.callback.__name__ in words for command in app.registered_commands)


def test_a_cell_is_begun_run_and_looked_at_where_only_the_wheel_is(installed):
    synctrl(installed, "new")
    words = ("run", "cell.toml", "--duration", "0.02", "--engine", "pinocchio", "--json", "-o", "out")
    found = json.loads(synctrl(installed, *words))
    assert found["status"] == "completed" and (installed / "out" / "index.html").is_file()


def test_the_doctor_finds_the_wheel_and_what_it_asks_for(installed):
    found = json.loads(synctrl(installed, "doctor", "--no-trial", "--json"))["findings"]
    by_name = {each["what"]: each for each in found}
    assert str(installed / "site") in by_name["synctrl"]["found"]
    assert by_name["libraries"]["state"] == by_name["robots"]["state"] == "ok"
    assert {"[compiled]", "[data]", "[tune]"} <= by_name.keys()  # out of the wheel's own description


def test_every_run_of_the_paper_can_be_made_where_only_the_wheel_is(installed):
    code = (
        "import synctrl\n"
        "from synctrl.paper.whole import everything\n"
        "print(len([run.make() for run in everything().values()]), synctrl.__file__)"
    )
    count, file = said(installed, sys.executable, "-c", code).split()
    assert int(count) > 20 and Path(file).is_relative_to(installed)
    assert "--quick" in synctrl(installed, "reproduce", "--help")
