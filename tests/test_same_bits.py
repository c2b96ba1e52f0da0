"""Results do not depend on the compiler, on how much it optimises, or on what the processor can do."""

from __future__ import annotations

import platform
from collections.abc import Callable
from functools import cache, partial

import pytest
from side_by_side import Outcome, differing, in_lanes

from synctrl import Experiment
from synctrl.compiled import build, compiler
from synctrl.experiments import planar_four, ur5_payload

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

ALWAYS = tuple(flag for flag in compiler.FLAGS if not flag.startswith("-O") and flag != compiler.NATIVE)
#: flags, and whether they are those of one family of processors
WAYS: dict[str, tuple[tuple[str, ...], str]] = {
    "no optimisation": (("-O0", *ALWAYS), ""),
    "a little": (("-O1", compiler.NATIVE, *ALWAYS), ""),
    "much": (("-O3", compiler.NATIVE, *ALWAYS), ""),
    "for any processor": (("-O2", "-march=x86-64", *ALWAYS), "x86_64"),
}
#: cells, and in how many lanes their robots stand
CELLS: dict[str, tuple[Callable[[], Experiment], int]] = {
    "four planar arms": (partial(planar_four, disturbance="torque"), 4),
    "two UR5": (ur5_payload, 2),
}


def made(name: str, folder, flags: tuple[str, ...] = compiler.FLAGS) -> Outcome:
    """A run with code that is compiled for it."""
    make, width = CELLS[name]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SYNCTRL_CACHE", str(folder))
        patch.setattr(build, "_CHECKED", {})
        patch.setattr(compiler, "FLAGS", flags)
        return in_lanes(make(), width, duration=0.05)


@pytest.fixture(scope="module")
def usual(tmp_path_factory) -> Callable[[str], Outcome]:
    """A run with code as it is compiled when nobody asks for anything else."""
    return cache(lambda name: made(name, tmp_path_factory.mktemp("usual")))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", CELLS)
def test_optimisation_and_processor_change_no_bit(name, way, usual, tmp_path):
    flags, machine = WAYS[way]
    if machine not in platform.machine():
        pytest.skip(f"flags for {machine}")
    assert not differing(usual(name), made(name, tmp_path, flags))


@pytest.mark.parametrize("name", CELLS)
def test_another_compiler_changes_no_bit(name, usual, tmp_path, monkeypatch):
    """One that puts products and sums together unless it is told not to."""
    pytest.importorskip("ziglang", reason="a compiler is an extra: pip install 'synctrl[compiler]'")
    expected = usual(name)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    assert not differing(expected, made(name, tmp_path))
