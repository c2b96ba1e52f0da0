"""Everything that reads a result, each as a function of it and of the experiment that made it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

from synctrl.analysis.certify import certify
from synctrl.analysis.convergence import convergence, identify
from synctrl.analysis.gain_condition import gain_condition
from synctrl.analysis.lyapunov import lyapunov
from synctrl.analysis.metrics import as_data, metrics, row_names, settling_bands
from synctrl.analysis.modal import modal_bounds
from synctrl.errors import SynctrlError
from synctrl.paper.judge import compare_runs, differences
from synctrl.paper.plant_sections import step_section
from synctrl.show import scene_of
from synctrl.show.animation import (
    error_colors,
    formation_scene,
    payload_pair_scene,
    payload_scene,
    planar_scene,
    vehicle_animation,
)
from synctrl.show.layout import cell_layout
from synctrl.show.lyapunov_plots import lyapunov_figure
from synctrl.show.modal_figures import modal_figure
from synctrl.show.plots import common_limits, joint_trajectories, sync_errors, tracking_errors
from synctrl.show.run_figures import estimates, paths, torques

FIGURES: dict[str, Callable[[Any, Any], Any]] = {
    "joint_trajectories": lambda r, e: joint_trajectories(r, 0),
    "tracking_errors": lambda r, e: tracking_errors(r),
    "sync_errors": lambda r, e: sync_errors(r),
    "sync_errors, limits": lambda r, e: sync_errors(r, common_limits("tracking_error", r)),
    "cell_layout": cell_layout,
    "differences": lambda r, e: differences([compare_runs(r, r)]),
    "torques": lambda r, e: torques(r),
    "paths": lambda r, e: paths(r),
    "estimates": lambda r, e: estimates(r),
    "lyapunov_figure": lambda r, e: lyapunov_figure(lyapunov(r, e)),
    "modal_figure": lambda r, e: modal_figure(modal_bounds(r, e)),
}
SCENES: dict[str, Callable[[Any, Any], Any]] = {
    "planar_scene": planar_scene,
    "payload_pair_scene": payload_pair_scene,
    "formation_scene": lambda r, e: formation_scene(r),
    "payload_scene": lambda r, e: payload_scene(r, (0.1, 0.1, 0.1)),
    "scene_of": scene_of,
    "vehicle_animation": lambda r, e: vehicle_animation(r, 0.1, 0.5),
}
OTHERS: dict[str, Callable[[Any, Any], Any]] = {
    "metrics": lambda r, e: as_data(r, metrics(r)),
    "metrics, bands": lambda r, e: metrics(r, {"tracking_error": 0.1, "sync_error": 0.1}),
    "settling_bands": lambda r, e: settling_bands(r, r),
    "row_names": lambda r, e: row_names(r, "sync_error"),
    "error_colors": lambda r, e: error_colors(r),
    "compare_runs": lambda r, e: compare_runs(r, r),
    "modal_bounds": lambda r, e: str(modal_bounds(r, e)),
    "certify": lambda r, e: str(certify(r, e)),
    "convergence": convergence,
    "gain_condition": gain_condition,
    "identify": identify,
    "step_section": lambda r, e: step_section({"run": r}),
}
CONSUMERS = {**FIGURES, **SCENES, **OTHERS}


def consume(result: Any, experiment: Any, names: list[str] | None = None) -> dict[str, str]:
    """Give a result to all that read one; what each has ended in, a SynctrlError or "done".

    Anything else comes through.
    """
    ended = {}
    for name in CONSUMERS if names is None else names:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of overflow, where numbers are hostile
                found = CONSUMERS[name](result, experiment)
                if name in FIGURES:
                    found.canvas.draw()
                elif name in SCENES:
                    found.page()
            ended[name] = "done"
        except SynctrlError as error:
            ended[name] = type(error).__name__
        except Exception as error:
            error.add_note(f"in {name}")
            raise
    return ended
