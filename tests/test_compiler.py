"""Generated code is made for the processor it runs on, rounds every operation, and is found only there."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest
from test_cache import script

from synctrl.compiled import build, processor
from synctrl.compiled.compiler import FLAGS, NATIVE, compile_library, compiler, flags


@pytest.fixture
def made(tmp_path):
    """A function that compiles a text, and loads the library."""

    def make(source: str) -> ctypes.CDLL:
        return ctypes.CDLL(str(compile_library([source], tmp_path)))

    return make


# -- the processor ----------------------------------------------------------------------------------------


def test_code_for_another_processor_has_another_key(monkeypatch):
    keys, own = [build.content_key("code")], processor.cpu_features()
    for features in (own[:-1], (*own, "another"), own):
        monkeypatch.setattr(build, "cpu_features", lambda features=features: features)
        keys.append(build.content_key("code"))
    assert len(set(keys[:3])) == 3
    assert keys[3] == keys[0]


@pytest.mark.parametrize(
    ("features", "width"),
    [
        ((), 1),
        (("fpu", "mmx"), 1),
        (("sse2", "sse"), 2),
        (("fp", "asimd"), 2),
        (("neon",), 1),  # of 32 bits: it has no doubles
        (("avx", "sse2"), 2),
        (("avx2", "avx", "sse2"), 4),
        (("avx512f", "avx2", "avx", "sse2"), 8),
        (("avx512cd", "avx2"), 4),
    ],
)
def test_the_widest_vectors_are_those_that_the_features_have(features, width):
    assert processor.widest(features) == width


def test_this_processor_has_vectors_as_wide_as_its_features_say():
    assert processor.widest() == processor.widest(processor.cpu_features())
    assert processor.widest() in {1, *processor.WIDTHS.values()}


def test_linux_names_features_of_each_processor_and_those_count_that_all_have():
    text = "processor\t: 0\nflags\t\t: fpu sse2 avx2\nbugs\t\t: none\n\nprocessor\t: 1\nflags\t: sse2 fpu\n"
    assert processor.of_linux(text) == {"fpu", "sse2"}
    assert processor.of_linux("processor\t: 0\nFeatures\t: fp asimd\nCPU part\t: 0xd0c\n") == {"fp", "asimd"}
    assert processor.of_linux("") == set()


def test_macos_names_features_in_lines_and_in_lists():
    arm = "hw.optional.floatingpoint: 1\nhw.optional.arm.FEAT_BF16: 0\nhw.optional.arm.FEAT_FHM: 1\n"
    assert processor.of_macos(arm) == {"floatingpoint", "feat_fhm"}
    intel = "hw.optional.sse2: 1\nmachdep.cpu.leaf7_features: AVX2 BMI1\nmachdep.cpu.brand_string: AVX512F\n"
    assert processor.of_macos(intel) == {"sse2", "avx2", "bmi1"}


@pytest.mark.parametrize("machine", ["x86_64", "AMD64", "arm64", "aarch64"])
def test_where_the_system_is_silent_every_processor_of_the_kind_has_two_doubles(monkeypatch, machine):
    monkeypatch.setattr(processor, "_cpuinfo", str)
    monkeypatch.setattr(processor, "_sysctl", str)
    monkeypatch.setattr(processor.platform, "machine", lambda: machine)
    assert processor.widest(processor.cpu_features.__wrapped__()) == 2


# -- the flags --------------------------------------------------------------------------------------------

SUM = "double f(double a, double b, double c) { return a * b + c; }"


def test_a_product_is_rounded_before_it_is_added_to(made):
    """One operation for both, which processors have and compilers take by themselves, leaves the rest."""
    f = made(SUM).f
    f.restype, f.argtypes = ctypes.c_double, [ctypes.c_double] * 3
    for x in (1.1, 1 / 3, 1e-9 + 1):
        assert f(x, x, -(x * x)) == 0.0


def restricted(tmp_path: Path, monkeypatch) -> Path:
    """A compiler that refuses every -march, and writes down what it was called with."""
    asked = tmp_path / "asked"
    lines = ["#!/bin/sh", f'echo "$*" >> "{asked}"', 'case "$*" in *-march*) exit 1;; esac']
    text = "\n".join([*lines, f'exec {" ".join(compiler())} "$@"', ""])
    monkeypatch.setenv("CC", str(script(tmp_path / "restricted", text)))
    return asked


def test_a_compiler_that_does_not_know_the_processor_compiles_without(tmp_path, monkeypatch, made):
    asked = restricted(tmp_path, monkeypatch)
    for _ in range(2):
        assert made("int answer(void) { return 42; }").answer() == 42
    lines = asked.read_text().splitlines()
    assert len([line for line in lines if NATIVE in line]) == 1  # once in a process
    compiled = [line.split() for line in lines if "-c" in line.split()]
    assert len(compiled) == 2
    assert all(set(FLAGS) - set(line) == {NATIVE} for line in compiled)


def test_the_compiler_here_knows_every_flag():
    assert flags(compiler()) == list(FLAGS)
