"""Which engine makes runs where the user leaves it open."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import CompilationError, InputError, MissingDependencyError
from ..simulation.simulate import Experiment

AUTO = "auto"
#: of the arguments of a run, those that it is planned with
PLANNED = ("dt", "control_period", "plant")


def fastest(experiment: Experiment, how: Mapping[str, Any]) -> tuple[str, str]:
    """The fastest engine that can make a run, and why it is not the compiled one; empty if it is.

    Args:
        experiment: what is to be run.
        how: arguments of `Experiment.simulate`.

    Raises:
        InputError: the run itself cannot be planned.
    """
    from ..compiled.build import require_casadi
    from ..compiled.cache import open_cache
    from ..compiled.compiler import compiler
    from ..compiled.engine import Compiled

    for name, only in (("integrator", "rk4"), ("plant", "pinocchio")):
        if how.get(name, only) != only:
            return "pinocchio", f"{name} '{how[name]}' is the reference engine's alone"
    run = experiment.plan(None, **{"dt": 1e-3, **{name: how[name] for name in PLANNED if name in how}})
    try:
        require_casadi()
        compiler()
        open_cache()
        Compiled().refuses(run)
    except (MissingDependencyError, CompilationError, InputError) as error:
        return "pinocchio", str(error)
    return "compiled", ""
