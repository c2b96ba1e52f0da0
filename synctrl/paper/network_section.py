"""Robots that talk on the page: runs over networks, and what is asked of them.

The paper's robots know everything of each other at once. Networks, delays and losses are our choice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from ..analysis.delay_condition import delay_condition
from ..control.network import Network
from ..experiments.a460_pair import a460_pair
from ..experiments.planar_four import planar_four
from ..show.curves import Curves
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .claims import Claim, Finding, findings, left
from .reproduction import PlannedRun
from .tasks import OUR_CELL, Drawing, Task, root_mean_square

#: the network over which receivers are compared: messages that come late, at odd times, or not at all
BAD = partial(Network, period=0.01, delay=0.01, jitter=0.01, loss=0.2)
#: a delay that both cells of the paper have to take, s
LONG = 0.1
#: "costs almost nothing" and "doubles": RMS of epsilon as a share of what it is with ideal communication
ALMOST_NOTHING, DOUBLE = 1.05, 2.0
#: how long the runs with a push are, s
PUSHED = 1.5
#: of its peak that may be left of epsilon after a long delay
FADED = 0.5

_pushed = partial(planar_four, disturbance="torque")
_run = partial(PlannedRun, engine="compiled")
_long = partial(PlannedRun, dt=2e-3, log_dt=1e-2, engine="compiled")
#: runs that are drawn
COMPARED = "ideal", "late", "filter", "hold"


def size_of_epsilon(run: Result) -> np.ndarray:
    """Length of epsilon of all pairs, (T,)."""
    return np.linalg.norm(run.sync_error.reshape(len(run.t), -1), axis=1)


def rms(run: Result) -> float:
    """Root mean square of the length of epsilon."""
    return root_mean_square(run.sync_error)


def peak_torque(run: Result) -> float:
    """Largest torque of any joint, N·m."""
    return float(np.abs(run.tau).max())


def messages(run: Result) -> float:
    """How many messages robots sent; none where they tell each other everything all the time."""
    return float(run.outputs["messages_sent"][-1].sum()) if "messages_sent" in run.outputs else 0.0


def epsilon_curves(run: Result) -> list[Curves]:
    """Size of epsilon over time."""
    unit = f"10⁻³ {run.info['weighted_unit']}"
    return [
        Curves("synchronization errors of all pairs, |ε|", unit, 1e3 * size_of_epsilon(run)[:, None], ["|ε|"])
    ]


def network_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """What is asked of the runs."""
    return [
        every_delay_is_tolerated(runs),
        a_filter_costs_almost_nothing(runs["filter"], runs["ideal"]),
        holding_doubles(runs["hold"], runs["ideal"]),
    ]


def every_delay_is_tolerated(runs: Mapping[str, Result]) -> Claim:
    """The theorem's condition holds along runs with a long delay, and epsilon fades in them."""
    makes: dict[str, Callable[..., Experiment]] = {
        "long": planar_four,
        "long_a460": partial(a460_pair, friction=False),
    }
    margins, shares = [], []
    for name, make in makes.items():
        condition = delay_condition(runs[name], make(network=Network(delay=LONG)))
        margins.append(condition.margin if condition is not None and condition.theorem else -np.inf)
        shares.append(left(runs[name].sync_error))
    who = "four planar arms", "two A460"
    figures = findings("smallest margin", margins, "N·m·s/rad", who)
    figures += findings("left of ε, share of its peak", shares, "", who)
    return Claim(
        "Both cells of the paper tolerate every constant delay.",
        OUR_CELL,
        min(margins) > 0 and max(shares) < FADED,
        tuple(figures),
        "Asked: the least eigenvalue of the theorem is above 0 at every logged instant, and with a delay "
        f"of {1e3 * LONG:g} ms the largest ε of the last tenth of the run is less than {FADED:g} of its "
        "peak. Stable is not fast: what all arms have in common fades slowly with a long delay.",
    )


def a_filter_costs_almost_nothing(filtered: Result, ideal: Result) -> Claim:
    """RMS of epsilon is hardly larger than with ideal communication."""
    share = rms(filtered) / rms(ideal)
    return Claim(
        "With a filter at the receiver, late, irregular and lost messages cost almost nothing.",
        OUR_CELL,
        share <= ALMOST_NOTHING,
        (Finding("RMS of ε against ideal communication", share),),
        f"Asked: at most {ALMOST_NOTHING:g} times the RMS of ε with ideal communication, of four arms of "
        "which one is pushed. The peak of the torque is another matter, see the table: it takes the filter "
        "some time to follow.",
    )


def holding_doubles(held: Result, ideal: Result) -> Claim:
    """RMS of epsilon is at least twice that with ideal communication."""
    share = rms(held) / rms(ideal)
    return Claim(
        "To hold what was heard last, without a filter, doubles ε.",
        OUR_CELL,
        share >= DOUBLE,
        (Finding("RMS of ε against ideal communication", share),),
        f"Asked: at least {DOUBLE:g} times the RMS of ε with ideal communication, over the same messages. "
        "Every message makes the torque jump, above all at the start, where errors change fast.",
    )


_RUNS = (
    "Four planar arms of the paper, one of which is pushed, as before. Each integrates its own error and "
    "sends that, W, to its neighbours; for the receiver “hold” also w and w'. A message that comes after "
    "others were lost restores everything.",
    "Compared are ideal communication, a constant delay of 50 ms, and messages every 10 ms that come 10 "
    "to 20 ms later, of which a fifth is lost, with a filter of 50 rad/s at the receiver and with the "
    "last message held.",
)

NETWORK = Task(
    name="network",
    title="Robots that talk",
    words=_RUNS,
    planned={
        "ideal": _run(_pushed, PUSHED),
        "late": _run(partial(_pushed, network=Network(delay=0.05)), PUSHED),
        "filter": _run(partial(_pushed, network=BAD()), PUSHED),
        "hold": _run(partial(_pushed, network=BAD(receiver="hold")), PUSHED),
        "long": _long(partial(planar_four, network=Network(delay=LONG)), 3.0),
        "long_a460": _long(partial(a460_pair, friction=False, network=Network(delay=LONG)), 2.0),
    },
    labels={
        "ideal": "ideal",
        "late": "delay of 50 ms",
        "filter": "messages, filter",
        "hold": "messages, hold",
        "long": "undisturbed, 100 ms",
        "long_a460": "two A460, 100 ms",
    },
    drawings=(
        Drawing("network_epsilon", "ε of four planar arms, one of them pushed.", epsilon_curves, COMPARED),
    ),
    animated=("filter", "hold"),
    columns={
        "RMS of ε, 10⁻³ m² or 10⁻³ rad": lambda run: 1e3 * rms(run),
        "peak torque, N·m": peak_torque,
        "messages (none: all the time)": messages,
    },
    claims=network_claims,
)
