"""Xacro files expand as with ROS, and what their expressions do stays behind a fence."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from synctrl import load_robot
from synctrl.errors import InputError, MissingDependencyError, RobotError, RobotWarning
from synctrl.robots.urdf import xacro as xacro_module
from synctrl.robots.urdf.xacro import expand_xacro

needs_xacro = pytest.mark.skipif(
    not all(map(xacro_module.find_spec, ("xacro", "yaml"))), reason="needs the extra xacro"
)

XMLNS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


def write(file: Path, body: str) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f'<?xml version="1.0"?>\n<robot name="demo" {XMLNS}>{body}</robot>\n', encoding="utf-8")
    return file


def package(folder: Path, name: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>", encoding="utf-8")
    return folder


def link(name: str) -> str:
    return f'<link name="{name}"/>'


# -- what they are for -------------------------------------------------------------------------------------


@needs_xacro
@pytest.mark.parametrize(("value", "name"), [("left", "left"), (3, "3"), (0.5, "0.5"), (True, "true")])
def test_an_argument_gets_the_value_that_is_given(value: object, name: str, tmp_path: Path) -> None:
    file = write(tmp_path / "a.xacro", '<xacro:arg name="side" default="right"/>' + link("$(arg side)"))
    assert link("right") in expand_xacro(file)
    assert link(name) in expand_xacro(file, {"side": value})


@needs_xacro
def test_an_argument_that_is_missing_is_named_with_the_way_to_give_it(tmp_path: Path) -> None:
    file = write(tmp_path / "a.xacro", link("$(arg side)"))
    with refused(RobotError, "xacro_args", found="side", file=str(file)):
        expand_xacro(file)


@needs_xacro
def test_packages_are_found_by_the_name_in_their_manifest(tmp_path: Path) -> None:
    package(tmp_path / "Maker-1.2" / "Parts", "maker_parts")
    write(tmp_path / "Maker-1.2" / "Parts" / "urdf" / "part.xacro", link("part"))
    home = package(tmp_path / "Maker-1.2" / "Arm", "maker_arm")
    find = '<xacro:include filename="$(find maker_parts)/urdf/part.xacro"/>'
    assert link("part") in expand_xacro(write(home / "urdf" / "arm.xacro", find))


@needs_xacro
def test_packages_are_found_in_the_folders_that_the_user_names(tmp_path: Path) -> None:
    write(package(tmp_path / "far" / "parts", "parts") / "part.xacro", link("part"))
    file = write(tmp_path / "home" / "a.xacro", '<xacro:include filename="$(find parts)/part.xacro"/>')
    with refused(RobotError, "package_dirs", found="parts", file=str(file)):
        expand_xacro(file)
    assert link("part") in expand_xacro(file, package_dirs=[tmp_path / "far"])


@needs_xacro
def test_includes_and_yaml_beside_the_file_are_read_from_any_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "robot").mkdir()
    (tmp_path / "robot" / "numbers.yaml").write_text("arm: {length: 0.25}", encoding="utf-8")
    write(
        tmp_path / "robot" / "part.xacro",
        '<xacro:macro name="part" params="n"><link name="${n}"/></xacro:macro>',
    )
    use = "<xacro:part n=\"arm ${xacro.load_yaml('numbers.yaml').arm.length}\"/>"
    write(tmp_path / "robot" / "a.xacro", '<xacro:include filename="part.xacro"/>' + use)
    monkeypatch.chdir(tmp_path)
    assert link("arm 0.25") in expand_xacro(Path("robot") / "a.xacro")


@needs_xacro
def test_text_that_is_not_ascii_comes_through_whatever_the_locale(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LC_ALL", "C")
    assert link("Größe ∅") in expand_xacro(write(tmp_path / "ä.xacro", link("Größe ∅")))


@needs_xacro
def test_every_element_has_a_line_of_its_own_so_that_messages_can_name_it(tmp_path: Path) -> None:
    macro = '<xacro:macro name="two"><link name="a"/><link name="b"/></xacro:macro><xacro:two/>'
    lines = [line.strip() for line in expand_xacro(write(tmp_path / "a.xacro", macro)).splitlines()]
    assert {link("a"), link("b")} <= {*lines}


@needs_xacro
def test_a_fault_deep_inside_is_said_with_its_file_and_macro(tmp_path: Path) -> None:
    macro = '<xacro:macro name="part" params="n"><link name="${missing}"/></xacro:macro>'
    write(tmp_path / "part.xacro", macro + '<xacro:part n="1"/>')
    file = write(tmp_path / "a.xacro", '<xacro:include filename="part.xacro"/>')
    with refused(RobotError, found="NameError", file=str(file)) as caught:
        expand_xacro(file)
    assert "part.xacro, in macro 'part'" in caught.value.problem  # xacro's own words, with where it stood


def test_arguments_that_are_no_plain_values_are_refused(tmp_path: Path) -> None:
    file = write(tmp_path / "a.xacro", link("a"))
    with refused(InputError, "xacro_args", found="list"):
        expand_xacro(file, {"side": ["left"]})


def test_without_the_extra_the_advice_is_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(xacro_module, "find_spec", lambda name: None)
    with refused(MissingDependencyError, found="xacro"):
        expand_xacro(write(tmp_path / "a.xacro", link("a")))


@needs_xacro
def test_expanding_imports_nothing_into_this_process(tmp_path: Path) -> None:
    file = write(tmp_path / "a.xacro", link("a"))
    code = (
        "import sys; from synctrl.robots.urdf.xacro import expand_xacro\n"
        f"expand_xacro({str(file)!r}); print('xacro' in sys.modules, 'yaml' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["False", "False"]


# -- the fence ---------------------------------------------------------------------------------------------

SUBCLASSES = "().__class__.__base__.__subclasses__()"
GLOBALS = f"[c for c in {SUBCLASSES} if c.__name__ == '_wrap_close'][0].__init__.__globals__"
BUILTINS = f"{GLOBALS}['__builtins__']"


def expression(code: str) -> str:
    """A link that is named by Python code. In a lambda it escapes xacro's own check of names."""
    return link("${(lambda: " + code + ")()}")


