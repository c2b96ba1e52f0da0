"""The page of a trial from end to end; CI makes the whole page, and looks at that one."""

from __future__ import annotations

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
