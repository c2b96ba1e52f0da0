"""Runs side by side in one page that plays them at one time, with marks that mean the same in all of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..checks import instance, label
from ..errors import InputError
from ..simulation.result import Result
from .carried_scene import largest_bead_error, largest_force
from .cell_scene import FPS, scene_of
from .html import page
from .meshes import MeshLibrary
from .scene import Scene
from .shown import Shown


class SideBySide(Shown):
    """Scenes next to one another, all seen from one place: turning one turns all.

    Args:
        title: of the page.
        scenes: from left to right, with the same number of frames per second.

    Raises:
        InputError: no scenes, or some that play at different rates.
    """

    def __init__(self, title: str, *scenes: Scene):
        self.title = label("title", title)
        for k, scene in enumerate(scenes, start=1):
            instance(f"scene {k}", scene, Scene, "a Scene")
        rates = tuple(scene.fps for scene in scenes)
        if len({*rates}) != 1:
            raise InputError.expected("scenes with the same frames per second", rates, "scenes")
        self.scenes = scenes

    def page(self) -> str:
        """All scenes as the text of a self-contained HTML page."""
        boxes = np.array([scene.box() for scene in self.scenes])
        box = np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
        return page(self.title, *(scene.pane(box) for scene in self.scenes))


def side_by_side(runs: Mapping[str, Result], *, fps: float = FPS) -> SideBySide:
    """Runs of one cell next to one another, each under its name.

    What is fully red, and how long an arrow is for a force, is the same for all runs.

    Args:
        runs: by name, from left to right.
        fps: frames per second.

    Raises:
        InputError: no runs, or what `scene_of` refuses.
    """
    instance("runs", runs, Mapping, "runs by name")
    for name, run in runs.items():
        instance(f"runs, {name}", run, Result, "a Result")
    limit = max((float(np.linalg.norm(run.sync_error, axis=2).max()) for run in runs.values()), default=0.0)
    force, bead = largest_force(*runs.values()), largest_bead_error(*runs.values())
    alike: Any = {"limit": limit or None, "force": force or None, "bead_error": bead or None}
    scenes, meshes = [], MeshLibrary()
    for name, run in runs.items():
        scene = scene_of(run, **alike, fps=fps, meshes=meshes)
        scene.title = label("name", name)
        scenes.append(scene)
    return SideBySide(", ".join(runs), *scenes)
