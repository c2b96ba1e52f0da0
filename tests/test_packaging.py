"""What is installed elsewhere is complete: the built package finds its robots without this folder."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
ROBOTS = ROOT / "robots"


def files(folder: Path) -> dict[str, bytes]:
    """Name and content of every file in a folder."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def run(*arguments: str, cwd: Path, **environment: str) -> str:
    """Output of this Python, which must succeed."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def build(source: Path, kind: str, folder: Path) -> Path:
    """Build a "wheel" or an "sdist" of the project in `source`."""
    run("-m", "hatchling", "build", "--target", kind, "--directory", str(folder), cwd=source)
    (built,) = folder.iterdir()
    return built


def source_of_wheel(origin: str, folder: Path) -> Path:
    """The work tree, or what the source distribution made from it unpacks to."""
    if origin == "work tree":
        return ROOT
    shutil.unpack_archive(build(ROOT, "sdist", folder / "sdist"), folder)
    (source,) = folder.glob("synctrl-*")
    return source


@pytest.mark.parametrize("origin", ["work tree", "source distribution"])
def test_a_wheel_carries_the_robots_and_finds_them(origin: str, tmp_path: Path) -> None:
    wheel = build(source_of_wheel(origin, tmp_path), "wheel", tmp_path / "wheel")
    installed = tmp_path / "installed"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(installed)
    carried = installed / "synctrl" / "_urdf"
    assert files(carried) == files(ROBOTS)
    code = (
        "import synctrl; print(synctrl.__file__); synctrl.load_robot('a460'); synctrl.load_robot('planar2r')"
    )
    found = run("-c", code, cwd=tmp_path, PYTHONPATH=str(installed))
    assert Path(found.strip()).is_relative_to(installed)


# -- what is asked for is what is used --------------------------------------------------------------------

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
#: distributions whose modules have other names
MODULES = {
    "pin": {"pinocchio"},
    "u-msgpack-python": {"umsgpack"},
    "pillow": {"PIL"},
    "pycollada": {"collada"},
    "pytest-xdist": {"xdist"},
    "dask": {"distributed"},
    "drake": {"pydrake"},
    "PyYAML": {"yaml"},
    "tree-sitter": {"tree_sitter"},
    "tree-sitter-toml": {"tree_sitter_toml"},
    "mcap-protobuf-support": {"mcap_protobuf"},
    "rerun-sdk": {"rerun"},
}
#: asked for although nothing imports them, and why
UNIMPORTED = {
    "ziglang": "a compiler, which is run and not imported",
    "meshcat": "pages hold its viewer, which is read from its folder",
    "example-robot-data": "a folder of URDF files and meshes",
    "pycollada": "trimesh reads DAE files with it",
    "xarray": "pandas makes datasets with it",
    "h5netcdf": "xarray writes netCDF files with it",
    "h5py": "h5netcdf writes with it",
    "foxglove-schemas-protobuf": "its modules are imported by the names of messages",
    "pytest-xdist": "the Makefile starts tests with it",
    "hatchling": "builds the package",
    "ipykernel": "notebooks run in it",
    "nbformat": "notebooks are stored by it",
}


def name_of(requirement: str) -> str:
    return re.match(r"[\w.-]+", requirement).group()


def modules_of(requirement: str) -> set[str]:
    name = name_of(requirement)
    return MODULES.get(name, {name})


def asked(*extras: str) -> list[str]:
    """Requirements of the package and of some of its extras."""
    optional = PROJECT["optional-dependencies"]
    return [*PROJECT["dependencies"], *(requirement for extra in extras for requirement in optional[extra])]


@cache
def imported(*folders: str) -> set[str]:
    """Names of the modules that are imported anywhere in some folders."""
    found = set()
    for path in (path for folder in folders for path in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module.partition(".")[0])
            elif isinstance(node, ast.Call) and "importorskip" in ast.unparse(node.func):
                found |= {n.value.partition(".")[0] for n in node.args if isinstance(n, ast.Constant)}
    return found - sys.stdlib_module_names - {"synctrl"}


def test_every_library_that_the_package_imports_is_asked_for():
    assert imported("synctrl") <= set.union(
        *map(modules_of, asked("compiled", "mujoco", "sweep", "tune", "xacro", "data", "rerun"))
    )


@pytest.mark.parametrize(
    ("extra", "users"),
    [
        (None, ["synctrl"]),
        ("compiled", ["synctrl"]),
        ("compiler", ["synctrl"]),
        ("mujoco", ["synctrl"]),
        ("sweep", ["synctrl"]),
        ("tune", ["synctrl"]),
        ("xacro", ["synctrl"]),
        ("data", ["synctrl", "tests"]),
        ("rerun", ["synctrl"]),
        ("benchmark", ["synctrl", "scripts"]),
        ("notebooks", ["notebooks", "tests"]),
        ("test", ["tests"]),
    ],
)
def test_every_library_that_is_asked_for_is_used(extra, users):
    requirements = PROJECT["optional-dependencies"][extra] if extra else PROJECT["dependencies"]
    used = imported(*users)
    unused = {name_of(r) for r in requirements if not modules_of(r) & used}
    assert unused <= {*UNIMPORTED}


def test_the_lowest_versions_are_those_of_the_lower_bounds():
    lowest = dict(line.split("==") for line in (ROOT / "constraints-lowest.txt").read_text().splitlines()[1:])
    for requirement in asked("compiled", "compiler", "mujoco", "sweep", "tune", "data", "test"):
        bound = re.search(r">=([\d.]+)", requirement).group(1)
        assert (lowest[name_of(requirement)] + ".0.0").startswith(bound + "."), requirement


def test_the_versions_of_every_library_that_is_asked_for_are_written_down():
    text = (ROOT / "constraints.txt").read_text()
    names = {line.partition("==")[0].lower() for line in text.splitlines()}
    needed = asked(
        *("compiled", "compiler", "mujoco", "sweep", "tune", "xacro", "data", "rerun"),
        *("test", "notebooks", "dev"),
    )
    assert {name_of(requirement).lower() for requirement in needed} <= names