@needs_xacro
def test_expressions_do_reach_python_without_a_fence(tmp_path: Path) -> None:
    """Else the tests of the fence would show nothing."""
    file = write(tmp_path / "a.xacro", expression(f"{BUILTINS}['len']('four')"))
    assert link("4") in expand_xacro(file)


@needs_xacro
@pytest.mark.parametrize(
    ("code", "event"),
    [
        (f"{BUILTINS}['open']('OUT', 'w')", "write"),
        (f"{BUILTINS}['open']('OUT', 'ab')", "write"),
        (f"{BUILTINS}['open']('HERE', 'r+')", "write"),
        (f"{GLOBALS}['open']('OUT', 65, 511)", "write"),
        (f"{GLOBALS}['system']('touch OUT')", "os.system"),
        (f"{GLOBALS}['fork']()", "os.fork"),
        (f"{GLOBALS}['posix_spawn']('/bin/touch', ['touch', 'OUT'], dict())", "os.posix_spawn"),
        (f"{GLOBALS}['execv']('/bin/touch', ['touch', 'OUT'])", "os.exec"),
        (f"{GLOBALS}['mkdir']('OUT')", "os.mkdir"),
        (f"{GLOBALS}['symlink']('/etc', 'OUT')", "os.symlink"),
        (f"{GLOBALS}['rename']('HERE', 'OUT')", "os.rename"),
        (f"{GLOBALS}['remove']('HERE')", "os.remove"),
        (f"{GLOBALS}['kill'](1, 0)", "os.kill"),
        (f"{BUILTINS}['__import__']('socket')", "import"),
        (f"{BUILTINS}['__import__']('subprocess')", "import"),
        (f"{BUILTINS}['__import__']('ctypes')", "import"),
        (f"{BUILTINS}['open']('/etc/passwd')", "read outside of its packages"),
        (f"{GLOBALS}['listdir']('/etc')", "read outside of its packages"),
        ("xacro.load_yaml('/etc/passwd')", "read outside of its packages"),
        ("xacro.load_yaml('../outside.yaml')", "read outside of its packages"),
        ("xacro.load_yaml('leads_out.yaml')", "read outside of its packages"),
        ("(lambda: 0).__code__", "object.__getattr__"),
    ],
)
def test_an_expression_can_do_nothing_but_compute(code: str, event: str, tmp_path: Path) -> None:
    home = tmp_path / "home"
    outside, out = tmp_path / "outside.yaml", tmp_path / "out"
    outside.write_text("secret: 1", encoding="utf-8")
    home.mkdir()
    (home / "leads_out.yaml").symlink_to(outside)
    code = code.replace("OUT", str(out)).replace("HERE", str(home / "a.xacro"))
    file = write(home / "a.xacro", expression(code))
    before = file.read_bytes()
    with refused(RobotError, found=event, file=str(file)):
        expand_xacro(file)
    assert not os.path.lexists(out)
    assert file.read_bytes() == before


@needs_xacro
def test_an_include_reads_nothing_outside_the_package(tmp_path: Path) -> None:
    write(tmp_path / "outside.xacro", link("secret"))
    file = write(tmp_path / "home" / "a.xacro", '<xacro:include filename="../outside.xacro"/>')
    with refused(RobotError, found="read outside of its packages"):
        expand_xacro(file)
    package(tmp_path, "whole")  # then the folder above belongs to it
    assert link("secret") in expand_xacro(file)


@needs_xacro
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.xacro")
    file = write(tmp_path / "a.xacro", '<xacro:include filename="pipe.xacro"/>')
    with refused(RobotError, found="read what is no regular file"):
        expand_xacro(file)


