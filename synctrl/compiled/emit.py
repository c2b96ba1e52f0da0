"""C from the instructions of CasADi functions, for numbers that are vectors of lanes.

CasADi would write C itself, but for one `double` at a time. Here every instruction becomes one line that
works on a `vec`, see `vectors.h`: as many robots, or runs, as it has lanes. Nothing is reordered, so the bits
of a result do not depend on how many lanes there are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

from ..errors import CompilationError
from .quantities import QUANTITIES

#: how C writes what an instruction does; the names are CasADi's, without OP_
OPERATIONS = {
    "INPUT": "{0}",
    "CONST": "{0}",
    "ASSIGN": "{0}",
    "ADD": "{0} + {1}",
    "SUB": "{0} - {1}",
    "MUL": "{0} * {1}",
    "DIV": "{0} / {1}",
    "NEG": "-{0}",
    "SQ": "{0} * {0}",
    "TWICE": "{0} + {0}",
    "INV": "splat(1) / {0}",
    "NOT": "v_not({0})",
    "SQRT": "v_sqrt({0})",
    "EXP": "v_exp({0})",
    "LOG": "v_log({0})",
    "POW": "v_pow({0}, {1})",
    "CONSTPOW": "v_pow({0}, {1})",
    "SIN": "v_sin({0})",
    "COS": "v_cos({0})",
    "TAN": "v_tan({0})",
    "ASIN": "v_asin({0})",
    "ACOS": "v_acos({0})",
    "ATAN": "v_atan({0})",
    "ATAN2": "v_atan2({0}, {1})",
    "SINH": "v_sinh({0})",
    "COSH": "v_cosh({0})",
    "TANH": "v_tanh({0})",
    "ASINH": "v_asinh({0})",
    "ACOSH": "v_acosh({0})",
    "ATANH": "v_atanh({0})",
    "LOG1P": "v_log1p({0})",
    "EXPM1": "v_expm1({0})",
    "HYPOT": "v_hypot({0}, {1})",
    "LT": "v_lt({0}, {1})",
    "LE": "v_le({0}, {1})",
    "EQ": "v_eq({0}, {1})",
    "NE": "v_ne({0}, {1})",
    "AND": "v_and({0}, {1})",
    "OR": "v_or({0}, {1})",
    "IF_ELSE_ZERO": "v_if_else_zero({0}, {1})",
    "FABS": "v_fabs({0})",
    "SIGN": "v_sign({0})",
    "COPYSIGN": "v_copysign({0}, {1})",
    "FMIN": "v_fmin({0}, {1})",
    "FMAX": "v_fmax({0}, {1})",
    "FMOD": "v_fmod({0}, {1})",
    "REMAINDER": "v_remainder({0}, {1})",
    "FLOOR": "v_floor({0})",
    "CEIL": "v_ceil({0})",
    "ERF": "v_erf({0})",
}


def declared_function(name: str) -> str:
    """How a generated function is declared: quantities, and the row that is computed."""
    return f"void {name}(const Quantities *a, int i)"


def written(function: Any) -> str:
    """A function of the table in C.

    Args:
        function: a CasADi function of SX whose arguments and results are quantities, see `quantities.py`.

    Raises:
        CompilationError: it has an instruction that is not in `OPERATIONS`.
    """
    body = "".join(f"    {line}\n" for line in (*_rows(function), *_instructions(function)))
    return f"{declared_function(function.name())} {{\n{body}}}\n"


def written_own(function: Any) -> str:
    """A function of the quantities of all robots in C, which writes its numbers where it is told.

    Args:
        function: a CasADi function of SX whose arguments are quantities, all of their rows, with one result.

    Raises:
        CompilationError: see `written`.
    """
    rows = [f"const vec *const in{k} = a->{function.name_in(k)};" for k in range(function.n_in())]
    body = "".join(f"    {line}\n" for line in (*rows, *_instructions(function)))
    return f"void {function.name()}(const Quantities *a, vec *restrict out0) {{\n{body}}}\n"


# -- internals --------------------------------------------------------------------------------------------


@cache
def _words() -> dict[int, str]:
    """What C writes, by CasADi's number of an operation."""
    import casadi as ca

    return {getattr(ca, f"OP_{name}"): text for name, text in OPERATIONS.items()}


def _rows(function: Any) -> Iterator[str]:
    """Where the rows of arguments and results are."""
    for k in range(function.n_in()):
        if function.nnz_in(k):
            yield f"const vec *const restrict in{k} = a->{_place(function.name_in(k))};"
    for k in range(function.n_out()):
        if function.nnz_out(k):
            yield f"vec *const restrict out{k} = a->{_place(function.name_out(k))};"


def _place(name: str) -> str:
    """The row of a quantity that belongs to robot i; what is not theirs has one row."""
    quantity = QUANTITIES[name]
    return f"{name} + (size_t)i * ({quantity.columns})" if quantity.rows == "n" else name


class _Line(NamedTuple):
    """An instruction whose places have become names: each intermediate number has one of its own."""

    operation: int
    given: list[str]
    result: str


def _instructions(function: Any) -> Iterator[str]:
    """One line per instruction, but sine and cosine of one angle together."""
    import casadi as ca

    lines = [*_lines(function)]
    asked = {(line.operation, line.given[0]): line.result for line in lines}
    for line in lines:
        angle = line.given[0]
        both = asked.get((ca.OP_SIN, angle), ""), asked.get((ca.OP_COS, angle), "")
        if line.operation == ca.OP_OUTPUT:
            yield f"{line.result} = {angle};"
        elif line.result not in both or "" in both:
            yield f"const vec {line.result} = {_text(function, line)};"
        elif line.result == min(both, key=lambda name: int(name[1:])):
            yield f"vec {both[0]}, {both[1]}; v_sincos({angle}, &{both[0]}, &{both[1]});"


def _lines(function: Any) -> Iterator[_Line]:
    """The instructions of a function, in their order."""
    import casadi as ca

    names: dict[int, str] = {}  # what stands at a place of CasADi's work vector now
    known: dict[tuple[int, int], str] = {}
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        given, result = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            yield _Line(operation, [names[given[0]]], f"out{result[0]}[{result[1]}]")
            continue
        name = f"t{k}"
        if operation == ca.OP_INPUT:
            place = given[0], given[1]
            if place in known:
                names[result[0]] = known[place]
                continue
            known[place] = name
            found = [f"in{given[0]}[{given[1]}]"]
        elif operation == ca.OP_CONST:
            found = [_number(function.instruction_constant(k))]
        else:
            found = [names[place] for place in given]
        names[result[0]] = name
        yield _Line(operation, found, name)


def _number(value: float) -> str:
    """A number that all lanes share."""
    text = {math.inf: "INFINITY", -math.inf: "-INFINITY"}.get(value, repr(float(value)))
    return f"splat({'NAN' if math.isnan(value) else text})"


def _text(function: Any, line: _Line) -> str:
    """What C computes in a line.

    Raises:
        CompilationError: its operation is not known.
    """
    template = _words().get(line.operation)
    if template is None:
        raise CompilationError(
            f"'{function.name()}' has an operation that is not generated, CasADi's number {line.operation}; "
            "use engine='pinocchio'",
            subject="generated code",
            found=line.operation,
        )
    return template.format(*line.given)
