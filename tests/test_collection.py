"""Robots of the package robot_descriptions, with a stand-in that downloads nothing."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest
from refusals import refused

from synctrl import load_robot
from synctrl.errors import MissingDependencyError, RobotError, RobotWarning
from synctrl.robots import catalog
from synctrl.robots.urdf import xacro as xacro_module

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
PLANAR = Path(load_robot("planar2r").document.file).read_text(encoding="utf-8")


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of a package robot_descriptions without a robot yet; its repository is in `repository`."""
    folder = tmp_path / "site" / "robot_descriptions"
    folder.mkdir(parents=True)
    (folder / "__init__.py").touch()
    (tmp_path / "repository" / "arm").mkdir(parents=True)
    monkeypatch.syspath_prepend(folder.parent)
    for name in [name for name in sys.modules if name.partition(".")[0] == "robot_descriptions"]:
        monkeypatch.delitem(sys.modules, name)
    yield folder
    for name in [name for name in sys.modules if name.partition(".")[0] == "robot_descriptions"]:
        del sys.modules[name]


def describe(modules: Path, name: str, attribute: str, file: str, text: str, more: str = "") -> None:
    """A module as that package has them, and the file that it speaks of."""
    repository = modules.parent.parent / "repository"
    (repository / "arm" / file).write_text(text, encoding="utf-8")
    lines = [
        f"REPOSITORY_PATH = {str(repository)!r}",
        f"PACKAGE_PATH = {str(repository / 'arm')!r}",
        f"{attribute} = {str(repository / 'arm' / file)!r}",
        more,
    ]
    (modules / f"{name}.py").write_text("\n".join(lines), encoding="utf-8")


def test_a_robot_is_read_from_where_its_module_says(modules: Path) -> None:
    describe(modules, "arm_description", "URDF_PATH", "arm.urdf", PLANAR)
    robot = load_robot("robot_descriptions:arm_description")
    assert robot.nv == 2
    assert robot.document.file == modules.parent.parent / "repository" / "arm" / "arm.urdf"


def test_its_meshes_are_found_in_its_repository(modules: Path) -> None:
    mesh = '<mesh filename="package://arm/part.obj"/>'
    text = PLANAR.replace("</link>", f"<visual><geometry>{mesh}</geometry></visual></link>", 1)
    describe(modules, "arm_description", "URDF_PATH", "arm.urdf", text)
    (modules.parent.parent / "repository" / "arm" / "part.obj").write_text(TRIANGLE, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error", RobotWarning)
        load_robot("robot_descriptions:arm_description")


@pytest.mark.skipif(not xacro_module.find_spec("xacro"), reason="needs the extra xacro")
def test_the_arguments_of_its_xacro_file_are_those_of_the_module_unless_others_are_given(
    modules: Path,
) -> None:
    text = PLANAR.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ')
    text = text.replace('name="planar2r"', 'name="$(arg side)"').replace("${", "$${")
    describe(modules, "arm_description", "XACRO_PATH", "arm.xacro", text, 'XACRO_ARGS = {"side": "left"}')
    assert load_robot("robot_descriptions:arm_description").name == "left"
    robot = load_robot("robot_descriptions:arm_description", xacro_args={"side": "right"})
    assert robot.name == "right"


def test_an_unknown_name_is_refused_with_near_ones(modules: Path) -> None:
    describe(modules, "arm_description", "URDF_PATH", "arm.urdf", PLANAR)
    with refused(RobotError, "robot", found="arm_descriptio") as caught:
        load_robot("robot_descriptions:arm_descriptio")
    assert "'arm_description'" in caught.value.problem


@pytest.mark.parametrize("name", ["", ".arm", "arm_description.x", "../arm", "__init__", "os"])
def test_no_other_module_is_imported(name: str, modules: Path) -> None:
    with refused(RobotError, "robot", found=name):
        load_robot(f"robot_descriptions:{name}")


def test_a_download_that_fails_is_said(modules: Path) -> None:
    (modules / "arm_description.py").write_text('raise OSError("no network")', encoding="utf-8")
    with refused(RobotError, "robot 'arm_description'", found="OSError"):
        load_robot("robot_descriptions:arm_description")


def test_a_module_without_a_file_is_said(modules: Path) -> None:
    (modules / "arm_description.py").touch()
    with refused(RobotError, "robot 'arm_description'", found=0):
        load_robot("robot_descriptions:arm_description")


def test_without_the_package_the_advice_is_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalog, "find_spec", lambda name: None)
    with refused(MissingDependencyError, "robot 'arm_description'", found="robot_descriptions"):
        load_robot("robot_descriptions:arm_description")
