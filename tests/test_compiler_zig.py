"""Where there is no C compiler, that of the package ziglang serves: the same bits, and nothing is left."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from test_cache import fetch
from test_compiler import SUM

from synctrl import Result, experiments
from synctrl.compiled import build, compiler, program
from synctrl.compiled.kind import classify
from synctrl.errors import CompilationError, MissingDependencyError

TARGETS = {
    "aarch64-linux-gnu": b"\x7fELF",
    "x86_64-macos": b"\xcf\xfa\xed\xfe",
    "aarch64-macos": b"\xcf\xfa\xed\xfe",
    "x86_64-windows-gnu": b"\x64\x86",
}


@pytest.fixture
def bare(tmp_path, monkeypatch):
    """A machine without a compiler: no program is found by its name."""
    (tmp_path / "programs").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "programs"))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(build, "_CHECKED", {})
    return tmp_path


@pytest.fixture
def zig(bare):
    """The compiler of the package on such a machine."""
    pytest.importorskip("ziglang", reason="a compiler is an extra: pip install 'synctrl[compiler]'")
    return compiler.compiler()


def test_without_any_compiler_the_extra_is_named(bare, monkeypatch):
    monkeypatch.setattr(compiler, "find_spec", lambda name: None)
    with refused(MissingDependencyError, "C compiler") as caught:
        fetch()
    assert "pip install 'synctrl[compiler]'" in caught.value.problem


def test_it_serves_where_there_is_no_other(zig):
    assert Path(zig[0]).parent.name == "ziglang"
    assert fetch().answer() == 42


def test_a_compiler_of_the_machine_comes_first(zig, bare, monkeypatch):
    (bare / "programs" / "clang").symlink_to("/bin/true")
    assert compiler.compiler() == ("clang",)
    monkeypatch.setenv("CC", "true")
    with refused(MissingDependencyError, "CC", found="'true' was not found"):
        compiler.compiler()


def test_a_module_of_its_name_in_the_working_folder_is_not_run(zig, bare, monkeypatch):
    (bare / "ziglang.py").write_text("raise SystemExit")
    (bare / "ziglang").mkdir()
    (bare / "ziglang" / "__main__.py").write_text("raise SystemExit")
    monkeypatch.chdir(bare)
    assert fetch().answer() == 42


def test_it_knows_the_processor(zig):
    assert compiler.flags(zig) == list(compiler.FLAGS)


def test_it_rounds_a_product_before_it_is_added_to(zig):
    """Left to itself it would not."""
    f = fetch(source=SUM).f
    f.restype, f.argtypes = ctypes.c_double, [ctypes.c_double] * 3
    for x in (1.1, 1 / 3, 1e-9 + 1):
        assert f(x, x, -(x * x)) == 0.0


CHECKED = """
import ctypes, sys
function = ctypes.CDLL(sys.argv[1]).next
print(function(2**31 - 1))
"""


@pytest.mark.parametrize("level", ["-O0", "-O2"])
def test_it_adds_no_checks_that_end_the_process(zig, bare, monkeypatch, level):
    monkeypatch.setattr(compiler, "FLAGS", (level, "-fPIC"))
    library = compiler.compile_library(["int next(int k) { return k + 1; }"], bare)
    done = subprocess.run([sys.executable, "-c", CHECKED, str(library)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) == -(2**31)


def test_it_is_stopped_when_it_takes_too_long(zig, bare, monkeypatch):
    monkeypatch.setattr(compiler, "LONGEST", 0.0)
    with refused(CompilationError, "C compiler", found="did not end within 0 s and was stopped"):
        fetch()
    assert not list((bare / "cache").iterdir())


def test_its_words_about_code_that_is_wrong_are_told(zig, bare):
    with refused(CompilationError, "C compiler", found="refused generated code") as caught:
        fetch(source="int answer(void) { return nothing; }")
    assert "nothing" in caught.value.problem
    assert not list((bare / "cache").iterdir())


# -- whole runs -------------------------------------------------------------------------------------------

RUN = """
import sys
from synctrl import experiments
getattr(experiments, sys.argv[1])().simulate(0.02, engine="compiled").save(sys.argv[2])
"""


def by_the_usual_compiler(name: str, cache: Path) -> Result:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", os.defpath)
        patch.setenv("SYNCTRL_CACHE", str(cache))
        return getattr(experiments, name)().simulate(0.02, engine="compiled")


@pytest.mark.parametrize("name", ["planar_four", "ur5_payload", "carry_planar"])
def test_a_run_has_the_same_bits_and_leaves_nothing_behind(name, zig, bare):
    """In a process of its own, whose homes and folders for temporary files are empty, and stay so."""
    expected = by_the_usual_compiler(name, bare / "usual")
    places = {word: bare / word for word in ("HOME", "XDG_CACHE_HOME", "TMPDIR")}
    for place in places.values():
        place.mkdir()
    paths = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "MPLCONFIGDIR": str(bare)}
    environment = {**os.environ, **{word: str(place) for word, place in places.items()}, **paths}
    command = [sys.executable, "-W", "ignore", "-c", RUN, name, str(bare / "run.npz")]
    subprocess.run(command, check=True, cwd=bare / "programs", env=environment)
    made = Result.load(bare / "run.npz")
    for word in ("q", "v", "tau", "theta_hat"):
        np.testing.assert_array_equal(getattr(made, word), getattr(expected, word), err_msg=word)
    assert [path for place in (*places.values(), bare / "programs") for path in place.iterdir()] == []
    assert sorted(path.suffix for path in (bare / "cache").iterdir()) == [".sha256", ".so"]


# -- other systems ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("target", TARGETS)
def test_the_code_compiles_for_other_systems(zig, bare, monkeypatch, target):
    """It is not run there. Without what a processor has beyond its kind, and for Windows not linked."""
    windows = "windows" in target
    flags = [flag for flag in compiler.FLAGS if flag != compiler.NATIVE and not (windows and flag == "-fPIC")]
    monkeypatch.setattr(compiler, "FLAGS", tuple(flags))
    monkeypatch.setattr(compiler, "compiler", lambda: (*zig, "-target", target))
    sources = program.generate(classify(experiments.planar_four().closed_loop()).kinds, width=2)
    made = parts(zig, target, sources, bare) if windows else [compiler.compile_library(sources, bare)]
    assert {path.read_bytes()[: len(TARGETS[target])] for path in made} == {TARGETS[target]}


def parts(zig, target: str, sources, folder: Path) -> list[Path]:
    """The object files of sources."""
    found = []
    for k, source in enumerate(sources):
        path = folder / f"{k}.c"
        path.write_text(source)
        command = [*zig, "-target", target, *compiler.FLAGS, "-c", str(path), "-o", f"{path}.o"]
        assert compiler.run(command, compiler.LONGEST, folder) == (0, "")
        found.append(folder / f"{k}.c.o")
    return found
