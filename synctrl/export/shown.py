"""What a recording shows of a run: which instants, and the scene."""

from __future__ import annotations

import numpy as np

from ..checks import positive_number
from ..errors import InputError, RobotWarning, warn
from ..show.cell_scene import scene_of
from ..show.runs import frame_indices
from ..show.scene import Scene
from ..simulation.result import Result

#: the last time that can be recorded, s: some 280 years of nanoseconds
LATEST = 9e9


def picture_instants(result: Result, fps: float) -> np.ndarray:
    """Indices of the logged instants that the pictures of a recording show; none of a run without instants.

    Raises:
        InputError: fps is not positive, there are more pictures than a scene can have, or times that no
            recording can have.
    """
    fps = positive_number("fps", fps)
    if not len(result.t):
        return np.zeros(0, dtype=int)
    if not 0 <= result.t[0] <= result.t[-1] <= LATEST:
        found = result.t[0], result.t[-1]
        raise InputError.expected(f"times from 0 to {LATEST:g} s", found, "result, t")
    return frame_indices(result, fps)


def scene_or_warn(result: Result, fps: float) -> Scene | None:
    """The scene of a run, with so many pictures a second.

    Warns:
        RobotWarning: it cannot be shown, and why; then None is returned.
    """
    try:
        return scene_of(result, fps=fps)
    except InputError as error:
        warn(f"the recording of '{result.info['title']}' has no scene: {error}", RobotWarning)
        return None
