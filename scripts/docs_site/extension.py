"""What Sphinx is told of the package: how its docstrings are written, and where its names have entries."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.ext.viewcode import _get_full_modname

from docs_site import reference
from docs_site.docstrings import as_markup

ROOT = Path(__file__).resolve().parents[2]
#: defaults that are no code, and what is shown for them
DEFAULTS = {
    r"<class '(?:\w+\.)*(\w+)'>": r"\1",
    r"<function (?:\w+\.)*(\w+) at 0x\w+>": r"\1",
    r"<(?:\w+\.)*(\w+) object at 0x\w+>": r"\1()",
    r"= <[^<>]*>": "= ...",
    r"=<[^<>]*>": "=...",
}


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    names = reference.public_names(reference.example_sources(ROOT))
    app.add_config_value("public_paths", public_paths(names), "env")
    app.connect("config-inited", with_files)
    app.connect("autodoc-process-docstring", markup)
    app.connect("autodoc-process-signature", signed)
    app.connect("autodoc-skip-member", skipped)
    app.connect("missing-reference", resolved)
    app.connect("doctree-read", with_origins)
    app.connect("env-updated", sources_lead_back)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def with_files(app: Sphinx, config: Any) -> None:
    """Take files that the site has as they are from beside its source."""
    config.html_static_path.append(str(app.srcdir / "_static"))
    config.html_extra_path.append(str(app.srcdir.parent / "extra"))


def public_paths(names: list[reference.Public]) -> dict[str, str]:
    """By every path of a name, that under which it has its entry."""
    chosen = reference.entries(names)
    return {path: chosen[each.origin].path for each in names for path in (each.origin, each.path)}


def markup(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are words, not reStructuredText."""
    lines[:] = as_markup(lines)


def skipped(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Members that a class has from elsewhere, of tuples, exceptions, arrays, and fields without words."""
    if (inspect.getdoc(obj) or "").startswith("Alias for field number"):
        return True
    function = (
        getattr(obj, "fget", None) or getattr(obj, "func", None) or inspect.unwrap(obj)
        if callable(obj)
        else obj
    )
    function = getattr(obj, "fget", function)
    module = getattr(function, "__module__", None)
    return True if isinstance(module, str) and not module.startswith("synctrl") else None


def signed(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Signatures with defaults as one would write them, or dots, where Python has no words for them."""
    return readable(signature), returns


def readable(signature: str | None) -> str | None:
    """A signature without what Python says between < and > of things that it cannot write."""
    if signature is None:
        return None
    for pattern, words in DEFAULTS.items():
        signature = re.sub(pattern, words, signature)
    return signature


def with_origins(app: Sphinx, doctree: nodes.document) -> None:
    """Give every entry the place under which the page of its source leads back to it."""
    for signature in doctree.findall(addnodes.desc_signature):
        module, name = signature.get("module"), signature.get("fullname")
        origin = f"{_get_full_modname(module, name)}.{name}" if module and name else ""
        if origin and origin not in signature["ids"] and not origin.startswith("None."):
            signature["ids"].append(origin)


def sources_lead_back(app: Sphinx, env: Any) -> list[str]:
    """Let pages of sources lead to entries by where things are defined, whatever their public paths are."""
    modules = getattr(env, "_viewcode_modules", {})
    for module, entry in modules.items():
        if entry:
            modules[module] = (*entry[:3], module)
    return []


def resolved(app: Sphinx, env: Any, node: Any, content: nodes.Element) -> nodes.Element | None:
    """A reference to where something is defined, or to its bare name, leads to where it is public."""
    if node.get("refdomain") != "py":
        return None
    target = public(node["reftarget"], node.get("py:module"), app.config.public_paths)
    if target is None:
        return None
    domain = env.domains["py"]
    return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", target, node, content)


def public(target: str, module: str | None, paths: dict[str, str]) -> str | None:
    """The public path of what a reference is to: a path, or a name of the module, a class or of the front.

    A bare name in small letters is that of an argument more often than that of a function, so it leads to
    another module only if it is one of those that `import synctrl` has.
    """
    owner, _, member = target.rpartition(".")
    for name, rest in ((target, ""), (owner, f".{member}")):
        for candidate in (name, f"{module}.{name}", f"synctrl.{name}"):
            if name and candidate in paths and paths[candidate] + rest != target:
                return paths[candidate] + rest
        if name[:1].isupper() and "." not in name:
            found = {path for path in paths.values() if path.rpartition(".")[2] == name}
            if len(found) == 1:
                return found.pop() + rest
    return None
