"""Results as MCAP recordings: numbers of all instants, joints, frames and a scene, with a layout beside."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..checks import instance
from ..files import reported, whole_file, write_whole
from ..show.scene import Scene
from ..simulation.result import Result
from .identifiers import identifiers
from .layout import layout
from .names import PAPER
from .needed import needed
from .pictures import SCHEMAS, Pictures, message, nanoseconds_of, stamp
from .quantities import quantities
from .shown import picture_instants, scene_or_warn
from .signals import Signal, numbers_of, signals

#: instants whose numbers are read at a time
ROWS = 1000


def to_mcap(result: Result, path: str | Path, *, fps: float = 30.0) -> Path:
    """Write a result as an MCAP recording and a layout, see `Result.to_mcap`.

    Raises:
        InputError: fps is not positive, or there are more frames than a scene can have, or times that an MCAP
            file cannot have.
        MissingDependencyError: mcap, its support for protobuf, or Foxglove's schemas are not installed.
        ResultError: a file cannot be written.

    Warns:
        RobotWarning: there is no scene, and why.
    """
    instance("path", path, (str, Path), "a path")
    needed("an MCAP recording", "mcap.writer", "mcap_protobuf.schema", f"{SCHEMAS}.JointStates_pb2")
    found, frames = signals(quantities(result)), picture_instants(result, fps)
    scene = scene_or_warn(result, fps) if len(frames) else None
    with reported("write the recording", path), whole_file(path) as file:
        recording = _Recording(file, _about(result, found))
        for each in _messages(result, found, scene, frames):
            recording.write(*each)
        recording.finish()
    beside = Path(path).with_suffix(".layout.json")
    with reported("write the layout", beside):
        write_whole(beside, json.dumps(layout(found, scene), indent=1))
    return Path(path)


def _about(result: Result, found: list[Signal]) -> dict[str, dict[str, str]]:
    """What the file says of the run, and of the numbers of each topic."""
    run = {"title": str(result.info["title"]), "status": result.status, "references": PAPER}
    return {
        "run": {**run, "info": json.dumps(dict(result.info))},
        "quantities": {signal.topic: signal.about() for signal in found},
    }


class _Recording:
    """Messages of protobuf in an MCAP file that begins with some metadata."""

    def __init__(self, file: BinaryIO, about: Mapping[str, dict[str, str]]):
        from mcap.writer import Writer

        self._writer, self._channels = Writer(file), {}  # type: ignore[var-annotated]
        self._writer.start(library="synctrl")
        for name, words in about.items():
            self._writer.add_metadata(name, words)
        self.finish = self._writer.finish

    def write(self, topic: str, found: Any, t: float) -> None:
        """Write a message to a topic, whose messages are all of one type, at a time, s."""
        if topic not in self._channels:
            self._channels[topic] = self._channel(topic, found)
        channel, at = self._channels[topic], nanoseconds_of(t)
        self._writer.add_message(channel, log_time=at, data=found.SerializeToString(), publish_time=at)

    def _channel(self, topic: str, found: Any) -> int:
        from mcap_protobuf.schema import register_schema

        schema = register_schema(self._writer, type(found))
        return int(self._writer.register_channel(topic, message_encoding="protobuf", schema_id=schema))


def _messages(
    result: Result, found: list[Signal], scene: Scene | None, frames: np.ndarray
) -> Iterator[tuple[str, Any, float]]:
    """Topic, message and time of everything, in time."""
    pictures = None if scene is None else Pictures(scene)
    shown = iter(enumerate(frames.tolist()))
    picture, at = next(shown, (0, -1))
    for k, (t, numbers) in enumerate(_instants(result, found)):
        for signal, values in zip(found, numbers, strict=True):
            yield signal.topic, signal.message(values), t
        for topic, joints in _joints(result, k, t):
            yield topic, joints, t
        while pictures is not None and at == k:
            for topic, each in pictures.messages(picture, t):
                yield topic, each, t
            picture, at = next(shown, (0, -1))


def _instants(result: Result, found: list[Signal]) -> Iterator[tuple[float, list[list[float]]]]:
    """Times, and for each signal its numbers then."""
    for start in range(0, len(result.t), ROWS):
        rows = slice(start, start + ROWS)
        numbers = numbers_of(found, rows)
        for k, t in enumerate(result.t[rows].tolist()):
            yield t, [each[k] for each in numbers]


def _joints(result: Result, k: int, t: float) -> Iterator[tuple[str, Any]]:
    """Topic and joint states of each robot at instant k."""
    for i, (topic, robot) in enumerate(zip(identifiers(result.names), result.info["robots"], strict=True)):
        states = message("JointStates")
        states.timestamp.seconds, states.timestamp.nanos = stamp(t).values()
        rows = (array[k, i].tolist() for array in (result.q, result.v, result.tau))
        for name, position, velocity, effort in zip(robot["joints"], *rows, strict=False):
            states.joints.add(name=name, position=position, velocity=velocity, effort=effort)
        yield f"/{topic}/joint_states", states
