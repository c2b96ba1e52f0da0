"""Print the polynomials of synctrl/compiled/elementary.h, found by Remez' exchange in 60 digits.

python scripts/polynomials.py
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import mpmath
from mpmath import mpf

DIGITS = 60
#: an exchange is at its end when the largest and the smallest extremum of the error are as close as this
LEVEL = 1.01

Function = Callable[[mpf], mpf]


class Task(NamedTuple):
    """A function on an interval, what its error counts there, and how many coefficients there are."""

    function: Function
    weight: Function
    lowest: mpf
    highest: mpf
    count: int


def tasks() -> dict[str, Task]:
    """What is left of functions when their first terms are taken away; odd and even ones in z = x x.

    Intervals are wider by a ten thousandth than what reduction leaves, as it rounds.
    """
    wider, near_0 = mpf("1.0001"), mpf(10) ** -10
    quarter, half_log = (mpmath.pi / 4 * wider) ** 2, mpmath.log(2) / 2 * wider
    ratio = ((mpmath.sqrt(2) - 1) / (mpmath.sqrt(2) + 1)) ** 2 * wider

    def odd(function: Function, first: int) -> Function:
        """Of an odd function without its first term, over x^3."""
        return lambda z: (function(mpmath.sqrt(z)) / mpmath.sqrt(z) - first) / z

    def relative(function: Function) -> Function:
        return lambda z: z * mpmath.sqrt(z) / function(mpmath.sqrt(z))

    def even(z: mpf) -> mpf:
        return (mpmath.cos(mpmath.sqrt(z)) - 1 + z / 2) / z**2

    def exponential(r: mpf) -> mpf:
        return (mpmath.expm1(r) - r) / r**2 if abs(r) > mpf(10) ** -12 else mpf(1) / 2 + r / 6

    return {
        "sine": Task(odd(mpmath.sin, 1), relative(mpmath.sin), near_0, quarter, 6),
        "cosine": Task(even, lambda z: z**2 / mpmath.cos(mpmath.sqrt(z)), near_0, quarter, 6),
        "arc tangent": Task(odd(mpmath.atan, 1), relative(mpmath.atan), near_0, mpf(1) / 4 * wider, 13),
        "exponential": Task(exponential, lambda r: abs(r) + mpf(10) ** -9, -half_log, half_log, 11),
        "logarithm": Task(odd(lambda s: 2 * mpmath.atanh(s), 2), lambda z: z / 2, near_0, ratio, 7),
    }


def exchange(task: Task) -> tuple[list[mpf], mpf]:
    """The coefficients of the polynomial whose largest error is smallest, and that error."""
    middle, radius = (task.lowest + task.highest) / 2, (task.highest - task.lowest) / 2
    count = task.count + 1
    points = [middle - radius * mpmath.cos(mpmath.pi * (k + mpf(1) / 2) / count) for k in range(count)]
    fine = 40 * task.count
    grid = [middle - radius * mpmath.cos(mpmath.pi * mpf(k) / fine) for k in range(fine + 1)]
    while True:
        coefficients = _level(task, points)
        extrema = _extrema([(x, _error(task, coefficients, x)) for x in grid], count)
        sizes = [abs(error) for _, error in extrema]
        if max(sizes) < LEVEL * min(sizes):
            return coefficients, max(sizes)
        points = [x for x, _ in extrema]


def _level(task: Task, points: list[mpf]) -> list[mpf]:
    """The polynomial with errors of one size and changing signs at the points."""
    rows = [[*(x**k for k in range(task.count)), (-1) ** i / task.weight(x)] for i, x in enumerate(points)]
    found = mpmath.lu_solve(mpmath.matrix(rows), mpmath.matrix([task.function(x) for x in points]))
    return list(found)[: task.count]


def _error(task: Task, coefficients: list[mpf], x: mpf) -> mpf:
    return task.weight(x) * (mpmath.fsum(c * x**k for k, c in enumerate(coefficients)) - task.function(x))


def _extrema(errors: list[tuple[mpf, mpf]], count: int) -> list[tuple[mpf, mpf]]:
    """The largest error of every run of one sign; of one too many, the smaller one at an end goes."""
    found = [errors[0]]
    for x, error in errors[1:]:
        if (error > 0) != (found[-1][1] > 0):
            found.append((x, error))
        elif abs(error) > abs(found[-1][1]):
            found[-1] = x, error
    while len(found) > count:
        found.pop(0 if abs(found[0][1]) < abs(found[-1][1]) else -1)
    return found


def polynomials() -> dict[str, tuple[list[float], float]]:
    """Coefficients and largest relative error of each polynomial, by name."""
    with mpmath.workdps(DIGITS):
        found = {name: exchange(task) for name, task in tasks().items()}
        return {name: ([*map(float, c)], float(error)) for name, (c, error) in found.items()}


if __name__ == "__main__":
    for name, (coefficients, error) in polynomials().items():
        print(f"{name}: error at most {error:.2g}")
        print("\n".join(f"    {x.hex()}" for x in coefficients))
