"""The page of a trial from end to end; CI makes the whole page, and looks at that one."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "scripts" / "reproduce.py"


def test_a_trial_of_the_page_is_made_and_says_that_it_is_one(tmp_path):
    command = [sys.executable, str(SCRIPT), "--quick", "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    page = tmp_path / "out" / "index.html"
    assert done.stdout.rstrip().endswith(str(page))
    assert "This page is a trial" in page.read_text("utf-8")


def test_the_command_makes_the_same_page_without_a_checkout(tmp_path):
    command = [
        sys.executable,
        "-m",
        "synctrl",
        "reproduce",
        "--quick",
        "--json",
        "--out",
        str(tmp_path / "out"),
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout)
    assert found["trial"] and Path(found["page"]).is_file() and len(found["claims"]) > 20
