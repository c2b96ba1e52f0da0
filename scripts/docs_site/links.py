"""Pages of the repository as pages of the site: where each goes, and where its links go then."""

from __future__ import annotations

import html
import posixpath
import re
from collections.abc import Mapping

#: what a link leads to that is no file of the repository
OUTSIDE = re.compile(r"^(?:[a-z][a-z+.-]*:|#|//)")
#: blocks of code, links and pictures, code in a line, whichever begins first
PIECES = re.compile(
    r"(?P<fence>^(?P<ticks>```+|~~~+).*?^(?P=ticks)\s*?$)"
    r"|(?P<link>(?P<words>!?\[(?:[^\[\]]|\[[^\[\]]*\])*\])\((?P<target>[^()\s]+)\))"
    r"|(?P<code>`[^`\n]+`)",
    re.MULTILINE | re.DOTALL,
)

#: words of a link that are a file's name: on the site it has the title of the page instead
NAMED = re.compile(r"\[`?[\w./]+\.(?:md|ipynb)`?\]$")
#: tests that a page names for a statement, in brackets
TESTS = re.compile(r"\[[^\[\]]*`test_[^\[\]]*\](?!\()")


def relinked(text: str, page: str, places: Mapping[str, str], sources: Mapping[str, str]) -> str:
    """A page's text with the links that it needs at its place on the site.

    Args:
        text: Markdown.
        page: its path in the repository.
        places: of every file of the repository that is on the site, its path there.
        sources: of every module whose source the site shows, its path there.

    Returns:
        The text. Links to files that are on the site lead to their places there, and so do links to modules
        and their paths in code, which may begin in synctrl/. Of links to other files the words are left.

    Raises:
        FileNotFoundError: a picture that is not on the site.
    """

    here = posixpath.dirname(places[page]) or "."

    def changed(found: re.Match[str]) -> str:
        if found["code"]:
            source = sources.get(found["code"][1:-1]) or sources.get(f"synctrl/{found['code'][1:-1]}")
            return shown(found["code"][1:-1], posixpath.relpath(source, here)) if source else found[0]
        if found["link"] is None or OUTSIDE.match(found["target"]):
            return found[0]
        path, hash_, anchor = found["target"].partition("#")
        origin = posixpath.normpath(posixpath.join(posixpath.dirname(page), path))
        there = places.get(origin)
        if there is not None:
            words = "[]" if NAMED.match(found["words"]) else found["words"]
            return f"{words}({posixpath.relpath(there, here)}{hash_}{anchor})"
        if origin in sources:
            return shown(found["words"][1:-1].strip("`"), posixpath.relpath(sources[origin], here))
        if found["words"].startswith("!"):
            raise FileNotFoundError(f"{page}: the picture {path} is not on the site")
        return found["words"][1:-1]

    return TESTS.sub(r"\g<0>{.tests}", PIECES.sub(changed, text))


def shown(words: str, target: str) -> str:
    """Code that leads to where the site shows the source."""
    return f'<a class="source" href="{target}"><code>{html.escape(words)}</code></a>'


def contents(index: str) -> dict[str, list[tuple[str, str]]]:
    """Sections of the index, each with its links to pages, as (words, path), in their order."""
    sections: dict[str, list[tuple[str, str]]] = {}
    for part in re.split(r"(?m)^## ", index)[1:]:
        title, _, body = part.partition("\n")
        links = [(found["words"][1:-1], found["target"]) for found in PIECES.finditer(body) if found["link"]]
        pages = [(words, path) for words, path in links if not OUTSIDE.match(path) and "#" not in path]
        sections[title.strip()] = list({path: (words, path) for words, path in reversed(pages)}.values())[
            ::-1
        ]
    return sections


def with_toctrees(index: str, others: Mapping[str, list[str]]) -> str:
    """The index with a table of contents that is not shown for each of its sections.

    Args:
        index: Markdown, with links to pages of the site.
        others: by section, pages that it does not name, which come last and are named by their titles.
    """
    head, *sections = re.split(r"(?m)^(?=## )", index)
    shown, trees = [head], []
    for section, (title, pages) in zip(sections, contents(index).items(), strict=True):
        more = others.get(title, [])
        listed = section.rstrip().rpartition("\n")[2].startswith("- ")
        shown += [section.rstrip(), "\n" if listed else "\n\n", *(f"- [](/{path})\n" for path in more), "\n"]
        entries = [*(f"{words.replace('`', '')} <{path}>" for words, path in pages), *more]
        if entries:
            trees.append("\n".join(["```{toctree}", ":hidden:", f":caption: {title}", "", *entries, "```"]))
    return "".join(shown) + "\n\n".join(trees) + "\n"
