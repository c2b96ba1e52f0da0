"""A cell as a compiled program: kinds of robots, generated code, and arrays as the C driver wants them."""

from __future__ import annotations

import ctypes
import json
from collections.abc import Iterator

import numpy as np

from ..control.network import BoundIdeal
from ..errors import CompilationError
from ..simulation.closed_loop import ClosedLoop, State
from . import processor
from .arrays import CompiledLoop
from .build import cached_library, content_key, require_casadi
from .carrying import object_function
from .emit import written
from .header import driver, elementwise, prelude
from .kind import Classified, Kind, classify, standing
from .known import check_known, check_untouched
from .lanes import narrowest
from .specimen import Specimen
from .trace import Trace

#: relative difference between generated code and the reference engine above which the code is refused
AGREEMENT = 1e-9


def generate(kinds: list[Kind], width: int) -> Iterator[str]:
    """C sources one after another: of functions of kinds of robots and of objects, then the driver's two."""
    before = prelude(kinds, width)
    for k, kind in enumerate(kinds):
        for function in Trace(kind, f"kind{k}").functions():
            yield before + written(function)
    if any(kind.holds for kind in kinds):
        yield before + written(object_function(f"kind{len(kinds)}_object"))
    yield elementwise(max(width, processor.widest()))
    yield driver(kinds, width)


class Program(CompiledLoop):
    """A closed loop as a library that was found in the cache or built, and was compared with Pinocchio.

    Args:
        loop: controller and plant of a cell.
        libraries: libraries that are loaded already, by what they were made for; this program's is added.
        widest: most lanes that are worth it on this machine; robots stand in as many of them as are cheapest.

    Attributes:
        kinds: number of different robots, each with generated functions of its own.

    Raises:
        InputError: the cell uses something the compiled engine does not have, such as a user's subclass.
        MissingDependencyError: CasADi or a C compiler is missing.
        CompilationError: the code cannot be compiled, or computes something else than the reference engine.
    """

    def __init__(
        self, loop: ClosedLoop, libraries: dict[str, ctypes.CDLL] | None = None, widest: int | None = None
    ):
        check_known(loop)
        classified = classify(loop)
        self.kinds = len(classified.kinds)
        width = robots_in_lanes(loop, classified, widest)
        library = library_for(loop, classified, {} if libraries is None else libraries, width)
        super().__init__(loop, classified, library, scattered=True)


def robots_in_lanes(loop: ClosedLoop, classified: Classified, widest: int | None = None) -> int:
    """In how many lanes the robots of a closed loop stand.

    In more than one only robots of one kind, which hear of each other at once and are not asked about in the
    middle of a step.

    Args:
        loop, classified: the loop, and its robots' kinds.
        widest: most lanes; by default what the machine has.
    """
    ideal = isinstance(loop.controller.network, BoundIdeal)
    alone = len(classified.kinds) > 1 or not ideal or loop.devices.settings
    return 1 if alone else narrowest(loop.cell.n, processor.widest() if widest is None else widest)


def library_for(
    loop: ClosedLoop, classified: Classified, libraries: dict[str, ctypes.CDLL], width: int
) -> ctypes.CDLL:
    """The library of the kinds of a closed loop, for as many lanes; found, or built and compared.

    Raises:
        see `Program`
    """
    keys = [kind.key() for kind in classified.kinds]
    name = json.dumps([width, keys])
    if name not in libraries:
        check_untouched(loop)
        key = content_key(width, keys, require_casadi())
        libraries[name] = cached_library(
            key,
            lambda: generate(classified.kinds, width),
            lambda library: _compare(library, loop, classified),
        )
    return libraries[name]


def _compare(library: ctypes.CDLL, loop: ClosedLoop, classified: Classified) -> None:
    """Compare a library with Pinocchio, on one robot of each kind.

    Raises:
        CompilationError: they differ.
    """
    if not (hasattr(library, "lanes") and hasattr(library, "state_dot")):
        raise CompilationError("the library was made from other code", subject="generated code")
    specimen = Specimen(loop, classified)
    small = specimen.loop
    bases = (standing(robots).bases for robots in (small.cell.robots, small.plant.robots))
    found = CompiledLoop(small, Classified(classified.kinds, specimen.index, *bases), library)
    for case in specimen.cases():
        rates = small.evaluate(*case)[0], found.state_dot(*case)
        _agree(*map(small.state, rates))


def _rates(rate: State) -> dict[str, np.ndarray]:
    """Parts of a rate by the names of what changes with it."""
    return {
        "q'": rate.q,
        "v'": rate.v,
        "z'": rate.z,
        "memory'": rate.memory,
        "the plant's state'": rate.hidden,
    }


def _agree(expected: State, found: State) -> None:
    parts = _rates(found)
    for name, a in _rates(expected).items():
        b = parts[name]
        difference = np.abs(b - a).max(initial=0.0) / (1 + np.abs(a).max(initial=0.0))
        if not difference < AGREEMENT:
            raise CompilationError(
                f"it differs from Pinocchio by {difference:.2g} relative in {name} at a random state; use "
                "engine='pinocchio', and please report the cell",
                subject="generated code",
                found=float(difference),
            )
