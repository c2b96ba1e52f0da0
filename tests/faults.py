"""Faults of the compiled engine's driver, and of the lists before it, which its check has to find."""

from __future__ import annotations

import pytest
from refusals import refused

from synctrl.compiled import build, compiler, program
from synctrl.compiled.kind import classify
from synctrl.compiled.program import Program
from synctrl.errors import CompilationError
from synctrl.simulation.closed_loop import ClosedLoop


def sources_of(loop: ClosedLoop) -> list[str]:
    """The C sources that are made for a closed loop, the driver last."""
    classified = classify(loop)
    return list(program.generate(classified.kinds, program.robots_in_lanes(loop, classified)))


def empty_cache(monkeypatch: pytest.MonkeyPatch, folder) -> None:
    """Let a test compile its own code in a folder: without optimization, to be quick."""
    monkeypatch.setenv("SYNCTRL_CACHE", str(folder))
    monkeypatch.setattr(build, "_CHECKED", {})
    monkeypatch.setattr(compiler, "FLAGS", ("-O0", "-fPIC", "-ffp-contract=off"))


def row(name: str, columns: str, other: str | None = None) -> tuple[str, str]:
    """A function that reads the row of a quantity, and one that reads another one's, or always the first."""
    place = f" + (size_t)i * ({columns})"
    return f"a->{name}{place}", f"a->{other}{place}" if other else f"a->{name}"


def check_fault(loop: ClosedLoop, sources: list[str], fault: tuple[str, str], monkeypatch) -> None:
    """See to it that code with another text in the place of one is not taken for the loop."""
    text, _ = fault
    assert any(text in source for source in sources)
    broken = [source.replace(*fault) for source in sources]
    monkeypatch.setattr(program, "generate", lambda kinds, width: iter(broken))
    with refused(CompilationError, "generated code") as caught:
        Program(loop)
    assert not caught.value.found <= program.AGREEMENT
