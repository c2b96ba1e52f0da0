"""What `synctrl doctor` looks at, one function for each thing; each finds a line of its table."""

from __future__ import annotations

import platform
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..errors import SynctrlError
from .installed import FEATURES, PACKAGE, Requirement, requirements, version

OLDEST_PYTHON = (3, 11)
#: how far two engines may be apart in the trial, rad: both make the same steps
SAME = 1e-9


class Finding(NamedTuple):
    """One thing: what it is, how it stands ("ok", "missing" or "wrong"), what was found, and what to do."""

    what: str
    state: str
    found: str
    remedy: str = ""
    needed: bool = True

    @property
    def wanting(self) -> bool:
        """Whether something that everybody needs is not as it should be."""
        return self.needed and self.state != "ok"


def python() -> Finding:
    """The interpreter."""
    found = f"{platform.python_version()}, {sys.executable}, {platform.system()} {platform.machine()}"
    if sys.version_info < OLDEST_PYTHON:
        return Finding("Python", "wrong", found, "install Python 3.11 or newer")
    return Finding("Python", "ok", found)


def package() -> Finding:
    """This package."""
    here = Path(__file__).parents[1]
    return Finding(PACKAGE, "ok", f"{version(PACKAGE) or 'of no known version'}, {here}")


def libraries() -> Iterator[Finding]:
    """Libraries that everybody needs, in a line if all are there, and each extra."""
    found = [*requirements()]
    core = [each for each in found if not each.extra]
    lacking = [each for each in core if not each.met]
    if core and not lacking:
        yield Finding("libraries", "ok", f"{len(core)} that are needed, none too old")
    yield from (_lacking(each) for each in lacking)
    for extra, feature in FEATURES.items():
        own = [each for each in found if each.extra == extra]
        if own:
            yield _extra(extra, feature, own)


def _lacking(each: Requirement) -> Finding:
    found = "not there" if each.found is None else f"{each.found}, older than {each.least}"
    state = "missing" if each.found is None else "wrong"
    return Finding(each.name, state, found, f"pip install '{each.name}>={each.least}'")


def _extra(extra: str, feature: str, own: Sequence[Requirement]) -> Finding:
    lacking = [each.name for each in own if not each.met]
    name, remedy = f"[{extra}]", f"pip install 'synctrl[{extra}]'"
    if lacking:
        return Finding(name, "missing", f"{feature}: without {', '.join(lacking)}", remedy, needed=False)
    return Finding(name, "ok", feature, needed=False)


def c_compiler() -> Finding:
    """The compiler that generated C is given to."""
    from ..compiled.compiler import compiler, compiler_version

    try:
        command = compiler()
        first = compiler_version(command).partition("\n")[0]
    except SynctrlError as error:
        return Finding("C compiler", "missing", str(error), "pip install 'synctrl[compiler]'", needed=False)
    return Finding("C compiler", "ok", f"{' '.join(command[:2])}: {first}", needed=False)


def cache() -> Finding:
    """The folder of compiled code."""
    from ..compiled.cache import open_cache
    from ..compiled.compiler import SUFFIX

    try:
        folder = open_cache()
        sizes = [path.stat().st_size for path in folder.rglob(f"*{SUFFIX}")]
    except (SynctrlError, OSError) as error:
        return Finding("cache", "wrong", str(error), "name another folder by SYNCTRL_CACHE", needed=False)
    return Finding(
        "cache", "ok", f"{folder}: {len(sizes)} libraries, {sum(sizes) / 1e6:.1f} MB", needed=False
    )


def robots() -> Finding:
    """Robots that have names: one of each source is read."""
    from ..robots.catalog import catalog_names, load_robot

    try:
        for name in ("planar2r", "ur5"):
            load_robot(name)
    except SynctrlError as error:
        return Finding(
            "robots", "wrong", str(error), "pip install --force-reinstall synctrl example-robot-data"
        )
    return Finding("robots", "ok", f"{len(catalog_names())} in the catalogue")


def trial() -> Iterator[Finding]:
    """A short run, by the reference engine and, where it can be had, by generated C."""
    from ..experiments.planar_four import planar_four

    runs: dict[str, Any] = {}
    for engine in ("pinocchio", "compiled"):
        start = perf_counter()
        try:
            runs[engine] = planar_four().simulate(0.02, engine=engine)
        except SynctrlError as error:
            yield Finding(f"trial, {engine}", "missing", str(error), needed=engine == "pinocchio")
            continue
        took = f"four arms for 0.02 s took {perf_counter() - start:.2g} s"
        apart = float(np.abs(runs[engine].q - runs.get("pinocchio", runs[engine]).q).max())
        state = "ok" if apart <= SAME else "wrong"
        same = "" if engine == "pinocchio" else f"; {apart:.1g} rad from the reference"
        yield Finding(f"trial, {engine}", state, took + same)


def findings(run: bool) -> Iterator[Finding]:
    """Everything, with a trial if that is asked for."""
    single: tuple[Callable[[], Finding], ...] = (python, package)
    yield from (look() for look in single)
    yield from libraries()
    yield from (look() for look in (c_compiler, cache, robots))
    if run:
        yield from trial()
