"""The house stays one in which people find their way: small files, small functions."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from synctrl import errors

PACKAGE = Path(__file__).parents[1] / "synctrl"
FILES = sorted(PACKAGE.rglob("*.py"))
TESTS = sorted(Path(__file__).parent.rglob("*.py"))
#: kinds whose data a test can read
KINDS = {
    name
    for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, errors.Portable)
}
LONGEST_FILE, LONGEST_FUNCTION = 300, 40


def too_long(source: str) -> list[str]:
    """What of a module is too long, each with its number of lines; docstrings count."""
    lines = len(source.splitlines())
    found = [f"the file: {lines} lines"] if lines > LONGEST_FILE else []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            lines = int(node.end_lineno or 0) - node.lineno + 1
            found += [f"{node.name}: {lines} lines"] if lines > LONGEST_FUNCTION else []
    return found


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(PACKAGE).as_posix())
def test_no_file_and_no_function_is_too_long(file):
    assert not too_long(file.read_text("utf-8"))


def test_the_check_finds_what_is_too_long():
    body = ["    pass"] * LONGEST_FUNCTION
    assert not too_long("\n".join(["def f():", *body[1:]]))
    assert too_long("\n".join(["def f():", *body])) == [f"f: {LONGEST_FUNCTION + 1} lines"]
    method = "\n    ".join(["class C:", "async def f(self):", *body])
    assert too_long(method) == [f"f: {LONGEST_FUNCTION + 1} lines"]
    assert too_long("x = 1\n" * (LONGEST_FILE + 1)) == [f"the file: {LONGEST_FILE + 1} lines"]


def by_their_words(source: str) -> list[int]:
    """Lines of a test that expect of an error of ours how it says what is wrong."""
    calls = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call))
    return [
        call.lineno
        for call in calls
        if ast.unparse(call.func) == "pytest.raises"
        and any(word.arg == "match" for word in call.keywords)
        and not {node.id for node in ast.walk(call.args[0]) if isinstance(node, ast.Name)}.isdisjoint(KINDS)
    ]


@pytest.mark.parametrize("file", TESTS, ids=lambda file: file.stem)
def test_no_test_knows_a_refusal_by_its_words(file):
    assert not by_their_words(file.read_text("utf-8"))


def test_the_check_finds_a_refusal_that_is_known_by_its_words():
    lines = [
        "pytest.raises(InputError)",
        "pytest.raises(InputError, match='above')",
        "pytest.raises((OSError, RobotError), match='above')",
        "pytest.raises(ValueError, match='read-only')",
    ]
    assert by_their_words("\n".join(lines)) == [2, 3]
