"""What figures and animations ask of a run before they draw it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..analysis.replay import experiment_of
from ..checks import instance, positive_number
from ..errors import InputError
from ..simulation.result import LAYOUT, Result
from ..simulation.simulate import Experiment

#: numbers beyond it are those of a run that went astray; no picture of them says anything
LARGEST = 1e30
#: an error, rad or m, or a speed, from which nothing comes back
LOST = 1e3
#: frames of an animation, about two hours at 25 frames per second
MOST_FRAMES = 200_000


def check_run(result: Result, *arrays: str) -> None:
    """Refuse what cannot be drawn.

    Args:
        result: the run.
        arrays: names of those of its arrays that are to be drawn.

    Raises:
        InputError: no run, one without instants, or numbers so large that there is nothing to see.
    """
    instance("result", result, Result, "a Result")
    if not len(result.t):
        words = "nothing was logged, so there is nothing to draw"
        raise InputError(words, subject=f"run '{result.info['title']}'", found=0)
    for name in arrays:
        numbers = getattr(result, name)
        seen = np.abs(numbers) <= LARGEST
        if not seen.all():
            found = numbers[~seen][0]
            raise InputError(
                f"expected numbers up to {LARGEST:g} to draw, found {found:g}; the run went astray",
                subject=f"run '{result.info['title']}', {name}",
                found=found,
            )


def as_far_as_it_means(result: Result) -> Result:
    """A run that stopped, without the rows at its end that have no meaning; else the run as it is.

    These are the rows from the first on in which an error or a speed is beyond `LOST`. If that leaves fewer
    than three, there is nothing to see, and the run is returned whole.
    """
    lost = [
        ~(np.abs(array) <= LOST).reshape(len(array), -1).all(axis=1)
        for array in (result.tracking_error, result.v)
    ]
    kept = int(np.argmax(np.any(lost, axis=0))) if np.any(lost) else len(result.t)
    if result.status == "completed" or not 3 <= kept < len(result.t):
        return result
    arrays = {name: getattr(result, name)[:kept] for name in LAYOUT}
    outputs = {name: array[:kept] for name, array in result.outputs.items()}
    return replace(result, **arrays, outputs=outputs)


def check_output(result: Result, name: str) -> np.ndarray:
    """An output of a run that is to be drawn.

    Raises:
        InputError: the run has none of this name, or one with numbers that cannot be drawn.
    """
    subject = f"run '{result.info['title']}', outputs, {name}"
    if name not in result.outputs:
        raise InputError("expected a run that has it", subject=subject, found=tuple(result.outputs))
    numbers = result.outputs[name]
    seen = np.abs(numbers) <= LARGEST
    if not seen.all():
        found = numbers[~seen][0]
        raise InputError(
            f"expected numbers up to {LARGEST:g} to draw, found {found:g}", subject=subject, found=found
        )
    return numbers


def check_axes(result: Result, *axes: str) -> None:
    """Refuse a run whose coordinates are not those of tips along these axes.

    Raises:
        InputError: other axes.
    """
    if (found := result.info["axes"]) != [*axes]:
        expected = f"{', '.join(axes[:-1])} and {axes[-1]}"
        raise InputError.expected(f"tips along {expected}", found, "result", shown=", ".join(found))


def shown_experiment(result: Result, experiment: Experiment | None) -> Experiment:
    """The experiment that made a run, given or still known.

    Raises:
        InputError: there is none, or it is that of another cell.
    """
    if experiment is None and result.experiment is None:
        raise InputError(
            "expected the one that made this result, or one that still has its experiment; "
            "this one was loaded from a file",
            subject="experiment",
            found="no experiment",
        )
    experiment = experiment_of(result, experiment)
    cell = experiment.cell
    if (cell.n, cell.nv, cell.m) != (*result.q.shape[1:], result.x.shape[2]):
        raise InputError.expected(
            f"the one that made the result, of {result.q.shape[1]} robots with up to "
            f"{result.q.shape[2]} joints and {result.x.shape[2]} coordinates",
            (cell.n, cell.nv, cell.m),
            "experiment",
            shown=f"{cell!r}",
        )
    return experiment


def frame_times(result: Result, fps: float) -> np.ndarray:
    """When the frames of an animation of a run are, at least one, s.

    Raises:
        InputError: `fps` is not positive, or there are more frames than an animation can hold.
    """
    fps = positive_number("fps", fps)
    if result.t[-1] * fps > MOST_FRAMES:
        raise InputError(
            f"expected at most {MOST_FRAMES} frames, found {result.t[-1] * fps:.3g} at {fps:g} a second",
            subject="fps",
            found=fps,
        )
    return np.append(0.0, np.arange(0.0, result.t[-1], 1 / fps)[1:])


def frame_indices(result: Result, fps: float) -> np.ndarray:
    """Indices of the logged instants that the frames of an animation show, the first at their time or later.

    Raises:
        InputError: see `frame_times`.
    """
    return np.clip(np.searchsorted(result.t, frame_times(result, fps)), 0, len(result.t) - 1)
