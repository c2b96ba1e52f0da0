"""What Sphinx is told of the package: how its docstrings are written, and where its names have entries."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

from docs_site import reference
from docs_site.docstrings import as_markup
from docutils import nodes
from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[2]


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    names = reference.public_names(reference.example_sources(ROOT))
    app.add_config_value("public_paths", {each.origin: chosen.path for each, chosen in paired(names)}, "env")
    app.connect("config-inited", lambda app, config: config.html_static_path.append(str(app.srcdir / "_static")))
    app.connect("autodoc-process-docstring", markup)
    app.connect("autodoc-skip-member", skipped)
    app.connect("missing-reference", resolved)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def paired(names: list[reference.Public]) -> list[tuple[reference.Public, reference.Public]]:
    """Every name with the one under which it has its entry."""
    chosen = reference.entries(names)
    return [(each, chosen[each.origin]) for each in names]


def markup(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are words, not reStructuredText."""
    lines[:] = as_markup(lines)


def skipped(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Members that a class has from elsewhere, of tuples, exceptions, arrays, and fields without words."""
    if (inspect.getdoc(obj) or "").startswith("Alias for field number"):
        return True
    function = getattr(obj, "fget", None) or getattr(obj, "func", None) or inspect.unwrap(obj) if callable(obj) else obj
    function = getattr(obj, "fget", function)
    module = getattr(function, "__module__", None)
    return True if isinstance(module, str) and not module.startswith("synctrl") else None


def resolved(app: Sphinx, env: Any, node: Any, content: nodes.Element) -> nodes.Element | None:
    """A reference to where something is defined leads to where it is public."""
    if node.get("refdomain") != "py":
        return None
    target = node["reftarget"]
    public = app.config.public_paths.get(target)
    if public is None and (module := node.get("py:module")) and "." not in target:
        public = app.config.public_paths.get(f"{module}.{target}")
    if public is None:
        owner, _, member = target.rpartition(".")
        public = f"{app.config.public_paths[owner]}.{member}" if owner in app.config.public_paths else None
    if public is None or public == target:
        return None
    domain = env.domains["py"]
    return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", public, node, content)
