"""What the site is made of: where pages go, what their links become, and that no public name is missing."""

from __future__ import annotations

import importlib
import inspect
import json
import re
import sys
from pathlib import Path

import pytest

import synctrl

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from docs_site import reference  # noqa: E402
from docs_site.docstrings import as_markup  # noqa: E402
from docs_site.links import contents, relinked, with_toctrees  # noqa: E402
from docs_site.stage import places, unnamed  # noqa: E402

PLACES = {"docs/laws.md": "laws.md", "README.md": "project/readme.md", "docs/tube.png": "tube.png"}
PLACES["docs/howto/a.md"] = "howto/a.md"
SOURCES = {"synctrl/control/law.py": "_modules/synctrl/control/law.html"}
NAMES = reference.public_names(reference.example_sources(ROOT))
PAGES = reference.pages(NAMES)


@pytest.mark.parametrize(
    ("page", "text", "expected"),
    [
        ("README.md", "[laws](docs/laws.md#x)", "[laws](../laws.md#x)"),
        ("docs/laws.md", "[a](../README.md)", "[a](project/readme.md)"),
        ("docs/howto/a.md", "[a](../laws.md)", "[a](../laws.md)"),
        ("README.md", "![a tube](docs/tube.png)", "![a tube](../tube.png)"),
        (
            "docs/laws.md",
            "[there](https://semver.org), [here](#law)",
            "[there](https://semver.org), [here](#law)",
        ),
        ("README.md", "see [docs/laws.md](docs/laws.md)", "see [](../laws.md)"),
        ("docs/laws.md", "[`seams`](../tests/seams) stay", "`seams` stay"),
        ("docs/laws.md", "`[a](../README.md)`", "`[a](../README.md)`"),
        ("docs/laws.md", "```\n[a](../README.md)\n```", "```\n[a](../README.md)\n```"),
        ("docs/laws.md", "so. [`test_law.py`: `test_a`]", "so. [`test_law.py`: `test_a`]{.tests}"),
    ],
)
def test_a_link_leads_where_the_page_is_on_the_site(page, text, expected):
    assert relinked(text, page, PLACES, SOURCES) == expected


def test_modules_lead_to_their_source_from_links_and_from_code():
    link = '<a class="source" href="../_modules/synctrl/control/law.html"><code>{}</code></a>'
    assert relinked("`control/law.py`", "README.md", PLACES, SOURCES) == link.format("control/law.py")
    assert relinked("[`law`](synctrl/control/law.py)", "README.md", PLACES, SOURCES) == link.format("law")
    assert relinked("`control/other.py`", "README.md", PLACES, SOURCES) == "`control/other.py`"


def test_a_picture_that_is_not_on_the_site_is_refused():
    with pytest.raises(FileNotFoundError):
        relinked("![a](../missing.png)", "docs/laws.md", PLACES, SOURCES)


def test_the_index_is_the_table_of_contents_and_names_every_page():
    index = (ROOT / "docs" / "index.md").read_text("utf-8")
    where = places(ROOT)
    staged = relinked(index, "docs/index.md", where, {})
    sections = contents(staged)
    assert unnamed(staged, where.values()) == {}
    assert [*sections] == ["Start", "Tutorials", "How-to", "Explanation", "Reference", "Gallery", "Project"]
    trees = with_toctrees(staged, {"Reference": ["reference/robots.rst"]})
    listed = re.findall(r"(?m)^.* <(.+)>$", trees.split("```{toctree}", 1)[1])
    assert listed == [path for links in sections.values() for _, path in links]
    assert "\nreference/robots.rst\n" in trees and "\n- [](/reference/robots.rst)\n" in trees


def test_the_example_of_the_index_runs():
    index = (ROOT / "docs" / "index.md").read_text("utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", index, re.DOTALL)
    names: dict = {}
    exec(block.replace("duration=2.0", "duration=0.02"), names)
    assert names["result"].status == "completed"


