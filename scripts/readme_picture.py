"""The picture in README: four arms, one of them pushed, synchronized and independent.

python scripts/readme_picture.py [docs/disturbed.png]
"""

from __future__ import annotations

import sys
from pathlib import Path

from synctrl.experiments import planar_four
from synctrl.files import whole_file
from synctrl.show.plots import common_limits, new_figure, style
from synctrl.show.style import ACCENT, display, line_style, robot_color

ROWS = (("tracking_error", "tracking error e"), ("sync_error", "sync. error ε"))
TITLES = ("synchronized", "independent")


def main() -> None:
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/disturbed.png")
    runs = [planar_four(synchronized, disturbance="torque").simulate(3.0) for synchronized in (True, False)]
    with style():
        figure, panels = new_figure(4.6, 2, 2, width=9.0, sharex=True, sharey="row")
        for (kind, what), row in zip(ROWS, panels, strict=True):
            unit, factor = display(runs[0].unit(kind))
            low, high = common_limits(kind, *runs)
            for run, panel in zip(runs, row, strict=True):
                draw(panel, run, kind, factor)
                panel.set(ylim=(factor * low, factor * high), xlim=(0, 3))
            row[0].set_ylabel(f"{what}, {unit}")
        for panel, title in zip(panels[0], TITLES, strict=True):
            panel.set_title(title, loc="left")
        for panel in panels[1]:
            panel.set_xlabel("time, s")
        for i in range(4):
            panels[0, 0].plot([], [], color=robot_color(i), linewidth=2.4, label=f"robot {i + 1}")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=4)
        with whole_file(path) as file:
            figure.savefig(file, metadata={"Software": None})
    print(path)


def draw(panel, run, kind, factor):
    """All errors of one kind, and when robot 1 is pushed."""
    error = getattr(run, kind)
    panel.axvspan(0.5, 0.75, color=ACCENT, alpha=0.1, linewidth=0)
    for k in range(error.shape[1]):
        for axis in range(error.shape[2]):
            panel.plot(run.t, factor * error[:, k, axis], line_style(axis), color=robot_color(k))


if __name__ == "__main__":
    main()
