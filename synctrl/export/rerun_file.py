"""Results as recordings for Rerun: numbers of all instants and a scene, with the layout inside."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import instance
from ..files import reported, write_whole
from ..show.scene import Scene
from ..simulation.result import Result
from ..tasks.rotations import quaternion
from .bodies import Body, Frame, Shape, as_triangles, take_apart
from .layout import CURVES, PLOTTED
from .needed import needed
from .quantities import Quantity, quantities
from .shown import picture_instants, scene_or_warn

#: where in a recording the scene is, and its timeline
SCENE, TIME = "scene", "time"


def to_rerun(result: Result, path: str | Path, *, fps: float = 30.0) -> Path:
    """Write a result as a recording of Rerun, see `Result.to_rerun`.

    Raises:
        InputError: see `to_mcap`.
        MissingDependencyError: rerun is not installed.
        ResultError: the file cannot be written.

    Warns:
        RobotWarning: there is no scene, and why.
    """
    instance("path", path, (str, Path), "a path")
    rerun = needed("a recording for Rerun", "rerun", extra="rerun")
    frames = picture_instants(result, fps)
    scene = scene_or_warn(result, fps) if len(frames) else None
    stream = rerun.RecordingStream("synctrl", send_properties=False)
    kept = stream.memory_recording()  # files are written by others than the one who could say that it fails
    _log(stream, result, scene, result.t[frames])
    stream.flush()
    with reported("write the recording", path):
        write_whole(path, kept.drain_as_bytes())
    return Path(path)


def _log(stream: Any, result: Result, scene: Scene | None, times: np.ndarray) -> None:
    """All of a result, with a scene whose pictures are at some times, s."""
    import rerun

    found = quantities(result)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    stream.send_recording_name(str(result.info["title"]))
    stream.send_blueprint(_blueprint(found, scene is not None))
    stream.log("info", rerun.TextDocument(json.dumps(dict(result.info))), static=True)
    for each in found:
        _log_quantity(stream, result.t, each)
    if scene is not None:
        _Scene(stream, times).log(scene)


def _log_quantity(stream: Any, t: np.ndarray, quantity: Quantity) -> None:
    """All numbers of a quantity: an entity for each row, or one if there are no columns; a curve for each."""
    import rerun

    rows: dict[str, list[int]] = {}
    for k, entry in enumerate(quantity.entries):
        rows.setdefault(entry.row if entry.column else "", []).append(k)
    numbers, times = quantity.flat(), rerun.TimeColumn(TIME, duration=t)
    for row, columns in rows.items():
        path = rerun.new_entity_path([quantity.name, *filter(None, [row])])
        entries = [quantity.entries[k] for k in columns]
        names = [
            f"{', '.join(filter(None, entry[1:3])) or quantity.name} [{entry.unit}]" for entry in entries
        ]
        stream.log(path, rerun.SeriesLines(names=names), static=True)
        values = numbers[:, columns].astype(float)
        series = rerun.Scalars.columns(scalars=values.ravel()).partition([len(columns)] * len(t))
        stream.send_columns(path, [times], series)


def _blueprint(found: Sequence[Quantity], scene: bool) -> Any:
    """The scene, and plots of errors and torques beside it."""
    import rerun.blueprint as views

    plots = [
        views.TimeSeriesView(origin=f"/{each.name}", name=f"{each.long_name}, {each.unit}")
        for name in PLOTTED
        for each in found
        if each.name == name and 0 < len(each.entries) <= CURVES
    ]
    parts = [views.Spatial3DView(origin=f"/{SCENE}", name="Cell")] if scene else []
    return views.Blueprint(views.Horizontal(*parts, views.Vertical(*plots)), collapse_panels=True)


class _Scene:
    """What a scene shows, told to a recording.

    Args:
        stream: the recording.
        times: of the pictures, s.
    """

    def __init__(self, stream: Any, times: np.ndarray):
        self._stream, self._times = stream, times

    def log(self, scene: Scene) -> None:
        """Frames, what stands in them, and how it changes."""
        frames, bodies = take_apart(scene.nodes)
        for frame in frames:
            self._move(frame)
        for body in bodies:
            if body.grows:
                seen = [k for k in range(len(self._times)) if body.seen(k)]
                self._draw(body, seen[:1])
            elif body.changes:
                self._draw(body, range(len(self._times)))
            else:
                self._put(body, 0, static=True)

    def _move(self, frame: Frame) -> None:
        import rerun

        path = rerun.new_entity_path([SCENE, *frame.name.split("/")])
        if max(len(frame.position), len(frame.quaternion)) == 1:
            still = rerun.Transform3D(translation=frame.position[0], quaternion=frame.quaternion[0])
            self._stream.log(path, still, static=True)
            return
        count = len(self._times)
        position, turned = (
            np.broadcast_to(part, (count, part.shape[1])) for part in (frame.position, frame.quaternion)
        )
        columns = rerun.Transform3D.columns(translation=position, quaternion=turned)
        self._stream.send_columns(path, [rerun.TimeColumn(TIME, duration=self._times)], columns)

    def _draw(self, body: Body, pictures: Sequence[int]) -> None:
        for k in pictures:
            self._stream.set_time(TIME, duration=float(self._times[k]))
            self._put(body, k, static=False)

    def _put(self, body: Body, k: int, *, static: bool) -> None:
        for number, shape in enumerate(body.shapes(k), start=1):
            path = [SCENE, *body.name.split("/"), f"shape {number}"]
            self._stream.log(path, _archetype(shape), static=static)


def _archetype(shape: Shape) -> Any:
    """A shape as Rerun has it; cones, which it has not, are triangles."""
    import rerun

    if shape.kind == "triangles" or shape.top != 1:
        vertices, faces, normals = as_triangles(shape)
        return rerun.Mesh3D(
            vertex_positions=vertices,
            triangle_indices=faces,
            vertex_normals=normals,
            albedo_factor=shape.color,
        )
    place = {
        "centers": [shape.position],
        "quaternions": [quaternion(shape.rotation)],
        "colors": [shape.color],
        "fill_mode": "solid",
    }
    match shape.kind:
        case "box":
            return rerun.Boxes3D(half_sizes=[shape.size / 2], **place)
        case "ball":
            return rerun.Ellipsoids3D(half_sizes=[shape.size / 2], **place)
        case _:
            return rerun.Cylinders3D(lengths=[shape.size[2]], radii=[shape.size[0] / 2], **place)
