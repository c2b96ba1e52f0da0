"""The survey of a folder of robots says what became of each, whatever that is."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
from pathlib import Path

import pytest

from synctrl import load_robot
from synctrl.robots.urdf.xacro import find_spec

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "scripts"))
survey_dynamics = pytest.importorskip("survey_dynamics")
survey_one = pytest.importorskip("survey_one")
survey_robots = pytest.importorskip("survey_robots")
pytest.importorskip("mujoco", reason="MuJoCo is an extra: pip install 'synctrl[mujoco]'")

CASES = ROOT / "tests" / "cases" / "urdf"
PLANAR = Path(load_robot("planar2r").document.file).read_text(encoding="utf-8")


def link(name: str, mass: float = 1.0) -> str:
    inertia = '<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><mass value="{mass}"/>{inertia}</inertial></link>'


def joint(parent: str, child: str, kind: str = "revolute") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    return f'<joint name="{child}_joint" type="{kind}">{ends}{limit}</joint>'


def tree(*edges: str, kind: str = "revolute", mass: float = 1.0) -> str:
    """A robot of edges such as "ab": link b hangs from link a."""
    names = dict.fromkeys("".join(edges))
    links = "".join(link(name, mass) for name in names)
    return f'<robot name="r">{links}{"".join(joint(*edge, kind) for edge in edges)}</robot>'


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (tree("ab", "bc"), "arm"),
        (tree("ab", "bc", "cd", "de", "df"), "arm"),
        (tree("ab", "bc", "cd", "ae", "ef", "fg"), "arm"),
        (f"<?xml version='1.0' encoding='gb2312'?>{tree('ab', 'bc')}", "arm"),
        (tree("ab", "ac", "ad", "ae"), "wheels or fingers"),
        (tree("ab", "bc", "cd", "ae", "ef", "fg", "ah", "hi", "ij"), "more than two limbs"),
        (tree("ab", "bc", kind="fixed"), "nothing moves"),
        (tree("ab", "bc", kind="floating"), "a joint of several degrees of freedom"),
        (tree("ab", "bc", mass=0), "no masses"),
        (
            tree("ab").replace('<parent link="a"/>', '<parent link="x"/>'),
            "a part, to be fixed to a link that it lacks",
        ),
        ("<robot", "not XML"),
        ("<sdf/>", "not a robot"),
    ],
)
def test_what_a_file_is_can_be_told_from_its_tree(text: str, what: str) -> None:
    assert survey_one.what_it_is(text) == what


def test_small_files_of_ours_are_surveyed_without_a_crash(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    out = tmp_path / "table.md"
    rows = survey_robots.main([str(CASES), "--out", str(out)])
    arms = [row for row in rows if row.what == "arm"]
    assert {row.file for row in rows} == {str(f.relative_to(CASES)) for f in CASES.rglob("*.urdf")}
    assert arms
    assert not [row for row in arms if "CRASH" in row.refusal]
    assert f"| together |  | {len(rows)} | {len(arms)} |" in out.read_text(encoding="utf-8")
    assert len(json.loads(out.with_suffix(".json").read_text())[CASES.name]) == len(rows)


def test_the_table_says_who_is_refused_and_counts_those_without_mass_apart() -> None:
    arm = survey_robots.Row("good", notes=[("locked", "held at 0 rad"), ("suspicious", "a range")])
    rows = [
        arm,
        survey_robots.Row("light", refusal="joint 'a': expected a mass above 0 kg, found 0"),
        survey_robots.Row("twisted", refusal="joint 'a': expected lower below upper, found 1 and 0"),
        survey_robots.Row("wheels", what="wheels or fingers"),
    ]
    text = survey_robots.table({Path("one"): rows})
    assert "- twisted: joint 'a': expected lower below upper" in text and "- light: joint" in text
    assert "Of 3 arms that have any mass, 1 load, 33.3 %" in text
    assert "Of 2 arms that are not refused for a missing mass" in text and "1 load, 50.0 %" in text
    assert "| together |  | 4 | 3 | 1 | 0 | 1 | 0 | 1 |" in text


def test_dynamics_are_compared_with_plain_pinocchio_and_both_engines_run(tmp_path: Path) -> None:
    pytest.importorskip("casadi")
    (tmp_path / "one" / "arm.urdf").parent.mkdir()
    (tmp_path / "one" / "arm.urdf").write_text(PLANAR, encoding="utf-8")
    (row,) = survey_robots.main([str(tmp_path), "--compare"])
    assert set(row.errors) == {"M", "C", "g", "regressor"}
    assert max(row.errors.values()) < 1e-12
    assert row.loop < 1e-9


def test_a_difference_from_plain_pinocchio_is_found() -> None:
    robot, other = load_robot("planar2r"), survey_dynamics.pin.buildModelFromXML(PLANAR)
    other.inertias[2].mass *= 1.001
    errors = survey_dynamics.differences(robot, other)
    assert min(errors[name] for name in ("M", "C", "regressor")) > 1e-5


@pytest.mark.skipif(not find_spec("xacro"), reason="needs the extra xacro")
def test_a_xacro_file_is_tried_with_each_set_of_arguments(tmp_path: Path) -> None:
    text = PLANAR.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', 1)
    (tmp_path / "arm.xacro").write_text(text.replace('name="planar2r"', 'name="$(arg n)"'), encoding="utf-8")
    (tmp_path / ".xacro_args.json").write_text(
        '{"arm.xacro": [{"n": "a"}, {"n": "b"}, {}]}', encoding="utf-8"
    )
    rows = survey_robots.main([str(tmp_path), "--xacro"])
    assert [row.file for row in rows] == ["arm.xacro n:=a", "arm.xacro n:=b", "arm.xacro"]
    assert [row.what for row in rows[:2]] == ["arm", "arm"]
    assert rows[2].what.startswith("does not expand: Undefined substitution argument n")


def test_a_process_that_is_killed_is_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(CASES / "good.urdf", tmp_path / "good.urdf")
    monkeypatch.setattr(survey_robots, "survey", lambda *_: os.kill(os.getpid(), signal.SIGKILL))
    (row,) = survey_robots.main([str(tmp_path)])
    assert row.refusal == f"CRASH: the process ended with {-signal.SIGKILL}"


def test_messages_of_one_kind_are_counted_together() -> None:
    kinds = {survey_robots._kind(f"/a/{k}.urdf:{k}: link 'l{k}': found {k}.5 kg") for k in range(3)}
    assert len(kinds) == 1
