"""A scene as messages of Foxglove's schemas: frames, what stands in them, and what changes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..show.scene import Scene
from ..tasks.rotations import quaternion
from .bodies import Body, Shape, take_apart
from .needed import needed

#: topics of frames, of what keeps its shape, of what changes in every picture, and of lines that grow. A
#: viewer that jumps in time looks at the last message of each topic, so each message has all of its topic.
FRAMES, STILL, CHANGING, GROWING = "/tf", "/scene", "/scene/changing", "/scene/growing"
#: what every message type is found in
SCHEMAS = "foxglove_schemas_protobuf"


class Pictures:
    """Messages of a scene.

    Args:
        scene: what is shown.

    Raises:
        MissingDependencyError: Foxglove's schemas are not installed.
    """

    def __init__(self, scene: Scene):
        self._frames, bodies = take_apart(scene.nodes)
        self._still = [body for body in bodies if not body.changes]
        self._growing = [body for body in bodies if body.changes and body.grows]
        self._changing = [body for body in bodies if body.changes and not body.grows]
        self._grown = -1

    def messages(self, k: int, t: float) -> Iterator[tuple[str, Any]]:
        """Topics and messages of picture k, which shows the time t, s; pictures are asked for in order."""
        yield FRAMES, self._transforms(k, t)
        if k == 0 and self._still:
            yield STILL, update(self._still, k, t)
        if self._changing:
            yield CHANGING, update(self._changing, k, t)
        seen = [body for body in self._growing if body.seen(k)]
        if len(seen) != self._grown and self._growing:
            self._grown = len(seen)
            yield GROWING, update(seen, k, t)

    def _transforms(self, k: int, t: float) -> Any:
        found = message("FrameTransforms")
        for frame in self._frames:
            position, turned = (part[min(k, len(part) - 1)] for part in (frame.position, frame.quaternion))
            found.transforms.add(
                timestamp=stamp(t),
                parent_frame_id=frame.parent,
                child_frame_id=frame.name,
                translation=_named(position),
                rotation=_named(turned),
            )
        return found


def message(schema: str) -> Any:
    """An empty message of one of Foxglove's schemas.

    Raises:
        MissingDependencyError: they are not installed.
    """
    return getattr(needed("an MCAP recording", f"{SCHEMAS}.{schema}_pb2"), schema)()


def stamp(t: float) -> dict[str, int]:
    """A time of a run, s, as protobuf writes times."""
    seconds, nanoseconds = divmod(nanoseconds_of(t), 10**9)
    return {"seconds": seconds, "nanos": nanoseconds}


def nanoseconds_of(t: float) -> int:
    """A time of a run in whole nanoseconds."""
    return round(t * 1e9)


def _named(values: np.ndarray) -> dict[str, float]:
    return dict(zip("xyzw", values.tolist(), strict=False))


def update(bodies: Sequence[Body], k: int, t: float) -> Any:
    """A `SceneUpdate` with all these bodies as they are in picture k, which shows the time t, s."""
    found = message("SceneUpdate")
    for body in bodies:
        entity = found.entities.add(timestamp=stamp(t), frame_id=body.frame, id=body.name, frame_locked=True)
        for shape in body.shapes(k):
            _add_shape(entity, shape)
    return found


def _add_shape(entity: Any, shape: Shape) -> None:
    red, green, blue, opacity = shape.color.tolist()
    pose = {"position": _named(shape.position), "orientation": _named(quaternion(shape.rotation))}
    common = {"pose": pose, "color": {"r": red, "g": green, "b": blue, "a": opacity}}
    if shape.vertices is not None and shape.faces is not None:
        points = [{"x": x, "y": y, "z": z} for x, y, z in shape.vertices.tolist()]
        entity.triangles.add(points=points, indices=shape.faces.ravel().tolist(), **common)
        return
    size = _named(shape.size)
    match shape.kind:
        case "box":
            entity.cubes.add(size=size, **common)
        case "ball":
            entity.spheres.add(size=size, **common)
        case _:
            entity.cylinders.add(size=size, bottom_scale=1.0, top_scale=shape.top, **common)
