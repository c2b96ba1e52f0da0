"""How many operations one evaluation of the generated functions takes, to compare ways to write them."""

from __future__ import annotations

from typing import Any

from .kind import Kind
from .trace import Trace


def operations(kind: Kind) -> dict[str, int]:
    """Arithmetic operations of every function of a kind, by name, and those of one evaluation, "evaluation".

    Sines and the like count as one. What only reads, writes or is a constant does not count.
    """
    counts = {
        function.name().partition("_")[2]: counted(function) for function in Trace(kind, "k").functions()
    }
    return {**counts, "evaluation": sum(counts[name] for name in ("measure", "control", "plant"))}


def counted(function: Any) -> int:
    """Arithmetic operations of one function of CasADi symbols."""
    import casadi as ca

    moves = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_ASSIGN}
    return sum(function.instruction_id(k) not in moves for k in range(function.n_instructions()))
