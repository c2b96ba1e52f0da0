"""What a closed loop costs, in this version and against another one.

python scripts/benchmark.py [--quick] [--page docs/performance.md] [folder]
python scripts/benchmark.py --against [COMMIT] [--reproduce] [--quick] [--page docs/performance.md] [folder]

The first form compares both engines with a naive loop, bare Pinocchio calls, and other libraries. The second
compares the compiled engine of the working tree with that of another commit of the repository, by default of
version 0.1, and says which aims are reached. Both are on one machine and take turns. They write benchmark.md
and benchmark.json to the folder, by default out/benchmark or out/benchmark_against, and, unless it is quick,
the second writes its part of docs/performance.md; `--page` names another page or asks the first to write its
part.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: the matrices are small

from benchmark_comparison import compare, into_page
from benchmark_pair import REPOSITORY, VERSION_0_1, Unmeasured
from benchmark_report import Table, described, machine, markdown
from benchmark_tables import FULL, QUICK, measure

from synctrl.files import write_whole

PAGE = REPOSITORY / "docs" / "performance.md"


def main(options: argparse.Namespace) -> Path:
    """Measure, and write everything; returns the path of the report."""
    figures: dict[str, Any] = {}
    part, page = "against", options.page or (None if options.quick else PAGE)
    if options.against is None:
        part, page = "engines", options.page
    if page is not None:
        into_page(page, part, "")  # before much is measured for nothing
    if options.against is None:
        about, tables = machine(), measure(QUICK if options.quick else FULL)
    else:
        about, tables, found = compare(options.against, options.quick, options.reproduce)
        figures = {"figures": found.values, "missing": found.missing, "remarks": found.remarks}
    folder = options.folder or Path("out") / ("benchmark" if part == "engines" else "benchmark_against")
    return write(folder, page, part, about, tables, figures)


def write(
    folder: Path,
    page: Path | None,
    part: str,
    about: dict[str, str],
    tables: list[Table],
    more: dict[str, Any],
) -> Path:
    """Write the report into the folder, and into its part of a page if there is one."""
    content = {"machine": about, "tables": [table._asdict() for table in tables], **more}
    write_whole(folder / "benchmark.json", json.dumps(content, indent=1) + "\n")
    report = folder / "benchmark.md"
    write_whole(report, f"# Benchmark\n\n{described(about)}\n{markdown(tables)}")
    if page is not None:
        write_whole(page, into_page(page, part, f"{described(about)}\n{markdown(tables, '###')}"))
    return report


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small sizes and short measurements")
    parser.add_argument("--against", metavar="COMMIT", nargs="?", const=VERSION_0_1, help="another version")
    parser.add_argument(
        "--reproduce", action="store_true", help="with --against, the paper's experiments too"
    )
    parser.add_argument("--page", type=Path, help="a page with a part for the tables")
    parser.add_argument("folder", nargs="?", type=Path)
    try:
        sys.stdout.write(f"{main(parser.parse_args())}\n")
    except Unmeasured as reason:
        sys.exit(f"error: {reason}")
