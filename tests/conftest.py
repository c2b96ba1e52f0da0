"""What all tests share: no display needed, repeatable random inputs, and a browser where there is one."""

from __future__ import annotations

import os
import shutil

import pytest
from hypothesis import HealthCheck, settings

os.environ.setdefault("MPLBACKEND", "Agg")

# The same examples in every run, and no test that fails because a machine is slow.
settings.register_profile(
    "synctrl",
    derandomize=True,
    database=None,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("synctrl")


@pytest.fixture(scope="session")
def chromium() -> str:
    """Path of Chromium. Without one the test is skipped, except under CI, where it fails."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        report = pytest.fail if os.environ.get("CI") else pytest.skip
        report("no Chromium on this machine (Debian: apt-get install chromium)")
    return path
