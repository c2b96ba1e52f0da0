"""The picture in docs/assembly.md: two arms that carry a payload, with the forces inside it.

python scripts/readme_picture.py [docs/carried.png]

It needs Chromium and the extra `test`, whose browser draws the arms.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from synctrl import Result
from synctrl.experiments import carry_ur5
from synctrl.files import whole_file
from synctrl.show import side_by_side
from synctrl.show.plots import new_figure, style
from synctrl.show.style import robot_color

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from browser import open_page

#: the instant at which the arms are drawn, s, and what shows nothing but them
INSTANT = 4.5
BARE = """document.querySelectorAll(".words, .dg").forEach(each => each.style.display = "none");
viewer.animator.pause(); viewer.animator.seek(%g); viewer.animator.display_progress(%g);"""
CAMERA = (0.4, -1.55, 0.85), (0.0, 0.03, 0.3)
TITLES = "both know where they hold it", "one is wrong by a millimetre"
NAMES = "independent", "synchronized", "with a leak"


def main() -> None:
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/carried.png")
    cells = [carried(False, False), carried(False, True)], [carried(True, False), carried(True, True)]
    cells[1].append(carried(True, True, leak=True))
    with style():
        figure, panels = new_figure(4.9, 2, 2, width=9.0, sharey="row", height_ratios=(1.5, 1))
        draw_arms(panels[0], [runs[1] for runs in cells])
        for panel, runs in zip(panels[1], cells, strict=True):
            for k, run in enumerate(runs):
                panel.plot(run.t, force(run), color=robot_color(k), linewidth=1.8, label=NAMES[k])
            panel.set(xlabel="time, s", xlim=(0, run.t[-1]))
        panels[1, 0].set(ylabel="force inside, N", ylim=(0, 1.05 * force(cells[1][1]).max()))
        figure.legend(*panels[1, 1].get_legend_handles_labels(), loc="outside lower right", ncols=3)
        with whole_file(path) as file:
            figure.savefig(file, metadata={"Software": None})
    print(path)


def carried(geometric_error: bool, synchronized: bool, **options) -> Result:
    """A run of the cell."""
    experiment = carry_ur5(synchronized, geometric_error=geometric_error, **options)
    return experiment.simulate(dt=2e-3, log_dt=1e-2)


def force(run: Result) -> np.ndarray:
    """Size of the internal force, N; both hands have the same."""
    return np.linalg.norm(run.outputs["internal_force"][:, 0, :3], axis=1)


def draw_arms(panels, runs) -> None:
    """The arms of two runs at one instant, as a browser shows them."""
    from matplotlib.image import imread

    shown = side_by_side(dict(zip(TITLES, runs, strict=True)))
    for scene in shown.scenes:
        scene.camera(*CAMERA)
    with TemporaryDirectory() as folder:
        page, picture = Path(folder, "page.html"), Path(folder, "page.png")
        with open_page(shown.write(page), (1720, 560)) as browser:
            browser.check_plays()
            browser.evaluate(BARE % (INSTANT, INSTANT))
            time.sleep(2.0)
            browser.screenshot(picture)
        pixels = imread(picture)
    half = pixels.shape[1] // 2
    for panel, first, title in zip(panels, (0, half + 2), TITLES, strict=True):
        panel.imshow(pixels[:, first : first + half - 2])
        panel.set_axis_off()
        panel.set_title(title, loc="left")


if __name__ == "__main__":
    main()
