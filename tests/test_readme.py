"""What README shows works as it stands there."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image, ImageChops

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")
CELL, TIPS, LOOP = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


def run(code: str, folder: Path) -> str:
    """What a script prints that warns of nothing."""
    script = folder / "script.py"
    script.write_text(code, encoding="utf-8")
    (folder / "robots").symlink_to(ROOT / "robots")  # the script's paths start where README lies
    command = [sys.executable, "-W", "error::UserWarning", str(script)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def test_the_cell_of_ones_own_runs_and_synchronizes(tmp_path):
    assert CELL.count("\n") < 30
    together, alone = map(float, re.findall(r"([\d.e-]+) rad", run(CELL, tmp_path)))
    assert together < alone


def test_the_cell_of_arms_of_different_kinds_runs_and_is_certified(tmp_path):
    assert TIPS.count("\n") < 30
    assert run(TIPS, tmp_path).startswith("cell: covered by the theorem\n")


def test_the_loop_of_ones_own_runs_in_mujoco_and_synchronizes(tmp_path):
    pytest.importorskip("mujoco", reason="MuJoCo is an extra: pip install 'synctrl[mujoco]'")
    assert LOOP.count("\n") < 30
    assert float(run(LOOP, tmp_path).split()[-1]) < 1e-3


def test_every_file_that_the_documents_link_to_exists():
    for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]:
        for link in re.findall(r"\]\((?!https?:)([^)#]+)", path.read_text("utf-8")):
            assert (path.parent / link).exists(), f"{path.name}: {link}"


def test_the_commands_that_readme_names_exist():
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for target in set(re.findall(r"^ {4}make (\w+)", README, flags=re.MULTILINE)):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target


def test_the_picture_in_motion_moves_and_is_small():
    (name,) = re.findall(r"\]\((\S+\.gif)\)", README)
    with Image.open(ROOT / name) as picture:
        assert picture.n_frames > 20
        first = picture.convert("RGB")
        picture.seek(picture.n_frames // 2)
        assert ImageChops.difference(first, picture.convert("RGB")).getbbox()
    assert (ROOT / name).stat().st_size < 2e6
