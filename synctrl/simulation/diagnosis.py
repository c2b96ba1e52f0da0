"""Why a run had to stop, in the same words for all engines.

A guard sees that a Jacobian is singular or a number infinite. Whether the path led there, or the closed loop
ran away and met a singular configuration on its way to infinity, is in the rows that were logged before, in
the gains, in the step and in the pushes from outside.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from typing import Any, NamedTuple
from warnings import catch_warnings, simplefilter

import numpy as np

from ..coupling.starts import FASTEST
from ..errors import NonFiniteError, OrientationError, SimulationError, SingularJacobianError
from ..robots.model import joined, unit_for
from .closed_loop import ClosedLoop
from .schedules import DisturbanceSchedule
from .stop import Excess, Push, Stop

#: an acceleration from outside that no step follows: 0.2 rad in a millisecond, rad/s^2
ABSURD = 2e5
#: one that is suspect where nothing else explains the stop, rad/s^2
STRONG = 2e3
#: a step or period is to blame where it is longer than a usual one and a short one would do, s
USUAL, SHORT = 1e-3, 5e-4
#: condition number from which on a Jacobian is nearly singular
NEARLY = 100.0

#: causes that no closed loop has a hand in
DESIRED = ("motion", "weights")

#: causes that other gains, or another step, would cure
CURABLE = ("step", "period", "Lambda", "beta", "K_r", "K_eps", "Gamma", "friction", "unstable")
#: what knows which change comes first: its module and name, imported when a run has to stop
ADVICE = ("synctrl.analysis.advise", "first_change")

DAMPING = "N·m·s/rad"
UNITS = {"Lambda": " 1/s", "beta": " 1/s", "K_eps": "", "Gamma": ""}
AWAY = "move the path away from the border of the workspace, or start in another configuration"
#: what configurations do, by the kind of the error
BY_KIND: dict[type[SimulationError], tuple[str, str]] = {
    SingularJacobianError: ("singular", AWAY),
    OrientationError: ("orientation", "start closer to the desired orientation, or turn more slowly"),
}


class Cause(NamedTuple):
    """Why a run stopped.

    Attributes:
        word: as in `SimulationError.cause`.
        words: for a reader.
        robot, joint: what began, counted from 0, or None.
        ran_away: whether the closed loop ran away; what a guard then saw is a matter of chance.
    """

    word: str
    words: str
    robot: int | None
    joint: int | None = None
    ran_away: bool = True


def diagnosed(
    error: SimulationError,
    loop: ClosedLoop,
    schedule: DisturbanceSchedule,
    rows: Mapping[str, np.ndarray],
    state: np.ndarray,
    info: Mapping[str, Any],
) -> SimulationError:
    """The error of a run that had to stop, with its cause, and the robot and the joint that began.

    A closed loop that ran away is a `NonFiniteError`, whatever configuration it met on its way to infinity.
    What is neither the guard's nor the integrator's stays as it is: an error that knows its cause keeps it,
    save for a part of a user's that lost its numbers after the loop had run away.

    Args:
        error: what stopped it.
        loop: the closed loop.
        schedule: pushes from outside.
        rows: logged arrays of a `Result` by name.
        state: flat state at the stop.
        info: how it was run: "dt", "integrator", "control_period".
    """
    if type(error) not in (NonFiniteError, *BY_KIND) or error.cause in DESIRED:
        return error
    h = info["dt"] if info["integrator"] == "rk4" else None
    stop = Stop(loop, schedule, error, rows, state, h, info["control_period"])
    if error.cause is not None and stop.calm:
        return error
    cause = find_cause(stop)
    about: Any = {"time": error.time, "robot": cause.robot, "joint": cause.joint, "cause": cause.word}
    if not cause.ran_away:
        found = type(error)(f"{error}; {cause.words}", **about)
        return found.about(error.subject, found=error.found)
    name = "the cell" if cause.robot is None else loop.cell.names[cause.robot]
    place = name if cause.joint is None else f"joint {cause.joint + 1} of {name}"
    words = cause.words + (_advice(loop, info) if cause.word in CURABLE else "")
    return NonFiniteError(f"{place} ran away at t = {error.time:g} s: {words}", **about)


def _advice(loop: ClosedLoop, info: Mapping[str, Any]) -> str:
    """What to change first, as far as that is known; whatever goes wrong here is not worth a word."""
    module, name = ADVICE
    with suppress(Exception), catch_warnings():
        simplefilter("ignore")
        change = getattr(import_module(module), name)(loop, info["dt"], info["control_period"])
        first = "" if change is None else f"to begin with, change {change.told(loop.cell.names)}; "
        return f"; {first}synctrl.analysis.advise(cell, gains) tells what else"
    return ""


def find_cause(stop: Stop) -> Cause:
    """What is to blame: a push or a start that no step follows, the path, a gain, the step, the period."""
    push = stop.push()
    if push is not None and push.acceleration > ABSURD:
        return _pushed(stop, push)
    if (start := _fast_start(stop)) is not None:
        return start
    if stop.calm and (met := BY_KIND.get(type(stop.error))) is not None:
        return Cause(*met, stop.error.robot, ran_away=False)
    for driven in (False, True):
        excesses = [each for each in stop.excesses(driven) if each.share > 1]
        if excesses:
            return _too_fast(stop, excesses)
        if getattr(stop.loop.controller.network, "jumps", False) and (late := _heard_late(stop)) is not None:
            return late
    if stop.conditions.max() > NEARLY:
        return _nearly_singular(stop)
    if push is not None and push.acceleration > STRONG:
        return _pushed(stop, push)
    return _strong_start(stop) or _heard_late(stop) or _unclear(stop)


def _heard_late(stop: Stop) -> Cause | None:
    """A network that may have done it, by its own words."""
    words = getattr(stop.loop.controller.network, "suspicion", None)
    if words is None or stop.calm or stop.h is None:
        return None
    return Cause("network", words, *stop.quickest(range(stop.loop.cell.n)))


def _pushed(stop: Stop, push: Push) -> Cause:
    torque, rate = (stop.unit(unit, push.robot, push.joint) for unit in ("N·m", "rad/s²"))
    gained = f"accelerates it by {push.acceleration:.2g} {rate}"
    words = f"a push of {push.torque:g} {torque} {gained}; make it smaller"
    return Cause("disturbance", words, push.robot, push.joint)


def _fast_start(stop: Stop) -> Cause | None:
    v0 = np.abs(stop.loop.cell.v0)
    if not v0.max() > FASTEST:
        return None
    robot, joint = (int(k) for k in np.unravel_index(v0.argmax(), v0.shape))
    speed = f"{v0.max():.3g} {stop.unit('rad/s', robot, joint)}"
    return Cause("start", f"it starts with {speed}, which no step follows", robot, joint)


def _strong_start(stop: Stop) -> Cause | None:
    """A run whose first torque already throws a robot, or is not even finite."""
    words = "its first torque is too large; look at theta_hat0, and at how far it starts from what is desired"
    if stop.last_calm > 0 or stop.h is None:
        return None
    if stop.last_calm < 0:
        return Cause("start", words, stop.error.robot, ran_away=False)
    robot, joint = stop.quickest(range(stop.loop.cell.n))
    thrown = not abs(stop.speed_after[robot, joint]) <= ABSURD * stop.h
    return Cause("start", words, robot, joint) if thrown else None


def _nearly_singular(stop: Stop) -> Cause:
    robot = int(stop.conditions.argmax())
    found = f"the Jacobian of {stop.loop.cell.names[robot]} was nearly singular before"
    words = f"{found}, with condition number {stop.conditions[robot]:.3g}; {AWAY}"
    return Cause("singular", words, robot, ran_away=False)


def _too_fast(stop: Stop, excesses: list[Excess]) -> Cause:
    """The gain that goes farthest beyond what the step allows, or the step, if a usual one would do."""
    gain, held = excesses[0].rate.gain, excesses[0].held
    own = [each for each in excesses if each.rate.gain == gain and each.held == held]
    robot, joint = stop.quickest(sorted({each.rate.robot for each in own}))
    worst = next(each for each in own if each.rate.robot == robot)
    joint = joint if worst.rate.joint is None else worst.rate.joint
    name = "control period" if held else "step"
    needs = f"{_gain(stop, gain, robot, joint)} needs at most {worst.longest:.2g} s"
    if worst.used > USUAL and worst.longest >= SHORT:
        words = f"the {name} of {worst.used:g} s is too long; {needs}"
        return Cause("period" if held else "step", words, robot, joint)
    lower = "" if gain in ("friction", "law") else "lower the gain, or "
    return Cause(
        gain, f"{needs}, but the {name} is {worst.used:g} s; {lower}shorten the {name}", robot, joint
    )


def _unclear(stop: Stop) -> Cause:
    if stop.h is not None and not stop.calm:
        robot, joint = stop.quickest(range(stop.loop.cell.n))
        words = "its closed loop is unstable; no gain, step or push stands out"
        return Cause("unstable", words, robot, joint)
    words = "nothing moved fast before: look at what is desired, and at its derivatives"
    if stop.h is None:
        words = "the closed loop is unstable, or too stiff for the tolerances of the method"
    return Cause("unstable", words, stop.error.robot, ran_away=False)


def _gain(stop: Stop, gain: str, robot: int, joint: int) -> str:
    """A gain with its value for a joint."""
    controller = stop.loop.controller
    if gain in ("friction", "law"):
        return f"its {gain}"
    values = getattr(controller.adaptation if gain == "Gamma" else controller, gain, None)
    if values is None:  # an adaptation of another kind
        return "its adaptation"
    if gain == "K_r" and controller.k_r_space == "joint":
        return f"K_r = {values[robot, joint]:g} {stop.unit(DAMPING, robot, joint)}"
    units = {**UNITS, "K_r": f" {joined(unit_for(DAMPING, unit) for unit in stop.loop.cell.units)}"}
    return f"{gain} = {(values[robot] if values.ndim == 2 else values).max():g}{units[gain]}"
