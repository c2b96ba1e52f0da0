"""Imports run one way, and `import synctrl` is cheap.

The checkers take a folder, so that small wrong packages can show that they find something.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "synctrl"

# From the ground up: a room may import from itself and from the rooms before it.
ROOMS = (
    "errors",
    "renamed",
    "checks",
    "files",
    "robots",
    "tasks",
    "coupling",
    "control",
    "simulation",
    "assembly",
    "compiled",
    "analysis",
    "sweep",
    "tune",
    "show",
    "export",
    "experiments",
    "cells",
    "paper",
    "cli",
)

# Imported inside the functions that use them: most users of a robot need neither figures nor a second engine.
ONLY_INSIDE_FUNCTIONS = {
    *("matplotlib", "meshcat", "scipy", "networkx", "trimesh", "yourdfpy"),
    *("casadi", "mujoco", "joblib", "dask", "distributed", "pandas", "optuna"),
    *("xarray", "h5netcdf", "h5py", "mcap", "mcap_protobuf", "foxglove_schemas_protobuf", "google", "rerun"),
    *("xacro", "yaml", "robot_descriptions"),
}

# Libraries that belong to some rooms alone.
EXPORTING = ("xarray", "h5netcdf", "mcap", "mcap_protobuf", "foxglove_schemas_protobuf", "rerun")
OWNERS = {
    "matplotlib": {"show", "paper"},
    "meshcat": {"show"},
    "typer": {"cli"},
    "rich": {"cli"},
    **{library: {"export"} for library in EXPORTING},
}

# What rooms other than robots/ may use of Pinocchio: types and the rotation group, never its dynamics.
GEOMETRY = {"SE3", "Quaternion", "exp3", "exp6", "log3", "log6", "Jlog3", "Jlog6"}
TYPES = {"Model", "Data", "GeometryModel", "GeometryData", "GeometryObject", "GeometryType"}
PINOCCHIO = {
    "tasks": GEOMETRY,
    "coupling": GEOMETRY,
    "simulation": GEOMETRY | TYPES,
    "compiled": GEOMETRY,
    "show": GEOMETRY | TYPES | {"visualize"},
}


@dataclass(frozen=True)
class Import:
    """One imported name: `import target`, or `from target import name`, bound to `alias`."""

    target: str
    name: str | None
    alias: str
    line: int
    runs_at_import: bool


class ImportReader(ast.NodeVisitor):
    """Collects the imports of one module, relative ones resolved."""

    def __init__(self, package: str):
        self.package, self.imports, self.deferred = package, [], 0

    def visit_Import(self, node: ast.Import) -> None:
        for alias in node.names:
            bound = alias.asname or alias.name.partition(".")[0]
            self.imports.append(Import(alias.name, None, bound, node.lineno, not self.deferred))

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        base = self.package.split(".")[: -(node.level - 1) or None] if node.level else []
        target = ".".join([*base, *([node.module] if node.module else [])])
        for alias in node.names:
            bound = alias.asname or alias.name
            self.imports.append(Import(target, alias.name, bound, node.lineno, not self.deferred))

    def visit_deferred(self, node: ast.AST) -> None:
        self.deferred += 1
        self.generic_visit(node)
        self.deferred -= 1

    visit_FunctionDef = visit_AsyncFunctionDef = visit_Lambda = visit_deferred  # noqa: N815

    def visit_If(self, node: ast.If) -> None:
        types_only = ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING")
        (self.visit_deferred if types_only else self.generic_visit)(node)


def modules(package: Path) -> dict[str, Path]:
    """Dotted name -> file of every module of a package; a folder's name stands for its __init__."""
    parts = {path: path.relative_to(package.parent).with_suffix("").parts for path in package.rglob("*.py")}
    return {".".join(p[:-1] if p[-1] == "__init__" else p): path for path, p in parts.items()}


def imports(module: str, path: Path) -> list[Import]:
    """All imports of a module, wherever they stand."""
    reader = ImportReader(module if path.name == "__init__.py" else module.rpartition(".")[0])
    reader.visit(ast.parse(path.read_text(encoding="utf-8")))
    return reader.imports


def all_imports(package: Path) -> Iterator[tuple[str, Import]]:
    for module, path in modules(package).items():
        for found in imports(module, path):
            yield module, found


def arrows(package: Path) -> Iterator[tuple[str, str, int]]:
    """(module, imported module of the same package, line)."""
    known = modules(package)
    for module, found in all_imports(package):
        if found.target.partition(".")[0] == package.name:
            submodule = f"{found.target}.{found.name}"
            yield module, submodule if submodule in known else found.target, found.line


def room(module: str) -> str:
    """ "synctrl.robots.urdf" -> "robots"; "" for the package itself, and for what `python -m` runs of it."""
    name = module.split(".")[1] if "." in module else ""
    return "" if name == "__main__" else name


def unknown_rooms(package: Path) -> list[str]:
    rooms = {room(module) for module in modules(package)} - {""}
    return [f"{name} has no place in ROOMS of {Path(__file__).name}" for name in sorted(rooms - {*ROOMS})]


def wrong_arrows(package: Path) -> list[str]:
    """Imports of a room from a later one, or from the package itself, which imports them all."""
    rank = {name: k for k, name in enumerate((*ROOMS, ""))}
    return [
        f"{module}:{line} imports {target}"
        for module, target, line in arrows(package)
        if rank.get(room(target), 0) > rank.get(room(module), 0)
    ]


def cycles(package: Path) -> list[str]:
    graph: dict[str, set[str]] = {}
    for module, target, _ in arrows(package):
        graph.setdefault(module, set()).add(target)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return [" <- ".join(error.args[1])]
    return []


