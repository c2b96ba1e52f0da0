"""The gallery: pages that `scripts/gallery.py` writes, with a picture of every example."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from docs_site.stage import ROOT, digest, keep

SCRIPT = ROOT / "scripts" / "gallery.py"
#: files that the site has as they are
ANIMATIONS = Path("gallery", "animations")


def gallery(source: Path, extra: Path, cache: Path, short: bool) -> list[Path]:
    """Run all examples, unless they were with this code, and put their pages into the source.

    Args:
        source: folder of the source of the site.
        extra: folder of files that the site has as they are.
        cache: folder for what the examples write.
        short: whether they run for a moment only.

    Returns:
        What is in the two folders now; nothing where the repository has no examples.

    Raises:
        SystemExit: an example failed.
    """
    if not SCRIPT.is_file():
        return []
    made = cache / digest([SCRIPT, *sorted((ROOT / "scripts" / "examples").glob("*.py"))], str(short))
    if not made.is_dir():
        shutil.rmtree(cache, ignore_errors=True)
        _run(made, ["--short"] if short else [])
    written = []
    for file in sorted(path for path in made.rglob("*") if path.is_file()):
        name = file.relative_to(made)
        place = (extra if name.is_relative_to(ANIMATIONS) else source) / name
        keep(place, file.read_bytes())
        written.append(place)
    return written


def _run(folder: Path, options: list[str]) -> None:
    part = folder.with_name("part")
    command = [sys.executable, str(SCRIPT), "--out", str(part), "--workers", "1", *options]
    done = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True
    )
    if done.returncode:
        raise SystemExit(f"The gallery failed:\n{done.stdout}{done.stderr}")
    print(done.stderr, end="", file=sys.stderr)  # scenes of which there is no picture
    part.rename(folder)
