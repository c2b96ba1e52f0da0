"""How a page that plays is shown: as a file, or in a notebook."""

from __future__ import annotations

from html import escape
from pathlib import Path

from ..checks import positive_number
from ..errors import InputError
from ..files import write_whole
from .html import frame

NOTEBOOK_LIMIT = 10_000_000  # characters; notebooks with larger outputs become slow to open and to save


class Shown:
    """What has a `page`, and so can be written to a file and shown in a notebook."""

    def page(self) -> str:
        """The text of a self-contained HTML page."""
        raise NotImplementedError

    def write(self, path: str | Path) -> Path:
        """Write it to one HTML file that plays offline; its folder is made.

        Raises:
            InputError: the file cannot be written.
        """
        path = Path(path)
        try:
            write_whole(path, self.page().encode("utf-8", "replace"))
        except OSError as error:
            words = f"animation '{path}' cannot be written: {error.strerror}"
            raise InputError(words, file=path, found=error.strerror) from error
        return path

    def html(self, height: int = 480) -> str:
        """For a notebook: an `<iframe>` that holds the whole page, `height` pixels high.

        Raises:
            InputError: the page is larger than a notebook should hold.
        """
        text = self.page()
        if len(text) > NOTEBOOK_LIMIT:
            raise InputError(
                f"the scene takes {len(text) / 1e6:.1f} MB, of which a notebook holds "
                f"{NOTEBOOK_LIMIT / 1e6:.0f} MB; use write() and link to the file",
                found=len(text),
            )
        return frame(text, round(positive_number("height", height)))

    def _repr_html_(self) -> str:
        """The page in a notebook; where it is too large, what to do instead."""
        try:
            return self.html()
        except InputError as error:
            return f"<p>{escape(str(error))}</p>"
