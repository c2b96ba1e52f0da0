"""Theorem C against the closed loop itself: a small error, simulated for some periods."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..checks import count, index, instance, positive_number
from ..control.controller import Controller
from ..coupling.cell import Cell
from ..errors import InputError
from ..simulation.engines import Engine
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .exponential_rate import ExponentialRate
from .in_words import InWords
from .on_motion import DesiredMotion
from .origin import alike
from .small_errors import Coordinates


@dataclass(frozen=True, eq=False, repr=False)
class Decay(InWords):
    """What a small error became in the nonlinear closed loop.

    Attributes:
        multiplier: what the theorem says one period makes of an error along the direction, complex.
        simulated: what the simulation made of it, over all periods that of one of them.
        before, after: z at the start and at the end, (k,).
        expected: what the theorem says of the latter, (k,).
    """

    multiplier: complex
    simulated: complex
    before: np.ndarray
    after: np.ndarray
    expected: np.ndarray

    @property
    def misfit(self) -> float:
        """|simulated - multiplier| / |multiplier|."""
        return abs(self.simulated - self.multiplier) / abs(self.multiplier)

    def __str__(self) -> str:
        return (
            f"of a small error a period leaves {_number(self.multiplier)} by the theorem, and "
            f"{_number(self.simulated)} in the simulation; they differ by {self.misfit:.2g} of that"
        )


def simulated_decay(
    experiment: Experiment,
    rate: ExponentialRate,
    direction: int | None = None,
    *,
    periods: int = 1,
    size: float = 1e-3,
    dt: float = 1e-3,
    engine: str | Engine = "pinocchio",
) -> Decay:
    """Start the closed loop from a small error, and see what some periods make of it.

    The error is the real part of an eigenvector, without its integrals, which start from zero in every run.
    How it falls is read off along that direction, from half the difference of two runs, with this error and
    its opposite: the error of the method is the same in both, and so is what grows with their square.

    Args:
        experiment: what the rate is of.
        rate: its rate.
        direction: number of the multiplier, counted from 0; by default that of the slowest direction that the
            motion excites.
        periods: how many.
        size: of the largest coordinate of the error; what is not linear is smaller by about its square.
        dt, engine: as in `simulate`.

    Raises:
        InputError: no such direction, numbers that are not positive, or another experiment than the rate's.
        SimulationError: the run had to stop.
    """
    _check_origin(experiment, rate)
    count("periods", periods), positive_number("size", size)
    k = len(rate.unexcited) if direction is None else index("direction", direction, len(rate.multipliers))
    before = size * _along(rate, k)
    duration, z = periods * rate.period, rate.coordinates
    runs = [_near(experiment, rate, e).simulate(duration, dt, engine=engine) for e in (before, -before)]
    after = (_last(z, runs[0]) - _last(z, runs[1])) / 2
    dual, multiplier = rate.left[:, k].conj(), complex(rate.multipliers[k])
    share = complex(dual @ after) / complex(dual @ before) / multiplier**periods
    simulated = multiplier * share ** (1 / periods)  # of all roots the one nearest to the multiplier
    return Decay(multiplier, simulated, before, after, np.linalg.matrix_power(rate.Phi, periods) @ before)


def _number(value: complex) -> str:
    """Without an imaginary part where there is none."""
    return f"{value.real:.6g}" if value.imag == 0 else f"({value:.6g})"


def _check_origin(experiment: Experiment, rate: ExponentialRate) -> None:
    """Refuse an experiment that the rate is not of, as far as its robots, coupling and gains tell."""
    instance("experiment", experiment, Experiment, "an Experiment")
    instance("rate", rate, ExponentialRate, "an ExponentialRate")
    ours, its = map(_told, (experiment.closed_loop().controller, rate.coordinates.controller))
    for name, value in ours.items():
        if not alike(value, its[name]):
            shown = f"one with {name} {value!r:.200}, where it has {its[name]!r:.200}"
            raise InputError.expected("the experiment that the rate is of", name, "experiment", shown=shown)


def _told(controller: Controller) -> dict[str, Any]:
    """What tells experiments apart, as plain data."""
    cell = controller.cell
    return {
        "robots": list(cell.names),
        "axes": list(cell.labels),
        "theta": cell.theta.tolist(),
        "S": cell.coupling.matrix.tolist(),
        "gains": controller.gains.as_dict(),
    }


def _along(rate: ExponentialRate, k: int) -> np.ndarray:
    """An error along direction k whose largest coordinate is 1, without integrals, (size,)."""
    vector = rate.right[:, k]
    error = (vector / vector[np.abs(vector).argmax()]).real
    error[rate.coordinates.parts["i"][0]] = 0.0
    return error / np.abs(error).max()


def _last(z: Coordinates, result: Result) -> np.ndarray:
    """z at the end of a run."""
    errors = result.v_error, result.theta_hat, result.coupled_error, result.sync_integral
    return z.of(*(x[-1] for x in errors))


def _near(experiment: Experiment, rate: ExponentialRate, errors: np.ndarray) -> Experiment:
    """The experiment from where the period begins, with these errors."""
    loop, z = experiment.closed_loop(), rate.coordinates
    cell, (s_q, e_star) = experiment.cell, z.rows(errors)
    motion, reference = DesiredMotion(loop), cell.references(np.array([rate.start]))[0]
    q = motion.joints(reference, motion.arrived(rate.start), np.matvec(reference.c_inv, e_star))
    still = loop.state(loop.initial_state())
    still.q[...], still.v[...] = q, 0.0
    v = loop.look(reference, still).v_ref - s_q
    starts: list[dict[str, Any]] = [
        {"q0": q[i], "v0": v[i], "theta_hat0": theta_hat} for i, theta_hat in enumerate(z.estimates(errors))
    ]
    members = [replace(member, **start) for member, start in zip(cell.members, starts, strict=True)]
    there = Cell(members, cell.coupling, cell.space, cell.name, cell.clocks + rate.start)
    return replace(experiment, cell=there)
