"""Scripts that sweep on several processes, with a main guard and without."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="pip install 'synctrl[sweep]'")
TESTS = Path(__file__).parent
ENV = {**os.environ, "PYTHONPATH": os.pathsep.join((str(TESTS.parent), str(TESTS)))}

UNGUARDED = """
from sweeps import quiet, small_sweep


def main():
    quiet(small_sweep(), "sweep", 2, "{backend}")
    print("done")

main()
"""
GUARDED = UNGUARDED.replace("\nmain()\n", '\nif __name__ == "__main__":\n    main()\n')


def run(*arguments: str, text: str | None = None, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=cwd, env=ENV, input=text, capture_output=True, text=True)


def script(folder: Path, text: str, backend: str) -> str:
    (folder / "script.py").write_text(text.format(backend=backend))
    return "script.py"


def test_a_dask_sweep_without_a_main_guard_is_refused_in_one_line_before_anything_starts(tmp_path):
    done = run(script(tmp_path, UNGUARDED, "dask"), cwd=tmp_path)
    assert done.returncode == 1
    said = [line for line in done.stderr.splitlines() if "Error" in line and not line.startswith(" ")]
    assert len(said) == 1, done.stderr
    assert said[0].startswith("synctrl.errors.SweepError: ")
    assert "script.py'" in said[0] and "line 9" in said[0] and '`if __name__ == "__main__":`' in said[0]
    assert done.stderr.count("Traceback") == 1


@pytest.mark.parametrize(("text", "backend"), [(GUARDED, "dask"), (UNGUARDED, "joblib")])
def test_a_script_that_starts_processes_runs_once(text, backend, tmp_path):
    done = run(script(tmp_path, text, backend), cwd=tmp_path)
    assert done.stdout == "done\n", done.stderr


def test_a_dask_sweep_runs_where_no_script_is_imported_again(tmp_path):
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "__main__.py").write_text(UNGUARDED.format(backend="dask"))
    for arguments in (["-m", "package"], ["-c", UNGUARDED.format(backend="dask")]):
        done = run(*arguments, cwd=tmp_path)
        assert done.stdout == "done\n", done.stderr


def test_a_dask_sweep_from_a_script_that_is_no_file_is_refused_in_one_line(tmp_path):
    done = run("-", text=UNGUARDED.format(backend="dask"), cwd=tmp_path)
    last = done.stderr.splitlines()[-1]
    assert last.startswith("synctrl.errors.SweepError: ") and "'<stdin>', which is no file" in last
    assert done.stderr.count("Traceback") == 1
