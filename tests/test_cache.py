"""The cache of compiled code runs what this user has put there and nothing else, and says what is wrong."""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import signal
import socket
import stat
import subprocess
import sys
import tempfile
from pathlib import Path
from time import monotonic

import pytest
import test_imports
from refusals import refused

from synctrl.compiled import build, cache, compiler
from synctrl.errors import CompilationError, InputError, MissingDependencyError

SOURCE = "int answer(void) { return 42; }"
OTHER = 12345

as_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files to other users")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The cache's folder, which does not exist yet."""
    path = tmp_path / "cache"
    monkeypatch.setenv("SYNCTRL_CACHE", str(path))
    monkeypatch.setattr(build, "_CHECKED", {})
    return path


def fetch(key: str = "key", source: str = SOURCE, check=lambda library: None) -> ctypes.CDLL:
    """A small library from the cache, or built."""
    return build.cached_library(key, lambda: iter([source]), check)


def forget(monkeypatch) -> None:
    """As another process would see the cache."""
    monkeypatch.setattr(build, "_CHECKED", {})


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def plant(folder: Path, marker: Path, key: str = "key") -> None:
    """A library, with a digest that fits, that writes a file as soon as it is loaded."""
    folder.mkdir(parents=True, exist_ok=True)
    source = folder / "planted.c"
    source.write_text(
        "#include <stdio.h>\n__attribute__((constructor)) static void run(void) "
        f'{{ FILE *f = fopen("{marker}", "w"); if (f) fclose(f); }}\nint answer(void) {{ return 13; }}'
    )
    library = folder / f"{key}.so"
    subprocess.run(["cc", "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
    source.unlink()
    seal(folder, key)


def seal(folder: Path, key: str = "key") -> None:
    """Write the digest that fits."""
    content = (folder / f"{key}.so").read_bytes()
    (folder / f"{key}.sha256").write_text(build._digest(key, content))
    for suffix in (".so", ".sha256"):
        (folder / f"{key}{suffix}").chmod(0o600)


# -- whose it is ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("umask", [0o000, 0o002, 0o022, 0o077])
def test_the_folder_and_what_is_in_it_are_for_this_user_alone(folder, umask):
    deep = folder / "a" / "b"
    os.environ["SYNCTRL_CACHE"] = str(deep)
    before = os.umask(umask)
    try:
        assert fetch().answer() == 42
    finally:
        os.umask(before)
    assert {mode(path) for path in (folder, deep.parent, deep)} == {0o700}
    assert {path.name: mode(path) for path in deep.iterdir()} == {"key.so": 0o600, "key.sha256": 0o600}


@pytest.mark.parametrize("bits", [0o777, 0o1777, 0o770, 0o720, 0o702, 0o1702])
def test_a_folder_that_others_may_write_is_refused_and_nothing_in_it_is_run(folder, tmp_path, bits):
    plant(folder, tmp_path / "ran")
    folder.chmod(bits)
    with refused(CompilationError, file=str(folder), found="can be written by others") as caught:
        fetch()
    said = str(caught.value)
    assert f"mode {bits:04o}" in said
    assert "chmod go-w" in said
    assert "SYNCTRL_CACHE" in said
    assert not (tmp_path / "ran").exists()


def test_what_this_user_has_put_there_is_run(folder, tmp_path):
    """Without this the tests around it would show nothing."""
    plant(folder, tmp_path / "ran")
    assert fetch().answer() == 13
    assert (tmp_path / "ran").exists()


@pytest.mark.parametrize("name", ["key.so", "key.sha256"])
@pytest.mark.parametrize("bits", [0o666, 0o620, 0o602])
def test_a_file_that_others_may_write_is_refused(folder, tmp_path, name, bits):
    plant(folder, tmp_path / "ran")
    (folder / name).chmod(bits)
    with refused(CompilationError, file=str(folder / name), found="can be written by others"):
        fetch()
    assert not (tmp_path / "ran").exists()


@as_root
@pytest.mark.parametrize("name", ["", "key.so", "key.sha256"])
def test_what_belongs_to_another_user_is_refused(folder, tmp_path, name):
    plant(folder, tmp_path / "ran")
    os.chown(folder / name, OTHER, OTHER)
    with refused(CompilationError, file=str(folder / name), found="belongs to another user"):
        fetch()
    assert not (tmp_path / "ran").exists()


@as_root
def test_what_belongs_to_the_administrator_is_taken(folder, tmp_path, monkeypatch):
    """A machine may come with a filled cache."""
    plant(folder, tmp_path / "ran")
    monkeypatch.setattr(os, "geteuid", lambda: OTHER)
    assert fetch().answer() == 13


def test_a_folder_that_others_could_exchange_is_refused(folder):
    folder.mkdir()
    folder.chmod(0o777)
    os.environ["SYNCTRL_CACHE"] = str(folder / "own")
    with refused(CompilationError, file=str(folder), found="can be written by others"):
        fetch()
    folder.chmod(0o1777)  # as /tmp: there nobody can rename what belongs to others
    assert fetch().answer() == 42


@as_root
def test_a_folder_in_that_of_another_user_is_refused(folder):
    folder.mkdir()
    os.chown(folder, OTHER, OTHER)
    os.environ["SYNCTRL_CACHE"] = str(folder / "own")
    with refused(CompilationError, file=str(folder), found="belongs to another user"):
        fetch()


def test_a_link_of_this_user_may_lead_to_the_folder(folder, tmp_path):
    (tmp_path / "far").mkdir(mode=0o700)
    folder.symlink_to("far")
    assert fetch().answer() == 42
    assert (tmp_path / "far" / "key.so").exists()


@as_root
def test_a_link_of_another_user_is_refused(folder, tmp_path):
    (tmp_path / "far").mkdir(mode=0o700)
    folder.symlink_to("far")
    os.chown(folder, OTHER, OTHER, follow_symlinks=False)
    with refused(CompilationError, file=str(folder), found="belongs to another user"):
        fetch()


def test_a_link_into_a_folder_that_others_may_write_is_refused(folder, tmp_path):
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    (tmp_path / "open" / "far").mkdir(mode=0o700)
    folder.symlink_to(tmp_path / "open" / "far")
    with refused(CompilationError, file=str(tmp_path / "open"), found="can be written by others"):
        fetch()


def test_links_that_lead_to_each_other_are_refused(folder, tmp_path):
    folder.symlink_to(tmp_path / "back")
    (tmp_path / "back").symlink_to(folder)
    with refused(CompilationError, file=str(folder), found=os.strerror(errno.ELOOP)):
        fetch()


# -- no plain files ---------------------------------------------------------------------------------------


def a_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as opened, pytest.MonkeyPatch.context() as patch:
        patch.chdir(path.parent)  # the names of sockets are short
        opened.bind(path.name)


STRANGE = {
    "a FIFO": os.mkfifo,
    "a folder": os.mkdir,
    "a socket": a_socket,
    "a link": lambda path: path.symlink_to("/etc/passwd"),
}


@pytest.mark.parametrize("kind", STRANGE)
@pytest.mark.parametrize("name", ["key.so", "key.sha256"])
def test_what_is_no_plain_file_is_refused_and_not_waited_for(folder, name, kind):
    fetch()
    (folder / name).unlink()
    STRANGE[kind](folder / name)
    with refused(CompilationError, file=str(folder / name), found=f"is {kind}, expected a plain file"):
        fetch()


def test_a_link_to_a_good_library_is_refused(folder, tmp_path):
    fetch()
    (folder / "key.so").rename(tmp_path / "elsewhere.so")
    (folder / "key.so").symlink_to(tmp_path / "elsewhere.so")
    with refused(CompilationError, file=str(folder / "key.so"), found="is a link, expected a plain file"):
        fetch()


# -- damage -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.0, 0.001, 0.1, 0.5, 0.9, 0.999])
def test_a_library_cut_short_under_a_digest_that_fits_is_built_again(folder, monkeypatch, share):
    fetch()
    library = folder / "key.so"
    whole = library.read_bytes()
    library.write_bytes(whole[: int(share * len(whole))])
    seal(folder)
    forget(monkeypatch)
    assert fetch().answer() == 42
    assert len(library.read_bytes()) == len(whole)


def test_no_part_of_a_library_counts_as_a_whole_one(folder):
    fetch()
    whole = (folder / "key.so").read_bytes()
    assert build.is_whole(whole)
    assert not any(build.is_whole(whole[:k]) for k in range(len(whole)))


def test_headers_of_any_content_are_judged_without_an_error():
    for wide in (1, 2, 3):
        for order in (1, 2, 3):
            for filler in (b"\x00", b"\x01", b"\xff"):
                content = b"\x7fELF" + bytes([wide, order]) + filler * 200
                assert build.is_whole(content) in (False, True)


@pytest.mark.parametrize("content", [b"", b"nonsense", b"\xff" * 64, b"0" * 1000])
def test_a_digest_that_does_not_fit_is_damage(folder, monkeypatch, content):
    fetch()
    (folder / "key.sha256").write_bytes(content)
    forget(monkeypatch)
    assert fetch().answer() == 42
    assert len((folder / "key.sha256").read_bytes()) == 64


def test_a_library_under_the_key_of_another_one_is_damage(folder, monkeypatch):
    fetch("key")
    fetch("other", "int answer(void) { return 7; }")
    for suffix in (".so", ".sha256"):
        shutil.copy(folder / f"other{suffix}", folder / f"key{suffix}")
    forget(monkeypatch)
    assert fetch("key").answer() == 42


def test_text_that_has_a_fitting_digest_is_built_again(folder, monkeypatch):
    fetch()
    (folder / "key.so").write_text("no library")
    seal(folder)
    forget(monkeypatch)
    assert fetch().answer() == 42


def test_what_happens_to_the_file_later_does_not_reach_a_process_that_has_loaded_it(folder):
    library = fetch()
    os.truncate(folder / "key.so", 0)
    assert library.answer() == 42
    assert fetch().answer() == 42


# -- the check --------------------------------------------------------------------------------------------


def wrong(library: ctypes.CDLL) -> None:
    if library.answer() != 42:
        raise CompilationError("another answer", subject="answer")


def test_what_comes_from_the_cache_is_checked_and_built_again_if_it_fails(folder, tmp_path):
    plant(folder, tmp_path / "ran")
    assert fetch(check=wrong).answer() == 42
    assert fetch(check=wrong).answer() == 42


def test_code_that_fails_the_check_is_not_kept(folder):
    with refused(CompilationError, "answer"):
        fetch(source="int answer(void) { return 13; }", check=wrong)
    assert not list(folder.iterdir())


def test_a_library_is_checked_once_in_a_process(folder, monkeypatch):
    calls = []
    for _ in range(3):
        fetch(check=calls.append)
    assert len(calls) == 1
    forget(monkeypatch)
    for _ in range(3):
        fetch(check=calls.append)
    assert len(calls) == 2


# -- the compiler -----------------------------------------------------------------------------------------


def script(path: Path, text: str, bits: int = 0o755) -> Path:
    path.write_text(text)
    path.chmod(bits)
    return path


#: how a compiler begins that says its version, and that it knows all flags
ANSWERS = '#!/bin/sh\ncase "$*" in --version | *" -E "*) echo test; exit;; esac'


def as_compiler(tmp_path: Path, monkeypatch, body: str) -> None:
    """A compiler that answers questions, and for the rest does what the text says."""
    monkeypatch.setenv("CC", str(script(tmp_path / "compiler", f"{ANSWERS}\n{body}\n")))


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ("''", "'' is no name"),
        ("gcc 'half", '"gcc \'half" cannot be split into words'),
        ("no-such-compiler", "'no-such-compiler' was not found"),
        ("/no/such/compiler -O2", "'/no/such/compiler' was not found"),
        ("/usr", "'/usr' is a folder"),
        ("/etc/passwd", "'/etc/passwd' is not executable"),
    ],
)
def test_a_compiler_that_cannot_be_used_is_named(folder, monkeypatch, named, said):
    monkeypatch.setenv("CC", named)
    with refused(MissingDependencyError, "CC", found=said):
        fetch()


