"""The parts of a controller that users may write: what they say of themselves, and whether they fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..checks import instance, shaped
from ..errors import InputError, SynctrlError
from .adaptation import Adaptation
from .laws import Asked, BoundLaw, Law, no_errors
from .network import BoundNetwork, Communication, Received


def settings_of(part: Adaptation | Law | Communication) -> dict[str, Any]:
    """Name and settings of a part, by default the name of its type.

    Raises:
        InputError: its `as_dict` gives no mapping.
    """
    settings, where = part.as_dict(), f"{type(part).__qualname__}, as_dict"
    instance(where, settings, Mapping, "names and settings, for example {'gain': 1.0}")
    return {"name": type(part).__name__, **settings}


def check_parts(law: BoundLaw, network: BoundNetwork, n: int, p: int, m: int) -> None:
    """Look at what law and network give where there are no errors.

    Args:
        law, network: for the robots of one cell.
        n, p, m: numbers of robots, of synchronization errors and of task coordinates.

    Raises:
        InputError: something of another shape than it should have, or one that fails where there are no
            errors.
    """
    with _named("network", network):
        memory = network.start()
        integral = network.integral(memory)
        received = network.exchange(0.0, np.zeros((2, n, m)), memory)
    with _named("law", law):
        asked = law.command(no_errors(n, m))
    instance(f"network {type(network).__qualname__}, exchange", received, Received, "a Received")
    instance(f"law {type(law).__qualname__}, command", asked, Asked, "an Asked")
    _check_shapes("network", network, {
        "epsilon": (received.epsilon, (p, m)), "epsilon_dot": (received.epsilon_dot, (p, m)),
        "shares": (received.shares, (3, n, m)), "memory_dot": (received.memory_dot, np.shape(memory)),
        "integral": (integral, (p, m)),
    })  # fmt: skip
    _check_shapes("law", law, {
        "xref_dot": (asked.xref_dot, (n, m)), "xref_ddot": (asked.xref_ddot, (n, m)),
        "force": (asked.force, (n, m)),
    })  # fmt: skip


@contextmanager
def _named(role: str, part: Any) -> Iterator[None]:
    """Name the part that fails in between."""
    try:
        yield
    except SynctrlError:
        raise
    except Exception as error:  # whatever a user's code raises
        raise InputError(
            f"expected one that works where there are no errors, found {type(error).__name__}: {error}",
            subject=f"{role} {type(part).__qualname__}",
            found=type(error).__name__,
        ) from error


def _check_shapes(role: str, part: Any, parts: Mapping[str, tuple[Any, tuple[int, ...]]]) -> None:
    for name, (value, shape) in parts.items():
        shaped(f"{role} {type(part).__qualname__}, {name}", value, shape)
