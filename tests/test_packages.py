"""Packages: found by the name in package.xml, from any working directory, and nothing beyond them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from refusals import refused

from synctrl.errors import InputError
from synctrl.robots.urdf.packages import Packages


def package(folder: Path, name: str = "", text: str = "<package><name> {} </name></package>") -> Path:
    """A folder with a package.xml of that name, or without any."""
    folder.mkdir(parents=True, exist_ok=True)
    if name:
        (folder / "package.xml").write_text(text.format(name))
    return folder


@pytest.fixture(autouse=True)
def _no_ros(monkeypatch):
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)


def test_a_package_is_found_above_a_description_by_the_name_in_its_package_xml(tmp_path):
    home = package(tmp_path / "Some_Repo", "arm_description")
    file = package(home / "urdf" / "old") / "arm.urdf"
    assert Packages(file).folder("arm_description") == home == Packages(file).home
    assert Packages(file).folder("Some_Repo") is None


def test_a_package_is_found_beside_a_description_and_beside_its_package(tmp_path):
    below = package(tmp_path / "robots" / "x", "grippers")
    assert Packages(tmp_path / "robots" / "a.urdf").folder("grippers") == below
    home, other = package(tmp_path / "a", "arm"), package(tmp_path / "b", "meshes_of_arm")
    assert Packages(home / "urdf" / "a.urdf").folder("meshes_of_arm") == other
    assert Packages(home / "a.urdf").folder("meshes_of_arm") == other


@pytest.mark.parametrize("kept", ["urdf", "robots"])
def test_a_folder_with_descriptions_and_meshes_is_a_package_of_its_name(kept, tmp_path):
    for folder in (kept, "meshes"):
        (tmp_path / "arm" / folder).mkdir(parents=True)
    packages = Packages(tmp_path / "arm" / kept / "old" / "a.urdf")
    assert packages.folder("arm") == packages.home == tmp_path / "arm"
    assert packages.allows(tmp_path / "arm" / "meshes" / "a.stl") and not packages.allows(tmp_path / "a.stl")
    (tmp_path / "arm" / "meshes").rmdir()
    alone = Packages(tmp_path / "arm" / kept / "old" / "a.urdf")
    assert alone.folder("arm") is None and alone.home == tmp_path / "arm" / kept / "old"


def test_a_description_may_call_its_own_folder_a_package(tmp_path):
    assert Packages(tmp_path / "arm" / "a.urdf").folder("arm") == tmp_path / "arm"


def test_a_folder_beside_a_package_is_none_without_a_package_xml(tmp_path):
    home = package(tmp_path / "a", "arm")
    (tmp_path / "private").mkdir()
    packages = Packages(home / "a.urdf")
    assert packages.folder("private") is None
    assert not packages.allows(tmp_path / "private" / "x.stl")


@pytest.mark.parametrize("depth", ["", "src", "src/repository"])
def test_a_package_is_found_in_a_folder_that_the_user_names(depth, tmp_path):
    workspace = tmp_path / "workspace"
    wanted = package(workspace / depth / "Folder", "arm_description")
    named = [wanted if not depth else workspace]
    assert Packages(tmp_path / "x" / "a.urdf", named).folder("arm_description") == wanted


def test_a_folder_that_the_user_names_needs_no_package_xml(tmp_path):
    wanted = package(tmp_path / "packages" / "arm")
    for folders in ([wanted], [str(tmp_path / "packages")], tmp_path / "packages"):
        assert Packages(None, folders).folder("arm") == wanted


@pytest.mark.parametrize(
    ("variable", "inside"), [("ROS_PACKAGE_PATH", "arm"), ("AMENT_PREFIX_PATH", "share/arm")]
)
def test_packages_are_found_where_ros_says(variable, inside, tmp_path, monkeypatch):
    wanted = package(tmp_path / "ros" / inside, "arm")
    monkeypatch.setenv(
        variable, os.pathsep.join(["", "relative", str(tmp_path / "none"), str(tmp_path / "ros")])
    )
    packages = Packages(tmp_path / "x" / "a.urdf")
    assert packages.folder("arm") == wanted
    assert packages.allows(wanted / "meshes" / "a.stl")


def test_what_the_user_names_comes_before_the_environment_and_what_lies_above_before_both(
    tmp_path, monkeypatch
):
    ros, named, home = (package(tmp_path / kind / "arm", "arm") for kind in ("ros", "named", "home"))
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(ros))
    assert Packages(tmp_path / "x" / "a.urdf").folder("arm") == ros
    assert Packages(tmp_path / "x" / "a.urdf", [named.parent]).folder("arm") == named
    assert Packages(home / "urdf" / "a.urdf", [named]).folder("arm") == home


def test_the_working_directory_plays_no_part_after_the_packages_are_made(tmp_path, monkeypatch):
    home = package(tmp_path / "arm", "arm")
    monkeypatch.chdir(tmp_path)
    packages = Packages(Path("arm/urdf/a.urdf"), ["arm"])
    monkeypatch.chdir("/")
    assert packages.folder("arm") == home
    assert packages.allows(home / "a.stl") and not packages.allows(Path("a.stl"))


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "../arm", "a\\b", "\0"])
def test_a_name_that_is_a_path_is_no_package(name, tmp_path):
    package(tmp_path / "arm", "arm")
    assert Packages(tmp_path / "arm" / "a.urdf", [tmp_path]).folder(name) is None


@pytest.mark.parametrize(
    "text",
    [
        "<package>",
        "<package/>",
        '<?xml version="1.0" encoding="none"?><package><name>{}</name></package>',
        '<!DOCTYPE package [<!ENTITY a "other">]><package><name>&a;</name></package>',
    ],
)
def test_a_package_xml_that_says_no_name_leaves_the_folder_its_own(text, tmp_path):
    home = package(tmp_path / "arm", "other", text)
    packages = Packages(home / "urdf" / "a.urdf")
    assert packages.folder("arm") == home and packages.folder("other") is None


def test_no_encoding_of_a_package_xml_hides_an_entity(tmp_path):
    home = package(tmp_path / "arm", "other")
    text = '<!DOCTYPE package [<!ENTITY a "other">]><package><name>&a;</name></package>'
    (home / "package.xml").write_text(text, encoding="utf-16")
    packages = Packages(home / "urdf" / "a.urdf")
    assert packages.folder("arm") == home and packages.folder("other") is None


def test_a_pipe_in_place_of_a_package_xml_is_not_opened(tmp_path):
    home = package(tmp_path / "arm")
    os.mkfifo(home / "package.xml")
    assert Packages(home / "urdf" / "a.urdf").folder("arm") is None


def test_reading_is_allowed_in_the_package_and_in_named_folders_wherever_links_lead(tmp_path):
    home, named = package(tmp_path / "a" / "arm", "arm"), package(tmp_path / "named")
    outside = package(tmp_path / "outside")
    packages = Packages(home / "urdf" / "a.urdf", [named])
    (home / "in").symlink_to(named)
    (home / "out").symlink_to(outside)
    (home / "round").symlink_to(home / "round")
    allowed = (home / "urdf" / ".." / "x.stl", named / "x.stl", home / "in" / "x.stl")
    assert all(map(packages.allows, allowed))
    refused = (outside / "x.stl", home / "out" / "x.stl", home / ".." / "x.stl", home / "round", home / "\0")
    assert not any(map(packages.allows, refused))


def test_without_a_package_reading_is_allowed_below_the_description_only(tmp_path):
    packages = Packages(tmp_path / "robot" / "a.urdf")
    assert packages.allows(tmp_path / "robot" / "meshes" / "a.stl")
    assert not packages.allows(tmp_path / "a.stl")


@pytest.mark.parametrize("folders", [3, [None], [3.0]])
def test_what_is_no_folder_is_refused(folders):
    with refused(InputError, "package_dirs"):
        Packages(None, folders)
