"""Result files: whatever is in them, they are a valid result or a ResultError; what is valid is usable."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from consumers import CONSUMERS, consume
from damage import HOSTILE_HEADERS, archive_of, array_of, damaged, info_of, members, npy, put, with_header
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import Cell, Disturbance, Experiment, Result
from synctrl.errors import InputError, ResultError, SimulationError
from synctrl.paper.plant_sections import step_section
from synctrl.show.plots import common_limits, save, tracking_errors
from synctrl.simulation.result import LAYOUT

FORMAT_1 = Path(__file__).parent / "data" / "result-format-1.npz"


@pytest.fixture(scope="module")
def experiment():
    return Experiment(small_cell(), SMALL_GAINS, 0.05, disturbances=[Disturbance(0, 0.3, 0.02, 0.03)])


@pytest.fixture(scope="module")
def result(experiment):
    """A run with one output."""
    run = experiment.simulate(dt=5e-3)
    outputs = {"applied": {"unit": "N·m", "axes": ["time", "robot", "joint"]}}
    return replace(run, outputs={"applied": run.tau.copy()}, info={**run.info, "outputs": outputs})


@pytest.fixture(scope="module")
def data(result, tmp_path_factory):
    """A good file."""
    return result.save(tmp_path_factory.mktemp("good") / "run.npz").read_bytes()


@pytest.fixture
def load(tmp_path):
    """Load a file with some content."""

    def load(content: bytes) -> Result:
        path = tmp_path / "some.npz"
        path.write_bytes(content)
        return Result.load(path)

    return load


def with_entry(data: bytes, name: str, entry: bytes) -> bytes:
    return archive_of([*(members(data) | {name: entry}).items()])


def with_info(data: bytes, info: object) -> bytes:
    return with_entry(data, "info.npy", npy(np.array(info if isinstance(info, str) else json.dumps(info))))


def with_array(data: bytes, name: str, where: object, value: float) -> bytes:
    array = array_of(members(data)[f"{name}.npy"]).copy()
    array[where] = value
    return with_entry(data, f"{name}.npy", npy(array))


# -- formats ----------------------------------------------------------------------------------------------


def test_files_of_format_1_are_read_and_have_no_outputs(tmp_path):
    """The file was written by version 0.1."""
    old = Result.load(FORMAT_1)
    assert "synctrl result 1" in str(np.load(FORMAT_1)["info"])
    assert old.outputs == {} and old.status == "completed" and len(old.names) == 4
    with np.load(FORMAT_1) as content:
        assert all(np.array_equal(content[name], getattr(old, name)) for name in LAYOUT)
    assert Result.load(old.save(tmp_path / "new.npz")) == old
    assert "synctrl result 2" in str(np.load(tmp_path / "new.npz")["info"])


def test_entries_that_nobody_here_reads_are_kept(result, tmp_path):
    more = {"remark": {"estimate": 1e-5, "times": [0.1, None, True]}, "note": "two\nlines", "odd": 1e400}
    run = replace(result, info={**result.info, **more})
    loaded = Result.load(run.save(tmp_path / "run.npz"))
    assert loaded == run and {key: loaded.info[key] for key in more} == more


def test_outputs_may_have_axes_of_their_own_and_say_that_there_is_no_value(result, tmp_path):
    force = np.full((len(result.t), 2, 6), np.nan)
    about = {"internal_force": {"unit": "N", "axes": ["time", "robot", "component"]}}
    run = replace(result, outputs={"internal_force": force}, info={**result.info, "outputs": about})
    assert Result.load(run.save(tmp_path / "run.npz")) == run


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("kind", ["<f8", ">f8"])
def test_numbers_are_the_same_in_any_byte_order_and_layout(data, result, load, order, kind):
    q = npy(np.array(result.q, dtype=kind, order=order))
    loaded = load(with_entry(data, "q.npy", q))
    assert loaded == result and loaded.q.dtype == np.float64


# -- hostile files ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("k", range(len(HOSTILE_HEADERS)))
@pytest.mark.parametrize("name", ["t", "q", "info", "outputs/applied"])
def test_a_header_that_numpy_does_not_write_is_refused(data, load, tmp_path, name, k, version):
    entry = members(data)[f"{name}.npy"]
    hostile = with_header(HOSTILE_HEADERS[k], entry[128:] if k % 2 else b"", version)
    with refused(ResultError, file=str(tmp_path / "some.npz")):
        load(with_entry(data, f"{name}.npy", hostile))


def test_a_size_that_the_file_does_not_have_is_refused_before_memory_is_asked_for(data, load, monkeypatch):
    monkeypatch.setattr(np, "empty", lambda *_: pytest.fail("memory was asked for"))
    monkeypatch.setattr(np, "zeros", np.empty)
    for shape in ("(18446744073709551615,)", "(4611686018427387904, 4)", "(1000000000000, 2, 2)"):
        header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n"
        for name in ("info", "t"):
            with pytest.raises(ResultError):
                load(archive_of([(f"{name}.npy", with_header(header))]))


@pytest.mark.parametrize(
    "change",
    [
        lambda found: found[1:],
        lambda found: [*found, found[3]],
        lambda found: [*found, ("more.npy", found[3][1])],
        lambda found: [*found, ("outputs/more.npy", found[3][1])],
        lambda found: [*found, ("more.txt", b"")],
        lambda found: [("x", b""), *found],
        lambda found: [(name.upper(), entry) for name, entry in found],
        lambda found: [(name, b"no array") for name, _ in found],
        lambda found: [(name, found[0][1]) for name, _ in found],
        lambda found: [(name, found[1][1]) for name, _ in found],
        lambda found: [],
    ],
)
def test_an_archive_with_other_entries_is_refused(data, load, tmp_path, change):
    with refused(ResultError, file=str(tmp_path / "some.npz")):
        load(archive_of(change([*members(data).items()])))


def remove(holder, key):
    del holder[key]


#: a place in info, and what is put there: all of it would mislead somebody who reads it later
WRONG_INFO = [
    (("robots",), []),
    (("robots", 0), "arm"),
    (("robots", 0, "name"), "robot 2"),
    (("robots", 0, "name"), "half a pair \ud800"),
    (("robots", 0, "name"), "bell \x07"),
    (("robots", 0, "name"), "two\nlines"),
    (("robots", 0, "name"), "x" * 5000),
    (("robots", 0, "joints"), []),
    (("robots", 0, "joints"), ["a", "b", "c"]),
    (("robots", 0, "joints"), ["a", "a"]),
    (("robots", 0, "parameters"), ["m"]),
    (("robots", 0, "theta", 0), None),
    (("robots", 0, "theta", 0), float("nan")),
    (("robots", 0, "theta"), []),
    (("robots", 0, "torque_limits"), [1.0]),
    (("robots", 0, "torque_limits", 0), -1.0),
    (("axes",), []),
    (("axes",), ["x", "x"]),
    (("axes",), "xy"),
    (("pairs",), []),
    (("pairs", 0), [0, 2]),
    (("pairs", 0), [0, -1]),
    (("pairs", 0), [0, 0]),
    (("pairs", 0), [0]),
    (("pairs", 0), [0, True]),
    (("pairs", 0), [0, 1.0]),
    (("signs",), [[1.0, 1.0]] * 3),
    (("sizes", "robot"), 0),
    (("sizes", "robot"), 3),
    (("sizes", "pair"), 0),
    (("sizes", "axis"), -2),
    (("sizes", "joint"), 2.0),
    (("sizes", "parameter"), 2**64),
    (("sizes", "time"), 3),
    (("title",), None),
    (("title",), "\ud800"),
    (("status",), ["completed"]),
    (("task_unit",), 1),
    (("weighted_unit",), "\x00"),
    (("gains",), {}),
    (("gains", "Lambda"), "large"),
    (("gains", "beta"), [1.0, [float("inf")]]),
    (("versions",), None),
    (("versions", "numpy"), 2),
    (("plant",), 5),
    (("control_period",), 0),
    (("saturate",), "yes"),
    (("decimated",), 0),
    (("dt",), -1.0),
    (("disturbances",), {}),
    (("disturbances", 0, "robot"), 2),
    (("disturbances", 0, "start"), None),
    (("disturbances", 0, "stop"), float("inf")),
    (("disturbances", 0, "torque"), "much"),
    (("limits",), [{"robot": 0, "joint": 7, "kind": "torque", "start": 0, "stop": 1}]),
    (("damping",), [{"robot": "first", "start": 0, "stop": 1}]),
    (("payloads",), [{"robot": 0}]),
    (("held_joints",), [{"joints": [], "largest": [], "final": []}]),
    *((("step_error",), value) for value in ("x", [1], 5, {}, {"estimate": 1.0}, {"estimate": None})),
    (("step_error", "estimate"), -1.0),
    (("step_error", "estimate"), None),
    (("step_error", "limit"), None),
    (("step_error", "robot"), 2),
    (("step_error", "joint"), -1),
    (("step_error", "time"), "late"),
    (("step_error", "time"), None),
    (("step_error", "advised_step"), 0.0),
    (("saturation",), [{"robot": 0, "joint": 0, "limit": 1, "share": 1, "largest": 2, "theta_hat": [0]}]),
    *(((part,), value) for part in ("adaptation", "law", "network") for value in ("x", [], {}, {"name": 1})),
    (("outputs",), {}),
    (("outputs", "applied", "axes"), ["robot", "time", "joint"]),
    (("outputs", "applied", "axes"), ["time", "robot"]),
    (("outputs", "applied", "axes"), []),
    (("outputs", "applied", "unit"), None),
    (("format",), "synctrl result 0"),
    (("large",), 2**70),
]


@pytest.mark.parametrize(("where", "value"), WRONG_INFO)
def test_info_that_would_mislead_a_reader_is_refused(data, load, tmp_path, where, value):
    info = info_of(members(data)["info.npy"])
    if where != ("sizes", "time"):
        put(info, where, lambda holder, key: holder.__setitem__(key, value))
        with refused(ResultError, file=str(tmp_path / "some.npz")) as caught:
            load(with_info(data, info))
        assert len(str(caught.value)) < 800 and str(caught.value).isprintable()
    else:  # the length of the log is that of its arrays, whatever else is said
        put(info, where, lambda holder, key: holder.__setitem__(key, value))
        assert len(load(with_info(data, info)).t) == 11


NEEDED = ["status", "title", "robots", "axes", "pairs", "sizes", "gains", "versions", "task_unit", "format"]


@pytest.mark.parametrize("where", [*((key,) for key in NEEDED), ("robots", 0, "joints"), ("gains", "beta")])
def test_info_without_an_entry_that_is_read_later_is_refused(data, load, where):
    info = info_of(members(data)["info.npy"])
    put(info, where, remove)
    with refused(ResultError) as caught:
        load(with_info(data, info))
    assert where[-1] in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        '{"format": "synctrl result 2", "format": "synctrl result 2"}',
        "[" * 100_000,
        '{"a":' * 100_000,
        '{"format": "synctrl result 2", "deep": ' + "[" * 50 + "]" * 50 + "}",
        "9" * 10_000,
        "1e999",
        "NaN",
        '"text"',
        "{'a': 1}",
        "\ufeff{}",
    ],
)
def test_a_text_that_is_no_info_is_refused(data, load, tmp_path, text):
    with refused(ResultError, file=str(tmp_path / "some.npz")):
        load(with_info(data, text))


@pytest.mark.parametrize(
    ("name", "where", "value"),
    [
        ("t", 3, np.nan),
        ("t", -1, np.inf),
        ("t", -1, 1e300),
        ("t", 3, 0.0),
        ("t", slice(None), 0.0),
        *((name, (2,), np.nan) for name in LAYOUT),
        *((name, (2,), -np.inf) for name in LAYOUT),
    ],
)
def test_numbers_that_no_run_has_are_refused(data, load, name, where, value):
    with refused(ResultError, f"array '{name}'"):
        load(with_array(data, name, where, value))


def test_what_load_would_refuse_is_not_saved(result, tmp_path):
    wrong = [
        replace(result, q=np.full_like(result.q, np.nan)),
        replace(result, q=result.q[:-1]),
        replace(result, info={**result.info, "more": object()}),
        replace(result, info={**result.info, "more": np.float32(1)}),
        replace(result, info={**result.info, "title": None}),
        replace(result, info={**result.info, "axes": ["x"]}),
    ]
    for run in wrong:
        with refused(ResultError, file=str(tmp_path / "run.npz")):
            run.save(tmp_path / "run.npz")
    assert [*tmp_path.iterdir()] == []


# -- names ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["half a pair \ud800", "bell \x07", "two\nlines", "x" * 5000, 7])
def test_names_that_files_and_figures_cannot_hold_are_refused_before_a_run(name):
    with refused(InputError, "name"):
        small_cell(name=name)
    cell = small_cell()
    with refused(InputError, "name"):
        Cell([replace(cell.members[0], name=name), cell.members[1]], cell.coupling, cell.space)
    with refused(InputError, "title"):
        Experiment(cell, SMALL_GAINS, 1.0, title=name)


def test_any_other_name_survives_the_disk_and_every_figure(result, experiment, tmp_path):
    names = ["<script>alert(1)</script>", "$\\frac{", "a & b", "--> '", "\u202e", "🤖"]
    robots = [{**robot, "name": name} for robot, name in zip(result.info["robots"], names[:2], strict=True)]
    info = {**result.info, "robots": robots, "title": names[2], "axes": names[3:5], "plant": names[5]}
    run = Result.load(replace(result, info=info).save(tmp_path / "run.npz"))
    assert run.names == names[:2]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of signs that a font lacks
        save(tracking_errors(run), tmp_path / "figure")
    assert {*consume(run, experiment).values()} <= {"done", "InputError"}


@pytest.mark.parametrize("advised", [None, 5e-4])
@pytest.mark.parametrize("missing", [None, "dt"])
def test_a_step_that_was_too_long_is_shown_whatever_else_is_known(result, tmp_path, advised, missing):
    step = {"estimate": 0.1, "limit": 1e-3, "robot": 1, "joint": 0, "time": 0.1, "advised_step": advised}
    info = {key: value for key, value in result.info.items() if key != missing} | {"step_error": step}
    run = Result.load(replace(result, info=info).save(tmp_path / "run.npz"))
    assert consume(run, None, ["step_section"]) == {"step_section": "done"}


def test_runs_of_one_title_are_told_apart_in_the_table_of_steps(result):
    step = {"estimate": 0.1, "limit": 1e-3, "robot": 1, "joint": 0, "time": 0.1, "advised_step": 5e-4}
    run = replace(result, info={**result.info, "step_error": step})
    other = replace(run, info={**run.info, "title": "another"})
    *_, table = step_section({"first_run": run, "second_run": run, "third_run": other}).blocks
    assert [row[0] for row in table.rows] == ["first run", "second run", "another"]


def test_a_run_whose_steps_could_not_be_looked_at_survives_the_disk(result, tmp_path):
    unseen = dict.fromkeys(("estimate", "robot", "joint", "time", "advised_step"))
    for step in (None, {**unseen, "limit": 1e-3}):
        run = replace(result, info={**result.info, "step_error": step})
        assert Result.load(run.save(tmp_path / "run.npz")) == run
        assert consume(run, None, ["step_section"]) == {"step_section": "done"}


# -- whatever is valid can be used ------------------------------------------------------------------------


def test_consumers_work_on_a_loaded_run_or_say_why_not(result, experiment, tmp_path):
    loaded = Result.load(result.save(tmp_path / "run.npz"))
    ended = consume(loaded, experiment)
    other_cells = {"payload_pair_scene", "formation_scene", "payload_scene", "vehicle_animation"}
    assert {name for name, end in ended.items() if end != "done"} == other_cells
    without = consume(loaded, None)
    assert {*without.values()} == {"done", "InputError"}
    assert without["certify"] == without["planar_scene"] == without["cell_layout"] == "InputError"


def test_a_run_of_no_instants_is_a_result_of_which_nothing_can_be_shown(result, experiment, tmp_path):
    arrays = {name: getattr(result, name)[:0] for name in LAYOUT}
    nothing = replace(result, **arrays, outputs={"applied": result.tau[:0]})
    loaded = Result.load(nothing.save(tmp_path / "run.npz"))
    assert loaded == nothing and len(loaded.decimated(3).t) == 0
    ended = consume(loaded, experiment)
    assert {name for name, end in ended.items() if end == "done"} == {"row_names", "step_section"}


def test_a_run_of_one_instant_can_be_used(result, experiment, tmp_path):
    arrays = {name: getattr(result, name)[:1] for name in LAYOUT}
    one = replace(result, **arrays, outputs={"applied": result.tau[:1]})
    ended = consume(Result.load(one.save(tmp_path / "run.npz")), experiment)
    assert ended["metrics"] == ended["tracking_errors"] == ended["planar_scene"] == "done"


@pytest.mark.parametrize("name", [*LAYOUT])
@pytest.mark.parametrize("value", [1e300, -1e31])
def test_numbers_of_a_run_that_went_astray_end_in_no_other_error(data, load, experiment, name, value):
    if name == "t":
        value = 9e11
    loaded = load(with_array(data, name, -1, value))
    consume(loaded, experiment, ["planar_scene", "metrics", "certify", "convergence", "identify"])


@pytest.mark.parametrize("name", [*CONSUMERS])
@pytest.mark.parametrize("thing", [None, 5, "run.npz", [], {"t": 0}])
def test_what_is_no_result_is_an_error_of_the_toolkit(experiment, name, thing):
    with pytest.raises(InputError):
        CONSUMERS[name](thing, experiment)


def test_figures_and_scenes_refuse_an_experiment_of_another_cell(result):
    other = Experiment(small_cell(3), SMALL_GAINS, 1.0)
    for name in ("planar_scene", "cell_layout", "certify"):
        with refused(InputError, "experiment"):
            CONSUMERS[name](replace(result, experiment=None), other)


@pytest.mark.parametrize("limits", [(1.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (0.0,), "ab", 3])
def test_limits_that_are_none_are_refused(result, limits):
    with refused(InputError, "limits"):
        tracking_errors(result, limits)


def test_limits_of_nothing_are_refused(result):
    with refused(InputError, "kind"):
        common_limits("speed", result)
    with refused(InputError, "results"):
        common_limits("sync_error")


def test_an_animation_of_too_many_frames_is_refused(data, load, experiment):
    with refused(InputError, "fps"):
        CONSUMERS["planar_scene"](load(with_array(data, "t", -1, 1e11)), experiment)


# -- chance -----------------------------------------------------------------------------------------------


@given(st.integers(0, 10**6))
@settings(max_examples=150)
def test_a_damaged_file_is_a_valid_result_or_a_result_error(data, tmp_path_factory, seed):
    path = tmp_path_factory.getbasetemp() / "damaged.npz"
    _, content = damaged(seed, data)
    path.write_bytes(content)
    try:
        loaded = Result.load(path)
    except ResultError as error:
        assert "damaged.npz" in str(error)
        return
    path.unlink()
    assert Result.load(loaded.save(path)) == loaded


# -- runs that stopped ------------------------------------------------------------------------------------

ASTRAY = {
    "step": {"gains": SMALL_GAINS.replace(Lambda=1e5)},
    "adaptation": {"gains": SMALL_GAINS.replace(Gamma=1e9)},
    "push": {"disturbances": [Disturbance(0, 1e300, 0.01, 0.03)]},
    "strong push": {"disturbances": [Disturbance(1, 1e12, 0.01, 0.03)]},
}


@pytest.mark.parametrize("options", [{}, {"control_period": 1e-2}, {"engine": "compiled"}])
@pytest.mark.parametrize("cause", [*ASTRAY])
def test_whatever_a_run_that_stopped_hands_over_can_be_saved_and_loaded(experiment, tmp_path, cause, options):
    if "engine" in options:
        pytest.importorskip("casadi")
    try:
        run = replace(experiment, **ASTRAY[cause]).simulate(0.1, dt=5e-3, **options)
    except SimulationError as error:
        run = error.result
    assert Result.load(run.save(tmp_path / "run.npz")) == run
