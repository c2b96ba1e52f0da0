"""The picture in motion in README: a bead of adhesive on an edge that another arm moves, and its error.

python scripts/readme_motion.py [docs/motion.gif]

It needs the extras `compiled` and `test`, and Chromium, which draws the arms.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from matplotlib import get_data_path
from PIL import Image, ImageDraw, ImageFont

from synctrl import Result
from synctrl.experiments import bead_on_edge
from synctrl.files import whole_file
from synctrl.show import side_by_side
from synctrl.show.plots import new_figure, style
from synctrl.show.style import ACCENT, PALETTE

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from browser import open_page
from scene_pictures import freeze, seen

#: of the run, s; frames per second; and how long the last one stays, s
DURATION, FPS, REST = 4.8, 12, 1.5
#: size of the scenes and of the curves below them, pixels; they are drawn at SCALE times that
WIDTH, SCENES, CURVES, SCALE = 840, 330, 150, 2
CAMERA = (-0.03, -0.67, 1.12), (0.05, 0.0, 0.4)
#: colours of the palette: of large areas, and of what is rare
COMMON, RARE = 27, 100


def main() -> None:
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/motion.gif")
    runs = {
        name: bead_on_edge(name == "synchronized", push=True).simulate(
            DURATION, dt=2e-4, log_dt=1e-2, engine="compiled"
        )
        for name in ("independent", "synchronized")
    }
    times = np.arange(0.0, DURATION, 1 / FPS)
    pictures = [joined(*parts) for parts in zip(scenes(runs, times), curves(runs, times), strict=True)]
    with whole_file(path) as file:
        write(pictures, file)
    print(path, f"{path.stat().st_size / 1e6:.2f} MB")


def scenes(runs: dict[str, Result], times: np.ndarray) -> Iterator[Image.Image]:
    """The arms of all runs side by side, at every time."""
    shown = side_by_side(runs, fps=30)
    for scene in shown.scenes:
        scene.camera(*CAMERA)
    with (
        TemporaryDirectory() as folder,
        open_page(shown.write(Path(folder, "page.html")), (SCALE * WIDTH, SCALE * SCENES)) as page,
    ):
        freeze(page, white=True)
        for t in times:
            yield row(dict(zip(runs, seen(page, t), strict=True)))


def row(panes: dict[str, Image.Image]) -> Image.Image:
    """Pictures side by side, each under its name and in its share of the width, with a line between them."""
    wide = WIDTH // len(panes)
    picture = Image.new("RGB", (WIDTH, SCENES), "white")
    font = ImageFont.truetype(str(Path(get_data_path(), "fonts/ttf/DejaVuSans-Bold.ttf")), 16)
    for k, (name, pane) in enumerate(panes.items()):
        picture.paste(pane.resize((wide - 2, SCENES), Image.Resampling.LANCZOS), (k * wide + (k > 0) * 2, 0))
        ImageDraw.Draw(picture).text((k * wide + 12, 10), name, fill=PALETTE[k + 1], font=font)
    return picture


def curves(runs: dict[str, Result], times: np.ndarray) -> Iterator[Image.Image]:
    """By how much the bead is beside its place, as far as it is laid."""
    with style():
        figure, panels = new_figure(CURVES / 100, width=WIDTH / 100)
        panel = panels[0, 0]
        errors = {name: 1e3 * np.linalg.norm(run.outputs["bead_error"], axis=1) for name, run in runs.items()}
        lines = {name: panel.plot([], [], color=color, lw=2)[0] for name, color in colors(runs)}
        panel.axvspan(2.0, 2.3, color=ACCENT, alpha=0.12, lw=0)
        panel.set(xlim=(0, DURATION), ylim=(0, 1.05 * max(map(np.max, errors.values()))))
        panel.set(xlabel="time, s", ylabel="bead off, mm")
        panel.legend(lines.values(), errors, loc="upper right", ncols=2)
        panel.annotate(
            "a push", (2.15, 0.9), xycoords=("data", "axes fraction"), ha="center", va="top", size=8
        )
        for t in times:
            for name, run in runs.items():
                laid = run.t <= t
                lines[name].set_data(run.t[laid], errors[name][laid])
            yield drawn(figure)


def colors(runs: dict[str, Result]) -> Iterator[tuple[str, str]]:
    """A colour for each run."""
    return zip(runs, (PALETTE[1], PALETTE[2]), strict=True)


def drawn(figure: Any) -> Image.Image:
    """A figure as pixels."""
    pixels = BytesIO()
    figure.savefig(pixels, format="png", dpi=100 * SCALE)
    return Image.open(pixels).convert("RGB").resize((WIDTH, CURVES), Image.Resampling.LANCZOS)


def joined(above: Image.Image, below: Image.Image) -> Image.Image:
    """Two pictures, one above the other."""
    picture = Image.new("RGB", (WIDTH, SCENES + CURVES), "white")
    picture.paste(above, (0, 0))
    picture.paste(below, (0, SCENES))
    return picture


def write(pictures: list[Image.Image], file: Any) -> None:
    """An animated GIF whose frames have one palette, so that what stands still takes no room."""
    palette = palette_of(pictures[:: max(1, len(pictures) // 6)])
    flat = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    lengths = [round(1000 / FPS)] * (len(flat) - 1) + [round(1000 * REST)]
    options = {"duration": lengths, "loop": 0, "optimize": False, "disposal": 1}
    flat[0].save(file, "GIF", save_all=True, append_images=flat[1:], **options)


def palette_of(pictures: list[Image.Image]) -> Image.Image:
    """White, colours of large areas, and colours that come near all others, the rare ones too."""
    pixels = np.concatenate([np.asarray(each).reshape(-1, 3) for each in pictures])
    kinds = 8 * np.unique(pixels // 8, axis=0) + 4
    parts = [np.full((1, 3), 255), chosen(pixels[::7], COMMON), chosen(kinds, RARE)]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.concatenate(parts).astype(np.uint8).tobytes())
    return palette


def chosen(colors: np.ndarray, count: int) -> np.ndarray:
    """So many colours for a list of them, (n, 3)."""
    row = Image.fromarray(colors[None].astype(np.uint8)).quantize(count, Image.Quantize.MEDIANCUT, kmeans=2)
    return np.array(row.getpalette()).reshape(-1, 3)[:count]


if __name__ == "__main__":
    main()
