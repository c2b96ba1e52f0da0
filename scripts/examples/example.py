"""What every example is told on the command line: the folder for its pictures, and whether to be short."""

from __future__ import annotations

import argparse
from pathlib import Path


def arguments(doc: str | None) -> tuple[Path, bool]:
    """The folder of `--out`, which is made, and whether `--short` was given; `doc` is shown by `--help`."""
    parser = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/gallery"), help="folder for what it writes")
    parser.add_argument("--short", action="store_true", help="a short run, to see that it works")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    return given.out, given.short
