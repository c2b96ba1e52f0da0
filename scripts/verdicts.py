"""Certify every ready cell with its main variants, and print docs/verdicts.md.

python scripts/verdicts.py > docs/verdicts.md     (runs of whole length: about half an hour)
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from synctrl import Experiment
from synctrl.analysis import Certificate, certify
from synctrl.analysis.certify import MEANINGS, VERDICTS
from synctrl.errors import SimulationError
from synctrl.experiments import (
    a460_full_pair,
    a460_pair,
    bead_on_edge,
    bead_on_path,
    carry_planar,
    carry_ur5,
    mixed_four,
    mobile_robot,
    panda_four,
    planar_four,
    rigid_object,
    ur5_payload,
)


@dataclass(frozen=True)
class Trial:
    """A ready cell with options of its own, and how it is run.

    Attributes:
        make, options: the cell is `make(**options)`.
        run: options of `simulate`.
        engine: the only engine that has the cell, or None if all have it.
    """

    make: Callable[..., Experiment]
    options: dict[str, Any] = field(default_factory=dict)
    run: dict[str, Any] = field(default_factory=dict)
    engine: str | None = None

    @property
    def name(self) -> str:
        """The call, as one writes it."""
        call = f"{self.make.__name__}({_arguments(self.options)})"
        return call + (f".simulate({_arguments(self.run)})" if self.run else "")

    def certificate(self, duration: float | None = None, engine: str = "pinocchio") -> Certificate:
        """Run it, by default to its end, and certify the run; or what there is of it, if it breaks off."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what a run warns of is not what is asked here
            made = self.make(**self.options)
            try:
                return certify(made.simulate(duration, engine=self.engine or engine, **self.run))
            except SimulationError as error:
                return certify(error.result)


def _arguments(options: dict[str, Any]) -> str:
    return ", ".join(f"{name}={value!r}" for name, value in options.items())


ALONE, PUSHED, RUBBED, QUIET = {"synchronized": False}, {"push": True}, {"friction": True}, {"push": False}
SMOOTH = {"friction": False}
TRIALS = (
    Trial(planar_four),
    Trial(planar_four, ALONE),
    Trial(planar_four, {"radii": "table"}),
    Trial(planar_four, {"k_r_space": "task"}),
    Trial(planar_four, {"reference_acceleration": "paper"}),
    Trial(planar_four, {"disturbance": "torque"}, {"dt": 5e-4}),
    Trial(planar_four, {}, {"control_period": 1e-3}),
    Trial(a460_pair),
    Trial(a460_pair, ALONE),
    Trial(a460_pair, SMOOTH),
    Trial(a460_pair, SMOOTH | ALONE),
    Trial(a460_pair, {"adapt_friction": True}),
    Trial(a460_full_pair, {}, {"dt": 2e-4}, "pinocchio"),
    Trial(rigid_object),
    Trial(rigid_object, {"disturbed": False}),
    Trial(mobile_robot),
    Trial(mobile_robot, {"disturbed": False}),
    Trial(ur5_payload),
    Trial(ur5_payload, ALONE),
    Trial(panda_four),
    Trial(panda_four, ALONE),
    Trial(mixed_four),
    Trial(mixed_four, ALONE),
    Trial(bead_on_path, {}, {"dt": 2e-4}),
    Trial(bead_on_path, QUIET | SMOOTH),
    Trial(bead_on_edge),
    Trial(bead_on_edge, QUIET),
    Trial(bead_on_edge, QUIET | RUBBED, {"dt": 2e-4}),
    Trial(carry_ur5),
    Trial(carry_ur5, ALONE),
    Trial(carry_ur5, {"grasp": "rigid"}, engine="pinocchio"),
    Trial(carry_ur5, RUBBED, {"dt": 2e-4}),
    Trial(carry_ur5, PUSHED),
    Trial(carry_ur5, {"geometric_error": True}),
    Trial(carry_ur5, {"geometric_error": True, "admittance": True}),
    Trial(carry_planar, engine="pinocchio"),
    Trial(carry_planar, ALONE, engine="pinocchio"),
    Trial(carry_planar, {"geometric_error": True}, engine="pinocchio"),
    Trial(carry_planar, {"geometric_error": True, "admittance": True}, engine="pinocchio"),
)

HEAD = """# Verdicts of the ready cells

What [the certificate](theory.md#watching-the-proof) says of every cell of `synctrl.experiments` and of its
main variants, each run to its end:

{meanings}

A reason is what acted outside the theorem, or what raises doubt about the run; if a run is outside, the first
one decides. Numbers are left out, so that the words are the same on every machine; `print(certify(run))` has
them. Where a call names a `dt`, the 1 ms of a run by default are too long for the balance of $V$ to tell, and
the verdict would be the last one for that alone.

`python scripts/verdicts.py > docs/verdicts.md` makes this page, in about half an hour. As that is too long
for every change, `tests/test_verdicts.py` finds out which cell is missing, and makes those rows again, from
short runs, whose verdict shows early.

| call | verdict | because of |
|---|---|---|
"""
NOTHING = "nothing outside acted"


def reasons(certificate: Certificate) -> tuple[str, ...]:
    """Why a verdict is what it is, what decides first; without numbers, which machines may round apart."""
    decisive = (*certificate.unbounded, *certificate.doubts)
    found = (*decisive, *(text for text in certificate.outside if text not in decisive))
    return tuple(
        re.sub(r" of [\d.e+-]+(?= may)", "", re.split(r": |, expected|, found", text)[0]) for text in found
    )


def row(name: str, certificate: Certificate) -> str:
    """A line of the table."""
    words = "; ".join(reasons(certificate)) or NOTHING
    return f"| `{name}` | {certificate.verdict} | {words} |"


def head() -> str:
    """The page above its rows, with what each verdict means."""
    meanings = (f"- **{verdict}**: {words}" for verdict, words in zip(VERDICTS, MEANINGS, strict=True))
    return HEAD.format(meanings="\n".join(meanings))


def lines(
    trials: Iterable[Trial] = TRIALS, duration: float | None = None, engine: str = "pinocchio"
) -> Iterator[str]:
    """Rows of the table, one by one, of runs to their end or of a shorter duration, s."""
    return (row(trial.name, trial.certificate(duration, engine)) for trial in trials)


if __name__ == "__main__":
    print(head(), end="")
    for line in lines(engine="compiled"):
        print(line, flush=True)
