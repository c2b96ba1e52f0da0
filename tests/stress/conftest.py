"""Long tests: marked `stress`, run by `make stress`, not by `make test`.

A test states the figures it found by `record_property("figure", "120 pages, no script ran")`;
they are printed at the end, and docs/reliability.md quotes them.
"""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items):
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.stress)


def pytest_terminal_summary(terminalreporter):
    reports = terminalreporter.stats.get("passed", []) + terminalreporter.stats.get("failed", [])
    figures = [
        (report.nodeid.split("::")[-1], value)
        for report in reports
        if report.when == "call"
        for name, value in report.user_properties
        if name == "figure"
    ]
    if figures:
        terminalreporter.section("figures")
    for test, value in figures:
        terminalreporter.write_line(f"{test}: {value}")
