"""Files are whole: readers see one version, writers do not disturb each other, failures leave nothing."""

from __future__ import annotations

import ast
import errno
import os
from functools import partial
from pathlib import Path

import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused
from writers import at_once, read_often, save_often, versions, write_often

from synctrl import Result, simulate
from synctrl.errors import InputError, ResultError
from synctrl.files import whole_file, write_whole
from synctrl.paper.report import write_page
from synctrl.robots.documents import planar_arm, write_urdf
from synctrl.show.plots import save, tracking_errors
from synctrl.show.scene import Scene

PACKAGE = Path(__file__).resolve().parent.parent / "synctrl"


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


# -- one writer -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("content", ["", "text\r\nand more\nα", b"\x00\xff" * 100_000])
def test_what_is_written_is_read_and_nothing_else_is_left(tmp_path, content):
    path = tmp_path / "deep" / "er" / "file"
    write_whole(path, content)
    assert path.read_bytes() == (content.encode() if isinstance(content, str) else content)
    assert names(path.parent) == ["file"]


def test_until_all_is_written_the_former_version_is_there(tmp_path):
    path = tmp_path / "file"
    write_whole(path, "old")
    with whole_file(path) as file:
        file.write(b"new")
        file.flush()
        assert path.read_text() == "old"
    assert path.read_text() == "new"


@pytest.mark.parametrize("kind", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_a_failure_while_writing_leaves_the_former_version_and_nothing_else(tmp_path, kind):
    path = tmp_path / "file"
    write_whole(path, "old")
    with pytest.raises(kind), whole_file(path) as file:
        file.write(b"half of it")
        raise kind
    assert path.read_text() == "old" and names(tmp_path) == ["file"]


@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_permissions_are_those_of_new_files(tmp_path, umask):
    before = os.umask(umask)
    try:
        write_whole(tmp_path / "file", "content")
    finally:
        os.umask(before)
    assert (tmp_path / "file").stat().st_mode & 0o777 == 0o666 & ~umask


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "there" / "file")
    write_whole(tmp_path / "link", "content")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "there" / "file").read_text() == "content"


def test_devices_folders_and_names_that_are_none_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for path in (tmp_path / "pipe", tmp_path / "folder", "/dev/null", "a\0b", "\ud800", "x" * 5000):
        with pytest.raises(OSError) as caught:
            write_whole(path, "content")
        assert caught.value.strerror
    with pytest.raises(OSError) as caught:
        write_whole(tmp_path / "file", "half a pair: \ud800")
    assert caught.value.errno == errno.EILSEQ
    assert names(tmp_path) == ["folder", "pipe"]


def test_names_may_be_as_long_as_the_system_lets_them(tmp_path):
    write_whole(tmp_path / ("x" * 255), "content")
    assert names(tmp_path) == ["x" * 255]


# -- who writes -------------------------------------------------------------------------------------------


def write_calls(path: Path) -> list[str]:
    """Calls in a module that write a file by themselves."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute) and node.attr in {"write_text", "write_bytes", "touch", "savetxt"}:
            found.append(f"{path.relative_to(PACKAGE)}:{node.lineno}: {node.attr}")
    return found


#: the cache of compiled code fills folders that have no name yet; a sweep adds lines to a file it has locked
EXCEPTIONS = {"compiled/build.py", "compiled/compiler.py", "sweep/journal.py"}


def test_the_package_writes_files_in_one_way():
    modules = [path for path in PACKAGE.rglob("*.py") if str(path.relative_to(PACKAGE)) not in EXCEPTIONS]
    assert len(modules) > 50
    assert [call for path in modules for call in write_calls(path)] == []


@pytest.fixture(scope="module")
def run():
    return simulate(small_cell(), SMALL_GAINS, 0.02, dt=5e-3)


def writers(run):
    """All that writes a file, as functions of a path, with the error of each."""
    from synctrl.analysis.metrics import write_metrics

    return [
        (run.save, ResultError),
        (lambda path: write_page(path, "page", []), ResultError),
        (lambda path: write_metrics(path, {}, []), ResultError),
        (lambda path: save(tracking_errors(run), path), ResultError),
        (lambda path: Scene().write(path), InputError),
        (lambda path: write_urdf(planar_arm([1.0], [1.0]), path), InputError),
    ]


@pytest.mark.parametrize("k", range(6))
def test_a_place_where_nothing_can_be_written_is_an_error_of_the_toolkit(run, tmp_path, k):
    write, kind = writers(run)[k]
    (tmp_path / "file").write_text("in the way")
    for place in (tmp_path / "file" / "in" / "it", tmp_path / "a\0b", tmp_path / "half \ud800"):
        with pytest.raises(kind):
            write(place)
    assert names(tmp_path) == ["file"]


@pytest.mark.parametrize("k", range(6))
def test_a_disk_that_fails_leaves_the_former_file_whole(run, tmp_path, monkeypatch, k):
    write, kind = writers(run)[k]
    write(tmp_path / "file")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def full(descriptor):
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with refused(kind, found="no space left on device"):
        write(tmp_path / "file")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


# -- several at a time ------------------------------------------------------------------------------------


def test_three_processes_write_one_path_and_readers_find_whole_versions(tmp_path):
    path, contents = tmp_path / "file", versions(200_000)
    write_whole(path, contents[0])
    writing = [partial(write_often, path, content, 40) for content in contents]
    assert at_once(*writing, partial(read_often, path, Path.read_bytes, contents, 400)) == []
    assert names(tmp_path) == ["file"]


def test_three_processes_save_results_to_one_path_and_readers_load_one_of_them(tmp_path, run):
    path, runs = tmp_path / "run.npz", [run, run.decimated(2), run.decimated(3)]
    run.save(path)
    saving = [partial(save_often, path, each, 40) for each in runs]
    assert at_once(*saving, partial(read_often, path, Result.load, runs, 100)) == []
    assert names(tmp_path) == ["run.npz"]
