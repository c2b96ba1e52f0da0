"""Pictures of scenes at instants, as a browser draws them.

with open_page(path) as page:
    freeze(page)
    pictures = seen(page, 0.6)
"""

from __future__ import annotations

import base64
import sys
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
if TYPE_CHECKING:
    from browser import Page

#: the page draws no more by itself, which would take all time of a machine without a graphics card
STILL = "window.requestAnimationFrame = () => 0; viewer.animator.pause();"
WHITE = """viewers.forEach(each => ["top_color", "bottom_color"].forEach(
  which => each.set_property(["Background"], which, [1, 1, 1])));"""
#: what all scenes show at a time, as addresses of PNG pictures
SEEN = """viewers.map(each => {
  each.animator.seek(%g); each.animator.display_progress(%g); each.render();
  return each.renderer.domElement.toDataURL("image/png");
})"""


def freeze(page: Page, white: bool = False) -> float:
    """Let an animation that plays stand still, on white if asked; returns how long it is, s."""
    page.check_plays()
    return freeze_short(page, white)


def freeze_short(page: Page, white: bool = False) -> float:
    """The same of one that may be over before anybody sees it play."""
    page.wait_for("typeof viewer === 'object' && viewer.animator.duration > 0")
    page.evaluate(STILL + WHITE * white)
    return float(page.evaluate("viewer.animator.duration"))


def seen(page: Page, t: float) -> list[Image.Image]:
    """What every scene of a page that stands still shows at a time, s, from left to right."""
    return [decoded(address) for address in page.evaluate(SEEN % (t, t))]


def decoded(address: str) -> Image.Image:
    """The picture that a data address holds."""
    with Image.open(BytesIO(base64.b64decode(address.partition(",")[2]))) as picture:
        return picture.convert("RGB")


def joined(panes: list[Image.Image], gap: int = 4) -> Image.Image:
    """Pictures of one height side by side, with a white line between them."""
    width = sum(pane.width for pane in panes) + gap * (len(panes) - 1)
    picture, x = Image.new("RGB", (width, panes[0].height), "white"), 0
    for pane in panes:
        picture.paste(pane, (x, 0))
        x += pane.width + gap
    return picture
