"""What hands hold, in a scene: the object, the hands, forces inside as arrows, and adhesive as it is laid.

All of it is drawn from what a run logged and says of itself, so loaded runs are drawn as fresh ones are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..assembly.body import place_of
from ..checks import positive_number
from ..robots.robot import Robot
from ..simulation.result import Result
from ..tasks.rotations import quaternion
from .arms import error_color, tip_positions
from .runs import check_output
from .scene import Scene
from .style import ACCENT, DESIRED, read_color, robot_color

#: colours of an object that hands carry, of a wrist, and of a bead that is where it should be
CARRIED, DARK, LAID = "#b9b2a3", "#3c434b", np.array([0.16, 0.62, 0.36])
#: colour of a hand that is open, and how much wider than a closed one it is
OPEN, SPREAD = "#aab4c0", 1.3
#: as shares of the reach of the arms: radius of an arrow and length of the longest, widths of a bead and of a
#: path, radii of the wrist and of the palm of a hand, and the thickness of that
SHAFT, ARROW, BEAD, LINE, WRIST, PALM, THICK = 0.009, 0.3, 0.009, 0.006, 0.026, 0.045, 0.02
#: likewise radii of a bar under a plate, and of the body and of the needle of a nozzle
BAR, BODY, NEEDLE = 0.012, 0.02, 0.007
#: of the way from the last joint to the point of a nozzle, how far its body goes; and how far from the middle
#: of a plate, of the way back to the last joint, the bar under it ends
SLENDER, UNDER = 0.7, 0.3
#: forces below which a run is drawn as one without, N, and errors of beads below which they are, m
NO_FORCE, NO_ERROR = 1e-9, 1e-9


def holders(result: Result) -> list[int]:
    """Which robots hold an object or lay adhesive on it, counted from 0."""
    edge = result.info.get("edge", {})
    on_edge = [int(edge[name]) for name in ("carrier", "nozzle") if name in edge]
    return [int(grasp["robot"]) for grasp in result.info.get("grasps", ())] + on_edge


def layers(result: Result) -> list[int]:
    """Which robot lays each bead, counted from 0."""
    if "bead_points" not in result.outputs:
        return []
    edge, count = result.info.get("edge", {}), result.outputs["bead_points"].shape[1]
    return [int(edge["nozzle"])] if "nozzle" in edge else [*range(count)]


def largest_force(*results: Result) -> float:
    """The largest internal force at any hand of some runs, N; 0 where they have none."""
    return max((float(_size(run, "internal_force").max()) for run in results), default=0.0)


def largest_bead_error(*results: Result) -> float:
    """The largest error of any bead of some runs, m; 0 where they have none."""
    return max((float(_size(run, "bead_error").max()) for run in results), default=0.0)


def add_carried(
    scene: Scene,
    result: Result,
    robots: Sequence[Robot],
    frames: np.ndarray,
    force: float | None,
    bead_error: float | None,
    scale: float,
) -> list[str]:
    """All that the functions below add to a scene; returns what a caption says of it."""
    add_object(scene, result, robots, frames, scale)
    for i in layers(result):
        _add_nozzle(scene, result, robots, i, frames, scale)
    return [
        add_forces(scene, result, frames, force, scale),
        add_beads(scene, result, frames, bead_error, scale),
    ]


def add_object(
    scene: Scene, result: Result, robots: Sequence[Robot], frames: np.ndarray, scale: float
) -> None:
    """The object of a run as it moved, its desired path, and the hands that hold it.

    Args:
        scene: what it is added to.
        result: the run; nothing is added to the scene of one without an object.
        robots: its robots.
        frames: indices of the logged instants that are shown.
        scale: reach of the arms, m.
    """
    about = _about(result)
    if about is None:
        return
    place, R = _poses(result, frames)
    center, turned = place + R @ np.array(about["center"]), quaternion(R)
    if about.get("box") is not None:
        scene.add_box(about["name"], about["box"], center, CARRIED, turned)
    elif about.get("outline") is not None:
        rim = about["outline"]
        scene.add_prism(about["name"], rim["points"], rim["thickness"], center, CARRIED, turned)
    if about.get("box") is not None or about.get("outline") is not None:
        scene.add_legend(about["name"], CARRIED)
    _add_desired(scene, result, frames, about["name"], scale)
    for i in sorted({int(grasp["robot"]) for grasp in result.info.get("grasps", ())}):
        wrist, hand, closed = (part[frames] for part in _hand(result, robots[i], i))
        _add_hand(scene, result.names[i], wrist, hand, closed, scale, robot_color(i))
    if "hand_closed" in result.outputs:
        scene.add_legend("open hand", OPEN)
    if "edge" in result.info:
        _add_bar(scene, result, robots, frames, scale)


def add_forces(scene: Scene, result: Result, frames: np.ndarray, limit: float | None, scale: float) -> str:
    """An arrow at every hand as long as the internal force there; returns what a caption says of it.

    Args:
        scene: what they are added to.
        result: the run.
        frames: indices of the logged instants that are shown.
        limit: force of the longest arrow, N; by default the largest of the run.
        scale: reach of the arms, m.
    """
    largest = largest_force(result) if limit is None else positive_number("force", limit)
    if "grasps" not in result.info or "internal_force" not in result.outputs or largest < NO_FORCE:
        return ""
    place, R = _poses(result, frames)
    length = ARROW * scale / largest
    forces = result.outputs["internal_force"][frames]
    for k, grasp in enumerate(result.info["grasps"]):
        along = np.zeros((len(frames), 3))
        along[:, : min(3, forces.shape[2])] = length * forces[:, k, :3]
        start, name = place + R @ np.array(grasp["arm"]), _grasp_name(result, k)
        scene.add_arrow(f"force inside at {name}", start, along, SHAFT * scale, ACCENT)
    scene.add_legend(f"internal force, {100 * ARROW * scale:.0f} cm for {largest:.3g} N", ACCENT)
    return "Arrows: what hands do to the object beyond carrying it, also where it hides them."


def add_beads(scene: Scene, result: Result, frames: np.ndarray, limit: float | None, scale: float) -> str:
    """Adhesive as it is laid, in the colour of its error; returns what a caption says of it.

    Beads of a run with an object are in its axes and go with it; else they are in the world.

    Args:
        scene: what they are added to.
        result: the run.
        frames: indices of the logged instants that are shown.
        limit: error that is fully red, m; by default the largest of the run.
        scale: reach of the arms, m.
    """
    if "bead_points" not in result.outputs:
        return ""
    points = check_output(result, "bead_points")[frames]
    largest = largest_bead_error(result) if limit is None else positive_number("bead_error", limit)
    share = np.clip(_size(result, "bead_error")[frames] / max(largest, NO_ERROR), 0, 1)
    colors = error_color(share, LAID)
    axes: Any = {}
    if "object_pose" in result.outputs:
        place, R = _poses(result, frames)
        axes = {"position": place, "quaternion": quaternion(R)}
    for k in range(points.shape[1]):
        scene.add_trail(f"bead {k + 1}", points[:, k], colors[:, k], BEAD * scale, **axes)
    for part in (0.0, 0.5, 1.0):
        scene.add_legend(f"bead off by {1e3 * part * largest:.2g} mm", error_color(np.array(part), LAID))
    return "The bead keeps the colour of the error with which it was laid."


def _about(result: Result) -> Mapping[str, Any] | None:
    """What a run says of its object, if it has one."""
    about = result.info.get("object")
    return about if "object_pose" in result.outputs and isinstance(about, Mapping) else None


def _poses(result: Result, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return place_of(check_output(result, "object_pose")[frames])


def _size(result: Result, name: str) -> np.ndarray:
    """Lengths of the first three entries of an output, for each hand or bead, (T, k); 0 without it."""
    if name not in result.outputs:
        return np.zeros((len(result.t), 1))
    values = check_output(result, name)
    values = values[:, None] if values.ndim == 2 else values
    return np.linalg.norm(values[..., :3], axis=2)


def _add_desired(scene: Scene, result: Result, frames: np.ndarray, name: str, scale: float) -> None:
    desired = result.outputs.get("object_desired")
    if desired is not None and np.isfinite(desired).all():
        scene.add_line(f"desired path of {name}", desired[frames, :3], DESIRED, LINE * scale)
        scene.add_legend(f"desired path of the {name}", DESIRED)


def _grasp_name(result: Result, k: int) -> str:
    """The name of the robot of a grasp, with a number from its second grasp on."""
    held = [int(grasp["robot"]) for grasp in result.info["grasps"]]
    before = held[:k].count(held[k])
    return result.names[held[k]] + (f", grasp {before + 1}" if before else "")


def _last_joint(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the last joint before the tip is, (T, 3), m, and its axes, (T, 3, 3)."""
    there = robot.with_tip(robot.joint_frames[robot.model.frames[robot.tip_id].parentJoint - 1])
    poses = [there.tip_pose(row[: robot.nv]) for row in q]
    return np.array([pose.translation for pose in poses]), np.array([pose.rotation for pose in poses])


