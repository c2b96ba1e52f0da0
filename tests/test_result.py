"""Result: frozen, the same after saving and loading, and safe to load from a file that anybody made."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import Disturbance, Result, SynctrlError, simulate
from synctrl.errors import InputError, ResultError
from synctrl.simulation.result import LAYOUT


@pytest.fixture(scope="module")
def result():
    push = Disturbance(0, 0.3, 0.02, 0.05)
    return simulate(small_cell(), SMALL_GAINS, 0.1, dt=5e-3, disturbances=[push])


@pytest.fixture(scope="module")
def saved(result, tmp_path_factory):
    return result.save(tmp_path_factory.mktemp("results") / "run.npz")


@pytest.fixture
def content(saved):
    """Arrays of a good file, to be spoilt."""
    with np.load(saved) as file:
        return {name: file[name] for name in file.files}


def write(path: Path, content: dict[str, np.ndarray], **options) -> Path:
    np.savez(path, **content, **options)
    return path


def change_info(content, **changes):
    info = json.loads(str(content["info"])) | changes
    content["info"] = np.array(json.dumps({k: v for k, v in info.items() if v != "leave out"}))


# -- what it is -------------------------------------------------------------------------------------------


def test_all_arrays_have_the_shape_and_unit_the_layout_gives_them(result):
    sizes = {"time": 21, "robot": 2, "pair": 1, "axis": 2, "joint": 2, "parameter": 20}
    for name, (dimensions, _) in LAYOUT.items():
        array = getattr(result, name)
        assert array.shape == tuple(sizes[d] for d in dimensions), name
        assert array.dtype == np.float64
        assert np.isfinite(array).all()
        assert "task" not in result.unit(name) and "weighted" not in result.unit(name)
    assert (result.unit("x"), result.unit("sync_error"), result.unit("tau")) == ("m", "m", "N·m")
    assert result.names == ["robot 1", "robot 2"] and result.status == "completed"


def test_its_arrays_keep_the_promises_of_their_names(result):
    np.testing.assert_array_equal(result.tracking_error, result.x_desired - result.x)
    np.testing.assert_allclose(
        result.sync_error[:, 0], result.tracking_error[:, 0] - result.tracking_error[:, 1], atol=1e-15
    )
    steps = np.diff(result.sync_integral[:, 0], axis=0) / 5e-3
    between = 0.5 * (result.sync_error[1:, 0] + result.sync_error[:-1, 0])
    np.testing.assert_allclose(steps, between, rtol=0, atol=2e-2 * np.abs(between).max())
    pushed = (result.t >= 0.02) & (result.t < 0.05)
    np.testing.assert_array_equal(result.disturbance[:, 0, 0], np.where(pushed, 0.3, 0.0))
    np.testing.assert_array_equal(result.disturbance[:, 1], 0)


def test_it_says_how_it_came_about(result):
    info = result.info
    assert info["gains"] == SMALL_GAINS.as_dict()
    assert (info["integrator"], info["dt"], info["duration"]) == ("rk4", 5e-3, 0.1)
    assert info["disturbances"] == [{"robot": 0, "torque": 0.3, "start": 0.02, "stop": 0.05}]
    assert {"synctrl", "pin", "numpy", "scipy"} <= set(info["versions"])
    assert info["units"] == {name: result.unit(name) for name in LAYOUT}
    assert info["units"]["v"] == "rad/s"
    assert [len(robot["theta"]) == len(robot["parameters"]) for robot in info["robots"]] == [True, True]


def test_it_cannot_be_changed(result):
    for name in LAYOUT:
        with pytest.raises(ValueError, match="read-only"):  # numpy's words
            getattr(result, name)[0] = 1.0
        with pytest.raises(AttributeError):
            setattr(result, name, np.zeros(3))
    with pytest.raises(TypeError):
        result.info["status"] = "better"


def test_results_differ_if_one_bit_does(result):
    assert Result(**{name: getattr(result, name).copy() for name in LAYOUT}, info=result.info) == result
    arrays = {name: getattr(result, name).copy() for name in LAYOUT}
    arrays["tau"][3, 1, 1] = np.nextafter(arrays["tau"][3, 1, 1], np.inf)
    assert Result(**arrays, info=result.info) != result
    assert (
        Result(**{name: getattr(result, name) for name in LAYOUT}, info={**result.info, "dt": 1.0}) != result
    )
    assert result != "a result"


# -- saving and loading -----------------------------------------------------------------------------------


def test_a_loaded_result_is_the_saved_one(result, saved):
    loaded = Result.load(saved)
    assert loaded == result
    assert dict(loaded.info) == json.loads(json.dumps(dict(result.info)))
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(result, name))
        assert not getattr(loaded, name).flags.writeable
    assert Result.load(str(saved)) == result


@pytest.mark.parametrize("disturbance", [None, "torque"])
def test_full_runs_survive_the_disk(planar_run, tmp_path, disturbance):
    run = planar_run(True, disturbance)
    assert Result.load(run.save(tmp_path / "deep" / "er" / "run.npz")) == run
    assert [path.name for path in (tmp_path / "deep" / "er").iterdir()] == ["run.npz"]


def test_the_file_needs_no_pickle_and_no_toolkit(saved, result):
    with np.load(saved, allow_pickle=False) as file:
        np.testing.assert_array_equal(file["q"], result.q)
        assert json.loads(str(file["info"]))["axes"] == ["x", "y"]


def test_the_same_result_gives_the_same_bytes(result, tmp_path):
    first, second = result.save(tmp_path / "a.npz"), result.save(tmp_path / "b.npz")
    assert first.read_bytes() == second.read_bytes()


def test_places_where_nothing_can_be_written_are_named(result, tmp_path):
    (tmp_path / "file").write_text("in the way")
    for place in (tmp_path, tmp_path / "file" / "run.npz"):
        with refused(ResultError, None, file=str(place)):
            result.save(place)
    with pytest.raises(SynctrlError):
        result.save(None)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file"]


# -- outputs ----------------------------------------------------------------------------------------------


@pytest.fixture
def with_output(result):
    """The result with one more array over time."""
    torque = np.arange(result.tau.size, dtype=float).reshape(result.tau.shape)
    about = {"applied_torque": {"unit": "N·m", "axes": ["time", "robot", "joint"]}}
    info = {**result.info, "outputs": about}
    return replace(result, outputs={"applied_torque": torque}, info=info)


def test_outputs_have_units_are_frozen_and_survive_the_disk(result, with_output, tmp_path):
    assert with_output.unit("applied_torque") == "N·m"
    loaded = Result.load(with_output.save(tmp_path / "run.npz"))
    assert loaded == with_output and loaded != result
    np.testing.assert_array_equal(loaded.outputs["applied_torque"], with_output.outputs["applied_torque"])
    with pytest.raises(ValueError, match="read-only"):  # numpy's words
        loaded.outputs["applied_torque"][0] = 1.0
    with pytest.raises(TypeError):
        loaded.outputs["more"] = np.zeros(21)


def test_results_with_another_output_differ(with_output):
    changed = {"applied_torque": with_output.outputs["applied_torque"] + 1.0}
    assert replace(with_output, outputs=changed) != with_output
    without = {key: entry for key, entry in with_output.info.items() if key != "outputs"}
    assert replace(with_output, outputs={}, info=without) != with_output


def test_outputs_are_thinned_with_the_other_arrays(with_output):
    thin = with_output.decimated(5)
    np.testing.assert_array_equal(
        thin.outputs["applied_torque"], with_output.outputs["applied_torque"][[0, 5, 10, 15, 20]]
    )
    assert len(thin.t) == 5


@pytest.mark.parametrize(
    "outputs", [{"unknown": np.zeros(21)}, {"applied_torque": np.zeros((20, 2, 2))}], ids=["name", "instants"]
)
def test_outputs_that_do_not_fit_their_description_are_refused(with_output, outputs):
    with refused(InputError, "outputs"):
        replace(with_output, outputs=outputs)


# -- damaged and hostile files ----------------------------------------------------------------------------


def test_a_missing_file_is_named(tmp_path):
    for place in (tmp_path / "none.npz", tmp_path):
        with refused(ResultError, None, file=str(place)):
            Result.load(place)
    with refused(InputError, "path"):
        Result.load(None)


@pytest.mark.parametrize("left", [0, 1, 10, 100, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(saved, tmp_path, left):
    data = saved.read_bytes()
    path = tmp_path / "short.npz"
    path.write_bytes(data[: left if isinstance(left, int) else int(left * len(data))])
    with refused(ResultError, file=str(path)):
        Result.load(path)


@given(st.data())
@settings(max_examples=60)
def test_a_file_with_flipped_bytes_is_refused_or_harmless(saved, result, tmp_path_factory, data):
    content = bytearray(saved.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    path = tmp_path_factory.getbasetemp() / "flipped.npz"
    path.write_bytes(content)
    try:
        assert Result.load(path) == result
    except ResultError as error:
        assert error.file == str(path)


@pytest.mark.parametrize("name", [*LAYOUT, "info"])
def test_a_file_without_one_of_its_arrays_is_refused(content, tmp_path, name):
    del content[name]
    with refused(ResultError) as caught:
        Result.load(write(tmp_path / "lacks.npz", content))
    assert (caught.value.subject, caught.value.found) in ((f"array '{name}'", None), ("arrays", name))


@pytest.mark.parametrize("name", ["x", "theta_hat", "info"])
def test_a_pickle_in_the_file_is_not_opened(content, tmp_path, name):
    class Trap:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "sprung",))

    content[name] = np.array([Trap()], dtype=object)
    with pytest.raises(ResultError):
        Result.load(write(tmp_path / "trap.npz", content, allow_pickle=True))
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize(
    "spoil",
    [
        lambda c: c.update(x=c["x"][:-1]),
        lambda c: c.update(x=c["x"][..., None]),
        lambda c: c.update(t=c["t"][:, None]),
        lambda c: c.update(t=np.array(1.0)),
        lambda c: c.update(tau=c["tau"].astype(np.float32)),
        lambda c: c.update(tau=c["tau"].astype(complex)),
        lambda c: c.update(q=c["q"].astype(str)),
        lambda c: c.update(theta_hat=np.zeros((21, 2, 3))),
        lambda c: change_info(c, sizes="leave out"),
        lambda c: change_info(c, sizes=[1, 2]),
        lambda c: change_info(c, sizes={"robot": 2}),
        lambda c: change_info(c, sizes={"robot": "two"}),
        lambda c: change_info(c, robots="leave out"),
        lambda c: change_info(c, robots=5),
        lambda c: change_info(c, robots=["robot 1", "robot 2"]),
        lambda c: change_info(c, title=7),
        lambda c: change_info(c, status=None),
        lambda c: change_info(c, task_unit=["m"]),
        lambda c: change_info(c, format="synctrl result 0"),
        lambda c: change_info(c, format="leave out"),
        lambda c: c.update(info=np.array("[1, 2")),
        lambda c: c.update(info=np.array("[1, 2]")),
        lambda c: c.update(info=np.array("null")),
        lambda c: c.update(info=np.array("")),
        lambda c: c.update(info=np.zeros(3)),
        lambda c: c.update(info=np.array("[" * 100_000)),
    ],
)
def test_content_that_does_not_fit_together_is_refused(content, tmp_path, spoil):
    spoil(content)
    with refused(ResultError, file=str(tmp_path / "spoilt.npz")):
        Result.load(write(tmp_path / "spoilt.npz", content))


def test_other_kinds_of_files_are_refused(tmp_path):
    np.save(tmp_path / "array.npy", np.zeros(3))
    (tmp_path / "text.npz").write_text("hello")
    (tmp_path / "pickle.npz").write_bytes(b"\x80\x04K\x01.")
    with zipfile.ZipFile(tmp_path / "other.npz", "w") as archive:
        archive.writestr("x.npy", b"not an array")
    (tmp_path / "empty.npz").touch()
    for name in ("array.npy", "text.npz", "pickle.npz", "other.npz", "empty.npz"):
        with refused(ResultError, file=str(tmp_path / name)):
            Result.load(tmp_path / name)


def test_a_file_that_would_swell_in_memory_is_refused(content, tmp_path):
    content["theta_hat"] = np.zeros((20_000, 2, 20))
    np.savez_compressed(tmp_path / "bomb.npz", **content)
    assert (tmp_path / "bomb.npz").stat().st_size < 0.01 * content["theta_hat"].nbytes
    with refused(ResultError, None, file=str(tmp_path / "bomb.npz")):
        Result.load(tmp_path / "bomb.npz")


def test_an_array_that_claims_more_numbers_than_there_are_is_refused(saved, tmp_path):
    path = tmp_path / "claims.npz"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**15,)})
    with zipfile.ZipFile(saved) as good, zipfile.ZipFile(path, "w") as bad:
        for entry in good.namelist():
            bad.writestr(entry, header.getvalue() if entry == "t.npy" else good.read(entry))
    with refused(ResultError, "'t.npy'", file=str(path)):
        Result.load(path)


def test_an_encrypted_file_is_refused(saved, tmp_path):
    data = bytearray(saved.read_bytes())
    central = data.index(b"PK\x01\x02")
    data[central + 8] |= 1
    data[6] |= 1
    (tmp_path / "secret.npz").write_bytes(data)
    with refused(ResultError, file=str(tmp_path / "secret.npz")):
        Result.load(tmp_path / "secret.npz")
