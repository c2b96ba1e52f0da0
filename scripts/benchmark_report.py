"""What the benchmark writes: tables, and the machine they were measured on."""

from __future__ import annotations

import os
import platform
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
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
        **{name: text for name, text in found.items() if text},
        "not installed": ", ".join(name for name, text in found.items() if not text) or "nothing",
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "unknown"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def is_installed(package: str) -> bool:
    """Whether a package is there."""
    return bool(_version(package))


def markdown(about: dict[str, str], tables: list[Table]) -> str:
    """The report as text."""
    lines = ["# Benchmark", "", "; ".join(f"{name}: {text}" for name, text in about.items()) + "."]
    for table in tables:
        lines += ["", f"## {table.title}", "", table.note, ""]
        lines += [_line(table.columns), _line(["---"] * len(table.columns))]
        lines += [_line(row) for row in table.rows]
    return "\n".join(lines) + "\n"


def _line(cells: Any) -> str:
    return "| " + " | ".join(_text(cell) for cell in cells) + " |"


def _text(cell: Any) -> str:
    if not isinstance(cell, float):
        return str(cell)
    return f"{cell:,.0f}" if abs(cell) >= 1000 else f"{cell:.3g}"
