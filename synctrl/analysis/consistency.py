"""Do the estimates describe bodies that can exist? Asked of a run at every logged instant.

Ten inertial parameters are those of a body exactly if its pseudo-inertia is positive definite, see
`synctrl.robots.pseudo_inertia`. The theorem does not need it: (14) leaves these parameters in the paper's own
cell. Whoever uses the estimates, to predict torque or to invert a mass matrix, does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..robots.parameters import count_bodies
from ..robots.pseudo_inertia import smallest_eigenvalues
from ..simulation.result import Result
from ..simulation.simulate import Experiment


@dataclass(frozen=True, eq=False)
class Consistency:
    """The smallest eigenvalue of the pseudo-inertia of every body, estimated.

    Attributes:
        t: logged instants, (T,), s.
        names: of the robots.
        smallest: per robot an array (T, bodies), in kg and kg·m^2 mixed; its sign says whether such a body
            can exist.
    """

    t: np.ndarray
    names: tuple[str, ...]
    smallest: tuple[np.ndarray, ...]

    @property
    def holds(self) -> bool:
        """Whether all estimates are those of bodies that can exist, throughout."""
        return all(bool((values > 0).all()) for values in self.smallest)

    @property
    def left(self) -> dict[str, tuple[float, int, float]]:
        """By name of a robot: when an estimate first was that of no body, s, which, and its worst value."""
        found = {}
        for name, values in zip(self.names, self.smallest, strict=True):
            outside = (values <= 0).any(axis=1)
            if outside.any():
                body = int(values[int(outside.argmax())].argmin())
                found[name] = (float(self.t[int(outside.argmax())]), body, float(values[:, body].min()))
        return found

    @property
    def until(self) -> float | None:
        """The first instant at which an estimate was that of no body, s; None if there is none."""
        return min((t for t, _, _ in self.left.values()), default=None)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers: whether it holds, by robot its smallest value, and when it was lost."""
        worst = {name: float(v.min()) for name, v in zip(self.names, self.smallest, strict=True)}
        return {"holds": self.holds, "smallest": worst, "left": {k: list(v) for k, v in self.left.items()}}

    def __str__(self) -> str:
        if self.holds:
            return "physically consistent throughout"
        return "; ".join(
            f"{name}: body {body + 1} is none that can exist from t = {t:.3g} s on "
            f"(eigenvalue {worst:.2g} of its pseudo-inertia)"
            for name, (t, body, worst) in self.left.items()
        )


def physical_consistency(result: Result, experiment: Experiment | None = None) -> Consistency:
    """Whether the estimates of a run are those of bodies that can exist.

    Args:
        result: the run.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: no experiment, or parameters that are not those of bodies.
    """
    made = experiment or result.experiment
    if made is None:
        raise InputError("expected the experiment that made the result, found none", subject="experiment")
    cell = made.cell
    counts = [
        count_bodies(f"{name}, parameters", p) for name, p in zip(cell.names, cell.parameters, strict=True)
    ]
    rows = [result.theta_hat[:, i, : 10 * count] for i, count in enumerate(counts)]
    return Consistency(result.t, tuple(cell.names), tuple(map(smallest_eigenvalues, rows)))
