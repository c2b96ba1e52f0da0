"""What all tests share: figures without a display, repeatable random inputs, meshes that are read once."""

from __future__ import annotations

import gc
import os
import sysconfig
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from engines import ENGINE
from hypothesis import HealthCheck, settings

import synctrl.robots.urdf.meshes as checking
import synctrl.show.meshes as drawing
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

INSTALLED = Path(sysconfig.get_path("purelib"))


def pytest_configure(config):
    """Files of installed packages stay as they are while tests run: each of their meshes is read once."""
    patch = pytest.MonkeyPatch()
    config.add_cleanup(patch.undo)
    patch.setattr(checking, "_fault", once_if_installed(checking._fault))
    patch.setattr(drawing, "read_mesh", once_if_installed(drawing.read_mesh))


def pytest_collection_finish():
    """Modules and collected tests stay to the end: garbage is not looked for among them."""
    gc.freeze()


def once_if_installed(look: Callable) -> Callable:
    known = cache(look)
    return lambda file: (known if file.is_relative_to(INSTALLED) else look)(file)


@pytest.fixture(scope="session")
def planar_run():
    """Full runs of the four arms, each computed once: `planar_run(synchronized, disturbance)`."""
    run = cache(lambda *arguments: planar_four(*arguments).simulate(engine=ENGINE))
    return lambda synchronized=True, disturbance=None: run(synchronized, disturbance)


@pytest.fixture(scope="session")
def a460_run():
    """Full runs of the two A460, each computed once: `a460_run(synchronized, friction)`."""
    run = cache(lambda *arguments: a460_pair(*arguments).simulate(engine=ENGINE))
    return lambda synchronized=True, friction=True: run(synchronized, friction)
