"""Numbers in lanes: functions within the errors they state, with the same bits whatever compiles them."""

from __future__ import annotations

import ctypes
import importlib.util
import math
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synctrl.compiled.compiler import compiler
from synctrl.compiled.emit import written_own

ca = pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

FOLDER = Path(__file__).parents[1] / "synctrl" / "compiled"
HEADERS = tuple((FOLDER / name).read_text("utf-8") for name in ("vectors.h", "elementary.h"))

#: functions whose errors are stated, of one number and of two
ROUNDED = (
    "sin", "cos", "tan", "atan", "asin", "acos", "exp", "expm1", "sinh", "cosh", "tanh", "log", "log1p",
)  # fmt: skip
ROUNDED_PAIRED = ("atan2", "hypot")
#: those without errors
EXACT = ("sqrt", "floor", "ceil", "fabs", "sign", "not", "sq", "twice", "inv")
EXACT_PAIRED = (
    "lt", "le", "eq", "ne", "and", "or", "if_else_zero", "fmin", "fmax", "copysign", "fmod", "remainder",
)  # fmt: skip
#: those of the C library
LIBRARY, LIBRARY_PAIRED = ("asinh", "acosh", "atanh", "erf"), ("pow",)
#: of what one comment states for several functions, where it stands
STATED_WITH = {"sin": "sincos", "cos": "sincos", "atan": "atan2", "acos": "asin"}

SOURCE = """
#define EACH(name, expression) \\
    void each_##name(long n, const double *x, const double *y, double *to) { \\
        for (long i = 0; i < n; i += LANES) { \\
            vec a = load(x + i), b = load(y + i); \\
            (void)b; \\
            store(to + i, expression); \\
        } \\
    }
#define ALONE(name) EACH(name, v_##name(a))
#define PAIRED(name) EACH(name, v_##name(a, b))
EACH(literals, -(2.0 * a + b * 0.5 - 3.0) / (1.0 + a * b))
EACH(smaller, choose(is_less(a, b), a, b))
EACH(middle, choose(is_less_equal(a, b) & ~is_equal(a, b) & is_different(a, splat(0)), a, splat(-0.0)))
EACH(any, any(is_less(a, b)) ? splat(1) : splat(0))
void each_reversed(long n, const double *x, const double *y, double *to) {
    (void)y;
    for (long i = 0; i < n; i += LANES) {
        int index[LANES];
        for (int l = 0; l < LANES; l++) index[l] = (int)(n - 1 - i) - l;
        vec found = gather(x, index);
        for (int l = 0; l < LANES; l++) to[i + l] = lane(found, l);
    }
}
"""
SOURCE += "".join(f"ALONE({name})\n" for name in (*ROUNDED, *EXACT, *LIBRARY))
SOURCE += "".join(f"PAIRED({name})\n" for name in (*ROUNDED_PAIRED, *EXACT_PAIRED, *LIBRARY_PAIRED))

ALWAYS = ("-ffp-contract=off", "-fno-math-errno", "-std=c11", "-Wall", "-Wextra", "-Werror", "-Wno-psabi")
WIDTHS = (1, 2, 4, 8)
#: what all others are compared with
REFERENCE = 4, ("-O2",)
VARIANTS = [
    ((), width, flags)
    for flags in (("-O0",), ("-O1",), ("-O2",), ("-O3",), ("-O2", "-march=native"))
    for width in (WIDTHS if "-O2" in flags else (1, 8))
]
if importlib.util.find_spec("ziglang"):
    zig = (sys.executable, "-m", "ziglang", "cc")
    VARIANTS += [(zig, width, ("-O2",)) for width in WIDTHS]
    VARIANTS += [(zig, width, ("-O3", "-mcpu=baseline")) for width in (1, 8)]


