"""Names of modules that have moved still import."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

from synctrl.renamed import MOVED, new_name

OLD = [*MOVED, "synctrl.simulation.compiled", "synctrl.simulation.compiled.program"]


@pytest.mark.parametrize("old", OLD)
def test_an_old_name_is_the_module_of_today_and_says_its_name(old: str) -> None:
    sys.modules.pop(old, None)
    with pytest.warns(DeprecationWarning) as told:
        found = import_module(old)
    new = new_name(old)
    assert found is import_module(str(new))
    assert found.__name__ == new and found.__spec__.name == new
    assert any(str(new) in str(warning.message) for warning in told)


def test_the_warning_has_the_line_of_whoever_imports() -> None:
    code = "import warnings\nwarnings.simplefilter('error')\nfrom synctrl.tasks.cell import Cell"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert run.returncode == 1
    assert "synctrl.coupling.cell" in run.stderr.splitlines()[-1]


def test_other_names_are_as_unknown_as_before() -> None:
    with pytest.raises(ModuleNotFoundError):
        import_module("synctrl.tasks.attic")
    assert new_name("synctrl.tasks.spaces") is None
