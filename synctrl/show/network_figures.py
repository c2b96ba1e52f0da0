"""The figure of what came over a network: messages per robot and link, and how old what is known is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..simulation.result import Result
from .curves import Curves, curves_figure
from .runs import check_output

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def traffic(result: Result, *, width: float | None = None, style: str | None = None) -> Figure:
    """Messages that robots sent and links brought until then, and the age of what is known on every link.

    Args:
        result: the run.
        width, style: of the figure, see `look.look_of`.

    Raises:
        InputError: a run whose network has no messages.
    """
    return curves_figure(result, traffic_curves(result), width, style)


def traffic_curves(result: Result) -> list[Curves]:
    """The panels of `traffic`, for one run.

    Raises:
        InputError: a run whose network has no messages.
    """
    sent, heard, age = (
        check_output(result, name) for name in ("messages_sent", "messages_heard", "message_age")
    )
    links = _links(result, heard.shape[1])
    return [
        Curves("messages sent", "messages", sent, list(result.names)),
        Curves("messages heard", "messages", heard, links),
        Curves("age of the message that counts", "age, ms", 1e3 * age, links),
    ]


def _links(result: Result, count: int) -> list[str]:
    """What every link is called, by who hears whom, counted from 1."""
    pairs = [tuple(pair) for pair in result.info["pairs"]]
    links = sorted({*pairs, *(pair[::-1] for pair in pairs)})
    if len(links) != count:  # of a coupling in which some pairs cancel
        return [f"link {k + 1}" for k in range(count)]
    return [f"{i + 1} hears {j + 1}" for i, j in links]
