"""The layout with which Foxglove opens a recording: the scene, and plots of errors and torques beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..show.scene import Scene
from .bodies import WORLD, take_apart
from .pictures import CHANGING, GROWING, STILL
from .signals import Signal

#: what is plotted, from above
PLOTTED = ("tracking_error", "sync_error", "tau")
#: curves of a plot at most
CURVES = 40
#: how far the camera is from the middle of a scene, as a multiple of half its size
FAR = 3.0


def layout(found: Sequence[Signal], shown: Scene | None) -> dict[str, Any]:
    """A layout of Foxglove.

    Args:
        found: the signals of the recording.
        shown: the scene of the recording, if it has one.
    """
    panels = {} if shown is None else {"3D!scene": _scene(shown)}
    plots = [signal for name in PLOTTED for signal in found if signal.quantity.name == name]
    ids = [f"Plot!{signal.quantity.name}" for signal in plots]
    panels |= dict(zip(ids, map(_plot, plots), strict=True))
    column = _stacked(ids)
    scene: Any = "3D!scene" if shown is not None else None
    both = {"first": scene, "second": column, "direction": "row", "splitPercentage": 55}
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": both if scene and column else scene or column,
    }


def _stacked(ids: Sequence[str]) -> Any:
    """Panels one above the other, all as high."""
    if len(ids) < 2:
        return ids[0] if ids else None
    share = 100 / len(ids)
    return {"first": ids[0], "second": _stacked(ids[1:]), "direction": "column", "splitPercentage": share}


def _scene(shown: Scene) -> Mapping[str, Any]:
    box, frames = shown.box(), take_apart(shown.nodes)[0]
    size = float(np.linalg.norm(box[1] - box[0])) or 1.0
    return {
        "cameraState": {
            "perspective": True,
            "distance": FAR * size / 2,
            "phi": 65,
            "thetaOffset": 40,
            "targetOffset": box.mean(axis=0).tolist(),
            "target": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.001 * size,
            "far": 1000 * size,
        },
        "followMode": "follow-none",
        "followTf": WORLD,
        "scene": {"transforms": {"showLabel": False, "axisScale": 0.1 * size}},
        "transforms": {
            f"frame:{name}": {"visible": False} for name in (WORLD, *(each.name for each in frames))
        },
        "topics": {topic: {"visible": True} for topic in (STILL, CHANGING, GROWING)},
        "layers": {"grid": _grid(size)},
        "publish": {},
        "imageMode": {},
        "foxglovePanelTitle": "Cell",
    }


def _grid(size: float) -> dict[str, Any]:
    """The ground: squares of a tenth of the power of ten above the size of the scene."""
    width = 10.0 ** np.ceil(np.log10(size))
    return {
        "layerId": "foxglove.Grid",
        "instanceId": "grid",
        "label": "Ground",
        "visible": True,
        "frameLocked": True,
        "frameId": WORLD,
        "size": width,
        "divisions": 10,
        "lineWidth": 1,
        "color": "#b0b6bdff",
        "position": [0, 0, 0],
        "rotation": [0, 0, 0],
    }


def _plot(signal: Signal) -> Mapping[str, Any]:
    entries = zip(signal.paths, signal.quantity.entries, strict=True)
    return {
        "paths": [
            {
                "value": f"{signal.topic}.{path}",
                "enabled": True,
                "timestampMethod": "receiveTime",
                "label": ", ".join(filter(None, (entry.row, entry.column))),
            }
            for path, entry in list(entries)[:CURVES]
        ],
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": False,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "yAxisLabel": signal.quantity.unit,
        "sidebarDimension": 240,
        "foxglovePanelTitle": f"{signal.quantity.long_name}, {signal.quantity.unit}",
    }
