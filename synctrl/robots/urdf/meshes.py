"""Finding the meshes and textures that a description names, in its packages and nowhere else.

Names are resolved once, when a description is read: what is drawn later is the file that was found then. See
`mesh_files` for what is looked at in a file. A mesh that cannot be shown is left out; of a texture the mean
colour is shown.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import coal
import numpy as np
import pinocchio as pin

from .document import Document, Geometry, Link, Shape, Vector
from .mesh_files import check_mesh
from .packages import Packages, Unusable, read_regular, require_regular
from .report import Notes
from .xml import quoted

DEFAULT_COLOR = (0.9, 0.9, 0.9, 1.0)
SCHEMES = ("package://", "model://", "file://")


def find_pictures(document: Document, packages: Packages, notes: Notes) -> Document:
    """The document with the file of every mesh that is shown, and the mean colour of every texture.

    A visual whose mesh cannot be shown stays in the document as it is named, without a file, and with a note.

    Raises:
        RobotError: the notes are strict.
    """
    finder = _Finder(packages, notes)
    visuals = [tuple(finder.visual(link, visual) for visual in link.visuals) for link in document.links]
    links = (replace(link, visuals=found) for link, found in zip(document.links, visuals, strict=True))
    return replace(document, links=tuple(links))


def build_visual(document: Document, model: pin.Model) -> pin.GeometryModel:
    """All shapes for display, each at its place in the frame of its link."""
    visual = pin.GeometryModel()
    for link in document.links:
        frame_id = model.getFrameId(link.name, pin.BODY)
        frame = model.frames[frame_id]
        for k, geometry in enumerate(link.visuals):
            if geometry.shape.hidden:
                continue
            colored, color = geometry.color is not None, np.array(geometry.color or DEFAULT_COLOR)
            placement = frame.placement * geometry.origin.se3
            place = (f"{link.name}_{k}", frame.parentJoint, frame_id, placement)
            visual.addGeometryObject(pin.GeometryObject(*place, *_solid(geometry.shape), colored, color))
    return visual


def _solid(shape: Shape) -> tuple[coal.CollisionGeometry, str, np.ndarray]:
    """Coal's geometry, and path and scale of a mesh."""
    if shape.kind == "mesh":
        return coal.BVHModelOBBRSS(), str(shape.file), np.array(shape.size)
    kinds = {"box": coal.Box, "cylinder": coal.Cylinder, "capsule": coal.Capsule, "sphere": coal.Sphere}
    return kinds[shape.kind](*shape.size), "", np.ones(3)


def find_file(filename: str, packages: Packages) -> Path:
    """The file that a name in a description stands for: a regular one that the description may read.

    Args:
        filename: `package://name/path`, `file:///path`, or a path from the description's own folder.
        packages: where the description is, and what it may read.

    Raises:
        Unusable: there is none, or it may not be read.
    """
    path = _path(filename, packages)
    if not packages.allows(path):
        raise Unusable(
            f"it lies outside of {packages.home} and of the packages that are known; "
            "name a folder that holds it in package_dirs"
        )
    require_regular(path)
    return path.parent.resolve() / path.name


def _path(filename: str, packages: Packages) -> Path:
    scheme = next((scheme for scheme in SCHEMES if filename.startswith(scheme)), "")
    rest = filename.removeprefix(scheme)
    if scheme == "file://":
        return Path("/", unquote(rest.removeprefix("localhost")))
    if not scheme:
        if "://" in filename:
            raise Unusable(f"expected a path or one of {', '.join(SCHEMES)}")
        return packages.here / filename
    name, _, inside = rest.partition("/")
    folder = packages.folder(name)
    if folder is None:
        raise Unusable(
            f"package {quoted(name)} is neither above nor beside {packages.here}; "
            "name a folder that holds it in package_dirs"
        )
    return folder / inside


@dataclass
class _Finder:
    """Looks at each file once."""

    packages: Packages
    notes: Notes
    checked: dict[Path, str] = field(default_factory=dict)

    def visual(self, link: Link, visual: Geometry) -> Geometry:
        """The visual of a link with its mesh file and the colour of its texture, if they can be used."""
        shape = visual.shape
        if shape.hidden:
            try:
                visual = replace(visual, shape=replace(shape, file=self._mesh(shape.filename or "")))
            except Unusable as error:
                self._leave_out(link, visual, f"mesh {quoted(shape.filename or '')}", error)
        if texture := visual.texture:
            try:
                visual = replace(visual, texture=None, color=self._color(texture))
            except Unusable as error:
                self._leave_out(link, visual, f"texture {quoted(texture)}", error)
        return visual

    def _leave_out(self, link: Link, visual: Geometry, what: str, why: Unusable) -> None:
        self.notes.add("left out", f"{link.title}, visual", f"{what} is not shown: {why}", visual.line)

    def _mesh(self, filename: str) -> Path:
        file = find_file(filename, self.packages)
        if file not in self.checked:
            self.checked[file] = _fault(file)
        if self.checked[file]:
            raise Unusable(self.checked[file])
        return file

    def _color(self, texture: str) -> Vector:
        return mean_color(read_regular(find_file(texture, self.packages), MAX_TEXTURE_BYTES))


def _fault(file: Path) -> str:
    """Why a mesh cannot be shown, or nothing."""
    try:
        check_mesh(file)
    except Unusable as error:
        return str(error)
    return ""


# -- textures ----------------------------------------------------------------------------------------------

FORMATS = ("PNG", "JPEG", "BMP", "GIF", "TGA", "WEBP")
MAX_TEXTURE_BYTES = 64_000_000
MAX_PIXELS = 64_000_000


def mean_color(data: bytes) -> Vector:
    """The mean colour, red, green, blue, alpha from 0 to 1, of the picture in a file with this content.

    Raises:
        Unusable: it is of another format, too large, or broken.
    """
    from PIL import Image

    try:
        image = Image.open(io.BytesIO(data), formats=FORMATS)
    except Exception as error:  # each format has its own
        raise Unusable(f"expected a picture in one of the formats {', '.join(FORMATS)}") from error
    return mean_of(image)


def mean_of(image: Any) -> Vector:
    """The mean colour of a picture, opaque.

    Raises:
        Unusable: it is of another format (some are programs), has too many pixels, or is broken.
    """
    from PIL.Image import Resampling

    if image.format not in FORMATS:
        raise Unusable(f"expected a picture in one of the formats {', '.join(FORMATS)}")
    if image.width * image.height > MAX_PIXELS:
        raise Unusable(f"expected a picture of at most {MAX_PIXELS / 1e6:g} million pixels, found more")
    try:
        pixel = image.convert("RGB").resize((1, 1), Resampling.BOX).tobytes()
    except Exception as error:  # each format has its own
        raise Unusable(f"the picture is broken ({error})") from error
    r, g, b = (level / 255 for level in pixel)
    return r, g, b, 1.0