@pytest.mark.parametrize("named", ["", "   "])
def test_an_empty_name_is_none(folder, monkeypatch, named):
    monkeypatch.setenv("CC", named)
    assert fetch().answer() == 42


FAULTS = {
    "writes nothing": ("exit 0", "ended without an error, but wrote no 'part0.o'"),
    "writes an empty file": (
        ': > "$(eval echo \\${$#})"',
        "ended without an error, but wrote no 'part0.o'",
    ),
    "writes junk": ('echo junk > "$(eval echo \\${$#})"', "wrote what cannot be loaded as a library"),
    "links nothing": (
        'case "$*" in *-shared*) ;; *) cc "$@";; esac',
        "ended without an error, but wrote no 'library.so'",
    ),
    "refuses": ("echo no such flag >&2; exit 3", "refused generated code"),
    "refuses without a word": ("exit 3", "refused generated code"),
    "prints bytes that are no text": ("printf '\\377\\376'; exit 3", "refused generated code"),
    "prints without end": ("exec yes", "printed without end and was stopped"),
    "dies": ("kill -9 $$", "was ended by signal 9"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_compiler_that_does_not_compile_is_told_from_other_faults(folder, tmp_path, monkeypatch, name):
    body, said = FAULTS[name]
    as_compiler(tmp_path, monkeypatch, body)
    with refused(CompilationError, "C compiler", found=said):
        fetch()
    assert not list(folder.iterdir())


def test_what_a_compiler_has_printed_is_told(folder, tmp_path, monkeypatch):
    as_compiler(tmp_path, monkeypatch, "echo no such flag >&2; exit 3")
    with refused(CompilationError, "C compiler", found="refused generated code") as caught:
        fetch()
    assert caught.value.problem.endswith("no such flag")  # the compiler's own words


def test_a_file_that_is_no_program_is_said(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", str(script(tmp_path / "compiler", "\x00\x01\x02")))
    with refused(CompilationError, "C compiler", found="cannot be run"):
        build.content_key("code")


def gone(pid: int) -> bool:
    """Whether a process has ended, or is about to be forgotten."""
    try:
        return "\nState:\tZ" in Path(f"/proc/{pid}/status").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return True


def wait_until_gone(pid: int) -> None:
    """A kill is on its way; only a test that fails waits to the end."""
    deadline = monotonic() + 30
    while not gone(pid):
        assert monotonic() < deadline, f"process {pid} still runs"
        os.sched_yield()


HANGS = {
    "itself": 'echo $$ > "{pid}"; exec sleep 1000',
    "with a child": 'sleep 1000 & echo $! > "{pid}"; wait',
    "with a child that ignores signals": '(trap "" TERM HUP INT; sleep 1000) & echo $! > "{pid}"; wait',
}


@pytest.mark.parametrize("name", HANGS)
def test_a_compiler_that_hangs_is_stopped_with_its_children(folder, tmp_path, monkeypatch, name):
    as_compiler(tmp_path, monkeypatch, HANGS[name].format(pid=tmp_path / "pid"))
    monkeypatch.setattr(compiler, "LONGEST", 0.5)
    with refused(CompilationError, "C compiler", found="did not end within 0.5 s and was stopped"):
        fetch()
    wait_until_gone(int((tmp_path / "pid").read_text()))
    assert not list(folder.iterdir())


def test_a_child_that_a_compiler_leaves_behind_is_ended_and_not_waited_for(folder, tmp_path, monkeypatch):
    as_compiler(tmp_path, monkeypatch, f'sleep 1000 & echo $! > "{tmp_path / "pid"}"; cc "$@"')
    assert fetch().answer() == 42
    wait_until_gone(int((tmp_path / "pid").read_text()))


def test_a_compiler_that_does_not_say_its_version_is_stopped(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", str(script(tmp_path / "compiler", "#!/bin/sh\nexec sleep 1000\n")))
    monkeypatch.setattr(compiler, "LONGEST_VERSION", 0.2)
    with refused(CompilationError, "C compiler", found="did not end within 0.2 s and was stopped"):
        build.content_key("code")


def test_an_interrupt_ends_the_compilers(folder, tmp_path, monkeypatch):
    started = tmp_path / "pid"
    os.mkfifo(started)
    as_compiler(tmp_path, monkeypatch, f'echo $$ > "{started}"; exec sleep 1000')
    pids = []

    def write():
        yield SOURCE
        pids.append(int(started.read_text()))
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build.cached_library("key", write, lambda library: None)
    wait_until_gone(pids[0])
    assert not list(folder.iterdir())


# -- what killed builds have left -------------------------------------------------------------------------


def test_folders_of_builds_that_were_killed_are_removed_by_the_next_build(folder, tmp_path, monkeypatch):
    started = tmp_path / "started"
    os.mkfifo(started)
    text = f'{ANSWERS}\necho $$ > "{started}"; exec sleep 1000\n'
    code = "from synctrl.compiled import build\nbuild.cached_library('key', lambda: iter(['int a;']), print)"
    environment = {**os.environ, "CC": str(script(tmp_path / "compiler", text))}
    process = subprocess.Popen([sys.executable, "-c", code], env=environment)
    orphan = int(started.read_text())
    process.kill()
    process.wait()
    (left,) = folder.glob("building-*")
    fetch()
    assert not left.exists()
    os.kill(orphan, signal.SIGKILL)


def test_folders_in_which_somebody_builds_stay(folder):
    folder.mkdir(mode=0o700)
    with cache.building_folder(folder) as used:
        (used / "part").write_text("half")
        assert fetch().answer() == 42
        assert (used / "part").read_text() == "half"
    assert not used.exists()


def test_only_folders_are_removed(folder, tmp_path):
    folder.mkdir(mode=0o700)
    (tmp_path / "precious").mkdir()
    (tmp_path / "precious" / "file").write_text("mine")
    (folder / "building-link").symlink_to(tmp_path / "precious")
    (folder / "building-file").write_text("mine")
    fetch()
    assert [path.name for path in (tmp_path / "precious").iterdir()] == ["file"]
    assert (folder / "building-file").exists()


def test_a_folder_that_was_taken_for_a_leftover_is_made_again(folder, monkeypatch):
    folder.mkdir(mode=0o700)
    make, made = tempfile.mkdtemp, []

    def robbed(**options):
        made.append(make(**options))
        if len(made) == 1:
            cache.remove_leftovers(folder)
        return made[-1]

    monkeypatch.setattr(tempfile, "mkdtemp", robbed)
    with cache.building_folder(folder) as used:
        assert used.is_dir()
    assert len(made) == 2


# -- where it is ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("named", [".", "here", "./a/../here", "~/x", "~"])
def test_the_folder_may_be_named_in_any_way(tmp_path, monkeypatch, named):
    monkeypatch.setattr(build, "_CHECKED", {})
    monkeypatch.chdir(tmp_path)
    (tmp_path / "home").mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("SYNCTRL_CACHE", named)
    assert fetch().answer() == 42
    where = named.replace("~", str(tmp_path / "home"))
    assert sorted(path.name for path in Path(where).glob("key.*")) == ["key.sha256", "key.so"]
    forget(monkeypatch)
    assert fetch(source="not C").answer() == 42


def test_a_home_that_is_not_known_is_said(monkeypatch):
    monkeypatch.setenv("SYNCTRL_CACHE", "~no-such-user-here/x")
    with refused(InputError, "SYNCTRL_CACHE"):
        fetch()


def test_a_file_in_the_place_of_the_folder_is_said(folder):
    folder.write_text("a file")
    with refused(CompilationError, file=str(folder), found=os.strerror(errno.ENOTDIR)):
        fetch()
    os.environ["SYNCTRL_CACHE"] = str(folder / "below")
    with refused(CompilationError, found=os.strerror(errno.ENOTDIR)):
        fetch()


def test_a_name_that_is_too_long_is_said(folder):
    os.environ["SYNCTRL_CACHE"] = str(folder / ("x" * 300))
    with refused(CompilationError, found=os.strerror(errno.ENAMETOOLONG)):
        fetch()


def test_a_working_folder_that_was_removed_is_said(tmp_path, monkeypatch):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    monkeypatch.setenv("SYNCTRL_CACHE", "here")
    with refused(CompilationError, "SYNCTRL_CACHE"):
        fetch()


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """A folder for temporary files of this test's own, and no folder named for the cache."""
    place = tmp_path / "temporary"
    place.mkdir(mode=0o700)
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    monkeypatch.delenv("SYNCTRL_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(build, "_CHECKED", {})
    return place


@pytest.mark.parametrize("home", [None, "/no/such/home", "/"])
def test_without_a_home_the_folder_is_a_private_one_among_the_temporary_files(temporary, monkeypatch, home):
    def unknown():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", unknown if home is None else lambda: Path(home))
    assert fetch().answer() == 42
    (made,) = temporary.iterdir()
    assert made.name == f"synctrl-{os.geteuid()}"
    assert mode(made) == 0o700
    assert (made / "key.so").exists()


@as_root
def test_a_private_folder_that_somebody_else_has_made_is_refused(temporary, monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: Path("/"))
    temporary.chmod(0o1777)
    (temporary / f"synctrl-{os.geteuid()}").mkdir()
    os.chown(temporary / f"synctrl-{os.geteuid()}", OTHER, OTHER)
    with refused(CompilationError, found="belongs to another user"):
        fetch()


@pytest.mark.parametrize("named", ["", "relative"])
def test_a_cache_home_that_is_no_full_path_does_not_count(temporary, tmp_path, monkeypatch, named):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", named)
    if sys.platform != "darwin":
        assert cache.cache_folder() == tmp_path / ".cache" / "synctrl"


def test_a_cache_home_is_followed_where_there_is_no_other(temporary, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "caches"))
    if sys.platform != "darwin":
        assert cache.cache_folder() == tmp_path / "caches" / "synctrl"


# -- where nothing may be executed ------------------------------------------------------------------------


@pytest.fixture
def noexec(tmp_path):
    """A folder on a file system where nothing may be executed."""
    place = tmp_path / "noexec"
    place.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "noexec,mode=0700", "tmpfs", str(place)], capture_output=True
    )
    if mounted.returncode != 0:
        pytest.skip("this user may not mount file systems")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_cache_where_nothing_may_be_executed_works_by_way_of_the_temporary_files(
    temporary, noexec, monkeypatch
):
    monkeypatch.setenv("SYNCTRL_CACHE", str(noexec))
    assert fetch().answer() == 42
    assert sorted(path.name for path in noexec.iterdir()) == ["key.sha256", "key.so"]
    assert not list(temporary.iterdir())
    forget(monkeypatch)
    assert fetch(source="not C").answer() == 42


def test_where_nothing_may_be_executed_at_all_is_said(temporary, noexec, monkeypatch):
    monkeypatch.setenv("SYNCTRL_CACHE", str(noexec))
    monkeypatch.setattr(tempfile, "tempdir", str(noexec))
    with refused(CompilationError, file=str(noexec), found="noexec"):
        fetch()


def test_what_the_system_says_of_places_is_believed(temporary, folder, monkeypatch):
    """The same without a mount, for users who may not."""
    monkeypatch.setattr(cache, "_is_executable", lambda place: place != folder)
    assert fetch().answer() == 42
    forget(monkeypatch)
    monkeypatch.setattr(cache, "_is_executable", lambda place: False)
    with refused(CompilationError, file=str(folder), found="noexec"):
        fetch()


def test_a_full_disk_is_said(folder, monkeypatch):
    def full(*arguments, **options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "replace", full)
    with refused(CompilationError, file=str(folder), found=os.strerror(errno.ENOSPC)):
        fetch()
    assert not list(folder.iterdir())


# -- the key ----------------------------------------------------------------------------------------------


def modules_behind(start: str) -> set[str]:
    """A module and all of the package that it imports, directly or by way of others."""
    arrows: dict[str, set[str]] = {}
    for module, target, _ in test_imports.arrows(test_imports.PACKAGE):
        arrows.setdefault(module, set()).add(target)
    found, ahead = set(), [start]
    while ahead:
        module = ahead.pop()
        if module not in found:
            found.add(module)
            ahead += arrows.get(module, ())
    return found


def test_the_key_covers_every_module_behind_generated_code():
    behind = modules_behind("synctrl.compiled.program")
    assert {"synctrl.control.law", "synctrl.robots.mechanism", "synctrl.tasks.rotations"} <= behind
    rooms = {test_imports.room(module) for module in behind} - {"", "errors", "renamed", "checks", "files"}
    assert rooms == set(build.ROOMS)


@pytest.mark.parametrize(
    "name",
    [
        *("control/law.py", "control/laws/sun_mills.py", "robots/mechanism.py", "tasks/rotations.py"),
        *("simulation/plant.py", "compiled/quantities.py", "compiled/driver.c"),
    ],
)
def test_another_source_gives_another_key(tmp_path, name):
    package = tmp_path / "synctrl"
    shutil.copytree(test_imports.PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    before = build.digest_of_sources.__wrapped__(package)
    assert before == build.digest_of_sources()
    with open(package / name, "a") as file:
        file.write("\n")
    assert build.digest_of_sources.__wrapped__(package) != before


def test_another_compiler_gives_another_key(tmp_path, monkeypatch):
    keys = {build.content_key("code")}
    for version in "12":
        path = script(tmp_path / f"compiler{version}", f"#!/bin/sh\necho {version}\n")
        monkeypatch.setenv("CC", str(path))
        keys.add(build.content_key("code"))
    assert len(keys) == 3
