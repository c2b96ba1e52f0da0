"""The colour of a picture as a whole: what is shown of a texture."""

from __future__ import annotations

import io
from typing import Any

from .document import Vector
from .regular import Unusable

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
