"""MathJax for the site, in the version and with the digest that package-lock.json beside this file has."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

from docs_site.stage import keep

HERE = Path(__file__).parent
#: of the package: everything in one file, which draws formulas with no font
FILES = {"es5/tex-svg-full.js": "tex-svg-full.js", "LICENSE": "LICENSE"}


def fetch(work: Path, place: Path) -> list[Path]:
    """Files of MathJax, at a place of the site.

    Args:
        work: folder for npm; what is there in the right version is taken again.
        place: folder of the site for them.

    Raises:
        SystemExit: there is no npm, or it cannot fetch.
    """
    package = work / "node_modules" / "mathjax"
    wanted = json.loads((HERE / "package-lock.json").read_text("utf-8"))["packages"]["node_modules/mathjax"]
    stamp = work / "integrity"
    if not stamp.is_file() or stamp.read_text("utf-8") != wanted["integrity"]:
        _install(work)
        stamp.write_text(wanted["integrity"], "utf-8")
    for name, target in FILES.items():
        keep(place / target, (package / name).read_bytes())
    return [place / target for target in FILES.values()]


def _install(work: Path) -> None:
    if shutil.which("npm") is None:
        raise SystemExit("The documentation needs npm, for MathJax (on Debian: apt-get install npm).")
    for name in ("package.json", "package-lock.json"):
        keep(work / name, (HERE / name).read_bytes())
    command = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"]
    if subprocess.run(command, cwd=work).returncode:
        raise SystemExit("npm could not fetch MathJax, see above.")
