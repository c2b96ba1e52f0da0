"""Every experiment of the paper: runs, figures, metrics, claims, animations, and the page that shows them.

python scripts/reproduce.py [--out out] [--workers 2] [--quick]

Where the package is installed, `synctrl reproduce` does the same.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from synctrl.errors import SynctrlError
from synctrl.paper.whole import everything, longest_comparison, reproduce


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for everything that is written")
    parser.add_argument("--workers", type=count, default=2, help="number of processes")
    parser.add_argument("--quick", action="store_true", help="no more than a second of every run, as a trial")
    options = parser.parse_args()
    planned, limit = everything(options.quick), longest_comparison(options.quick)
    try:
        page = reproduce(options.out, options.workers, planned, limit)
    except SynctrlError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"\ninterrupted; runs that were complete are in {options.out / 'runs'}", file=sys.stderr)
        return 130
    print(f"\nOpen {page}")
    return 0


def count(text: str) -> int:
    """A number of processes."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a number of at least 1, found {text!r}")
    return int(text)


if __name__ == "__main__":
    sys.exit(main())
