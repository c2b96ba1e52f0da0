"""Ready cells in motion: the paper's arms and vehicle, and real robots in formation or with a payload."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, positive_number
from ..errors import InputError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from ..tasks import rotations
from ..tasks.poses import Attached
from .arms import add_bars, add_disturbances, arms_scene, error_color, error_share, tip_positions
from .nodes import towards
from .runs import check_axes, check_run, frame_indices, frame_times, shown_experiment
from .scene import Scene
from .style import DESIRED, robot_color

LINE = 0.008  # m
THIN, THICK = 0.006, 0.022  # m, radius of a bar without and with the largest synchronization error
BALL = 0.016  # m, radius of a tip
PAYLOAD = (0.5, 0.08, 0.05)  # m
PLANAR_TIMES, PAIR_TIMES = 10.0, 20.0  # how much larger tracking errors are drawn
FPS = 30.0
FINE, BAR, TIP = 0.005, 0.008, 0.018  # m, of real robots: a desired path, a bar and a tip
#: synchronization error of real robots that is shown fully red, as a share of the largest of the run
RED = 0.3
#: arrays of a run that its scene is made of
DRAWN = "x", "x_desired", "sync_error", "q", "disturbance"


def planar_scene(
    result: Result, experiment: Experiment | None = None, limit: float | None = None, fps: float = FPS
) -> Scene:
    """Planar arms with their desired paths, and bars between the tips of robots that are compared.

    A bar grows and turns red with the synchronization error of its robots, see `add_bars`. A thin bar in the
    colour of its robot leads from where a tip should be to where it would be if its error were
    `PLANAR_TIMES` as large.

    Args:
        result: a run in Cartesian space along x and y.
        experiment: what made it; needed for a result loaded from a file.
        limit: synchronization error that is fully red; by default the largest of the run. Animations that are
            compared share it.
        fps: frames per second.

    Raises:
        InputError: a run in another space, or one without its experiment.
    """
    check_run(result, *DRAWN)
    check_axes(result, "x", "y")
    share, limit = error_share(result, limit)
    caption = (
        f"Bars between compared tips: synchronization error, thick and red from {_shown(result, limit)}. "
        f"Thin bars at the tips: tracking error, {PLANAR_TIMES:g} times as large. Dark lines: desired paths."
    )
    frames = frame_indices(result, fps)
    robots = shown_experiment(result, experiment).cell.robots
    scene = arms_scene(result, robots, frames, fps, caption, [robot_color(i) for i in range(len(robots))])
    height = float(robots[0].tip_position(result.q[0, 0, : robots[0].nv])[2])
    tips, desired = (np.insert(x[frames], 2, height, axis=2) for x in (result.x, result.x_desired))
    for k, compared in enumerate(result.info["pairs"]):
        shown = share[frames, k]
        radius = THIN + shown * (THICK - THIN)
        add_bars(scene, result, f"error {k + 1}", compared, tips, radius, error_color(shown))
    _add_tracking(scene, result, desired, tips, PLANAR_TIMES)
    add_disturbances(scene, result, robots, frames)
    return scene


def payload_pair_scene(
    result: Result, experiment: Experiment | None = None, limit: float | None = None, fps: float = FPS
) -> Scene:
    """Two arms that carry a level payload between their wrists.

    The payload is drawn, not simulated: a box midway between the wrists and along the line through them. It
    turns red with the synchronization error. A thin bar in the colour of its robot leads from where a wrist
    should be to where it would be if its error were `PAIR_TIMES` as large.

    Args:
        result: a run of two robots in joint space.
        experiment: what made it; needed for a result loaded from a file.
        limit: synchronization error that is fully red; by default the largest of the run.
        fps: frames per second.

    Raises:
        InputError: a run of other robots or in another space, or one without its experiment.
    """
    check_run(result, *DRAWN)
    found = result.x.shape[1], result.info["task_unit"]
    if found != (2, "rad"):
        words = f"expected two robots in joint space, found {found[0]} with coordinates in {found[1]}"
        raise InputError(words, subject="result", found=found)
    share, limit = error_share(result, limit)
    caption = (
        f"The payload is drawn, not simulated; fully red from {_shown(result, limit)} of synchronization "
        f"error. Thin bars at the wrists: tracking error, {PAIR_TIMES:g} times as large. "
        "Dark lines: desired paths."
    )
    frames = frame_indices(result, fps)
    robots = shown_experiment(result, experiment).cell.robots
    scene = arms_scene(result, robots, frames, fps, caption)
    wrists, desired = (tip_positions(robots, q[frames]) for q in (result.q, result.x_desired))
    color, along = error_color(share[frames].max(axis=1)), wrists[:, 1] - wrists[:, 0]
    scene.add_box("payload", PAYLOAD, wrists.mean(axis=1), color, quaternion=towards(along, axis=(1, 0, 0)))
    _add_tracking(scene, result, desired, wrists, PAIR_TIMES)
    add_disturbances(scene, result, robots, frames)
    return scene


def _add_tracking(scene: Scene, result: Result, desired: np.ndarray, tips: np.ndarray, times: float) -> None:
    """Desired paths, and tracking errors drawn larger than they are; positions are (T, n, 3)."""
    for i, name in enumerate(result.names):
        scene.add_line(f"desired path of {name}", desired[:, i], DESIRED, LINE)
        far = desired[:, i] + times * (tips[:, i] - desired[:, i])
        scene.add_segment(f"error of {name}", desired[:, i], far, THIN, robot_color(i))
        scene.add_sphere(f"end of error of {name}", BALL, far, robot_color(i))


def _shown(result: Result, size: float) -> str:
    """A synchronization error for the caption: degrees for rad, else its own unit."""
    unit = result.unit("sync_error")
    return f"{np.rad2deg(size):.2g} deg" if unit == "rad" else f"{size:.2g} {unit}"


def formation_scene(result: Result, fps: float = 25) -> Scene:
    """Arms with their desired paths, and a bar between the tips of every pair that is compared.

    A bar turns from grey to red with the synchronization error of its pair.

    Args:
        result: a run in Cartesian space along x, y, z, still with its experiment.
        fps: frames per second.

    Raises:
        InputError: a run in another space, or one without its experiment.
    """
    check_run(result, *DRAWN)
    check_axes(result, "x", "y", "z")
    frames = frame_indices(result, fps)
    caption = "Bars between compared tips turn red with the synchronization error."
    scene = arms_scene(result, shown_experiment(result, None).cell.robots, frames, fps, caption)
    tips = result.x[frames]
    for i, name in enumerate(result.names):
        scene.add_line(f"desired path of {name}", result.x_desired[frames, i], robot_color(i), FINE)
        scene.add_sphere(f"tip of {name}", TIP, tips[:, i], robot_color(i))
    colors = error_colors(result)[frames]
    for k, compared in enumerate(result.info["pairs"]):
        add_bars(scene, result, f"pair {k + 1}", compared, tips, BAR, colors[:, k])
    return scene


def payload_scene(result: Result, size: ArrayLike, fps: float = 25) -> Scene:
    """Two arms whose hands hold a box that lies midway between where each of them holds it.

    The box turns from grey to red with the synchronization error; it is drawn, not simulated.

    Args:
        result: a run in pose space with `Attached` desired motions, still with its experiment.
        size: of the box in the payload's axes, (3,), m.
        fps: frames per second.

    Raises:
        InputError: a run of other desired motions, or one without its experiment.
    """
    check_run(result, *DRAWN)
    frames = frame_indices(result, fps)
    caption = "The payload turns red with the synchronization error; it has no mass."
    cell = shown_experiment(result, None).cell
    scene = arms_scene(result, cell.robots, frames, fps, caption)
    hands = [hand for member in cell.members if isinstance(hand := member.trajectory, Attached)]
    if not len(hands) == cell.n == 2:
        words = "expected two robots whose desired motions are Attached to a payload"
        raise InputError(words, subject="result", found=tuple(type(hand).__name__ for hand in hands))
    position, orientation = _held(result.x[frames], hands)
    extent = finite_array("size", size, (3,))
    color = error_colors(result)[frames, 0]
    scene.add_box("payload", extent, position, color, rotations.quaternion(orientation))
    scene.add_line("desired path", hands[0].body(result.t[frames]).x[:, :3], DESIRED, FINE)
    scene.add_legend("desired path of the payload", DESIRED)
    return scene


def error_colors(result: Result) -> np.ndarray:
    """A colour per instant and pair, (T, p, 3), which reddens with the synchronization error."""
    check_run(result, "sync_error")
    size = np.linalg.norm(result.sync_error[:, :, :3], axis=2)
    return error_color(np.clip(size / max(RED * float(size.max()), 1e-12), 0, 1))


def _held(x: np.ndarray, hands: list[Attached]) -> tuple[np.ndarray, np.ndarray]:
    """Position, (T, 3), and orientation, (T, 3, 3), midway between where the two hands hold the payload."""
    first, second = (rotations.exp(x[:, i, 3:]) @ hand.rotation.T for i, hand in enumerate(hands))
    half = 0.5 * rotations.log(second @ np.swapaxes(first, 1, 2))
    places = [
        x[:, i, :3] - R @ hand.xyz for i, (R, hand) in enumerate(zip((first, second), hands, strict=True))
    ]
    return 0.5 * (places[0] + places[1]), rotations.exp(half) @ first


# -- a vehicle with two driven wheels, as their angles move it over the ground ------------------------------

BODY, WHEEL, SPOKE, NOSE = "#c9d3de", "#26282b", "#ee8730", "#2f6fb3"
WANTED, DRIVEN = "#3a9d5d", "#c2403a"
LANE = 0.012  # m, width of its paths
X, Y, Z = np.eye(3)


def vehicle_path(angles: ArrayLike, wheel_radius: float, track: float) -> np.ndarray:
    """Where wheels that roll without slip take a vehicle that starts at the origin, towards +x.

    The heading is r (q_2 - q_1) / b. Between two instants the centre between the wheels moves on an arc.

    Args:
        angles: of the left and the right wheel, (T, 2), rad.
        wheel_radius: r, m.
        track: distance b of the wheels, m.

    Returns:
        x, y and heading, (T, 3), in m and rad.
    """
    q = finite_array("angles", angles, (None, 2))
    way = positive_number("wheel_radius", wheel_radius) * (q - q[:1])
    heading = (way[:, 1] - way[:, 0]) / positive_number("track", track)
    turn, arc = np.diff(heading), np.diff(way.mean(axis=1))
    chord = arc * np.sinc(turn / (2 * np.pi))
    middle = heading[:-1] + turn / 2
    steps = chord[:, None] * np.stack([np.cos(middle), np.sin(middle)], axis=1)
    return np.column_stack([np.vstack([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), heading])


def vehicle_animation(result: Result, wheel_radius: float, track: float, fps: float = 30) -> Scene:
    """The vehicle of a run with two wheels, left and right, driving its path.

    Args:
        result: a run of two robots with one joint each, in joint space.
        wheel_radius, track: of the vehicle, m.
        fps: frames per second.

    Raises:
        InputError: a run of other robots.
    """
    check_run(result, "x", "x_desired")
    n, m = result.x.shape[1:]
    if (n, m) != (2, 1):
        found = f"{n} robots with {m} coordinates"
        raise InputError.expected("two wheels with one angle each", (n, m), "result", shown=found)
    times = frame_times(result, fps)
    frames = np.searchsorted(0.5 * (result.t[1:] + result.t[:-1]), times)  # the nearest logged instants
    driven = vehicle_path(result.x[:, :, 0], wheel_radius, track)
    desired = vehicle_path(result.x_desired[:, :, 0], wheel_radius, track)
    scene = Scene(fps=fps, title=str(result.info["title"]), caption="The wheels' angles move the vehicle.")
    for name, path, color, height in (("desired", desired, WANTED, 0.0), ("driven", driven, DRIVEN, LANE)):
        scene.add_line(f"{name} path", np.column_stack([path[frames, :2], 0 * times + height]), color, LANE)
        scene.add_legend(f"{name} path", color)
    _add_body(scene, driven[frames], wheel_radius, track)
    for i, name in enumerate(("left wheel", "right wheel")):
        side = (0.5, -0.5)[i] * track
        _add_wheel(scene, name, driven[frames], result.x[frames, i, 0], side, wheel_radius)
    return scene


def _add_body(scene: Scene, poses: np.ndarray, r: float, track: float) -> None:
    turned = rotations.quaternion(_heading(poses))
    size = np.array([1.1 * track, 0.7 * track, 0.5 * r])
    scene.add_box("body", size, _at(poses, 0.15 * track, 0.0, 1.2 * r), BODY, turned)
    scene.add_sphere("caster", 0.35 * r, _at(poses, 0.55 * track, 0.0, 0.35 * r), WHEEL)
    scene.add_box("nose", size * [0.1, 0.5, 0.6], _at(poses, 0.7 * track, 0.0, 1.2 * r), NOSE, turned)


def _add_wheel(scene: Scene, name: str, poses: np.ndarray, angle: np.ndarray, side: float, r: float) -> None:
    rolled = _heading(poses) @ rotations.exp(np.outer(angle, Y))
    axle = rolled @ rotations.exp(np.pi / 2 * X)
    centre = _at(poses, 0.0, side, r)
    scene.add_cylinder(name, r, 0.35 * r, centre, WHEEL, rotations.quaternion(axle))
    size = [1.7 * r, 0.4 * r, 0.3 * r]
    scene.add_box(f"spoke of {name}", size, centre, SPOKE, rotations.quaternion(rolled))


def _heading(poses: np.ndarray) -> np.ndarray:
    """Orientations of the vehicle, (T, 3, 3)."""
    return rotations.exp(np.outer(poses[:, 2], Z))


def _at(poses: np.ndarray, ahead: float, left: float, height: float) -> np.ndarray:
    """A point of the vehicle in the world, (T, 3), m."""
    return poses * [1, 1, 0] + _heading(poses) @ [ahead, left, height]