@needs_xacro
def test_an_entity_reads_no_file(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret words", encoding="utf-8")
    entity = '<!DOCTYPE robot [<!ENTITY x SYSTEM "secret">]>'
    file = tmp_path / "a.xacro"
    file.write_text(f'{entity}<robot name="a" {XMLNS}><link name="l">&x;</link></robot>', encoding="utf-8")
    with suppress(RobotError):
        assert "secret words" not in expand_xacro(file)


@needs_xacro
def test_the_environment_is_not_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYNCTRL_SECRET", "secret-words")
    file = write(tmp_path / "a.xacro", link("$(optenv SYNCTRL_SECRET none)"))
    assert link("none") in expand_xacro(file)


@needs_xacro
def test_an_expression_without_end_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xacro_module, "TIME_LIMIT", 1.0)
    file = write(tmp_path / "a.xacro", link("${python.sum(python.range(10**15))}"))
    with refused(RobotError, found="no end", file=str(file)):
        expand_xacro(file)


@needs_xacro
@pytest.mark.parametrize(
    ("body", "kind"),
    [
        (link("${'a' * 10**11}"), "MemoryError"),
        (link("${'a' * 20000000}"), "ValueError"),
        ('<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>', "RecursionError"),
    ],
)
def test_a_file_that_grows_without_end_is_refused(body: str, kind: str, tmp_path: Path) -> None:
    with refused(RobotError, found=kind):
        expand_xacro(write(tmp_path / "a.xacro", body))


@needs_xacro
def test_what_a_file_prints_is_no_answer(tmp_path: Path) -> None:
    lie = """xacro.message('\\x7b&quot;text&quot;: &quot;a lie&quot;\\x7d')"""
    file = write(tmp_path / "a.xacro", link("said ${" + lie + "}"))
    assert link("said ") in expand_xacro(file)


@needs_xacro
def test_without_a_python_to_start_it_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    with refused(RobotError, found="no process"):
        expand_xacro(write(tmp_path / "a.xacro", link("a")))


@needs_xacro
def test_a_process_that_dies_is_said(tmp_path: Path) -> None:
    file = write(tmp_path / "a.xacro", expression(f"{GLOBALS}['_exit'](3)"))
    with refused(RobotError, found="nothing"):
        expand_xacro(file)


# -- robots ------------------------------------------------------------------------------------------------


def arm(body: str = "") -> str:
    """The links of the planar arm, in a xacro file."""
    text = Path(load_robot("planar2r").document.file).read_text(encoding="utf-8")
    return text[text.index(">", text.index("<robot")) + 1 : text.rindex("</robot>")] + body


@needs_xacro
def test_a_xacro_file_loads_as_the_urdf_that_it_expands_to(tmp_path: Path) -> None:
    urdf = load_robot("planar2r")
    robot = load_robot(write(tmp_path / "arm.urdf.xacro", arm()))
    assert robot.joint_names == urdf.joint_names
    assert np.array_equal(robot.inertial_parameters, urdf.inertial_parameters)


@needs_xacro
def test_arguments_reach_the_robot(tmp_path: Path) -> None:
    text = '<xacro:arg name="tool" default="a"/>' + link("$(arg tool)")
    joint = '<joint name="mount" type="fixed"><parent link="tip"/><child link="$(arg tool)"/></joint>'
    file = write(tmp_path / "arm.xacro", arm(text + joint))
    assert load_robot(file, tip="gripper", xacro_args={"tool": "gripper"}).tip == "gripper"


@needs_xacro
def test_an_argument_that_the_file_does_not_ask_for_is_said(tmp_path: Path) -> None:
    """As a misspelt one is."""
    used = '<xacro:arg name="tool" default="a"/><xacro:if value="$(arg free)"/>'
    file = write(tmp_path / "arm.xacro", arm(used))
    given = {"tool": "b", "free": 1, "tol": "c"}
    with pytest.warns(RobotWarning, match="no argument 'tol'"):
        robot = load_robot(file, xacro_args=given)
    assert [note.where for note in robot.report] == ["xacro_args"]
    with refused(RobotError, "xacro_args"):
        load_robot(file, xacro_args=given, strict=True)


@needs_xacro
def test_what_it_expands_to_is_checked_as_any_urdf(tmp_path: Path) -> None:
    file = write(tmp_path / "arm.xacro", arm('<link name="tip"/>'))
    with refused(RobotError, "link 'tip'", file=str(file)):
        load_robot(file)


def test_arguments_for_another_kind_of_file_are_refused() -> None:
    file = load_robot("planar2r").document.file
    with refused(InputError, "xacro_args", found=("a",)):
        load_robot(file, xacro_args={"a": 1})


@pytest.mark.parametrize("use", ["", '<link name="${width}"/>'])
def test_a_definition_in_a_urdf_is_left_out_if_nothing_uses_it(use: str, tmp_path: Path) -> None:
    file = write(tmp_path / "arm.urdf", arm('<xacro:property name="width" value="1"/>' + use))
    if use:
        with refused(RobotError, "link '${width}'", found="'name' of '${width}'"):
            load_robot(file)
    else:
        with pytest.warns(RobotWarning, match="xacro:property"):
            load_robot(file)


CASE = Path(__file__).parent / "cases" / "urdf" / "xacro_file.xacro"


@needs_xacro
def test_a_small_file_of_ours_loads() -> None:
    assert load_robot(CASE).nv


def test_it_is_refused_with_advice_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xacro_module, "find_spec", lambda name: None)
    with refused(MissingDependencyError, found="xacro", file=str(CASE)):
        load_robot(CASE)
