"""Files that nobody meant: whatever stands in one, it is read, or refused with a line of it."""

from __future__ import annotations

import copy
import math
import tomllib
import warnings
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cell_variants import PARTS
from hypothesis import given, settings
from hypothesis import strategies as st

from synctrl.cells import STARTER, CellFileError, read_cell, toml, write_cell
from synctrl.experiments import a460_pair, carry_planar, mobile_robot, planar_four, rigid_object

#: values that are wrong nearly everywhere, each right somewhere
VALUES: list[Any] = [
    0, -1, 2, 0.5, 1e300, -1e300, 1e-300, math.inf, math.nan, 2**70, True, "", "x", "left", "pair", "joint",
    "a\nb", "../../etc/passwd", "é\u0000", "arm.urdf", "90 deg", [], [[]], {}, [{}], [1, "a"],
    [1.0, 2.0, 3.0], [[1.0, 2.0], [3.0]], [[[[[1.0]]]]], [1.0, [2.0]], {"kind": 3}, {"kind": []},
    {"a": {"b": 1}}, {"kind": "hold", "position": [0.0]},
]  # fmt: skip
plain = st.recursive(
    st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=12),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=12,
)


@cache
def files() -> list[str]:
    """Files that are right."""
    made = [
        planar_four(),
        mobile_robot(),
        rigid_object(),
        carry_planar(),
        *(a460_pair(**parts) for parts in PARTS),
    ]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "cell.toml"
        return [STARTER, *(write_cell(experiment, path).read_text("utf-8") for experiment in made)]


def places(data: Any, above: tuple = ()) -> list[tuple]:
    """Where something can be changed; of arrays the first few."""
    inner = data.items() if isinstance(data, dict) else enumerate(data[:4]) if isinstance(data, list) else ()
    return [place for key, value in inner for place in [(*above, key), *places(value, (*above, key))]]


def changed(draw: Any, data: Any) -> None:
    """Change one thing: another value, none, or a key that is not known."""
    *above, last = draw(st.sampled_from(places(data)))
    for key in above:
        data = data[key]
    what = draw(st.sampled_from(["value", "value", "none", "new"]))
    if what == "none":
        del data[last]
    elif what == "new" and isinstance(data, dict):
        data[draw(st.sampled_from(["kind", "name", "c", "robot", f"{last}x"]))] = copy.deepcopy(
            draw(st.sampled_from(VALUES))
        )
    else:
        data[last] = copy.deepcopy(draw(st.sampled_from(VALUES)))


@settings(max_examples=150)
@given(st.data())
def test_a_file_is_read_or_refused_with_a_line_of_it(data: st.DataObject) -> None:
    cell = tomllib.loads(data.draw(st.sampled_from(files())))
    for _ in range(data.draw(st.integers(1, 2))):
        changed(data.draw, cell)
    text = toml.document(cell)
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = Path(folder) / "cell.toml"
        path.write_text(text, "utf-8")
        try:
            read_cell(path)
        except CellFileError as error:
            assert 1 <= error.line <= text.count("\n") + 1
            assert str(error).startswith(f"{path}:{error.line}: ")


@settings(max_examples=100)
@given(st.text(alphabet="[]{}=\"'#.,\n\\abk1 -é", max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "cell.toml"
        path.write_bytes(text.encode())
        try:
            read_cell(path)
        except CellFileError as error:
            assert error.line >= 1


@settings(max_examples=60)
@given(st.dictionaries(st.text(max_size=8), plain, max_size=5))
def test_data_written_as_toml_reads_back_to_the_same(data: dict[str, Any]) -> None:
    assert repr(in_order(tomllib.loads(toml.document(data)))) == repr(in_order(data))


def in_order(data: Any) -> Any:
    """Data with the keys of its tables in order: that of a file has values first."""
    if isinstance(data, dict):
        return {key: in_order(data[key]) for key in sorted(data)}
    return [in_order(each) for each in data] if isinstance(data, list) else data
