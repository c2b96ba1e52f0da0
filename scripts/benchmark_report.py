"""What the benchmark writes: tables, and the machine they were measured on."""

from __future__ import annotations

import os
import platform
import shlex
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple


class Table(NamedTuple):
    """A table of the report."""

    title: str
    note: str
    columns: tuple[str, ...]
    rows: list[list[Any]]


def machine() -> dict[str, str]:
    """What it ran on."""
    packages = ("synctrl", "pin", "numpy", "casadi", "mujoco", "drake")
    found = {name: _version(name) for name in packages}
    return {
        "processor": _processor(),
        "vectors": ", ".join(vectors()) or "unknown",
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "compiler": _compiler(),
        "Python": platform.python_version(),
        **{name: text for name, text in found.items() if text},
        "not installed": ", ".join(name for name, text in found.items() if not text) or "nothing",
    }


def vectors() -> tuple[str, ...]:
    """Which of the vectors that matter here the processor has."""
    flags = _said_of_processor("flags").split()
    return tuple(name for name in ("sse2", "avx2", "avx512f") if name in flags)


def _processor() -> str:
    return _said_of_processor("model name") or platform.processor() or "unknown"


def _said_of_processor(name: str) -> str:
    """An entry of what Linux says of the first core, or nothing."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith(name))
    except (OSError, StopIteration):
        return ""


def _compiler() -> str:
    """What the C compiler says of itself."""
    command = [*(shlex.split(os.environ.get("CC", "")) or ["cc"]), "--version"]
    try:
        run = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "none"
    return run.stdout.splitlines()[0].partition(" ")[2]


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def is_installed(package: str) -> bool:
    """Whether a package is there."""
    return bool(_version(package))


def described(about: dict[str, str]) -> str:
    """The machine in one paragraph."""
    return "; ".join(f"{name}: {text}" for name, text in about.items()) + "."


def markdown(tables: list[Table], heading: str = "##") -> str:
    """Tables as text."""
    lines: list[str] = []
    for table in tables:
        lines += ["", f"{heading} {table.title}", "", table.note, ""]
        lines += [_line(table.columns), _line(["---"] * len(table.columns))]
        lines += [_line(row) for row in table.rows]
    return "\n".join(lines) + "\n"


def _line(cells: Any) -> str:
    return "| " + " | ".join(_text(cell) for cell in cells) + " |"


def _text(cell: Any) -> str:
    if not isinstance(cell, float):
        return str(cell)
    return f"{cell:,.0f}" if abs(cell) >= 1000 else f"{cell:.3g}"
