"""Sphinx's settings. The site is built by `make docs`, from a folder that `scripts/build_docs.py` fills."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

import synctrl  # noqa: E402, F401  what the reference is made of

project = "synctrl"
author = copyright = "the synctrl authors"
language = "en"

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx.ext.mathjax",
    "myst_nb",
    "sphinx_copybutton",
    "docs_site.extension",
]
root_doc = "index"
nitpicky = True
nitpick_ignore_regex = [(r"py:(?:class|obj|exc|data)", r".*")]  # types in signatures, and code in backticks

# Pages: Markdown as code hosts show it.
myst_enable_extensions = ["dollarmath", "amsmath", "attrs_inline"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
suppress_warnings = ["myst.header"]  # a page may go from a title to a third level, as docstrings do
nb_execution_mode = "off"  # they are executed before, side by side
nb_ipywidgets_js = {}  # nothing from a network
nb_merge_streams = True

# The reference.
default_role = "py:obj"
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_type_aliases = {name: name for name in ("ArrayLike", "WeightsLike", "GraphLike")}
python_maximum_signature_line_length = 88
toc_object_entries_show_parents = "hide"

# The looks.
html_theme = "furo"
html_title = "synctrl"
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False  # it fetches pages, which files may not
html_theme_options = {"navigation_with_keys": True}
mathjax_path = "mathjax/tex-svg-full.js"
copybutton_exclude = ".linenos, .gp, .go"
