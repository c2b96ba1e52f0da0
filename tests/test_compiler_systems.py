"""What other systems lack is not needed: on this one it is hidden, in a process of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest
from test_cache import script

from synctrl.compiled.compiler import compiler

#: takes away what Windows does not have; before, Python loads what it has for each system on its own
HIDDEN = """
import concurrent.futures.process, ctypes, multiprocessing.connection, multiprocessing.popen_spawn_posix
import asyncio, os, shutil, subprocess, sys, tempfile
import matplotlib.pyplot, numpy, pinocchio, rich.console, scipy.optimize, trimesh, typer

for name in ("fcntl", "grp", "pwd", "resource", "termios"):
    sys.modules[name] = None
for name in (
    *("fork", "geteuid", "getuid", "getpgid", "killpg", "mkfifo", "setsid", "statvfs", "sysconf"),
    *("sysconf_names", "O_CLOEXEC", "O_NOFOLLOW", "O_NONBLOCK", "O_DIRECTORY"),
):
    delattr(os, name)
sys.platform = "win32"
"""

IMPORTS = """
import importlib, pkgutil
import synctrl

names = [module.name for module in pkgutil.walk_packages(synctrl.__path__, "synctrl.")]
for name in names:
    importlib.import_module(name)
print(len(names))
"""

LIBRARY = """
from pathlib import Path
from synctrl.compiled import build

def fetch():
    source = "int answer(void) { return 42; }"
    return build.cached_library("key", lambda: iter([source]), lambda library: None).answer()

print(fetch())
build._CHECKED.clear()
build.compile_library = None
print(fetch())
"""


@pytest.fixture
def elsewhere(tmp_path):
    """Runs a text without what other systems lack; its home is empty at first."""
    home = tmp_path / "home"
    home.mkdir()

    def run(text: str, **environment: str) -> subprocess.CompletedProcess:
        words = {"HOME": str(home), "MPLCONFIGDIR": str(tmp_path), "TMPDIR": str(tmp_path)}
        words["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
        inherited = {word: os.environ[word] for word in os.environ if word != "SYNCTRL_CACHE"}
        return subprocess.run(
            [sys.executable, "-c", HIDDEN + text],
            env={**inherited, **words, **environment},
            capture_output=True,
            text=True,
            timeout=300,
        )

    return run


def test_every_module_is_imported(elsewhere):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    done = elsewhere(IMPORTS)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 100


def test_a_library_is_built_kept_and_found_in_the_home(elsewhere, tmp_path):
    program, *words = compiler()
    done = elsewhere(LIBRARY, CC=" ".join([str(shutil.which(program)), *words]))
    assert done.stdout.split() == ["42", "42"], done.stderr
    cache = tmp_path / "home" / "AppData" / "Local" / "synctrl"
    assert sorted(path.name for path in cache.iterdir()) == ["key.dll", "key.sha256"]


@pytest.mark.parametrize("way", ["a folder", "a link in the home"])
def test_outside_the_home_nothing_is_run_where_files_do_not_say_whose_they_are(elsewhere, tmp_path, way):
    named = tmp_path / "outside"
    named.mkdir(mode=0o700)
    if way != "a folder":
        (tmp_path / "home" / "link").symlink_to(named)
        named = tmp_path / "home" / "link"
    done = elsewhere(LIBRARY, SYNCTRL_CACHE=str(named))
    assert done.returncode != 0
    assert f"CompilationError: the cache of compiled code: '{named}' is not in your home" in done.stderr
    assert not list((tmp_path / "outside").iterdir())


@pytest.mark.parametrize("kind", ["hangs", "refuses"])
def test_a_compiler_is_followed_where_there_are_no_groups_of_processes(elsewhere, tmp_path, kind):
    body = {"hangs": "exec sleep 1000", "refuses": "echo no such flag; exit 3"}[kind]
    path = script(tmp_path / "compiler", f'#!/bin/sh\ncase "$*" in *" -E "*) exit;; esac\n{body}\n')
    short = "from synctrl.compiled import compiler\ncompiler.LONGEST = 0.5\n"
    done = elsewhere(short + LIBRARY, CC=str(path))
    said = {
        "hangs": "did not end within 0.5 s and was stopped",
        "refuses": "refused generated code:\nno such flag",
    }
    assert f"CompilationError: C compiler: '{path}' {said[kind]}" in done.stderr
    assert not list((tmp_path / "home").rglob("*.dll"))


def test_what_is_hidden_is_hidden(elsewhere):
    """Without this the tests above would show nothing."""
    assert "ModuleNotFoundError" in elsewhere("import pwd").stderr
    assert "AttributeError" in elsewhere("os.geteuid()").stderr
    assert elsewhere("print(sys.platform)").stdout == "win32\n"
