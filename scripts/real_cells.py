"""Run the ready cells of real robots and write their animations to out/.

python scripts/real_cells.py [folder]
"""

from __future__ import annotations

import sys
from pathlib import Path

from synctrl import Result
from synctrl.experiments import mixed_four, panda_four, ur5_payload
from synctrl.experiments.ur5_payload import PAYLOAD
from synctrl.show.animation import formation_scene, payload_scene
from synctrl.show.scene import Scene


def payload(result: Result) -> Scene:
    """The UR5 pair with its payload."""
    return payload_scene(result, PAYLOAD)


CELLS = {
    "panda_four": (panda_four, formation_scene),
    "mixed_four": (mixed_four, formation_scene),
    "ur5_payload": (ur5_payload, payload),
}


def main(folder: Path, duration: float | None = None) -> list[Path]:
    """Write one HTML file per cell, synchronized and independent."""
    written = []
    for name, (cell, scene) in CELLS.items():
        for kind, synchronized in (("synchronized", True), ("independent", False)):
            result = cell(synchronized=synchronized).simulate(duration, dt=2e-3)
            path = scene(result).write(folder / f"{name}_{kind}.html")
            print(f"{path}  {path.stat().st_size / 1e6:.1f} MB")
            written.append(path)
    return written


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
