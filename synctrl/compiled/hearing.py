"""The networks that compiled code has: how robots hear of each other, and what of it the driver is told."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Mapping
from enum import IntEnum
from types import MappingProxyType
from typing import Any

import numpy as np

from ..control.network import BoundDelayed, BoundIdeal, BoundPosted, Links, WForm
from ..control.network.delayed import NEAR
from ..control.network.links import Parts
from ..control.network.receivers import Extrapolate, Filter, Hold
from .address import Doubles, Ints


class Hearing(IntEnum):
    """How robots hear of each other; what the words mean is said in `control/network/`."""

    IDEAL = 0
    AT_ONCE = 1
    HOLD = 2
    EXTRAPOLATE = 3
    FILTER = 4
    DELAYED = 5


class Exchange(ctypes.Structure):
    """How robots hear of each other, and where that is in the memory of the network.

    Attributes:
        hearing: see `Hearing`; with the ideal network nothing else is told.
        F, F_dot, stamp, held, since, first, kept: where these parts of the memory begin.
        places: how many instants of the grid are kept.
        links, sender: where the links of a robot begin, (n + 1), and robot after robot whom it hears.
        own, weight: L_ii, (n), and A_ij of the links.
        delay: of the links, s.
        hermite: coefficients of polynomials across a step of the grid, (6, 6).
        omega, horizon: of receivers, rad/s and s.
        grid, near: step of the grid, s, and how far from it an instant may be, as a share of it.
    """

    _fields_ = [
        *((name, ctypes.c_int) for name in ("hearing", "F", "F_dot", "stamp", "held", "since", "first")),
        *((name, ctypes.c_int) for name in ("kept", "places")),
        *((name, Ints) for name in ("links", "sender")),
        *((name, Doubles) for name in ("own", "weight", "delay", "hermite")),
        *((name, ctypes.c_double) for name in ("omega", "horizon", "grid", "near")),
    ]


#: what is believed between messages, by the receiver
RECEIVERS: Mapping[type, Hearing] = MappingProxyType(
    {Hold: Hearing.HOLD, Extrapolate: Hearing.EXTRAPOLATE, Filter: Hearing.FILTER}
)
#: how robots hear of each other, by the network; where there are messages the receiver says it
NETWORKS: Mapping[type, Hearing | None] = MappingProxyType(
    {
        BoundIdeal: Hearing.IDEAL,
        WForm: Hearing.AT_ONCE,
        BoundPosted: None,
        BoundDelayed: Hearing.DELAYED,
    }
)
#: parts of a memory that the driver reads
READ = "F", "F_dot", "stamp", "held", "since", "first", "kept"


def parts_of(network: Any) -> Iterator[tuple[str, Any, tuple[type, ...]]]:
    """Every part of a network: what it is, the object, and the types that the driver stands for."""
    yield "network", network, (*NETWORKS,)
    if isinstance(network, WForm):
        yield "links of the network", network.links, (Links,)
        yield "memory of the network", network.parts, (Parts,)
    if isinstance(network, BoundPosted):
        yield "receiver of the network", network.receiver, (*RECEIVERS,)


def exchange_of(network: Any, address: Callable[[np.ndarray], int]) -> Exchange:
    """What the driver is told of a network.

    Args:
        network: one of `NETWORKS`.
        address: gives the address of an array, which it keeps.
    """
    if isinstance(network, BoundIdeal):
        return Exchange(hearing=Hearing.IDEAL)
    hearing = NETWORKS[type(network)]
    told = {**_links(network.links), **_delays(network)}
    if isinstance(network, BoundPosted):
        hearing = RECEIVERS[type(network.receiver)]
        told |= vars(network.receiver)
    told |= {name: place for name, place in network.parts.starts.items() if name in READ}
    arrays = {name: address(value) for name, value in told.items() if isinstance(value, np.ndarray)}
    return Exchange(hearing=hearing, **{**told, **arrays})


# -- internals --------------------------------------------------------------------------------------------


def _links(links: Links) -> dict[str, np.ndarray]:
    """Who hears whom; see `Exchange`."""
    begin = np.searchsorted(links.hearer, np.arange(len(links.own) + 1))
    integers = {"links": begin, "sender": links.sender}
    numbers = {"own": links.own, "weight": links.weight}
    return {
        **{name: np.array(array, dtype=np.intc) for name, array in integers.items()},
        **{name: np.array(array, dtype=float) for name, array in numbers.items()},
    }


def _delays(network: WForm) -> dict[str, Any]:
    """What a network with delays in continuous time has beside."""
    if not isinstance(network, BoundDelayed):
        return {}
    hermite = np.ascontiguousarray(network._coefficients)
    numbers = {"grid": network._step, "places": network._places, "near": NEAR}
    return {"delay": np.array(network.delay, dtype=float), "hermite": hermite, **numbers}
