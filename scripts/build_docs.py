"""Build the documentation.

python scripts/build_docs.py [--short] [folder]

The site is written to the folder, by default out/docs: open index.html in any browser, no server is needed.
What it is made from is put together beside it, in a folder with `-work` at the end of its name: pages,
notebooks that were executed, pictures of the gallery, and MathJax, which npm fetches. What is there already,
and has not changed, is taken again. With `--short` the examples of the gallery run for a moment only.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from docs_site import reference
from docs_site.gallery import SCRIPT, gallery
from docs_site.links import relinked
from docs_site.mathjax import fetch
from docs_site.notebooks import executed
from docs_site.stage import ROOT, keep, places, stage, sweep

#: notebooks, and the gallery, that are run at a time
WORKERS = 2
OPTIONS = ["-W", "--keep-going", "-q", "-j", str(WORKERS), "-b", "html"]


def gather(work: Path, short: bool) -> Path:
    """Put the source of the site together, and give its folder."""
    source, extra = work / "source", work / "extra"
    where, names = places(ROOT), reference.public_names(reference.example_sources(ROOT))

    def shown(path: str) -> Path:
        words = partial(relinked, page=path, places=where, sources=reference.sources(names))
        return executed(ROOT / path, source / where[path], work / "executed", words)

    extra.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(WORKERS) as pool:
        formulas = pool.submit(fetch, work / "npm", source / "_static" / "mathjax")
        pictures = pool.submit(gallery, source, extra, work / "gallery", short)
        runs = [pool.submit(shown, path) for path in where if path.endswith(".ipynb")]
        kept = [
            *written(source, names),
            *formulas.result(),
            *pictures.result(),
            *(run.result() for run in runs),
        ]
    sweep(source, kept)
    sweep(extra, kept)
    return source


def written(source: Path, names: list[reference.Public]) -> list[Path]:
    """Write what is made of files of the repository alone: pages, the reference, the looks."""
    pages = reference.pages(names)
    made = {source / page: text.encode() for page, text in pages.items()}
    made[source / "_static" / "site.css"] = (ROOT / "docs" / "site.css").read_bytes()
    for file, content in made.items():
        keep(file, content)
    others = [*pages, "gallery.md"] if SCRIPT.is_file() else [*pages]
    return [*made, *stage(ROOT, source, others, reference.sources(names))]


def stale(folder: Path, source: Path, extra: Path) -> list[Path]:
    """Pages of the site that it had, and whose source is gone."""
    found = []
    for page in folder.rglob("*.html"):
        name = page.relative_to(folder)
        sources = [source / name.with_suffix(kind) for kind in (".md", ".rst", ".ipynb")]
        own = name.parts[0].startswith("_") or str(name) in ("search.html", "genindex.html")
        if not own and not any(path.is_file() for path in [*sources, extra / name]):
            found.append(page)
    return found


def build(folder: Path, short: bool = False) -> int:
    """Build the site, and give what Sphinx ends with: 0 where it had nothing to complain of."""
    work = folder.with_name(f"{folder.name}-work")
    source = gather(work, short)
    if not (folder / "searchindex.js").is_file():
        shutil.rmtree(work / "doctrees", ignore_errors=True)  # a build that did not end: begin anew
    for page in stale(folder, source, work / "extra"):
        page.unlink()
    places = ["-c", str(ROOT / "docs"), "-d", str(work / "doctrees"), str(source), str(folder)]
    return subprocess.run([sys.executable, "-m", "sphinx", *OPTIONS, *places]).returncode


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "out" / "docs")
    parser.add_argument(
        "--short", action="store_true", help="run the examples of the gallery for a moment only"
    )
    given = parser.parse_args()
    code = build(given.folder.resolve(), given.short)
    print("The site has faults, see above." if code else f"{given.folder / 'index.html'} is written.")
    return code


if __name__ == "__main__":
    sys.exit(main())