def early_imports(package: Path) -> list[str]:
    """Libraries loaded with the package that belong inside a function."""
    return [
        f"{module}:{found.line} imports {found.target} at import time"
        for module, found in all_imports(package)
        if found.runs_at_import and found.target.partition(".")[0] in ONLY_INSIDE_FUNCTIONS
    ]


def foreign_libraries(package: Path) -> list[str]:
    """Libraries imported outside the room that owns them."""
    return [
        f"{module}:{found.line} imports {found.target}"
        for module, found in all_imports(package)
        if room(module) not in OWNERS.get(found.target.partition(".")[0], {room(module)})
    ]


def pinocchio_names(module: str, path: Path) -> Iterator[str]:
    """Names of Pinocchio that a module uses: SE3 in `pin.SE3` and in `from pinocchio import SE3`."""
    of_pinocchio = [i for i in imports(module, path) if i.target.partition(".")[0] == "pinocchio"]
    aliases = {i.alias for i in of_pinocchio if i.name is None}
    for found in of_pinocchio:
        submodule = found.target.partition(".")[2]
        if submodule or found.name:
            yield submodule or str(found.name)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in aliases:
            yield node.attr


def foreign_dynamics(package: Path) -> list[str]:
    """Names of Pinocchio that a room other than robots/ uses and is not allowed to."""
    return [
        f"{module} uses pinocchio.{name}"
        for module, path in modules(package).items()
        if room(module) != "robots"
        for name in pinocchio_names(module, path)
        if name not in PINOCCHIO.get(room(module), ())
    ]


CHECKERS = [unknown_rooms, wrong_arrows, cycles, early_imports, foreign_libraries, foreign_dynamics]


@pytest.mark.parametrize("checker", CHECKERS, ids=lambda checker: checker.__name__)
def test_the_package_has_no(checker: Callable[[Path], list[str]]) -> None:
    assert modules(PACKAGE), "no modules found"
    assert checker(PACKAGE) == []


# One small package per defect: file -> text, and what the checker has to say.
WRONG = [
    (unknown_rooms, {"attic/__init__.py": ""}, "attic has no place"),
    (
        wrong_arrows,
        {"robots/a.py": "from synctrl.tasks import b", "tasks/b.py": ""},
        "imports synctrl.tasks.b",
    ),
    (wrong_arrows, {"robots/a.py": "from ..tasks.b import f", "tasks/b.py": ""}, "imports synctrl.tasks.b"),
    (wrong_arrows, {"errors.py": "def f():\n    import synctrl.show", "show/__init__.py": ""}, "errors:2"),
    (wrong_arrows, {"tasks/a.py": "from synctrl import Robot", "__init__.py": ""}, "imports synctrl"),
    (wrong_arrows, {"analysis/a.py": "from ..show import plots", "show/plots.py": ""}, "synctrl.show.plots"),
    (cycles, {"tasks/a.py": "from . import b", "tasks/b.py": "from .a import f"}, "synctrl.tasks.a"),
    (
        cycles,
        {"tasks/__init__.py": "from .a import f", "tasks/a.py": "from ..tasks import f"},
        "synctrl.tasks.a",
    ),
    (early_imports, {"show/a.py": "import matplotlib.pyplot as plt"}, "matplotlib.pyplot"),
    (early_imports, {"tasks/a.py": "class A:\n    from scipy import linalg"}, "scipy"),
    (foreign_libraries, {"analysis/a.py": "def f():\n    import matplotlib"}, "matplotlib"),
    (foreign_dynamics, {"control/a.py": "import pinocchio as pin\npin.SE3"}, "pinocchio.SE3"),
    (foreign_dynamics, {"tasks/a.py": "import pinocchio as pin\npin.rnea"}, "pinocchio.rnea"),
    (foreign_dynamics, {"tasks/a.py": "from pinocchio import aba"}, "pinocchio.aba"),
]

RIGHT = {
    "__init__.py": "from .robots import Robot\nfrom .tasks.a import f",
    "robots/__init__.py": "import pinocchio as pin\nfrom ..errors import E\nRobot = pin.rnea",
    "tasks/a.py": "import pinocchio as pin\npin.SE3\nfrom .b import g\nfrom ..robots import Robot",
    "tasks/b.py": "from synctrl import errors\ndef g():\n    import scipy",
    "show/a.py": "if TYPE_CHECKING:\n    import matplotlib",
    "errors.py": "E = 1",
}


def write_package(folder: Path, files: dict[str, str]) -> Path:
    package = folder / "synctrl"
    for name, text in files.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text, encoding="utf-8")
    return package


@pytest.mark.parametrize(("checker", "files", "said"), WRONG)
def test_a_wrong_package_is_found(
    checker: Callable[[Path], list[str]], files: dict[str, str], said: str, tmp_path: Path
) -> None:
    findings = checker(write_package(tmp_path, files))
    assert len(findings) == 1
    assert said in findings[0]


@pytest.mark.parametrize("checker", CHECKERS, ids=lambda checker: checker.__name__)
def test_a_right_package_passes(checker: Callable[[Path], list[str]], tmp_path: Path) -> None:
    assert checker(write_package(tmp_path, RIGHT)) == []


def libraries_after(statement: str) -> set[str]:
    """Top-level modules outside the standard library that a fresh interpreter holds after a statement."""
    code = f"{statement}\nimport sys\nprint(*{{m.partition('.')[0] for m in sys.modules}})"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    return set(run.stdout.split()) - sys.stdlib_module_names


def test_importing_the_package_loads_nothing_but_numpy_and_pinocchio() -> None:
    cost = libraries_after("import numpy, pinocchio")
    assert cost.isdisjoint(ONLY_INSIDE_FUNCTIONS)
    assert libraries_after("import synctrl; synctrl.__file__.lower()") - cost == {"synctrl"}