def _hand(result: Result, robot: Robot, i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Over time the last joint of robot i and its hand, (T, 3) each, m, and whether that is closed, (T,).

    A closed hand is where it holds the object, and an open one where its link has it.
    """
    (p, R), (wrist, axes) = place_of(check_output(result, "object_pose")), _last_joint(robot, result.q[:, i])
    own = [k for k, grasp in enumerate(result.info["grasps"]) if grasp["robot"] == i]
    places = [p + R @ np.array(result.info["grasps"][k]["arm"]) for k in own]
    if "hand_closed" not in result.outputs:
        return wrist, places[0], np.ones(len(p), dtype=bool)
    closed = check_output(result, "hand_closed")[:, own] > 0
    held = int(np.flatnonzero(closed[:, 0])[-1]) if closed[:, 0].any() else 0
    hand = wrist + axes @ axes[held].T @ (places[0][held] - wrist[held])
    for place, holds in zip(places, closed.T, strict=True):
        hand = np.where(holds[:, None], place, hand)
    return wrist, np.asarray(hand), np.asarray(closed.any(axis=1))


def _add_hand(
    scene: Scene,
    name: str,
    wrist: np.ndarray,
    place: np.ndarray,
    closed: np.ndarray,
    scale: float,
    color: str,
) -> None:
    """A palm at `place`, (T, 3), wide and grey where it is open, and a bar from the wrist, (T, 3)."""
    way = place - wrist
    lengths = np.linalg.norm(way, axis=1, keepdims=True)
    palm = place - way * np.minimum(THICK * scale / np.maximum(lengths, 1e-9), 1.0)
    scene.add_segment(f"wrist of {name}", wrist, palm, WRIST * scale, DARK)
    radius = np.where(closed, 1.0, SPREAD) * PALM * scale
    tint = np.where(closed[:, None], read_color(name, color)[:3], read_color(name, OPEN)[:3])
    scene.add_segment(f"hand of {name}", palm, place, radius, tint)


def _add_bar(scene: Scene, result: Result, robots: Sequence[Robot], frames: np.ndarray, scale: float) -> None:
    """A bar under a plate, from the last joint of the robot that carries it."""
    about, i = result.info["object"], int(result.info["edge"]["carrier"])
    (p, R), (wrist, _) = _poses(result, frames), _last_joint(robots[i], result.q[frames, i])
    thickness = about["outline"]["thickness"] if about.get("outline") else (about.get("box") or [0.0])[-1]
    center = np.array(about["center"])
    end = center + UNDER * (R[0].T @ (wrist[0] - p[0]) - center)
    end[2] = center[2] - thickness
    scene.add_segment(f"hand of {result.names[i]}", wrist, p + R @ end, BAR * scale, DARK)


def _add_nozzle(
    scene: Scene, result: Result, robots: Sequence[Robot], i: int, frames: np.ndarray, scale: float
) -> None:
    """The body of a nozzle from the last joint on, and a needle from there to its point."""
    wrist, _ = _last_joint(robots[i], result.q[frames, i])
    point = tip_positions([robots[i]], result.q[frames, i : i + 1])[:, 0]
    end, name = wrist + SLENDER * (point - wrist), result.names[i]
    scene.add_segment(f"body of the nozzle of {name}", wrist, end, BODY * scale, DARK)
    scene.add_segment(f"nozzle of {name}", end, point, NEEDLE * scale, robot_color(i))
