"""Which engine makes runs where the user leaves it open."""

from __future__ import annotations

from ..errors import CompilationError, InputError, MissingDependencyError
from ..simulation.simulate import Experiment

AUTO = "auto"


def chosen(engine: str, experiment: Experiment, dt: float, period: float | None = None) -> tuple[str, str]:
    """The engine to use, and why it is not the fast one; the latter is empty if it is, or if a user has said.

    Args:
        engine: what the user has said: a name, or "auto".
        experiment: what is to be run.
        dt: its step, s.
        period: of sampled control, s, or None.

    Raises:
        InputError: the run itself cannot be planned.
    """
    if engine != AUTO:
        return engine, ""
    from ..compiled.build import require_casadi
    from ..compiled.cache import open_cache
    from ..compiled.compiler import compiler
    from ..compiled.engine import Compiled

    run = experiment.plan(None, dt, period)
    try:
        require_casadi()
        compiler()
        open_cache()
        Compiled().refuses(run)
    except (MissingDependencyError, CompilationError, InputError) as error:
        return "pinocchio", str(error)
    return "compiled", ""
