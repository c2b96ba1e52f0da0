"""Build the documentation.

python scripts/build_docs.py [folder]

The site is written to the folder, by default out/docs: open index.html in any browser, no server is needed.
What it is made from is put together beside it, in a folder with `-work` at the end of its name: pages,
notebooks that were executed, pictures of the gallery, and MathJax, which npm fetches. What is there already,
and has not changed, is taken again.
"""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from docs_site import reference
from docs_site.mathjax import fetch
from docs_site.notebooks import executed
from docs_site.stage import keep, places, stage, sweep

ROOT = Path(__file__).resolve().parents[1]


def gather(work: Path) -> Path:
    """Put the source of the site together, and give its folder."""
    source = work / "source"
    notebooks = {
        ROOT / origin: source / place for origin, place in places(ROOT).items() if origin.endswith(".ipynb")
    }
    with ThreadPoolExecutor(2) as pool:
        formulas = pool.submit(fetch, work / "npm", source / "_static" / "mathjax")
        runs = [pool.submit(executed, path, place, work / "executed") for path, place in notebooks.items()]
        names = reference.public_names(reference.example_sources(ROOT))
        pages = reference.pages(names)
        for page, text in pages.items():
            keep(source / page, text.encode())
        keep(source / "_static" / "site.css", (ROOT / "docs" / "site.css").read_bytes())
        written = stage(ROOT, source, pages, reference.sources(names))
        kept = [
            *written,
            *(source / page for page in pages),
            *notebooks.values(),
            source / "_static" / "site.css",
        ]
        kept += formulas.result()
        for run in runs:
            run.result()
    sweep(source, kept)
    return source


def build(folder: Path) -> int:
    """Build the site, and give what Sphinx ends with: 0 where it had nothing to complain of."""
    work = folder.with_name(f"{folder.name}-work")
    source = gather(work)
    options = ["-W", "--keep-going", "-q", "-j", "2", "-b", "html", "-c", str(ROOT / "docs")]
    command = [
        sys.executable,
        "-m",
        "sphinx",
        *options,
        "-d",
        str(work / "doctrees"),
        str(source),
        str(folder),
    ]
    return subprocess.run(command).returncode


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "out" / "docs"
    code = build(target.resolve())
    print(f"{target / 'index.html'} is written." if code == 0 else "The site has faults, see above.")
    sys.exit(code)