class Library:
    """The functions of both headers, compiled for so many lanes."""

    def __init__(self, folder, width, flags, command=(), headers=HEADERS):
        source, binary = folder / "each.c", folder / "each.so"
        source.write_text("\n".join([f"#define LANES {width}", *headers, SOURCE]), "utf-8")
        call = [
            *(command or compiler()),
            *flags,
            *ALWAYS,
            "-fPIC",
            "-shared",
            str(source),
            "-o",
            str(binary),
            "-lm",
        ]
        subprocess.run(call, check=True, timeout=300)
        self._library = ctypes.CDLL(str(binary))

    def __call__(self, name, a, b=None):
        """What a function says of each number, or of each pair."""
        a, b = np.broadcast_arrays(a, a if b is None else b)
        count = a.size
        a, b = (np.resize(x.astype(float), -(-count // 8) * 8) for x in (a, b))
        found = np.empty(a.size)
        pointers = [ctypes.c_void_p(x.ctypes.data) for x in (a, b, found)]
        getattr(self._library, f"each_{name}")(ctypes.c_long(a.size), *pointers)
        return found[:count]


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return Library(tmp_path_factory.mktemp("reference"), *REFERENCE)


def bits(numbers):
    """What stands in memory; one NaN is as good as another."""
    return np.where(np.isnan(numbers), np.nan, numbers).view(np.int64)


# -- arguments --------------------------------------------------------------------------------------------

LARGEST, SMALLEST, NORMAL = sys.float_info.max, 5e-324, sys.float_info.min
SPECIAL = np.array([0, 1, 2, 20, 709.5, 710.2, 745, 750, 2.0**20, LARGEST, SMALLEST, NORMAL, math.inf])
SPECIAL = np.concatenate([SPECIAL, np.nextafter(SPECIAL[1:-1], 0), [math.nan]])
SPECIAL = np.concatenate([SPECIAL, -SPECIAL])


@cache
def arguments():
    """Numbers of all sizes, shuffled: dense near 0, tiny, huge, near multiples of pi/2."""
    rng = np.random.default_rng(17)
    every_size = np.ldexp(rng.uniform(-1, 1, 800), rng.integers(-1073, 1024, 800))
    near_one = 1 - np.ldexp(rng.uniform(-1, 1, 200), rng.integers(-53, 0, 200))
    k = np.concatenate([np.arange(1, 60), rng.integers(60, 2**24, 240)])
    with mpmath.workprec(200):
        multiples = np.array([float(int(n) * mpmath.pi / 2) for n in k])
    found = [np.linspace(-4, 4, 801), rng.uniform(-30, 30, 300), rng.uniform(-746, 711, 300), every_size]
    found += [rng.uniform(-2e6, 2e6, 300), near_one, -near_one, multiples, np.nextafter(multiples, -np.inf)]
    # the double that is closest to a multiple of pi/2, for its size
    found += [[6381956970095103 * 2.0**797], SPECIAL]
    return rng.permutation(np.concatenate(found))


def pairs():
    """Pairs of numbers of all sizes, of like sizes, and special ones."""
    rng = np.random.default_rng(18)
    a, like = np.array([rng.permutation(arguments())[:1500], rng.normal(size=1500)])
    with np.errstate(over="ignore"):
        b = np.concatenate([rng.permutation(arguments())[:500], (a * like)[500:1000], like[1000:]])
    special = np.array(np.meshgrid(SPECIAL, SPECIAL)).reshape(2, -1)
    return np.concatenate([a, special[0]]), np.concatenate([b, special[1]])


# -- errors -----------------------------------------------------------------------------------------------


#: where functions are real, and have no more digits than mpmath can write
DOMAIN = {
    "asin": (-1, 1),
    "acos": (-1, 1),
    "log": (SMALLEST, math.inf),
    "log1p": (math.nextafter(-1, 0), math.inf),
}
DOMAIN |= dict.fromkeys(("exp", "expm1", "sinh", "cosh", "tanh"), (-800, 800))


def stated(name):
    """The error that the comment above a function states, ulp."""
    form = r"ithin ([\d.]+) ulp[^/]*\*/\nVECTOR \w+ v_(\w+)\("
    return {found: float(ulp) for ulp, found in re.findall(form, HEADERS[1])}[STATED_WITH.get(name, name)]


def error(found, exact):
    """Of one number, in units in the last place of the exact one."""
    _, exponent = mpmath.frexp(exact)
    if abs(exact) > LARGEST:
        return mpmath.mpf(0 if found == math.copysign(math.inf, exact) else math.inf)
    return abs(mpmath.mpf(found) - exact) / mpmath.ldexp(1, max(int(exponent), -1021) - 53)


def worst(library, name, *args):
    """The largest error, where the exact value is a real number, ulp."""
    found, largest = library(name, *args), mpmath.mpf(0)
    with mpmath.workprec(130):
        for row in zip(found, *args, strict=True):
            y, *x = (float(number) for number in row)
            exact = exactly(name, *x)
            if exact is not None:
                largest = max(largest, error(y, exact))
    return float(largest)


def exactly(name, *x):
    """The value of a function, None if it is no finite real number."""
    if not all(map(math.isfinite, x)) or (name == "atan2" and x[0] == 0):
        return None  # mpmath has one 0 only
    if name in DOMAIN and not DOMAIN[name][0] <= x[0] <= DOMAIN[name][1]:
        return None
    return getattr(mpmath, name)(*map(mpmath.mpf, x))


@pytest.mark.parametrize("name", ROUNDED)
def test_errors_are_those_that_are_stated(library, name):
    assert worst(library, name, arguments()) <= stated(name)


@pytest.mark.parametrize("name", ROUNDED_PAIRED)
def test_errors_of_functions_of_two_numbers_are_those_that_are_stated(library, name):
    assert worst(library, name, *pairs()) <= stated(name)


@settings(max_examples=200)
@given(x=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=4, max_size=4))
def test_sine_and_cosine_are_right_of_any_number(library, x):
    for name in ("sin", "cos"):
        assert worst(library, name, np.array(x)) <= stated(name)


def test_a_wrong_digit_of_a_coefficient_is_seen(tmp_path):
    assert "0x1.111111110f7cbp-7" in HEADERS[1]
    wrong = Library(tmp_path, *REFERENCE, headers=(HEADERS[0], HEADERS[1].replace("0f7cbp-7", "1f7cbp-7")))
    assert worst(wrong, "sin", np.linspace(-1, 1, 101)) > stated("sin")


def test_polynomials_are_the_best_of_their_degree(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "scripts")
    from polynomials import polynomials

    written = {float.fromhex(text) for text in re.findall(r"-?0x[\da-f.]+p[+-]\d+", HEADERS[1])}
    for name, (coefficients, largest) in polynomials().items():
        assert {*coefficients} - {0.5} <= written, name
        assert largest < 2.0**-57


# -- special arguments ------------------------------------------------------------------------------------

NUMPY = {"atan": "arctan", "asin": "arcsin", "acos": "arccos", "atan2": "arctan2", "inv": "reciprocal"}


@pytest.mark.parametrize("name", [*ROUNDED, *LIBRARY[:3]])
def test_infinite_numbers_0_and_nan_are_those_of_c(library, name):
    name_of_numpy = NUMPY.get(name, f"arc{name[1:]}" if name in LIBRARY else name)
    with np.errstate(all="ignore"):
        expected = getattr(np, name_of_numpy)(SPECIAL)
    found = library(name, SPECIAL)
    plain = np.isfinite(expected) & (expected != 0)
    np.testing.assert_array_equal(bits(found)[~plain], bits(expected)[~plain])
    np.testing.assert_array_equal(np.signbit(found)[plain], np.signbit(expected)[plain])


@pytest.mark.parametrize("name", ROUNDED_PAIRED)
def test_infinite_numbers_0_and_nan_of_two_are_those_of_c(library, name):
    a, b = np.array(np.meshgrid(SPECIAL, SPECIAL)).reshape(2, -1)
    special = ~(np.isfinite(a) & np.isfinite(b)) | (a == 0) | (b == 0)
    with np.errstate(all="ignore"):
        expected = getattr(np, NUMPY.get(name, name))(a, b)
    np.testing.assert_array_equal(bits(library(name, a, b))[special], bits(expected)[special])


@pytest.mark.parametrize("name", ["sin", "tan", "atan", "asin", "expm1", "sinh", "tanh", "log1p"])
def test_odd_ones_keep_what_is_next_to_0(library, name):
    x = np.concatenate([SMALLEST * np.arange(100), NORMAL * np.linspace(0, 1, 100)])
    np.testing.assert_array_equal(bits(library(name, [*x, *-x])), bits(np.array([*x, *-x])))


# -- exact operations -------------------------------------------------------------------------------------

numbers = st.floats() | st.sampled_from([*SPECIAL]) | st.integers(-3, 3).map(float)
several = st.lists(st.tuples(numbers, numbers), min_size=8, max_size=8).map(lambda rows: np.array(rows).T)

A, B = ca.SX.sym("a"), ca.SX.sym("b")
CASADI = {
    "sqrt": ca.sqrt(A), "floor": ca.floor(A), "ceil": ca.ceil(A), "fabs": ca.fabs(A), "sign": ca.sign(A),
    "not": ca.logic_not(A), "sq": A * A, "twice": 2 * A, "inv": 1 / A, "copysign": ca.copysign(A, B),
    "lt": A < B, "le": A <= B, "eq": A == B, "ne": A != B, "and": ca.logic_and(A, B), "or": ca.logic_or(A, B),
    "if_else_zero": ca.if_else(A, B, 0), "fmin": ca.fmin(A, B), "fmax": ca.fmax(A, B),
    "fmod": ca.fmod(A, B), "remainder": ca.remainder(A, B),
    "literals": -(2 * A + B * 0.5 - 3) / (1 + A * B),
}  # fmt: skip
CASADI = {name: ca.Function(name, [A, B], [found]) for name, found in CASADI.items()}


@pytest.mark.parametrize("name", CASADI)
@settings(max_examples=60)
@given(ab=several)
def test_exact_operations_are_those_of_casadi(library, name, ab):
    found, expected = library(name, *ab), CASADI[name](*ab[:, None]).full()[0]
    if name in ("fmin", "fmax"):  # of 0 and -0, either
        found, expected = found + 0.0, expected + 0.0
    np.testing.assert_array_equal(bits(found), bits(expected))


@pytest.mark.parametrize("name", (*ROUNDED, *LIBRARY, *ROUNDED_PAIRED, "fmod", "remainder"))
def test_what_lanes_have_is_written_where_symbols_ask_for_it(name):
    found = getattr(ca, name)(*(A, B)[: 1 if name in ROUNDED + LIBRARY else 2])
    assert f"= v_{name}(" in written_own(ca.Function("own", [A, B], [found], ["q", "v"], ["numbers"]))


@given(ab=several)
def test_masks_choose(library, ab):
    a, b = ab
    with np.errstate(invalid="ignore"):
        np.testing.assert_array_equal(bits(library("smaller", a, b)), bits(np.where(a < b, a, b)))
        middle = np.where((a <= b) & ~(a == b) & (a != 0), a, -0.0)
        np.testing.assert_array_equal(bits(library("middle", a, b)), bits(middle))
        width = REFERENCE[0]
        some = np.repeat((a < b).reshape(-1, width).any(axis=1), width)
        np.testing.assert_array_equal(library("any", a, b), some)
    np.testing.assert_array_equal(bits(library("reversed", a)), bits(a[::-1]))


@pytest.mark.parametrize("lane", range(REFERENCE[0]))
def test_a_mask_of_one_lane_is_seen(library, lane):
    a = np.eye(REFERENCE[0])[lane]
    assert library("any", 0 * a, a).all()
    assert not library("any", a, a).any()


# -- bits -------------------------------------------------------------------------------------------------


@cache
def in_reference(library):
    """What the reference variant says, by function."""
    alone = {name: bits(library(name, arguments())) for name in (*ROUNDED, *EXACT)}
    paired = {name: bits(library(name, *pairs())) for name in (*ROUNDED_PAIRED, *EXACT_PAIRED, "literals")}
    return alone, paired


def label(variant):
    command, width, flags = variant
    return " ".join(["zig" if command else "cc", str(width), *flags])


@pytest.mark.parametrize("variant", VARIANTS, ids=label)
def test_bits_depend_neither_on_lanes_nor_on_the_compiler(library, variant, tmp_path):
    command, width, flags = variant
    other = Library(tmp_path, width, flags, command)
    for expected, found in zip(in_reference(library), in_reference(other), strict=True):
        for name in expected:
            np.testing.assert_array_equal(found[name], expected[name], err_msg=name)
