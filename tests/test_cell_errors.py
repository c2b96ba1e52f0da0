"""What is wrong with a cell file is said with file, line and key, what was found and what is expected."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import refused

from synctrl.cells import STARTER, CellFileError, read_cell
from synctrl.cells.reading import OTHER_NAMES

CIRCLE = '{ kind = "circle", center = [0.15, 0.35], radius = 0.08, speed = "90 deg" }'
#: what is changed in the starter, and the key and a text of the line at which the error then is
WRONG = [
    ("duration = 6.0  ", "duration = -4.0  ", "duration", "duration = -4.0"),
    ("duration = 6.0  ", 'duration = "4 s"', "duration", 'duration = "4 s"'),
    ("duration = 6.0  ", "duration = true", "duration", "duration = true"),
    ("duration = 6.0  ", "duration = inf", "duration", "duration = inf"),
    ('axes = "xy"', 'axes = "xw"', "space.axes", "axes ="),
    ('axes = "xy"', "axes = 3", "space.axes", "axes ="),
    ('kind = "cartesian"', 'kind = "cartesain"', "space.kind", "cartesain"),
    ('kind = "pair"', 'kind = "pear"', "coupling.kind", "pear"),
    ('kind = "pair"', "# none", "coupling.kind", "[coupling]"),
    ('kind = "pair"', 'kind = "pair"\nc = [1.0, -1.0, 1.0]', "coupling.c", "c = [1.0"),
    ('kind = "pair"', 'kind = "pair"\nc = [1.0, "a"]', "coupling.c", 'c = [1.0, "a"]'),
    ('kind = "pair"', 'kind = "star"\nleader = "middle"', "coupling.leader", "leader"),
    ('kind = "pair"', 'kind = "rows"\nedges = [["left", "rihgt"]]', "coupling.edges[0][1]", "edges"),
    ("beta = 10.0", "betta = 20.0", "gains.betta", "betta"),
    ("K_r = 5.0 ", "K_r = [1.0, 2.0, 3.0] ", "gains.K_r", "K_r = [1"),
    ("Lambda = 5.0", "Lambda = 0.0", "gains.Lambda", "Lambda"),
    ('name = "left"', "name = 3", "robots[0].name", "name = 3"),
    ('name = "left"', 'nmae = "left"', "robots[0].nmae", "nmae"),
    ('name = "right"', 'name = "left"', "robots", "[[robots]]"),
    ('robot = "left"', 'robot = "lft"', "disturbances[0].robot", '"lft"'),
    ('robot = "left"', "robot = 2", "disturbances[0].robot", "robot = 2"),
    ("start = 2.0  ", "start = 3.0  ", "disturbances[0]", "[[disturbances]]"),
    ("torque = 1.0", "torque = [1.0, 2.0, 3.0]", "disturbances[0].torque", "torque"),
    ('[0.15, 0.35], radius = 0.08', '[0.15, 0.35], radius = -0.08', "robots[1].motion.radius", "-0.08"),
    ('[0.15, 0.35], radius = 0.08', '[0.15, 0.35]', "robots[1].motion.radius", "[0.15, 0.35]"),
    ('center = [0.15, 0.35]', 'center = [0.15, 9.35]', "robots[1].motion", "9.35"),
    ('center = [0.15, 0.35]', 'center = [0.15]', "robots[1].motion.center", "center = [0.15]"),
    ('center = [0.15, 0.35]', 'center = [0.15, 0.35, 0.0]', "robots[1].motion", "0.35, 0.0]"),
    ('center = [0.15, 0.35]', 'centre = [0.15, 0.35]', "robots[1].motion.centre", "centre"),
    ("base = { xyz = [0.35, 0.0, 0.0] }", "base = { xyz = [0.35, 0.0] }", "robots[1].base.xyz", "[0.35,"),
    ("base = { xyz = [0.35, 0.0, 0.0] }", 'base = { rpy = [0, 0, "1 turn"] }', "robots[1].base.rpy", "turn"),
    ("known = 0.7", 'known = "7 deg"', "robots[1].known", "7 deg"),
    ("base = { xyz = [0.35, 0.0, 0.0] }", "base = [0.35, 0.0, 0.0]", "robots[1].base", "base = [0.35"),
    ("beta = 10.0", "beta = 10.0\nduration = 4.0", "gains.duration", "duration"),
    ("[coupling]", '[adaptation]\nkind = "natural"\ngamma = 1.0\n[coupling]', "gains.Gamma", "Gamma"),
    ("[coupling]", 'law = "pd-gravity"\n[coupling]', "robots[1].law", "pd-gravity"),
    ("[[disturbances]]", "[disturbances]", "disturbances", "[disturbances]"),
    ("[[disturbances]]", '[[sensors]]\nkind = "bias"\nq = [1.0]\n[[disturbances]]', "sensors[0].q", "q ="),
    ("[[disturbances]]", '[[loads]]\nrobot = 0\nmass = -1\n[[disturbances]]', "loads[0].mass", "mass = -1"),
    ("[coupling]", "[run]\ndt = 0.0\n[coupling]", "run.dt", "dt = 0.0"),
    ('"circle", center', '"line", center', "robots[1].motion.kind", '"line"'),
    (CIRCLE, '"circle"', "robots[1].motion", '"circle"'),
    ("known = 0.7\nfriction", "known = 0.7\nestimate = [1.0]\nfriction", "robots[1].estimate", "estimate"),
]  # fmt: skip


def changed(folder: Path, old: str, new: str) -> Path:
    """A starter file with a change, of the last place that has the old text."""
    assert old in STARTER
    path = folder / "cell.toml"
    path.write_text(new.join(STARTER.rsplit(old, 1)), "utf-8")
    return path


@pytest.mark.parametrize(("old", "new", "key", "line"), WRONG, ids=[new[:30] for _, new, _, _ in WRONG])
def test_a_wrong_value_is_refused_with_its_line_and_key(old, new, key, line, tmp_path):
    path = changed(tmp_path, old, new)
    lines = path.read_text("utf-8").splitlines()
    with refused(CellFileError, file=str(path)) as caught:
        read_cell(path)
    error = caught.value
    assert error.subject == key
    assert line in lines[error.line - 1]
    assert str(error).startswith(f"{path}:{error.line}: {key}: ")


@pytest.mark.parametrize(("kind", "meant"), OTHER_NAMES.items())
def test_what_is_called_otherwise_elsewhere_is_known_by_its_name_here(kind, meant, tmp_path):
    path = changed(tmp_path, '"circle", center', f'"{kind}", center')
    with pytest.raises(CellFileError, match=f"did you mean '{meant}'"):
        read_cell(path)
