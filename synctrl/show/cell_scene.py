"""The scene of any run: its arms, where their tips should go, and bars between robots that are compared."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from ..analysis.metrics import row_names
from ..errors import InputError, SynctrlError
from ..robots.robot import Robot
from ..robots.written import read_robot
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from . import arms, carried_scene
from .legends import pair_colors, pair_symbols
from .meshes import MeshLibrary
from .runs import check_run, frame_indices, shown_experiment
from .scene import Scene
from .style import DESIRED, read_color, robot_color

#: as shares of the reach of the arms: a tip, a desired path, and bars without and with the largest error
BALL, LINE, THIN, THICK = 0.032, 0.006, 0.006, 0.02
#: colour of the bar where there is no other
ONE_PAIR = "#a3acb7"
#: reach that is assumed where arms have none, such as wheels, m
NO_REACH = 0.3
#: a tip that moves less is drawn without a path, m
STILL = 1e-3
#: how far coordinates called x, y, z may be off the tips, m
AT_TIP = 1e-6
FPS = 30.0


def scene_of(
    result: Result,
    experiment: Experiment | None = None,
    *,
    limit: float | None = None,
    force: float | None = None,
    bead_error: float | None = None,
    fps: float = FPS,
    package_dirs: Iterable[str | Path] = (),
    meshes: MeshLibrary | None = None,
) -> Scene:
    """The scene of a run: `scene_of(result).write("cell.html")`, or the scene itself in a notebook.

    It has the arms, the desired paths of their tips where the space says where these are, and a bar between
    the tips of every pair that is compared, in the pair's colour; it grows, and turns red, with the
    synchronization error. Robots without shapes are drawn as plain links. `carried_scene` draws what hands
    carry, forces inside it as arrows, and adhesive as it is laid.

    Args:
        result: a run in any space, also one that was loaded: its robots are then made again from what the
            result says of them.
        experiment: what made it, for results whose robots cannot be made again.
        limit: synchronization error that is fully red, in its unit; by default the largest of the run.
        force: internal force of the longest arrow, N; by default the largest of the run.
        bead_error: error of adhesive that is fully red, m; by default the largest of the run.
        fps: frames per second.
        package_dirs: where else than in installed packages meshes of loaded results may be looked for.
        meshes: mesh files that were read for other scenes.

    Raises:
        InputError: nothing to show, or a robot that cannot be made again, by name.
    """
    check_run(result, "x", "x_desired", "sync_error", "q", "disturbance")
    robots, frames = robots_of(result, experiment, package_dirs), frame_indices(result, fps)
    scene, scale = arms.arms_scene(result, robots, frames, fps, meshes=meshes), _scale(robots)
    marks = _add_marks(scene, result, robots, frames, limit, scale)
    carried = carried_scene.add_carried(scene, result, robots, frames, force, bead_error, scale)
    arms.add_disturbances(scene, result, robots, frames)
    scene.caption = " ".join(filter(None, [*marks, *carried]))
    return scene


def _add_marks(
    scene: Scene,
    result: Result,
    robots: Sequence[Robot],
    frames: np.ndarray,
    limit: float | None,
    scale: float,
) -> list[str]:
    """Tips, their desired paths and bars between them; returns what a caption says of them."""
    tips = arms.tip_positions(robots, result.q[frames])
    desired = desired_tips(result, robots, frames, tips)
    _add_tips(scene, result, tips, desired, scale)
    bars = _add_bars(scene, result, tips, frames, limit, scale)
    return _caption(robots, result, desired is not None, bars)


def robots_of(
    result: Result, experiment: Experiment | None = None, package_dirs: Iterable[str | Path] = ()
) -> Sequence[Robot]:
    """The robots of a run: those of its experiment, or made again.

    Raises:
        InputError: one cannot be made again, by name, or the experiment is that of another cell.
    """
    if experiment is not None or result.experiment is not None:
        return shown_experiment(result, experiment).cell.robots
    robots = []
    for about in result.info["robots"]:
        try:
            robots.append(read_robot(about, about["name"], about["joints"], package_dirs))
        except SynctrlError as error:
            raise InputError(
                f"expected the one that made this result: {about['name']} ('{about.get('model', '?')}') "
                f"cannot be made again from the file, {error}",
                subject="experiment",
                found=about["name"],
            ) from error
    return robots


def _scale(robots: Sequence[Robot]) -> float:
    """Reach of the arms, as a measure for what is drawn beside them, m."""
    reaches = [found for robot in robots if (found := arms.reach(robot)) > 0]
    return float(np.median(reaches)) if reaches else NO_REACH


def desired_tips(
    result: Result, robots: Sequence[Robot], frames: np.ndarray, tips: np.ndarray
) -> np.ndarray | None:
    """Where the tips should be, (T, n, 3), m; None in a space that does not say it.

    In joint space x is q. In others the coordinates called x, y and z are those of the tip, if they are where
    the tips are; those that are left free are as the tips have them.
    """
    if result.x.shape == result.q.shape and np.array_equal(result.x, result.q):
        return arms.tip_positions(robots, result.x_desired[frames])
    axes = {"xyz".index(name): k for k, name in enumerate(result.info["axes"]) if name in ("x", "y", "z")}
    rows, columns = [*axes], [*axes.values()]
    if not axes or np.abs(result.x[frames][..., columns] - tips[..., rows]).max() > AT_TIP:
        return None
    desired = tips.copy()
    desired[..., rows] = result.x_desired[frames][..., columns]
    return desired


def _add_tips(
    scene: Scene, result: Result, tips: np.ndarray, desired: np.ndarray | None, scale: float
) -> None:
    """Tips of robots that hold nothing, if no nozzle is drawn there, and where they should go, if known."""
    holding = carried_scene.holders(result)
    free = [i for i in range(len(result.names)) if i not in holding]
    for i in set(free).difference(carried_scene.layers(result)):
        scene.add_sphere(f"tip of {result.names[i]}", BALL * scale, tips[:, i], robot_color(i))
    if desired is None:
        return
    drawn = [i for i in free if np.ptp(desired[:, i], axis=0).max() > STILL]
    for i in drawn:
        scene.add_line(f"desired path of {result.names[i]}", desired[:, i], DESIRED, LINE * scale)
    if drawn:
        scene.add_legend("desired paths", DESIRED)


def _add_bars(
    scene: Scene, result: Result, tips: np.ndarray, frames: np.ndarray, limit: float | None, scale: float
) -> bool:
    """Bars of each pair, in its colour until they redden; none between hands of one object.

    Returns:
        Whether there are any.
    """
    holding, drawn = {*carried_scene.holders(result)}, False
    share = arms.error_share(result, limit)[0][frames]
    names, colors = row_names(result, "sync_error"), pair_colors(result)
    colors = colors if len(colors) > 1 else [ONE_PAIR]
    marks = zip(result.info["pairs"], colors, pair_symbols(result), names, strict=True)
    lifts = _lifts(result.info["pairs"], tips[0], BALL * scale)
    for k, (robots, color, symbol, name) in enumerate(marks):
        if holding.issuperset(robots):
            continue
        drawn = True
        calm = np.array(read_color(symbol, color)[:3])
        radius = scale * (THIN + share[:, k] * (THICK - THIN))
        lifted = tips + np.array([0.0, 0.0, lifts[k]])
        arms.add_bars(scene, result, symbol, robots, lifted, radius, arms.error_color(share[:, k], calm))
        scene.add_legend(f"{symbol}: {name.partition(': ')[2]}", color)
    return drawn


def _lifts(pairs: Sequence[Sequence[int]], tips: np.ndarray, ball: float) -> list[float]:
    """How far above the tips, (n, 3), each bar is drawn, m: one past another tip would hide what ends there.

    The first of them touches the tops of the balls, of radius `ball`, and each more is that far above.
    """
    past = [len(robots) == 2 and _passes_a_tip(robots, tips, ball) for robots in pairs]
    return [ball * sum(past[: k + 1]) if hidden else 0.0 for k, hidden in enumerate(past)]


def _passes_a_tip(pair: Sequence[int], tips: np.ndarray, ball: float) -> bool:
    """Whether the way between the tips of a pair leads through the ball of another tip."""
    start, end = tips[list(pair)]
    others = np.delete(tips, list(pair), axis=0)
    along = end - start
    share = (others - start) @ along / max(float(along @ along), ball**2)
    off = np.linalg.norm(others - start - share[:, None] * along, axis=1)
    return bool(((share > 0) & (share < 1) & (off < ball)).any())


def _caption(robots: Sequence[Robot], result: Result, has_paths: bool, has_bars: bool) -> list[str]:
    lines = []
    if has_bars:
        lines.append("Bars between compared tips grow and turn red with the synchronization error.")
    if not has_paths:
        lines.append("Desired paths are not shown: the coordinates are not those of tips.")
    plain = [name for name, robot in zip(result.names, robots, strict=True) if not arms.has_shapes(robot)]
    if plain:
        lines.append(f"Without shapes that can be shown, as plain links: {', '.join(plain)}.")
    return lines
