"""MJCF files as one text that needs no other file, so that MuJoCo opens none.

MuJoCo's compiler opens whatever a file names. Here includes are put in their places, meshes that give a body
its mass are read, and of all others no more than the placement is kept: they are only pictures.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

from .packages import Packages, Unusable, read_regular
from .report import Notes
from .xml import Element, one_line, parse_xml, quoted, read_bytes

ROOT = "mujoco"
MAX_INCLUDES = 100
MAX_MESH_BYTES = 50_000_000
NOT_NEEDED = ("visual", "statistic", "custom", "sensor", "keyframe", "contact")
"""Sections that say nothing about the mechanism."""
REFUSED = {
    "extension": ("a plugin", ", which can do anything to the dynamics"),
    "plugin": ("a plugin", ", which can do anything to the dynamics"),
    "model": ("a model within the model", "; write it out with mujoco's MjSpec first"),
    "flexcomp": ("a flexible body", ""),
    "composite": ("a composite body", ""),
}
_PICTURES = ("texture", "skin", "layer")
_TETRAHEDRON = "0 0 0 1 0 0 0 1 0 0 0 1"


@dataclass
class Whole:
    """An MJCF file and all that it needs.

    Attributes:
        text: one XML document, which names no file but those in `assets`.
        assets: content of the meshes that give a body its mass, by the names that `text` has for them.
        meshes: the file of each mesh, by the mesh's name, as a description's shapes name files.
        name: what the file calls its model, or the file's own name.
    """

    text: str = ""
    assets: dict[str, bytes] = field(default_factory=dict)
    meshes: dict[str, str] = field(default_factory=dict)
    name: str = ""


def read_whole(file: Path, packages: Packages, notes: Notes) -> Whole:
    """Read an MJCF file and its includes.

    Raises:
        RobotError: not MJCF, an include that is missing or outside of the file's package, a mesh that cannot
            be had although a body's mass comes from it, a plugin or submodel.
    """
    reader = _Reader(file, packages, notes)
    root = parse_xml(str(file), read_bytes(file), notes)
    reader.prepare(root)
    reader.whole.text = "".join(_written(root))
    reader.whole.name = one_line(root.attributes.get("model") or file.stem)
    return reader.whole


class _Reader:
    def __init__(self, file: Path, packages: Packages, notes: Notes):
        self.file, self.packages, self.notes = file, packages, notes
        self.whole, self.included = Whole(), 0

    def prepare(self, root: Element) -> None:
        self._include(root)
        root.children = [child for child in root.children if child.tag not in NOT_NEEDED]
        compiler = {k: v for e in root.all("compiler") for k, v in e.attributes.items()}
        for child in root.all("compiler"):
            for name in ("meshdir", "texturedir", "assetdir"):
                child.attributes.pop(name, None)
        self._leave_out_pictures(root)
        weighty = _weighty_meshes(root, compiler.get("inertiafromgeom") == "true")
        for element in root.walk():
            if element.tag in REFUSED:
                element.refuse("one rigid mechanism", *REFUSED[element.tag])
            if element.tag == "mesh" and "file" in element.attributes:
                self._mesh(element, compiler, weighty)
            elif named := [name for name in element.attributes if name.startswith("file")]:
                element.refuse("no file named here", f"attribute {quoted(named[0])}")

    def _include(self, parent: Element) -> None:
        """Replace each <include> by what it includes."""
        children = []
        for child in parent.children:
            if child.tag == "include":
                included = self._included(child)
                self._include(included)
                children += included.children
            else:
                self._include(child)
                children.append(child)
        parent.children = children

    def _included(self, element: Element) -> Element:
        self.included += 1
        if self.included > MAX_INCLUDES:
            words = f"at most {MAX_INCLUDES} files included"
            element.refuse(words, "more", "; does a file include itself?")
        named = element.text("file")
        places = (self.file.parent / named, Path(element.file).parent / named)
        for file in places:
            if self.packages.allows(file) and file.is_file():
                return parse_xml(str(file), read_bytes(file), self.notes)
        element.refuse("a file beside this one, or in its package", quoted(named))

    def _leave_out_pictures(self, root: Element) -> None:
        for element in root.walk():
            for child in element.children:
                if child.tag in ("texture", "skin"):
                    child.note("left out", f"a {child.tag}; it is only seen")
            element.children = [child for child in element.children if child.tag not in _PICTURES]
            if element.tag == "material":
                element.attributes.pop("texture", None)

    def _mesh(self, element: Element, compiler: dict[str, str], weighty: set[str]) -> None:
        """Take the file out of a mesh; what remains is its content, or a tetrahedron in its place."""
        attributes = element.attributes
        named = attributes.pop("file")
        attributes.pop("content_type", None)
        name = attributes.setdefault("name", Path(named).stem)
        if compiler.get("strippath") == "true":
            named = Path(named).name
        folder = compiler.get("meshdir", compiler.get("assetdir", ""))
        path = Path(folder) / named
        self.whole.meshes[name] = str(path)
        if name not in weighty:
            attributes["vertex"] = _TETRAHEDRON
            return
        key = f"mesh{len(self.whole.assets)}{path.suffix}"
        self.whole.assets[key] = self._content(element, path)
        attributes["file"] = key

    def _content(self, element: Element, path: Path) -> bytes:
        expected, file = "a mesh, from which a body without <inertial> has its mass", self.file.parent / path
        if not self.packages.allows(file):
            place = "outside of the package"
            raise element.error(f"expected {expected}, found {quoted(str(path))} {place}", place)
        try:
            return read_regular(file, MAX_MESH_BYTES)
        except Unusable as error:
            words = f"expected {expected}, found {quoted(str(path))}: {error}"
            raise element.error(words, str(error)) from error


def _weighty_meshes(root: Element, all_of_them: bool) -> set[str]:
    """Names of the meshes that can give a body its mass, or a primitive its size."""
    named = {
        geom.attributes["mesh"] for geom in root.walk() if geom.tag == "geom" and "mesh" in geom.attributes
    }
    if all_of_them:
        return named
    return {name for body in root.walk() if body.tag == "body" for name in _weights(body)}


def _weights(body: Element) -> Iterator[str]:
    """Meshes from which MuJoCo computes the mass of this body."""
    if body.all("inertial"):
        return
    frames = [body, *(frame for child in body.all("frame") for frame in child.walk())]
    for geom in (geom for frame in frames if frame.tag in ("body", "frame") for geom in frame.all("geom")):
        if "mesh" in geom.attributes and geom.attributes.get("mass") != "0":
            yield geom.attributes["mesh"]


def _written(element: Element) -> Iterator[str]:
    attributes = "".join(f" {name}={quoteattr(value)}" for name, value in element.attributes.items())
    yield f"<{element.tag}{attributes}>"
    for child in element.children:
        yield from _written(child)
    yield f"</{element.tag}>"
