"""What is wrong with gains, and to which number to change them: one rule after another, the worst first.

Every rule looks at gains in which what the rules before it found is already changed, so that all changes
together fit each other. The numbers are those of `Gains.suggest` for a bandwidth of Lambda.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..control.gains import Gains
from ..control.suggest import Arm, cut, learning, stiffness, wished
from ..robots.model import unit_for
from ..simulation.diagnosis import SHORT, USUAL
from .expected_torque import ExpectedTorque
from .gain_case import Case, Change

#: share of what is stable that a step, or period, may be, and to which it is to be shortened
MARGIN, SHORTENED = 0.9, 0.4
#: damping ratio of what is learned, below which it swings too much
SWINGING = 0.25
#: change that is worth a word, as a share
WORTH = 0.05
#: torque above the limit, as a share, that is not worth a word
ROUNDING = 1e-3
#: of Lambda and beta: the least share to which they are lowered for the sake of torque
LEAST = 0.05
#: how exactly that share is found
FINE = 0.02
#: unit of K_r of joints that turn
DAMPING = "N·m·s/rad"


Rule = Callable[[Case], Iterator[Change]]
"""The changes that gains need, in the order in which they are made."""


def changes(case: Case, rules: Sequence[Rule]) -> Iterator[Change]:
    """What to change by some rules, each of them on gains in which all before it is changed."""
    for rule in rules:
        for change in rule(case):
            yield change
            dt = change.to if change.what == "dt" else case.dt
            case = replace(case, gains=change.gains, dt=dt)


# -- what diverges -----------------------------------------------------------------------------------------


def too_fast(case: Case, longest: float) -> Iterator[Change]:
    """Gains beyond what step or period allow, the farthest first; or a shorter step, if none is to blame.

    A step that is longer than usual is shortened, if that is enough; a period is what a robot's driver has.

    Args:
        case: the gains as they are.
        longest: step, or period, up to which small errors fall, s.
    """
    if case.used <= MARGIN * longest:
        return
    if case.period is None and case.dt > USUAL and longest >= SHORT:
        yield _shorter(case, longest, "and a shorter one will do")
        return
    given, ratios = case, {"K_r": case.mode / case.rates.room, **case.springs}
    ratios |= {"Lambda": 4 * case.rates.Lambda / case.top, "beta": 4 * case.rates.synchronized / case.top}
    for name in sorted(ratios, key=lambda name: -ratios[name]):
        change = _lowered(case, name) if ratios[name] > 1 else None
        if change is not None:
            yield change
            case = replace(case, gains=change.gains)
    if case is given:
        yield _shorter(case, longest, "and no gain alone is to blame")


def _lowered(case: Case, name: str) -> Change | None:
    """The change of a gain that is too large for step or period."""
    if name == "Gamma":
        return _learning(case, "diverges")
    if name == "K_r":
        K_r = [case.cut(arm, K) for arm, K in zip(case.arms, case.K_r, strict=True)]
        why = f"with {case.pace} its modes have to stay below {case.rates.room:.3g} 1/s"
        return _damped(case, K_r, "diverges", why)
    if name == "K_eps":
        return coupled(case, "diverges", "it is a spring too stiff for the damping")
    return _at_most(case, name, case.top / 4 / (case.loop.cell.largest_share if name == "beta" else 1.0))


def _at_most(case: Case, name: str, most: float) -> Change:
    """Lambda or beta, nowhere above a number."""
    gain = getattr(case.controller, name)
    changed = case.changed(**{name: np.minimum(gain, most)})
    why = f"a quarter is left for it of what {case.pace} can follow, {case.top:.3g} 1/s"
    return Change("diverges", name, None, None, float(gain.max()), most, "1/s", why, changed.gains)


def coupled(case: Case, urgency: str, why: str) -> Change | None:
    """K_eps as `Gains.suggest` has it: every constant delay is tolerated; None if it is no larger now."""
    if not case.in_joints:
        return None
    gain, rates = case.controller.K_eps, case.rates
    arms = zip(case.arms, case.K_r, strict=True)
    most = np.min([stiffness(arm, K, case.loop.cell, rates) for arm, K in arms], axis=0)
    at = int(np.argmax(gain / most))
    if gain[at] <= most[at]:
        return None
    gains = case.changed(K_eps=np.minimum(gain, most)).gains
    return Change(urgency, "K_eps", None, None, float(gain[at]), float(most[at]), "", why, gains)


def _shorter(case: Case, longest: float, because: str) -> Change:
    """A shorter step or period."""
    what = "dt" if case.period is None else "control_period"
    why = f"small errors grow from {longest:.3g} s on, {because}"
    return Change("diverges", what, None, None, case.used, SHORTENED * longest, "s", why, case.gains)


# -- what swings, or is slow -------------------------------------------------------------------------------


def swinging(case: Case, damping: Callable[[Gains], float]) -> Iterator[Change]:
    """Gamma, if what is learned swings; `damping` is the least damping ratio of that, for some gains."""
    if case.Gamma is not None and damping(case.gains) < SWINGING:
        change = _learning(case, "swings")
        yield from () if change is None else (change,)


def _learning(case: Case, urgency: str) -> Change | None:
    """Gamma in the metric of the bodies, as fast as the damping allows; None if it is no faster now."""
    Gamma, rates, worst = case.Gamma, case.rates, int(np.argmax(case.shares))
    if Gamma is None or case.shares[worst] <= 1 + WORTH:
        return None
    new = [learning(arm, K, rates.Lambda, rates) for arm, K in zip(case.arms, case.K_r, strict=True)]
    at = _pulls_most(case.arms[worst], Gamma[worst])
    why = (
        f"estimates move {case.shares[worst]:.3g} times as fast as the damping can follow, "
        f"{case.loop.cell.parameters[worst].names[at]} most of all, of which these are the rates; in the "
        "metric of the bodies each has one of its own, see docs/gains.md: `Advice.changed` and "
        "`synctrl advise --write` have them all"
    )
    found, to = float(Gamma[worst][at]), float(new[worst][at])
    return Change(urgency, "Gamma", worst, None, found, to, "", why, case.changed(Gamma=new).gains)


def _pulls_most(arm: Arm, Gamma: np.ndarray) -> int:
    """The parameter whose estimate moves the torque most along the path."""
    on = zip(arm.q, arm.v, arm.a, strict=True)
    Y = np.array([arm.parameters.regressor(q, v, v, a) for q, v, a in on])
    return int(np.argmax(Gamma * (Y**2).sum(axis=1).max(axis=0)))


def slow(case: Case) -> Iterator[Change]:
    """K_r of robots whose slowest mode is slower than Lambda."""
    if not case.in_joints:
        return
    Lambda, K_r = case.rates.Lambda, []
    modes = [case.slowest(arm, K) for arm, K in zip(case.arms, case.K_r, strict=True)]
    for arm, K, mode in zip(case.arms, case.K_r, modes, strict=True):
        wish = np.maximum(K, wished(arm, Lambda, Lambda))
        room = max(case.rates.room, case.largest(arm, K))
        K_r.append(cut(arm, wish, room) if mode < Lambda else K)
    why = f"the slowest mode of M^-1 K_r falls at {min(modes):.3g} 1/s, Lambda asks for {Lambda:.3g}"
    change = _damped(case, K_r, "slow", why)
    yield from () if change is None else (change,)


def _damped(case: Case, K_r: list[np.ndarray], urgency: str, why: str) -> Change | None:
    """The change of K_r, told of the joint where it is largest; None if it is none worth while."""
    ratios = [np.abs(np.log(new / old)) for new, old in zip(K_r, case.K_r, strict=True)]
    worst = int(np.argmax([ratio.max() for ratio in ratios]))
    joint = int(np.argmax(ratios[worst]))
    if ratios[worst][joint] < WORTH:
        return None
    units = case.arms[worst].robot.joint_units if case.in_joints else case.loop.cell.units
    unit, gains = unit_for(DAMPING, units[joint]), case.changed(K_r=K_r).gains
    found, to = float(case.K_r[worst][joint]), float(K_r[worst][joint])
    return Change(urgency, "K_r", worst, joint, found, to, unit, why, gains)


# -- what takes too much torque ----------------------------------------------------------------------------


def too_strong(case: Case, expected: Callable[[Gains], ExpectedTorque]) -> Iterator[Change]:
    """What to change where a joint is expected to need more torque than it has.

    Args:
        case: the gains as they are.
        expected: the torque that some gains take.
    """
    torque = expected(case.gains)
    robot, joint = (int(k) for k in np.unravel_index(np.argmax(torque.share), torque.share.shape))
    if torque.share[robot, joint] <= 1 + ROUNDING:
        return
    unit = unit_for("N·m", case.arms[robot].robot.joint_units[joint])
    limit, peak = float(torque.limit[robot, joint]), float(torque.peak[robot, joint])
    told = f"joint {joint + 1} of {case.loop.cell.names[robot]} takes {peak:.3g} {unit}, and has {limit:.3g}"
    if (torque.gravity > torque.limit).any():
        why = f"{told}; gravity alone is more than some joint has, and no gains can hold it"
        yield Change("torque", "torque limit", robot, joint, limit, peak, unit, why, case.gains)
    elif torque.stretch > 1:
        why = f"{told}, on the desired motion itself"
        yield Change("torque", "time", None, None, 1.0, torque.stretch, "times as long", why, case.gains)
    else:
        why = f"{told}, because of errors at the start"
        yield _gentler(case, why, expected) or _nearer(case, torque, robot, joint, why)


def _gentler(case: Case, why: str, expected: Callable[[Gains], ExpectedTorque]) -> Change | None:
    """Smaller Lambda and beta, with which errors of the start take no more torque than there is."""
    given = case.gains

    def slower(factor: float) -> Gains:
        return given.replace(Lambda=factor * given.Lambda, beta=factor * given.beta)

    def fits(factor: float) -> bool:
        return bool(expected(slower(factor)).share.max() <= MARGIN)

    low, high = LEAST, 1.0
    if not fits(low):
        return None
    while high - low > FINE:
        middle = (low + high) / 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    most = float(case.controller.Lambda.max())
    words = f"{why}; beta goes down with Lambda"
    return Change("torque", "Lambda", None, None, most, low * most, "1/s", words, slower(low))


def _nearer(case: Case, torque: ExpectedTorque, robot: int, joint: int, why: str) -> Change:
    """A start nearer to the path: what errors add to the torque is in proportion to them."""
    limit, peak, rest = (float(x[robot, joint]) for x in (torque.limit, torque.peak, torque.path))
    share = max(0.0, (limit - rest) / (peak - rest))
    words = "times as far from the path, with estimates that much nearer to the truth"
    return Change("torque", "start", robot, joint, 1.0, MARGIN * share, words, why, case.gains)
