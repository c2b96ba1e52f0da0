"""Figures of tasks of assembly: forces inside, errors of what is carried, beads, and gaps between robots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ..assembly.body import place_of
from ..simulation.result import Result
from ..tasks.rotations import log
from .curves import Curves, curves_figure
from .runs import check_output
from .style import display

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def internal_force_curves(result: Result) -> list[Curves]:
    """Size of the internal force at each hand, N, and of the moment where hands can hold one, N·m."""
    forces = check_output(result, "internal_force")
    hands = [result.names[int(grasp["robot"])] for grasp in result.info["grasps"]]
    linear = min(3, forces.shape[2])
    parts = [Curves("internal force", "force, N", np.linalg.norm(forces[..., :linear], axis=2), hands)]
    if forces.shape[2] > linear:
        moment = np.linalg.norm(forces[..., linear:], axis=2)
        parts.append(Curves("internal moment at the hand", "moment, N·m", moment, hands))
    return parts


def object_error_curves(result: Result) -> list[Curves]:
    """Desired less actual pose of the object: position, and orientation as a rotation vector."""
    place, R = place_of(check_output(result, "object_pose"))
    wanted, R_wanted = place_of(check_output(result, "object_desired"))
    axes = ["x", "y", "z"]
    moved, turned = (display(unit) for unit in ("m", "rad"))
    return [
        Curves("error of the object", f"position, {moved.unit}", moved.factor * (wanted - place), axes),
        Curves("and of its orientation", f"{turned.unit}", turned.factor * log(R_wanted @ R.mT), axes),
    ]


def output_curves(result: Result, name: str) -> list[Curves]:
    """An output of a run as it is: over time, and each of its other entries a curve."""
    values = check_output(result, name)
    about = result.info["outputs"][name]
    unit, factor = display(about["unit"])
    title = name.replace("_", " ")
    entries = [_words(at, about["axes"][1:], values.shape[-1]) for at in np.ndindex(values.shape[1:]) if at]
    flat = factor * values.reshape(len(values), -1)
    return [Curves(title, unit, flat, entries if values.ndim > 1 else [title])]


def _words(at: tuple[int, ...], axes: Sequence[str], last: int) -> str:
    """An entry of an array by its axes, counted from 1; of three coordinates they are x, y and z."""
    named = {"coordinate": "xyz"} if last == 3 else {}
    words = [named[axis][k] if axis in named else f"{axis} {k + 1}" for k, axis in zip(at, axes, strict=True)]
    return ", ".join(words)


#: what is drawn of a run that has it, by name, and the output that it needs
CURVES: Mapping[str, tuple[str, Callable[[Result], Sequence[Curves]]]] = MappingProxyType(
    {
        "internal_force": ("internal_force", internal_force_curves),
        "object_error": ("object_desired", object_error_curves),
        **{
            name: (name, partial(output_curves, name=name))
            for name in ("bead_error", "normal_angle", "bead_speed", "gap_error", "phase", "feed")
        },
    }
)


def assembly_figure(
    result: Result, *, name: str, width: float | None = None, style: str | None = None
) -> Figure:
    """One of the figures of `CURVES`.

    Raises:
        InputError: the run does not have what is drawn in it.
    """
    return curves_figure(result, CURVES[name][1](result), width, style)


def internal_forces(result: Result, *, width: float | None = None, style: str | None = None) -> Figure:
    """Size of the internal force at each hand of what several hands carry, and of the moment.

    Args:
        result: the run.
        width, style: of the figure, see `look.look_of`.

    Raises:
        InputError: nothing is carried.
    """
    return assembly_figure(result, name="internal_force", width=width, style=style)


def has(result: Result, name: str) -> bool:
    """Whether a run has what one of the figures of `CURVES` shows, all of it known."""
    values = result.outputs.get(CURVES[name][0])
    return values is not None and bool(np.isfinite(values).all())
