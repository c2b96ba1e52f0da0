"""The source of the site: pages of the repository, each at its place, and pages that are made of the code."""

from __future__ import annotations

import hashlib
import posixpath
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

from docs_site.links import contents, relinked, with_toctrees

ROOT = Path(__file__).resolve().parents[2]
#: pages from the top of the repository, and the folder of the site for them
TOP, PROJECT = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md"), "project"
PICTURES = {".png", ".svg", ".gif", ".webp", ".jpg"}
#: sections of the index for pages that it does not name, by the folder in which they are; else the last
SECTIONS = {"start": "Start", "tutorials": "Tutorials", "howto": "How-to", "reference": "Reference"}
ALONE = {"gallery.md": "Gallery"}
ELSE = "Explanation"


def places(root: Path) -> dict[str, str]:
    """Of every file of the repository that is on the site its path there; paths with slashes."""
    found = {name: f"{PROJECT}/{name.lower()}" for name in TOP if (root / name).is_file()}
    for path in sorted((root / "docs").rglob("*")):
        if path.suffix in {".md", *PICTURES}:
            found[path.relative_to(root).as_posix()] = path.relative_to(root / "docs").as_posix()
    for path in sorted((root / "notebooks").glob("*.ipynb")):
        found[path.relative_to(root).as_posix()] = f"tutorials/{path.name}"
    return found


def stage(root: Path, source: Path, made: Iterable[str], sources: Mapping[str, str]) -> list[Path]:
    """Write pages and pictures of the repository to the source of the site; notebooks are left to others.

    Args:
        root: the repository.
        source: folder of the source; files there that are the same already are left alone.
        made: pages, as paths in the source, that others write, also in the place of one of the repository.
        sources: of every module whose source the site shows, its path there.

    Returns:
        What was written or is there already.
    """
    where = places(root)
    written = []
    for origin, place in where.items():
        file = source / place
        if origin.endswith(".ipynb") or place in made:
            continue
        if origin.endswith(".md"):
            text = relinked((root / origin).read_text("utf-8"), origin, where, sources)
            if place == "index.md":
                text = with_toctrees(text, unnamed(text, [*where.values(), *made]))
            keep(file, text.encode())
        else:
            keep(file, (root / origin).read_bytes())
        written.append(file)
    return written


def unnamed(index: str, pages: Iterable[str]) -> dict[str, list[str]]:
    """By section of the index, the pages that it does not name."""
    named = {path for links in contents(index).values() for _, path in links} | {"index.md"}
    found: dict[str, list[str]] = {}
    for page in dict.fromkeys(pages):
        if page not in named and page.endswith((".md", ".rst", ".ipynb")):
            section = ALONE.get(page) or SECTIONS.get(posixpath.dirname(page), ELSE)
            found.setdefault(section, []).append(page)
    return found


def keep(file: Path, content: bytes) -> None:
    """Write a file, unless that is what is in it."""
    if not file.is_file() or file.read_bytes() != content:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)


def digest(files: Iterable[Path], *words: str) -> str:
    """What files, words and all code of the package are, as a short text."""
    found = hashlib.sha256("\0".join(words).encode())
    for file in [*files, *sorted((ROOT / "synctrl").rglob("*.py"))]:
        found.update(file.read_bytes())
    return found.hexdigest()[:16]


def sweep(source: Path, kept: Iterable[Path]) -> None:
    """Remove all files from the source but those that are kept."""
    wanted = {path.resolve() for path in kept}
    for path in sorted(source.rglob("*"), reverse=True):
        if path.is_file() and path.resolve() not in wanted:
            path.unlink()
        elif path.is_dir() and not any(path.iterdir()):
            shutil.rmtree(path)
