"""What is installed elsewhere is complete: the built package finds its robots without this folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
ROBOTS = ROOT / "robots"


def files(folder: Path) -> dict[str, bytes]:
    """Name and content of every file in a folder."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def run(*arguments: str, cwd: Path, **environment: str) -> str:
    """Output of this Python, which must succeed."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def build(source: Path, kind: str, folder: Path) -> Path:
    """Build a "wheel" or an "sdist" of the project in `source`."""
    run("-m", "hatchling", "build", "--target", kind, "--directory", str(folder), cwd=source)
    (built,) = folder.iterdir()
    return built


def source_of_wheel(origin: str, folder: Path) -> Path:
    """The work tree, or what the source distribution made from it unpacks to."""
    if origin == "work tree":
        return ROOT
    shutil.unpack_archive(build(ROOT, "sdist", folder / "sdist"), folder)
    (source,) = folder.glob("synctrl-*")
    return source


@pytest.mark.parametrize("origin", ["work tree", "source distribution"])
def test_a_wheel_carries_the_robots_and_finds_them(origin: str, tmp_path: Path) -> None:
    wheel = build(source_of_wheel(origin, tmp_path), "wheel", tmp_path / "wheel")
    installed = tmp_path / "installed"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(installed)
    carried = installed / "synctrl" / "_urdf"
    assert files(carried) == files(ROBOTS)
    code = (
        "import synctrl; print(synctrl.__file__); synctrl.load_robot('a460'); synctrl.load_robot('planar2r')"
    )
    found = run("-c", code, cwd=tmp_path, PYTHONPATH=str(installed))
    assert Path(found.strip()).is_relative_to(installed)
