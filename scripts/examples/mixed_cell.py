"""A mixed cell: a UR5, a UR10, a Panda and an xArm7 hold a formation that goes round a tilted circle.

Arms of different kinds have no joints in common, but they have tips. The ring compares neighbours.
"""

from example import arguments

from synctrl.experiments import mixed_four
from synctrl.show import scene_of
from synctrl.show.curves import Curves, overlay
from synctrl.show.plots import save

out, short = arguments(__doc__)
duration = 0.05 if short else 4.0
together = mixed_four().simulate(duration, dt=2e-3)
alone = mixed_four(synchronized=False).simulate(duration, dt=2e-3)
scene_of(together).write(out / "mixed_cell.html")


def sizes(run):
    """The largest of the synchronization errors, and of the tracking errors, in one panel each."""
    largest = {"synchronization": run.sync_error, "tracking": run.tracking_error}
    return [
        Curves(
            f"largest {name} error", "mm", 1e3 * (e**2).sum(axis=2).max(axis=1, keepdims=True) ** 0.5, [name]
        )
        for name, e in largest.items()
    ]


save(overlay(sizes, {"synchronized": together, "independent": alone}), out / "mixed_cell")
