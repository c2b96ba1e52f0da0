"""docs/command_line.md is true: its commands run, its options and codes are those that there are."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from synctrl.cli import codes
from synctrl.cli.app import app

PAGE = (Path(__file__).parents[1] / "docs" / "command_line.md").read_text("utf-8")
COMMANDS = typer.main.get_command(app).commands


def console_lines() -> list[list[str]]:
    blocks = re.findall(r"```console\n(.*?)```", PAGE, flags=re.DOTALL)
    return [shlex.split(line) for block in blocks for line in block.splitlines()]


def test_every_line_of_the_page_runs_one_after_another(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = console_lines()
    assert {line[1] for line in lines} >= {*COMMANDS} - {"reproduce"}
    for line in lines:
        done = CliRunner().invoke(app, line[1:])
        assert done.exit_code == 0, (line, done.output, done.exception)
    assert (tmp_path / "out" / "first" / "index.html").is_file()


def test_the_page_has_every_command_and_no_other():
    section = PAGE.partition("## Commands")[2].partition("\n## ")[0]
    assert re.findall(r"^\| `(\w+)[^`]*` \|", section, flags=re.MULTILINE) == [*COMMANDS]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_says_what_it_is_for(name):
    command = COMMANDS[name]
    assert command.help
    assert all(getattr(each, "help", None) for each in command.params if each.name != "help")


def test_every_option_that_the_page_names_is_one():
    known = {
        word
        for command in COMMANDS.values()
        for each in command.params
        for word in (*each.opts, *each.secondary_opts)
    }
    known |= {"--help", "--install-completion", "--spec", "--from"}  # the last two are of pipx and uvx
    assert {*re.findall(r"(?<![\w-])--[a-z][\w-]*", PAGE)} <= known


def test_the_page_has_all_codes():
    told = {int(code) for code in re.findall(r"^\| (\d+) \|", PAGE, flags=re.MULTILINE)}
    assert told == {value for name, value in vars(codes).items() if name.isupper()}