def test_what_the_index_does_not_name_comes_last_in_its_section():
    index = "# A\n\n## Start\n\n- [Laws](laws.md)\n\n## Explanation\n"
    pages = [
        "index.md",
        "laws.md",
        "theory.md",
        "theory.md",
        "start/install.md",
        "tutorials/b.ipynb",
        "a.png",
    ]
    expected = {
        "Explanation": ["theory.md"],
        "Start": ["start/install.md"],
        "Tutorials": ["tutorials/b.ipynb"],
    }
    assert unnamed(index, pages) == expected


def exported() -> list[tuple[str, str]]:
    """Every (module, name) in an `__all__` of the package or a subpackage."""
    folders = [path.parent for path in Path(synctrl.__file__).parent.rglob("__init__.py")]
    root = Path(synctrl.__file__).parents[1]
    modules = [".".join(folder.relative_to(root).parts) for folder in folders]
    return [
        (name, each) for name in modules for each in getattr(importlib.import_module(name), "__all__", ())
    ]


def test_no_public_name_is_missing_in_the_reference():
    assert len(exported()) > 200
    chosen = reference.entries(NAMES)
    for module, name in exported():
        (public,) = [each for each in NAMES if (each.module, each.name) == (module, name)]
        entry = chosen[public.origin]
        section = PAGES[f"reference/{public.room or 'front'}.rst"].split(f"\nFrom ``{module}``\n")[1]
        assert f":py:obj:`{name} <{entry.path}>`" in section.split("\nFrom ``")[0], (module, name)
        lines = "\n".join(PAGES.values()).split("\n")
        assert sum(line.startswith(".. auto") and line.endswith(f":: {entry.path}") for line in lines) == 1


def test_what_examples_import_is_in_the_reference():
    example = "import numpy\nfrom synctrl.show.plots import torques\nfrom os import path\n"
    assert reference.imported([example]) == {("synctrl.show.plots", "torques")}
    assert ("synctrl.show.animation", "planar_scene") in {(each.module, each.name) for each in NAMES}


def test_every_public_name_is_explained():
    plain = [each for each in NAMES if inspect.isclass(each.thing) or inspect.isfunction(each.thing)]
    assert len(plain) > 200
    assert not [each.path for each in plain if not inspect.getdoc(each.thing)]


DOCSTRING = """The size |x| of x_i * y, see `Gains` and `x + y`.

    for code in lines:
        print(code)

Args:
    q, v: of all joints, (n, nv),
        rad and rad/s.
    *names: any.

Raises:
    InputError: not finite.

- one
- two"""
MARKUP = r"""The size \|x\| of x_i \* y, see :py:obj:`Gains` and ``x + y``.

::

   for code in lines:
       print(code)

:Arguments:
   :py:obj:`q`, :py:obj:`v`
      of all joints, (n, nv),
      rad and rad/s.
   ``*names``
      any.

:Raises:
   :py:obj:`InputError`
      not finite.

- one
- two"""


def test_docstrings_are_words_in_sections_and_code():
    lines = [line for line in as_markup(DOCSTRING.split("\n")) if line]
    assert lines == [line for line in MARKUP.split("\n") if line]


def test_words_below_a_heading_that_are_no_items_stay_words():
    assert as_markup(["Returns:", "    A dictionary: of figures."])[-2:] == [
        "   A dictionary: of figures.",
        "",
    ]


def test_formulas_come_in_one_version_with_its_digest_and_from_nowhere_in_particular():
    folder = ROOT / "scripts" / "docs_site"
    asked = json.loads((folder / "package.json").read_text("utf-8"))["dependencies"]
    locked = json.loads((folder / "package-lock.json").read_text("utf-8"))["packages"]
    (name, package) = next(item for item in locked.items() if item[0])
    assert {name: package["version"]} == {f"node_modules/{key}": version for key, version in asked.items()}
    assert package["integrity"].startswith("sha512-") and "resolved" not in package
