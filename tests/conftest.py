"""What all tests share: figures without a display, and repeatable random inputs."""

from __future__ import annotations

import os
from functools import cache

import pytest
from hypothesis import HealthCheck, settings

from synctrl.experiments import a460_pair, planar_four

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
def planar_run():
    """Full runs of the four arms, each computed once: `planar_run(synchronized, disturbance)`."""
    run = cache(lambda *arguments: planar_four(*arguments).simulate())
    return lambda synchronized=True, disturbance=None: run(synchronized, disturbance)


@pytest.fixture(scope="session")
def a460_run():
    """Full runs of the two A460, each computed once: `a460_run(synchronized, friction)`."""
    run = cache(lambda *arguments: a460_pair(*arguments).simulate())
    return lambda synchronized=True, friction=True: run(synchronized, friction)
